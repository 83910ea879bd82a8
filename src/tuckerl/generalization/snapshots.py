"""The window of Q-tables that the tensor step factorises, and who changed what in it, rebuilt from what changed.

Axes are (state, action, episode, agent), as in the paper's MQT tensor. The state axis holds the states whose row some
agent changed in the window, in the order of first touch. All other rows are the same in every episode, and most are the
same in every table. They count exactly, at the cost of a few rows: the row space of the state mode is all that the
other factors see, so rows that stood still may be replaced by a triangular factor of theirs, at most A x N rows, and
those that nobody ever touched by at most A (zeros need none). So the step's cost follows what was visited lately.
"""

import functools
import math

import numpy as np
import scipy.linalg

from tuckerl.generalization.change_log import ENTRIES, ChangeLog, restart_log
from tuckerl.generalization.log_reading import (
    add_touched,
    copy_rows,
    count_changes,
    mark_changed,
    part_rows,
    replay,
    write_changed,
)
from tuckerl.saved_arrays import SavedArrays, check_distinct
from tuckerl.types import BoolArray, FloatArray, IntArray


class Snapshots:
    """The tables of the current window for N agents, E episodes, S states and A actions."""

    def __init__(self, initial_q: FloatArray, n_agents: int) -> None:
        self._initial_q = initial_q  # (S, A), possibly broadcast from one number
        self._n_agents = n_agents
        n_states, n_actions = initial_q.shape
        self._position = np.full(n_states, -1, dtype=np.int64)  # of each state on the tensor's state axis
        self._touched = np.empty(n_states, dtype=np.int64)  # room for the states in that order
        self.states: IntArray = self._touched[:0]  # (V,) the touched states, in that order
        self.changed: IntArray = np.zeros(0, dtype=np.int64)  # (C,) those that changed in the latest tensor's window
        self._n_read: list[int] = []  # how many entries of the logs have been looked at, if they were not begun anew
        self._room: FloatArray = np.empty((0, n_actions, n_agents))
        self._base = self._room  # (V, A, N) their rows when the logs began, at the beginning of that room
        self._counted = np.empty(n_states, dtype=np.int64)  # room for the states that `changes` counts
        self._place = np.full(n_states, -1, dtype=np.int64)  # of each of them among these, while it does
        self.may_differ = False  # whether the agents' rows may have differed after they were last to be shared

    @property
    def n_states(self) -> int:
        """Rows of a table."""
        return len(self._initial_q)

    def tensor(self, logs: tuple[ChangeLog, ...], places: IntArray, unit: float = 1.0) -> FloatArray:
        """Return the window's tables as a (C + at most A x N + A, A, E, N) array, C rows being those that changed.

        Parameters
        ----------
        logs : N change logs
        places : (E,) int64
            Those of the window's episodes in the logs; what is logged from the first of them on has changed in it.
        unit : float
            A power of two by which the tables are multiplied, so that rows that stand for many stay finite.
        """
        self._add_states(logs)
        base, first = self._rows_before(logs, int(places[0])), int(places[0])
        begins = [_n_entries(log, first) for log in logs]
        n_touched, n_actions, n_agents = base.shape
        place, rows = np.full(n_touched, -1, dtype=np.int64), np.empty(n_touched, dtype=np.int64)
        for log, begin in zip(logs, begins, strict=True):
            mark_changed(place, self._position, log, begin)
        room = np.empty((n_touched, n_actions * n_agents))
        n, are_equal = part_rows(place, rows, room, base)
        changed = rows[:n]
        self.changed = self.states[changed]
        still = self._still_rows(room[: n_touched - n], unit, are_equal=are_equal)
        untouched = self._untouched_rows(unit)
        n_known = n + len(still)
        tensor = np.empty((n_known + len(untouched), n_actions, places.size, n_agents))
        tensor[n:n_known] = still[:, :, None]
        tensor[n_known:] = untouched[:, :, None, None]
        latest = np.empty((n, places.size), dtype=np.int64)
        for agent, (log, begin) in enumerate(zip(logs, begins, strict=True)):
            write_changed(tensor, agent, base, changed, latest, self._position, place, log, places, begin)
        if unit != 1.0:
            tensor[:n] *= unit
        return tensor

    def changes(self, logs: tuple[ChangeLog, ...], first: int) -> tuple[IntArray, IntArray]:
        """Return the states whose rows may differ between agents, and who changed their entries how often.

        Parameters
        ----------
        logs : N change logs
        first : int
            The place of the window's first episode in the logs; those behind it are all of episodes.

        Returns
        -------
        states : (R,) int64
            Those that some agent changed in the window, and those whose rows differed when it began.
        changes : (N, R, A) int64
            In how many episodes each agent changed each entry: its value at the end is not that at the end before.
        """
        self._add_states(logs)
        base, n = self._rows_before(logs, first), 0
        for log in logs:
            n = add_touched(self._counted, n, self._place, log, _n_entries(log, first))
        try:
            changed = self._counted[:n]
            counts = np.zeros((self._n_agents, n, self._base.shape[1]), dtype=np.int64)
            for agent, log in enumerate(logs):
                rows = base[self._position[changed], :, agent]
                count_changes(counts[agent], rows, self._place, log, _n_entries(log, first))
            others = self._differing(base) if self.may_differ else changed[:0]
        finally:
            self._place[self._counted[:n]] = -1
        unchanged = np.zeros((self._n_agents, others.size, counts.shape[2]), dtype=np.int64)
        return np.concatenate([changed, others]), np.concatenate([counts, unchanged], axis=1)

    def touched(self, logs: tuple[ChangeLog, ...]) -> IntArray:
        """Return the states of which some agent has ever changed the row, (V,): no other rows can differ."""
        self._add_states(logs)
        return self.states

    def restart(self, logs: tuple[ChangeLog, ...], q: FloatArray, states: IntArray | None) -> None:
        """Begin the logs anew with the (N, S, A) tables as they are now.

        Parameters
        ----------
        logs : N change logs
        q : (N, S, A) float64
        states : (R,) int64 or None
            All whose rows are other ones than when the logs began; None where more than those may be.
        """
        self._add_states(logs)
        copy_rows(self._base, q, self.states if states is None else states, self._position)
        for log in logs:
            restart_log(log)
        self._n_read.clear()

    def saved(self) -> dict[str, np.ndarray]:
        """Return the arrays from which `restore` goes on."""
        return {"states": self.states, "base": self._base}

    def read(self, arrays: SavedArrays, *, finite: bool) -> dict[str, np.ndarray]:
        """Return the arrays that `saved` returned, from a file; where they must be `finite`, they are.

        Raises
        ------
        SavedFileError
            If they are none of such tables'.
        """
        n_states, n_actions = self._initial_q.shape
        states = arrays.take("states", np.int64, (range(n_states + 1),), 0, n_states - 1)
        check_distinct("the states of a window", states)
        base = arrays.take("base", np.float64, (states.size, n_actions, self._n_agents), finite=finite)
        return {"states": states, "base": base}

    def restore(self, arrays: dict[str, np.ndarray]) -> None:
        """Go on from what `saved` or `read` returned."""
        states, self._room = arrays["states"], arrays["base"]
        self._base = self._room
        self.may_differ = True  # as far as is known
        self._n_read.clear()
        self.states = self._touched[: states.size]
        self.states[:] = states
        self._position[states] = np.arange(states.size)

    def _add_states(self, logs: tuple[ChangeLog, ...]) -> None:
        n_entries = [int(log.cursor[ENTRIES]) for log in logs]
        if n_entries == self._n_read:  # a window's end asks several times
            return
        self._n_read = n_entries
        n_before = n_touched = self.states.size
        for log in logs:
            n_touched = add_touched(self._touched, n_touched, self._position, log, 0)
        if n_touched > n_before:
            self.states = self._touched[:n_touched]
            if n_touched > len(self._room):  # twice as much: all copies together are as long as the rows are
                room = np.empty((max(n_touched, 2 * n_before), *self._base.shape[1:]))
                room[:n_before] = self._base
                self._room = room
            self._base = self._room[:n_touched]
            self._base[n_before:] = self._initial_q[self.states[n_before:]][:, :, None]

    def _rows_before(self, logs: tuple[ChangeLog, ...], first: int) -> FloatArray:
        """Return the touched states' rows as they were before the place `first` of the logs, (V, A, N)."""
        if first == 0:
            return self._base
        rows = self._base.copy()
        for agent, log in enumerate(logs):
            replay(rows, agent, self._position, log, _n_entries(log, first))
        return rows

    def _differing(self, base: FloatArray) -> IntArray:
        """Return the states that are not counted at present and whose rows, (V, A, N), differ between agents."""
        rows = (base != base[:, :, :1]).any(axis=(1, 2))
        differing: IntArray = self.states[rows & (self._place[self.states] < 0)]
        return differing

    def _still_rows(self, rows: FloatArray, unit: float, *, are_equal: bool) -> FloatArray:
        """Return what stands for the touched rows that did not change: (at most A x N, A, N), or 1 for N equal ones."""
        if unit != 1.0:
            rows = rows * unit
        tables = rows.reshape(len(rows), rows.shape[1] // self._n_agents, self._n_agents)
        if self._n_agents > 1 and are_equal:  # as after a window that has shared all tables
            return _equivalent_rows(tables[:, :, 0])[:, :, None]
        return _equivalent_rows(tables)

    def _untouched_rows(self, unit: float) -> FloatArray:
        """Return what stands for the rows that nobody ever touched: (at most A, A)."""
        n_states, n_actions = self._initial_q.shape
        n_untouched = n_states - self.states.size
        first = one_number(self._initial_q)
        if first is not None:
            n_rows = 1 if first * unit != 0.0 and n_untouched else 0
            return np.full((n_rows, n_actions), first * unit * math.sqrt(n_untouched))
        untouched: BoolArray = self._position < 0
        return _equivalent_rows(self._initial_q[untouched] * unit)


def _equivalent_rows(rows: FloatArray) -> FloatArray:
    """Return few rows with the same Gram matrix as many: (n, ...) becomes (at most the size of a row, ...)."""
    length = math.prod(rows.shape[1:])
    if len(rows) <= length:
        return rows
    reflected = scipy.linalg.lapack.dgeqrf(rows.reshape(-1, length))[0]  # R, and what Q is made of below it
    factor: FloatArray = reflected[:length] * _upper(length)
    return factor.reshape(-1, *rows.shape[1:])


@functools.cache
def _upper(n: int) -> FloatArray:
    """Return an (n, n) matrix of ones on and above the diagonal, and zeros below it."""
    ones: FloatArray = np.triu(np.ones((n, n)))
    return ones


def _n_entries(log: ChangeLog, place: int) -> int:
    """Return how many entries a log has before a place."""
    return int(log.end[place - 1]) if place > 0 else 0


def one_number(table: FloatArray) -> float | None:
    """Return the number that fills a table (S, A) at no cost, as it was broadcast; None where it has entries."""
    return None if any(table.strides) else float(table[0, 0])
