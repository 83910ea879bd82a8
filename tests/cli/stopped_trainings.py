"""Trainings in processes of their own, which are stopped at random moments and begun again."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

import tuckerl
from tests.cli.moody_world import ID
from tuckerl.cli import main

ROOT = Path(__file__).parents[2]
COMMANDS = [
    ["tq-learning", f"tests.cli.moody_world:{ID}", "--agents", "2", "--episodes", "200", "--checkpoint", "2"],
    ["sarsa-lambda", "FrozenLake-v1", "--agents", "2", "--episodes", "400", "--checkpoint", "4"],
]
"""A world that is stepped in Python and one that is played in compiled code; both save often."""


@contextmanager
def training(command: list[str], folder: Path) -> Iterator[subprocess.Popen[str]]:
    """Start a training, as a shell with a terminal does; it is dead at the end."""
    places = os.pathsep.join((str(Path(tuckerl.__file__).parents[1]), str(ROOT)))
    process = subprocess.Popen(
        [sys.executable, "-m", "tuckerl", "train", *command, "--evaluate", "0", "--out", str(folder)],
        env=os.environ | {"PYTHONPATH": places},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


def trained(command: list[str], folder: Path) -> dict[str, bytes]:
    """Let a training come to its end, and return the files of its folder by name."""
    with pytest.raises(SystemExit) as end:  # in this process, which has loaded everything
        main(["train", *command, "--evaluate", "0", "--out", str(folder)])
    assert end.value.code == 0
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}


Stop = Callable[[subprocess.Popen[str], np.random.Generator], None]


def kill(process: subprocess.Popen[str], rng: np.random.Generator) -> None:
    """Kill a process, which hears nothing of it."""
    process.kill()
    process.wait()


def interrupt(process: subprocess.Popen[str], rng: np.random.Generator) -> None:
    """Ask a process for its end, in one of the ways in which that is done, once or twice."""
    ending = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)[rng.integers(3)]
    process.send_signal(ending)
    if rng.random() < 0.5:
        time.sleep(rng.uniform(0.0, 0.02))
        process.send_signal(ending)
    _, said = process.communicate(timeout=60)
    # A second one may come when all is done but the exit; a shell shows 130 for that, too.
    assert process.returncode in (0, 130, -ending), said


def stopped_again_and_again(stop: Stop, n_stops: int, folder: Path, seed: int) -> None:
    """Stop trainings at random moments until it has been done so often; each must end at the bits of one left alone."""
    rng = np.random.default_rng(seed)
    whole: dict[int, dict[str, bytes]] = {}
    stopped = trainings = 0
    while stopped < n_stops:
        place = trainings % len(COMMANDS)
        if place not in whole:
            whole[place] = trained(COMMANDS[place], folder / f"whole{place}")
        trainings += 1
        again = folder / f"stopped{trainings}"
        for _ in range(rng.integers(1, 6)):
            with training(COMMANDS[place], again) as process:
                assert process.stderr is not None
                if rng.random() < 0.9:
                    process.stderr.readline()  # it has begun to learn, or found that nothing is left
                if stop is kill or process.poll() is None:
                    time.sleep(rng.uniform(0.0, 0.4))
                if process.poll() is None:
                    stop(process, rng)
                    stopped += 1
        assert trained(COMMANDS[place], again) == whole[place], f"seed {seed}, training {trainings}"
