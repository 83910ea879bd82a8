"""From observations, as an environment gives them, to actions, as it takes them: by the learner's policy."""

import copy
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tuckerl._jit import kernel
from tuckerl.generalization.change_log import empty_log
from tuckerl.problems.problem import Problem
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
    target : Policy
        Which they learn, without exploration.
    q : (N, S, A) float64
    declared : sequence of mapping
        Each agent's declared arrays by name.
    action_masks : sequence of (S, A) bool
        Where each agent may take an action; (0, 0) where it always may.
    episode : int
        For which policies take the values of their schedules.
    random_ties : bool
        Whether exploring agents break ties at random; otherwise the lowest action wins.
    rng : numpy Generator
        What predictions draw from.
    """

    def __init__(
        self,
        problem: Problem,
        policy: Policy,
        target: Policy,
        q: FloatArray,
        declared: Sequence[Mapping[str, Any]],
        action_masks: Sequence[BoolArray],
        episode: int,
        *,
        random_ties: bool,
        rng: np.random.Generator,
    ) -> None:
        self.problem, self.q = problem, q
        self._policy, self._target = policy, target
        self._declared, self._action_masks = declared, action_masks
        self._episode, self._random_ties, self._rng = episode, random_ties, rng

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
        scheduled = policy.schedule_values.values(self._episode + 1)[self._episode].copy()
        n_states, n_actions = table.shape
        return AgentArrays(
            algorithm=EvaluationState(),
            policy=policy.arrays(scheduled, self._without_effect(policy, agent)),
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
        return q, self._policy if deterministic is False else self._target

    def _without_effect(self, policy: Policy, agent: int) -> dict[str, Any]:
        """Return an agent's declared arrays, copies of those that the policy changes: learning must not notice."""
        held = dict(self._declared[agent])
        return held | {own.name: copy.deepcopy(held[own.name]) for own in policy.declare_state() if own.name in held}

    def predict(self, observation: Any, deterministic: bool | None) -> Any:
        """Return the actions for an observation, for a batch of them, or for a dict of observations by agent.

        Raises
        ------
        ParameterError, ParameterTypeError, ObservationError
            If an observation is none of the environment's.
        """

        def choose(agent: int, states: NDArray[Any], action_mask: BoolArray | None) -> NDArray[Any]:
            return self._choose(agent, states, deterministic)

        return self.problem.decide(observation, choose)

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
