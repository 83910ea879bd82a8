r"""Eligibility traces at their true cost: |A| work a step, whatever the number of states.

Figures 2 and 8 change every entry of the table at every step, Q(s, a) <- Q(s, a) + alpha omega(a) delta e(s, a), and
then let every trace decay, e <- gamma lambda e. Since all traces decay alike, a trace is a constant times the running
product phi of the decays, and all that a row has missed since it was last brought up to date is that constant times


.. math:: \Delta = \sum_i \delta_i \varphi_i

summed over the steps since. So a step adds one number to Delta, and only the rows that are looked at are brought up
to date: exactly, not approximately (Wiering and Schmidhuber 1998, "Fast online Q(lambda)"). Before phi gets so small
that its inverse costs digits, everything is rebased to phi = 1.
"""

from typing import NamedTuple

import numpy as np

from tuckerl._jit import kernel
from tuckerl.generalization.change_log import ChangeLog, mark
from tuckerl.types import BoolArray, FloatArray, StateArray

# Rows meet Delta multiplied by up to 1 / phi, so phi at 1e-4 costs four of sixteen digits; at 1e-6, as good a choice
# for speed (rebasing is rare), it would be six.
_REBASE_BELOW = 1e-4
_FORGET_BELOW = 1e-16  # no float of any size notices a trace this small

PRODUCT, SUM = 0, 1


class Traces(NamedTuple):
    """One agent's traces, kept row by row."""

    constant: FloatArray  # (S, A) e(s, a) / phi; zero in rows that are not active
    seen: FloatArray  # (S,) what Delta was when the row was last brought up to date
    active: BoolArray  # (S,) whether the row has any trace
    rows: StateArray  # (S,) the active rows in order of their first visit
    n_rows: StateArray  # (1,)
    clock: FloatArray  # (2,) phi and Delta


class Decay(NamedTuple):
    """How traces grow and decay."""

    decay: float  # gamma lambda: 0 is the one-step algorithm, without traces
    replacing: bool  # e <- 1 at a visit; otherwise e <- e + 1
    carried: bool  # from one episode to the next; otherwise episodes begin without traces


def empty_traces(n_states: int, n_actions: int) -> Traces:
    """Return the traces of an agent that has been nowhere."""
    return Traces(
        constant=np.zeros((n_states, n_actions)),
        seen=np.zeros(n_states),
        active=np.zeros(n_states, dtype=np.bool_),
        rows=np.zeros(n_states, dtype=np.uint32),
        n_rows=np.zeros(1, dtype=np.uint32),
        clock=np.array([1.0, 0.0]),
    )


@kernel
def bring_up_to_date(
    traces: Traces, q: FloatArray, weights: FloatArray, alpha: float, log: ChangeLog, state: int
) -> None:
    """Give a row of `q` all that it has missed."""
    missed = traces.clock[SUM] - traces.seen[state]
    if traces.active[state] and missed != 0.0:
        mark(log, state)
        for action in range(q.shape[1]):
            q[state, action] += alpha * weights[action] * traces.constant[state, action] * missed
    traces.seen[state] = traces.clock[SUM]


@kernel
def visit(traces: Traces, decay: Decay, state: int, action: int) -> None:
    """Give a pair its trace; its row must be up to date."""
    if not traces.active[state]:
        traces.active[state] = True
        traces.rows[traces.n_rows[0]] = state
        traces.n_rows[0] += 1
    one = 1.0 / traces.clock[PRODUCT]
    traces.constant[state, action] = one if decay.replacing else traces.constant[state, action] + one


@kernel
def learn_from(
    traces: Traces, decay: Decay, q: FloatArray, weights: FloatArray, alpha: float, log: ChangeLog, delta: float
) -> None:
    """Let a step's error reach all pairs by their traces, and let the traces decay."""
    traces.clock[SUM] += delta * traces.clock[PRODUCT]
    traces.clock[PRODUCT] *= decay.decay
    if traces.clock[PRODUCT] < _REBASE_BELOW:
        settle(traces, q, weights, alpha, log, True)


@kernel
def settle(traces: Traces, q: FloatArray, weights: FloatArray, alpha: float, log: ChangeLog, keep: bool) -> bool:
    """Bring all rows up to date and begin anew from phi = 1, keeping the traces or not; return whether q is finite."""
    total, kept = 0.0, 0
    for place in range(traces.n_rows[0]):
        state = traces.rows[place]
        bring_up_to_date(traces, q, weights, alpha, log, state)
        alive = False
        for action in range(q.shape[1]):
            trace = traces.constant[state, action] * traces.clock[PRODUCT] if keep else 0.0
            trace = 0.0 if trace < _FORGET_BELOW else trace
            traces.constant[state, action] = trace
            alive = alive or trace > 0.0
            total += q[state, action] - q[state, action]  # 0 for a finite number, NaN for any other
        traces.active[state] = alive
        traces.seen[state] = 0.0
        if alive:
            traces.rows[kept] = state
            kept += 1
    traces.n_rows[0] = kept
    traces.clock[PRODUCT], traces.clock[SUM] = 1.0, 0.0
    return np.isfinite(total)
