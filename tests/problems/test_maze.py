"""Mazes: the worlds themselves, their shortest paths, their heuristics and what is refused."""

import hashlib
import math
import time
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import csr_array
from scipy.sparse.csgraph import shortest_path

from tuckerl.errors import MazeError, ParameterError, ParameterTypeError, UnknownNameError
from tuckerl.problems.maze import MOVES, Maze, random_maze, sutton_maze
from tuckerl.types import BoolArray

# seed: (the first cells that are walls, how many walls, SHA-256 of the walls, steps of the shortest path)
GOLDEN: dict[int, tuple[list[list[int]], int, str, int]] = {
    0: ([[0, 12], [1, 11], [1, 12]], 124, "28fc341a0abf6b1b", 59),
    1: ([[0, 24], [0, 25], [0, 30]], 145, "0717743f6dd1fbb8", 61),
    2: ([[0, 4], [0, 26], [0, 28]], 136, "957223673e49870c", 59),
}


def open_maze(rows: int = 3, columns: int = 4) -> Maze:
    return random_maze(rows, columns, 0, start=(0, 0), goal=(rows - 1, columns - 1))


def least_steps(maze: Maze) -> float:
    """The length of a shortest path by SciPy, from the transitions."""
    next_state = maze.to_mdp().arrays.next_state.astype(np.int64)
    state = np.repeat(np.arange(maze.n_states), len(MOVES))
    graph = csr_array((np.ones(state.size), (state, next_state)), shape=(maze.n_states,) * 2)
    return float(shortest_path(graph, unweighted=True, indices=maze.state(maze.start))[maze.state(maze.goal)])


@pytest.mark.parametrize("seed", GOLDEN)
def test_the_worlds_of_the_paper_stay_what_they_are(seed: int) -> None:
    maze = random_maze(seed=seed)
    first, count, digest, steps = GOLDEN[seed]
    assert maze.walls.shape == (39, 36)
    assert np.argwhere(maze.walls)[:3].tolist() == first
    assert maze.walls.sum() == count
    assert hashlib.sha256(maze.walls.tobytes()).hexdigest()[:16] == digest
    assert len(maze.shortest_path()) - 1 == steps


def test_the_same_seed_draws_the_same_world_and_others_draw_others() -> None:
    walls = [random_maze(12, 12, seed=seed, start=(0, 0), goal=(11, 11)).walls for seed in (5, 5, 6)]
    assert np.array_equal(walls[0], walls[1])
    assert not np.array_equal(walls[0], walls[2])


def test_one_cell_in_ten_is_a_wall() -> None:
    probability = math.erfc(0.5 / 0.3 / math.sqrt(2))
    assert probability == pytest.approx(0.096, abs=0.0005)
    mazes = [random_maze(seed=seed) for seed in range(200)]
    cells = sum(maze.walls.size - 2 for maze in mazes)
    share = sum(int(maze.walls.sum()) for maze in mazes) / cells
    # Four standard errors; worlds without a path are too rare to shift it.
    assert abs(share - probability) < 4 * math.sqrt(probability * (1 - probability) / cells)


def test_start_and_goal_are_cleared_and_only_worlds_without_a_path_drawn_again() -> None:
    again = 0
    for seed in range(40):
        maze = random_maze(1, 3, 0.5, seed, start=(0, 0), goal=(0, 2))
        assert not maze.walls.any()
        generator = np.random.default_rng(seed)
        wide = random_maze(2, 2, 0.5, seed, start=(0, 0), goal=(1, 1))
        while True:
            walls = np.abs(generator.normal(0.0, 0.5, (2, 2))) > 0.5
            if not (walls[0, 1] and walls[1, 0]):
                break
            again += 1
        assert wide.walls.tolist() == [[False, walls[0, 1]], [walls[1, 0], False]]
    assert again > 0


def test_deviation_0_makes_no_walls() -> None:
    assert not random_maze(deviation=0).walls.any()


def test_sutton_maze() -> None:
    maze = sutton_maze()
    expected = [
        ".......#G",
        "..#....#.",
        "S.#....#.",
        "..#......",
        ".....#...",
        ".........",
    ]
    assert [[cell == "#" for cell in row] for row in expected] == maze.walls.tolist()
    assert maze.start == (2, 0)
    assert maze.goal == (0, 8)
    assert len(maze.shortest_path()) - 1 == 14


@settings(max_examples=60, deadline=None)
@given(
    rows=st.integers(1, 9),
    columns=st.integers(2, 9),
    deviation=st.floats(0, 0.6),
    seed=st.integers(0, 2**32),
    data=st.data(),
)
def test_shortest_path_is_a_path_and_none_is_shorter(
    rows: int, columns: int, deviation: float, seed: int, data: st.DataObject
) -> None:
    cells = st.tuples(st.integers(0, rows - 1), st.integers(0, columns - 1))
    start = data.draw(cells)
    goal = data.draw(cells.filter(lambda cell: cell != start))
    try:
        maze = random_maze(rows, columns, deviation, seed, start=start, goal=goal)
    except MazeError:  # a narrow world may have no path in any draw
        return
    path = maze.shortest_path()
    assert path[0] == start
    assert path[-1] == goal
    assert len(set(path)) == len(path)
    assert not any(maze.walls[cell] for cell in path)
    assert all(abs(a[0] - b[0]) + abs(a[1] - b[1]) == 1 for a, b in pairwise(path))
    assert len(path) - 1 == least_steps(maze)


@settings(max_examples=60, deadline=None)
@given(st.integers(1, 7), st.integers(2, 7), st.integers(0, 2**32))
def test_a_maze_is_refused_exactly_when_no_path_exists(rows: int, columns: int, seed: int) -> None:
    walls: BoolArray = np.random.default_rng(seed).random((rows, columns)) < 0.4
    walls[0, 0] = walls[-1, -1] = False
    joined = {(0, 0)}
    for _ in range(walls.size):
        joined |= {
            (r + down, c + right)
            for r, c in joined
            for down, right in MOVES
            if 0 <= r + down < rows and 0 <= c + right < columns and not walls[r + down, c + right]
        }
    if (rows - 1, columns - 1) in joined:
        Maze(walls, (0, 0), (rows - 1, columns - 1))
    else:
        with pytest.raises(MazeError, match="no path"):
            Maze(walls, (0, 0), (rows - 1, columns - 1))


def test_transitions_by_hand() -> None:
    # S # G      0 1 2
    # . . .      3 4 5
    mdp = Maze(np.array([[False, True, False], [False, False, False]]), (0, 0), (0, 2)).to_mdp()
    arrays = mdp.arrays
    # up, down, left, right
    assert arrays.next_state.reshape(6, 4).tolist() == [
        [0, 3, 0, 0],
        [1, 1, 1, 1],
        [2, 2, 2, 2],
        [0, 3, 3, 4],
        [4, 4, 3, 5],
        [2, 5, 4, 5],
    ]
    assert arrays.terminated.reshape(6, 4)[5].tolist() == [True, False, False, False]
    assert arrays.reward.reshape(6, 4)[5].tolist() == [0, -1, -1, -1]
    assert arrays.terminated.reshape(6, 4)[2].all()
    assert mdp.max_episode_steps == 2000
    assert arrays.start_state.tolist() == [0]
    assert arrays.offsets.size == arrays.cumulative.size == 0


def test_rewards_can_be_chosen() -> None:
    arrays = open_maze(1, 3).to_mdp(step_reward=0, goal_reward=1).arrays
    assert arrays.reward.reshape(3, 4).tolist() == [[0, 0, 0, 0], [0, 0, 0, 1], [1, 1, 1, 1]]
    with pytest.raises(ParameterError, match="goal_reward must be a finite number"):
        open_maze().to_mdp(goal_reward=math.inf)
    with pytest.raises(ParameterError, match=r"max_episode_steps .* at least 1"):
        open_maze().to_mdp(max_episode_steps=0)


def test_heuristics_closed_form() -> None:
    maze = random_maze(7, 5, seed=1, start=(0, 0), goal=(5, 2))
    for state in range(maze.n_states):
        row, column = maze.cell(state)
        assert maze.state((row, column)) == state
        assert maze.heuristic()[state] == (row - 5) ** 2 + (column - 2) ** 2
        assert maze.heuristic("squared")[state] == maze.heuristic()[state]
        assert maze.heuristic("euclidean")[state] == pytest.approx(math.hypot(row - 5, column - 2), rel=1e-15)
        assert maze.heuristic("l1")[state] == abs(row - 5) + abs(column - 2)
    assert np.array_equal(np.asarray(maze.to_mdp().heuristic), maze.heuristic())
    with pytest.raises(UnknownNameError, match=r"unknown metric 'euclid': did you mean 'euclidean'"):
        maze.heuristic("euclid")  # type: ignore[arg-type]  # that is the point


def test_walls_are_a_read_only_copy() -> None:
    walls = np.zeros((2, 2), dtype=np.bool_)
    maze = Maze(walls, (0, 0), (1, 1))
    walls[0, 1] = True
    assert not maze.walls.any()
    with pytest.raises(ValueError, match="read-only"):
        maze.walls[0, 1] = True
    assert Maze([[False, False]], (0, 0), (0, 1)).rows == 1  # type: ignore[arg-type]  # lists are taken too


BLOCKED = np.array([[False, True, False]])


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ((BLOCKED, (0, 1), (0, 2)), MazeError, r"start must be a free cell; \(0, 1\) is a wall"),
        ((BLOCKED, (0, 0), (0, 1)), MazeError, r"goal must be a free cell; \(0, 1\) is a wall"),
        ((BLOCKED, (0, 0), (0, 3)), MazeError, r"goal must lie inside the 1 x 3 maze; got \(0, 3\)"),
        ((BLOCKED, (-1, 0), (0, 2)), MazeError, r"start must lie inside"),
        ((BLOCKED, (0, 0), (0, 0)), MazeError, r"two cells; both are \(0, 0\)"),
        ((BLOCKED, (0, 0), (0, 2)), MazeError, r"no path leads from start \(0, 0\) to goal \(0, 2\)"),
        ((BLOCKED, (0,), (0, 2)), ParameterError, r"start must be a pair \(row, column\)"),
        ((BLOCKED, 3, (0, 2)), ParameterTypeError, r"start must be a pair"),
        ((BLOCKED, np.array(3), (0, 2)), ParameterTypeError, r"start must be a pair"),
        ((BLOCKED, (0, [1, 2]), (0, 2)), ParameterTypeError, r"start's column must be a whole number"),
        ((BLOCKED, (0, 0), (0.0, 2)), ParameterTypeError, r"goal's row must be a whole number"),
        ((BLOCKED.astype(int), (0, 0), (0, 2)), ParameterTypeError, r"walls must be a boolean array.*int64"),
        ((BLOCKED[0], (0, 0), (0, 2)), MazeError, r"walls must be .*got shape \(3,\)"),
        ((np.zeros((0, 3), dtype=bool), (0, 0), (0, 2)), MazeError, r"got shape \(0, 3\)"),
        (([[False], [False, True]], (0, 0), (0, 2)), MazeError, r"walls must be .*inhomogeneous"),
    ],
)
def test_bad_mazes_are_refused(arguments: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        Maze(*arguments)


@pytest.mark.parametrize(
    ("parameters", "error", "message"),
    [
        ({"rows": 0}, ParameterError, r"rows must be a whole number of at least 1; got 0"),
        ({"columns": 2.5}, ParameterTypeError, r"columns must be a whole number"),
        ({"deviation": math.nan}, ParameterError, r"deviation must be .*got nan"),
        ({"deviation": -0.1}, ParameterError, r"deviation must be"),
        ({"deviation": "a"}, ParameterTypeError, r"deviation must be"),
        ({"seed": -1}, ParameterError, r"seed must be a whole number of at least 0"),
        ({"rows": 10}, MazeError, r"goal must lie inside the 10 x 36 maze; got \(28, 34\)"),
        ({"start": (28, 34)}, MazeError, r"two cells"),
    ],
)
def test_bad_worlds_are_refused(parameters: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        random_maze(**parameters)


def test_a_world_too_dense_for_a_path_is_given_up_soon() -> None:
    begin = time.perf_counter()
    with pytest.raises(MazeError, match=r"no maze of 39 x 36 cells .* in 1000 draws at deviation 5"):
        random_maze(deviation=5)
    assert time.perf_counter() - begin < 10  # 0.2 s on a laptop
