"""The DYNA maze under Gymnasium's rules: spaces, episodes, limits, pictures."""

import subprocess
import sys
import warnings
from itertools import pairwise
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import check_env

from tuckerl.environments import ENVIRONMENTS, register_environments
from tuckerl.environments.dyna_maze import DynaMazeEnv
from tuckerl.environments.maze_view import AGENT, GOAL, PATH, START
from tuckerl.environments.raster import FREE, GRID, WALL
from tuckerl.errors import MazeError, ParameterError, ParameterTypeError, UnknownNameError
from tuckerl.problems.maze import MOVES, Cell, Maze, random_maze, sutton_maze

ID = "tuckerl/DynaMaze-v0"
UP, DOWN, LEFT, RIGHT = range(4)


def sutton() -> dict[str, Any]:
    maze = sutton_maze()
    return {"walls": maze.walls, "start": maze.start, "goal": maze.goal}


def actions_along(path: list[Cell]) -> list[int]:
    return [MOVES.index((b[0] - a[0], b[1] - a[1])) for a, b in pairwise(path)]


def pixel(image: np.ndarray[Any, Any], maze: Maze, cell: tuple[float, float]) -> tuple[int, ...]:
    """The colour at a place counted in cells: (0.5, 0.5) is the middle of the first cell."""
    size = image.shape[0] // (maze.rows + 1)
    row, column = (int(size // 2 + place * size) for place in cell)
    return tuple(int(value) for value in image[row, column])


@pytest.mark.parametrize(
    "parameters",
    [
        {},
        {"maze_seed": 3, "deviation": 0.4},
        sutton(),
        {"rows": 2, "columns": 2, "start": (0, 0), "goal": (1, 1)},
        {"rows": 20, "columns": 30, "deviation": 0, "start": (19, 0), "goal": (0, 29)},
        {"rows": 1, "columns": 5, "deviation": 0, "start": (0, 4), "goal": (0, 0)},
        {"rows": 1, "columns": 2, "start": (0, 0), "goal": (0, 1)},
        {"walls": [[False], [False], [False]], "start": [0, 0], "goal": np.array([2, 0])},
        {"render_mode": "ansi"},
        {"render_mode": "rgb_array"},
        {**sutton(), "render_mode": "rgb_array"},
    ],
    ids=str,
)
def test_gymnasium_finds_no_fault(parameters: dict[str, Any]) -> None:
    check_env(gymnasium.make(ID, **parameters).unwrapped)


def test_spaces_and_what_it_carries() -> None:
    env = gymnasium.make(ID, maze_seed=2).unwrapped
    assert isinstance(env, DynaMazeEnv)
    assert env.observation_space == gymnasium.spaces.Discrete(39 * 36)
    assert env.action_space == gymnasium.spaces.Discrete(4)
    assert np.array_equal(env.maze.walls, random_maze(seed=2).walls)
    assert env.mdp.max_episode_steps is None
    assert (env.mdp.n_states, env.mdp.n_actions) == (39 * 36, 4)


def test_walls_are_taken_as_they_are() -> None:
    env = DynaMazeEnv(**sutton(), rows=100, columns=100, deviation=3)
    assert np.array_equal(env.maze.walls, sutton_maze().walls)
    assert env.maze.n_states == 54


def test_golden_episode() -> None:
    env = gymnasium.make(ID, **sutton())
    assert env.reset(seed=0) == (18, {})
    bumps = [env.step(action) for action in (LEFT, RIGHT, RIGHT, UP, UP, UP)]
    assert [observation for observation, *_ in bumps] == [18, 19, 19, 10, 1, 1]
    assert {tuple(rest) for _, *rest, info in bumps if info == {}} == {(-1.0, False, False)}
    env.reset()
    actions = [DOWN, DOWN, *[RIGHT] * 4, UP, *[RIGHT] * 4, UP, UP, UP]
    seen = [env.step(action) for action in actions]
    assert [step[0] for step in seen] == [27, 36, 37, 38, 39, 40, 31, 32, 33, 34, 35, 26, 17, 8]
    assert [step[1] for step in seen] == [-1.0] * 13 + [0.0]
    assert [step[2] for step in seen] == [False] * 13 + [True]
    assert not any(step[3] for step in seen)
    assert all(type(step[0]) is int and type(step[1]) is float and type(step[2]) is bool for step in seen)


def test_a_shortest_path_costs_its_steps_but_the_last() -> None:
    env = DynaMazeEnv(maze_seed=1)
    env.reset()
    steps = [env.step(action) for action in actions_along(env.maze.shortest_path())]
    assert sum(reward for _, reward, *_ in steps) == -60
    assert [terminated for _, _, terminated, *_ in steps] == [False] * 60 + [True]
    assert env.maze.cell(steps[-1][0]) == (28, 34)


@pytest.mark.parametrize(("limit", "steps"), [(None, 2000), (7, 7)])
def test_the_time_limit_truncates(limit: int | None, steps: int) -> None:
    env = gymnasium.make(ID, max_episode_steps=limit)
    env.reset()
    ends = [env.step(UP)[2:4] for _ in range(steps)]
    assert ends == [(False, False)] * (steps - 1) + [(False, True)]


def test_by_itself_it_never_truncates() -> None:
    env = DynaMazeEnv()
    env.reset()
    assert not any(env.step(UP)[3] for _ in range(2500))


def test_steps_need_a_reset() -> None:
    with pytest.raises(ResetNeeded, match=r"call reset\(\) before step\(\)"):
        DynaMazeEnv().step(0)
    with pytest.raises(ResetNeeded):
        gymnasium.make(ID).step(0)


@pytest.mark.parametrize("action", [4, -1, 0.0, "up", None, np.array([0])])
def test_unknown_actions_are_refused(action: Any) -> None:
    env = DynaMazeEnv(**sutton())
    env.reset()
    with pytest.raises(ParameterError, match=r"action must be 0 \(up\), 1 \(down\), 2 \(left\) or 3 \(right\); got"):
        env.step(action)


@pytest.mark.parametrize("action", [1, np.int64(1), np.uint8(1), np.array(1)])
def test_actions_may_be_of_any_integer_kind(action: Any) -> None:
    env = DynaMazeEnv(**sutton())
    env.reset()
    assert env.step(action)[0] == 27


@pytest.mark.parametrize(
    ("parameters", "error", "message"),
    [
        ({"render_mode": "rgb_aray"}, UnknownNameError, r"unknown render_mode 'rgb_aray': did you mean 'rgb_array'\?"),
        ({"render_mode": 1}, ParameterTypeError, r"render_mode must be one of ansi, rgb_array; got 1"),
        ({"maze_seed": -1}, ParameterError, r"maze_seed must be a whole number of at least 0; got -1"),
        ({"maze_seed": None}, ParameterTypeError, r"maze_seed must be a whole number"),
        ({"rows": 0}, ParameterError, r"rows must be"),
        ({"walls": [[0, 1]]}, ParameterTypeError, r"walls must be a boolean array"),
        ({"walls": sutton_maze().walls}, MazeError, r"goal must lie inside the 6 x 9 maze; got \(28, 34\)"),
        ({"deviation": 5}, MazeError, r"choose a smaller deviation"),
    ],
)
def test_bad_parameters_are_refused(parameters: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        DynaMazeEnv(**parameters)


def test_bad_parameters_are_refused_through_gymnasium_too() -> None:
    with pytest.raises(ParameterTypeError, match="rows must be a whole number of at least 1; got 'a'"):
        gymnasium.make(ID, rows="a")


def walked_sutton(render_mode: str) -> DynaMazeEnv:
    env = DynaMazeEnv(**sutton(), render_mode=render_mode)
    env.reset()
    for action in (LEFT, DOWN, DOWN, RIGHT, RIGHT, RIGHT, DOWN, UP):
        env.step(action)
    return env


def test_ansi_picture() -> None:
    env = walked_sutton("ansi")
    assert env.render() == "\n".join(
        [
            ".......#G",
            "..#....#.",
            "S.#....#.",
            "+.#......",
            "+++@.#...",
            "...+.....",
        ]
    )
    env.reset()
    assert env.render() == "\n".join(
        [
            ".......#G",
            "..#....#.",
            "@.#....#.",
            "..#......",
            ".....#...",
            ".........",
        ]
    )


def test_rgb_picture() -> None:
    env = walked_sutton("rgb_array")
    image = env.render()
    assert image.shape == (7 * 48, 10 * 48, 3)
    assert image.dtype == np.uint8
    seen = {
        place: pixel(image, env.maze, place)
        for place in [(-0.2, 3.5), (1.5, 2.5), (0.5, 0.5), (3, 4.5), (3.5, 0.5), (4.5, 1), (5.5, 3.5), (4.5, 3.5)]
    }
    assert list(seen.values()) == [WALL, WALL, FREE, GRID, PATH, PATH, PATH, AGENT]
    assert pixel(image, env.maze, (2.15, 0.5)) == START
    assert pixel(image, env.maze, (2.5, 0.15)) == START
    assert pixel(image, env.maze, (2.35, 0.35)) == FREE, "the start is a ring"
    assert pixel(image, env.maze, (0.5, 8.5)) == GOAL
    assert pixel(image, env.maze, (0.1, 8.1)) == FREE, "the goal is a diamond"
    assert pixel(image, env.maze, (2.7, 1)) == GRID, "the agent has never crossed this line"


def test_rgb_picture_of_the_agent_at_the_goal_shows_both() -> None:
    env = DynaMazeEnv(**sutton(), render_mode="rgb_array")
    env.reset()
    for action in actions_along(env.maze.shortest_path()):
        env.step(action)
    image = env.render()
    assert pixel(image, env.maze, (0.5, 8.5)) == AGENT
    assert pixel(image, env.maze, (0.03, 8.5)) == GOAL


def test_pictures_stay_legible_in_grey() -> None:
    grey = [np.dot(colour, (0.299, 0.587, 0.114)) for colour in (WALL, PATH, FREE)]
    assert min(np.diff(grey)) > 80


@pytest.mark.parametrize(("rows", "columns", "shape"), [(1, 3, (96, 192)), (39, 36, (640, 592)), (3, 300, (24, 1806))])
def test_pictures_fit_the_maze(rows: int, columns: int, shape: tuple[int, int]) -> None:
    env = DynaMazeEnv(rows=rows, columns=columns, deviation=0, start=(0, 0), goal=(rows - 1, columns - 1))
    env.render_mode = "rgb_array"
    assert env.render().shape == (*shape, 3)


def test_a_picture_shows_this_episode_alone_and_does_not_change_it() -> None:
    env = walked_sutton("rgb_array")
    first = env.render()
    assert np.array_equal(env.render(), first)
    first[:] = 0
    assert env.render().any()
    env.reset()
    assert pixel(env.render(), env.maze, (3.5, 0.5)) == FREE


def test_render_without_a_mode_warns() -> None:
    env = DynaMazeEnv(**sutton())
    env.reset()
    with pytest.warns(UserWarning, match="render_mode"):
        assert env.render() is None


def test_registering_twice_is_silent() -> None:
    before = dict(gymnasium.registry)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        register_environments()
    assert gymnasium.registry == before
    assert set(ENVIRONMENTS) <= set(gymnasium.registry)


def test_vectorized() -> None:
    envs = gymnasium.make_vec(ID, num_envs=3, vectorization_mode="sync", **sutton())
    observations, _ = envs.reset(seed=0)
    assert observations.tolist() == [18] * 3
    observations, rewards, *_ = envs.step(np.array([UP, DOWN, LEFT]))
    assert observations.tolist() == [9, 27, 18]
    assert rewards.tolist() == [-1.0] * 3
    envs.close()


def test_playing_a_maze_needs_no_compiler() -> None:
    code = "import sys, tuckerl, gymnasium; gymnasium.make(sys.argv[1]).reset(); sys.exit('numba' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code, ID], check=False).returncode == 0
