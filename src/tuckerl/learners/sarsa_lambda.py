r"""SARSA(lambda), the paper's Figure 2; with a tensor step, TSARSA(lambda), its Figure 8.

.. math::
    \delta = r + \gamma Q(s', a') - Q(s, a), \qquad
    Q \leftarrow Q + \alpha\,\omega\,\delta\,e, \qquad e \leftarrow \gamma \lambda e

for all pairs at every step, after e(s, a) <- 1 (replacing) or e(s, a) + 1 (accumulating). The sweep over all pairs is
postponed until a row is looked at: see `traces`. (Rummery and Niranjan 1994; Singh and Sutton 1996.)
"""

from typing import NamedTuple

from tuckerl._jit import kernel
from tuckerl.learners.traces import Traces, learn, value_of
from tuckerl.learners.tracing import TracingLearner, act_on_synced_row, end_with_traces
from tuckerl.training.agent_arrays import AgentArrays, Transition
from tuckerl.training.algorithm import register_algorithm


class SarsaLambdaState(NamedTuple):
    """SARSA(lambda) keeps traces."""

    traces: Traces


@kernel
def update(algorithm: SarsaLambdaState, agent: AgentArrays, transition: Transition, next_action: int) -> bool:
    """Let the error of a step reach all pairs that have a trace; ``agent.q`` (S, A) changes, partly later."""
    traces, q, step_sizes, log = algorithm.traces, agent.q, agent.step_sizes, agent.log
    state, action = transition.state, transition.action
    value = value_of(traces, q, step_sizes, log, state, action)
    delta = transition.reward + transition.discount * q[transition.next_state, next_action] - value
    return learn(traces, q, step_sizes, log, state, action, delta)


register_algorithm(SarsaLambdaState, act=act_on_synced_row, update=update, end_episode=end_with_traces, on_policy=True)


class SarsaLambda(TracingLearner):
    """SARSA(lambda) for one agent or several, each in its own copy of the problem.

    See :class:`~tuckerl.learners.tracing.TracingLearner` for the parameters.

    References
    ----------
    Rummery and Niranjan, CUED/F-INFENG/TR 166, 1994; Singh and Sutton, Machine Learning 22, 1996; the paper's
    Figures 2 and 8; Wiering and Schmidhuber, Machine Learning 33, 1998, for the postponed updates.

    Examples
    --------
    >>> import tuckerl
    >>> agent = tuckerl.SarsaLambda(tuckerl.sutton_maze(), lambda_=0.9, seed=0).learn(episodes=50)
    >>> agent.steps.shape
    (50, 1)
    """

    state_type = SarsaLambdaState
