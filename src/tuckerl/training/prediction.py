"""From observations, as an environment gives them, to actions, as it takes them."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tuckerl.adapters.gymnasium_problem import GymnasiumProblem
from tuckerl.adapters.masks import MaskReader
from tuckerl.adapters.pettingzoo_problem import PettingZooProblem
from tuckerl.adapters.resolve import Problem
from tuckerl.errors import ObservationError, ParameterError, ParameterTypeError
from tuckerl.spaces.encoder import SpaceEncoder
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
    if isinstance(problem, PettingZooProblem):
        return _by_agent(problem, q, action_masks, observation, epsilon, rng)
    if not isinstance(problem, GymnasiumProblem):
        states = check_observation(observation, problem.n_states)
        chosen = _choose(q[0], action_masks[0], states, epsilon, rng)
        return int(chosen) if states.ndim == 0 else chosen
    if problem.agents and isinstance(observation, Mapping):
        joint = _of_agents(observation, problem)
        actions = predict(problem, q, action_masks, joint, epsilon, rng)
        return dict(zip(problem.agents, actions, strict=True))
    return _by_encoder(
        problem.read, problem.observations, problem.actions, q[0], action_masks[0], observation, epsilon, rng
    )


def _by_agent(
    problem: PettingZooProblem,
    q: FloatArray,
    action_masks: Sequence[BoolArray],
    observations: Any,
    epsilon: float,
    rng: np.random.Generator,
) -> dict[Any, Any]:
    if not isinstance(observations, Mapping) or not set(observations) <= set(problem.agents):
        raise ObservationError(
            f"observations must be a dict by agent, of {', '.join(map(str, problem.agents))}; got {observations!r}"
        )
    chosen = {}
    for agent, observation in observations.items():
        place = problem.agents.index(agent)
        parts = problem.readers[place], problem.observations[place], problem.actions[place]
        chosen[agent] = _by_encoder(*parts, q[place], action_masks[place], observation, epsilon, rng)
    return chosen


def _of_agents(observations: Mapping[Any, Any], problem: GymnasiumProblem) -> tuple[Any, ...]:
    missing = [name for name in problem.agents if name not in observations]
    if missing:
        raise ObservationError(
            f"observations must have one of each agent, {', '.join(map(str, problem.agents))}; {missing[0]} has none: "
            "for one that has left, give its last"
        )
    readers = zip(problem.agents, problem.agent_readers, strict=True)
    return tuple(reader.part(observations[name]) for name, reader in readers)


def _by_encoder(
    reader: MaskReader,
    observations: SpaceEncoder,
    actions: SpaceEncoder,
    table: FloatArray,
    action_mask: BoolArray,
    observation: Any,
    epsilon: float,
    rng: np.random.Generator,
) -> Any:
    observation = reader.part(observation)
    if not observations.is_batch(observation):
        state = np.array(observations.encode(observation))
        return actions.decode(int(_choose(table, action_mask, state, epsilon, rng)[()]))
    states = observations.encode_many(observation)
    return np.array([actions.decode(int(a)) for a in _choose(table, action_mask, states, epsilon, rng)])


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


def check_observation(observation: ArrayLike, n_states: int) -> NDArray[Any]:
    """Return a state's number, or several, as an array of integers.

    Raises
    ------
    ParameterError, ParameterTypeError
        If it is no such number.
    """
    try:
        states = np.asarray(observation)
    except ValueError:  # lists of different lengths
        states = np.zeros(0)
    if states.dtype.kind not in "iu":
        hint = ""
        if isinstance(observation, Mapping):  # a team whose joint transitions were lifted
            hint = ": pass the joint state's, such as env.state(), or learn with compiled=False to pass what agents "
            hint += "observe"
        raise ParameterTypeError(f"an observation must be a state's number; got {observation!r}{hint}")
    if states.size and (states.min() < 0 or states.max() >= n_states):
        raise ParameterError(f"an observation must be a state from 0 to {n_states - 1}; got {observation!r}")
    return states
