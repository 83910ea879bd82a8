"""Checks of transitions as arrays: what their constructor cannot know to be a mistake."""

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import breadth_first_order

from tuckerl.errors import ProblemCheckError
from tuckerl.problems.mdp import TabularMDP
from tuckerl.types import BoolArray, IntArray


def check_arrays(mdp: TabularMDP, source: str) -> None:
    """Check that every episode can end, and that no state is an end that is not said to be one.

    Raises
    ------
    ProblemCheckError
    """
    # The outcomes of actions that may be taken, as edges from state to state.
    arrays, n_pairs = mdp.arrays, mdp.n_states * mdp.n_actions
    counts = np.diff(arrays.offsets) if arrays.offsets.size else np.ones(n_pairs, dtype=np.int64)
    pair = np.repeat(np.arange(n_pairs), counts)
    allowed = arrays.action_mask.ravel()[pair] if arrays.action_mask.size else np.ones(pair.size, dtype=np.bool_)
    source_of, target = (pair // mdp.n_actions)[allowed], arrays.next_state[allowed].astype(np.int64)
    ends, harmless = arrays.terminated[allowed], arrays.reward[allowed] == 0.0
    begin, end = source_of[~ends], target[~ends]
    reached = _searched(mdp.n_states, begin, end, np.unique(arrays.start_state).astype(np.int64))
    leaves = np.zeros(mdp.n_states, dtype=np.bool_)
    leaves[source_of[(target != source_of) | ends | ~harmless]] = True
    if (reached & ~leaves).any():
        raise ProblemCheckError(
            f"{source} reaches state {int(np.argmax(reached & ~leaves))}, which no action leaves and where nothing is "
            f"paid, without an end: if it is a goal or a failure, mark the outcomes that lead into it as terminated"
        )
    if mdp.max_episode_steps is None or mdp.is_capped:
        lost = reached & ~_searched(mdp.n_states, end, begin, np.unique(source_of[ends]))
        if lost.any():
            raise ProblemCheckError(
                f"{source} reaches state {int(np.argmax(lost))}, from where no episode ends, and has no time limit: "
                f"mark the outcomes that end an episode as terminated, or set max_episode_steps"
            )


def _searched(n_states: int, source: IntArray, target: IntArray, roots: IntArray) -> BoolArray:
    """Return which states are connected to the roots, (S,), by one more node that leads to all of them."""
    rows = np.concatenate([source, np.full(roots.size, n_states)])
    columns = np.concatenate([target, roots])
    graph = csr_array((np.ones(rows.size, dtype=np.int8), (rows, columns)), shape=(n_states + 1, n_states + 1))
    found = np.zeros(n_states + 1, dtype=np.bool_)
    found[breadth_first_order(graph, n_states, return_predecessors=False)] = True
    return found[:n_states]
