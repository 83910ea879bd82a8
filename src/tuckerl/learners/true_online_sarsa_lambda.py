r"""True online SARSA(lambda), tabular, with dutch traces.

.. math::
    \delta = r + \gamma Q(s', a') - Q_{\text{old}}, \qquad
    Q \leftarrow Q + \alpha\,\omega\,\delta\,e, \qquad
    Q(s, a) \leftarrow Q(s, a) - \alpha\,\omega(a) [Q(s, a) - Q_{\text{old}}]

for all pairs at every step, after e <- gamma lambda e and e(s, a) <- (1 - alpha omega(a)) e(s, a) + 1. Q_old is what
Q(s, a) was when the step before was taken. So after each step the table is, exactly, that of the online lambda-return
algorithm, which begins the episode anew at every step; other traces only come near it for small alpha. (van Seijen,
Mahmood, Pilarski, Machado and Sutton 2016; Sutton and Barto 2018, section 12.7.)

The dutch trace is a constant times phi, too, as all traces decay alike and only a visit mixes the old one with the new.
What remains is one entry, that of the pair which is visited, and the sweep over all pairs is postponed: see `traces`.
"""

from typing import NamedTuple, Unpack

from tuckerl._jit import kernel
from tuckerl.adapters.resolve import Environment
from tuckerl.checks import check_real
from tuckerl.generalization.change_log import record_change
from tuckerl.learners.traces import ROWS, Decay, Trace, Traces, empty_traces, learn, value_of
from tuckerl.learners.tracing import act_on_synced_row, end_with_traces
from tuckerl.training.agent_arrays import AgentArrays, Transition
from tuckerl.training.algorithm import register_algorithm
from tuckerl.training.declared_state import Declaration, DeclaredArray, DeclaredRecord
from tuckerl.training.learner import Learner
from tuckerl.training.parameters import LearnerParameters
from tuckerl.types import FloatArray


class TrueOnlineSarsaLambdaState(NamedTuple):
    """True online SARSA(lambda) keeps traces, and what the pair it comes to was worth before it learned."""

    traces: Traces
    old: FloatArray  # (1,) Q_old of the pair that is visited next


@kernel
def update(algorithm: TrueOnlineSarsaLambdaState, agent: AgentArrays, transition: Transition, next_action: int) -> bool:
    """Let the error of a step reach all pairs that have a trace; ``agent.q`` (S, A) changes, partly later."""
    traces, q, step_sizes, log = algorithm.traces, agent.q, agent.step_sizes, agent.log
    state, action = transition.state, transition.action
    value = value_of(traces, q, step_sizes, log, state, action)
    next_value = q[transition.next_state, next_action]
    old = value
    if traces.cursor[ROWS] > 0:  # without traces, at the beginning and where lambda is 0, what follows cancels out
        old = algorithm.old[0]
        record_change(log, state)
        q[state, action] -= step_sizes[action] * (value - old)
    algorithm.old[0] = next_value
    return learn(traces, q, step_sizes, log, state, action, transition.reward + transition.discount * next_value - old)


register_algorithm(
    TrueOnlineSarsaLambdaState, act=act_on_synced_row, update=update, end_episode=end_with_traces, on_policy=True
)


class TrueOnlineSarsaLambda(Learner):
    """True online SARSA(lambda) for one agent or several, each in its own copy of the problem.

    Parameters
    ----------
    env
        As for every :class:`~tuckerl.training.learner.Learner`, whose other parameters hold too.
    lambda_ : float in [0, 1]
        How strongly traces last; 0 is SARSA.

    References
    ----------
    van Seijen, Mahmood, Pilarski, Machado and Sutton, Journal of Machine Learning Research 17(145), 2016; Sutton and
    Barto, *Reinforcement Learning*, 2018, section 12.7; Wiering and Schmidhuber, Machine Learning 33, 1998, for the
    postponed updates.

    Examples
    --------
    >>> import tuckerl
    >>> agent = tuckerl.TrueOnlineSarsaLambda(tuckerl.sutton_maze(), lambda_=0.9, seed=0).learn(episodes=50)
    >>> agent.steps.shape
    (50, 1)
    """

    state_type = TrueOnlineSarsaLambdaState

    def __init__(self, env: Environment, *, lambda_: float = 0.95, **parameters: Unpack[LearnerParameters]) -> None:
        self.lambda_ = check_real("lambda_", lambda_, 0.0, 1.0)
        super().__init__(env, **parameters)

    def declare_state(self) -> tuple[Declaration, ...]:
        """Return the traces, which end with an episode as the returns do that they stand for, and the value."""
        decay = Decay(self.gamma * self.lambda_, int(Trace.DUTCH), carried=False)
        return (
            DeclaredRecord("traces", "none", lambda n_states, n_actions: empty_traces(n_states, n_actions, decay)),
            DeclaredArray("old", "none", (1,)),
        )
