"""Problems to be solved, and the same for QuantEcon's DiscreteDP."""

import itertools
from typing import Any

import numpy as np
from quantecon.markov import DiscreteDP

from tests.learners.worlds import random_mdp
from tests.reference.value_iteration import Model, model_of
from tuckerl import TabularMDP
from tuckerl.types import FloatArray


def masked_mdp(seed: int) -> TabularMDP:
    """A random problem in which some actions may not be taken."""
    rng = np.random.default_rng(seed)
    mask = rng.random((6, 3)) < 0.6
    mask[:, 0] |= ~mask.any(axis=1)
    probability = rng.dirichlet(np.ones(3), size=(6, 3))
    return TabularMDP(
        rng.integers(6, size=(6, 3, 3)),
        rng.normal(size=(6, 3, 3)),
        rng.random((6, 3, 3)) < 0.1,
        probability,
        action_mask=mask,
    )


def periodic_mdp() -> TabularMDP:
    """A wheel of four states that never ends: forwards, paid at the top, or two steps forwards for a fee."""
    states = np.arange(4)
    reward = np.stack([np.where(states == 3, 1.0, 0.0), np.full(4, -0.1)], axis=1)
    return TabularMDP(np.stack([(states + 1) % 4, (states + 2) % 4], axis=1), reward, np.zeros((4, 2), dtype=bool))


def absorbing_mdp() -> TabularMDP:
    """Three states, of which the last keeps for ever and pays nothing; on the way, slips."""
    next_state = [[[0, 1], [1, 2]], [[1, 2], [0, 2]], [[2, 2], [2, 2]]]
    reward = [[[0.0, -1.0], [-2.0, 3.0]], [[-1.0, 5.0], [0.5, 0.5]], [[0.0, 0.0], [0.0, 0.0]]]
    probability = [[[0.5, 0.5], [0.7, 0.3]], [[0.9, 0.1], [0.4, 0.6]], [[1.0, 0.0], [1.0, 0.0]]]
    return TabularMDP(next_state, reward, np.zeros((3, 2, 2), dtype=bool), probability)


def never_ending_mdp(seed: int) -> TabularMDP:
    """A random problem without an end."""
    return random_mdp(seed, 8, 3, n_outcomes=3, ends=0.0)


PROBLEMS = {
    "random": lambda: random_mdp(1, 7, 3, n_outcomes=3),
    "without an end": lambda: never_ending_mdp(2),
    "certain": lambda: random_mdp(3, 9, 2),
    "masked": lambda: masked_mdp(4),
    "periodic": periodic_mdp,
    "absorbing": absorbing_mdp,
}


def quantecon_values(mdp: TabularMDP, gamma: float) -> FloatArray:
    """The optimal values by QuantEcon's policy iteration, (S,); the end is one more state that keeps for ever."""
    model = model_of(mdp)
    n_states, n_actions = model.reward.shape
    reward = np.where(model.allowed, model.reward, -np.inf)
    transition = np.zeros((n_states + 1, n_actions, n_states + 1))
    transition[:-1, :, :-1] = model.transition
    transition[:, :, -1] = np.maximum(1.0 - transition[:, :, :-1].sum(axis=2), 0.0)  # rounding
    peer = DiscreteDP(np.vstack([reward, np.zeros((1, n_actions))]), transition, gamma)
    values: FloatArray = peer.solve(method="policy_iteration").v[:-1]
    return values


def two_states() -> TabularMDP:
    """Puterman (2005), section 3.1: stay or go for 5 (in two equal halves) or for 10; the other state costs 1."""
    return TabularMDP(
        [[[0, 1], [1, 1]], [[1, 1], [1, 1]]],
        [[[5.0, 5.0], [10.0, 10.0]], [[-1.0, -1.0], [-1.0, -1.0]]],
        np.zeros((2, 2, 2), dtype=bool),
        [[[0.5, 0.5], [1.0, 0.0]], [[1.0, 0.0], [1.0, 0.0]]],
        action_mask=[[True, True], [True, False]],
    )


def inventory(n_epochs: int) -> TabularMDP:
    """Puterman (2005), section 3.2.2, over so many months (4.6.1): state (month, stock), action: how much is ordered.

    Stock up to 3; ordering u > 0 costs 4 + 2 u, holding u costs u, each of 0, 1 or 2 sold (probability 1/4, 1/2, 1/4)
    earns 8.
    """
    demand = (0.25, 0.5, 0.25)
    shape = (n_epochs * 4, 4, 3)
    next_state, reward, ends = np.zeros(shape, dtype=np.int64), np.zeros(shape), np.zeros(shape, dtype=np.bool_)
    mask = np.zeros(shape[:2], dtype=np.bool_)
    for month, stock, order in itertools.product(range(n_epochs), range(4), range(4)):
        if stock + order > 3:
            continue
        mask[month * 4 + stock, order] = True
        for wanted in range(3):
            sold = min(wanted, stock + order)
            place = month * 4 + stock, order, wanted
            reward[place] = 8 * sold - (stock + order) - (4 + 2 * order if order else 0)
            ends[place] = month == n_epochs - 1
            next_state[place] = 0 if ends[place] else (month + 1) * 4 + stock + order - sold
    probability = np.broadcast_to(demand, shape)
    return TabularMDP(next_state, reward, ends, probability, action_mask=mask)


def rows_of(mdp: TabularMDP) -> tuple[Model, Any]:
    """The twin's model, and where actions may be taken."""
    model = model_of(mdp)
    return model, model.allowed
