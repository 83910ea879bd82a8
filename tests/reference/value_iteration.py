"""Optimal values and those of a policy, computed from a problem's transitions: what learned policies are held to.

Expected rewards and transition probabilities are read outcome by outcome, as the twins read them; then

    V(s) = max over allowed a of  r(s, a) + gamma * sum over s' of p(s' | s, a) V(s')

is swept until nothing moves (Sutton and Barto 2018, section 4.4), where outcomes that terminate have no V(s'). Time
limits are left out: truncation cuts an episode, not its value.
"""

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
