"""Everything that learning changes: tables, declared arrays, random streams, records, worlds.

Sizes: N agents, S states, A actions, K scheduled numbers.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from tuckerl.errors import LearnerError, SavedFileError
from tuckerl.generalization.change_log import (
    ChangeLog,
    begin_undo,
    empty_log,
    read_log,
    restore_log,
    saved_log,
    undo_changes,
    with_tables,
)
from tuckerl.generalization.log_window import LogWindow
from tuckerl.generalization.step import TensorStepResult, TensorStepState
from tuckerl.generalization.tensor_step import TensorStep
from tuckerl.problems.worlds import World
from tuckerl.rng import child, stream
from tuckerl.saved_arrays import SavedArrays, grouped
from tuckerl.training.agent_arrays import AgentArrays, EpisodeRecord, trajectory_length
from tuckerl.training.declared_state import (
    Arrays,
    Declaration,
    DeclaredArray,
    carried_over,
    read_state,
    restore_state,
    saved_state,
)
from tuckerl.training.held_state import HeldAgent, HeldState, is_seen, read_mask, read_streams, read_weights
from tuckerl.training.history import EpisodeHistory
from tuckerl.training.kernel_calls import KernelCall, Pace
from tuckerl.training.row_maxima import maxima_of, room_for_maxima
from tuckerl.training.rules import Rules
from tuckerl.training.schedules import ScheduleValues, read_past
from tuckerl.training.sharing import share_all
from tuckerl.types import BoolArray, FloatArray, IntArray, Stream

MakeAlgorithmState = Callable[[Mapping[str, Any], FloatArray], Any]
"""From an agent's declared arrays by name and the algorithm's scheduled numbers to what its kernels read."""


class _Kept(NamedTuple):
    """What an agent had at a point between two episodes, besides its arrays by states."""

    stream: Stream
    arrays: Arrays
    log: IntArray


class TrainingState:
    """What learning changes, for N agents.

    Parameters
    ----------
    worlds : sequence of World
        One for each agent, or one that all share.
    initial_q : (S, A) float64
        Possibly broadcast from one number.
    n_agents : int
    tensor_step : TensorStep or None
    rules : Rules
    max_episode_steps : int or None
    keeps_maxima : bool
        Whether kernels change the tables one entry at a time and follow what becomes of the rows' maxima.
    sequence : SeedSequence
        The learner's.
    check_declared : callable
        Refuses one agent's declared arrays by name, from a file, if they contradict each other.
    """

    def __init__(
        self,
        worlds: Sequence[World],
        initial_q: FloatArray,
        *,
        n_agents: int,
        tensor_step: TensorStep | None,
        rules: Rules,
        max_episode_steps: int | None,
        keeps_maxima: bool,
        sequence: np.random.SeedSequence,
        check_declared: Callable[[Mapping[str, Any]], None],
    ) -> None:
        n_states, n_actions = initial_q.shape
        self.worlds, self.initial_q, self._check_declared = tuple(worlds), initial_q, check_declared
        self.pace = Pace(may_hang=any(world.has_users_functions for world in worlds))
        for number, world in enumerate(self.worlds):
            world.seed(child(sequence, number))
        self.q: FloatArray = np.zeros((n_agents, n_states, n_actions))  # zeros cost nothing until they are touched
        if initial_q.any():
            self.q += initial_q
        self.weights: FloatArray = np.ones(n_actions)
        self.declarations: tuple[Declaration, ...] = ()
        self.declared: tuple[dict[str, Any], ...] = tuple({} for _ in range(n_agents))
        self.schedules = ScheduleValues({})
        self.step_sizes: FloatArray = np.zeros((n_agents, n_actions))
        self.streams = [stream(child(sequence, agent)) for agent in range(n_agents)]
        self._trajectory: IntArray = np.zeros((n_agents, 2, trajectory_length(max_episode_steps)), dtype=np.int64)
        window = 0 if tensor_step is None else LogWindow(tensor_step, n_agents).n_places
        self.logs: tuple[ChangeLog, ...] = tuple(empty_log(n_states, n_actions, window) for _ in range(n_agents))
        self._maxima = [room_for_maxima(n_states, n_actions) if keeps_maxima else None for _ in range(n_agents)]
        self._kept: dict[int, _Kept] = {}
        self.history = EpisodeHistory(n_agents, shares_world=len(self.worlds) < n_agents)
        self.go_on_by(rules)
        self.tensor_step = None if tensor_step is None else TensorStepState(tensor_step, initial_q, n_agents, sequence)
        self.diverged_at: int | None = None
        self.was_capped = False

    def go_on_by(self, rules: Rules) -> None:
        """Learn by these rules from the next episode on; what was learned stays.

        Raises
        ------
        LearnerError
            If two declarations have one name.
        ImmutableError
            If a declared array would have to become another one.
        """
        declarations = (*rules.declarations, *rules.policy.declare_state())
        names = [declaration.name for declaration in declarations]
        if len(set(names)) < len(names):
            raise LearnerError(f"declared arrays must have different names; got {', '.join(names)}")
        before = {declaration.name: declaration for declaration in self.declarations}
        self.declared = tuple(
            {d.name: carried_over(before.get(d.name), d, held.get(d.name), self.initial_q) for d in declarations}
            for held in self.declared
        )
        self.declarations, self.rules = declarations, rules
        schedules = dict(rules.schedules) | rules.policy.schedules()
        self.schedules = self.schedules.followed_by(schedules, self.history.most_episodes)
        self.scheduled: FloatArray = np.zeros((self.n_agents, self.schedules.n))
        self.logs = tuple(with_tables(log, self._by_state(agent)) for agent, log in enumerate(self.logs))

    @property
    def n_agents(self) -> int:
        """Number of agents, each with a table."""
        return len(self.q)

    @property
    def action_masks(self) -> list[BoolArray]:
        """Where each agent may take an action, (S, A), or (0, 0) where it always may."""
        return [mask for world in self.worlds for mask in world.action_masks]

    @property
    def due_step(self) -> TensorStepState | None:
        """The tensor step where a window has ended and the step has not followed yet (a user's function may raise)."""
        step = self.tensor_step
        return step if step is not None and step.n_windows < self.history.episodes // step.step.interval else None

    @property
    def in_sync(self) -> bool:
        """Whether all agents are at one episode and the tensor step of the latest window is done."""
        return self.history.in_sync and self.due_step is None

    @property
    def is_saveable(self) -> bool:
        """Whether no table has diverged."""
        return self.diverged_at is None

    def _by_state(self, agent: int) -> list[np.ndarray]:
        """Return an agent's arrays that have a row for each state: what change logs bring back."""
        declared = [d for d in self.declarations if isinstance(d, DeclaredArray) and d.is_by_state]
        return [self.q[agent], *(self.declared[agent][declaration.name] for declaration in declared)]

    def _others(self, agent: int) -> list[tuple[Declaration, Any]]:
        """Return an agent's declared arrays that are in no change log."""
        pairs = [(declaration, self.declared[agent][declaration.name]) for declaration in self.declarations]
        return [(d, value) for d, value in pairs if not (isinstance(d, DeclaredArray) and d.is_by_state)]

    def keep(self, world: int, agents: Sequence[int]) -> None:
        """Remember where a world and its agents are between two episodes, for `undo`; only small arrays are copied."""
        self.worlds[world].keep()
        for agent in agents:
            others = [saved_state(declaration, value) for declaration, value in self._others(agent)]
            copies = {name: array.copy() for arrays in others for name, array in arrays.items()}
            self._kept[agent] = _Kept(self.streams[agent].copy(), copies, begin_undo(self.logs[agent]))

    def undo(self, world: int, agents: Sequence[int]) -> None:
        """Go back to where `keep` was called: what was broken off since then has never been."""
        self.worlds[world].undo()
        for agent in agents:
            kept = self._kept[agent]
            self.streams[agent] = kept.stream.copy()  # a function that has not returned may draw from the other one
            for declaration, value in self._others(agent):
                restore_state(declaration, value, kept.arrays)
            undo_changes(self.logs[agent], kept.log)

    def latest_trajectory(self, agent: int) -> IntArray:
        """Return the states of an agent's latest episode, and what an earlier one has left behind their end."""
        latest: IntArray = self._trajectory[agent, (self.history.finished[agent] - 1) & 1]
        return latest

    def agent(
        self,
        agent: int,
        until: int,
        max_steps: int,
        action_mask: BoolArray,
        make_algorithm_state: MakeAlgorithmState,
        call: KernelCall,
    ) -> AgentArrays:
        """Return an agent as a call of a kernel sees it, to play up to its episode `until`."""
        chunk = slice(int(self.history.finished[agent]), until)
        steps, returns = self.history.room(agent, until)
        scheduled, declared, own = self.scheduled[agent], self.declared[agent], len(self.rules.schedules)
        return AgentArrays(
            algorithm=make_algorithm_state(declared, scheduled[1:own]),
            policy=self.rules.policy.arrays(scheduled[own:], declared),
            q=self.q[agent],
            weights=self.weights,
            step_sizes=self.step_sizes[agent],
            scheduled=scheduled,
            action_mask=action_mask,
            settings=self.rules.settings,
            maxima=maxima_of(self._maxima[agent], call.number),
            log=self.logs[agent],
            record=EpisodeRecord(
                steps=steps,
                returns=returns,
                trajectory=self._trajectory[agent],
                scheduled=self.schedules.values(until)[chunk],
                max_steps=max_steps,
                first=chunk.start,
                stop=call.stop,
                listen=call.listen,
            ),
            rng=self.streams[agent],
            fault=np.zeros(4),
        )

    def share(self, result: TensorStepResult) -> None:
        """Let every agent go on with the tables that a tensor step says, and with what is declared to be shared."""
        share_all(result, self.q, self.declarations, self.declared, self.initial_q)

    def to_arrays(self) -> Arrays:
        """Return all that learning changes, as `read` reads it."""
        # Of every agent, also of one that is ahead of others; none where tables are not finite.
        sizes = self.history.latest_steps[:, np.newaxis] + 1 if self.is_saveable else np.zeros((1, 1), dtype=np.int64)
        trajectory = np.stack([self.latest_trajectory(agent)[: sizes.max()] for agent in range(self.n_agents)])
        trajectory *= np.arange(trajectory.shape[1]) < sizes  # what earlier episodes left behind its end
        arrays: Arrays = {"q": self.q, "weights": self.weights, "trajectory": trajectory}
        arrays |= {"streams": np.stack(self.streams)} | self.history.to_arrays()
        arrays = grouped("state", arrays)
        for agent, (log, mask, declared) in enumerate(zip(self.logs, self.action_masks, self.declared, strict=True)):
            own = grouped("log", saved_log(log))
            if is_seen(mask):
                own["action_mask"] = mask
            for declaration in self.declarations:
                own |= saved_state(declaration, declared[declaration.name])
            arrays |= grouped(f"agents/{agent}", own)
        arrays |= grouped("scheduled", self.schedules.past)
        return arrays if self.tensor_step is None else arrays | grouped("step", self.tensor_step.saved())

    def read(self, arrays: SavedArrays, diverged_at: int | None) -> HeldState:
        """Return what `to_arrays` returned, from a file; this state does not change.

        Raises
        ------
        SavedFileError
            If it is none of such a learner's: kernels would read and write where nothing is.
        """
        n_agents, n_states, n_actions = self.q.shape
        own, finite = arrays.group("state"), diverged_at is None
        streams, history = read_streams(own, n_agents), self.history.read(own, n_agents, diverged=not finite)
        finished = history["finished"]
        if diverged_at is not None and not 0 <= diverged_at <= finished.max():
            raise SavedFileError(f"it diverged in episode {diverged_at}, which it does not have")
        q = own.take("q", np.float64, self.q.shape, finite=finite)
        trajectory = own.take("trajectory", np.int64, (n_agents, range(self._trajectory.shape[2] + 1)), 0, n_states - 1)
        step = self.tensor_step
        held_step = None if step is None else step.read(arrays.group("step"), finished, diverged=not finite)
        weights, n_windows = read_weights(own, held_step, n_actions)
        stepped = 0 if step is None else n_windows * step.step.interval
        logged = [int(n) if step is None else step.places.n_filled(int(n), stepped) for n in finished]
        past = read_past(arrays.group("scheduled"), int(finished.max()))
        agents = [self._read_agent(i, arrays, n, finite=finite) for i, n in enumerate(logged)]
        return HeldState(q, weights, history, trajectory, streams, held_step, tuple(agents), past, diverged_at)

    def _read_agent(self, agent: int, arrays: SavedArrays, n_closed: int, *, finite: bool) -> HeldAgent:
        arrays, log, mask = arrays.group(f"agents/{agent}"), self.logs[agent], self.action_masks[agent]
        held_log = read_log(arrays.group("log"), log, self.q.shape[2], n_closed if finite else None, finite=finite)
        n_own = [n for world in self.worlds for n in world.n_own_actions][agent]
        held_mask = read_mask(arrays, mask.shape, n_own) if is_seen(mask) else None
        declared = {d.name: read_state(d, arrays, self.initial_q, finite=finite) for d in self.declarations}
        if finite:
            self._check_declared(declared)
        return HeldAgent(held_log, held_mask, declared)

    def restore(self, held: HeldState) -> None:
        """Go on from what `read` returned."""
        self.q, self.weights, self.streams = held.q, held.weights, list(held.streams)
        self.history.set_arrays(held.history)
        for agent, states in enumerate(held.trajectory):
            self.latest_trajectory(agent)[: states.size] = states
        self.diverged_at = held.diverged_at
        self.schedules = self.schedules.with_past(held.past)
        self.declared = tuple(agent.declared for agent in held.agents)
        n_states, n_actions = self.initial_q.shape
        self.logs = tuple(
            with_tables(empty_log(n_states, n_actions, log.end.size), self._by_state(agent))
            for agent, log in enumerate(self.logs)
        )
        for log, mask, own in zip(self.logs, self.action_masks, held.agents, strict=True):
            restore_log(log, own.log)
            if own.mask is not None:
                mask[...] = own.mask
        if self.tensor_step is not None and held.step is not None:
            self.tensor_step.restore(held.step)
