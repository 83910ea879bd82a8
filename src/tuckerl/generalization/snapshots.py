"""The window of Q-tables that the tensor step factorises, rebuilt from what changed.

Axes are (state, action, episode, agent), as in the paper's MQT tensor. The state axis holds only the states that some
agent has ever touched, in the order of first touch. All other rows still hold their initial values in every table; they
count exactly, at the cost of at most A rows: the row space of the state mode is all that the other factors see, so the
untouched rows may be replaced by a triangular factor of theirs (zeros need none).
"""

import numpy as np

from tuckerl._jit import kernel
from tuckerl.generalization.change_log import ENTRIES, ChangeLog, restart_log
from tuckerl.types import BoolArray, FloatArray, IntArray


class Snapshots:
    """The tables of the current window for N agents, E episodes, S states and A actions."""

    def __init__(self, initial_q: FloatArray, n_agents: int, n_episodes: int) -> None:
        self._initial_q = initial_q  # (S, A), possibly broadcast from one number
        self._n_agents, self._n_episodes = n_agents, n_episodes
        n_states, n_actions = initial_q.shape
        self._position = np.full(n_states, -1, dtype=np.int64)  # of each state on the tensor's state axis
        self.states: IntArray = np.zeros(0, dtype=np.int64)  # (V,) the touched states, in that order
        self._base: FloatArray = np.zeros((0, n_actions, n_agents))  # their rows when the window began

    def tensor(self, logs: tuple[ChangeLog, ...]) -> FloatArray:
        """Return the window's tables as a (V + at most A, A, E, N) array."""
        self._add_states(logs)
        untouched = self._untouched_rows()
        n_touched, n_actions, n_agents = self._base.shape
        tensor = np.empty((n_touched + len(untouched), n_actions, self._n_episodes, n_agents))
        tensor[:n_touched] = self._base[:, :, None, :]
        tensor[n_touched:] = untouched[:, :, None, None]
        for agent, log in enumerate(logs):
            _apply(tensor, agent, self._position, log)
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

    def restore(self, arrays: dict[str, np.ndarray]) -> None:
        """Go on from what `saved` returned."""
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

    def _untouched_rows(self) -> FloatArray:
        n_states, n_actions = self._initial_q.shape
        n_untouched = n_states - self.states.size
        if self._initial_q.strides == (0, 0):  # one number for every entry
            value = float(self._initial_q[0, 0])
            n_rows = 1 if value != 0.0 and n_untouched else 0
            return np.full((n_rows, n_actions), value * np.sqrt(n_untouched))
        untouched: BoolArray = self._position < 0
        return np.asarray(np.linalg.qr(self._initial_q[untouched], mode="r"))


@kernel
def _apply(tensor: FloatArray, agent: int, position: IntArray, log: ChangeLog) -> None:
    """Write an agent's changes into the tensor, each from its episode to the window's end."""
    entry = 0
    for episode in range(tensor.shape[2]):
        while entry < log.end[episode]:
            place = position[log.state[entry]]
            for action in range(tensor.shape[1]):
                for later in range(episode, tensor.shape[2]):
                    tensor[place, action, later, agent] = log.row[entry, action]
            entry += 1
