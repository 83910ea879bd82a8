r"""Watkins' Q(lambda): Q-learning with traces that reach back to the latest action that was not greedy.

.. math::
    \delta = r + \gamma \max_b Q(s', b) - Q(s, a), \qquad
    Q \leftarrow Q + \alpha\,\omega\,\delta\,e, \qquad
    e \leftarrow \gamma \lambda e \text{ if } a' \text{ is greedy, else } 0

for all pairs at every step. What followed an action that is not greedy did not follow from the policy that is learned,
so what came before must not learn from it. The sweep over all pairs is postponed: see `traces`. (Watkins 1989; Sutton
and Barto 2018, section 12.10.)
"""

from typing import Any, NamedTuple

from tuckerl._jit import kernel
from tuckerl.learners.traces import Traces, flush_traces, learn, sync_row
from tuckerl.learners.tracing import TracingLearner, act_on_synced_row, end_with_traces
from tuckerl.training.agent_arrays import AgentArrays, Transition
from tuckerl.training.algorithm import NOT_FINITE, register_algorithm
from tuckerl.training.greedy_actions import best_value

_TIE = 1e-12  # values this close differ by the order of additions only, which must not decide


class WatkinsQLambdaState(NamedTuple):
    """Watkins' Q(lambda) keeps traces."""

    traces: Traces


@kernel
def act_and_cut(algorithm: Any, agent: AgentArrays, state: int) -> int:
    """Choose an action; one whose value lies below the maximum of its row in ``agent.q`` (S, A) cuts the traces.

    They are cut here and not in the update: an environment may give other masks for the same state a step later.
    """
    action = act_on_synced_row(algorithm, agent, state)
    best = best_value(agent.q, agent.action_mask, state)
    is_worse = agent.q[state, action] < best - _TIE * abs(best)
    if not is_worse:
        return action
    return action if flush_traces(algorithm.traces, agent.q, agent.step_sizes, agent.log, False) else NOT_FINITE


@kernel
def update(algorithm: Any, agent: AgentArrays, transition: Transition, next_action: int) -> bool:
    """Let the error reach all pairs that have a trace; ``agent.q`` (S, A) changes, partly later."""
    traces, q, state, action = algorithm.traces, agent.q, transition.state, transition.action
    sync_row(traces, q, agent.step_sizes, agent.log, transition.next_state)
    target = transition.reward + transition.discount * best_value(q, agent.action_mask, transition.next_state)
    return learn(traces, q, agent.step_sizes, agent.log, state, action, target - q[state, action])


register_algorithm(WatkinsQLambdaState, act=act_and_cut, update=update, end_episode=end_with_traces)


class WatkinsQLambda(TracingLearner):
    """Watkins' Q(lambda) for one agent or several, each in its own copy of the problem.

    See :class:`~tuckerl.learners.tracing.TracingLearner` for the parameters.

    References
    ----------
    Watkins, *Learning from Delayed Rewards*, 1989; Sutton and Barto, *Reinforcement Learning*, 2018, section 12.10;
    Wiering and Schmidhuber, Machine Learning 33, 1998, for the postponed updates.

    Examples
    --------
    >>> import tuckerl
    >>> agent = tuckerl.WatkinsQLambda(tuckerl.sutton_maze(), lambda_=0.9, seed=0).learn(episodes=50)
    >>> agent.steps.shape
    (50, 1)
    """

    state_type = WatkinsQLambdaState
