"""Several agents in one PettingZoo environment, each with a table of its own: independent learners.

A kernel lets all agents choose, hands their actions to Python through one callback, and lets all of them learn.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from tuckerl._jit import call_python, kernel, python_callback
from tuckerl.adapters.gymnasium_problem import Edges, observation_encoder
from tuckerl.adapters.joint import agents_of
from tuckerl.adapters.masks import MASK_IS_LATE, MaskReader
from tuckerl.adapters.python_world import (
    FAULT,
    REWARD_IS_NOT_FINITE,
    STEP_CAP,
    TERMINATED,
    TRUNCATED,
    YIELD,
    Environments,
    PythonWorld,
)
from tuckerl.errors import ProblemError
from tuckerl.interrupts import is_impatient
from tuckerl.problems.mdp import Layout
from tuckerl.spaces.encoder import SpaceEncoder, n_dimensions, space_encoder
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
def step_together(world: PettingZooArrays, begin: bool) -> None:
    """Begin an episode, or take a step with all agents' actions."""
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


class EdgesOfAgents(NamedTuple):
    """The edges of all bins of all agents' encoders, as a saved file holds them."""

    by_place: tuple[Edges, ...]


class PettingZooProblem:
    """A PettingZoo parallel environment in which every agent has a table of its own.

    Agents with fewer observations or actions than others have tables as large as the others', of which they use a
    part. `bins` are the same for all agents that see a Box, or by agent.

    Raises
    ------
    SpaceError
        If a space cannot be numbered.
    ProblemError
        If the environment does not begin.
    """

    shares_world = True
    heuristic: FloatArray | None = None
    id: str | None = None
    """The id by which it can be made again; None where an instance or a callable was given."""
    layout: Layout | None = None

    def __init__(
        self,
        env: Any,
        source: str,
        make: Callable[[], Any] | None = None,
        *,
        bins: Any = None,
        max_episode_steps: int | None = None,
    ) -> None:
        self.source, self._environments = source, Environments(env, source, make)
        self.agents: tuple[Any, ...] = tuple(agents_of(env))
        self.readers = tuple(MaskReader(env.observation_space(p), env.action_space(p)) for p in self.agents)
        own_bins = _bins_of_agents(bins, self.agents, self.readers)
        self.observations: tuple[SpaceEncoder, ...] = tuple(
            observation_encoder(reader.observation_space, own, what=f"observation of {agent}")
            for agent, reader, own in zip(self.agents, self.readers, own_bins, strict=True)
        )
        self.actions: tuple[SpaceEncoder, ...] = tuple(
            space_encoder(env.action_space(agent), what=f"action of {agent}") for agent in self.agents
        )
        self.n_states = max(own.n for own in self.observations)
        self.n_actions = max(own.n for own in self.actions)
        kinds = {(seen.sizes, done.sizes) for seen, done in zip(self.observations, self.actions, strict=True)}
        self.are_equal = len(kinds) == 1
        self.action_sizes = (self.n_actions,)
        self.max_episode_steps = max_episode_steps or STEP_CAP
        self.is_capped = max_episode_steps is None
        has_masks = self._environments.try_out(self._look)
        self.has_masks = has_masks or len({own.n for own in self.actions}) > 1

    def _look(self, observations: Any, infos: Any) -> bool:
        """Try to number the first observations; return whether there are masks."""
        masks = []
        for agent, observation in observations.items():
            place = self.agents.index(agent)
            part, mask = self.readers[place](observation, infos.get(agent) or {})
            self.observations[place].encode(part)
            masks.append(mask)
        return any(mask is not None for mask in masks)

    def world(self) -> "PettingZooWorld":
        """Return a world for all agents.

        Raises
        ------
        ProblemError
            If the environment cannot be copied.
        """
        return PettingZooWorld(self, self._environments.take())

    def __repr__(self) -> str:
        return (
            f"PettingZooProblem({self.source}, {len(self.agents)} agents, {self.n_states} states, {self.n_actions} "
            f"actions, max_episode_steps={self.max_episode_steps})"
        )


def _bins_of_agents(bins: Any, agents: Sequence[Any], readers: Sequence[MaskReader]) -> Sequence[Any]:
    """Return each agent's bins: its own where they are by agent, else the same for all that see a Box."""
    if isinstance(bins, EdgesOfAgents):
        return bins.by_place
    if isinstance(bins, Mapping) and bins.keys() <= set(agents):
        return [bins.get(agent) for agent in agents]
    sees_box = [n_dimensions(reader.observation_space) > 0 for reader in readers]
    return [
        bins if own or not any(sees_box) else None for own in sees_box
    ]  # without any, the encoder says what is wrong


class PettingZooWorld(PythonWorld):
    """The environment of all agents, and the callback by which kernels step it."""

    def __init__(self, problem: PettingZooProblem, env: Any) -> None:
        super().__init__(problem.source, env)
        n, self.problem = len(problem.agents), problem
        self._places = {agent: place for place, agent in enumerate(problem.agents)}
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
            max_episode_steps=problem.max_episode_steps,
        )
        shape = (problem.n_states, problem.n_actions) if problem.has_masks else (0, 0)
        tables = tuple(np.ones(shape, dtype=np.bool_) for _ in problem.agents)
        if problem.has_masks:
            for table, actions in zip(tables, problem.actions, strict=True):
                if actions.n < problem.n_actions:
                    table[:, actions.n :] = False
        self.action_masks = tables

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
        observations, infos = self.seeds.reset()
        if not observations:
            raise ProblemError("there must be agents after the reset; it returned no observations")
        self.arrays.playing[:] = False
        self.arrays.reward[:] = 0.0
        for agent, observation in observations.items():
            self.arrays.playing[self._places[agent]] = True
            self._note(agent, observation, infos.get(agent) or {})
        return 0

    def _step(self) -> None:
        arrays, actions = self.arrays, self.problem.actions
        chosen = {
            agent: actions[place].decode(int(arrays.action[place]))
            for agent, place in self._places.items()
            if arrays.playing[place]
        }
        observations, rewards, terminations, truncations, infos = self.env.step(chosen)
        arrays.end[:] = 0
        for agent in chosen:
            place = self._places[agent]
            arrays.reward[place] = rewards[agent]
            arrays.end[place] = TERMINATED if terminations[agent] else TRUNCATED if truncations[agent] else 0
            if agent in observations or arrays.end[place] == 0:  # who has left need not see anything more
                self._note(agent, observations[agent], infos.get(agent) or {})
        if not set(observations) <= set(chosen):
            late = sorted(map(str, set(observations) - set(chosen)))
            raise ProblemError(f"agents must be there from an episode's beginning; {', '.join(late)} came later")

    def _note(self, agent: Any, observation: Any, info: Any) -> None:
        place = self._places[agent]
        part, mask = self.problem.readers[place](observation, info)
        state = self.problem.observations[place].encode(part)
        self.arrays.state[place] = state
        if self.problem.has_masks:
            self.action_masks[place][state, : self.problem.actions[place].n] = True if mask is None else mask
        elif mask is not None:
            raise ProblemError(MASK_IS_LATE)
