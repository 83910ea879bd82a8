"""The algorithm of an evaluation: it acts by the policy and learns nothing."""

from typing import NamedTuple

from tuckerl._jit import kernel
from tuckerl.training.agent_arrays import AgentArrays, Transition
from tuckerl.training.algorithm import register_algorithm


class EvaluationState(NamedTuple):
    """A policy that is followed keeps nothing."""


@kernel
def _learn_nothing(algorithm: EvaluationState, agent: AgentArrays, transition: Transition, next_action: int) -> bool:
    return True


register_algorithm(EvaluationState, update=_learn_nothing)
