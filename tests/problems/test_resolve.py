"""What a learner may be given to learn on, and what it is told about the rest."""

import warnings
from typing import Any

import gymnasium
import pytest
from gymnasium.wrappers import OrderEnforcing, TimeLimit, TransformReward

from tuckerl.errors import MazeError, ParameterTypeError, ProblemError, UnknownNameError
from tuckerl.problems.dyna_maze import DynaMazeEnv
from tuckerl.problems.maze import sutton_maze
from tuckerl.problems.mdp import TabularMDP
from tuckerl.problems.resolve import as_problem

ID = "tuckerl/DynaMaze-v0"


class WatchedMaze(DynaMazeEnv):
    """A small maze that counts how often it is closed."""

    closed = 0

    def __init__(self) -> None:
        maze = sutton_maze()
        super().__init__(maze.walls, start=maze.start, goal=maze.goal)

    def close(self) -> None:
        type(self).closed += 1


@pytest.fixture
def watched() -> type[WatchedMaze]:
    return type("Watched", (WatchedMaze,), {"closed": 0})


class ObedientTimeLimit(TimeLimit[Any, Any]):
    """A subclass of a wrapper that is known; what it overrides is not."""


def test_problems_of_this_library() -> None:
    mdp = TabularMDP([[0]], [[1]], [[True]])
    assert as_problem(mdp) is mdp
    assert as_problem(sutton_maze()).max_episode_steps == 2000


def test_an_id_is_made_with_its_time_limit_and_without_a_word() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        problem = as_problem(ID)
    assert problem.n_states == 39 * 36
    assert problem.max_episode_steps == 2000
    assert problem.arrays.max_episode_steps == 2000
    assert problem.heuristic is not None


def test_an_id_may_name_the_module_that_registers_it() -> None:
    assert as_problem(f"tuckerl:{ID}").n_states == 39 * 36
    with pytest.raises(ModuleNotFoundError, match="no_such_module"):
        as_problem(f"no_such_module:{ID}")


@pytest.mark.parametrize(
    "name",
    ["tuckerl/DynaMaze-v1", "tuckerl/dynamaze-v0", "TUCKERL/DynaMaze-v0", "tuckerl/DynaMaze", "tuckerl/Dynamaze-v0"],
)
def test_a_misspelt_id_is_put_right(name: str) -> None:
    with pytest.raises(UnknownNameError, match=rf"unknown environment '{name}': did you mean '{ID}'\?"):
        as_problem(name)


def test_instances_are_not_closed_and_callables_are(watched: type[WatchedMaze]) -> None:
    env = watched()
    assert as_problem(env) is env.mdp
    assert as_problem(TimeLimit(env, 5)).max_episode_steps == 5
    assert watched.closed == 0
    assert as_problem(watched).n_states == 54
    assert as_problem(lambda: TimeLimit(watched(), 9)).max_episode_steps == 9
    assert watched.closed == 2


def test_what_a_callable_made_is_closed_when_it_is_refused(watched: type[WatchedMaze]) -> None:
    with pytest.raises(ProblemError):
        as_problem(lambda: TransformReward(watched(), float))
    assert watched.closed == 1


def test_the_strictest_of_several_time_limits_holds() -> None:
    env = WatchedMaze()
    assert as_problem(TimeLimit(OrderEnforcing(TimeLimit(env, 30)), 20)).max_episode_steps == 20
    assert as_problem(TimeLimit(TimeLimit(env, 20), 30)).max_episode_steps == 20
    env.mdp = env.mdp.with_time_limit(10)
    assert as_problem(TimeLimit(env, 20)).max_episode_steps == 10
    assert as_problem(gymnasium.make(ID, max_episode_steps=-1)).max_episode_steps is None


def test_wrappers_that_may_change_what_happens_are_refused() -> None:
    with pytest.raises(ProblemError, match=r"the wrapper TransformReward may change what .* learn on the environment"):
        as_problem(TimeLimit(TransformReward(gymnasium.make(ID), float), 10))
    with pytest.raises(ProblemError, match="the wrapper ObedientTimeLimit may change"):
        as_problem(ObedientTimeLimit(WatchedMaze(), 10))


def test_an_environment_without_its_transitions_is_refused() -> None:
    with pytest.raises(ProblemError, match="carries neither its transitions"):
        as_problem("CartPole-v1")


@pytest.mark.parametrize("env", [3, None, [ID]])
def test_other_things_are_refused(env: Any) -> None:
    with pytest.raises(ParameterTypeError, match="env must be a Gymnasium id or environment, a callable"):
        as_problem(env)


def test_callables_must_make_environments() -> None:
    with pytest.raises(ParameterTypeError, match="the callable must make a Gymnasium environment; it made 3"):
        as_problem(lambda: 3)  # type: ignore[arg-type, return-value]  # that is the point
    with pytest.raises(MazeError, match="goal must lie inside"):
        as_problem(lambda: DynaMazeEnv(rows=3))
