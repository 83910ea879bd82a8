r"""Eligibility traces at their true cost: |A| work a step, whatever the number of states.

Figures 2 and 8 change every entry of the table at every step, Q(s, a) <- Q(s, a) + alpha omega(a) delta e(s, a), and
then let every trace decay, e <- gamma lambda e. Since all traces decay alike, a trace is a constant times the running
product phi of the decays, and all that a row has missed since it was last brought up to date is that constant times

.. math:: \Delta = \sum_i \delta_i \varphi_i

summed over the steps since. So a step adds one number to Delta, and only the rows that are looked at are brought up
to date: exactly, not approximately (Wiering and Schmidhuber 1998, "Fast online Q(lambda)").

Before phi gets too small to be divided by, a new *epoch* begins from phi = 1 and Delta = 0. A row that was last looked
at in an earlier epoch finds there what it needs to catch up, so no step waits until all rows are moved to the new one.
"""

from enum import IntEnum
from typing import NamedTuple

import numpy as np

from tuckerl._jit import kernel
from tuckerl.generalization.change_log import ChangeLog, keep_row, record_change
from tuckerl.saved_arrays import SavedArrays, check_distinct
from tuckerl.types import FloatArray, IntArray, StateArray

_NEW_EPOCH_BELOW = 1e-8
_FAST_DECAY = 1e-4  # a visit to a row that missed the last step costs as many digits as one decay takes
_N_EPOCHS = 40  # then a trace of the first epoch is below 1e-8 ** 40, smaller than any float
_FORGET_BELOW = 1e-300  # not earlier: however small its trace, a pair of value 0 becomes better than others of value 0

PHI, DELTA, REST = 0, 1, 2
LATER, SCALE = 3, 4
ROWS, EPOCH = 0, 1


class Trace(IntEnum):
    """What a visit makes of a pair's trace."""

    REPLACING = 0  # e <- 1
    ACCUMULATING = 1  # e <- e + 1
    DUTCH = 2  # e <- (1 - alpha omega) e + 1


class Decay(NamedTuple):
    """How traces grow and decay."""

    factor: float  # gamma lambda: 0 is the one-step algorithm, without traces
    trace: int  # a `Trace`
    carried: bool  # from one episode to the next; otherwise episodes begin without traces


class Traces(NamedTuple):
    """One agent's traces: a slot for each state that has any, so that they lie together in memory.

    Delta is the sum of two numbers, the second being what the first lost by rounding: small errors count among large
    ones, as they do in the sweep over all pairs.
    """

    decay: Decay
    slot: StateArray  # (S,) where a state's row is, from 1; 0 where it has none
    state: StateArray  # (S + 1,) whose row it is
    constant: FloatArray  # (S + 1, A) e(s, a) / phi; zero in slots that are free
    synced: FloatArray  # (S + 1, 2) what DELTA and REST were when the row was last brought up to date
    epoch: StateArray  # (S + 1,) and in which epoch that was
    clock: FloatArray  # (3,) PHI, DELTA and REST
    past: FloatArray  # (_N_EPOCHS, 5) for each epoch before this one: clock at its end, what followed, phi since
    cursor: IntArray  # (2,) slots in use, and the present epoch

    def to_arrays(self) -> dict[str, np.ndarray]:
        """Return the states that have traces and these, taken between two episodes, when all rows are in sync."""
        slots = slice(1, self.cursor[ROWS] + 1)
        return {"state": self.state[slots].copy(), "constant": self.constant[slots].copy()}

    def set_arrays(self, arrays: SavedArrays) -> None:
        """Replace the traces by those that `to_arrays` returned, if an episode may begin with traces.

        Raises
        ------
        SavedFileError
            If they are no traces: kernels use states as indices, and slots are as many as states.
        """
        n_states = self.slot.size
        states = arrays.take("state", np.uint32, (range(n_states + 1),), 0, n_states - 1)
        check_distinct("the states that have traces", states)
        traces = arrays.take("constant", np.float64, (states.size, self.constant.shape[1]), 0.0, finite=True)
        self.clear()
        if not self.decay.carried:
            return
        n_rows = states.size
        slots = slice(1, n_rows + 1)
        self.state[slots], self.constant[slots] = states, traces
        self.slot[states], self.cursor[ROWS] = np.arange(1, n_rows + 1), n_rows
        self.synced[slots], self.epoch[slots] = 0.0, 0

    def clear(self) -> None:
        """Forget all traces, also in the middle of an episode."""
        slots = slice(1, self.cursor[ROWS] + 1)
        self.slot[self.state[slots]], self.constant[slots], self.cursor[:] = 0, 0.0, 0
        self.clock[:] = 1.0, 0.0, 0.0


def empty_traces(n_states: int, n_actions: int, decay: Decay) -> Traces:
    """Return the traces of an agent that has been nowhere."""
    return Traces(
        decay=decay,
        slot=np.zeros(n_states, dtype=np.uint32),
        state=np.zeros(n_states + 1, dtype=np.uint32),
        constant=np.zeros((n_states + 1, n_actions)),
        synced=np.zeros((n_states + 1, 2)),
        epoch=np.zeros(n_states + 1, dtype=np.uint32),
        clock=np.array([1.0, 0.0, 0.0]),
        past=np.zeros((_N_EPOCHS, 5)),
        cursor=np.zeros(2, dtype=np.int64),
    )


@kernel
def sync_row(traces: Traces, q: FloatArray, step_sizes: FloatArray, log: ChangeLog, state: int) -> None:
    """Give a row of `q` all that it has missed.

    Parameters
    ----------
    traces : Traces
    q : (S, A) float64
        Changed in place.
    step_sizes : (A,) float64
        Alpha times omega.
    log : ChangeLog
        Where the change is recorded.
    state : int
    """
    slot = traces.slot[state]
    if slot == 0:
        return
    clock, synced, scale = traces.clock, traces.synced[slot], 1.0
    missed = (clock[DELTA] - synced[0]) + (clock[REST] - synced[1])
    if traces.epoch[slot] != traces.cursor[EPOCH]:
        past = traces.past[traces.epoch[slot]]
        since = past[LATER] + past[SCALE] * (clock[DELTA] + clock[REST])
        missed = (past[DELTA] - synced[0]) + (past[REST] - synced[1]) + past[PHI] * since
        scale = past[PHI] * past[SCALE]
    if missed != 0.0:
        record_change(log, state)
        for action in range(q.shape[1]):
            q[state, action] += step_sizes[action] * (traces.constant[slot, action] * missed)
    if scale != 1.0:
        traces.epoch[slot] = traces.cursor[EPOCH]
        for action in range(q.shape[1]):
            traces.constant[slot, action] *= scale
    synced[0], synced[1] = clock[DELTA], clock[REST]


@kernel
def value_of(traces: Traces, q: FloatArray, step_sizes: FloatArray, log: ChangeLog, state: int, action: int) -> float:
    """Return Q(s, a) as it is up to date, without the work for its row where that is possible.

    Parameters
    ----------
    traces : Traces
    q : (S, A) float64
        Changed in place.
    step_sizes : (A,) float64
        Alpha times omega.
    log : ChangeLog
        Where a change is recorded.
    state, action : int
    """
    slot = traces.slot[state]
    # A pair without a trace has missed nothing: its value, perhaps 0, must not meet what its row has missed.
    if slot != 0 and (traces.epoch[slot] != traces.cursor[EPOCH] or traces.constant[slot, action] == 0.0):
        sync_row(traces, q, step_sizes, log, state)
    return q[state, action] + step_sizes[action] * (traces.constant[slot, action] * _missed(traces, slot))


@kernel
def _missed(traces: Traces, slot: int) -> float:
    """Return what a row of this epoch has missed."""
    if slot == 0:
        return 0.0
    return (traces.clock[DELTA] - traces.synced[slot, 0]) + (traces.clock[REST] - traces.synced[slot, 1])


@kernel
def learn(
    traces: Traces, q: FloatArray, step_sizes: FloatArray, log: ChangeLog, state: int, action: int, delta: float
) -> bool:
    """Visit a pair whose value was looked up, let a step's error reach all pairs by their traces, and let these decay.

    Parameters
    ----------
    traces : Traces
    q : (S, A) float64
        Changed in place.
    step_sizes : (A,) float64
        Alpha times omega.
    log : ChangeLog
        Where changes are recorded.
    state, action : int
        The pair.
    delta : float
        The step's error.

    Returns
    -------
    bool
        Whether everything is finite, as far as it was looked at.
    """
    if not np.isfinite(delta):
        flush_traces(traces, q, step_sizes, log, False)
        return False
    if traces.decay.factor == 0.0:
        record_change(log, state)
        q[state, action] += step_sizes[action] * delta
        return np.isfinite(q[state, action])
    if traces.decay.factor < _FAST_DECAY:
        sync_row(traces, q, step_sizes, log, state)
    _visit(traces, q, step_sizes, log, state, action)
    clock = traces.clock
    change = delta * clock[PHI]
    total = clock[DELTA] + change
    added = total - clock[DELTA]
    clock[REST] += (clock[DELTA] - (total - added)) + (change - added)
    clock[DELTA] = total
    clock[PHI] *= traces.decay.factor
    if clock[PHI] < _NEW_EPOCH_BELOW:
        _begin_epoch(traces)
        if traces.cursor[EPOCH] == _N_EPOCHS:
            return flush_traces(traces, q, step_sizes, log, True)
    return True


@kernel
def _visit(traces: Traces, q: FloatArray, step_sizes: FloatArray, log: ChangeLog, state: int, action: int) -> None:
    """Give a pair its trace, and its entry such a value that catching up with its row stays right for it.

    Parameters
    ----------
    traces : Traces
    q : (S, A) float64
        Changed at the pair.
    step_sizes : (A,) float64
        Alpha times omega.
    log : ChangeLog
        Where the row is recorded if it has missed something; else it is kept, and recorded when it catches up.
    state, action : int
        The pair.
    """
    slot = traces.slot[state]
    if slot == 0:
        traces.cursor[ROWS] += 1
        slot = np.uint32(traces.cursor[ROWS])
        traces.slot[state], traces.state[slot], traces.epoch[slot] = slot, state, traces.cursor[EPOCH]
        traces.synced[slot, 0], traces.synced[slot, 1] = traces.clock[DELTA], traces.clock[REST]
    missed = _missed(traces, slot)
    if missed != 0.0:  # what comes may cancel it, so that the row would not be seen to change when it catches up
        record_change(log, state)
    else:
        keep_row(log, state)
    before, kept = traces.constant[slot, action], 1.0
    if traces.decay.trace == Trace.REPLACING:
        kept = 0.0
    elif traces.decay.trace == Trace.DUTCH:
        kept = 1.0 - step_sizes[action]
    after = kept * before + 1.0 / traces.clock[PHI]
    traces.constant[slot, action] = after
    q[state, action] += step_sizes[action] * ((before - after) * missed)


@kernel
def _begin_epoch(traces: Traces) -> None:
    """Begin anew from phi = 1, and keep for each epoch before what its rows will need."""
    clock, past, epoch = traces.clock, traces.past, traces.cursor[EPOCH]
    for earlier in range(epoch):
        past[earlier, LATER] += past[earlier, SCALE] * (clock[DELTA] + clock[REST])
        past[earlier, SCALE] *= clock[PHI]
    past[epoch, PHI], past[epoch, DELTA], past[epoch, REST] = clock[PHI], clock[DELTA], clock[REST]
    past[epoch, LATER], past[epoch, SCALE] = 0.0, 1.0
    clock[PHI], clock[DELTA], clock[REST] = 1.0, 0.0, 0.0
    traces.cursor[EPOCH] += 1


@kernel
def flush_traces(traces: Traces, q: FloatArray, step_sizes: FloatArray, log: ChangeLog, keep: bool) -> bool:
    """Bring all rows up to date and begin anew from phi = 1.

    Parameters
    ----------
    traces : Traces
    q : (S, A) float64
        Changed in place.
    step_sizes : (A,) float64
        Alpha times omega.
    log : ChangeLog
        Where changes are recorded.
    keep : bool
        Whether traces go on; otherwise all are forgotten.

    Returns
    -------
    bool
        Whether the rows of `q` that have traces are finite.
    """
    n_broken, kept = 0, 0
    for slot in range(1, traces.cursor[ROWS] + 1):
        state = traces.state[slot]
        sync_row(traces, q, step_sizes, log, state)
        largest = 0.0
        for action in range(q.shape[1]):
            trace = traces.constant[slot, action] * traces.clock[PHI] if keep else 0.0
            trace = trace if abs(trace) > _FORGET_BELOW else 0.0  # dutch ones may be negative where alpha omega > 1
            largest = max(largest, abs(trace))
            traces.constant[slot, action] = 0.0
            traces.constant[kept + 1, action] = trace
            n_broken += q[state, action] - q[state, action] != 0.0  # 0 for a finite number, NaN for any other
        traces.slot[state] = 0
        if largest > 0.0:
            kept += 1
            traces.slot[state], traces.state[kept], traces.epoch[kept] = kept, state, 0
            traces.synced[kept, 0], traces.synced[kept, 1] = 0.0, 0.0
    traces.cursor[ROWS], traces.cursor[EPOCH] = kept, 0
    traces.clock[PHI], traces.clock[DELTA], traces.clock[REST] = 1.0, 0.0, 0.0
    return n_broken == 0
