"""Problems do not change once they are made: neither attributes nor arrays, nor after copying."""

import copy
import pickle
from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
import pytest

import tuckerl
from tests.structure.additions.lottery import Lottery
from tuckerl.adapters.resolve import as_problem
from tuckerl.errors import ImmutableError, TuckerlError
from tuckerl.problems.immutable import read_only
from tuckerl.problems.maze import Maze, sutton_maze
from tuckerl.problems.mdp import TabularMDP
from tuckerl.problems.simulator import Simulator


def reset(parameters: Any, state: Any, rng: Any) -> None:
    state[0] = 0.0


def step(parameters: Any, state: Any, action: Any, rng: Any) -> tuple[float, bool]:
    state[0] = min(state[0] + parameters[0], 2.0)
    return -1.0, state[0] == 2.0


def table() -> TabularMDP:
    return TabularMDP(
        [[[0, 1], [0, 1]], [[0, 1], [1, 0]]],
        np.zeros((2, 2, 2)),
        np.zeros((2, 2, 2), dtype=np.bool_),
        np.full((2, 2, 2), 0.5),
        start=[0.5, 0.5],
        heuristic=[1.0, 0.0],
        action_mask=[[True, False], [True, True]],
        layout=(1, 2),
        max_episode_steps=9,
    )


MADE: dict[str, Callable[[], Any]] = {
    "table": table,
    "time limit": lambda: table().with_time_limit(5),
    "from arrays": lambda: TabularMDP.from_arrays(table().arrays, 2, np.zeros(2)),
    "simulator": lambda: Simulator(reset, step, n_states=3, n_actions=2, parameters=[1.0]),
    "maze": sutton_maze,
    "stepped": lambda: as_problem(gymnasium.make("Blackjack-v1")),
    "user's own": lambda: Lottery([0.5, 0.25]),
}
DATA = ["table", "time limit", "from arrays", "simulator", "maze", "user's own"]


def pickled(made: Any) -> Any:
    """Return what is made of an object's pickle."""
    return pickle.loads(pickle.dumps(made))  # noqa: S301  # our own


def arrays_of(value: Any) -> list[Any]:
    """Return all arrays in an object's attributes and their tuples."""
    if isinstance(value, np.ndarray):
        return [value]
    parts = value if isinstance(value, tuple) else vars(value).values() if hasattr(value, "_is_made") else ()
    return [array for part in parts for array in arrays_of(part)]


@pytest.mark.parametrize("kind", MADE)
def test_no_attribute_changes(kind: str) -> None:
    made: Any = MADE[kind]()
    before = dict(vars(made))
    for name in (*before, "n_states", "n_actions", "kind", "of_my_own", "__class__"):
        with pytest.raises(ImmutableError, match=f"{name} cannot be assigned: a {type(made).__name__} does not change"):
            setattr(made, name, 50)
    for name in before:
        with pytest.raises(ImmutableError, match=f"{name} cannot be deleted"):
            delattr(made, name)
    assert all(vars(made)[name] is value for name, value in before.items())
    assert issubclass(ImmutableError, AttributeError)
    assert issubclass(ImmutableError, TuckerlError)


def test_the_refusal_names_what_to_call_instead() -> None:
    with pytest.raises(ImmutableError, match=r"with_time_limit\(steps\) returns one with another limit"):
        table().max_episode_steps = 7
    with pytest.raises(ImmutableError, match=r"with_source\(source\) returns one that is called so"):
        table().source = "mine"
    with pytest.raises(ImmutableError, match="make another Maze"):
        sutton_maze().goal = (0, 0)


@pytest.mark.parametrize("through", ["as made", "copy", "deepcopy", "pickle"])
@pytest.mark.parametrize("kind", DATA)
def test_no_array_changes(kind: str, through: str) -> None:
    ways: dict[str, Any] = {"copy": copy.copy, "deepcopy": copy.deepcopy, "pickle": pickled, "as made": lambda it: it}
    made = MADE[kind]()
    again = ways[through](made)
    held = arrays_of(again)
    assert len(held) == len(arrays_of(made)) > 0
    for array, old in zip(held, arrays_of(made), strict=True):
        assert np.array_equal(array, old)
        assert array.dtype == old.dtype
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 99
        with pytest.raises(ValueError, match="cannot set WRITEABLE flag"):
            array.flags.writeable = True
    with pytest.raises(ImmutableError, match="cannot be assigned"):
        again.n_actions = 50


@pytest.mark.slow
def test_learners_play_what_was_copied() -> None:
    for kind in ("table", "simulator", "user's own"):
        made: Any = MADE[kind]()
        alike = (made, copy.deepcopy(made), pickled(made))
        learned = [tuckerl.QLearning(problem, seed=0).learn(episodes=10).q for problem in alike]
        assert np.array_equal(learned[0], learned[1])
        assert np.array_equal(learned[0], learned[2])


def test_arrays_that_cannot_change_are_shared() -> None:
    mdp = table()
    assert mdp.with_time_limit(5).arrays.outcomes is mdp.arrays.outcomes
    assert read_only(mdp.arrays) is mdp.arrays
    given = np.arange(6.0).reshape(2, 3).T
    kept = read_only((given, 3))[0]
    assert np.array_equal(kept, given)
    given[0, 0] = 7
    assert kept[0, 0] == 0
    assert read_only(np.zeros((0, 4))).shape == (0, 4)


def test_a_maze_is_checked_as_before() -> None:
    walls = np.zeros((2, 2), dtype=np.bool_)
    maze = Maze(walls, (0, 0), (1, 1))
    assert maze.walls is not walls
    assert copy.deepcopy(maze).shortest_path() == maze.shortest_path()
