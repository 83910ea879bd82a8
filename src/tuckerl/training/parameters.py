"""The parameters that all learners take, and checks of those that only learners know."""

import os
from collections.abc import Mapping
from inspect import Parameter, signature
from numbers import Real
from typing import Any, Literal, TypedDict

import numpy as np
from numpy.typing import ArrayLike

from tuckerl.adapters.pettingzoo_problem import PettingZooProblem
from tuckerl.adapters.resolve import Problem
from tuckerl.checks import check_real, did_you_mean
from tuckerl.errors import ParameterError, ParameterTypeError, ProblemError, TableSizeError
from tuckerl.generalization.answers import real_array
from tuckerl.generalization.step import TensorStep
from tuckerl.training.schedules import Schedule
from tuckerl.types import FloatArray, Seed

PLAIN_PARAMETERS = ("alpha", "gamma", "epsilon", "epsilon_decay", "ties", "n_agents", "bootstrap_terminal", "compiled")
"""Those that a saved file holds as JSON."""


class LearnerParameters(TypedDict, total=False):
    """The keyword parameters that all learners take; see :class:`Learner`."""

    alpha: float | Schedule
    gamma: float
    epsilon: float | Schedule
    epsilon_decay: float
    ties: Literal["random", "first"]
    initial_q: float | ArrayLike
    n_agents: int
    bootstrap_terminal: bool
    tensor_step: TensorStep | None
    seed: Seed
    bins: Any
    compiled: Literal["auto"] | bool


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
        hint = did_you_mean(name, known) or f"it takes {', '.join(known)}"
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


def check_size(problem: Problem, n_agents: int, step: TensorStep | None) -> int:
    """Return how many tables there are to be, if the machine has memory for them.

    Raises
    ------
    ParameterError, ProblemError
        If agents of a PettingZoo environment are asked for more than once, or with a tensor step and unequal spaces.
    TableSizeError
        If the tables are larger than the machine's memory.
    """
    n_tables = n_agents
    if isinstance(problem, PettingZooProblem):
        n_tables = len(problem.agents)
        if n_agents != 1:
            raise ParameterError(
                f"n_agents must stay 1 where each of the environment's {n_tables} agents has a table; got {n_agents}"
            )
        if step is not None and not problem.are_equal:
            raise ProblemError(
                "a tensor step needs agents whose observations and actions have equal spaces, as it puts their tables "
                f"into one tensor; those of {problem.source} differ: leave tensor_step out"
            )
    size = n_tables * problem.n_states * problem.n_actions * 8
    memory = _memory()
    if size > memory:
        raise TableSizeError(
            f"the tables would take {size / 2**30:,.1f} GiB ({n_tables} x {problem.n_states} states x "
            f"{problem.n_actions} actions x 8 bytes), and this machine has {memory / 2**30:,.1f}: use fewer bins, "
            "agents or actions"
        )
    return n_tables


def _memory() -> int:
    """Return the machine's memory in bytes; more than any desk has where the system does not say (Windows)."""
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError):
        return 2**40
