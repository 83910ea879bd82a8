"""A learner, live or loaded, as something to look into."""

from collections.abc import Sequence

from tuckerl.problems.parts import Layout, check_action_names, check_layout
from tuckerl.reports.inspect.content import Inspection, Loadings
from tuckerl.training.learner import Learner


def inspect_learner(
    learner: Learner,
    *,
    title: str | None = None,
    layout: Layout | None = None,
    action_names: Sequence[str] | None = None,
) -> Inspection:
    """Return what there is to see of a learner.

    Cells that no start leads to, such as walls, are blocked; actions that may not be taken are never greedy.

    Parameters
    ----------
    learner : Learner
    title : str, optional
        What the page says that this is.
    layout : (rows, columns), optional
        Where the states are the cells of a grid, row by row. Default: the problem's own.
    action_names : A strings, optional
        Default: the problem's own.

    Raises
    ------
    ProblemError
        If `layout` or `action_names` does not fit.

    Examples
    --------
    >>> import tuckerl
    >>> inside = inspect_learner(tuckerl.Sarsa("FrozenLake-v1", seed=0).learn(episodes=20))
    >>> inside.layout, list(inside.action_names)
    ((4, 4), ['left', 'down', 'right', 'up'])
    """
    problem = learner.problem
    names = check_action_names(action_names, problem.n_actions) or problem.action_names
    return Inspection(
        title=title or name_of(learner),
        q=learner.q,
        layout=problem.layout if layout is None else check_layout(layout, problem.n_states),
        blocked=problem.unreachable_states(),
        action_names=list(names),
        history=learner.tensor_step_history,
        loadings=_loadings(learner),
        steps=learner.steps,
        returns=learner.returns,
        action_mask=learner.action_mask,
    )


def name_of(learner: Learner) -> str:
    """Return the learner's class and what it learned on."""
    t_version = " with a tensor step" if learner.tensor_step is not None else ""
    source = getattr(learner.problem, "source", None)
    return f"{type(learner).__name__}{t_version}{f' on {source}' if source else ''}"


def _loadings(learner: Learner) -> Loadings | None:
    held = learner.loadings
    if held is None:
        return None
    first = held.episode - held.factors[2].shape[0] + 1
    return Loadings(held.states, held.factors, held.core, held.fit, first)
