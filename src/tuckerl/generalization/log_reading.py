"""What change logs tell of the rows of tables, read in compiled code.

Sizes: S states, A actions, N agents, E episodes of a window; V states were ever touched, C rows changed in the window.
"""

from tuckerl._jit import kernel
from tuckerl.generalization.change_log import ENTRIES, ChangeLog
from tuckerl.types import FloatArray, IntArray


@kernel
def add_touched(touched: IntArray, n: int, position: IntArray, log: ChangeLog, first: int) -> int:
    """Put the states of a log that are new, from its entry `first` on, behind the first `n`; return how many are there.

    Parameters
    ----------
    touched : (S,) int64
        The states that were ever touched, in that order.
    n : int
    position : (S,) int64
        The place of each state in `touched`, -1 of those that are not there; changed with it.
    log : ChangeLog
    first : int
    """
    for entry in range(first, log.cursor[ENTRIES]):
        state = log.state[entry]
        if position[state] < 0:
            position[state], touched[n] = n, state
            n += 1
    return n


@kernel
def mark_changed(place: IntArray, position: IntArray, log: ChangeLog, first: int) -> None:
    """Set `place`, (V,) int64, to 0 for the touched states in a log from `first` on; `position` is (S,) int64."""
    for entry in range(first, log.cursor[ENTRIES]):
        place[position[log.state[entry]]] = 0


@kernel
def part_rows(place: IntArray, changed: IntArray, still: FloatArray, base: FloatArray) -> tuple[int, bool]:
    """Give numbers to the touched states that changed, and copy the rows of the others.

    Parameters
    ----------
    place : (V,) int64
        0 of those that changed, which becomes their number among them, else -1.
    changed : (V,) int64
        Room, in which they are listed.
    still : (V, A * N) float64
        Room for the others' rows.
    base : (V, A, N) float64

    Returns
    -------
    n_changed : int
    are_equal : bool
        Whether the others' rows are the same for all agents.
    """
    n_changed, are_equal = 0, True
    for row in range(place.size):
        if place[row] >= 0:
            place[row], changed[n_changed] = n_changed, row
            n_changed += 1
        else:
            column = 0
            for action in range(base.shape[1]):
                for agent in range(base.shape[2]):
                    value = base[row, action, agent]
                    still[row - n_changed, column] = value
                    are_equal = are_equal and value == base[row, action, 0]
                    column += 1
    return n_changed, are_equal


@kernel
def find_latest(
    latest: IntArray, position: IntArray, place: IntArray, log: ChangeLog, places: IntArray, first: int
) -> None:
    """Find which entry of a log holds a row after each episode.

    Parameters
    ----------
    latest : (C, E) int64
        Changed: for each row that changed and each episode, the entry, -1 where the row was still as at the beginning.
    position, place : (S,) int64, (V,) int64
        Of each state among those that were ever touched, and of each of these among the C rows.
    log : ChangeLog
    places : (E,) int64
        Those of the episodes in the log; what is between two of them belongs to the later one.
    first : int
        The entry with which the window begins.
    """
    for row in range(latest.shape[0]):
        for episode in range(latest.shape[1]):
            latest[row, episode] = -1
    entry = first
    for episode in range(latest.shape[1]):
        while entry < log.end[places[episode]]:
            latest[place[position[log.state[entry]]], episode] = entry
            entry += 1
    for row in range(latest.shape[0]):
        for episode in range(1, latest.shape[1]):
            if latest[row, episode] < 0:
                latest[row, episode] = latest[row, episode - 1]


@kernel
def write_changed(
    tensor: FloatArray,
    agent: int,
    base: FloatArray,
    changed: IntArray,
    latest: IntArray,
    position: IntArray,
    place: IntArray,
    log: ChangeLog,
    places: IntArray,
    first: int,
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
        Room.
    position, place, places : (S,) int64, (V,) int64, (E,) int64
        As for `find_latest`.
    log, first
        As for `find_latest`; the log is the agent's.
    """
    find_latest(latest, position, place, log, places, first)
    for row in range(latest.shape[0]):
        for action in range(tensor.shape[1]):
            before = base[changed[row], action, agent]
            for episode in range(tensor.shape[2]):
                entry = latest[row, episode]
                tensor[row, action, episode, agent] = log.row[entry, action] if entry >= 0 else before


@kernel
def replay(rows: FloatArray, agent: int, position: IntArray, log: ChangeLog, n: int) -> None:
    """Bring an agent's rows, in (V, A, N) float64, to where the first `n` entries of its log left them.

    Parameters
    ----------
    rows : (V, A, N) float64
        Changed.
    agent : int
    position : (S,) int64
        Of each state among the V rows.
    log : ChangeLog
    n : int
    """
    for entry in range(n):
        row = position[log.state[entry]]
        for action in range(rows.shape[1]):
            rows[row, action, agent] = log.row[entry, action]


@kernel
def count_changes(counts: IntArray, rows: FloatArray, place: IntArray, log: ChangeLog, first: int) -> None:
    """Count in how many episodes of a log, from its entry `first` on, entries of tables changed.

    Parameters
    ----------
    counts : (R, A) int64
        Changed: so much is added.
    rows : (R, A) float64
        The rows when the window began; changed to those at the end of it.
    place : (S,) int64
        Of each of the states among the R.
    log : ChangeLog
    first : int
    """
    for entry in range(first, log.cursor[ENTRIES]):
        row = place[log.state[entry]]
        for action in range(rows.shape[1]):
            if log.row[entry, action] != rows[row, action]:
                rows[row, action] = log.row[entry, action]
                counts[row, action] += 1


@kernel
def copy_rows(base: FloatArray, q: FloatArray, states: IntArray, position: IntArray) -> None:
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
