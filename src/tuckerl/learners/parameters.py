"""The parameters that all learners take, and checks of those that only learners know."""

from collections.abc import Mapping
from difflib import get_close_matches
from inspect import Parameter, signature
from numbers import Real
from typing import Any, Literal, TypedDict

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tuckerl.checks import check_real
from tuckerl.errors import ParameterError, ParameterTypeError
from tuckerl.generalization.answers import real_array
from tuckerl.generalization.step import TensorStep
from tuckerl.types import FloatArray, Seed


class LearnerParameters(TypedDict, total=False):
    """The keyword parameters that all learners take; see :class:`Learner`."""

    alpha: float
    gamma: float
    epsilon: float
    epsilon_decay: float
    ties: Literal["random", "first"]
    initial_q: float | ArrayLike
    n_agents: int
    bootstrap_terminal: bool
    tensor_step: TensorStep | None
    seed: Seed


def check_known(learner: type, parameters: Mapping[str, object]) -> None:
    """Refuse parameters that a learner does not take.

    Raises
    ------
    ParameterTypeError
        If there is one.
    """
    unknown = set(parameters) - set(LearnerParameters.__annotations__)
    if unknown:
        name = min(unknown)
        own = [p.name for p in signature(learner).parameters.values() if p.kind is Parameter.KEYWORD_ONLY]
        known = [*own, *LearnerParameters.__annotations__]
        close = get_close_matches(name, known, n=1)
        hint = f"did you mean {close[0]!r}?" if close else f"it takes {', '.join(known)}"
        raise ParameterTypeError(f"{learner.__name__} has no parameter {name!r}: {hint}")


def check_step(step: object) -> TensorStep | None:
    """Return `step` if it is a tensor step or None.

    Raises
    ------
    ParameterTypeError
        If it is anything else.
    """
    if step is None or isinstance(step, TensorStep):
        return step
    raise ParameterTypeError(f"tensor_step must be a tuckerl.TensorStep or None; got {step!r}")


def check_initial_q(initial_q: object, shape: tuple[int, int]) -> FloatArray:
    """Return the first table as (S, A); one number is broadcast, at no cost.

    Raises
    ------
    ParameterError, ParameterTypeError
        If it is neither a finite number nor an array of them of this shape.
    """
    if isinstance(initial_q, Real):
        return np.broadcast_to(check_real("initial_q", initial_q), shape)
    expected = f"initial_q must be one finite number or finite numbers of shape {shape}"
    table = real_array(initial_q)
    if table is None:
        raise ParameterTypeError(f"{expected}; got {initial_q!r}")
    if table.shape != shape or not np.isfinite(table).all():
        raise ParameterError(
            f"{expected}; got shape {table.shape}{'' if np.isfinite(table).all() else ' with NaN or infinity in it'}"
        )
    return table


def check_observation(observation: ArrayLike, n_states: int) -> NDArray[Any]:
    """Return a state's number, or several, as an array of integers.

    Raises
    ------
    ParameterError, ParameterTypeError
        If it is no such number.
    """
    states = np.asarray(observation)
    if states.dtype.kind not in "iu":
        raise ParameterTypeError(f"an observation must be a state's number; got {observation!r}")
    if states.size and (states.min() < 0 or states.max() >= n_states):
        raise ParameterError(f"an observation must be a state from 0 to {n_states - 1}; got {observation!r}")
    return states
