"""Checks of what a learner declares: what it keeps is saved and shared, and a distribution that it learns is played."""

from typing import Any

import numpy as np

from tuckerl.errors import LearnerCheckError
from tuckerl.testing.small_problems import slippery
from tuckerl.testing.subject import EVERY, Subject
from tuckerl.training.declared_state import DeclaredArray
from tuckerl.training.learner import Learner


def check_declarations(subject: Subject) -> None:
    """Check that what changes is declared, that values are shared, and that a distribution decides what is done."""
    learner = subject.on(slippery(), n_agents=2, tensor_step=subject.tensor_step())
    _check_undeclared(subject, learner)
    for declaration in learner.declare_state():
        if not isinstance(declaration, DeclaredArray):
            continue
        if declaration.initial is None and declaration.share not in ("by_entry", "by_row"):
            raise LearnerCheckError(
                f"tables of values must be shared at a tensor step, or agents go on with another agent's Q-table "
                f"beside one of their own; {declaration.name!r} of {subject.name} begins as the Q-table does and "
                f"is declared with share={declaration.share!r}: declare it with share='by_entry'"
            )
    _check_played(subject, learner)


def _check_undeclared(subject: Subject, learner: Learner) -> None:
    """Check that the arrays of the algorithm's state that change are declared."""
    declared = [value for held in learner.declared for value in held.values() if isinstance(value, np.ndarray)]
    fields = _arrays_of(learner)
    before = {name: array.copy() for name, array in fields.items()}
    learner.learn(2 * EVERY)
    for name, array in fields.items():
        is_declared = any(np.shares_memory(array, own) for own in declared)
        if not is_declared and array.tobytes() != before[name].tobytes():
            raise LearnerCheckError(
                f"what an algorithm changes must be declared, or it is neither saved nor shared; {name!r} of "
                f"{learner.state_type.__name__} changed while {subject.name} learned: return "
                f"DeclaredArray({name!r}, share=...) from declare_state instead of the array from constants"
            )


def _arrays_of(learner: Learner) -> dict[str, np.ndarray]:
    """Return the arrays in the first agent's algorithm state that are no part of a declared record."""
    records = {name for name, value in learner.declared[0].items() if not isinstance(value, np.ndarray)}
    state: Any = learner.algorithm_state(learner.declared[0], np.zeros(len(learner.algorithm_schedules())))
    fields = state._asdict()
    fields.pop("scheduled", None)
    return {name: value for name, value in fields.items() if isinstance(value, np.ndarray) and name not in records}


def _check_played(subject: Subject, learner: Learner) -> None:
    """Check that the policy reads a learned distribution, if there is one."""
    held = learner.declared[0]
    names = [d.name for d in learner.declare_state() if isinstance(d, DeclaredArray) and d.share == "by_row"]
    played = learner.acting_policy.preferences(learner.q[0], held)
    if names and not any(np.shares_memory(played, held[name]) for name in names):
        raise LearnerCheckError(
            f"a distribution that is learned must be what is played; {subject.name} learns {names[0]!r}, and predict "
            f"and evaluate do not look at it: return OwnDistribution({names[0]!r}, ...) from default_policy"
        )
