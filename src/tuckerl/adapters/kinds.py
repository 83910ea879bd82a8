"""The kinds of problem, and how saved files tell them apart.

To add a kind, write its file (see :mod:`tuckerl.problems.problem`) and list it in `PROBLEM_KINDS`.
"""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple, TypedDict

import numpy as np

from tuckerl.adapters.resolve import AdapterOptions, Environment, as_problem
from tuckerl.checks import shown
from tuckerl.errors import SavedFileError
from tuckerl.problems.problem import Arrays, Header, Problem
from tuckerl.registers import load
from tuckerl.saved_arrays import SavedArrays
from tuckerl.saved_json import checked_json


class ProblemKind(NamedTuple):
    """An entry of the register."""

    home: str
    description: str

    def load(self) -> type[Problem]:
        """Return the class."""
        return load(self.home)


PROBLEM_KINDS: dict[str, ProblemKind] = {
    "table": ProblemKind("tuckerl.problems.mdp:TabularMDP", "a finite MDP given by arrays"),
    "simulator": ProblemKind("tuckerl.problems.simulator:Simulator", "compiled functions that move a few numbers"),
    "gymnasium": ProblemKind(
        "tuckerl.adapters.gymnasium_problem:GymnasiumProblem", "a Gymnasium environment that Python steps"
    ),
    "pettingzoo": ProblemKind(
        "tuckerl.adapters.pettingzoo_problem:PettingZooProblem", "a PettingZoo environment, a table for each agent"
    ),
}


class _StoredProblem(TypedDict):
    """What a file says of a problem: its kind, and what that kind holds."""

    kind: str
    held: dict[str, Any]


def save_problem(problem: Problem) -> tuple[Header, Arrays]:
    """Return what a saved file holds of a problem."""
    header, arrays = problem.save()
    return {"kind": problem.kind, "held": header}, arrays


def restore_problem(
    header: Header, arrays: Mapping[str, np.ndarray], env: Environment | None, path: Path, options: AdapterOptions
) -> Problem:
    """Return the problem that `save_problem` took apart; one that is code, from the environment that is given.

    Raises
    ------
    SavedFileError
        If an environment is needed and none is given, the kind is not known, or what is held is no such problem.
    ParameterError
        If the one given is another kind of problem or has other sizes, or none is needed.
    """
    stored = checked_json(header, _StoredProblem, f"the problem in {path}")
    if stored["kind"] not in PROBLEM_KINDS:
        raise SavedFileError(f"{path} holds a problem of an unknown kind: import the module that registers it first")

    _check_reward(options.reward, stored["held"].get("description"), path)

    def resolve(given: Environment, **changes: Any) -> Problem:
        return as_problem(given, replace(options, **changes))

    kind = PROBLEM_KINDS[stored["kind"]].load()
    return kind.restore(stored["held"], SavedArrays.of(arrays), env, resolve, path)


def _check_reward(reward: object, described: object, path: Path) -> None:
    """Refuse a team's reward that is not what the same file's environment paid: an environment is not to blame."""
    if isinstance(described, dict) and str(reward) not in ("mean", described.get("team reward")):
        raise SavedFileError(f"{path} has the team_reward {shown(reward)}, by which its environment has not paid")
