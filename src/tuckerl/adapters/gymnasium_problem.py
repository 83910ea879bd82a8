"""Gymnasium environments that Python steps: the compiled loops call them back at every step.

A kernel hands an action to Python and gets one number back: the next state, shifted, and two bits that say whether the
episode ended and how. So a step costs a fraction of a microsecond on top of the environment's own time, and every
learner plays every environment.
"""

from array import array
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np
from gymnasium.spaces import Tuple

from tuckerl._jit import call_python, kernel, python_callback
from tuckerl.adapters.joint import JointEnv
from tuckerl.adapters.making import GymEnvironment
from tuckerl.adapters.masks import MASK, MASK_IS_LATE, MaskReader
from tuckerl.adapters.python_problem import AgentSpaces, PythonProblem
from tuckerl.adapters.python_world import FAULT, REWARD_IS_NOT_FINITE, YIELD, PythonWorld, must_return
from tuckerl.adapters.step_results import ENDS, ends_of
from tuckerl.adapters.team import Team
from tuckerl.checks import shown
from tuckerl.errors import ParameterError, ProblemError
from tuckerl.interrupts import is_impatient, may_raise_interrupts
from tuckerl.problems.dynamics import TERMINATED, TRUNCATED, register_dynamics
from tuckerl.problems.parts import NO_LIMIT, StateFactor
from tuckerl.problems.problem import Choose
from tuckerl.spaces.description import Description
from tuckerl.spaces.encoder import SpaceEncoder, digit_names, space_encoder
from tuckerl.types import BoolArray, FloatArray, IntArray, Stream

Maker = Callable[[], GymEnvironment]

BEGIN_EPISODE = -1
"""What a callback gets instead of an action."""
STATE_SHIFT = 2
"""How many bits of a callback's answer lie below the state: TERMINATED and TRUNCATED."""

_FEW_ACTIONS = 100_000  # decoded once and kept


class GymnasiumArrays(NamedTuple):
    """What kernels read of an environment that Python steps."""

    call: int  # the address of a callback: an action in, a state and how the episode ended out
    reward: FloatArray  # (1,) of the latest step
    truncated: BoolArray  # (1,) whether the environment ended the episode by itself without an end of the return
    status: IntArray  # (1,) 0, or below 0 where the kernel must return
    clock: FloatArray  # (1,) steps in this episode
    n_states: int
    max_episode_steps: int


@kernel
def _reset(world: GymnasiumArrays, rng: Stream) -> int:
    """Return the first state of an episode.

    Parameters
    ----------
    world : GymnasiumArrays
        Its status and clock are changed.
    rng : (4,) uint64
        The agent's stream; the environment draws from its own.
    """
    world.clock[0] = 0.0
    return _state_of(world, call_python(world.call, BEGIN_EPISODE))


@kernel
def _step(world: GymnasiumArrays, state: int, action: int, rng: Stream) -> tuple[int, float, bool]:
    """Return the next state, the reward, and whether the return ends there.

    Parameters
    ----------
    world : GymnasiumArrays
        Its status, clock and truncated are changed.
    state, action : int
    rng : (4,) uint64
        The agent's stream; the environment draws from its own.
    """
    world.clock[0] += 1.0
    answer = call_python(world.call, action)
    state, reward = _state_of(world, answer), world.reward[0]
    if world.status[0] == 0 and reward - reward != 0.0:  # 0 for a finite number, NaN for any other
        world.status[0] = REWARD_IS_NOT_FINITE
    world.truncated[0] = answer & TRUNCATED > 0
    return state, reward, answer & TERMINATED > 0


@kernel
def _state_of(world: GymnasiumArrays, answer: int) -> int:
    """Return the state in a callback's answer; 0 if that is an error's number, or what an uncaught error left there."""
    state = answer >> STATE_SHIFT
    if 0 <= state < world.n_states:
        world.status[0] = 0
        return state
    world.status[0] = YIELD if answer == YIELD else FAULT
    return 0


@kernel
def _is_out_of_time(world: GymnasiumArrays, steps: int) -> bool:
    """Return whether the environment or the time limit truncates the episode after so many steps."""
    return world.truncated[0] or steps >= world.max_episode_steps


register_dynamics(GymnasiumArrays, reset=_reset, step=_step, is_out_of_time=_is_out_of_time, must_return=must_return)


class GymnasiumProblem(PythonProblem):
    """A Gymnasium environment whose spaces are numbered.

    Parameters
    ----------
    env : gymnasium.Env
        The first agent plays this one.
    source : str
        What it is called in messages.
    make : callable, optional
        Makes one more; by default it is copied.
    bins
        How a Box is cut into bins; see :func:`tuckerl.spaces.encoder.space_encoder`. Of a :class:`~tuckerl.JointEnv`
        they may be a dict by agent, too.
    **parts
        ``max_episode_steps`` and ``heuristic``, see :class:`~tuckerl.adapters.python_problem.PythonProblem`.

    Attributes
    ----------
    agents : tuple
        Those of a :class:`~tuckerl.JointEnv`, whose observations and actions the joint ones are made of; none where
        wrappers have made something else of either.

    Raises
    ------
    SpaceError
        If a space cannot be numbered.
    ParameterError, ParameterTypeError
        If `bins` does not fit the space.
    ProblemError
        If the environment does not begin.
    """

    kind = "gymnasium"

    def __init__(
        self,
        env: GymEnvironment,
        source: str,
        make: Maker | None = None,
        *,
        bins: Any = None,
        **parts: Any,
    ) -> None:
        readers = _readers_of_team(env)
        if readers and isinstance(bins, Mapping):
            bins = _bins_in_order(bins, tuple(readers))
        spaces = AgentSpaces(env.observation_space, env.action_space, bins)
        self._team = Team(spaces, readers) if readers else None
        self.agents = () if self._team is None else self._team.agents
        self._team_reward = env.unwrapped.reward if isinstance(env.unwrapped, JointEnv) else None
        acted: Any = env.action_space if self.agents else (env.action_space,)
        super().__init__(
            env,
            source,
            make,
            [spaces],
            action_sizes=tuple(space_encoder(part, what="action").n for part in acted),
            layout=spaces.observations.layout,
            **parts,
        )

    @property
    def state_factors(self) -> tuple[StateFactor, ...]:
        """The digits of an observation's number, those of a joint one named by their agents."""
        named = zip(self.agents, self.spaces[0].observations.parts if self.agents else (), strict=True)
        digits = [pair for agent, part in named for pair in zip(digit_names(part, str(agent)), part.sizes, strict=True)]
        return tuple(StateFactor(*pair) for pair in digits) or super().state_factors

    def description(self) -> Description:
        """Return all that makes this environment the one that it is, but for its code, as JSON."""
        return super().description() | ({} if self._team_reward is None else {"team reward": str(self._team_reward)})

    def declared(self, env: Any) -> list[tuple[Any, Any]]:
        """Return the spaces of the environment, of which there is one pair."""
        return [(env.observation_space, env.action_space)]

    def world(self) -> "GymnasiumWorld":
        """Return a world of its own for one agent.

        Raises
        ------
        ProblemError
            If the environment cannot be copied.
        """
        return GymnasiumWorld(self, self.copies.take())

    def decide(self, observation: Any, choose: Choose, action_masks: Any = None) -> Any:
        """Return the action that is chosen for an observation, or those for a batch; see `Problem.decide`.

        Agents of a joint environment may give dicts by agent instead of tuples, and get one.

        Raises
        ------
        ObservationError
            If an observation is none of the environment's, or an agent's is missing.
        """
        if self._team is not None and isinstance(observation, Mapping):
            return self._team.decide(observation, choose, action_masks)
        return self.spaces[0].decide(observation, 0, choose, action_masks)


def _readers_of_team(env: GymEnvironment) -> dict[Any, MaskReader]:
    """Return a joint environment's readers by agent, as long as its wrappers leave a part of both spaces to each."""
    joint, spaces = env.unwrapped, (env.observation_space, env.action_space)
    if not isinstance(joint, JointEnv):
        return {}
    is_whole = all(isinstance(space, Tuple) and len(space) == len(joint.readers) for space in spaces)
    return joint.readers if is_whole else {}


def _bins_in_order(bins: Mapping[Any, Any], agents: tuple[Any, ...]) -> tuple[Any, ...]:
    """Return bins by agent as those of a tuple with a part for each, None for an agent that has none."""
    if not bins.keys() <= set(agents):
        known = ", ".join(map(str, agents))
        raise ParameterError(f"bins of a joint observation must be a dict by agent, of {known}; got {shown(bins)}")
    return tuple(bins.get(agent) for agent in agents)


class GymnasiumWorld(PythonWorld):
    """One agent's copy of an environment, and the callback by which kernels step it."""

    problem: GymnasiumProblem

    def __init__(self, problem: GymnasiumProblem, env: GymEnvironment) -> None:
        super().__init__(problem, env)
        self._reward = array("d", [0.0])
        self._callback, address = python_callback(self._caller())
        self.arrays = GymnasiumArrays(
            call=address,
            reward=np.frombuffer(self._reward),
            truncated=np.zeros(1, dtype=np.bool_),
            status=np.zeros(1, dtype=np.int64),
            clock=np.zeros(1),
            n_states=problem.n_states,
            max_episode_steps=problem.max_episode_steps or NO_LIMIT,
        )

    def _caller(self) -> Callable[[int], int]:
        """Return the callback, with all that it needs at hand."""
        step, reward_of, spaces, reads = self.env.step, self._reward, self.problem.spaces[0], self.problem.has_masks
        read, encode, n = spaces.read, spaces.observations.encode, spaces.actions.n
        few = n <= _FEW_ACTIONS
        actions: Any = [spaces.actions.decode(a) for a in range(n)] if few else _Decoded(spaces.actions)

        @may_raise_interrupts
        def call(action: int) -> int:
            result = None
            try:
                if action < 0:
                    return self._begin_episode()
                if is_impatient():
                    raise KeyboardInterrupt
                result = step(actions[action])
                observation, reward_of[0], terminated, truncated, info = result
                if reads:
                    observation, mask = read(observation, info)
                    state = encode(observation)
                    self.note_mask(0, state, mask)
                else:
                    if info and info.get(MASK) is not None:
                        raise ProblemError(MASK_IS_LATE)
                    state = encode(observation)
                try:
                    return state << STATE_SHIFT | ENDS[terminated, truncated]
                except (KeyError, TypeError):
                    return state << STATE_SHIFT | ends_of(terminated, truncated)
            except BaseException as error:  # noqa: BLE001  # raised again when the kernel has returned
                return self.fail(error, result)

        return call

    def _begin_episode(self) -> int:
        if self.is_late:
            return YIELD
        self.before_episode()
        observation, info = self.begin()
        self.arrays.truncated[0] = False
        state, mask = self.problem.spaces[0].encode(observation, info)
        self.note_mask(0, state, mask)
        return state << STATE_SHIFT


class _Decoded:
    """Actions that are too many to be kept in a list."""

    def __init__(self, actions: SpaceEncoder) -> None:
        self._actions = actions

    def __getitem__(self, action: int) -> Any:
        return self._actions.decode(action)
