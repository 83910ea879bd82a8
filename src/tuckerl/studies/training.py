"""Training one learner into a folder: the work behind ``tuckerl train``.

``run.json`` holds the configuration, ``agent.tuckerl`` the learner as it was saved last, ``history.parquet`` the steps
and returns of its episodes. If the learner in a folder is not finished, its training goes on, to the same bits as if it
had never stopped.

The folder is locked meanwhile, and what it holds is believed only after it was checked. The agent is the truth about
how far it is: it must be of the training that ``run.json`` tells of, and the file that was written then, of which
``run.json`` keeps the digest wherever a training came to an orderly end. The history is written anew from the agent
where it is not the one that belongs to it.
"""

import hashlib
import io
import json
import math
import platform
import time
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple, Self

from tuckerl._version import __version__
from tuckerl.adapters.kinds import PROBLEM_KINDS
from tuckerl.adapters.making import make_environment
from tuckerl.adapters.resolve import Environment
from tuckerl.checks import check_int
from tuckerl.errors import EnvironmentFaultError, OutputConflictError, ParameterError, UnknownNameError
from tuckerl.files import delete_unfinished, make_folder, write_whole
from tuckerl.learners.loading import load
from tuckerl.studies.environments import environment_of
from tuckerl.studies.folder_lock import FolderLock
from tuckerl.studies.store import differences
from tuckerl.studies.training_config import TrainingConfig, build_learner
from tuckerl.training.callbacks.base import Callback
from tuckerl.training.evaluation import Evaluation
from tuckerl.training.learner import Learner
from tuckerl.training.schedules import as_json

AGENT, HISTORY, RUN = "agent.tuckerl", "history.parquet", "run.json"

_DECIDES = ("format", "algorithm", "environment", "settings", "quantile_bins", "agents", "seed")
"""What of ``run.json`` must be equal for the learner to be the same; other entries are for its readers."""
_GOALS = ("episodes", "steps")
_IDENTITY = ("played", "learner", "parameters", "tensor_step")
"""What ``run.json`` says of the learner that was made from all this."""


class TrainingResult(NamedTuple):
    """The result of a training."""

    episodes: int
    steps: int  # of all agents in all episodes
    rate: float  # steps per second, of all agents in this process; NaN where there were too few to say
    n_last: int  # episodes: the last tenth of all
    last_return: float  # their mean return; NaN without any
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
        self.config, self.folder = config, folder
        self._environment = environment_of(config.environment, config.keywords)
        self._entries = config.to_dict()
        self._lock = FolderLock(folder) if folder.is_dir() else None
        self._clock = _Clock()
        try:
            self._open(resume=resume, overwrite=overwrite)
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Let others write into the folder."""
        if self._lock is not None:
            self._lock.release()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    @property
    def agent_file(self) -> Path:
        """Where the learner is saved."""
        return self.folder / AGENT

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
            self._save(finished=False)
            if isinstance(error, EnvironmentFaultError):
                raise EnvironmentFaultError(f"{error}; saved in {self.agent_file}") from error
            raise
        self._save(finished=True)
        self.is_finished = True

    def result(self, n_evaluated: int) -> TrainingResult:
        """Return how it went, with an evaluation by `n_evaluated` greedy episodes, or none."""
        learner, evaluation = self.learner, None
        if n_evaluated and learner.diverged_at is None:
            evaluation = learner.evaluate(n_evaluated)
        returns = learner.returns
        n_last = min(len(returns), max(1, len(returns) // 10))
        last = float(returns[-n_last:].mean()) if n_last else math.nan
        return TrainingResult(learner.episodes, int(learner.steps.sum()), self._clock.rate, n_last, last, evaluation)

    def _open(self, *, resume: bool, overwrite: bool) -> None:
        """Make the learner, or load the folder's, and say in the folder that it is learning."""
        held = None if overwrite else self._saved_run(resume)
        if resume and held is None:
            raise ParameterError(f"{self.folder} holds no agent to go on with: leave --resume out")
        goes_on = held is not None and self.agent_file.exists()
        if held is not None and goes_on:
            self.learner = load(self.agent_file, env=None if _is_in_file(held["played"]) else self._environment)
            self._check_agent(held, resume=resume)
            self._check_goal()
        else:
            self.learner = build_learner(self.config, self._environment)
        self.is_finished = held is not None and goes_on and self._is_finished(held)
        if not self.is_finished:
            self._lock_new_folder()
            for name in (AGENT, HISTORY, RUN):
                delete_unfinished(self.folder / name)
            if held is None:
                make_folder(self.folder, without=(AGENT, HISTORY))
            self._write_run(finished=False)

    def _lock_new_folder(self) -> None:
        """Make and lock the folder where it was not there; then nobody else may have begun in it meanwhile."""
        if self._lock is None:
            make_folder(self.folder)
            self._lock = FolderLock(self.folder)
            if (self.folder / RUN).exists():
                raise OutputConflictError(
                    f"{self.folder} was made by another tuckerl train just now: give the command again, or choose "
                    "another folder with --out"
                )

    def _saved_run(self, resume: bool) -> dict[str, Any] | None:
        """Return what the folder's ``run.json`` says; None where there is no agent yet."""
        path = self.folder / RUN
        try:
            if not path.exists():
                if (self.folder / AGENT).exists():
                    raise _conflict(self.folder, f"{AGENT} without {RUN}")
                return None
            held: dict[str, Any] = json.loads(path.read_bytes())
            there, here = ({name: run.get(name) for name in _DECIDES} for run in (held, self._entries))
            is_whole = {"goal", "finished", *_IDENTITY} <= held.keys() and isinstance(held["parameters"], dict)
        except (OSError, ValueError, AttributeError) as error:
            if isinstance(error, OutputConflictError):
                raise
            raise _conflict(self.folder, f"its {RUN} cannot be read") from error
        difference = next(differences(there, here, ""), "" if is_whole else f"its {RUN} lacks something")
        if difference:
            raise _conflict(self.folder, difference)
        if not resume and held["goal"] != self._entries["goal"]:
            goals = f"{_goal_words(held['goal'])} there and {_goal_words(self._entries['goal'])} now"
            raise OutputConflictError(
                f"{self.folder} holds the same agent for another goal ({goals}): --resume goes on with it to the new "
                "one, --overwrite begins anew"
            )
        return held

    def _left(self) -> dict[str, int]:
        """Return the arguments of `learn` for what is left to learn; none where nothing is."""
        episodes, steps = (self._entries["goal"][name] for name in _GOALS)
        if episodes is not None:
            left = episodes - self.learner.episodes
            return {"episodes": left} if left > 0 else {}
        left = steps - self.learner.first_agent_steps
        if left > 0:
            return {"steps": left}
        # The first agent has done its steps; asking for one episode more lets the others catch up with it instead.
        return {} if self.learner.history.in_sync else {"episodes": 1}

    def _check_agent(self, held: Mapping[str, Any], *, resume: bool) -> None:
        """Refuse an agent that is not the one that ``run.json`` tells of.

        Raises
        ------
        OutputConflictError
            If that is so.
        """
        sequence = self.learner.seed_sequence
        there = _flat(_plain(_identity(self.learner))) | {
            "seed": sequence.entropy,
            "spawn_key": list(sequence.spawn_key),
        }
        here = _flat(held) | {"seed": self.config.seed, "spawn_key": []}
        for name in (name for name in there if name in here):  # another version may have written down others
            if there[name] != here[name]:
                values = f"{json.dumps(there[name])} in {AGENT} and {json.dumps(here[name])} in {RUN}"
                raise _conflict(self.folder, f"{name} is {values}")
        saved = held.get("saved")
        if saved and not resume and _digest(self.agent_file) != saved[AGENT]:
            raise OutputConflictError(
                f"{self.agent_file} is not the file that the training wrote, of which {RUN} has the digest: put that "
                "back, go on from this one with --resume, or begin anew with --overwrite"
            )

    def _check_goal(self) -> None:
        history, (episodes, steps) = self.learner.history, (self._entries["goal"][name] for name in _GOALS)
        if episodes is not None and history.most_episodes > episodes:
            more = f"{history.most_episodes} episodes, more than the {episodes}"
        elif steps is not None and history.first_agent_steps - int(history.latest_steps[0]) >= steps:
            more = f"{history.first_agent_steps} steps, an episode more than the {steps}"
        else:
            return
        raise ParameterError(
            f"{self.folder} holds {more} asked for: ask for more with --resume, or begin anew with --overwrite"
        )

    def _is_finished(self, held: Mapping[str, Any]) -> bool:
        """Return whether the folder holds this training's end: nothing is left, and all its files are those of then."""
        if held["goal"] != self._entries["goal"] or not held["finished"]:
            return False
        is_done = self.learner.diverged_at is not None or not self._left()
        return is_done and held.get("saved") == self._digests()

    def _digests(self) -> dict[str, str | None]:
        return {name: _digest(self.folder / name) for name in (AGENT, HISTORY)}

    def _write_run(self, *, finished: bool, saved: Mapping[str, str | None] | None = None) -> None:
        """Write ``run.json``; `saved` has the digests of the files beside it, as long as these stay as they are."""
        entries = self._entries | _identity(self.learner) | {"finished": finished, "saved": saved}
        write_whole(self.folder / RUN, json.dumps(entries | {"versions": _versions()}, indent=1).encode() + b"\n")

    def _save(self, *, finished: bool) -> None:
        self.learner.save(self.agent_file)
        buffer = io.BytesIO()
        self.learner.to_frame().write_parquet(buffer)
        write_whole(self.folder / HISTORY, buffer.getvalue())
        self._write_run(finished=finished, saved=self._digests())


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
    return None if path.name != AGENT or _is_in_file(played) else environment_of(name, keywords)


_OLD_KINDS = {"lifted": "table"}
"""What older folders call the kinds of problems."""


def _is_in_file(kind: str) -> bool:
    """Return whether a saved learner holds all of its problem, which is then not given to `load`."""
    kind = _OLD_KINDS.get(kind, kind)
    return kind in PROBLEM_KINDS and PROBLEM_KINDS[kind].load().is_data


def _identity(learner: Learner) -> dict[str, Any]:
    """Return the entries of `_IDENTITY`."""
    return {
        "played": learner.problem.kind,
        "learner": type(learner).__name__,
        "parameters": {name: as_json(value) for name, value in learner.parameters.items()},
        "tensor_step": None if learner.tensor_step is None else vars(learner.tensor_step),
    }


def _flat(identity: Mapping[str, Any]) -> dict[str, Any]:
    """Return the entries of `_IDENTITY`, as they are read from JSON, in one dict."""
    step, played = identity["tensor_step"], identity["played"]
    names = {"learner": identity["learner"], "played": _OLD_KINDS.get(played, played), "tensor_step": step is not None}
    flat: dict[str, Any] = names | identity["parameters"] | (step or {})
    return flat


def _plain(entries: Mapping[str, Any]) -> dict[str, Any]:
    """Return entries as they are read back from JSON."""
    plain: dict[str, Any] = json.loads(json.dumps(entries))
    return plain


def _digest(path: Path) -> str | None:
    """Return the SHA-256 of a file; None where it cannot be read."""
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError:
        return None


def _versions() -> dict[str, str]:
    libraries = ("numpy", "numba", "scipy", "gymnasium", "pettingzoo")
    return {"tuckerl": __version__, "python": platform.python_version(), **{name: version(name) for name in libraries}}


def _goal_words(goal: Mapping[str, int | None]) -> str:
    return next(f"{number} {name}" for name, number in goal.items() if number is not None)


def _conflict(folder: Path, difference: str) -> OutputConflictError:
    return OutputConflictError(
        f"{folder} holds another agent ({difference}): choose another folder with --out, or replace it with --overwrite"
    )
