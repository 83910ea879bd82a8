r"""SARSA, the paper's equation 4, with an update weighted by omega where there is a tensor step.

.. math:: Q(s, a) \leftarrow Q(s, a) + \alpha\,\omega(a) [r + \gamma Q(s', a') - Q(s, a)]

where a' is the action that is taken in s'. (Rummery and Niranjan 1994; Sutton and Barto 2018, section 6.4.)
"""

import numpy as np

from tuckerl._jit import kernel
from tuckerl.generalization.change_log import ChangeLog, close_episode, mark
from tuckerl.learners.episodes import Record, Settings, epsilon_greedy, note_episode, note_state
from tuckerl.learners.learner import Learner
from tuckerl.problems.dynamics import World, reset, step
from tuckerl.types import FloatArray, Stream


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
        epsilon = record.epsilon[0]
        action = epsilon_greedy(q, state, epsilon, settings.random_ties, rng)
        while not terminated and steps < world.max_episode_steps:
            next_state, reward, terminated = step(world, state, action, rng)
            discount = settings.terminal_discount if terminated else settings.gamma
            next_action = epsilon_greedy(q, next_state, epsilon, settings.random_ties, rng)
            mark(log, state)
            delta = reward + discount * q[next_state, next_action] - q[state, action]
            q[state, action] += rates[action] * delta
            if not np.isfinite(q[state, action]):
                return episode
            state, action, steps, total = next_state, next_action, steps + 1, total + reward
            note_state(record, steps, state)
        note_episode(record, settings, episode, steps, total)
        close_episode(log, q)
    return record.steps.size


class Sarsa(Learner):
    """SARSA for one agent or several, each in its own copy of the problem.

    See :class:`~tuckerl.learners.learner.Learner` for the parameters.

    References
    ----------
    Rummery and Niranjan, CUED/F-INFENG/TR 166, 1994; Sutton and Barto, *Reinforcement Learning*, 2018, section 6.4.

    Examples
    --------
    >>> import tuckerl
    >>> agent = tuckerl.Sarsa(tuckerl.sutton_maze(), seed=0).learn(episodes=50)
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
