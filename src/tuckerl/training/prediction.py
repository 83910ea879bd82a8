"""From observations, as an environment gives them, to actions, as it takes them."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tuckerl.problems.problem import Problem
from tuckerl.types import BoolArray, FloatArray


def predict(
    problem: Problem,
    q: FloatArray,
    action_masks: Sequence[BoolArray],
    observation: Any,
    epsilon: float,
    rng: np.random.Generator,
) -> Any:
    """Return the actions for an observation, or for a batch of them.

    Parameters
    ----------
    problem : Problem
    q : (N, S, A) float64
    action_masks : sequence of (S, A) bool
        For each table, or for the first alone.
    observation
        A state's number or several; what the environment gives; or a dict of that by agent.
    epsilon : float
        The probability of a random action.
    rng : numpy Generator
    """

    def choose(table: int, states: NDArray[Any], carried: BoolArray | None) -> NDArray[Any]:
        return _choose(q[table], action_masks[table], states, epsilon, rng)

    return problem.decide(observation, choose)


def _choose(
    table: FloatArray, action_mask: BoolArray, states: NDArray[Any], epsilon: float, rng: np.random.Generator
) -> NDArray[Any]:
    """Return the greedy actions of states, the lowest on ties, or with probability epsilon random ones."""
    values, allowed = table[states], np.ones(table[states].shape, dtype=np.bool_)
    if action_mask.size:
        allowed = action_mask[states]
    actions: NDArray[Any] = np.argmax(np.where(allowed, values, -np.inf), axis=-1)
    if epsilon > 0:
        explores = rng.random(states.shape) < epsilon
        drawn = np.argmax(np.where(allowed, rng.random(values.shape), -1.0), axis=-1)
        actions = np.where(explores, drawn, actions)
    return actions
