"""Training one learner into a folder: the work behind ``tuckerl train``.

If the learner in a folder is not finished, its training goes on, to the same bits as if it had never stopped.
"""

import json
import math
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np

from tuckerl.adapters.making import make_environment
from tuckerl.adapters.resolve import Environment
from tuckerl.checks import check_int
from tuckerl.errors import EnvironmentFaultError, ParameterError, UnknownNameError
from tuckerl.learners.loading import load
from tuckerl.studies.environments import environment_of
from tuckerl.studies.training_config import TrainingConfig, build_learner
from tuckerl.studies.training_folder import AGENT, RUN, TrainingFolder, is_in_file
from tuckerl.training.callbacks.base import Callback
from tuckerl.training.evaluation import Evaluation
from tuckerl.training.learner import Learner
from tuckerl.types import FloatArray

_GOALS = ("episodes", "steps")


class TrainingResult(NamedTuple):
    """The result of a training."""

    episodes: int
    steps: int  # of all agents in all episodes
    rate: float  # steps per second, of all agents in this process; NaN where there were too few to say
    n_last: int  # episodes: the last tenth of all
    last_return: float  # their mean return; NaN without any
    last_by_agent: FloatArray  # (N,) the same by agent
    agents: tuple[str, ...]  # the names of those that share a world; none where each has a world of its own
    evaluation: Evaluation | None


class Training:
    """A learner and its folder.

    Parameters
    ----------
    config : TrainingConfig
    folder : Path
        Made if it is missing.
    resume : bool
        Whether to go on to other numbers of episodes or steps than the folder's.
    overwrite : bool
        Whether to begin anew, whatever the folder holds.

    Attributes
    ----------
    learner : Learner
    is_finished : bool
        Whether there is nothing left to learn.

    Raises
    ------
    UnknownNameError
        If there is no such algorithm or environment.
    ParameterError, ParameterTypeError
        If a setting or number is impossible, or there is nothing to resume.
    ProblemError
        If the environment cannot be made, or the algorithm cannot play it.
    OutputConflictError
        If the folder holds another agent.
    SavedFileError
        If its agent cannot be read.
    """

    def __init__(self, config: TrainingConfig, folder: Path, *, resume: bool = False, overwrite: bool = False) -> None:
        config = config.validate()
        if resume and overwrite:
            raise ParameterError("give --resume to go on or --overwrite to begin anew, not both")
        self.config = config
        self._environment = environment_of(config.environment, config.keywords)
        entries = config.to_dict()
        self._goal: dict[str, Any] = entries["goal"]
        self._folder = TrainingFolder(folder, entries)
        self._clock = _Clock()
        self.learner: Learner
        self.is_finished = False
        try:
            self._open(resume=resume, overwrite=overwrite)
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Let others write into the folder."""
        self._folder.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    @property
    def agent_file(self) -> Path:
        """Where the learner is saved."""
        return self._folder.agent_file

    def learn(self, *, checkpoint: int | None = None, progress: bool = False) -> None:
        """Learn what is left, and save; also what was learned before an error or Ctrl-C.

        Parameters
        ----------
        checkpoint : int, optional
            Save after every so many episodes, too.
        progress : bool
            Whether to show a progress bar on a terminal.

        Raises
        ------
        ParameterError, ParameterTypeError
            If `checkpoint` is not a whole number of at least 1.
        SimulatorError, EnvironmentFaultError
            If a simulator or an environment does something impossible.
        OutputError
            If a file cannot be written.
        """
        saving = [] if checkpoint is None else [_Saving(self.agent_file, check_int("checkpoint", checkpoint, 1))]
        try:
            left = self._left()
            if left:
                self.learner.learn(**left, callbacks=[self._clock, *saving], progress=progress)
        except BaseException as error:
            self._folder.save(self.learner, finished=False)
            if isinstance(error, EnvironmentFaultError):
                raise EnvironmentFaultError(f"{error}; saved in {self.agent_file}") from error
            raise
        self._folder.save(self.learner, finished=True)
        self.is_finished = True

    def result(self, n_evaluated: int) -> TrainingResult:
        """Return how it went, with an evaluation by `n_evaluated` greedy episodes, or none."""
        learner, evaluation = self.learner, None
        if n_evaluated and learner.diverged_at is None:
            evaluation = learner.evaluate(n_evaluated)
        last = last_returns(learner)
        n_last = len(last)
        by_agent = last.mean(axis=0) if n_last else np.full(last.shape[1], math.nan)
        return TrainingResult(
            learner.episodes,
            int(learner.steps.sum()),
            self._clock.rate,
            n_last,
            float(last.mean()) if n_last else math.nan,
            by_agent,
            names_of_agents(learner),
            evaluation,
        )

    def _open(self, *, resume: bool, overwrite: bool) -> None:
        """Make the learner, or load the folder's, and say in the folder that it is learning."""
        folder = self._folder
        held = None if overwrite else folder.held(resume=resume)
        if resume and held is None:
            raise ParameterError(f"{folder.path} holds no agent to go on with: leave --resume out")
        if held is not None and self.agent_file.exists():
            self.learner = load(self.agent_file, env=None if is_in_file(held["played"]) else self._environment)
            folder.check_agent(self.learner, held, resume=resume)
            self._check_goal()
            is_done = self.learner.diverged_at is not None or not self._left()
            self.is_finished = is_done and folder.is_finished(held)
        else:
            self.learner = build_learner(self.config, self._environment)
        if not self.is_finished:
            folder.begin(self.learner, anew=held is None)

    def _left(self) -> dict[str, int]:
        """Return the arguments of `learn` for what is left to learn; none where nothing is."""
        episodes, steps = (self._goal[name] for name in _GOALS)
        if episodes is not None:
            left = episodes - self.learner.episodes
            return {"episodes": left} if left > 0 else {}
        left = steps - self.learner.first_agent_steps
        if left > 0:
            return {"steps": left}
        # The first agent has done its steps; asking for one episode more lets the others catch up with it instead.
        return {} if self.learner.history.in_sync else {"episodes": 1}

    def _check_goal(self) -> None:
        history, (episodes, steps) = self.learner.history, (self._goal[name] for name in _GOALS)
        if episodes is not None and history.most_episodes > episodes:
            more = f"{history.most_episodes} episodes, more than the {episodes}"
        elif steps is not None and history.first_agent_steps - self._latest_steps() >= steps:
            more = f"{history.first_agent_steps} steps, an episode more than the {steps}"
        else:
            return
        raise ParameterError(
            f"{self._folder.path} holds {more} asked for: ask for more with --resume, or begin anew with --overwrite"
        )

    def _latest_steps(self) -> int:
        """Return the steps of the latest episode, as `first_agent_steps` counts them."""
        latest = self.learner.history.latest_steps
        return int(latest.max() if self.learner.problem.shares_world else latest[0])


class _Clock(Callback):
    """A clock that measures how fast a learner is from its first window on, which loads the kernels."""

    def __init__(self) -> None:
        super().__init__()
        self._first: tuple[float, int] | None = None
        self.rate = math.nan

    def on_window(self, learner: Learner) -> None:
        if self._first is None:
            self._first = time.perf_counter(), int(learner.steps.sum())

    def on_end(self, learner: Learner) -> None:
        if self._first is not None:
            seconds, steps = time.perf_counter() - self._first[0], int(learner.steps.sum()) - self._first[1]
            self.rate = steps / seconds if steps else math.nan


class _Saving(Callback):
    """A callback that saves a learner every so many episodes."""

    def __init__(self, path: Path, every: int) -> None:
        super().__init__(every)
        self._path = path

    def on_window(self, learner: Learner) -> None:
        learner.save(self._path)


def last_returns(learner: Learner) -> FloatArray:
    """Return the returns of the last tenth of what a learner has learned from, (episodes, agents)."""
    returns = learner.returns
    return returns[len(returns) - min(len(returns), max(1, len(returns) // 10)) :]


def names_of_agents(learner: Learner) -> tuple[str, ...]:
    """Return the names of the agents that share a learner's world; none where each has a world of its own."""
    return tuple(map(str, getattr(learner.problem, "agents", ()))) if learner.problem.shares_world else ()


def load_learner(path: Path, environment: str | None = None, keywords: Mapping[str, Any] = {}) -> Learner:
    """Return a saved learner; its environment is the given one, or that of the file or of ``run.json`` beside it.

    Raises
    ------
    SavedFileError
        If the file cannot be read, or an environment is needed and neither names it.
    ParameterError
        If the environment is not the one that the learner was saved with, or none is needed.
    UnknownNameError
        If there is no such environment.
    ProblemError
        If it cannot be made.
    """
    if environment is not None:
        make_environment(environment, keywords).close()
        return load(path, env=environment_of(environment, keywords))
    if keywords:
        raise ParameterError("keywords of the environment need its id: give --env with --env-set")
    try:
        return load(path, env=_environment_beside(path))
    except UnknownNameError as error:
        raise UnknownNameError(f"{error}; name what it learned on with --env") from error


def _environment_beside(path: Path) -> Environment | None:
    """Return the environment of the training that a file came from; None where that is not known or not needed."""
    try:
        run = json.loads((path.parent / RUN).read_bytes())
        name, keywords, played = run["environment"]["id"], run["environment"]["keywords"], run["played"]
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return None if path.name != AGENT or is_in_file(played) else environment_of(name, keywords)
