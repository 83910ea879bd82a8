"""What formats 1 and 2 of a learner's file call by other names or hold in other forms.

Format 1 knew no environments that Python steps, no masks and no schedules.
"""

import re
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np

from tuckerl.saved_arrays import SavedArrays, StoredArray
from tuckerl.training.declared_state import Declaration, DeclaredRecord
from tuckerl.training.parameters import keywords_of

Header = dict[str, Any]


class _Stored(NamedTuple):
    """What old files call a parameter, and those of its values that they call otherwise."""

    name: str
    values: dict[Any, Any]


_PARAMETERS = {
    "compiled": _Stored("lift", {True: "auto"}),
    "cut_traces": _Stored("cut", {}),
    "search_control": _Stored("walk", {}),
    "exploration": _Stored("exploration", {"members": "independent", "team": "joint"}),
}

_PROBLEM_KINDS = {"SteppedProblem": "gymnasium", "PlayersProblem": "pettingzoo"}
"""Kinds of problem whose header stood under a name; those of others stood alone."""

_ARRAYS = (
    (re.compile(r"problem\.edges(\d+)\.(\d+)"), r"problem/edges/\1/\2"),
    (re.compile(r"problem\.forbidden"), r"problem/action_mask"),
    (re.compile(r"problem\.(\w+)"), r"problem/\1"),
    (re.compile(r"(q|weights|trajectory|streams|steps|returns)"), r"state/\1"),
    (re.compile(r"done"), r"state/finished"),
    (re.compile(r"scheduled\.(\w+)"), r"scheduled/\1"),
    (re.compile(r"log(\d+)\.(state|row|end)"), r"agents/\1/log/\2"),
    (re.compile(r"forbidden(\d+)"), r"agents/\1/action_mask"),
    (re.compile(r"step\.loadings\.(\w+)"), r"step/loadings/\1"),
    (re.compile(r"step\.(\w+)"), r"step/\1"),
)
"""The names of arrays, as expressions, and those of format 3. Others are a parameter's or declared."""


def new_header(header: Header) -> Header:
    """Return the header of an old file in the form of format 3, but for the parameters."""
    problem = header.get("problem")
    if not isinstance(problem, dict):
        return header
    kind = next((kind for kind in _PROBLEM_KINDS if kind in problem), None)
    named = "simulator" if "simulator" in problem else "table" if "n_states" in problem else "unknown"
    own = problem if kind is None else problem[kind]
    return header | {"problem": {"kind": _PROBLEM_KINDS.get(kind or "", named), "held": own}}


def rename_arrays(arrays: SavedArrays, version: int) -> None:
    """Give the arrays of an old file the names and contents of format 3."""
    for old in list(arrays):
        for expression, new in _ARRAYS:
            found = expression.fullmatch(old)
            if found:
                name = found.expand(new)
                arrays.rename({old: name})
                if "forbidden" in old:
                    arrays.replace(name, np.logical_not)
                break
    if version == 1:
        _add_what_format_1_lacks(arrays)


def _add_what_format_1_lacks(arrays: SavedArrays) -> None:
    if "state/steps" in arrays and "state/finished" not in arrays:
        n_agents, n_episodes = arrays.shape("state/steps")
        full = StoredArray(np.dtype(np.int64), (n_agents,), lambda: np.full(n_agents, n_episodes, dtype=np.int64))
        arrays.add("state/finished", full)
    nowhere = StoredArray(np.dtype(np.bool_), (0, 0), lambda: np.zeros((0, 0), dtype=np.bool_))
    if "problem/next_state" in arrays:
        arrays.add("problem/action_mask", nowhere)
    arrays.leave_out("epsilon")  # the present values, which follow from the episode


def rename_declared(arrays: SavedArrays, declarations: Iterable[Declaration], n_agents: int) -> None:
    """Give the arrays that an algorithm declares the names of format 3."""
    for agent in range(n_agents):
        for declaration in declarations:
            if isinstance(declaration, DeclaredRecord):
                start = f"{declaration.name}{agent}."
                own = [name for name in arrays if name.startswith(start)]
                new = f"agents/{agent}/records/{declaration.name}/"
                arrays.rename({name: new + name.removeprefix(start) for name in own})
            else:
                group, dot, member = declaration.name.partition(".")
                old = f"{group}{agent}.{member}" if dot else f"{group}.{agent}"
                arrays.rename({old: f"agents/{agent}/arrays/{declaration.name}"})


def new_parameters(kind: type, parameters: Mapping[str, Any]) -> Header:
    """Return a learner's parameters under the names of today; those of a user's own kept theirs."""
    ours = next(base for base in kind.__mro__ if base.__module__.startswith("tuckerl."))
    names = {form.name: name for name, form in _PARAMETERS.items() if name in keywords_of(ours)}
    renamed: Header = {}
    for stored, value in parameters.items():
        name = names.get(stored, stored)
        meant = _PARAMETERS[name].values if stored in names else {}
        renamed[name] = meant.get(value, value) if isinstance(value, (str, bool)) else value
    return renamed
