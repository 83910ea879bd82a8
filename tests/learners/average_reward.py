"""Problems of the average reward, and their exact solution, which shares nothing with the learners."""

from math import comb

import numpy as np

from tuckerl import TabularMDP
from tuckerl.types import BoolArray, FloatArray, IntArray

N_SERVERS, FREED, PAYS = 10, 0.06, (1.0, 2.0, 4.0, 8.0)
REJECT, ACCEPT = 0, 1


def two_loops(limit: int = 200) -> TabularMDP:
    """From home, action 0 begins a loop of 5 steps that pays 5 at its end, action 1 one of 10 steps that pays 20.

    The printer and the mail room of Mahadevan 1996: the loops pay 1 and 2 a step. States 1 to 4 are the way round the
    one, 5 to 13 that round the other; there action 0 is the only one.
    """
    there = np.tile(np.arange(14)[:, None] + 1, (1, 2))
    there[0] = 1, 5
    there[[4, 13]] = 0
    rewards = np.zeros((14, 2))
    rewards[4], rewards[13] = 5.0, 20.0
    mask = np.ones((14, 2), dtype=np.bool_)
    mask[1:, 1] = False
    return TabularMDP(there, rewards, np.zeros((14, 2), dtype=np.bool_), max_episode_steps=limit, action_mask=mask)


def queue_chances() -> tuple[FloatArray, FloatArray, BoolArray]:
    """Return chances (S, A, S), rewards (S, A) and what may be done (S, A) in the access-control queue.

    Sutton and Barto, example 10.2: state 4 f + p has f of 10 servers free and a customer at the head of the queue who
    pays 1, 2, 4 or 8 for one. Then each busy server becomes free with probability 0.06.
    """
    n_states = 4 * (N_SERVERS + 1)
    chances, rewards = np.zeros((n_states, 2, n_states)), np.zeros((n_states, 2))
    for state in range(n_states):
        for action in (REJECT, ACCEPT):
            busy = N_SERVERS - state // 4 + action
            rewards[state, action] = action * PAYS[state % 4]
            for freed in range(busy + 1 if busy <= N_SERVERS else 0):
                chance = comb(busy, freed) * FREED**freed * (1 - FREED) ** (busy - freed)
                first = 4 * (N_SERVERS - busy + freed)
                chances[state, action, first : first + 4] += chance / 4
    mask = np.ones((n_states, 2), dtype=np.bool_)
    mask[:4, ACCEPT] = False
    return chances, rewards, mask


def access_control(limit: int) -> TabularMDP:
    """Return the queue as a problem that is only cut off, at all servers free and the customer who pays least."""
    chances, rewards, mask = queue_chances()
    n_states, n_outcomes = len(chances), int((chances > 0).sum(axis=2).max())
    there = np.zeros((n_states, 2, n_outcomes), dtype=np.int64)
    probability = np.zeros(there.shape)
    probability[:4, ACCEPT, 0] = 1.0  # is never taken
    for state, action in np.argwhere(mask):
        found = np.flatnonzero(chances[state, action])
        there[state, action, : found.size] = found
        probability[state, action, : found.size] = chances[state, action, found]
    ends = np.zeros(there.shape, dtype=np.bool_)
    paid = np.repeat(rewards[:, :, None], n_outcomes, axis=2)
    probability /= probability.sum(axis=2, keepdims=True)
    return TabularMDP(there, paid, ends, probability, start=4 * N_SERVERS, max_episode_steps=limit, action_mask=mask)


def best_average(chances: FloatArray, rewards: FloatArray, mask: BoolArray) -> tuple[float, FloatArray, IntArray]:
    """Return the largest average reward, its relative values (S, A) and a policy, by policy iteration (Howard 1960).

    Of each policy, gain and values solve h = r - gain + P h with h[0] = 0.
    """
    n_states = len(chances)
    policy = np.where(mask[:, 0], 0, 1)
    while True:
        own = np.arange(n_states), policy
        system = np.zeros((n_states + 1, n_states + 1))
        system[:n_states, :n_states] = np.eye(n_states) - chances[own]
        system[:n_states, n_states] = 1.0
        system[n_states, 0] = 1.0
        *values, gain = np.linalg.solve(system, np.append(rewards[own], 0.0))
        relative = np.where(mask, rewards - gain + chances @ np.array(values), -np.inf)
        better = relative.max(axis=1) > relative[own] + 1e-9
        if not better.any():
            return float(gain), relative, policy
        policy = np.where(better, relative.argmax(axis=1), policy)


def average_of(policy: IntArray, chances: FloatArray, rewards: FloatArray) -> float:
    """Return what a policy earns a step, from the chances of the states in the long run."""
    own, n_states = (np.arange(len(chances)), policy), len(chances)
    system = np.vstack([chances[own].T - np.eye(n_states), np.ones(n_states)])
    stationary = np.linalg.lstsq(system, np.append(np.zeros(n_states), 1.0), rcond=None)[0]
    return float(stationary @ rewards[own])
