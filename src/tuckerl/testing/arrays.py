"""Checks of transitions as arrays: what their constructor cannot know to be a mistake."""

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import breadth_first_order

from tuckerl.errors import ProblemCheckError
from tuckerl.problems.mdp import TabularMDP
from tuckerl.types import BoolArray, FloatArray, IntArray


def check_arrays(mdp: TabularMDP, source: str) -> None:
    """Check that every episode can end, and that no state is an end that is not said to be one.

    Raises
    ------
    ProblemCheckError
    """
    outcomes = _Outcomes(mdp)
    reached = outcomes.reached_from(np.unique(mdp.arrays.start_state).astype(np.int64))
    trap = outcomes.first_trap(reached)
    if trap is not None:
        raise ProblemCheckError(
            f"{source} reaches state {trap}, which no action leaves and where nothing is paid, without an end: if it "
            f"is a goal or a failure, mark the outcomes that lead into it as terminated"
        )
    if mdp.max_episode_steps is None or mdp.is_capped:
        lost = reached & ~outcomes.can_end()
        if lost.any():
            raise ProblemCheckError(
                f"{source} reaches state {int(np.argmax(lost))}, from where no episode ends, and has no time limit: "
                f"mark the outcomes that end an episode as terminated, or set max_episode_steps"
            )


class _Outcomes:
    """The outcomes of actions that may be taken, as edges from state to state."""

    def __init__(self, mdp: TabularMDP) -> None:
        arrays, n_pairs = mdp.arrays, mdp.n_states * mdp.n_actions
        counts = np.diff(arrays.offsets) if arrays.offsets.size else np.ones(n_pairs, dtype=np.int64)
        pair = np.repeat(np.arange(n_pairs), counts)
        allowed = arrays.action_mask.ravel()[pair] if arrays.action_mask.size else np.ones(pair.size, dtype=np.bool_)
        self._n_states = mdp.n_states
        self._source: IntArray = (pair // mdp.n_actions)[allowed]
        self._target: IntArray = arrays.next_state[allowed].astype(np.int64)
        self._ends: BoolArray = arrays.terminated[allowed]
        self._reward: FloatArray = arrays.reward[allowed]

    def reached_from(self, starts: IntArray) -> BoolArray:
        """Return which states an episode may come to and go on from, (S,)."""
        on = ~self._ends
        return self._searched(self._source[on], self._target[on], starts)

    def can_end(self) -> BoolArray:
        """Return from which states an episode may come to an end, (S,)."""
        on = ~self._ends
        return self._searched(self._target[on], self._source[on], np.unique(self._source[self._ends]))

    def first_trap(self, reached: BoolArray) -> int | None:
        """Return a reached state that every action leads back to, at no reward and without an end."""
        harmless = (self._target == self._source) & ~self._ends & (self._reward == 0.0)
        leaves = np.zeros(self._n_states, dtype=np.bool_)
        leaves[self._source[~harmless]] = True
        traps = np.flatnonzero(reached & ~leaves)
        return int(traps[0]) if traps.size else None

    def _searched(self, source: IntArray, target: IntArray, roots: IntArray) -> BoolArray:
        """Return which states are connected to the roots, by one more node that leads to all of them."""
        n = self._n_states
        rows = np.concatenate([source, np.full(roots.size, n)])
        columns = np.concatenate([target, roots])
        graph = csr_array((np.ones(rows.size, dtype=np.int8), (rows, columns)), shape=(n + 1, n + 1))
        found = np.zeros(n + 1, dtype=np.bool_)
        found[breadth_first_order(graph, n, return_predecessors=False)] = True
        return found[:n]
