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
        self.states: IntArray = np.zeros(0, dtype=np.int64)  # (V,) the touched states, in that order
        self.changed: IntArray = np.zeros(0, dtype=np.int64)  # (C,) those that changed in the latest tensor's window
        self._base: FloatArray = np.zeros((0, n_actions, n_agents))  # their rows when the window began

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
        changed = np.unique(np.concatenate([self._position[log.state[: log.cursor[ENTRIES]]] for log in logs]))
        fixed = np.concatenate([self._still_rows(changed, unit), self._untouched_rows(unit)])
        self.changed = self.states[changed]
        tensor = np.empty((changed.size + len(fixed), *self._base.shape[1:2], self._n_episodes, self._n_agents))
        tensor[: changed.size] = self._base[changed][:, :, None, :]
        tensor[changed.size :] = fixed[:, :, None, :]
        place = np.empty(self.states.size, dtype=np.int64)
        place[changed] = np.arange(changed.size)
        for agent, log in enumerate(logs):
            _apply(tensor, agent, self._position, place, log)
        if unit != 1.0:
            tensor[: changed.size] *= unit
        return tensor

    def restart(self, logs: tuple[ChangeLog, ...], q: FloatArray) -> None:
        """Begin the next window with the (N, S, A) tables as they are now."""
        self._add_states(logs)
        self._base = np.ascontiguousarray(np.moveaxis(q[:, self.states], 0, 2))
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
        self.states, self._base = arrays["states"], arrays["base"]
        self._position[self.states] = np.arange(self.states.size)

    def _add_states(self, logs: tuple[ChangeLog, ...]) -> None:
        logged = np.concatenate([log.state[: log.cursor[ENTRIES]] for log in logs])
        new = logged[self._position[logged] < 0]
        if new.size == 0:
            return
        unique, first = np.unique(new, return_index=True)
        new = unique[np.argsort(first)]
        self._position[new] = np.arange(self.states.size, self.states.size + new.size)
        self.states = np.concatenate([self.states, new])
        rows = np.repeat(self._initial_q[new][:, :, None], self._n_agents, axis=2)
        self._base = np.concatenate([self._base, rows])

    def _still_rows(self, changed: IntArray, unit: float) -> FloatArray:
        """Return what stands for the touched rows that did not change in the window: (at most A x N, A, N)."""
        still = np.ones(self.states.size, dtype=np.bool_)
        still[changed] = False
        return _equivalent_rows(self._base[still] * unit)

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
def _apply(tensor: FloatArray, agent: int, position: IntArray, place: IntArray, log: ChangeLog) -> None:
    """Write an agent's changes into the tensor, each from its episode to the window's end.

    Parameters
    ----------
    tensor : (R, A, E, N) float64
        R rows that stand for states, A actions, E episodes, N agents; changed in place.
    agent : int
    position : (S,) int64
        Of each state among those that were ever touched.
    place : (T,) int64
        Of each of these T states among the R rows.
    log : ChangeLog
        The agent's.
    """
    entry = 0
    for episode in range(tensor.shape[2]):
        while entry < log.end[episode]:
            row = place[position[log.state[entry]]]
            for action in range(tensor.shape[1]):
                for later in range(episode, tensor.shape[2]):
                    tensor[row, action, later, agent] = log.row[entry, action]
            entry += 1


def one_number(table: FloatArray) -> float | None:
    """Return the number that fills a table (S, A) at no cost, as it was broadcast; None where it has entries."""
    return None if any(table.strides) else float(table[0, 0])
