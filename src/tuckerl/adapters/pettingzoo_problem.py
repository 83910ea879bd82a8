"""Several agents in one PettingZoo environment, each with a table of its own: independent learners.

A kernel lets all agents choose, hands their actions to Python through one callback, and lets all of them learn.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from tuckerl._jit import call_python, kernel, python_callback
from tuckerl.adapters.joint import agents_of
from tuckerl.adapters.masks import observation_part
from tuckerl.adapters.python_problem import AgentSpaces, Edges, PythonProblem
from tuckerl.adapters.python_world import FAULT, REWARD_IS_NOT_FINITE, YIELD, PythonWorld, must_return
from tuckerl.adapters.step_results import check_reward, ends_of, step_result
from tuckerl.checks import shown
from tuckerl.errors import ObservationError, ParameterError, ProblemError
from tuckerl.interrupts import is_impatient, may_raise_interrupts
from tuckerl.problems.dynamics import TERMINATED, register_shared_dynamics
from tuckerl.problems.parts import NO_LIMIT
from tuckerl.problems.problem import Choose
from tuckerl.spaces.encoder import n_dimensions
from tuckerl.types import BoolArray, FloatArray, IntArray

_BEGIN, _STEP = 0, 1


class PettingZooArrays(NamedTuple):
    """What kernels read of an environment of N agents."""

    call: int  # the address of a callback that begins an episode or takes a step
    before: IntArray  # (N,) each agent's state before the step
    state: IntArray  # (N,) and after it
    action: IntArray  # (N,)
    reward: FloatArray  # (N,)
    end: IntArray  # (N,) 0, TERMINATED or TRUNCATED
    playing: BoolArray  # (N,) who has not left
    status: IntArray  # (1,) 0, or below 0 where the kernel must return
    clock: FloatArray  # (1,) steps in this episode
    max_episode_steps: int


@kernel
def _step_together(world: PettingZooArrays, begin: bool) -> None:
    """Begin an episode, or take a step with all agents' actions.

    Parameters
    ----------
    world : PettingZooArrays
        All of its arrays but `action` are changed.
    begin : bool
    """
    world.clock[0] = 0.0 if begin else world.clock[0] + 1.0
    for agent in range(world.state.size):
        world.before[agent] = world.state[agent]
    code = call_python(world.call, _BEGIN if begin else _STEP)
    total = 0.0
    for reward in world.reward:
        total += reward - reward  # 0 for finite numbers, NaN for any other
    if code == 0:
        world.status[0] = REWARD_IS_NOT_FINITE if total != 0.0 else 0
    else:  # an error that was not caught leaves any number
        world.status[0] = YIELD if code == YIELD else FAULT


register_shared_dynamics(PettingZooArrays, step_together=_step_together, must_return=must_return)


class PettingZooProblem(PythonProblem):
    """A PettingZoo parallel environment in which every agent has a table of its own.

    Agents with fewer observations or actions than others have tables as large as the others', of which they use a
    part.

    Parameters
    ----------
    env : pettingzoo.ParallelEnv
        The first world plays this one.
    source : str
        What it is called in messages.
    make : callable, optional
        Makes one more; by default it is copied.
    bins
        The same for all agents that see a Box, or by agent; see :func:`tuckerl.spaces.encoder.space_encoder`.
    **parts
        ``max_episode_steps`` and ``heuristic``, see :class:`~tuckerl.adapters.python_problem.PythonProblem`.

    Raises
    ------
    SpaceError
        If a space cannot be numbered.
    ProblemError
        If the environment does not begin.
    """

    kind = "pettingzoo"
    shares_world = True

    def __init__(
        self,
        env: Any,
        source: str,
        make: Callable[[], Any] | None = None,
        *,
        bins: Any = None,
        **parts: Any,
    ) -> None:
        self.agents = tuple(agents_of(env))
        own_bins = _bins_of_agents(bins, self.agents, env)
        spaces = [
            AgentSpaces(env.observation_space(agent), env.action_space(agent), own, agent, place)
            for place, (agent, own) in enumerate(zip(self.agents, own_bins, strict=True))
        ]
        sizes = {(own.observations.sizes, own.actions.sizes) for own in spaces}
        self.has_equal_spaces = len(sizes) == 1
        super().__init__(env, source, make, spaces, **parts)
        # An agent with fewer actions than others may not take those beyond.
        self.has_masks = self.has_masks or len({own.actions.n for own in spaces}) > 1

    def _look(self, observation: Any, info: Any) -> bool:
        self.check_listed(observation)
        masks = [
            self.spaces[self.agents.index(agent)].encode(own, info.get(agent) or {})[1]
            for agent, own in observation.items()
        ]
        return any(mask is not None for mask in masks)

    def check_listed(self, agents: Iterable[Any]) -> None:
        """Refuse agents that are not in the list of those that there may be.

        Raises
        ------
        ProblemError
            If there is one.
        """
        unknown = [agent for agent in agents if agent not in self.agents]
        if unknown:
            known = ", ".join(map(str, self.agents))
            raise ProblemError(f"the agents must be among the possible_agents, {known}; got {shown(unknown[0])}")

    def n_tables(self, n_agents: int) -> int:
        """Return the number of the environment's agents.

        Raises
        ------
        ParameterError
            If `n_agents` is not 1.
        """
        if n_agents != 1:
            raise ParameterError(
                f"n_agents must stay 1 where each of the environment's {len(self.agents)} agents has a table; "
                f"got {n_agents}"
            )
        return len(self.agents)

    def declared(self, env: Any) -> list[tuple[Any, Any]]:
        """Return the spaces of the agents, in their order."""
        return [(env.observation_space(agent), env.action_space(agent)) for agent in self.agents]

    def world(self) -> "PettingZooWorld":
        """Return a world for all agents.

        Raises
        ------
        ProblemError
            If the environment cannot be copied.
        """
        return PettingZooWorld(self, self.copies.take())

    def decide(self, observation: Any, choose: Choose, action_masks: Any = None) -> Any:
        """Return by agent the actions that are chosen for a dict of observations; see `Problem.decide`.

        Raises
        ------
        ObservationError
            If they are no such dict, one is none of the environment's, or so with the masks.
        """
        masks = {} if action_masks is None else action_masks
        for given, what in ((observation, "observations"), (masks, "action_masks")):
            if not isinstance(given, Mapping) or not set(given) <= set(self.agents):
                raise ObservationError(
                    f"{what} must be a dict by agent, of {', '.join(map(str, self.agents))}; got {shown(given)}"
                )
        places = {agent: self.agents.index(agent) for agent in observation}
        return {
            agent: self.spaces[i].decide(observation[agent], i, choose, masks.get(agent)) for agent, i in places.items()
        }

    def describe(self) -> str:
        """Return in a part of a sentence how the problem is played, and its sizes."""
        return f"{super().describe()}; each of its {len(self.agents)} agents has a table of its own"

    def __repr__(self) -> str:
        return super().__repr__().replace(", ", f", {len(self.agents)} agents, ", 1)


def _bins_of_agents(bins: Any, agents: Sequence[Any], env: Any) -> Sequence[Any]:
    """Return each agent's bins: its own where they are by agent, else the same for all that see a Box."""
    if isinstance(bins, Edges):
        return [bins] * len(agents)
    if isinstance(bins, Mapping) and bins.keys() <= set(agents):
        return [bins.get(agent) for agent in agents]
    sees_box = [n_dimensions(observation_part(env.observation_space(agent))) > 0 for agent in agents]
    # Where nobody sees a Box, everybody gets the bins, so that the encoder says what is wrong with them.
    return [bins if own or not any(sees_box) else None for own in sees_box]


class PettingZooWorld(PythonWorld):
    """The environment of all agents, and the callback by which kernels step it."""

    problem: PettingZooProblem

    def __init__(self, problem: PettingZooProblem, env: Any) -> None:
        super().__init__(problem, env)
        n = len(problem.agents)
        self._places = {agent: place for place, agent in enumerate(problem.agents)}
        self._met: set[Any] = set()  # who has acted in this episode
        self._callback, address = python_callback(self._call)
        self.arrays = PettingZooArrays(
            call=address,
            before=np.zeros(n, dtype=np.int64),
            state=np.zeros(n, dtype=np.int64),
            action=np.zeros(n, dtype=np.int64),
            reward=np.zeros(n),
            end=np.zeros(n, dtype=np.int64),
            playing=np.zeros(n, dtype=np.bool_),
            status=np.zeros(1, dtype=np.int64),
            clock=np.zeros(1),
            max_episode_steps=problem.max_episode_steps or NO_LIMIT,
        )

    @may_raise_interrupts
    def _call(self, what: int) -> int:
        try:
            if what == _BEGIN:
                return self._begin_episode()
            if is_impatient():
                raise KeyboardInterrupt
            self._step()
            return 0
        except BaseException as error:  # noqa: BLE001  # raised again when the kernel has returned
            return self.fail(error)

    def _begin_episode(self) -> int:
        if self.is_late:
            return YIELD
        self.before_episode()
        observations, infos = self.begin()
        if not observations:
            raise ProblemError("there must be agents after the reset; it returned no observations")
        self.problem.check_listed(observations)
        self._met.clear()
        self.arrays.playing[:] = False
        self.arrays.reward[:] = 0.0
        for agent, observation in observations.items():
            self.arrays.playing[self._places[agent]] = True
            self._note(agent, observation, infos.get(agent) or {})
        return 0

    def _step(self) -> None:
        arrays, spaces = self.arrays, self.problem.spaces
        chosen = {
            agent: spaces[place].actions.decode(int(arrays.action[place]))
            for agent, place in self._places.items()
            if arrays.playing[place]
        }
        observations, rewards, terminations, truncations, infos = step_result(self.env.step(chosen))
        arrays.end[:] = 0
        for agent in chosen:
            place = self._places[agent]
            reward = _of(agent, rewards, "a reward")
            check_reward(reward)
            arrays.reward[place] = reward
            end = ends_of(_of(agent, terminations, "a termination"), _of(agent, truncations, "a truncation"))
            arrays.end[place] = TERMINATED if end & TERMINATED else end
            if agent in observations or arrays.end[place] == 0:  # who has left need not see anything more
                self._note(agent, _of(agent, observations, "an observation"), infos.get(agent) or {})
        self._met.update(chosen)
        if not set(observations) <= self._met:  # who has left and is still reported is not looked at
            late = sorted(map(str, set(observations) - self._met))
            raise ProblemError(f"agents must be there from an episode's beginning; {', '.join(late)} came later")

    def _note(self, agent: Any, observation: Any, info: Any) -> None:
        place = self._places[agent]
        state, mask = self.problem.spaces[place].encode(observation, info)
        self.arrays.state[place] = state
        if mask is not None or self.problem.has_masks:  # spares a call at each step of most environments
            self.note_mask(place, state, mask)


def _of(agent: Any, values: Mapping[Any, Any], what: str) -> Any:
    """Return an agent's own of what a step returned by agent."""
    try:
        return values[agent]
    except KeyError as error:
        raise ProblemError(f"step must return {what} of every agent that acted; none came of {agent}") from error
