"""Soft SARSA: soft policy evaluation (Haarnoja et al., ICML 2018) in a table, with a bonus for entropy."""

import math
from typing import Any, NamedTuple

import numpy as np

from tuckerl._jit import kernel
from tuckerl.generalization.change_log import record_change
from tuckerl.training.agent_arrays import AgentArrays, Transition
from tuckerl.training.algorithm import register_algorithm
from tuckerl.training.declared_state import DeclaredArray
from tuckerl.training.learner import Learner
from tuckerl.training.policies.policy import write_probabilities
from tuckerl.types import FloatArray


class SoftSarsaState(NamedTuple):
    """Room for the policy's probabilities, and what its entropy is worth."""

    probabilities: FloatArray  # (A,) overwritten at every step
    bonus: float


@kernel
def update(algorithm: SoftSarsaState, agent: AgentArrays, transition: Transition, next_action: int) -> bool:
    """Learn from a step and what the policy would do next; ``agent.q`` (S, A) changes at the state and action."""
    q, state, action = agent.q, transition.state, transition.action
    write_probabilities(agent.policy, agent, transition.next_state, algorithm.probabilities)
    expected = 0.0
    for other in range(q.shape[1]):
        p = algorithm.probabilities[other]
        if p > 0.0:
            expected += p * (q[transition.next_state, other] - algorithm.bonus * math.log(p))
    record_change(agent.log, state)
    q[state, action] += agent.step_sizes[action] * (
        transition.reward + transition.discount * expected - q[state, action]
    )
    return np.isfinite(q[state, action])


register_algorithm(SoftSarsaState, update=update)


class SoftSarsa(Learner):
    """Soft SARSA for one agent or several, whose policy is paid `bonus` for each nat of its entropy."""

    state_type = SoftSarsaState

    def __init__(self, env: Any, *, bonus: float = 0.01, **parameters: Any) -> None:
        self.bonus = bonus
        super().__init__(env, **parameters)

    def constants(self) -> dict[str, Any]:
        """Return what entropy is worth."""
        return {"bonus": self.bonus}

    def declare_state(self) -> tuple[DeclaredArray, ...]:
        """Return the room, which nobody shares."""
        return (DeclaredArray("probabilities", "none", ("actions",)),)
