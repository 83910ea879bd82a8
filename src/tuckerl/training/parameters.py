"""The parameters that all learners take, and checks of those that only learners know."""

from inspect import Parameter, Signature, cleandoc, signature
from numbers import Real
from typing import TYPE_CHECKING, Any, Literal, TypedDict

import numpy as np
from numpy.typing import ArrayLike

from tuckerl.checks import check_flag, check_real, shown
from tuckerl.errors import LearnerError, ParameterError, ParameterTypeError, ProblemError
from tuckerl.generalization.answers import real_array
from tuckerl.generalization.snapshots import one_number
from tuckerl.generalization.tensor_step import TensorStep
from tuckerl.problems.problem import Problem
from tuckerl.training.habits import word_to_use
from tuckerl.training.policies.epsilon_greedy import EpsilonGreedy
from tuckerl.training.policies.policy import Policy
from tuckerl.training.schedules import Schedule, as_schedule
from tuckerl.types import FloatArray, Seed

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tuckerl.training.learned import Learned

NOT_SAVED = ("env", "tensor_step", "seed", "bins")
"""Constructor parameters that a saved file holds in forms of their own, or in its problem."""


class LearnerParameters(TypedDict, total=False):
    """The keyword parameters that all learners take; see :class:`~tuckerl.training.learner.Learner`."""

    alpha: float | Schedule
    gamma: float
    epsilon: float | Schedule | None
    epsilon_decay: float
    ties: Literal["random", "first"]
    initial_q: float | ArrayLike
    n_agents: int
    bootstrap_terminal: bool
    tensor_step: TensorStep | None
    seed: Seed
    bins: Any
    policy: Policy | None
    compiled: Literal["auto"] | bool


def merged_signature(own: Signature, base: Signature) -> Signature:
    """Return a constructor's signature with the base's keywords in the place of its ``**parameters``."""
    if not any(parameter.kind is Parameter.VAR_KEYWORD for parameter in own.parameters.values()):
        return own
    kept = [p for p in own.parameters.values() if p.kind is not Parameter.VAR_KEYWORD]
    names = {parameter.name for parameter in kept}
    more = [p for p in base.parameters.values() if p.kind is Parameter.KEYWORD_ONLY and p.name not in names]
    return own.replace(parameters=[*kept, *more])


def with_parameters(own: str | None, base: str | None, taken: Signature) -> str | None:
    """Return a learner's docstring with those of its base's parameters that it takes and does not describe itself.

    So ``help()`` and the reference show all that a constructor takes.
    """
    if own is None or base is None:  # python -OO
        return own
    before, described, after = _parameter_entries(cleandoc(own))
    inherited = _parameter_entries(cleandoc(base))[1]
    missing = {name: entry for name, entry in inherited.items() if name not in described and name in taken.parameters}
    return "\n".join([*before, *described.values(), *missing.values(), "", *after]).rstrip() + "\n"


def _parameter_entries(doc: str) -> tuple[list[str], dict[str, str], list[str]]:
    """Return the lines before the parameters' entries in a numpydoc docstring, these by name, and the rest."""
    lines = doc.split("\n")
    heads = [i for i, line in enumerate(lines[1:]) if line.startswith("---")] + [len(lines)]
    if "Parameters" not in lines:
        return [*lines[: heads[0]], "Parameters", "----------"], {}, lines[heads[0] :]
    begin = lines.index("Parameters") + 2
    end = next(head for head in heads if head >= begin)
    entries: dict[str, str] = {}
    for line in lines[begin:end]:
        if line and not line.startswith(" "):
            name = line.partition(" : ")[0]
            entries[name] = line
        elif line:
            entries[name] += f"\n{line}"
    return lines[:begin], entries, lines[end:]


def keywords_of(learner: type) -> tuple[str, ...]:
    """Return the names of the keyword parameters that a learner's constructor takes."""
    named = (Parameter.KEYWORD_ONLY, Parameter.POSITIONAL_OR_KEYWORD)
    return tuple(p.name for p in signature(learner).parameters.values() if p.kind in named and p.name != "env")


def check_known(learner: type, parameters: "Mapping[str, object]") -> None:
    """Refuse parameters that a learner does not take.

    Raises
    ------
    ParameterTypeError
        If there is one.
    """
    known = keywords_of(learner)
    unknown = set(parameters) - {*known, "env"}
    if unknown:
        name = min(unknown, key=shown)
        hint = word_to_use("constructor", str(name), known)
        raise ParameterTypeError(f"{learner.__name__} has no parameter {shown(name)}: {hint}")


def kept_parameters(learner: "Learned") -> dict[str, Any]:
    """Return a learner's constructor parameters by name, those but that files hold in forms of their own.

    Raises
    ------
    LearnerError
        If the learner has not kept one.
    """
    names = [name for name in keywords_of(type(learner)) if name not in NOT_SAVED]
    missing = [name for name in names if not hasattr(learner, name)]
    if missing:
        raise LearnerError(
            f"{type(learner).__name__} must keep its parameter {missing[0]!r} as an attribute of the same name, or no "
            f"file can hold it: set self.{missing[0]}"
        )
    values = {name: getattr(learner, name) for name in names}
    if learner.problem.shares_world and "n_agents" in values:
        values["n_agents"] = 1  # as it was given: there is one environment
    if values.get("policy") is None:
        values.pop("policy", None)
    return values


def given_parameters(learner: "Learned") -> dict[str, Any]:
    """Return what a learner's constructor makes the same learner of, together with its problem.

    Raises
    ------
    LearnerError
        If the learner has not kept a parameter, or takes no seed.
    """
    values, taken = kept_parameters(learner), keywords_of(type(learner))
    if "initial_q" in values and (first := one_number(values["initial_q"])) is not None:
        values["initial_q"] = first
    check_takes_seed(type(learner))
    own = {"tensor_step": learner.tensor_step, "seed": learner.seed_sequence}
    return values | {name: value for name, value in own.items() if name in taken}


def check_takes_seed(kind: type) -> None:
    """Refuse to make again a learner whose constructor takes no seed: it would draw otherwise.

    Raises
    ------
    LearnerError
        If it is such a one.
    """
    if "seed" not in keywords_of(kind):
        raise LearnerError(
            f"the constructor of {kind.__name__} takes no seed, so that no file or copy can go on as it does: let it "
            "take **parameters, and pass them on"
        )


def check_alpha(alpha: Any) -> Schedule:
    """Return a learning rate as a schedule, which may fall to 0, but must not be 0 from the beginning to the end.

    Raises
    ------
    ParameterError, ParameterTypeError
        If it is neither a number in (0, 1] nor such a schedule.
    """
    if not isinstance(alpha, Schedule):
        return as_schedule("alpha", alpha, positive=True)
    schedule = as_schedule("alpha", alpha)
    if not schedule.values(2).any():
        raise ParameterError(f"alpha must not be 0 in all episodes, as nothing would be learned; got {shown(alpha)}")
    return schedule


def check_step(learner: str, step: object, no_weights: str | None, no_sharing: str | None) -> TensorStep | None:
    """Return `step` if it is a tensor step that the learner can use, or None.

    Parameters
    ----------
    learner : str
        The name of its class.
    step : object
    no_weights, no_sharing : str, optional
        Why the step's weights, or its sharing, would mean nothing in this learner.

    Raises
    ------
    ParameterTypeError
        If it is neither a tensor step nor None.
    ParameterError
        If it weights or shares where that would mean nothing.
    """
    if step is None:
        return None
    if not isinstance(step, TensorStep):
        raise ParameterTypeError(f"tensor_step must be a tuckerl.TensorStep or None; got {shown(step)}")
    for name, off, reason in (
        ("weights", "none", no_weights),
        ("share", "none", no_sharing),
        ("shrink", 0, no_sharing),
    ):
        value = getattr(step, name)
        if reason is not None and value != off:
            needed = f'{name}="none"' if off else f"{name}=0"
            raise ParameterError(f"a tensor step of {learner} must have {needed}: {reason}; got {name}={shown(value)}")
    return step


def check_policy(policy: object, epsilon: Any, decay: float) -> Policy:
    """Return the policy that is given, or the epsilon-greedy one that `epsilon` stands for.

    Raises
    ------
    ParameterError
        If both are given.
    ParameterTypeError
        If `policy` is no policy.
    """
    if policy is None:
        return EpsilonGreedy(0.1 if epsilon is None else epsilon, decay)
    if not isinstance(policy, Policy):
        raise ParameterTypeError(f"policy must be a policy such as tuckerl.EpsilonGreedy(0.1); got {shown(policy)}")
    if epsilon is not None or check_real("epsilon_decay", decay, 0.0, 1.0) != 1.0:
        raise ParameterError(
            f"epsilon belongs to the default policy: leave it out, or leave out policy={shown(policy)}"
        )
    return policy


def check_deterministic(value: object) -> bool | None:
    """Return `value` if it is None, True or False.

    Raises
    ------
    ParameterTypeError
        If it is anything else.
    """
    return None if value is None else check_flag("deterministic", value)


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
    table = real_array("initial_q", initial_q)
    if table is None:
        raise ParameterTypeError(f"{expected}; got {shown(initial_q)}")
    if table.shape != shape or not np.isfinite(table).all():
        raise ParameterError(
            f"{expected}; got shape {table.shape}{'' if np.isfinite(table).all() else ' with NaN or infinity in it'}"
        )
    table.flags.writeable = False
    return table


def check_equal_spaces(problem: Problem, step: TensorStep | None) -> None:
    """Refuse a tensor step for agents whose tables differ in size.

    Raises
    ------
    ProblemError
        If that is so.
    """
    if step is not None and not problem.has_equal_spaces:
        raise ProblemError(
            "a tensor step needs agents whose observations and actions have equal spaces, as it puts their tables "
            f"into one tensor; those of {problem.source} differ: leave tensor_step out"
        )
