"""What every learner is: parameters checked once, tables for N agents, and a loop over windows of episodes.

A learner's own file holds its update, its kernel and a thin class that says how one agent plays the next episodes.
Everything else is here: seeds, the window loop with its tensor step, accounts, prediction, and saving.
"""

import sys
import warnings
from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from typing import Any, Self

import numpy as np

from tuckerl._version import __version__
from tuckerl.adapters.kinds import restore_problem, save_problem
from tuckerl.adapters.resolve import Environment
from tuckerl.checks import check_int
from tuckerl.errors import DivergenceWarning, ParameterError, SavedFileError, StepCapWarning
from tuckerl.generalization.change_log import restore_log, saved_log
from tuckerl.generalization.sharing import share_tables
from tuckerl.generalization.step import TensorStep, TensorStepState
from tuckerl.interrupts import interrupts_held_back
from tuckerl.training import learner_file as saved
from tuckerl.training.agent_arrays import Agent, Record
from tuckerl.training.callbacks.base import CallbackLike, CallbackList, Goal
from tuckerl.training.evaluation import CAPPED
from tuckerl.training.loop import play, play_together
from tuckerl.training.persistence import (
    restored_parameters,
    restored_seed,
    restored_step,
    seed_parts,
    step_parts,
    stored_parameters,
)
from tuckerl.training.tables import Tables
from tuckerl.types import FloatArray

_DIVERGED = "a table left the finite numbers in episode {}, where learning stopped: a smaller alpha may keep it finite"
_PATIENCE = 0.25  # seconds in which Python is not asked, but for the end of an episode
_UNLIMITED = sys.maxsize
# Ctrl-C and callbacks wait for one call of a kernel, which costs as much as a thousand steps.
_CHUNK, _CHUNK_STEPS = 1000, 1_000_000  # episodes without a tensor step; steps of the first agent, and its episode


class Learner(Tables):
    """A tabular learner of N agents, each in its own copy of the problem.

    Parameters
    ----------
    env
        A Gymnasium environment or PettingZoo parallel environment: its id, an instance or a callable that makes one; or
        a :class:`~tuckerl.TabularMDP`, a :class:`~tuckerl.Simulator` or a :class:`~tuckerl.Maze`. Every agent of a
        PettingZoo environment has a table of its own, and `n_agents` stays 1; :class:`~tuckerl.TeamQ` has one for all.
    alpha : float in (0, 1] or Schedule
        Learning rate; a schedule such as ``tuckerl.Harmonic(0.5, half_after=1000)`` changes it from episode to episode.
    gamma : float in [0, 1]
        Discount.
    epsilon : float in [0, 1] or Schedule
        Probability of a random action.
    epsilon_decay : float in [0, 1]
        Multiplies epsilon after each episode.
    ties : "random" or "first"
        Which of several maximal actions is greedy.
    initial_q : float or (S, A) array
        The tables' first values; high ones are an optimistic start, which explores.
    n_agents : int
    bootstrap_terminal : bool
        Whether a terminal state's value counts as any other's (some older programs did so); by default it is 0.
    tensor_step : TensorStep, optional
        None is the unmodified algorithm; with a step it is the paper's T-version.
    seed : int or SeedSequence, optional
        Agent j draws from its child j. None takes a fresh seed.
    bins : int, sequence, ...
        How observations that are a Box are cut into bins: a number for every dimension, or for each dimension a number
        or the edges between its bins. Of a PettingZoo environment's agents, that for all or by agent.
    compiled : "auto" or bool
        Whether an environment whose transition table can be extracted is played from it, in compiled code ("auto", the
        default), or every step is taken in Python (False); True is refused where it cannot be extracted.

    Raises
    ------
    ParameterError, ParameterTypeError, UnknownNameError
        If a parameter is out of its range, of the wrong type or not a known name.
    ProblemError
        If `env` is no problem that this learner can play.
    """

    def learn(
        self,
        episodes: int | None = None,
        *,
        steps: int | None = None,
        callbacks: Sequence[CallbackLike] = (),
        progress: bool = False,
    ) -> Self:
        """Play and learn more episodes with every agent.

        Learning 50 and then 50 equals learning 100, to the last bit. A run whose tables leave the finite numbers
        stops there, with a :class:`~tuckerl.errors.DivergenceWarning`; see `diverged_at`. Ctrl-C is heard at the end of
        an episode; pressed twice, at the next step of an environment that is stepped in Python.

        Parameters
        ----------
        episodes : int, optional
            How many; or ...
        steps : int, optional
            ... stop after the episode in which the first agent has done so many more steps.
        callbacks : sequence of Callback or callable
            Called at the end of every window of episodes. A callable takes the learner; if it returns False, learning
            ends.
        progress : bool
            Whether to show a progress bar on a terminal.

        Raises
        ------
        ParameterError, ParameterTypeError
            If neither or both of `episodes` and `steps` are given, or one is not a whole number of at least 1.
        SimulatorError, EnvironmentFaultError
            If a simulator or an environment does something impossible. What was learned before is kept.
        """
        goal = self._goal(episodes, steps)
        with CallbackList(self, callbacks, goal, progress=progress) as followers:
            while self.diverged_at is None and followers.go_on and not self._is_done(goal):
                try:
                    with interrupts_held_back():
                        self._advance(min(goal.episodes, followers.next_stop()), goal.steps)
                finally:  # Ctrl-C is heard above; the window that it waited for may have ended
                    followers.follow()
        if self.diverged_at is not None:
            warnings.warn(_DIVERGED.format(self.diverged_at), DivergenceWarning, stacklevel=2)
        return self

    def _advance(self, until: int, n_steps: int) -> None:
        """Play on, and take the tensor step where a window has ended (or is owed, as a user's function raised)."""
        due = self._due_step()
        if due is None:
            self._play_on(until, n_steps - self._accounts.first_steps)
            due = self._due_step()
        if due is not None and self.diverged_at is None:
            self._generalize(due)

    def _goal(self, episodes: int | None, steps: int | None) -> Goal:
        """Return the numbers of episodes and of the first agent's steps at which learning ends."""
        if (episodes is None) == (steps is None):
            raise ParameterError(f"learn() takes either episodes or steps; got episodes={episodes} and steps={steps}")
        if episodes is not None:
            return Goal(self.episodes + check_int("episodes", episodes, 1), _UNLIMITED)
        return Goal(_UNLIMITED, self._accounts.first_steps + check_int("steps", steps, 1))

    def _is_done(self, goal: Goal) -> bool:
        reached = self.episodes >= goal.episodes or self._accounts.first_steps >= goal.steps
        return reached and self._accounts.is_even and self._due_step() is None

    def _due_step(self) -> TensorStepState | None:
        """Return the tensor step if a window has ended and it has not followed yet (a user's function may raise)."""
        run = self._run
        return run if run is not None and run.n_windows < self.episodes // run.step.every else None

    @property
    def is_saveable(self) -> bool:
        """Whether it is intact, all agents are at one episode, and the tensor step of the latest window is done."""
        return self.is_intact and self._accounts.is_even and self._due_step() is None

    def _play_on(self, until: int, enough: int) -> None:
        """Play up to an episode or until the first agent has made `enough` steps, or let those behind catch up."""
        accounts = self._accounts
        chunk = _CHUNK if self._run is None else self._run.step.every
        until, enough = min(until, self.episodes + chunk - self.episodes % chunk), min(enough, _CHUNK_STEPS)
        if not accounts.is_even:
            until, enough = accounts.furthest, _UNLIMITED
        finite = True
        if self.problem.shares_world:
            finite = self._play_world(0, list(range(self.n_tables)), until, enough)
        else:
            for table in range(self.n_tables):
                finite &= self._play_world(table, [table], until, enough)
                until, enough = max(accounts.furthest, self.episodes), _UNLIMITED
        if not finite:
            self.diverged_at = self.episodes

    def _play_world(self, place: int, tables: list[int], until: int, enough: int) -> bool:
        """Let the agents of a world play; return whether their tables stayed finite."""
        accounts, world = self._accounts, self._worlds[place]
        before = int(accounts.done[tables[0]])
        if until <= before:
            return True
        agents = tuple(self._agent(table, until, enough, world.action_masks[i]) for i, table in enumerate(tables))
        world.set_deadline(_PATIENCE)
        n = play_together(world.arrays, agents) if self.problem.shares_world else play(world.arrays, agents[0])
        accounts.add(tables, n if n >= 0 else -1 - n)
        torn, self._is_torn[tables] = self._is_torn[tables] & (n == 0), True
        world.raise_pending()
        self._is_torn[tables] = torn
        longest = max(int(agent.record.steps[: max(n, 0)].max(initial=0)) for agent in agents)
        if self.problem.is_capped and longest == self.problem.max_episode_steps and not self._was_capped:
            self._was_capped = True
            warnings.warn(CAPPED.format(longest), StepCapWarning, stacklevel=5)
        return n >= 0

    def _agent(self, table: int, until: int, enough: int, action_mask: Any) -> Agent:
        chunk = slice(int(self._accounts.done[table]), until)
        steps, returns = self._accounts.room(table, until)
        alpha, epsilon = (numbers[chunk] for numbers in self._course(until))
        return Agent(
            method=self._method(table),
            q=self._q[table],
            weights=self._weights,
            step_sizes=self._step_sizes[table],
            action_mask=action_mask,
            settings=self._settings,
            log=self._logs[table],
            record=Record(steps, returns, self._trajectory[table], alpha, epsilon, enough),
            rng=self._streams[table],
        )

    def _generalize(self, run: TensorStepState) -> None:
        window = self._accounts.returns[:, self.episodes - run.step.every :].T.copy()
        outcome = run.close_window(self.episodes, self._weights, self._logs, window)
        if not outcome.finite:
            self._accounts.drop_last()
            self.diverged_at = self.episodes
            return
        self._weights = outcome.weights
        if outcome.mixture is not None and self.n_tables > 1:
            self._share(outcome.mixture)
        if run.step.needs_decomposition:
            run.snapshots.restart(self._logs, self._q)

    def _share(self, mixture: FloatArray) -> None:
        """Let every agent go on with the mixture of all tables."""
        known = self._run.snapshots.states if self._run is not None and self._run.step.needs_decomposition else None
        share_tables(self._q, mixture, known)

    def save(self, path: str | PathLike[str]) -> None:
        """Write everything that is needed to go on, to the last bit, into one file (no pickle).

        Raises
        ------
        OutputError
            If it cannot be written.
        """
        problem_header, problem_arrays = save_problem(self.problem)
        header = {
            "tuckerl": __version__,
            "learner": type(self).__name__,
            "problem": problem_header,
            "parameters": stored_parameters(self._parameters()),
            "tensor_step": step_parts(self.tensor_step),
            "seed": seed_parts(self._sequence),
            "prediction_rng": self._prediction_rng.bit_generator.state,
            "diverged_at": self.diverged_at,
            "worlds": [world.saved() for world in self._worlds],
        }
        arrays = saved.with_prefix("problem", problem_arrays) | self._saved_arrays()
        saved.write(Path(path), header, arrays)

    @classmethod
    def load(
        cls,
        path: str | PathLike[str],
        *,
        env: Environment | None = None,
        tensor_step: TensorStep | None = None,
    ) -> Self:
        """Return the learner that `save` wrote.

        What is code is in no file: `env` is needed where the problem is a simulator or an environment that is stepped
        in Python and was not named by its id, `tensor_step` where the saved one used functions of the user's own; both
        as they were.

        Raises
        ------
        SavedFileError
            If the file is truncated, damaged, of another kind or learner, or of a newer version.
        ParameterError
            If `env` or `tensor_step` is not the one that it was saved with.
        FileNotFoundError
            If there is none.
        """
        header, arrays = saved.read(Path(path))
        if header["learner"] != cls.__name__:
            held = header["learner"]
            raise SavedFileError(f"{path} holds a {held}, not a {cls.__name__}: load it with {held}.load")
        parameters = restored_parameters(header["parameters"])
        problem_arrays = saved.of_prefix("problem", arrays)
        learner = cls(
            restore_problem(header["problem"], problem_arrays, env, Path(path), cls.reading_of(parameters)),
            **parameters,
            **cls._array_parameters(arrays),
            tensor_step=restored_step(header["tensor_step"], tensor_step, Path(path)),
            seed=restored_seed(header["seed"]),
        )
        learner.diverged_at = header["diverged_at"]
        learner._prediction_rng.bit_generator.state = header["prediction_rng"]
        learner._restore_arrays(arrays)
        for world, state in zip(learner._worlds, header.get("worlds", ()), strict=False):  # format 1 had none
            world.restore(state)
        return learner

    @classmethod
    def _array_parameters(cls, arrays: saved.Arrays) -> dict[str, Any]:
        """Return the parameters that the constructor takes as arrays."""
        initial_q = arrays["initial_q"]
        return {"initial_q": float(initial_q) if initial_q.ndim == 0 else initial_q}

    def _saved_arrays(self) -> saved.Arrays:
        """Return all that learning changes, and the parameters that are arrays."""
        uniform = self._initial_q.strides == (0, 0)
        # Of every table, also of one that is ahead of others; none where an error broke off somebody's latest episode.
        sizes = self._accounts.latest_steps[:, np.newaxis] + 1 if self.is_intact else np.zeros((1, 1), dtype=np.int64)
        trajectory = self._trajectory[:, : sizes.max()].copy()
        trajectory *= np.arange(trajectory.shape[1]) < sizes  # what earlier episodes left behind its end
        arrays: saved.Arrays = {
            "initial_q": self._initial_q[0, 0] if uniform else self._initial_q,
            "q": self._q,
            "weights": self._weights,
            "trajectory": trajectory,
            "streams": np.stack(self._streams),
        }
        arrays |= self._accounts.saved()
        for table, log in enumerate(self._logs):
            arrays |= saved.with_prefix(f"log{table}", saved_log(log))
        for table, mask in enumerate(mask for world in self._worlds for mask in world.action_masks):
            arrays[f"forbidden{table}"] = ~mask
        return arrays if self._run is None else arrays | saved.with_prefix("step", self._run.saved())

    def _restore_arrays(self, arrays: saved.Arrays) -> None:
        """Go on from what `_saved_arrays` returned."""
        self._q, self._weights = arrays["q"], arrays["weights"]
        self._accounts.restore(arrays)
        self._trajectory[:, : arrays["trajectory"].shape[1]] = arrays["trajectory"]
        self._is_torn[:] = self._accounts.furthest > 0 and arrays["trajectory"].size == 0
        self._streams = list(arrays["streams"])
        for table, log in enumerate(self._logs):
            restore_log(log, saved.of_prefix(f"log{table}", arrays))
        for table, mask in enumerate(mask for world in self._worlds for mask in world.action_masks):
            if mask.flags.writeable and f"forbidden{table}" in arrays:
                mask[...] = ~arrays[f"forbidden{table}"]
        if self._run is not None:
            self._run.restore(saved.of_prefix("step", arrays))
