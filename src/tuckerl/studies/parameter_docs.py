"""What can be set of an algorithm: each parameter's type, default and meaning, as the classes' docstrings have them."""

import inspect
import re
from collections.abc import Iterator
from dataclasses import fields
from typing import Any, NamedTuple

from tuckerl.generalization.tensor_step import TensorStep
from tuckerl.studies.algorithms import Algorithm, parameters_of, step_defaults
from tuckerl.training.parameters import keywords_of

_SECTION = re.compile(r"^Parameters\n-+\n(.*?)(?:\n\n\S|\Z)", re.DOTALL | re.MULTILINE)
_ROLE = re.compile(r":\w+:`~?([^`]*)`")


class ParameterDoc(NamedTuple):
    """One parameter, in words."""

    default: str
    kind: str
    meaning: str  # one sentence


def parameter_docs(algorithm: Algorithm) -> dict[str, ParameterDoc]:
    """Return all that can be set of an algorithm by name, its own parameters first."""
    told: dict[str, tuple[str, str]] = {}
    for kind in (*algorithm.learner.__mro__, TensorStep):
        for name, kind_of, meaning in _documented(kind):
            told.setdefault(name, (kind_of, meaning))
    defaults = _defaults(algorithm)
    return {name: ParameterDoc(defaults[name], *told[name]) for name in parameters_of(algorithm)}


def _defaults(algorithm: Algorithm) -> dict[str, str]:
    parameters = inspect.signature(algorithm.learner).parameters
    values: dict[str, Any] = {name: parameters[name].default for name in keywords_of(algorithm.learner)}
    if algorithm.is_t_version:
        values |= {field.name: field.default for field in fields(TensorStep)} | step_defaults(algorithm)
        values["ranks"] = "from the sizes"
    return {name: value if isinstance(value, str) else repr(value) for name, value in values.items()}


def _documented(kind: type) -> Iterator[tuple[str, str, str]]:
    """Give the name, the type and the meaning of each parameter in a class's own docstring."""
    section = _SECTION.search(inspect.cleandoc(kind.__doc__ or ""))
    for entry in re.split(r"\n(?=\S)", section[1]) if section else ():
        head, _, body = entry.partition("\n")
        names, _, of_kind = head.partition(" : ")
        for name in names.split(", "):
            yield name, of_kind.replace(", optional", ""), _first_sentence(" ".join(body.split()))


def _first_sentence(text: str) -> str:
    plain = _ROLE.sub(lambda role: role[1].rpartition(".")[2], text).replace("``", "")
    return re.split(r"(?<=\.) (?=[A-Z])", plain)[0].rstrip(".")
