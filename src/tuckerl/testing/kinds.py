"""Checks of this library's own problems, by kind."""

from collections.abc import Callable
from typing import Any

from tuckerl.problems.mdp import TabularMDP
from tuckerl.problems.problem import Problem
from tuckerl.problems.simulator import Simulator
from tuckerl.testing.arrays import check_arrays
from tuckerl.testing.simulators import check_simulator

KIND_CHECKS: dict[str, Callable[[Any, str, int, int], None]] = {
    TabularMDP.kind: lambda problem, source, episodes, seed: check_arrays(problem, source),
    Simulator.kind: lambda problem, source, episodes, seed: check_simulator(problem, episodes, seed),
}
"""``check(problem, source, episodes, seed)`` raises ProblemCheckError."""


def check_kind(problem: Problem, source: str, episodes: int, seed: int) -> None:
    """Check a problem as its kind is checked, if it is.

    Raises
    ------
    ProblemCheckError
    """
    if problem.kind in KIND_CHECKS:
        KIND_CHECKS[problem.kind](problem, source, episodes, seed)
