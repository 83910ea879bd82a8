"""What a policy is: a strategy that gives an action and its probabilities, wherever a learner acts."""

from abc import abstractmethod
from collections.abc import Callable, Mapping
from functools import cached_property
from inspect import signature
from typing import Any

import numpy as np

from tuckerl._jit import ByKind, is_ours, kernel
from tuckerl.errors import LearnerError
from tuckerl.problems.immutable import Immutable
from tuckerl.training.agent_arrays import AgentArrays
from tuckerl.training.declared_state import DeclaredArray
from tuckerl.training.guards import guarded_choose, guarded_probabilities
from tuckerl.training.schedules import Schedule, ScheduleValues
from tuckerl.types import BoolArray, FloatArray, IntArray

_SUM_TOLERANCE = 1e-6
_CHOOSE: dict[type, Callable[..., int]] = {}
_PROBABILITIES: dict[type, Callable[..., None]] = {}
_EXPECTED_VALUE: dict[type, Callable[..., float]] = {}

choose = ByKind(_CHOOSE)
"""``choose(agent.policy, agent, state)`` returns an action."""

write_probabilities = ByKind(_PROBABILITIES)
"""``write_probabilities(agent.policy, agent, state, out)`` writes each action's probability into `out` (A,)."""

expected_value = ByKind(_EXPECTED_VALUE)
"""``expected_value(agent.policy, agent, state, room)``: what the next action is worth in the mean; `room` is (A,)."""


def register_policy(arrays: type, *, choose: Callable[..., int], probabilities: Callable[..., None]) -> None:
    """Register the kernels of a policy under the type of its arrays.

    Parameters
    ----------
    arrays : type
        A NamedTuple: what the policy's kernels read, see :meth:`Policy.arrays`.
    choose : kernel ``(policy, agent, state) -> action``
        Chooses an action that ``agent.action_mask`` allows, drawing from ``agent.rng``.
    probabilities : kernel ``(policy, agent, state, out) -> None``
        Writes the probability of each action into `out` (A,), 0 for those that are not allowed.

    Raises
    ------
    ParameterError, ParameterTypeError
        If a kernel takes other arguments, or is no function.
    """
    _CHOOSE[arrays], _PROBABILITIES[arrays] = guarded_choose(choose), guarded_probabilities(probabilities)
    _EXPECTED_VALUE[arrays] = _by_probabilities


def register_expected_value(arrays: type, expected_value: Callable[..., float]) -> None:
    """Register a shorter way to the expected value than by the probabilities: of our own policies, without a guard."""
    _EXPECTED_VALUE[arrays] = expected_value


@kernel
def _by_probabilities(policy: Any, agent: AgentArrays, state: int, room: FloatArray) -> float:
    """Return the mean of a row of ``agent.q`` (S, A) over the probabilities, which are left in `room` (A,)."""
    write_probabilities(policy, agent, state, room)
    expected = 0.0
    for action in range(room.size):
        expected += room[action] * agent.q[state, action]
    return expected


def check_policy_registered(policy: "Policy", arrays: Any) -> None:
    """Refuse a policy whose kernels nobody has registered; `arrays` is what its kernels would read.

    Raises
    ------
    LearnerError
        If that is so.
    """
    if type(arrays) not in _CHOOSE:
        name = type(arrays).__name__
        raise LearnerError(
            f"no kernels are registered for {name}, which arrays() of {type(policy).__name__} returns: call "
            f"register_policy({name}, choose=..., probabilities=...) in its file"
        )


def check_probabilities(policy: "Policy", arrays: Any, states: IntArray, probabilities: FloatArray) -> None:
    """Refuse rows that are no distributions, as a policy of a user's own may write them.

    Parameters
    ----------
    policy : Policy
        Perhaps one of ours around a user's.
    arrays : NamedTuple
        What its kernels have read.
    states : (B,) int64
    probabilities : (B, A) float64
        One row for each of the states.

    Raises
    ------
    LearnerError
        If a number is negative or not finite, or a row does not sum to 1 (to 1e-6).
    """
    if is_ours(type(policy)) and is_ours(type(arrays)):
        return
    wrong = ~((probabilities >= 0.0).all(axis=1) & (np.abs(probabilities.sum(axis=1) - 1.0) <= _SUM_TOLERANCE))
    if wrong.any():
        row = int(np.argmax(wrong))
        raise LearnerError(
            f"probabilities of {type(arrays).__name__} must write numbers from 0 that sum to 1; in state {states[row]} "
            f"it wrote {probabilities[row].tolist()[:20]}"
        )


class Policy(Immutable):
    """How a learner chooses its actions.

    A subclass keeps what its constructor is given as attributes of the same names, which is how they are saved. A
    policy does not change once it is made: to act otherwise, a learner is given another one (``agent.policy = ...``).
    """

    def parameters(self) -> dict[str, Any]:
        """Return what the constructor was given, by name."""
        return {name: getattr(self, name) for name in signature(type(self)).parameters}

    def schedules(self) -> dict[str, Schedule]:
        """Return the numbers that may follow a schedule, by name; kernels find their values in this order."""
        return {}

    @cached_property
    def schedule_values(self) -> ScheduleValues:
        """The values of `schedules`, kept as far as they have been needed."""
        return ScheduleValues(self.schedules())

    def declare_state(self) -> tuple[DeclaredArray, ...]:
        """Return the arrays that the policy changes while learning goes on; see :class:`DeclaredArray`."""
        return ()

    @abstractmethod
    def arrays(self, scheduled: FloatArray, declared: Mapping[str, Any]) -> Any:
        """Return what the policy's kernels read for one agent: a NamedTuple of a registered type.

        Parameters
        ----------
        scheduled : (number of schedules,) float64
            The values of `schedules` in the present episode; the loop writes them at the start of each episode.
        declared : mapping
            The agent's declared arrays by name: the policy's own and the algorithm's.
        """

    def target(self) -> "Policy | None":
        """Return the policy that is learned for, without exploration; None is the greedy one."""
        return None

    def preferences(self, q: FloatArray, declared: Mapping[str, Any]) -> FloatArray:
        """Return the (S, A) table whose largest allowed entry in a row is the most probable action.

        Parameters
        ----------
        q : (S, A) float64
        declared : mapping
            The agent's declared arrays by name.
        """
        return q

    def table(self, q: FloatArray, declared: Mapping[str, Any], action_mask: BoolArray) -> FloatArray:
        """Return the (S, A) table that is played by: `q`, unless an algorithm's own `act` lets the policy see another.

        Parameters
        ----------
        q : (S, A) float64
        declared : mapping
            The agent's declared arrays by name.
        action_mask : (S, A) or (0, 0) bool
            Where actions may be taken, as far as is known; (0, 0) where all always may.
        """
        return q
