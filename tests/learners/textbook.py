"""Small problems of Sutton and Barto's book (2018) whose answers are known."""

from statistics import NormalDist

import numpy as np

from tuckerl import TabularMDP


def random_walk(n_states: int, left: float = 0.0, right: float = 1.0) -> TabularMDP:
    """A row of states with one action, which goes left or right by chance; leaving it ends and pays (example 6.2)."""
    states = np.arange(n_states)
    next_state = np.stack([np.maximum(states - 1, 0), np.minimum(states + 1, n_states - 1)], axis=1)
    reward, ends = np.zeros((n_states, 2)), np.zeros((n_states, 2), dtype=np.bool_)
    reward[0, 0], reward[-1, 1] = left, right
    ends[0, 0] = ends[-1, 1] = True
    parts = (part[:, np.newaxis, :] for part in (next_state, reward, ends, np.full((n_states, 2), 0.5)))
    return TabularMDP(*parts, start=n_states // 2, max_episode_steps=100_000)


def maximisation_bias(n_actions: int = 10, n_rewards: int = 20) -> TabularMDP:
    """Left leads to a choice of actions that all pay N(-0.1, 1), right ends and pays nothing (example 6.7).

    The normal distribution is that of `n_rewards` equally likely quantiles of it.
    """
    shape = (2, n_actions, n_rewards)
    pays, ends = np.zeros(shape), np.ones(shape, dtype=np.bool_)
    pays[1] = [NormalDist(-0.1, 1.0).inv_cdf((i + 0.5) / n_rewards) for i in range(n_rewards)]
    ends[0, 0] = False
    allowed = np.array([[True, True] + [False] * (n_actions - 2), [True] * n_actions])
    chances = np.full(shape, 1.0 / n_rewards)
    return TabularMDP(np.ones(shape, int), pays, ends, chances, action_mask=allowed, max_episode_steps=10)


def there_and_back(limit: int = 4) -> TabularMDP:
    """From state 0 to 1 for a reward of 1, and back for one of 2, until the time is over."""
    return TabularMDP([[1], [0]], [[1.0], [2.0]], [[False], [False]], max_episode_steps=limit)
