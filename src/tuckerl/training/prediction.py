"""From observations, as an environment gives them, to actions, as it takes them: by the learner's policy."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tuckerl._jit import kernel
from tuckerl.adapters.gymnasium_problem import GymnasiumProblem
from tuckerl.adapters.masks import MaskReader
from tuckerl.adapters.pettingzoo_problem import PettingZooProblem
from tuckerl.adapters.resolve import Problem
from tuckerl.errors import ObservationError, ParameterError, ParameterTypeError
from tuckerl.generalization.change_log import empty_log
from tuckerl.spaces.encoder import SpaceEncoder
from tuckerl.training.agent_arrays import AgentArrays, EpisodeRecord, Settings
from tuckerl.training.evaluation_algorithm import EvaluationState
from tuckerl.training.policies.greedy import Greedy
from tuckerl.training.policies.policy import Policy, write_probabilities
from tuckerl.types import BoolArray, FloatArray, IntArray

_NO_RECORD = EpisodeRecord(np.zeros(0, np.int64), np.zeros(0), np.zeros(1, np.int64), np.zeros((0, 0)), 0)
_NO_STREAM = np.zeros(4, dtype=np.uint64)


@kernel
def _write_rows(agent: AgentArrays, states: IntArray, out: FloatArray) -> None:
    """Write the probabilities of the actions in `states` (B,) into `out` (B, A)."""
    for row in range(states.size):
        write_probabilities(agent.policy, agent, states[row], out[row])


class Predictor:
    """What N agents do by their tables: as they were learned, or with exploration.

    Parameters
    ----------
    problem : Problem
    policy : Policy
        By which the agents act while they learn.
    q : (N, S, A) float64
    declared : sequence of mapping
        Each agent's declared arrays by name.
    action_masks : sequence of (S, A) bool
        Where each agent may take an action; (0, 0) where it always may.
    scheduled : (K,) float64
        The present values of the policy's schedules.
    random_ties : bool
        Whether exploring agents break ties at random; otherwise the lowest action wins.
    rng : numpy Generator
        What predictions draw from.
    """

    def __init__(
        self,
        problem: Problem,
        policy: Policy,
        q: FloatArray,
        declared: Sequence[Mapping[str, Any]],
        action_masks: Sequence[BoolArray],
        scheduled: FloatArray,
        *,
        random_ties: bool,
        rng: np.random.Generator,
    ) -> None:
        self.problem, self.q = problem, q
        self._policy, self._declared, self._action_masks = policy, declared, action_masks
        self._scheduled, self._random_ties, self._rng = scheduled, random_ties, rng

    def agent(
        self,
        agent: int,
        deterministic: bool | None,
        *,
        action_mask: BoolArray | None = None,
        record: EpisodeRecord = _NO_RECORD,
        rng: NDArray[np.uint64] = _NO_STREAM,
    ) -> AgentArrays:
        """Return an agent as kernels see it, that acts and learns nothing.

        Parameters
        ----------
        agent : int
        deterministic : bool, optional
            As of :meth:`tuckerl.training.learner.Learner.predict`.
        action_mask : (S, A) or (0, 0) bool, optional
            Default: what was seen while learning.
        record, rng
            Where episodes are to be played.
        """
        table, policy = self._followed(agent, deterministic)
        scheduled = self._scheduled if deterministic is False else np.zeros(len(policy.schedules()))
        n_states, n_actions = table.shape
        return AgentArrays(
            algorithm=EvaluationState(),
            policy=policy.arrays(scheduled, self._declared[agent]),
            q=table,
            weights=np.ones(n_actions),
            step_sizes=np.zeros(n_actions),
            scheduled=np.zeros(1),
            action_mask=self._action_masks[agent] if action_mask is None else action_mask,
            settings=Settings(1.0, 0.0, self._random_ties and deterministic is False),
            log=empty_log(n_states, n_actions, 0),
            record=record,
            rng=rng,
        )

    def _followed(self, agent: int, deterministic: bool | None) -> tuple[FloatArray, Policy]:
        """Return the policy that is to be followed, and the (S, A) table that it looks at."""
        q = self.q[agent]
        if deterministic:
            return self._policy.preferences(q, self._declared[agent]), Greedy()
        return q, self._policy if deterministic is False else self._policy.target() or Greedy()

    def predict(self, observation: Any, deterministic: bool | None) -> Any:
        """Return the actions for an observation, for a batch of them, or for a dict of observations by agent.

        Raises
        ------
        ParameterError, ParameterTypeError, ObservationError
            If an observation is none of the environment's.
        """

        def choose(agent: int, states: NDArray[Any]) -> NDArray[Any]:
            return self._choose(agent, states, deterministic)

        return decide(self.problem, observation, choose)

    def _choose(self, agent: int, states: NDArray[Any], deterministic: bool | None) -> NDArray[Any]:
        """Return the actions in states of any shape."""
        table, policy = self._followed(agent, deterministic)
        if isinstance(policy, Greedy) and not (deterministic is False and self._random_ties):
            return self._greedy(table, self._action_masks[agent], states)
        flat = np.ascontiguousarray(states, dtype=np.int64).reshape(-1)
        probabilities = np.empty((flat.size, table.shape[1]))
        _write_rows(self.agent(agent, deterministic), flat, probabilities)
        cumulative = probabilities.cumsum(axis=1)
        u = self._rng.random((flat.size, 1)) * cumulative[:, -1:]
        return (cumulative <= u).sum(axis=1).reshape(states.shape)

    @staticmethod
    def _greedy(table: FloatArray, action_mask: BoolArray, states: NDArray[Any]) -> NDArray[Any]:
        """Return the greedy actions, the lowest on ties; NumPy needs not be compiled as a kernel would."""
        values = table[states]
        allowed = np.where(action_mask[states], values, -np.inf) if action_mask.size else values
        actions: NDArray[Any] = allowed.argmax(axis=-1)
        return actions


def decide(problem: Problem, observation: Any, choose: Any) -> Any:
    """Return what an environment is to be given for what it gave; ``choose(agent, states)`` returns actions."""
    if isinstance(problem, PettingZooProblem):
        return _by_agent(problem, observation, choose)
    if not isinstance(problem, GymnasiumProblem):
        states = check_observation(observation, problem.n_states)
        chosen = choose(0, states)
        return int(chosen) if states.ndim == 0 else chosen
    if problem.agents and isinstance(observation, Mapping):
        joint = _of_agents(observation, problem)
        return dict(zip(problem.agents, decide(problem, joint, choose), strict=True))
    return _by_encoder(problem.read, problem.observations, problem.actions, observation, lambda s: choose(0, s))


def _by_agent(problem: PettingZooProblem, observations: Any, choose: Any) -> dict[Any, Any]:
    if not isinstance(observations, Mapping) or not set(observations) <= set(problem.agents):
        raise ObservationError(
            f"observations must be a dict by agent, of {', '.join(map(str, problem.agents))}; got {observations!r}"
        )
    chosen = {}
    for agent, observation in observations.items():
        place = problem.agents.index(agent)
        parts = problem.readers[place], problem.observations[place], problem.actions[place]
        chosen[agent] = _by_encoder(*parts, observation, lambda states, place=place: choose(place, states))
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
    reader: MaskReader, observations: SpaceEncoder, actions: SpaceEncoder, observation: Any, choose: Any
) -> Any:
    observation = reader.part(observation)
    if not observations.is_batch(observation):
        return actions.decode(int(choose(np.array(observations.encode(observation)))[()]))
    states = observations.encode_many(observation)
    return np.array([actions.decode(int(a)) for a in choose(states)])


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
        if isinstance(observation, Mapping):  # a team that plays the extracted joint transition table
            hint = ": pass the joint state's, such as env.state(), or learn with compiled=False to pass what agents "
            hint += "observe"
        raise ParameterTypeError(f"an observation must be a state's number; got {observation!r}{hint}")
    if states.size and (states.min() < 0 or states.max() >= n_states):
        raise ParameterError(f"an observation must be a state from 0 to {n_states - 1}; got {observation!r}")
    return states
