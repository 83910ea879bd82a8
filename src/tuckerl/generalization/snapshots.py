"""The window of Q-tables that the tensor step factorises, rebuilt from what changed.

Axes are (state, action, episode, agent), as in the paper's MQT tensor. The state axis holds the states whose row some
agent changed in the window, in the order of first touch. All other rows are the same in every episode, and most are the
same in every table. They count exactly, at the cost of a few rows: the row space of the state mode is all that the
other factors see, so rows that stood still may be replaced by a triangular factor of theirs, at most A x N rows, and
those that nobody ever touched by at most A (zeros need none). So the step's cost follows what was visited lately.
"""

import math

import numpy as np

from tuckerl._jit import kernel
from tuckerl.generalization.change_log import ENTRIES, ChangeLog, restart_log
from tuckerl.saved_arrays import SavedArrays, check_distinct
from tuckerl.types import BoolArray, FloatArray, IntArray


class Snapshots:
    """The tables of the current window for N agents, E episodes, S states and A actions."""

    def __init__(self, initial_q: FloatArray, n_agents: int, n_episodes: int) -> None:
        self._initial_q = initial_q  # (S, A), possibly broadcast from one number
        self._n_agents, self._n_episodes = n_agents, n_episodes
        n_states, n_actions = initial_q.shape
        self._position = np.full(n_states, -1, dtype=np.int64)  # of each state on the tensor's state axis
        self._touched = np.empty(n_states, dtype=np.int64)  # room for the states in that order
        self.states: IntArray = self._touched[:0]  # (V,) the touched states, in that order
        self.changed: IntArray = np.zeros(0, dtype=np.int64)  # (C,) those that changed in the latest tensor's window
        self._room: FloatArray = np.empty((0, n_actions, n_agents))
        self._base = self._room  # (V, A, N) their rows when the window began, at the beginning of that room
        self._counted = np.empty(n_states, dtype=np.int64)  # room for the states that `changes` counts
        self._place = np.full(n_states, -1, dtype=np.int64)  # of each of them among these, while it does
        self.may_differ = False  # whether the agents' rows may have differed when the window began

    @property
    def n_states(self) -> int:
        """Rows of a table."""
        return len(self._initial_q)

    def tensor(self, logs: tuple[ChangeLog, ...], unit: float = 1.0) -> FloatArray:
        """Return the window's tables as a (C + at most A x N + A, A, E, N) array, C rows being those that changed.

        Parameters
        ----------
        logs : N change logs
        unit : float
            A power of two by which the tables are multiplied, so that rows that stand for many stay finite.
        """
        self._add_states(logs)
        place = np.full(self.states.size, -1, dtype=np.int64)
        for log in logs:
            _mark_changed(place, self._position, log)
        changed = np.flatnonzero(place >= 0)
        place[changed] = np.arange(changed.size)
        self.changed = self.states[changed]
        fixed = np.concatenate([self._still_rows(place, unit), self._untouched_rows(unit)])
        tensor = np.empty((changed.size + len(fixed), *self._base.shape[1:2], self._n_episodes, self._n_agents))
        tensor[changed.size :] = fixed[:, :, None, :]
        latest = np.empty((changed.size, self._n_episodes), dtype=np.int64)
        for agent, log in enumerate(logs):
            _find_latest(latest, self._position, place, log)
            _write_changed(tensor, agent, self._base, changed, latest, log)
        if unit != 1.0:
            tensor[: changed.size] *= unit
        return tensor

    def changes(self, logs: tuple[ChangeLog, ...]) -> tuple[IntArray, IntArray]:
        """Return the states whose rows may differ between agents, and who changed their entries how often.

        Returns
        -------
        states : (R,) int64
            Those that some agent changed in the window, and those whose rows differed when it began.
        changes : (N, R, A) int64
            In how many episodes each agent changed each entry: its value at the end is not that at the end before.
        """
        self._add_states(logs)
        n = 0
        for log in logs:
            n = _add_touched(self._counted, n, self._place, log)
        try:
            changed = self._counted[:n]
            counts = np.zeros((self._n_agents, n, self._base.shape[1]), dtype=np.int64)
            for agent, log in enumerate(logs):
                _count_changes(counts[agent], self._base[self._position[changed], :, agent], self._place, log)
            others = self._differing() if self.may_differ else changed[:0]
        finally:
            self._place[self._counted[:n]] = -1
        unchanged = np.zeros((self._n_agents, others.size, counts.shape[2]), dtype=np.int64)
        return np.concatenate([changed, others]), np.concatenate([counts, unchanged], axis=1)

    def restart(self, logs: tuple[ChangeLog, ...], q: FloatArray, states: IntArray | None, *, may_differ: bool) -> None:
        """Begin the next window with the (N, S, A) tables as they are now.

        Parameters
        ----------
        logs : N change logs
        q : (N, S, A) float64
        states : (R,) int64 or None
            All whose rows are other ones than when the window began; None where more than those may be.
        may_differ : bool
            Whether the agents' rows may differ.
        """
        self._add_states(logs)
        self.may_differ = may_differ
        _copy_rows(self._base, q, self.states if states is None else states, self._position)
        for log in logs:
            restart_log(log)

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
        self.states = self._touched[: states.size]
        self.states[:] = states
        self._position[states] = np.arange(states.size)

    def _add_states(self, logs: tuple[ChangeLog, ...]) -> None:
        n_before = n_touched = self.states.size
        for log in logs:
            n_touched = _add_touched(self._touched, n_touched, self._position, log)
        if n_touched > n_before:
            self.states = self._touched[:n_touched]
            if n_touched > len(self._room):  # twice as much: all copies together are as long as the rows are
                room = np.empty((max(n_touched, 2 * n_before), *self._base.shape[1:]))
                room[:n_before] = self._base
                self._room = room
            self._base = self._room[:n_touched]
            self._base[n_before:] = self._initial_q[self.states[n_before:]][:, :, None]

    def _differing(self) -> IntArray:
        """Return the states that are not counted at present and whose rows differed when the window began."""
        rows = (self._base != self._base[:, :, :1]).any(axis=(1, 2))
        differing: IntArray = self.states[rows & (self._place[self.states] < 0)]
        return differing

    def _still_rows(self, place: IntArray, unit: float) -> FloatArray:
        """Return what stands for the touched rows that did not change in the window: (at most A x N, A, N)."""
        rows = self._base[place < 0]
        if self._n_agents > 1 and (rows == rows[:, :, :1]).all():  # as after a window that has shared all tables
            return np.repeat(_equivalent_rows(rows[:, :, 0] * unit)[:, :, None], self._n_agents, axis=2)
        return _equivalent_rows(rows * unit)

    def _untouched_rows(self, unit: float) -> FloatArray:
        """Return what stands for the rows that nobody ever touched: (at most A, A, N)."""
        n_states, n_actions = self._initial_q.shape
        n_untouched = n_states - self.states.size
        first = one_number(self._initial_q)
        if first is not None:
            value = first * unit
            n_rows = 1 if value != 0.0 and n_untouched else 0
            rows = np.full((n_rows, n_actions), value * np.sqrt(n_untouched))
        else:
            untouched: BoolArray = self._position < 0
            rows = _equivalent_rows(self._initial_q[untouched] * unit)
        return np.repeat(rows[:, :, None], self._n_agents, axis=2)


def _equivalent_rows(rows: FloatArray) -> FloatArray:
    """Return few rows with the same Gram matrix as many: (n, ...) becomes (at most the size of a row, ...)."""
    length = math.prod(rows.shape[1:])
    if len(rows) <= length:
        return rows
    factor = np.asarray(np.linalg.qr(rows.reshape(-1, length), mode="r"))
    return factor.reshape(-1, *rows.shape[1:])


@kernel
def _add_touched(touched: IntArray, n: int, position: IntArray, log: ChangeLog) -> int:
    """Put the states of a log that are new behind the first `n`; return how many there are then.

    Parameters
    ----------
    touched : (S,) int64
        The states that were ever touched, in that order.
    n : int
    position : (S,) int64
        The place of each state in `touched`, -1 of those that are not there; changed with it.
    log : ChangeLog
    """
    for entry in range(log.cursor[ENTRIES]):
        state = log.state[entry]
        if position[state] < 0:
            position[state], touched[n] = n, state
            n += 1
    return n


@kernel
def _mark_changed(place: IntArray, position: IntArray, log: ChangeLog) -> None:
    """Set `place`, (V,) int64, to 0 for those of the touched states that a log has; `position` is (S,) int64."""
    for entry in range(log.cursor[ENTRIES]):
        place[position[log.state[entry]]] = 0


@kernel
def _find_latest(latest: IntArray, position: IntArray, place: IntArray, log: ChangeLog) -> None:
    """Find which entry of a log holds a row after each episode.

    Parameters
    ----------
    latest : (C, E) int64
        Changed: for each row that changed and each episode, the entry, -1 where the row was still as at the beginning.
    position, place : (S,) int64, (V,) int64
        Of each state among those that were ever touched, and of each of these among the C rows.
    log : ChangeLog
    """
    for row in range(latest.shape[0]):
        for episode in range(latest.shape[1]):
            latest[row, episode] = -1
    entry = 0
    for episode in range(latest.shape[1]):
        while entry < log.end[episode]:
            latest[place[position[log.state[entry]]], episode] = entry
            entry += 1
    for row in range(latest.shape[0]):
        for episode in range(1, latest.shape[1]):
            if latest[row, episode] < 0:
                latest[row, episode] = latest[row, episode - 1]


@kernel
def _write_changed(
    tensor: FloatArray, agent: int, base: FloatArray, changed: IntArray, latest: IntArray, log: ChangeLog
) -> None:
    """Write the rows that changed into an agent's part of the tensor.

    Parameters
    ----------
    tensor : (R, A, E, N) float64
        Its first C rows are changed.
    agent : int
    base : (V, A, N) float64
        The touched states' rows when the window began.
    changed : (C,) int64
        Which of them the C rows are.
    latest : (C, E) int64
        As of `_find_latest`.
    log : ChangeLog
        The agent's.
    """
    for row in range(latest.shape[0]):
        for action in range(tensor.shape[1]):
            before = base[changed[row], action, agent]
            for episode in range(tensor.shape[2]):
                entry = latest[row, episode]
                tensor[row, action, episode, agent] = log.row[entry, action] if entry >= 0 else before


@kernel
def _count_changes(counts: IntArray, rows: FloatArray, place: IntArray, log: ChangeLog) -> None:
    """Count in how many episodes of a log entries changed.

    Parameters
    ----------
    counts : (R, A) int64
        Changed: so much is added.
    rows : (R, A) float64
        The rows when the window began; changed to those at the end of it.
    place : (S,) int64
        Of each of the states among the R.
    log : ChangeLog
    """
    for entry in range(log.cursor[ENTRIES]):
        row = place[log.state[entry]]
        for action in range(rows.shape[1]):
            if log.row[entry, action] != rows[row, action]:
                rows[row, action] = log.row[entry, action]
                counts[row, action] += 1


@kernel
def _copy_rows(base: FloatArray, q: FloatArray, states: IntArray, position: IntArray) -> None:
    """Copy the rows of `states`, (R,) int64, from the tables `q`, (N, S, A), to their `position`, (S,) in `base`.

    Parameters
    ----------
    base : (V, A, N) float64
        Changed.
    q : (N, S, A) float64
    states : (R,) int64
    position : (S,) int64
        Of each of them among the V rows.
    """
    for state in states:
        row = position[state]
        for action in range(base.shape[1]):
            for agent in range(base.shape[2]):
                base[row, action, agent] = q[agent, state, action]


def one_number(table: FloatArray) -> float | None:
    """Return the number that fills a table (S, A) at no cost, as it was broadcast; None where it has entries."""
    return None if any(table.strides) else float(table[0, 0])
