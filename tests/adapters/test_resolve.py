"""What a learner may be given to learn on, and what it is told about the rest."""

import warnings
from pathlib import Path
from typing import Any

import gymnasium
import pettingzoo
import pytest
from gymnasium.wrappers import OrderEnforcing, TimeLimit, TransformReward
from pettingzoo.utils import BaseParallelWrapper, parallel_to_aec
from pettingzoo.utils.wrappers import MultiEpisodeParallelEnv

from tuckerl.adapters.gymnasium_problem import GymnasiumProblem
from tuckerl.adapters.pettingzoo_problem import PettingZooProblem
from tuckerl.adapters.resolve import AdapterOptions, Agents, as_problem
from tuckerl.environments.dyna_maze import DynaMazeEnv
from tuckerl.environments.robot_rescue_env import RobotRescueEnv
from tuckerl.errors import MazeError, ParameterError, ParameterTypeError, ProblemError, SpaceError, UnknownNameError
from tuckerl.problems.maze import sutton_maze
from tuckerl.problems.mdp import TabularMDP
from tuckerl.problems.parts import STEP_CAP
from tuckerl.problems.problem import Problem

ID = "tuckerl/DynaMaze-v0"
TEAM_ID = "tuckerl/RobotRescue-v0"
TEAM = AdapterOptions(Agents.JOINT)


def table_of(problem: Problem) -> Any:
    assert isinstance(problem, TabularMDP)
    return problem.arrays.outcomes


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
    mdp = TabularMDP([[0]], [[1]], [[True]], max_episode_steps=9)
    assert as_problem(mdp) is mdp
    assert as_problem(mdp.with_time_limit(None)).max_episode_steps == STEP_CAP
    assert as_problem(sutton_maze()).max_episode_steps == 2000


def test_an_id_is_made_with_its_time_limit_and_without_a_word() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        problem = as_problem(ID)
    assert isinstance(problem, TabularMDP)
    assert problem.n_states == 39 * 36
    assert problem.max_episode_steps == 2000
    assert problem.arrays.max_episode_steps == 2000
    assert problem.heuristic is not None


def test_an_id_may_name_the_module_that_registers_it() -> None:
    assert as_problem(f"tuckerl:{ID}").n_states == 39 * 36
    with pytest.raises(UnknownNameError, match="there is no module 'no_such_module' to import"):
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
    assert table_of(as_problem(env)) is env.mdp.arrays.outcomes
    assert as_problem(TimeLimit(env, 5)).max_episode_steps == 5
    assert watched.closed == 0
    assert as_problem(watched).n_states == 54
    assert as_problem(lambda: TimeLimit(watched(), 9)).max_episode_steps == 9
    assert watched.closed == 4  # two of each, as it is seen whether a callable makes the same again


def test_what_a_callable_made_is_closed_when_it_is_refused(watched: type[WatchedMaze]) -> None:
    with pytest.raises(ParameterError, match="bins are for environments whose observations are a Box"):
        as_problem(lambda: watched(), AdapterOptions(bins=3))
    assert watched.closed == 2
    as_problem(lambda: watched(), AdapterOptions(compiled=False))
    assert watched.closed == 2


def test_the_strictest_of_several_time_limits_holds() -> None:
    env = WatchedMaze()
    assert as_problem(TimeLimit(OrderEnforcing(TimeLimit(env, 30)), 20)).max_episode_steps == 20
    assert as_problem(TimeLimit(TimeLimit(env, 20), 30)).max_episode_steps == 20
    env.mdp = env.mdp.with_time_limit(10)
    assert as_problem(TimeLimit(env, 20)).max_episode_steps == 10


def test_an_environment_without_a_time_limit_gets_a_cap() -> None:
    for env in (gymnasium.make(ID, max_episode_steps=-1), "CliffWalking-v1"):
        for compiled in ("auto", False):
            problem = as_problem(env, AdapterOptions(compiled=compiled))
            assert (problem.max_episode_steps, problem.is_capped) == (STEP_CAP, True)
    assert not as_problem(ID).is_capped
    assert not as_problem(ID, AdapterOptions(compiled=False)).is_capped


def test_what_a_wrapper_may_change_is_stepped() -> None:
    wrapped = as_problem(TimeLimit(TransformReward(gymnasium.make(ID), float), 10))
    assert isinstance(wrapped, GymnasiumProblem)
    assert wrapped.max_episode_steps == 10
    assert isinstance(as_problem(ObedientTimeLimit(WatchedMaze(), 10)), GymnasiumProblem)


def test_lifting_can_be_forbidden() -> None:
    problem = as_problem(ID, AdapterOptions(compiled=False))
    assert isinstance(problem, GymnasiumProblem)
    assert (problem.n_states, problem.n_actions, problem.max_episode_steps) == (39 * 36, 4, 2000)
    assert isinstance(as_problem(TEAM_ID, AdapterOptions(Agents.JOINT, compiled=False)), GymnasiumProblem)


def test_toy_text_is_lifted() -> None:
    problem = as_problem("FrozenLake-v1")
    assert isinstance(problem, TabularMDP)
    assert (problem.n_states, problem.max_episode_steps, problem.layout) == (16, 100, (4, 4))
    # The passenger remembers more than the table.
    taxi = as_problem(lambda: gymnasium.make("Taxi-v4", fickle_passenger=True))
    assert isinstance(taxi, GymnasiumProblem)
    assert taxi.has_masks


def test_a_box_without_bounds_needs_edges() -> None:
    with pytest.raises(SpaceError, match=r"give .*edges"):
        as_problem("CartPole-v1", AdapterOptions(bins=5))
    with pytest.raises(SpaceError, match="action must be one of finitely many"):
        as_problem("Pendulum-v1", AdapterOptions(bins=5))


@pytest.mark.parametrize("env", [3, None, [ID]])
def test_other_things_are_refused(env: Any) -> None:
    with pytest.raises(
        ParameterTypeError,
        match="env must be a Gymnasium environment, a PettingZoo parallel environment, the id of one, a callable",
    ):
        as_problem(env)


def test_callables_must_make_environments() -> None:
    with pytest.raises(ParameterTypeError, match=r"the callable must make a Gymnasium environment or .*; it made 3"):
        as_problem(lambda: 3)  # type: ignore[arg-type, return-value]  # that is the point
    with pytest.raises(MazeError, match="goal must lie inside"):
        as_problem(lambda: DynaMazeEnv(rows=3))


class WatchedRescue(RobotRescueEnv):
    """A small rescue that counts how often it is closed."""

    closed = 0

    def __init__(self) -> None:
        super().__init__(".H.\nATB", max_cycles=7)

    def close(self) -> None:
        type(self).closed += 1


@pytest.mark.parametrize("name", [TEAM_ID, f"tuckerl:{TEAM_ID}"])
def test_parallel_environments_by_id(name: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        problem = as_problem(name, TEAM)
    assert isinstance(problem, TabularMDP)
    assert (problem.n_states, problem.action_sizes, problem.max_episode_steps) == (36_864, (5, 5), 1000)


@pytest.mark.parametrize("name", ["tuckerl/RobotRescue-v1", "tuckerl/robotrescue-v0", "tuckerl/RobotRescue_v0"])
def test_a_misspelt_parallel_id_is_put_right(name: str) -> None:
    with pytest.raises(UnknownNameError, match=rf"unknown environment '{name}': did you mean '{TEAM_ID}'\?"):
        as_problem(name)


def test_parallel_instances_are_not_closed_and_callables_are() -> None:
    watched: type[WatchedRescue] = type("Watched", (WatchedRescue,), {"closed": 0})
    env = watched()
    assert table_of(as_problem(env, TEAM)) is env.mdp.arrays.outcomes
    assert table_of(as_problem(BaseParallelWrapper(env), TEAM)) is env.mdp.arrays.outcomes
    assert watched.closed == 0
    assert as_problem(watched, TEAM).max_episode_steps == 7
    assert watched.closed == 2
    assert as_problem(lambda: pettingzoo.make("parallel", TEAM_ID, max_cycles=9), TEAM).max_episode_steps == 9
    unlimited = as_problem(lambda: pettingzoo.make("parallel", TEAM_ID, max_cycles=-1), TEAM)
    assert unlimited.max_episode_steps == STEP_CAP


def test_what_a_parallel_wrapper_may_change_is_stepped() -> None:
    wrapped = BaseParallelWrapper(MultiEpisodeParallelEnv(WatchedRescue(), 2))
    assert isinstance(as_problem(wrapped, TEAM), GymnasiumProblem)


def test_joint_transitions_must_belong_to_the_agents() -> None:
    env = WatchedRescue()
    env.mdp = TabularMDP([[0] * 25], [[0] * 25], [[True] * 25])
    with pytest.raises(ProblemError, match=r"one of its action_sizes for each of the 2 agents; got \(25,\)"):
        as_problem(env, TEAM)


def test_agents_have_tables_of_their_own_unless_they_are_a_team() -> None:
    problem = as_problem(TEAM_ID)
    assert isinstance(problem, PettingZooProblem)
    assert problem.agents == ("robot_0", "robot_1")
    assert (problem.n_states, problem.n_actions, problem.has_equal_spaces) == (192, 5, True)


def test_environments_played_in_turns_are_refused() -> None:
    with pytest.raises(ParameterTypeError, match="a PettingZoo parallel environment, the id of one"):
        as_problem(parallel_to_aec(WatchedRescue()))


def test_a_module_that_lacks_another_is_not_said_to_be_missing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "lacking_worlds.py").write_text("import nothing_of_this_name\n")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(ProblemError, match=r"lacking_worlds imports nothing_of_this_name, which is not installed"):
        as_problem("lacking_worlds:World-v0")
    with pytest.raises(UnknownNameError, match=r"there is no module 'tuckerl\.no_such_worlds' to import"):
        as_problem("tuckerl.no_such_worlds:World-v0")
