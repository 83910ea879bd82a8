r"""SARSA(lambda), the paper's Figure 2; with a tensor step, TSARSA(lambda), its Figure 8.

.. math::
    \delta = r + \gamma Q(s', a') - Q(s, a), \qquad
    Q \leftarrow Q + \alpha\,\omega\,\delta\,e, \qquad e \leftarrow \gamma \lambda e

for all pairs at every step, after e(s, a) <- 1 (replacing) or e(s, a) + 1 (accumulating). The sweep over all pairs is
postponed until a row is looked at: see `traces`. (Rummery and Niranjan 1994; Singh and Sutton 1996.)
"""

from typing import NamedTuple

from tuckerl._jit import kernel
from tuckerl.learners.traces import Traces, flush_traces, learn, sync_row, value_of
from tuckerl.learners.tracing import TracingLearner
from tuckerl.training.agent_arrays import Agent, Transition
from tuckerl.training.loop import NOT_FINITE, algorithm
from tuckerl.training.policies import epsilon_greedy


class SarsaLambdaMethod(NamedTuple):
    """SARSA(lambda) keeps traces."""

    traces: Traces


@kernel
def first(method: SarsaLambdaMethod, agent: Agent, state: int, epsilon: float) -> int:
    """Choose an episode's first action."""
    sync_row(method.traces, agent.q, agent.step_sizes, agent.log, state)
    return epsilon_greedy(agent, state, epsilon)


@kernel
def turn(method: SarsaLambdaMethod, agent: Agent, seen: Transition, epsilon: float) -> int:
    """Choose the next action, and let the error reach all pairs that have a trace."""
    traces, q, step_sizes, log = method.traces, agent.q, agent.step_sizes, agent.log
    sync_row(traces, q, step_sizes, log, seen.next_state)
    next_action = epsilon_greedy(agent, seen.next_state, epsilon)
    value = value_of(traces, q, step_sizes, log, seen.state, seen.action)
    delta = seen.reward + seen.discount * q[seen.next_state, next_action] - value
    return next_action if learn(traces, q, step_sizes, log, seen.state, seen.action, delta) else NOT_FINITE


@kernel
def leave(method: SarsaLambdaMethod, agent: Agent, finished: bool) -> bool:
    """Bring all rows up to date; traces go on into the next episode only if they are to, and this one was finished."""
    keep = finished and method.traces.decay.carried
    return flush_traces(method.traces, agent.q, agent.step_sizes, agent.log, keep)


algorithm(SarsaLambdaMethod, first=first, turn=turn, leave=leave)


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

    def _method(self, table: int) -> SarsaLambdaMethod:
        return SarsaLambdaMethod(self._traces[table])
