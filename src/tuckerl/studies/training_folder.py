"""The folder of a training: what it may hold, whether that is what was written, and whose it is.

``run.json`` holds the configuration, ``agent.tuckerl`` the learner as it was saved last, ``history.parquet`` the steps
and returns of its episodes. The folder is locked while a training has it, and what it holds is believed only after it
was checked. The agent is the truth about how far it is: it must be of the training that ``run.json`` tells of, and the
file that was written then, of which ``run.json`` keeps the digest wherever a training came to an orderly end.
"""

import hashlib
import io
import json
import platform
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any

from tuckerl._version import __version__
from tuckerl.adapters.kinds import PROBLEM_KINDS
from tuckerl.errors import OutputConflictError, SavedFileMissingError
from tuckerl.files import delete_unfinished, make_folder, write_whole
from tuckerl.studies.folder_lock import FolderLock
from tuckerl.studies.study_differences import differences
from tuckerl.training.learner import Learner
from tuckerl.training.parameter_json import in_words

AGENT, HISTORY, RUN = "agent.tuckerl", "history.parquet", "run.json"

_DECIDES = ("format", "algorithm", "environment", "settings", "quantile_bins", "agents", "seed")
"""What of ``run.json`` must be equal for the learner to be the same; other entries are for its readers."""
_IDENTITY = ("played", "learner", "parameters", "tensor_step")
"""What ``run.json`` says of the learner that was made from all this."""
_OLD_KINDS = {"lifted": "table"}
"""What older folders call the kinds of problems."""


class TrainingFolder:
    """A folder, and the right to write into it, until `close`.

    Parameters
    ----------
    path : Path
        It need not be there.
    entries : dict
        What ``run.json`` is to say of the configuration.

    Raises
    ------
    OutputConflictError
        If another process has it.
    OutputError
        If it cannot be locked.
    """

    def __init__(self, path: Path, entries: Mapping[str, Any]) -> None:
        self.path, self._entries = path, entries
        self._lock = FolderLock(path) if path.is_dir() else None

    @property
    def agent_file(self) -> Path:
        """Where the learner is saved."""
        return self.path / AGENT

    def close(self) -> None:
        """Let others write into it."""
        if self._lock is not None:
            self._lock.release()

    def held(self, *, resume: bool) -> dict[str, Any] | None:
        """Return what ``run.json`` says; None where there is no agent yet.

        Raises
        ------
        OutputConflictError
            If it cannot be read, or is of another configuration, or has another goal and `resume` is False.
        """
        path = self.path / RUN
        try:
            if not path.exists():
                if self.agent_file.exists():
                    raise self._conflict(f"{AGENT} without {RUN}")
                return None
            held: dict[str, Any] = json.loads(path.read_bytes())
            there, here = ({name: run.get(name) for name in _DECIDES} for run in (held, self._entries))
            is_whole = {"goal", "finished", *_IDENTITY} <= held.keys() and isinstance(held["parameters"], dict)
        except (OSError, ValueError, AttributeError) as error:
            if isinstance(error, OutputConflictError):
                raise
            raise self._conflict(f"its {RUN} cannot be read") from error
        difference = next(differences(there, here, ""), "" if is_whole else f"its {RUN} lacks something")
        if difference:
            raise self._conflict(difference)
        if not resume and held["goal"] != self._entries["goal"]:
            goals = f"{_goal_words(held['goal'])} there and {_goal_words(self._entries['goal'])} now"
            raise OutputConflictError(
                f"{self.path} holds the same agent for another goal ({goals}): --resume goes on with it to the new "
                "one, --overwrite begins anew"
            )
        return held

    def check_agent(self, learner: Learner, held: Mapping[str, Any], *, resume: bool) -> None:
        """Refuse an agent that is not the one that ``run.json`` tells of, or not the file that was written.

        Raises
        ------
        OutputConflictError
            If that is so.
        """
        sequence = learner.seed_sequence
        identity = json.loads(json.dumps(_identity(learner)))
        there = _flat(identity) | {"seed": sequence.entropy, "spawn key": [*sequence.spawn_key]}
        here = _flat(held) | {"seed": self._entries["seed"], "spawn key": []}
        for name in (name for name in there if name in here):  # another version may have written down others
            if there[name] != here[name]:
                values = f"{json.dumps(there[name])} in {AGENT} and {json.dumps(here[name])} in {RUN}"
                raise self._conflict(f"{name} is {values}")
        saved = held.get("saved")
        if saved and not resume and saved != self._digests() | {HISTORY: saved.get(HISTORY)}:
            raise OutputConflictError(
                f"{self.agent_file} is not the file that the training wrote, of which {RUN} has the digest: put that "
                "back, go on from this one with --resume, or begin anew with --overwrite"
            )

    def is_finished(self, held: Mapping[str, Any]) -> bool:
        """Return whether ``run.json`` says that this goal was reached, and the files are those of then."""
        is_same = held["goal"] == self._entries["goal"] and held.get("saved") == self._digests()
        return is_same and bool(held["finished"])

    def begin(self, learner: Learner, *, anew: bool) -> None:
        """Make and lock the folder where it was not there, and write that a learner is learning, perhaps `anew`.

        Raises
        ------
        OutputError
            If that cannot be done.
        OutputConflictError
            If another training has begun in it meanwhile.
        """
        if self._lock is None:
            make_folder(self.path)
            self._lock = FolderLock(self.path)
            if (self.path / RUN).exists():
                raise OutputConflictError(
                    f"{self.path} was made by another tuckerl train just now: give the command again, or choose "
                    "another folder with --out"
                )
        for name in (AGENT, HISTORY, RUN):
            delete_unfinished(self.path / name)
        if anew:
            make_folder(self.path, without=(AGENT, HISTORY))
        self._write_run(learner, finished=False, saved=None)

    def save(self, learner: Learner, *, finished: bool) -> None:
        """Write the agent, its history and, last, ``run.json``.

        Raises
        ------
        OutputError
            If that cannot be done.
        """
        learner.save(self.agent_file)
        buffer = io.BytesIO()
        learner.to_frame().write_parquet(buffer)
        write_whole(self.path / HISTORY, buffer.getvalue())
        self._write_run(learner, finished=finished, saved=self._digests())

    def _write_run(self, learner: Learner, *, finished: bool, saved: Mapping[str, str | None] | None) -> None:
        """Write ``run.json``; `saved` has the digests of the files beside it, as long as these stay as they are."""
        entries = {**self._entries, **_identity(learner), "finished": finished, "saved": saved, "versions": _versions()}
        write_whole(self.path / RUN, json.dumps(entries, indent=1).encode() + b"\n")

    def _digests(self) -> dict[str, str | None]:
        return {name: _digest(self.path / name) for name in (AGENT, HISTORY)}

    def _conflict(self, difference: str) -> OutputConflictError:
        return OutputConflictError(
            f"{self.path} holds another agent ({difference}): choose another folder with --out, or replace it with "
            "--overwrite"
        )


def agent_at(place: Path) -> Path:
    """Return the file of a saved agent: `place`, or the agent in the folder that `place` is.

    Raises
    ------
    SavedFileMissingError
        If the folder holds no agent; a study's folder is named as such.
    """
    if not place.is_dir() or (place / AGENT).is_file():
        return place / AGENT if place.is_dir() else place
    page = place / "report.html"
    if (place / "study.json").exists():
        look = f"open {page}" if page.exists() else f"`tuckerl study report {place}` writes its report"
        raise SavedFileMissingError(
            f"{place} holds the runs of a study, whose agents are not kept: {look}, or keep one with `tuckerl train`"
        )
    raise SavedFileMissingError(f"the folder {place} holds no {AGENT}: name one that `tuckerl train` made, or a file")


def is_in_file(kind: str) -> bool:
    """Return whether a saved learner holds all of its problem, which is then not given to `load`."""
    kind = _OLD_KINDS.get(kind, kind)
    return kind in PROBLEM_KINDS and PROBLEM_KINDS[kind].load().is_data


def _identity(learner: Learner) -> dict[str, Any]:
    """Return the entries of `_IDENTITY`."""
    return {
        "played": learner.problem.kind,
        "learner": type(learner).__name__,
        "parameters": {name: in_words(value) for name, value in learner.parameters.items()},
        "tensor_step": None if learner.tensor_step is None else vars(learner.tensor_step),
    }


def _flat(identity: Mapping[str, Any]) -> dict[str, Any]:
    """Return the entries of `_IDENTITY`, as they are read from JSON, in one dict."""
    step, played = identity["tensor_step"], identity["played"]
    names = {"learner": identity["learner"], "played": _OLD_KINDS.get(played, played), "tensor_step": step is not None}
    flat: dict[str, Any] = names | identity["parameters"] | (step or {})
    return flat


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
