"""Which rows of a Q-table changed, episode by episode: what a window of tables is later rebuilt from.

The paper stores the whole table after every episode. Most rows do not change during an episode, so a kernel writes
down only those that did: `record_change` before it changes a row, `close_episode` to keep those rows as they are at
the end. From the same word follows what an episode that is broken off has changed: rows are kept as they were before
their first change since `begin_undo`, and `undo_changes` brings them back.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tuckerl._jit import is_rare, kernel
from tuckerl.errors import SavedFileError
from tuckerl.saved_arrays import SavedArrays, check_distinct
from tuckerl.types import ByteArray, FloatArray, IntArray

ENTRIES, EPISODES, CLOCK, STRAY, UNDO_ENTRIES, UNDO_CLOCK = range(6)
NO_STRAY = np.iinfo(np.int64).min
"""What the cursor holds at `STRAY` as long as only rows of the table were recorded."""


class ChangeLog(NamedTuple):
    """One agent's changes in up to E episodes, over S states and A actions.

    What agents go on with that share between two episodes counts as an episode: see
    :mod:`tuckerl.generalization.log_window`.

    The arrays are as long as a window could ever need; memory that is never written costs nothing, because the
    operating system hands out pages on first touch.
    """

    enabled: bool  # whether windows are recorded; what is needed to undo always is
    stamp: IntArray  # (S,) the clock when the row was last recorded
    state: IntArray  # (E * S,) the recorded states in order, episode after episode
    row: FloatArray  # (E * S, A) their rows at the end of that episode
    end: IntArray  # (E,) how many entries there were at the end of each episode
    cursor: IntArray  # (6,) entries, episodes, a clock that counts episodes, a row that is none; kept rows, their clock
    tables: tuple[ByteArray, ...]  # (S, B_i) each: what has a row for each state, the Q-table first, as bytes
    undo_state: IntArray  # (S,) whose rows are kept
    undo_row: ByteArray  # (S, sum of B_i) their rows in all tables before they changed


def empty_log(n_states: int, n_actions: int, n_episodes: int) -> ChangeLog:
    """Return a log for windows of `n_episodes`; for 0 episodes, one that records no windows."""
    capacity = n_states * n_episodes
    return ChangeLog(
        enabled=n_episodes > 0,
        stamp=np.zeros(n_states, dtype=np.int64),
        state=np.empty(capacity, dtype=np.int64),
        row=np.empty((capacity, n_actions)),
        end=np.zeros(n_episodes, dtype=np.int64),
        cursor=np.array([0, 0, 1, NO_STRAY, 0, 1], dtype=np.int64),
        tables=(np.zeros((n_states, 0), dtype=np.uint8),),
        undo_state=np.empty(n_states, dtype=np.int64),
        undo_row=np.empty((n_states, 0), dtype=np.uint8),
    )


def with_tables(log: ChangeLog, tables: Sequence[np.ndarray]) -> ChangeLog:
    """Return the same log, between two episodes, of which `undo_changes` brings back these arrays.

    Parameters
    ----------
    log : ChangeLog
    tables : sequence of arrays whose first axis is the states
        Their rows that change without being recorded are not brought back.
    """
    n_states = log.stamp.size
    rows = tuple(table.reshape(n_states, -1).view(np.uint8) for table in tables if table.size)
    return log._replace(tables=rows, undo_row=np.empty((n_states, sum(row.shape[1] for row in rows)), dtype=np.uint8))


def begin_undo(log: ChangeLog) -> IntArray:
    """Begin anew to keep the rows that change, between two episodes; return what `undo_changes` needs to know."""
    log.cursor[UNDO_ENTRIES] = 0
    log.cursor[UNDO_CLOCK] = log.cursor[CLOCK] + 1
    log.cursor[CLOCK] += 2  # later than that of rows that are kept and not recorded
    return log.cursor[:CLOCK].copy()


def undo_changes(log: ChangeLog, begun: IntArray) -> None:
    """Bring all tables and the log back to where they were when `begin_undo` returned `begun`."""
    kept, first = slice(log.cursor[UNDO_ENTRIES]), 0
    for table in log.tables:
        beyond = first + table.shape[1]
        table[log.undo_state[kept]] = log.undo_row[kept, first:beyond]
        first = beyond
    log.cursor[:CLOCK] = begun
    begin_undo(log)


def restart_log(log: ChangeLog) -> None:
    """Forget the window's entries and begin the next window."""
    log.cursor[ENTRIES] = log.cursor[EPISODES] = 0
    log.end[:] = 0


def log_shared(log: ChangeLog, q: FloatArray, states: IntArray) -> None:
    """Write into a log that, between two episodes, the rows of `states`, (R,), have become those of `q`, (S, A)."""
    rows = slice(log.cursor[ENTRIES], log.cursor[ENTRIES] + states.size)
    log.state[rows], log.row[rows] = states, q[states]
    log.cursor[ENTRIES] = log.end[log.cursor[EPISODES]] = rows.stop
    log.cursor[EPISODES] += 1
    log.cursor[CLOCK] += 1


def saved_log(log: ChangeLog) -> dict[str, np.ndarray]:
    """Return the arrays from which `restore_log` goes on: of finished episodes, as one that diverged has no rows."""
    end = log.end[: log.cursor[EPISODES]]
    entries = int(end[-1]) if end.size else 0
    return {"state": log.state[:entries], "row": log.row[:entries], "end": end}


def read_log(
    arrays: SavedArrays, log: ChangeLog, n_actions: int, n_closed: int | None, *, finite: bool
) -> dict[str, np.ndarray]:
    """Return the arrays that `saved_log` returned, from a file.

    Parameters
    ----------
    arrays : SavedArrays
    log : ChangeLog
        One of the same size, which is not changed.
    n_actions : int
    n_closed : int or None
        How many episodes of the window the agent has finished; None where that is not known.
    finite : bool
        Whether its rows must be finite.

    Raises
    ------
    SavedFileError
        If they are none of such a log's: kernels would write beyond its arrays.
    """
    n_states, capacity, n_episodes = log.stamp.size, log.state.size, log.end.size
    end = arrays.take("end", np.int64, (range(n_episodes + 1),), 0, capacity)
    state = arrays.take("state", np.int64, (range(capacity + 1),), 0, n_states - 1)
    closed = int(end[-1]) if end.size else 0
    row = arrays.take("row", np.float64, (closed, n_actions), finite=finite)
    if (log.enabled and n_closed not in (None, end.size)) or (np.diff(end) < 0).any() or closed > state.size:
        raise SavedFileError("a change log must have an end for each episode of its window, and these must rise")
    episode = np.repeat(np.arange(end.size + 1), np.diff(end, prepend=0, append=state.size))
    check_distinct("each episode of a change log", episode * n_states + state)
    return {"state": state, "row": row, "end": end}


def restore_log(log: ChangeLog, arrays: dict[str, np.ndarray]) -> None:
    """Let an empty log go on from what `saved_log` returned."""
    # Older files may hold more states: those of an episode that an error broke off.
    entries, episodes = len(arrays["row"]), arrays["end"].size
    log.state[:entries], log.row[:entries], log.end[:episodes] = arrays["state"][:entries], arrays["row"], arrays["end"]
    log.cursor[ENTRIES], log.cursor[EPISODES] = entries, episodes


@kernel
def record_change(log: ChangeLog, state: int) -> None:
    """Note that the row of `state` is about to change in this episode; a row that is none is kept as a stray."""
    if is_rare(not 0 <= state < log.stamp.size):
        log.cursor[STRAY] = state
    elif is_rare(log.stamp[state] != log.cursor[CLOCK]):
        keep_row(log, state)
        log.stamp[state] = log.cursor[CLOCK]
        if log.enabled:
            log.state[log.cursor[ENTRIES]] = state
            log.cursor[ENTRIES] += 1


@kernel
def keep_row(log: ChangeLog, state: int) -> None:
    """Keep the row of `state` as it is, to undo what follows; no window hears of it."""
    if is_rare(log.stamp[state] < log.cursor[UNDO_CLOCK]):
        log.stamp[state] = log.cursor[UNDO_CLOCK]
        entry, place = log.cursor[UNDO_ENTRIES], 0
        log.undo_state[entry] = state
        for table in log.tables:
            for byte in range(table.shape[1]):
                log.undo_row[entry, place + byte] = table[state, byte]
            place += table.shape[1]
        log.cursor[UNDO_ENTRIES] += 1


@kernel
def close_episode(log: ChangeLog, q: FloatArray) -> None:
    """Keep the rows of `q` that were recorded in the episode that ends here.

    Parameters
    ----------
    log : ChangeLog
        Its `row`, `end` and `cursor` change.
    q : (S, A) float64
    """
    if not log.enabled:
        return
    episode = log.cursor[EPISODES]
    first = log.end[episode - 1] if episode > 0 else 0
    for entry in range(first, log.cursor[ENTRIES]):
        for action in range(q.shape[1]):
            log.row[entry, action] = q[log.state[entry], action]
    log.end[episode] = log.cursor[ENTRIES]
    log.cursor[EPISODES] += 1
    log.cursor[CLOCK] += 1
