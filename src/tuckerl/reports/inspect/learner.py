"""Inspecting a learner, live or loaded."""

import itertools
import re
from collections.abc import Sequence

import numpy as np

from tuckerl.adapters.resolve import Problem
from tuckerl.errors import ProblemError
from tuckerl.problems.mdp import Layout, TabularMDP, check_layout
from tuckerl.reports.inspect.content import Inspection
from tuckerl.reports.learner_text import name_of
from tuckerl.training.learner import Learner
from tuckerl.types import BoolArray

_RESCUE = ("left", "right", "up", "down", "stay")
_MAZE = ("up", "down", "left", "right")
_CLIFF = ("up", "right", "down", "left")
_LAKE = ("left", "down", "right", "up")
_ACTIONS = {
    "Blackjack": ("stick", "hit"),
    "CartPole": ("push left", "push right"),
    "CliffWalking": _CLIFF,
    "CliffWalkingSlippery": _CLIFF,
    "DynaMaze": _MAZE,
    "FrozenLake": _LAKE,
    "FrozenLake8x8": _LAKE,
    "Maze": _MAZE,
    "MountainCar": ("push left", "no push", "push right"),
    "RobotRescue": _RESCUE,
    "Taxi": ("south", "north", "east", "west", "pick up", "drop off"),
}
"""What the actions of an environment are called, by its name without namespace and version."""


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
        Default: what is known of the environment, else "0", "1", ...

    Raises
    ------
    ProblemError
        If `layout` or `action_names` does not fit.

    Examples
    --------
    >>> import tuckerl
    >>> inspection = inspect_learner(tuckerl.Sarsa("FrozenLake-v1", seed=0).learn(episodes=20))
    >>> inspection.layout, list(inspection.action_names)
    ((4, 4), ['left', 'down', 'right', 'up'])
    """
    problem = learner.problem
    names = names_of_actions(problem) if action_names is None else [str(name) for name in action_names]
    if len(names) != problem.n_actions:
        raise ProblemError(f"action_names must be {problem.n_actions} names, one for each action; got {len(names)}")
    return Inspection(
        title=title or name_of(learner),
        q=learner.q,
        layout=problem.layout if layout is None else check_layout(layout, problem.n_states),
        blocked=_unreachable(problem) if isinstance(problem, TabularMDP) else None,
        action_names=names,
        history=learner.tensor_step_history,
        loadings=learner.loadings,
        steps=learner.steps,
        returns=learner.returns,
        action_mask=learner.action_mask,
    )


def names_of_actions(problem: Problem) -> list[str]:
    """Return what a problem's actions are called: words where its environment is known, else numbers."""
    numbers = [str(action) for action in range(problem.n_actions)]
    # "module:space/Name-v1" by its id; of PettingZoo's, which tell no id, the class: "NameEnv".
    plain = re.sub(r"(Env|-v\d+)$", "", re.split(r"[:/]", problem.source or "")[-1])
    own = _ACTIONS.get(plain)
    if own is None:
        return numbers
    members = getattr(problem, "action_sizes", (problem.n_actions,))
    if any(size != len(own) for size in members):
        return numbers
    return [", ".join(names) for names in itertools.product(own, repeat=len(members))]


def _unreachable(problem: TabularMDP) -> BoolArray | None:
    """Return the states that no start leads to; None where there is none."""
    arrays = problem.arrays
    pairs = problem.n_states * problem.n_actions
    offsets = arrays.offsets if arrays.offsets.size else np.arange(pairs + 1)
    origin = np.repeat(np.arange(pairs) // problem.n_actions, np.diff(offsets))
    reached = np.zeros(problem.n_states, dtype=np.bool_)
    frontier = np.zeros(problem.n_states, dtype=np.bool_)
    frontier[arrays.start_state] = True
    while frontier.any():
        reached |= frontier
        ways = frontier[origin]
        frontier = np.zeros(problem.n_states, dtype=np.bool_)
        frontier[arrays.next_state[ways & ~arrays.terminated]] = True
        frontier &= ~reached
    reached[arrays.next_state[reached[origin]]] = True  # where an episode ends, nobody goes on, but somebody stands
    return None if reached.all() else ~reached
