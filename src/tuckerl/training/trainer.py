"""Learning: kernels play windows of episodes, and the tensor step follows each window."""

import sys
from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

from tuckerl.checks import check_int, shown
from tuckerl.errors import ParameterError, StepCapWarning, warn
from tuckerl.generalization.step import TensorStepState
from tuckerl.interrupts import interrupts_held_back, is_waiting
from tuckerl.memory import check_memory
from tuckerl.training.agent_arrays import AgentArrays
from tuckerl.training.callbacks.base import CallbackLike, CallbackList, Goal
from tuckerl.training.evaluation import CAPPED
from tuckerl.training.guards import raise_fault
from tuckerl.training.kernel_calls import SLICE, KernelCall
from tuckerl.training.loop import play, play_together
from tuckerl.training.memory_account import history_parts
from tuckerl.training.one_owner import Owner
from tuckerl.training.python_calls import PythonCall
from tuckerl.training.training_state import TrainingState

if TYPE_CHECKING:
    from tuckerl.training.learner import Learner

WINDOW = 100
"""Episodes between callbacks where there is no tensor step."""

_UNLIMITED = sys.maxsize
_CHUNK = 1000  # episodes of one call of a kernel without a tensor step


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
        goal = self._goal(episodes, steps)
        with CallbackList(self._learner, callbacks, goal, progress=progress) as listed:
            while listed.go_on and not self._is_over(goal):
                try:
                    with interrupts_held_back(), self._owner.playing():
                        self._advance(min(goal.episodes, listed.next_stop()), goal.steps)
                        # Where nobody is to hear of windows, there is no need to leave this block after each.
                        while listed.is_empty and not (is_waiting() or self._is_over(goal)):
                            self._advance(goal.episodes, goal.steps)
                finally:  # Ctrl-C is heard above; the window that it waited for may have ended
                    listed.call()

    def _goal(self, episodes: int | None, steps: int | None) -> Goal:
        """Return the numbers of episodes and of the first agent's steps at which learning ends."""
        history = self._state.history
        if (episodes is None) == (steps is None):
            raise ParameterError(f"learn() takes either episodes or steps; got {shown(episodes)} and {shown(steps)}")
        if episodes is not None:
            goal = history.episodes + (episodes := check_int("episodes", episodes, 1))
            if goal > history.capacity:  # to ask what is free takes longer than a short episode
                check_memory("learning", history_parts(self._state.n_agents, episodes, self._state.schedules.n))
            return Goal(goal, _UNLIMITED)
        return Goal(_UNLIMITED, min(_UNLIMITED, history.first_agent_steps + check_int("steps", steps, 1)))

    def _is_over(self, goal: Goal) -> bool:
        """Return whether a table has diverged or the goal is reached."""
        state, history = self._state, self._state.history
        is_reached = history.episodes >= goal.episodes or history.first_agent_steps >= goal.steps
        return state.diverged_at is not None or (is_reached and state.in_sync)

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
        chunk = _CHUNK if state.tensor_step is None else state.tensor_step.step.interval
        until = min(until, history.episodes + chunk - history.episodes % chunk)
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

    def _play_world(self, place: int, agents: Sequence[int], until: int, max_steps: int) -> bool:
        """Let the agents of a world play; return whether their tables stayed finite."""
        state, world = self._state, self._state.worlds[place]
        first = int(state.history.finished[agents[0]])
        if until <= first:
            return True
        is_compiled = self._learner.problem.is_compiled
        if self._python_calls and is_compiled:
            until = first + 1  # what such a function has done cannot be undone: no finished episode is played again
        call = KernelCall(calls_python=bool(self._python_calls) or not is_compiled, pace=state.pace)
        state.keep(place, agents)
        world.before_episode = partial(state.keep, place, agents)
        world.set_deadline(SLICE)
        n, error = self._play_or_fail(place, agents, until, max_steps, call)
        finished = n if n >= 0 else -1 - n
        is_broken = error is not None or (n < 0 and call.was_stopped)
        if is_broken:
            self._undo(place, agents, finished)
        state.history.add(agents, finished)
        if error is not None:
            raise error
        if not is_broken:
            self._warn_of_cap(agents, first)
        return is_broken or n >= 0

    def _play_or_fail(
        self, place: int, agents: Sequence[int], until: int, max_steps: int, call: KernelCall
    ) -> tuple[int, BaseException | None]:
        """Return what the kernel returned, 0 if it has not, and the error that came: in a user's function, say."""
        n = 0
        try:
            arrays = self._arrays(place, agents, until, max_steps, call)
            n = self._play(place, arrays, call)
            errors = [error for own in self._python_calls if (error := own.take_error()) is not None]
            self._state.worlds[place].raise_pending()
            if not errors:
                raise_fault(type(self._learner).__name__, self._state.worlds[place].arrays, arrays)
            return n, errors[0] if errors else None
        except BaseException as error:  # noqa: BLE001  # raised when the episode is undone
            return n, error

    def _arrays(
        self, place: int, agents: Sequence[int], until: int, max_steps: int, call: KernelCall
    ) -> tuple[AgentArrays, ...]:
        masks, make = self._state.worlds[place].action_masks, self._learner.algorithm_state
        return tuple(self._state.agent(agent, until, max_steps, masks[i], make, call) for i, agent in enumerate(agents))

    def _play(self, place: int, arrays: tuple[AgentArrays, ...], call: KernelCall) -> int:
        world, is_shared = self._state.worlds[place], self._learner.problem.shares_world
        return call.run(play_together, world.arrays, arrays) if is_shared else call.run(play, world.arrays, arrays[0])

    def _undo(self, place: int, agents: Sequence[int], n_finished: int) -> None:
        """Go back to the end of the latest finished episode, as if the one after it had never begun."""
        state = self._state
        state.undo(place, agents)
        if n_finished and self._learner.problem.is_compiled:  # they were undone, too, and come to the same bits
            call = KernelCall(calls_python=False, is_replay=True)
            until = int(state.history.finished[agents[0]]) + n_finished
            self._play(place, self._arrays(place, agents, until, _UNLIMITED, call), call)

    def _warn_of_cap(self, agents: Sequence[int], first: int) -> None:
        """Warn once where an episode from the `first` on was as long as any may be, by a limit that nobody gave."""
        problem, state, longest = self._learner.problem, self._state, self._learner.problem.max_episode_steps
        if problem.is_capped and not state.was_capped and longest in state.history.steps_of(agents, first):
            state.was_capped = True
            warn(CAPPED.format(longest), StepCapWarning)

    def _close_window(self, step: TensorStepState) -> None:
        state = self._state
        result = step.close_window(state.weights, state.logs, state.history.returns, state.q)
        if not result.finite:
            state.history.drop_last()
            state.diverged_at = state.history.episodes
            return
        state.weights = result.weights
        state.share(result)
        step.begin_window(state.logs, state.q, result, state.history.episodes)
