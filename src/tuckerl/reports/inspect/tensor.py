"""Inspecting a user's own tensor of Q-tables."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from tuckerl.checks import check_text, to_array
from tuckerl.errors import ProblemError, TensorError
from tuckerl.generalization.loadings import Loadings
from tuckerl.generalization.step_history import empty_history
from tuckerl.problems.parts import Layout, check_action_names, check_layout
from tuckerl.reports.inspect.content import Inspection
from tuckerl.tensor import tucker
from tuckerl.types import AskedRanks, BoolArray, FloatArray


def inspect_tensor(
    X: ArrayLike,
    ranks: AskedRanks,
    layout: Layout | None = None,
    *,
    title: str | None = None,
    action_names: Sequence[str] | None = None,
    blocked: BoolArray | None = None,
) -> Inspection:
    """Decompose a tensor of Q-tables and return what there is to see.

    The tables shown are those of the last episode.

    Parameters
    ----------
    X : (S, A, E, N) array_like
        Tables of S states, A actions, E episodes and N agents.
    ranks : four ints, float or "auto"
        As for :func:`tuckerl.tucker`.
    layout : (rows, columns), optional
        Where the states are the cells of a grid, row by row.
    title : str, optional
        What the page says that this is.
    action_names : A strings, optional
        By default "0", "1", ...
    blocked : (S,) bool, optional
        The cells where nobody can stand.

    Returns
    -------
    Inspection
        Without learning curve and windows. States whose rows are zero throughout have no loadings.

    Raises
    ------
    TensorError, ParameterError, ParameterTypeError
        If `X` or `ranks` cannot be decomposed, or `X` has not four axes.
    ProblemError
        If `layout`, `action_names` or `blocked` do not fit.

    Examples
    --------
    >>> import numpy as np
    >>> inspection = inspect_tensor(np.ones((6, 2, 5, 1)), (1, 1, 1, 1), layout=(2, 3))
    >>> inspection.q.shape, inspection.loadings.states.size, round(inspection.loadings.fit, 6)
    ((1, 6, 2), 6, 1.0)
    """
    title = None if title is None else check_text("title", title)
    tensor = to_array("X", X, "a tensor of Q-tables")
    if tensor.dtype.kind not in "biuf":
        raise TensorError(f"a tensor of Q-tables must hold numbers; got dtype {tensor.dtype}")
    if tensor.ndim != 4:
        raise TensorError(
            f"a tensor of Q-tables must have the axes (state, action, episode, agent); got shape {tensor.shape}: "
            "add what is missing as an axis of length 1, such as X[:, :, None, None]"
        )
    n_states, n_actions, n_episodes, n_agents = tensor.shape
    check_layout(layout, n_states)
    names = check_action_names(action_names, n_actions) or map(str, range(n_actions))
    if blocked is not None:
        expected = f"{n_states} booleans, one for each state"
        blocked = to_array("blocked", blocked, expected)
        if blocked.shape != (n_states,) or blocked.dtype.kind != "b":
            raise ProblemError(f"blocked must be {expected}; got dtype {blocked.dtype} of shape {blocked.shape}")
    return Inspection(
        title=title or f"Q-tables of {n_states} states, {n_actions} actions, {n_episodes} episodes, {n_agents} agents",
        q=np.ascontiguousarray(np.moveaxis(tensor[:, :, -1, :], 2, 0), dtype=np.float64),
        layout=layout,
        blocked=blocked,
        action_names=list(names),
        history=empty_history(n_actions),
        loadings=_loadings(tensor, ranks),
        steps=np.zeros((0, n_agents), dtype=np.int64),
        returns=np.zeros((0, n_agents)),
    )


def _loadings(tensor: FloatArray, ranks: AskedRanks) -> Loadings | None:
    """Return the decomposition of the rows that are not zero throughout; None if there is none."""
    # The whole tensor first where it is empty or not of numbers, for tucker to say what is wrong with it.
    used = np.flatnonzero(tensor.any(axis=(1, 2, 3))) if tensor.size and tensor.dtype.kind in "iuf" else slice(None)
    rows = tensor[used]
    if rows.size == 0 and tensor.size:
        return None
    decomposition = tucker(rows, ranks)
    states = np.arange(len(tensor), dtype=np.int64)[used]
    return Loadings(states, tuple(decomposition.factors), decomposition.core, tensor.shape[2], decomposition.fit)
