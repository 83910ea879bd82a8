"""How a tensor step, a seed and parameters are put into a file's header and arrays, and how they come back."""

from collections.abc import Iterable, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from tuckerl.errors import ParameterError, SavedFileError
from tuckerl.generalization.step import TensorStep
from tuckerl.training.learner_file import Header
from tuckerl.training.schedules import as_json, from_json

_STORED_NAMES = {"compiled": "lift", "cut_traces": "cut", "search_control": "walk"}
_STORED_VALUES: dict[str, dict[Any, Any]] = {
    "compiled": {"auto": True},
    "exploration": {"independent": "members", "joint": "team"},
}
"""What formats 1 and 2 call parameters and their values that have other names today."""


def seed_parts(sequence: np.random.SeedSequence) -> Header:
    """Return what makes `sequence` again."""
    entropy: Any = sequence.entropy
    words = [int(word) for word in entropy] if isinstance(entropy, Iterable) else int(entropy)
    return {"entropy": words, "spawn_key": [int(key) for key in sequence.spawn_key]}


def restored_seed(header: Header) -> np.random.SeedSequence:
    """Return the sequence that `seed_parts` took apart."""
    return np.random.SeedSequence(header["entropy"], spawn_key=header["spawn_key"])


def step_parts(step: TensorStep | None) -> Header | None:
    """Return a tensor step's parameters; None stands for a user's function, which a file of data cannot hold."""
    if step is None:
        return None
    parameters = {field.name: getattr(step, field.name) for field in fields(step)}
    return {name: None if callable(value) else value for name, value in parameters.items()}


def restored_step(header: Header | None, given: TensorStep | None, path: Path) -> TensorStep | None:
    """Return the tensor step that `step_parts` took apart, with the functions of the one `given` in its place.

    Raises
    ------
    SavedFileError
        If functions are needed and none is given.
    ParameterError
        If the one given differs in anything but those functions, or none is needed.
    """
    functions = [] if header is None else [name for name, value in header.items() if value is None]
    if given is None:
        if functions:
            raise SavedFileError(
                f"{path} used a tensor step with functions of its own ({', '.join(functions)}), which files cannot "
                "hold: pass load() a tensor_step with them"
            )
        return None if header is None else TensorStep(**header)
    if header is None or not functions:
        raise ParameterError(f"{path} holds all of its tensor step: load it without tensor_step")
    for name, value in header.items():
        now = getattr(given, name)
        same = callable(now) if value is None else now == (tuple(value) if name == "ranks" else value)
        if not same:
            before = "a function" if value is None else repr(value)
            raise ParameterError(
                f"tensor_step must be the one that {path} was saved with: its {name} was {before}; got {now!r}"
            )
    return given


def stored_parameters(parameters: Mapping[str, Any]) -> Header:
    """Return a learner's parameters as JSON, under the names that files know them by."""
    header = {}
    for name, value in parameters.items():
        values = _STORED_VALUES.get(name)
        header[_STORED_NAMES.get(name, name)] = as_json(value) if values is None else values.get(value, value)
    return header


def restored_parameters(header: Header) -> dict[str, Any]:
    """Return the parameters that `stored_parameters` took apart."""
    names = {stored: name for name, stored in _STORED_NAMES.items()}
    parameters = {names.get(stored, stored): from_json(value) for stored, value in header.items()}
    for name, values in _STORED_VALUES.items():
        if name in parameters:
            meant = {stored: value for value, stored in values.items()}
            parameters[name] = meant.get(parameters[name], parameters[name])
    return parameters
