"""Optimal values and those of a policy, computed from a problem's transitions: what learned policies are held to.

Expected rewards and transition probabilities are read outcome by outcome, as the twins read them; then

    V(s) = max over allowed a of  r(s, a) + gamma * sum over s' of p(s' | s, a) V(s')

is swept until nothing moves (Sutton and Barto 2018, section 4.4), where outcomes that terminate have no V(s'). Time
limits are left out: truncation cuts an episode, not its value.
"""

import itertools
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from tests.learners.worlds import world_of
from tuckerl import TabularMDP
from tuckerl.types import BoolArray, FloatArray, IntArray


class Model(NamedTuple):
    """What is expected of each pair."""

    reward: FloatArray  # (S, A)
    transition: FloatArray  # (S, A, S) probability of s' without termination
    allowed: BoolArray  # (S, A)
    start: FloatArray  # (S,)


def model_of(mdp: TabularMDP) -> Model:
    world = world_of(mdp)
    reward = np.zeros((mdp.n_states, mdp.n_actions))
    transition = np.zeros((mdp.n_states, mdp.n_actions, mdp.n_states))
    allowed = np.ones((mdp.n_states, mdp.n_actions), dtype=np.bool_)
    start = np.zeros(mdp.n_states)
    for s in range(mdp.n_states):
        for a in range(mdp.n_actions):
            if mdp.arrays.action_mask.size:
                allowed[s, a] = mdp.arrays.action_mask[s, a]
            for probability, next_state, r, terminated in world.outcomes[s][a]:
                reward[s, a] += probability * r
                if not terminated:
                    transition[s, a, next_state] += probability
    for probability, s in world.start:
        start[s] += probability
    return Model(reward, transition, allowed, start)


def action_values(model: Model, values: FloatArray, gamma: float) -> FloatArray:
    """What each pair is worth where states are worth `values`, (S, A); minus infinity where it is forbidden."""
    q: FloatArray = model.reward + gamma * model.transition @ values
    allowed: FloatArray = np.where(model.allowed, q, -np.inf)
    return allowed


def optimal_values(model: Model, gamma: float, tolerance: float = 1e-11) -> FloatArray:
    """Value iteration, (S,)."""
    values = np.zeros(model.start.size)
    while True:
        better: FloatArray = action_values(model, values, gamma).max(axis=1)
        if np.abs(better - values).max() <= tolerance:
            return better
        values = better


def policy_values(model: Model, policy: IntArray, gamma: float) -> FloatArray:
    """The values of taking action ``policy[s]`` in s, (S,): the solution of V = r + gamma P V."""
    states = np.arange(model.start.size)
    steps = np.eye(states.size) - gamma * model.transition[states, policy]
    return np.linalg.solve(steps, model.reward[states, policy]).astype(np.float64, copy=False)


def distribution_values(model: Model, probabilities: FloatArray, gamma: float) -> FloatArray:
    """The values of taking action a in s with ``probabilities[s, a]``, (S,), by the same equation (section 4.1)."""
    reward, transition = np.zeros(model.start.size), np.zeros((model.start.size, model.start.size))
    for s in range(model.start.size):
        for a in range(model.reward.shape[1]):
            reward[s] += probabilities[s, a] * model.reward[s, a]
            for s_next in range(model.start.size):
                transition[s, s_next] += probabilities[s, a] * model.transition[s, a, s_next]
    steps = np.eye(model.start.size) - gamma * transition
    return np.linalg.solve(steps, reward).astype(np.float64, copy=False)


def exact_optimum(mdp: TabularMDP, gamma: Fraction) -> list[Fraction]:
    """The optimal values without any rounding: all deterministic policies, each solved in fractions."""
    world = world_of(mdp)
    n, mask = mdp.n_states, mdp.action_mask
    best: list[Fraction] = []
    for policy in itertools.product(range(mdp.n_actions), repeat=n):
        if mask is not None and not mask[range(n), policy].all():
            continue
        rows = [[Fraction(int(s == other)) for other in range(n)] for s in range(n)]
        right = [Fraction(0)] * n
        for s, a in enumerate(policy):
            for probability, next_state, reward, terminated in world.outcomes[s][a]:
                right[s] += Fraction(probability) * Fraction(reward)
                if not terminated:
                    rows[s][next_state] -= gamma * Fraction(probability)
        values = _solved_in_fractions(rows, right)
        best = values if not best else [max(pair) for pair in zip(best, values, strict=True)]
    return best


def _solved_in_fractions(rows: list[list[Fraction]], right: list[Fraction]) -> list[Fraction]:
    """Gauss and Jordan's elimination."""
    n = len(right)
    for i in range(n):
        pivot = next(k for k in range(i, n) if rows[k][i] != 0)
        rows[i], rows[pivot], right[i], right[pivot] = rows[pivot], rows[i], right[pivot], right[i]
        right[i], rows[i] = right[i] / rows[i][i], [entry / rows[i][i] for entry in rows[i]]
        for k in range(n):
            if k != i:
                factor = rows[k][i]
                rows[k] = [entry - factor * own for entry, own in zip(rows[k], rows[i], strict=True)]
                right[k] -= factor * right[i]
    return right


def greedy_policy(model: Model, q: FloatArray) -> IntArray:
    """The first of the largest allowed entries of each row, (S,)."""
    policy: IntArray = np.where(model.allowed, q, -np.inf).argmax(axis=1)
    return policy


def regret(model: Model, q: FloatArray, gamma: float) -> float:
    """How far the greedy policy falls short of the optimum, from the starts, as a share of the optimum's size.

    0 is optimal; 0.01 is 0.99 of the optimal value where that is positive, and a cost of at most 1.01 times the least
    where it is negative.
    """
    best = float(model.start @ optimal_values(model, gamma))
    reached = float(model.start @ policy_values(model, greedy_policy(model, q), gamma))
    return (best - reached) / abs(best)


def average_reward(model: Model, policy: IntArray) -> float:
    """What a policy earns a step in the long run, where nothing ends and all states are met again and again."""
    states = np.arange(model.start.size)
    transition = model.transition[states, policy]
    equations = np.vstack([transition.T - np.eye(states.size), np.ones(states.size)])  # of the stationary distribution
    share = np.linalg.lstsq(equations, np.append(np.zeros(states.size), 1.0), rcond=None)[0]
    return float(share @ model.reward[states, policy])
