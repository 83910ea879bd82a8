"""Expected SARSA (Sutton and Barto 2018, section 6.6): the mean over what the policy may do next."""

from typing import NamedTuple

import numpy as np

from tuckerl._jit import kernel
from tuckerl.generalization.change_log import record_change
from tuckerl.training.agent_arrays import AgentArrays, Transition
from tuckerl.training.algorithm import register_algorithm
from tuckerl.training.declared_state import DeclaredArray
from tuckerl.training.learner import Learner
from tuckerl.training.policies.policy import write_probabilities
from tuckerl.types import FloatArray


class ExpectedSarsaState(NamedTuple):
    """Room for the policy's probabilities."""

    probabilities: FloatArray  # (A,) overwritten at every step


@kernel
def update(algorithm: ExpectedSarsaState, agent: AgentArrays, transition: Transition, next_action: int) -> bool:
    """Learn from a step and what the policy would do next; ``agent.q`` (S, A) changes at the state and action."""
    q, state, action = agent.q, transition.state, transition.action
    write_probabilities(agent.policy, agent, transition.next_state, algorithm.probabilities)
    expected = 0.0
    for other in range(q.shape[1]):
        if algorithm.probabilities[other] > 0.0:
            expected += algorithm.probabilities[other] * q[transition.next_state, other]
    record_change(agent.log, state)
    q[state, action] += agent.step_sizes[action] * (
        transition.reward + transition.discount * expected - q[state, action]
    )
    return np.isfinite(q[state, action])


register_algorithm(ExpectedSarsaState, update=update)


class ExpectedSarsa(Learner):
    """Expected SARSA for one agent or several."""

    state_type = ExpectedSarsaState

    def declare_state(self) -> tuple[DeclaredArray, ...]:
        """Return the room, which nobody shares."""
        return (DeclaredArray("probabilities", "none", ("actions",)),)
