r"""SARSA(lambda), the paper's Figure 2; with a tensor step, TSARSA(lambda), its Figure 8.

.. math::
    \delta = r + \gamma Q(s', a') - Q(s, a), \qquad
    Q \leftarrow Q + \alpha\,\omega\,\delta\,e, \qquad e \leftarrow \gamma \lambda e

for all pairs at every step, after e(s, a) <- 1 (replacing) or e(s, a) + 1 (accumulating). The sweep over all pairs is
postponed until a row is looked at: see `traces`. (Rummery and Niranjan 1994; Singh and Sutton 1996.)
"""

from tuckerl._jit import kernel
from tuckerl.generalization.change_log import ChangeLog, close_episode
from tuckerl.learners.episodes import Record, Settings, epsilon_greedy, note_episode, note_state
from tuckerl.learners.traces import Traces, bring_up_to_date, learn, settle, value_of
from tuckerl.learners.tracing import TracingLearner
from tuckerl.problems.dynamics import World, reset, step
from tuckerl.types import FloatArray, Stream


@kernel
def play(
    world: World,
    traces: Traces,
    q: FloatArray,
    rates: FloatArray,
    settings: Settings,
    log: ChangeLog,
    record: Record,
    rng: Stream,
) -> int:
    """Play and learn one agent's next episodes; return how many stayed finite."""
    for episode in range(record.steps.size):
        state, steps, total, terminated = reset(world, rng), 0, 0.0, False
        note_state(record, 0, state)
        epsilon = record.epsilon[0]
        bring_up_to_date(traces, q, rates, log, state)
        action = epsilon_greedy(q, state, epsilon, settings.random_ties, rng)
        while not terminated and steps < world.max_episode_steps:
            next_state, reward, terminated = step(world, state, action, rng)
            discount = settings.terminal_discount if terminated else settings.gamma
            bring_up_to_date(traces, q, rates, log, next_state)
            next_action = epsilon_greedy(q, next_state, epsilon, settings.random_ties, rng)
            value = value_of(traces, q, rates, log, state, action)
            delta = reward + discount * q[next_state, next_action] - value
            if not learn(traces, q, rates, log, state, action, delta):
                return episode
            state, action, steps, total = next_state, next_action, steps + 1, total + reward
            note_state(record, steps, state)
        if not settle(traces, q, rates, log, traces.decay.carried):
            return episode
        note_episode(record, settings, episode, steps, total)
        close_episode(log, q)
    return record.steps.size


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

    def _play(self, agent: int, record: Record) -> int:
        return play(
            self._worlds[agent],
            self._traces[agent],
            self._q[agent],
            self.alpha * self._weights,
            self._settings,
            self._logs[agent],
            record,
            self._streams[agent],
        )
