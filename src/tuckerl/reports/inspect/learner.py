"""Inspecting a learner, live or loaded."""

from collections.abc import Sequence

import numpy as np

from tuckerl.checks import check_text, shown
from tuckerl.errors import ParameterTypeError, ProblemError
from tuckerl.problems.mdp import TabularMDP
from tuckerl.problems.parts import Layout, check_action_names, check_layout
from tuckerl.reports.inspect.content import Inspection, StatePath
from tuckerl.reports.inspect.greedy import NO_PREFERENCE, greedy
from tuckerl.reports.learner_text import name_of
from tuckerl.reports.text import counted
from tuckerl.solving.solve import solve
from tuckerl.training.learner import Learner
from tuckerl.types import FloatArray, IntArray


def inspect_learner(
    learner: Learner,
    *,
    title: str | None = None,
    layout: Layout | None = None,
    action_names: Sequence[str] | None = None,
) -> Inspection:
    """Return what there is to see of a learner.

    Cells that no start leads to, such as walls, are blocked; actions that may not be taken are never greedy. Where the
    problem's transitions are known, it is solved, so that the optimal values stand beside the learned ones.

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
    ParameterTypeError
        If it is no learner.
    ProblemError
        If `layout` or `action_names` does not fit.

    Examples
    --------
    >>> import tuckerl
    >>> inspection = inspect_learner(tuckerl.Sarsa("FrozenLake-v1", seed=0).learn(episodes=20))
    >>> inspection.layout, list(inspection.action_names)
    ((4, 4), ['left', 'down', 'right', 'up'])
    """
    if not isinstance(learner, Learner):
        raise ParameterTypeError(f"learner must be one of tuckerl's learners; got {shown(learner)}")
    title = None if title is None else check_text("title", title)
    problem = learner.problem
    names = check_action_names(action_names, problem.n_actions) or problem.action_names
    return Inspection(
        title=title or name_of(learner),
        q=learner.q,
        layout=problem.layout if layout is None else check_layout(layout, problem.n_states),
        blocked=problem.unreachable_states(),
        action_names=list(names),
        history=learner.tensor_step_history,
        loadings=learner.loadings,
        steps=learner.steps,
        returns=learner.returns,
        action_mask=learner.action_mask,
        optimal=_optimal(learner),
        paths=() if problem.layout is None or layout is not None else _paths(learner),
        state_factors=problem.state_factors,
    )


def _optimal(learner: Learner) -> FloatArray | None:
    """Return the optimal values with the learner's discount, (S,); None where they do not exist or are not known."""
    if not isinstance(learner.problem, TabularMDP):
        return None
    try:
        return solve(learner.problem, float(learner.gamma), tol=1e-6).v
    except ProblemError:  # without a discount, where something never ends; or it is too large
        return None


def _paths(learner: Learner) -> list[StatePath]:
    """Return the greedy policies' ways from the start, where nothing is left to chance, and the latest episode's."""
    last = learner.trajectories
    latest = [StatePath("latest episode of learning", last)] if all(path.size for path in last) else []
    problem, start = learner.problem, learner.problem.start_distribution()
    if not isinstance(problem, TabularMDP) or problem.arrays.offsets.size or start is None or start[0].size != 1:
        return latest
    mask = np.True_ if learner.action_mask is None else learner.action_mask
    ways = [_greedy_path(problem, best, int(start[0][0])) for best in greedy(learner.q, mask)]
    return [StatePath("greedy path", tuple(np.array(states) for states, _ in ways), ways[0][1]), *latest]


def _greedy_path(problem: TabularMDP, best: IntArray, state: int) -> tuple[list[int], str]:
    """Return the states that greedy actions lead through, and in words how it ends."""
    path, seen = [state], {state}
    while best[state] != NO_PREFERENCE:
        outcome = state * problem.n_actions + int(best[state])
        state = int(problem.arrays.next_state[outcome])
        path.append(state)
        if problem.arrays.terminated[outcome]:
            return path, f"it ends after {counted(len(path) - 1, 'step')}"
        if state in seen:
            return path, f"it goes in a circle from step {len(path) - 1} on and never ends"
        seen.add(state)
    return path, f"it stops after {counted(len(path) - 1, 'step')}, where no action is preferred"
