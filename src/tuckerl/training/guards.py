"""Guards around kernels that others wrote: what they do wrong stops learning, and Python says which did what.

They are compiled with bounds checks, which make an error of an access outside of an array; what they return is looked
at before it is used as an index. The guards are put around them when they are registered, so the library's own kernels
pay nothing; what takes other arguments than it will be given is refused then.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from tuckerl._jit import is_ours, kernel, recompiled
from tuckerl.checks import check_function
from tuckerl.errors import LearnerError
from tuckerl.generalization.change_log import NO_STRAY, STRAY
from tuckerl.problems.dynamics import WorldArrays, is_possible
from tuckerl.training.agent_arrays import AgentArrays
from tuckerl.types import FloatArray

STOPS = -1
"""What a guard returns instead of an action where learning must stop."""

# What `AgentArrays.fault` holds once a kernel has done something impossible; KIND is 0 while there is none.
KIND, KERNEL, STATE, VALUE = range(4)
RAISED, OUT_OF_RANGE, FORBIDDEN, STRAYED = 1, 2, 3, 4
ACT, UPDATE, END_EPISODE, CHOOSE, PROBABILITIES, DYNAMICS = range(6)
_NAMES = ("act", "update", "end_episode", "choose", "probabilities")


@kernel
def note_fault(fault: FloatArray, kind: int, number: int, state: int, value: float) -> None:
    """Keep the first impossible thing in `fault`, (4,) float64, for Python to raise."""
    if fault[KIND] == 0:
        fault[KIND], fault[KERNEL], fault[STATE], fault[VALUE] = kind, number, state, value


@kernel
def _checked(agent: AgentArrays, number: int, state: int, action: float) -> int:
    """Return an action that a kernel chose as an int, or `STOPS` where it may not be taken."""
    if not (0 <= action < agent.q.shape[1] and action == int(action)):
        note_fault(agent.fault, OUT_OF_RANGE, number, state, action)
        return STOPS
    if agent.action_mask.size > 0 and not agent.action_mask[state, int(action)]:
        note_fault(agent.fault, FORBIDDEN, number, state, action)
        return STOPS
    return int(action)


def guarded_act(act: Callable[..., int]) -> Callable[..., int]:
    """Return a user's `act` within a guard; ours as it is."""
    check_function("act", act, "algorithm, agent, state")
    if is_ours(act):
        return act
    inner = recompiled(act)

    @kernel
    def guarded(algorithm: Any, agent: AgentArrays, state: int) -> int:
        action, raised = 0.0, False
        try:
            action = float(inner(algorithm, agent, state))
        except Exception:  # noqa: BLE001  # whatever a user's kernel raises; Numba knows no other clause
            raised = True
        if raised:
            note_fault(agent.fault, RAISED, ACT, state, 0.0)
            return STOPS
        if action == STOPS:  # a value is not finite any more, or the policy's own guard has said so
            return STOPS
        return _checked(agent, ACT, state, action)

    return guarded


def guarded_choose(choose: Callable[..., int]) -> Callable[..., int]:
    """Return a user's policy's `choose` within a guard; ours as it is."""
    check_function("choose", choose, "policy, agent, state")
    if is_ours(choose):
        return choose
    inner = recompiled(choose)

    @kernel
    def guarded(policy: Any, agent: AgentArrays, state: int) -> int:
        action, raised = 0.0, False
        try:
            action = float(inner(policy, agent, state))
        except Exception:  # noqa: BLE001  # as above
            raised = True
        if raised:
            note_fault(agent.fault, RAISED, CHOOSE, state, 0.0)
            return STOPS
        return _checked(agent, CHOOSE, state, action)

    return guarded


def guarded_probabilities(probabilities: Callable[..., None]) -> Callable[..., None]:
    """Return a user's policy's `probabilities` within a guard, which leaves NaN after an error; ours as it is."""
    check_function("probabilities", probabilities, "policy, agent, state, out")
    if is_ours(probabilities):
        return probabilities
    inner = recompiled(probabilities)

    @kernel
    def guarded(policy: Any, agent: AgentArrays, state: int, out: FloatArray) -> None:
        """Write into `out` (A,)."""
        raised = False
        try:
            inner(policy, agent, state, out)
        except Exception:  # noqa: BLE001  # as above
            raised = True
        if raised:
            note_fault(agent.fault, RAISED, PROBABILITIES, state, 0.0)
            out[:] = np.nan

    return guarded


def guarded_update(update: Callable[..., bool]) -> Callable[..., bool]:
    """Return a user's `update` within a guard; ours as it is."""
    check_function("update", update, "algorithm, agent, transition, next_action")
    if is_ours(update):
        return update
    inner = recompiled(update)

    @kernel
    def guarded(algorithm: Any, agent: AgentArrays, transition: Any, next_action: int) -> bool:
        finite, raised = False, False
        try:
            finite = bool(inner(algorithm, agent, transition, next_action))
        except Exception:  # noqa: BLE001  # as above
            raised = True
        if raised:
            note_fault(agent.fault, RAISED, UPDATE, transition.state, 0.0)
        return _goes_on(agent, UPDATE, transition.state) and finite

    return guarded


def guarded_end(end_episode: Callable[..., bool]) -> Callable[..., bool]:
    """Return a user's `end_episode` within a guard; ours as it is."""
    check_function("end_episode", end_episode, "algorithm, agent, finished")
    if is_ours(end_episode):
        return end_episode
    inner = recompiled(end_episode)

    @kernel
    def guarded(algorithm: Any, agent: AgentArrays, finished: bool) -> bool:
        finite, raised = False, False
        try:
            finite = bool(inner(algorithm, agent, finished))
        except Exception:  # noqa: BLE001  # as above
            raised = True
        if raised:
            note_fault(agent.fault, RAISED, END_EPISODE, -1, 0.0)
        return _goes_on(agent, END_EPISODE, -1) and finite

    return guarded


@kernel
def _goes_on(agent: AgentArrays, number: int, state: int) -> bool:
    """Return whether nothing impossible was done so far, rows that were recorded included."""
    stray = agent.log.cursor[STRAY]
    if stray != NO_STRAY:
        note_fault(agent.fault, STRAYED, number, state, stray)
        agent.log.cursor[STRAY] = NO_STRAY
    return agent.fault[KIND] == 0


@kernel
def strays(world: WorldArrays, agent: AgentArrays, state: int) -> bool:
    """Return whether a problem of a user's own has given a state that is no row of ``agent.q`` (S, A)."""
    if is_possible(world, state, agent.q.shape[0]):
        return False
    note_fault(agent.fault, OUT_OF_RANGE, DYNAMICS, -1, state)
    return True


def raise_fault(subject: str, world: Any, agents: Sequence[AgentArrays]) -> None:
    """Raise the first impossible thing that a kernel of a user's own has done, if any.

    Parameters
    ----------
    subject : str
        Whose kernels played, as messages name it.
    world : NamedTuple
        What they played.
    agents : sequence of AgentArrays

    Raises
    ------
    LearnerError
        It names the kernel, the state and the value.
    """
    for agent in agents:
        if agent.fault[KIND]:
            raise LearnerError(f"{subject}: {_fault_text(agent, world)}")


def _fault_text(agent: AgentArrays, world: Any) -> str:
    kind, number, state = (int(agent.fault[i]) for i in (KIND, KERNEL, STATE))
    value, (n_states, n_actions) = f"{agent.fault[VALUE]:.15g}", agent.q.shape
    if number == DYNAMICS:
        return (
            f"the kernels of {type(world).__name__} must give states from 0 to {n_states - 1}; they gave {value} (an "
            "error in one of them reads as -1)"
        )
    owner = agent.policy if number in (CHOOSE, PROBABILITIES) else agent.algorithm
    name = f"{_NAMES[number]} of {type(owner).__name__}"
    where = "" if state < 0 else f" in state {state}"
    if kind == RAISED:
        return (
            f"{name} raised an error{where}, or reached outside of an array: tuckerl.testing.check_learner says which, "
            "or run it in plain Python (NUMBA_DISABLE_JIT=1)"
        )
    if kind == STRAYED:
        return f"{name} must record rows from 0 to {n_states - 1} by record_change; it recorded {value}{where}"
    if kind == FORBIDDEN:
        return f"{name} returned action {value}{where}, where it is forbidden: look at agent.action_mask (is_allowed)"
    return f"{name} must return an action from 0 to {n_actions - 1}; it returned {value}{where}"
