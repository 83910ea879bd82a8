"""The kinds of problem, and how saved files tell them apart.

To add a kind, write its file (see :mod:`tuckerl.problems.problem`) and list it in `PROBLEM_KINDS`.
"""

from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from tuckerl.adapters.resolve import AdapterOptions, Environment, as_problem
from tuckerl.errors import SavedFileError
from tuckerl.problems.problem import Arrays, Header, Problem
from tuckerl.registers import load


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

_STORED_KINDS = {"gymnasium": "SteppedProblem", "pettingzoo": "PlayersProblem"}
"""What formats 1 and 2 call kinds that have other names today."""

_FLAT_KINDS = {"table": "n_states", "simulator": "simulator"}
"""Kinds whose header stands in the file without their name around it, and the entry by which it is recognised."""


def save_problem(problem: Problem) -> tuple[Header, Arrays]:
    """Return what a saved file holds of a problem."""
    header, arrays = problem.save()
    if "action_mask" in arrays:  # formats 1 and 2 hold what may not be done
        arrays["forbidden"] = ~arrays.pop("action_mask")
    if problem.kind not in _FLAT_KINDS:
        header = {_STORED_KINDS.get(problem.kind, problem.kind): header}
    return header, arrays


def restore_problem(
    header: Header, arrays: Arrays, env: Environment | None, path: Path, options: AdapterOptions
) -> Problem:
    """Return the problem that `save_problem` took apart; one that is code, from the environment that is given.

    Raises
    ------
    SavedFileError
        If an environment is needed and none is given, or the kind is not known.
    ParameterError
        If the one given is another kind of problem or has other sizes, or none is needed.
    """
    stored = {kind: _FLAT_KINDS.get(kind, _STORED_KINDS.get(kind, kind)) for kind in PROBLEM_KINDS}
    kind = next((kind for kind, key in stored.items() if key in header), None)
    if kind is None:
        raise SavedFileError(f"{path} holds a problem of an unknown kind: import the module that registers it first")
    if "forbidden" in arrays:
        arrays = arrays | {"action_mask": ~arrays["forbidden"]}
    own = header if kind in _FLAT_KINDS else header[stored[kind]]

    def resolve(given: Environment, **changes: Any) -> Problem:
        return as_problem(given, replace(options, **changes))

    return PROBLEM_KINDS[kind].load().restore(own, arrays, env, resolve, path)
