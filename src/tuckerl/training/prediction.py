"""From observations, as an environment gives them, to actions, as it takes them: by the learner's policy."""

import copy
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tuckerl._jit import kernel
from tuckerl.errors import ObservationError
from tuckerl.generalization.change_log import empty_log
from tuckerl.problems.problem import Problem
from tuckerl.training.agent_arrays import AgentArrays, EpisodeRecord, Settings
from tuckerl.training.evaluation_algorithm import EvaluationState
from tuckerl.training.guards import raise_fault
from tuckerl.training.policies.greedy import Greedy
from tuckerl.training.policies.policy import Policy, check_probabilities, write_probabilities
from tuckerl.training.row_maxima import NoMaxima, RowMaxima
from tuckerl.types import BoolArray, FloatArray, IntArray

FORBIDS_ALL = (
    "an action mask must allow an action in every state that is asked for; the one given or carried by the "
    "observation, or both together, allows none: correct it, or leave out the agent that has no choice"
)
_NO_RECORD = EpisodeRecord(
    steps=np.zeros(0, np.int64),
    returns=np.zeros(0),
    trajectory=np.zeros((2, 1), np.int64),
    scheduled=np.zeros((0, 0)),
    max_steps=0,
    first=0,
    stop=np.zeros(1, np.int64),
    listen=0,
)
_ALL_ALLOWED: BoolArray = np.zeros((0, 0), dtype=np.bool_)  # not read-only: kernels are compiled once for all masks
_NO_STREAM = np.zeros(4, dtype=np.uint64)


@kernel
def _write_rows(agent: AgentArrays, states: IntArray, allowed: BoolArray, out: FloatArray) -> None:
    """Write the probabilities of the actions in `states` (B,) into `out` (B, A).

    Parameters
    ----------
    agent : AgentArrays
    states : (B,) int64
    allowed : (B, A) bool
        Replaces the rows of ``agent.action_mask`` (S, A), one after the other; (0, 0) where these hold.
    out : (B, A) float64
    """
    for row in range(states.size):
        if allowed.size > 0:
            for action in range(allowed.shape[1]):
                agent.action_mask[states[row], action] = allowed[row, action]
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
        maxima: RowMaxima | NoMaxima = NoMaxima(),  # noqa: B008  # it is immutable
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
        maxima, record, rng
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
            maxima=maxima,
            log=empty_log(n_states, n_actions, 0),
            record=record,
            rng=rng,
            fault=np.zeros(4),
        )

    def _followed(self, agent: int, deterministic: bool | None) -> tuple[FloatArray, Policy]:
        """Return the policy that is to be followed, and the (S, A) table that it looks at."""
        q, declared, mask = self.q[agent], self._declared[agent], self._action_masks[agent]
        policy = self._target if deterministic is None else self._policy
        table = policy.table(q, declared, mask)
        return (policy.preferences(table, declared), Greedy()) if deterministic else (table, policy)

    def _without_effect(self, policy: Policy, agent: int) -> dict[str, Any]:
        """Return an agent's declared arrays, copies of those that the policy changes: learning must not notice."""
        held = dict(self._declared[agent])
        return held | {own.name: copy.deepcopy(held[own.name]) for own in policy.declare_state() if own.name in held}

    def predict(self, observation: Any, deterministic: bool | None, action_masks: Any = None) -> Any:
        """Return the actions for an observation, for a batch of them, or for a dict of observations by agent.

        Raises
        ------
        ParameterError, ParameterTypeError, ObservationError
            If an observation is none of the environment's, or a mask none of its actions, or it allows none.
        """

        def choose(agent: int, states: NDArray[Any], given: BoolArray | None) -> NDArray[Any]:
            allowed = None if given is None else self._whole_rows(given)
            return self._choose(agent, states, allowed, deterministic)

        return self.problem.decide(observation, choose, action_masks)

    def _whole_rows(self, given: BoolArray) -> BoolArray:
        """Return masks of all of a table's actions, (..., A); those that an agent does not have may not be taken."""
        if not given.any(axis=-1).all():
            raise ObservationError(FORBIDS_ALL)
        allowed = np.zeros((*given.shape[:-1], self.q.shape[2]), dtype=np.bool_)
        allowed[..., : given.shape[-1]] = given
        return allowed

    def _choose(
        self, agent: int, states: NDArray[Any], allowed: BoolArray | None, deterministic: bool | None
    ) -> NDArray[Any]:
        """Return the actions in states of any shape, of those that are `allowed`, (..., A), or were while learning."""
        table, policy = self._followed(agent, deterministic)
        known = self._action_masks[agent]
        if allowed is None and known.size:
            allowed = known[states]
        if isinstance(policy, Greedy) and not (deterministic is False and self._random_ties):
            values = table[states]  # NumPy needs not be compiled as a kernel would
            actions: NDArray[Any] = (values if allowed is None else np.where(allowed, values, -np.inf)).argmax(axis=-1)
            return actions
        flat = np.ascontiguousarray(states, dtype=np.int64).reshape(-1)
        cumulative = self._probabilities(agent, flat, allowed, deterministic).cumsum(axis=1)
        u = self._rng.random((flat.size, 1)) * cumulative[:, -1:]
        return (cumulative <= u).sum(axis=1).reshape(states.shape)

    def _probabilities(
        self, agent: int, states: IntArray, allowed: BoolArray | None, deterministic: bool | None
    ) -> FloatArray:
        """Return how probable each action is in `states`, (B, A), up to a factor; 0 for all that are not allowed."""
        probabilities = np.empty((states.size, self.q.shape[2]))
        rows = _ALL_ALLOWED if allowed is None else allowed.reshape(probabilities.shape)
        mask = rows if allowed is None else np.zeros(self.q.shape[1:], dtype=np.bool_)  # room for one row at a time
        arrays = self.agent(agent, deterministic, action_mask=mask)
        _write_rows(arrays, states, rows, probabilities)
        raise_fault("predict", None, [arrays])
        check_probabilities(self._followed(agent, deterministic)[1], arrays.policy, states, probabilities)
        if allowed is not None:
            probabilities[~rows] = 0.0  # whatever a policy of the user's own makes of masks
            nothing = probabilities.sum(axis=1) <= 0.0
            probabilities[nothing] = rows[nothing]
        return probabilities
