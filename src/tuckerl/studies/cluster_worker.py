"""What is sent to a cluster's workers, and what they do with it: show that their code is the same, and play runs."""

import socket
import sys
import threading
import time
from pathlib import Path
from typing import NamedTuple

from threadpoolctl import threadpool_limits

from tuckerl.errors import WorkerError
from tuckerl.studies.environments import environment_specification
from tuckerl.studies.executed_code import BLAS, changes, executed_code
from tuckerl.studies.playing import warm_up
from tuckerl.studies.runs import run_code
from tuckerl.studies.study import Study
from tuckerl.studies.workers import Played, Task, play_task

_MOST_STUDIES = 16  # that a worker knows; one that is asked for a forgotten one says so, and is sent it again

_studies: dict[str, Study] = {}  # that this worker is ready for, by the name of who plays it
_one_run = threading.Lock()  # at a time in a process: environments in Python are shared by its learners


class Sent(NamedTuple):
    """A study, and the code that its results follow from."""

    study: bytes
    code: dict[str, str]


def sent(study: Study) -> Sent:
    """Return what a worker is sent of a study.

    Raises
    ------
    WorkerError
        If something in it cannot be sent.
    """
    from distributed.protocol.pickle import dumps

    try:
        content: bytes = dumps(study)
    except Exception as error:
        raise WorkerError(
            f"the study cannot be sent to workers ({error}): let its problem be a function or a class of a module that "
            "they can import, without open files, locks or the like"
        ) from error
    return Sent(content, _code_of(study))


def _code_of(study: Study) -> dict[str, str]:
    """Return the code that a study's runs execute, but for the program that was started, which is sent whole."""
    code: dict[str, str] = {}
    for scenario in study.scenarios:
        for variant in scenario.variants:
            code |= run_code(scenario, variant)
        if scenario.environment:
            name, keywords = scenario.environment["id"], scenario.environment["keywords"]
            code[f"environment {name}"] = str(environment_specification(name, keywords)["sources"])
    program = Path(getattr(sys.modules["__main__"], "__file__", None) or "").name
    return {name: digest for name, digest in code.items() if name != program or not name.endswith(".py")}


def prepare(name: str, content: Sent) -> str:
    """Make this worker ready to play a study's runs; return why it cannot, "" where it can.

    Parameters
    ----------
    name : str
        By which `play` is asked for it.
    content : Sent
    """
    with _one_run:
        try:
            why = _prepare(name, content)
        except Exception as error:  # noqa: BLE001  # whatever the user's module does when it is imported
            why = (
                f"{type(error).__name__}: {error}; let it find the study's modules, by PYTHONPATH or by starting it in "
                "their folder, and let them register their environments (MODULE:ID)"
            )
    return why and f"on {socket.gethostname()}, {why}"


def _prepare(name: str, content: Sent) -> str:
    from distributed.protocol.pickle import loads

    threadpool_limits(1)  # for good: more of them would add in another order
    versions = executed_code([])
    why = changes(versions, {one: content.code[one] for one in versions}, "here")
    if versions[BLAS] != content.code[BLAS]:
        why[-1] += ": start all, also the study, with the same OPENBLAS_CORETYPE"
    if not why:  # only now: other versions may not even read it
        study = loads(content.study)
        warm_up(study)
        why = changes(_code_of(study), content.code, "here")
        if why:
            why[-1] += ": bring it up to date, and start it again"
    if not why:
        while len(_studies) >= _MOST_STUDIES:
            del _studies[next(iter(_studies))]
        _studies[name] = study
    return "; ".join(why)


class Left(NamedTuple):
    """What came of a piece, and how long it took."""

    played: list[Played]
    seconds: float


def play(name: str, tasks: tuple[Task, ...]) -> Left | None:
    """Return what comes of tasks; None where this worker was not made ready for the study."""
    study = _studies.get(name)
    if study is None:
        return None
    with _one_run:
        begun = time.monotonic()
        return Left([play_task(study, task) for task in tasks], time.monotonic() - begun)
