"""Which rows of a Q-table changed, episode by episode: what a window of tables is later rebuilt from.

The paper stores the whole table after every episode. Most rows do not change during an episode, so a kernel writes
down only those that did: `record_change` when it touches a row, `close_episode` to keep
those rows as they are at the end.
"""

from typing import NamedTuple

import numpy as np

from tuckerl._jit import kernel
from tuckerl.types import FloatArray, IntArray

ENTRIES, EPISODES, CLOCK, STRAY = range(4)
NO_STRAY = np.iinfo(np.int64).min
"""What the cursor holds at `STRAY` as long as only rows of the table were recorded."""


class ChangeLog(NamedTuple):
    """One agent's changes in one window of up to E episodes, over S states and A actions.

    The arrays are as long as a window could ever need; memory that is never written costs nothing, because the
    operating system hands out pages on first touch.
    """

    enabled: bool
    stamp: IntArray  # (S,) the clock when the row was last recorded
    state: IntArray  # (E * S,) the recorded states in order, episode after episode
    row: FloatArray  # (E * S, A) their rows at the end of that episode
    end: IntArray  # (E,) how many entries there were at the end of each episode
    cursor: IntArray  # (4,) entries and episodes so far, a clock that counts episodes for ever, a row that is none


def empty_log(n_states: int, n_actions: int, n_episodes: int) -> ChangeLog:
    """Return a log for windows of `n_episodes`; for 0 episodes, one that is switched off."""
    capacity = n_states * n_episodes
    return ChangeLog(
        enabled=n_episodes > 0,
        stamp=np.zeros(n_states if n_episodes else 0, dtype=np.int64),
        state=np.empty(capacity, dtype=np.int64),
        row=np.empty((capacity, n_actions)),
        end=np.zeros(n_episodes, dtype=np.int64),
        cursor=np.array([0, 0, 1, NO_STRAY], dtype=np.int64),
    )


def restart_log(log: ChangeLog) -> None:
    """Forget the window's entries and begin the next window."""
    log.cursor[ENTRIES] = log.cursor[EPISODES] = 0
    log.end[:] = 0


def saved_log(log: ChangeLog) -> dict[str, np.ndarray]:
    """Return the arrays from which `restore_log` goes on, taken between two episodes."""
    entries, episodes = log.cursor[ENTRIES], log.cursor[EPISODES]
    closed = log.end[episodes - 1] if episodes else 0
    return {"state": log.state[:entries], "row": log.row[:closed], "end": log.end[:episodes]}


def restore_log(log: ChangeLog, arrays: dict[str, np.ndarray]) -> None:
    """Let an empty log go on from what `saved_log` returned."""
    entries, closed, episodes = arrays["state"].size, len(arrays["row"]), arrays["end"].size
    log.state[:entries], log.row[:closed], log.end[:episodes] = arrays["state"], arrays["row"], arrays["end"]
    log.cursor[ENTRIES], log.cursor[EPISODES] = entries, episodes
    # Marked are only rows of an episode that an error broke off: the next one goes on with them.
    pending = arrays["state"][int(arrays["end"][-1]) if episodes else 0 :]
    if log.enabled:
        log.stamp[pending] = log.cursor[CLOCK]


@kernel
def record_change(log: ChangeLog, state: int) -> None:
    """Note that the row of `state` changes in this episode; a row that is none is kept as a stray."""
    if not log.enabled:
        return
    if not 0 <= state < log.stamp.size:
        log.cursor[STRAY] = state
    elif log.stamp[state] != log.cursor[CLOCK]:
        log.stamp[state] = log.cursor[CLOCK]
        log.state[log.cursor[ENTRIES]] = state
        log.cursor[ENTRIES] += 1


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
