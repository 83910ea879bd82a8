"""Saving a learner to a file and loading it again, to go on to the last bit.

What code is, no file holds: functions, and environments that are not known by an id, are given again to `load`.
"""

from collections.abc import Iterable, Mapping
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import numpy as np

from tuckerl._version import __version__
from tuckerl.adapters.kinds import restore_problem, save_problem
from tuckerl.adapters.resolve import Environment
from tuckerl.errors import ParameterError, SavedFileError
from tuckerl.generalization.step import TensorStep
from tuckerl.training import learner_file
from tuckerl.training.learner_file import Arrays, Header, of_prefix, with_prefix
from tuckerl.training.parameters import kept_parameters, keywords_of
from tuckerl.training.policies import POLICIES, policy_class
from tuckerl.training.policies.policy import Policy
from tuckerl.training.schedules import as_json, from_json
from tuckerl.training.training_state import TrainingState

if TYPE_CHECKING:
    from tuckerl.training.learner import Learner

_Learner = TypeVar("_Learner", bound="Learner")


class _Stored(NamedTuple):
    """What files call a parameter, and those of its values that they call otherwise."""

    name: str
    values: dict[Any, Any]


_STORED = {
    "compiled": _Stored("lift", {"auto": True}),
    "cut_traces": _Stored("cut", {}),
    "search_control": _Stored("walk", {}),
    "exploration": _Stored("exploration", {"independent": "members", "joint": "team"}),
}
"""Parameters that files call otherwise, as format 2 has the names of the first shape."""


class SavedLearner(NamedTuple):
    """The content of a learner's file."""

    path: Path
    header: Header
    arrays: Arrays

    @property
    def seed(self) -> np.random.SeedSequence:
        """The learner's seed."""
        return np.random.SeedSequence(self.header["seed"]["entropy"], spawn_key=self.header["seed"]["spawn_key"])


def read(path: Path) -> SavedLearner:
    """Return the content of a learner's file; see :func:`tuckerl.training.learner_file.read` for the errors."""
    return SavedLearner(path, *learner_file.read(path))


def plain_parameters(learner: "Learner") -> dict[str, Any]:
    """Return a learner's constructor parameters that are no arrays, by name."""
    return {name: value for name, value in kept_parameters(learner).items() if not isinstance(value, np.ndarray)}


def save(learner: "Learner", state: TrainingState, prediction_rng: np.random.Generator, path: Path) -> None:
    """Write a learner into a file.

    Raises
    ------
    OutputError
        If it cannot be written.
    """
    problem_header, problem_arrays = save_problem(learner.problem)
    header = {
        "tuckerl": __version__,
        "learner": type(learner).__name__,
        "problem": problem_header,
        "parameters": _stored_parameters(type(learner), plain_parameters(learner)),
        "tensor_step": _stored_step(learner.tensor_step),
        "seed": _stored_seed(learner.seed_sequence),
        "prediction_rng": prediction_rng.bit_generator.state,
        "diverged_at": state.diverged_at,
        "worlds": [world.saved() for world in state.worlds],
    }
    arrays = with_prefix("problem", problem_arrays) | _array_parameters(learner) | state.to_arrays()
    learner_file.write(path, header, arrays)


def _array_parameters(learner: "Learner") -> Arrays:
    """Return a learner's constructor parameters that are arrays; a uniform first table as one number."""
    arrays: Arrays = {}
    for name, value in kept_parameters(learner).items():
        if isinstance(value, np.ndarray):
            arrays[name] = value[(0,) * value.ndim] if not any(value.strides) else value
    return arrays


def load(
    kind: type[_Learner],
    saved: SavedLearner,
    *,
    env: Environment | None,
    tensor_step: TensorStep | None,
    changes: Mapping[str, Any],
) -> _Learner:
    """Return the learner that a file holds; see :meth:`tuckerl.training.learner.Learner.load` for the errors."""
    path, header, arrays = saved
    if header["learner"] != kind.__name__:
        held = header["learner"]
        raise SavedFileError(f"{path} holds a {held}, not a {kind.__name__}: load it with {held}.load")
    kind.check_changes(changes)
    parameters = _restored_parameters(kind, header["parameters"])
    for name in keywords_of(kind):
        if name in arrays and name not in parameters:  # format 1 had other arrays of such names
            parameters[name] = float(arrays[name]) if arrays[name].ndim == 0 else arrays[name]
    problem = restore_problem(
        header["problem"], of_prefix("problem", arrays), env, path, kind.adapter_options(parameters)
    )
    learner = kind(
        problem, **parameters, tensor_step=_restored_step(header["tensor_step"], tensor_step, path), seed=saved.seed
    )
    learner.restore(header, arrays)
    learner.change(changes)
    return learner


def _stored_seed(sequence: np.random.SeedSequence) -> Header:
    """Return what makes `sequence` again."""
    entropy: Any = sequence.entropy
    words = [int(word) for word in entropy] if isinstance(entropy, Iterable) else int(entropy)
    return {"entropy": words, "spawn_key": [int(key) for key in sequence.spawn_key]}


def _stored_step(step: TensorStep | None) -> Header | None:
    """Return a tensor step's parameters; None stands for a user's function, which a file of data cannot hold."""
    if step is None:
        return None
    parameters = {field.name: getattr(step, field.name) for field in fields(step)}
    return {name: None if callable(value) else value for name, value in parameters.items()}


def _restored_step(header: Header | None, given: TensorStep | None, path: Path) -> TensorStep | None:
    """Return the tensor step that `_stored_step` returned, with the functions of the one `given` in its place.

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


def _stored_forms(kind: "type[Learner]") -> dict[str, _Stored]:
    """Return how files hold a learner's parameters, where it differs; not those of a user's own."""
    ours = next(base for base in kind.__mro__ if base.__module__.startswith("tuckerl."))
    return {name: form for name, form in _STORED.items() if name in keywords_of(ours)}


def _stored_parameters(kind: "type[Learner]", parameters: Mapping[str, Any]) -> Header:
    """Return a learner's parameters as JSON, under the names that files know them by."""
    header: Header = {}
    forms = _stored_forms(kind)
    for name, value in parameters.items():
        form = forms.get(name, _Stored(name, {}))
        plain = _policy_as_json(value) if isinstance(value, Policy) else as_json(value)
        header[form.name] = form.values[value] if isinstance(value, str) and value in form.values else plain
    return header


def _restored_parameters(kind: "type[Learner]", header: Header) -> dict[str, Any]:
    """Return the parameters that `_stored_parameters` was given."""
    names = {form.name: name for name, form in _stored_forms(kind).items()}
    parameters: dict[str, Any] = {}
    for stored, value in header.items():
        name = names.get(stored, stored)
        meant = {held: own for own, held in _STORED[name].values.items()} if stored in names else {}
        if name == "policy" and value is not None:
            parameters[name] = _policy_from_json(value)
        else:
            parameters[name] = meant[value] if isinstance(value, (str, bool)) and value in meant else from_json(value)
    if "policy" in parameters:
        parameters["epsilon"] = None
    return parameters


def _policy_as_json(policy: Policy) -> Header:
    """Return a registered policy by its class and its constructor's parameters, which it keeps as attributes."""
    kind = type(policy).__name__
    if kind not in POLICIES or policy_class(kind) is not type(policy):
        raise ParameterError(f"only tuckerl's own policies can be saved in a file; {policy!r} is none of them")
    numbers = {name: as_json(getattr(policy, name)) for name in policy.parameters()}
    return {"policy": kind} | numbers


def _policy_from_json(header: Header) -> Policy:
    numbers = {name: from_json(value) for name, value in header.items() if name != "policy"}
    return policy_class(header["policy"])(**numbers)
