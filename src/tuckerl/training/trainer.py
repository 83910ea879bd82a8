"""Learning: kernels play windows of episodes, and the tensor step follows each window."""

import sys
import warnings
from collections.abc import Sequence
from typing import TYPE_CHECKING

from tuckerl.checks import check_int
from tuckerl.errors import ParameterError, StepCapWarning
from tuckerl.generalization.step import TensorStepState
from tuckerl.interrupts import interrupts_held_back
from tuckerl.memory import check_memory
from tuckerl.training.callbacks.base import CallbackLike, CallbackList, Goal
from tuckerl.training.evaluation import CAPPED
from tuckerl.training.guards import raise_fault
from tuckerl.training.loop import play, play_together
from tuckerl.training.memory_account import history_parts
from tuckerl.training.one_owner import Owner
from tuckerl.training.python_calls import PythonCall
from tuckerl.training.training_state import TrainingState

if TYPE_CHECKING:
    from tuckerl.training.learner import Learner

WINDOW = 100
"""Episodes between callbacks where there is no tensor step."""

_PATIENCE = 0.25  # seconds after which a Python environment returns, at the end of an episode
_UNLIMITED = sys.maxsize
# Ctrl-C and callbacks wait for one call of a kernel, which costs as much as a thousand steps.
_CHUNK, _CHUNK_STEPS = 1000, 1_000_000  # episodes without a tensor step; steps of the first agent, and its episode


class Trainer:
    """One call of `learn`: what a learner does to its training state.

    Parameters
    ----------
    learner : Learner
    state : TrainingState
        The learner's, changed in place.
    python_calls : sequence of PythonCall
        The Python functions that the algorithm's kernels may call.
    owner : Owner
        Knows that the learner is in use, and whether episodes are being played.
    """

    def __init__(
        self, learner: "Learner", state: TrainingState, python_calls: Sequence[PythonCall], owner: Owner
    ) -> None:
        self._learner, self._state, self._python_calls, self._owner = learner, state, python_calls, owner

    def learn(
        self, episodes: int | None, steps: int | None, callbacks: Sequence[CallbackLike], *, progress: bool
    ) -> None:
        """Learn until the goal; see :meth:`tuckerl.training.learner.Learner.learn`."""
        state, goal = self._state, self._goal(episodes, steps)
        with CallbackList(self._learner, callbacks, goal, progress=progress) as listed:
            while state.diverged_at is None and listed.go_on and not self._is_done(goal):
                try:
                    with interrupts_held_back(), self._owner.playing():
                        self._advance(min(goal.episodes, listed.next_stop()), goal.steps)
                finally:  # Ctrl-C is heard above; the window that it waited for may have ended
                    listed.call()

    def _goal(self, episodes: int | None, steps: int | None) -> Goal:
        """Return the numbers of episodes and of the first agent's steps at which learning ends."""
        history = self._state.history
        if (episodes is None) == (steps is None):
            raise ParameterError(f"learn() takes either episodes or steps; got episodes={episodes} and steps={steps}")
        if episodes is not None:
            n_episodes = check_int("episodes", episodes, 1)
            check_memory("learning", history_parts(self._state.n_agents, n_episodes, self._state.schedules.n))
            return Goal(history.episodes + n_episodes, _UNLIMITED)
        return Goal(_UNLIMITED, history.first_agent_steps + check_int("steps", steps, 1))

    def _is_done(self, goal: Goal) -> bool:
        history = self._state.history
        reached = history.episodes >= goal.episodes or history.first_agent_steps >= goal.steps
        return reached and self._state.in_sync

    def _advance(self, until: int, until_steps: int) -> None:
        """Play on, and take the tensor step where a window has ended (or is due, as a user's function raised)."""
        state = self._state
        due = state.due_step
        if due is None:
            self._play_on(until, until_steps - state.history.first_agent_steps)
            due = state.due_step
        if due is not None and state.diverged_at is None:
            self._close_window(due)

    def _play_on(self, until: int, max_steps: int) -> None:
        """Play up to an episode or until the first agent has made `max_steps` steps, or let those behind catch up."""
        state, history = self._state, self._state.history
        chunk = _CHUNK if state.tensor_step is None else state.tensor_step.step.every
        until, max_steps = min(until, history.episodes + chunk - history.episodes % chunk), min(max_steps, _CHUNK_STEPS)
        if not history.in_sync:
            until, max_steps = history.most_episodes, _UNLIMITED
        finite = True
        try:
            if len(state.worlds) < state.n_agents:
                finite = self._play_world(0, list(range(state.n_agents)), until, max_steps)
            for agent in range(state.n_agents if len(state.worlds) == state.n_agents else 0):
                finite = self._play_world(agent, [agent], until, max_steps) and finite
                until, max_steps = history.most_episodes, _UNLIMITED
        finally:  # also where the environment of a later agent has failed
            if not finite:
                state.diverged_at = history.episodes

    def _play_world(self, place: int, agents: list[int], until: int, max_steps: int) -> bool:
        """Let the agents of a world play; return whether their tables stayed finite."""
        state, world, make = self._state, self._state.worlds[place], self._learner.algorithm_state
        if until <= int(state.history.finished[agents[0]]):
            return True
        arrays = tuple(
            state.agent(agent, until, max_steps, world.action_masks[i], make) for i, agent in enumerate(agents)
        )
        world.set_deadline(_PATIENCE)
        shared = self._learner.problem.shares_world
        n = play_together(world.arrays, arrays) if shared else play(world.arrays, arrays[0])
        state.history.add(agents, n if n >= 0 else -1 - n)
        partial, state.partial[agents] = state.partial[agents] & (n == 0), True
        errors = [error for call in self._python_calls if (error := call.take_error()) is not None]
        try:
            world.raise_pending()
        finally:
            if errors:
                raise errors[0]
        raise_fault(type(self._learner).__name__, world.arrays, arrays)
        state.partial[agents] = partial
        self._warn_of_cap(max(int(one.record.steps[: max(n, 0)].max(initial=0)) for one in arrays))
        return n >= 0

    def _warn_of_cap(self, longest: int) -> None:
        problem, state = self._learner.problem, self._state
        if problem.is_capped and longest == problem.max_episode_steps and not state.was_capped:
            state.was_capped = True
            warnings.warn(CAPPED.format(longest), StepCapWarning, stacklevel=7)

    def _close_window(self, step: TensorStepState) -> None:
        state, every = self._state, step.step.every
        window = state.history.returns[:, state.history.episodes - every :].T.copy()
        result = step.close_window(state.history.episodes, state.weights, state.logs, window)
        if not result.finite:
            state.history.drop_last()
            state.diverged_at = state.history.episodes
            return
        state.weights = result.weights
        if result.mixture is not None and state.n_agents > 1:
            state.share(result.mixture)
        if step.step.needs_decomposition:
            step.snapshots.restart(state.logs, state.q)
