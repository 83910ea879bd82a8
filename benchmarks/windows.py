"""What a window costs: the step whole on real windows of the paper's three problems, and what Python does around one.

``python -m benchmarks windows`` times the present tree, and TensorLy beside it. Two versions are
compared by ``python -m benchmarks.versions speed``.
"""

import statistics
import time
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
from tensorly.decomposition import tucker as tensorly_tucker

from benchmarks.steps import random_table
from benchmarks.timing import Row, compare, replaced
from tuckerl import DynaH, QLearning, TensorStep, random_maze
from tuckerl.generalization import step as tensor_step
from tuckerl.generalization.snapshots import Snapshots
from tuckerl.generalization.step import TensorStepState
from tuckerl.studies.scenarios import SCENARIOS
from tuckerl.tensor import decompose
from tuckerl.tensor.one_thread import ONE_THREAD
from tuckerl.training.learner import Learner
from tuckerl.types import FloatArray

AGENTS = (1, 3, 10, 30, 100)
ROUNDS = 5


def rows() -> list[Row]:
    """Time the six kinds of windows and their parts, the tables of 1 to 100 agents, and the smallest windows."""
    warnings.simplefilter("ignore")
    six = [row for name in SCENARIOS for n in (1, 3) for row in _rows(name, n)]
    agents = [_parts(f"maze, {n} agents, consensus", _maze(n), 30, 1)[0] for n in AGENTS]
    return [*six, *agents, *_smallest()]


def _learner(scenario: str, n_agents: int) -> Learner:
    chosen = SCENARIOS[scenario]
    paper = chosen.algorithm
    return paper.learner(chosen.problem(0), n_agents=n_agents, tensor_step=paper.step, seed=0, **paper.parameters)


def _maze(n_agents: int) -> Callable[[], Learner]:
    step = TensorStep(every=10, ranks=(15, 3, 9, 2), share="consensus")
    return lambda: DynaH(random_maze(seed=0), n_agents=n_agents, tensor_step=step, seed=0)


def _rows(scenario: str, n_agents: int) -> list[Row]:
    what = f"{scenario}, {n_agents} agent{'s' * (n_agents > 1)}"
    found = _parts(what, lambda: _learner(scenario, n_agents), 100, ROUNDS)
    if scenario == "dyna-maze":
        found.append(_beside_tensorly(what, n_agents))
    return found


def _timed(function: Callable[..., Any], into: list[float]) -> Callable[..., Any]:
    """Keep this thread's processor time of each call of a function."""

    def timed(*arguments: Any) -> Any:
        begun = time.thread_time()
        try:
            return function(*arguments)
        finally:
            into.append(time.thread_time() - begun)

    return timed


def _parts(what: str, make: Callable[[], Learner], episodes: int, rounds: int) -> list[Row]:
    """Return a window whole, and its decomposition alone: each window's least time of some rounds, then the mean."""
    whole: list[list[float]] = [[] for _ in range(rounds)]
    alone: list[list[float]] = [[] for _ in range(rounds)]
    for a, b in zip(whole, alone, strict=True):
        close_window, step = _timed(TensorStepState.close_window, a), _timed(decompose, b)
        with replaced(TensorStepState, "close_window", close_window), replaced(tensor_step, "decompose", step):
            make().learn(episodes)
    return [
        Row(f"{what}: {part}", "window", statistics.mean(map(min, zip(*times, strict=True))), "-", None, None)
        for part, times in (("the step", whole), ("decomposition", alone))
    ]


def _beside_tensorly(what: str, n_agents: int) -> Row:
    """Time the decomposition of a real window beside TensorLy's of the same tables, whole."""
    learner, seen = _learner("dyna-maze", n_agents).learn(40), []
    original = Snapshots.tensor

    def spy(*arguments: Any) -> FloatArray:
        seen.append(original(*arguments))
        return seen[-1]

    with replaced(Snapshots, "tensor", spy):
        tables = np.stack([np.moveaxis(learner.learn(1).q, 0, 2) for _ in range(10)], axis=2)
    ranks = tuple(learner.tensor_step_history.ranks[-1].tolist())
    return compare(
        f"{what}: one decomposition",
        "window",
        lambda: _on_one_thread(seen[-1], ranks),
        "TensorLy, all states",
        lambda: tensorly_tucker(tables, rank=list(ranks)),
        repeats=15,
    )


def _on_one_thread(tensor: FloatArray, ranks: tuple[int, ...]) -> None:
    """Decompose as the end of a window does."""
    with ONE_THREAD:
        decompose(tensor, ranks)


def _smallest() -> list[Row]:
    """Time windows of a 50 x 4 table against the same episodes without a step, which are taken off."""
    found = []
    for what, weights in (("nothing decomposed (constant weights)", "constant"), ("the whole of a tiny one", "paper")):
        step = TensorStep(every=10, ranks=(4, 3, 5, 1), weights=weights, share="none")
        made, plain = (QLearning(_short(), tensor_step=given, seed=0).learn(100) for given in (step, None))
        times = [_processor_time(made) - _processor_time(plain) for _ in range(15)]
        found.append(Row(what, "window", max(0.0, statistics.median(times)) / 200, "-", None, None))
    return found


def _short() -> Any:
    return random_table(50, 4).with_time_limit(10)


def _processor_time(learner: Learner) -> float:
    begun = time.process_time()
    learner.learn(2000)
    return time.process_time() - begun
