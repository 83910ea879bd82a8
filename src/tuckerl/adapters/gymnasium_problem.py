"""Environments that Python steps: the same compiled kernels play them, through a callback.

A kernel hands an action to Python and gets one number back: the next state, shifted, and two bits that say whether the
episode ended and how. So a step costs a fraction of a microsecond on top of the environment's own time, and every
learner plays every environment.
"""

from array import array
from collections.abc import Callable
from typing import Any, NamedTuple

import gymnasium
import numpy as np

from tuckerl._jit import python_callback
from tuckerl.adapters.joint import JointEnv
from tuckerl.adapters.making import GymEnvironment
from tuckerl.adapters.masks import MASK, MASK_IS_LATE, MaskReader
from tuckerl.adapters.python_world import STEP_CAP, YIELD, Environments, PythonWorld
from tuckerl.errors import ProblemError
from tuckerl.interrupts import is_impatient
from tuckerl.problems.mdp import Layout
from tuckerl.spaces.encoder import SpaceEncoder, space_encoder, space_encoder_of_edges
from tuckerl.types import BoolArray, FloatArray, IntArray

Maker = Callable[[], GymEnvironment]

BEGIN_EPISODE = -1
"""What a callback gets instead of an action."""
STATE_SHIFT = 2
"""The bits of a callback's answer that lie below the state: TERMINATED and TRUNCATED."""

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


class Edges(NamedTuple):
    """The edges of all bins of an encoder, as a saved file holds them."""

    arrays: tuple[FloatArray, ...]


class GymnasiumProblem:
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
        How a Box is cut into bins; see :func:`tuckerl.spaces.encoder.space_encoder`.
    max_episode_steps : int, optional
        An episode is truncated after as many steps. Default: the environment's own business, and `STEP_CAP`.

    Raises
    ------
    SpaceError
        If a space cannot be numbered.
    ProblemError
        If the environment does not begin.
    """

    shares_world = False
    heuristic: FloatArray | None = None
    id: str | None = None
    """The id by which it can be made again; None where an instance or a callable was given."""

    def __init__(
        self,
        env: GymEnvironment,
        source: str,
        make: Maker | None = None,
        *,
        bins: Any = None,
        max_episode_steps: int | None = None,
    ) -> None:
        self.source, self._environments = source, Environments(env, source, make)
        self.read = MaskReader(env.observation_space, env.action_space)
        self.actions: SpaceEncoder = space_encoder(
            env.action_space, what="action"
        )  # first: no bins can mend continuous actions
        self.observations: SpaceEncoder = observation_encoder(self.read.observation_space, bins)
        self.n_states, self.n_actions = self.observations.n, self.actions.n
        self.layout: Layout | None = self.observations.layout
        joint = env.unwrapped if isinstance(env.unwrapped, JointEnv) else None
        self.agents: tuple[Any, ...] = tuple(joint.possible_agents) if joint else ()
        """The agents of whose observations and actions those of a joint environment are made."""
        self.agent_readers = tuple(joint.readers.values()) if joint else ()
        parts: Any = joint.action_space if joint else (env.action_space,)
        self.action_sizes = tuple(space_encoder(part, what="action").n for part in parts)
        self.max_episode_steps = max_episode_steps or STEP_CAP
        self.is_capped = max_episode_steps is None
        self.has_masks = self._environments.try_out(self._look)

    def _look(self, observation: Any, info: Any) -> bool:
        """Try to number the first observation; return whether there is a mask."""
        part, mask = self.read(observation, info)
        self.observations.encode(part)
        return mask is not None

    def world(self) -> "GymnasiumWorld":
        """Return a world of its own for one agent.

        Raises
        ------
        ProblemError
            If the environment cannot be copied.
        """
        return GymnasiumWorld(self, self._environments.take())

    def __repr__(self) -> str:
        return (
            f"GymnasiumProblem({self.source}, {self.n_states} states, {self.n_actions} actions, "
            f"max_episode_steps={self.max_episode_steps})"
        )


def observation_encoder(space: gymnasium.Space[Any], bins: Any, *, what: str = "observation") -> SpaceEncoder:
    """Return the encoder of observations for bins as users give them, or for edges as files hold them."""
    if isinstance(bins, Edges):
        return space_encoder_of_edges(space, bins.arrays, what=what)
    return space_encoder(space, bins, what=what)


class GymnasiumWorld(PythonWorld):
    """One agent's environment, and the callback by which kernels step it."""

    def __init__(self, problem: GymnasiumProblem, env: GymEnvironment) -> None:
        super().__init__(problem.source, env)
        self.problem = problem
        self._reward = array("d", [0.0])
        self._callback, address = python_callback(self._caller())
        self.arrays = GymnasiumArrays(
            call=address,
            reward=np.frombuffer(self._reward),
            truncated=np.zeros(1, dtype=np.bool_),
            status=np.zeros(1, dtype=np.int64),
            clock=np.zeros(1),
            n_states=problem.n_states,
            max_episode_steps=problem.max_episode_steps,
        )
        shape = (problem.n_states, problem.n_actions) if problem.has_masks else (0, 0)
        self.action_masks = (np.ones(shape, dtype=np.bool_),)

    def _caller(self) -> Callable[[int], int]:
        """Return the callback, with all that it needs at hand."""
        step, reward_of, read = self.env.step, self._reward, self.problem.read
        encode, reads = self.problem.observations.encode, self.problem.has_masks
        coded = self.problem.actions
        actions: Any = [coded.decode(a) for a in range(coded.n)] if coded.n <= _FEW_ACTIONS else _Decoded(coded)

        def call(action: int) -> int:
            try:
                if action < 0:
                    return self._begin_episode()
                if is_impatient():
                    raise KeyboardInterrupt
                observation, reward_of[0], terminated, truncated, info = step(actions[action])
                if reads:
                    observation, mask = read(observation, info)
                    state = encode(observation)
                    self._note_mask(state, mask)
                else:
                    if info and info.get(MASK) is not None:
                        raise ProblemError(MASK_IS_LATE)
                    state = encode(observation)
                return state << 2 | (1 if terminated else 0) | (2 if truncated else 0)
            except BaseException as error:  # noqa: BLE001  # raised again when the kernel has returned
                return self.fail(error)

        return call

    def _begin_episode(self) -> int:
        if self.is_late:
            return YIELD
        observation, info = self.seeds.reset()
        self.arrays.truncated[0] = False
        observation, mask = self.problem.read(observation, info)
        state = self.problem.observations.encode(observation)
        self._note_mask(state, mask)
        return state << STATE_SHIFT

    def _note_mask(self, state: int, mask: BoolArray | None) -> None:
        if self.problem.has_masks:
            self.action_masks[0][state] = True if mask is None else mask
        elif mask is not None:
            raise ProblemError(MASK_IS_LATE)


class _Decoded:
    """Actions that are too many to be kept in a list."""

    def __init__(self, actions: SpaceEncoder) -> None:
        self._actions = actions

    def __getitem__(self, action: int) -> Any:
        return self._actions.decode(action)
