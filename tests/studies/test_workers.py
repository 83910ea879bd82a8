"""Workers end with the process that started them, and at once where Ctrl-C is pressed again."""

import multiprocessing
import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from tuckerl.studies import runner
from tuckerl.studies.runner import all_tasks, play_tasks
from tuckerl.studies.study import Study

ROOT = Path(__file__).parents[2]


@pytest.mark.long
@pytest.mark.skipif(os.name == "nt", reason="a process cannot send another one Ctrl-C there")
@pytest.mark.parametrize("signals", [[signal.SIGKILL], [signal.SIGINT, signal.SIGINT]] if os.name != "nt" else [])
def test_no_worker_outlives_its_parent(signals: list[signal.Signals]) -> None:
    command = [sys.executable, "-m", "tests.studies.endless_study"]
    with subprocess.Popen(
        command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, start_new_session=True
    ) as process:
        assert process.stdout is not None
        try:
            assert process.stdout.readline() == "playing\n"
            for one in signals:
                process.send_signal(one)
                time.sleep(0.5)
            process.communicate(timeout=20)  # until no process has its output open any more
        finally:
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
    assert process.returncode != 0


class _Impatient:
    """A pool whose tasks never end, and whose end is not waited for."""

    def __init__(self, *given: Any) -> None: ...

    def submit(self, *task: Any) -> Any:
        raise KeyboardInterrupt

    def shutdown(self, **how: Any) -> None:
        raise KeyboardInterrupt


class _Worker:
    killed = False

    def kill(self) -> None:
        self.killed = True


def test_only_workers_are_killed_where_their_end_is_not_waited_for(
    study: Study, monkeypatch: pytest.MonkeyPatch
) -> None:
    others, workers = _Worker(), [_Worker(), _Worker()]
    children = iter([[others], [others, *workers]])
    monkeypatch.setattr(runner, "ProcessPoolExecutor", _Impatient)
    monkeypatch.setattr(runner, "_warm_up", lambda study: None)
    monkeypatch.setattr(multiprocessing, "active_children", lambda: next(children))
    with pytest.raises(KeyboardInterrupt):
        list(play_tasks(study, all_tasks(study), 2))
    assert [worker.killed for worker in (others, *workers)] == [False, True, True]
