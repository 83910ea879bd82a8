r"""Q-learning, the paper's Figure 1; with a tensor step, its Figure 5.

.. math:: Q(s, a) \leftarrow Q(s, a) + \alpha\,\omega(a) [r + \gamma \max_b Q(s', b) - Q(s, a)]

where omega is 1 without a tensor step. (Watkins and Dayan 1992.)
"""

import numpy as np

from tuckerl._jit import kernel
from tuckerl.generalization.change_log import ChangeLog, close_episode, mark
from tuckerl.learners.episodes import Record, Settings, epsilon_greedy, note_episode, note_state, row_max
from tuckerl.learners.learner import Learner
from tuckerl.problems.dynamics import World, reset, step
from tuckerl.types import FloatArray, Stream


@kernel
def update(
    q: FloatArray, state: int, action: int, reward: float, discount: float, next_state: int, rate: float
) -> float:
    """Move Q(s, a) towards its target and return its new value."""
    delta = reward + discount * row_max(q, next_state) - q[state, action]
    q[state, action] += rate * delta
    return q[state, action]


@kernel
def play(
    world: World,
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
        while not terminated and steps < world.max_episode_steps:
            action = epsilon_greedy(q, state, record.epsilon[0], settings.random_ties, rng)
            next_state, reward, terminated = step(world, state, action, rng)
            discount = settings.terminal_discount if terminated else settings.gamma
            mark(log, state)
            value = update(q, state, action, reward, discount, next_state, rates[action])
            if not np.isfinite(value):
                return episode
            state, steps, total = next_state, steps + 1, total + reward
            note_state(record, steps, state)
        note_episode(record, settings, episode, steps, total)
        close_episode(log, q)
    return record.steps.size


class QLearning(Learner):
    """Q-learning for one agent or several, each in its own copy of the problem.

    See :class:`~tuckerl.learners.learner.Learner` for the parameters.

    References
    ----------
    Watkins and Dayan, Machine Learning 8, 1992; the paper's Figures 1 and 5.

    Examples
    --------
    >>> import tuckerl
    >>> agent = tuckerl.QLearning(tuckerl.sutton_maze(), seed=0).learn(episodes=50)
    >>> agent.steps.shape
    (50, 1)
    """

    def _play(self, agent: int, record: Record) -> int:
        return play(
            self._worlds[agent],
            self._q[agent],
            self.alpha * self._weights,
            self._settings,
            self._logs[agent],
            record,
            self._streams[agent],
        )
