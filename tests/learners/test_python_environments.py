"""Environments that Python steps: learned on as their arrays are, and gone on with as if nothing had been between."""

import copy
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.wrappers import TimeLimit, TransformReward

from tests.adapters.parallel_worlds import Dice
from tests.learners.stepped_worlds import DETERMINISTIC, SeededTableEnv, TableEnv, cliff, dry_lake
from tests.learners.test_masks import masked_mdp
from tests.learners.worlds import random_mdp
from tests.training.test_resume import assert_same
from tuckerl import DynaH, JointEnv, QLearning, Sarsa, SarsaLambda, TabularMDP, TeamQ, TensorStep
from tuckerl.adapters.gymnasium_problem import GymnasiumProblem
from tuckerl.environments.dyna_maze import DynaMazeEnv
from tuckerl.environments.robot_rescue_env import RobotRescueEnv
from tuckerl.errors import ParameterError, SavedFileError
from tuckerl.problems.maze import sutton_maze

STEP = TensorStep(every=4, ranks=(3, 2, 2, 1), floor=0.2)
LEARNERS: dict[str, tuple[Any, dict[str, Any]]] = {
    "q-learning": (QLearning, {}),
    "sarsa": (Sarsa, {}),
    "sarsa-lambda": (SarsaLambda, {}),
    "accumulating and carried": (SarsaLambda, {"trace": "accumulating", "carry_trace": True, "alpha": 0.05}),
    "dyna-h": (DynaH, {"planning_steps": 3}),
    "team-q": (TeamQ, {}),
}


def made(name: str, env: Any, n_states: int, **parameters: Any) -> Any:
    learner, own = LEARNERS[name]
    if learner is DynaH:
        own = own | {"heuristic": np.arange(n_states) * 7.0 % 11}
    return learner(env, **{"alpha": 0.3, "epsilon": 0.3, "seed": 4} | own | parameters)


def assert_learned_alike(one: Any, other: Any) -> None:
    for name in ("q", "steps", "returns", "action_weights"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name), err_msg=name)
    for ours, theirs in zip(one.trajectories, other.trajectories, strict=True):
        np.testing.assert_array_equal(ours, theirs)


@pytest.mark.filterwarnings("ignore::tuckerl.errors.RankWarning")
@pytest.mark.parametrize(("n_agents", "step"), [(1, None), (1, STEP), (3, None), (3, STEP)])
@pytest.mark.parametrize("env", DETERMINISTIC)
@pytest.mark.parametrize("name", LEARNERS)
def test_deterministic_environments_are_learned_as_their_tables_are(
    name: str, env: str, n_agents: int, step: TensorStep | None
) -> None:
    learners = []
    for compiled in ("auto", False):
        problem_env = DETERMINISTIC[env]
        n_states = problem_env().observation_space.n  # type: ignore[attr-defined]  # Discrete
        learners.append(
            made(name, problem_env, n_states, n_agents=n_agents, tensor_step=step, compiled=compiled).learn(9)
        )
    extracted, in_python = learners
    assert isinstance(extracted.problem, TabularMDP)
    assert isinstance(in_python.problem, GymnasiumProblem)
    assert_learned_alike(extracted, in_python)


@pytest.mark.filterwarnings("ignore::tuckerl.errors.RankWarning")
@pytest.mark.parametrize("step", [None, STEP])
@pytest.mark.parametrize("masked", [False, True])
@pytest.mark.parametrize("name", LEARNERS)
def test_a_table_on_the_learners_own_stream_is_learned_alike_in_python(
    name: str, masked: bool, step: TensorStep | None
) -> None:
    make = masked_mdp if masked else random_mdp
    mdp = make(3, n_states=9, n_outcomes=3, random_start=True, limit=30)
    env = TableEnv(mdp)
    in_python = made(name, env, 9, tensor_step=step)
    env.draw_from(in_python._state.streams[0])
    assert_learned_alike(made(name, mdp, 9, tensor_step=step).learn(10), in_python.learn(10))


@pytest.mark.filterwarnings("ignore::tuckerl.errors.RankWarning")
@pytest.mark.parametrize("exploration", ["independent", "joint"])
@pytest.mark.parametrize(("n_agents", "step"), [(1, None), (2, STEP)])
def test_teams_learn_alike_extracted_and_in_python(exploration: Any, n_agents: int, step: TensorStep | None) -> None:
    extracted, in_python = (
        TeamQ(
            lambda: RobotRescueEnv(".H.\nATB", max_cycles=40),
            compiled=compiled,
            n_agents=n_agents,
            tensor_step=step,
            exploration=exploration,
            seed=1,
        ).learn(8)
        for compiled in ("auto", False)
    )
    assert isinstance(in_python.problem, GymnasiumProblem)
    assert in_python.problem.agents == ("robot_0", "robot_1")
    assert_learned_alike(extracted, in_python)


def test_a_team_that_is_not_paid_the_mean_is_played_in_python() -> None:
    team = TeamQ(lambda: RobotRescueEnv(".H.\nATB", max_cycles=40), team_reward="sum", seed=1).learn(3)
    mean = TeamQ(lambda: RobotRescueEnv(".H.\nATB", max_cycles=40), team_reward="mean", seed=1).learn(1)
    assert team.returns[0, 0] == 2 * mean.returns[0, 0] != 0
    with pytest.raises(ValueError, match="reward"):
        TeamQ(lambda: RobotRescueEnv(".H.\nATB"), team_reward="robot_9")


@pytest.mark.parametrize(
    "env",
    ["FrozenLake-v1", lambda: JointEnv(RobotRescueEnv(".H.\nATB")), TabularMDP([[0]], [[1]], [[True]]), sutton_maze()],
)
def test_a_team_reward_is_refused_where_there_is_one_reward_only(env: Any) -> None:
    with pytest.raises(
        ParameterError, match=r"team_reward is for PettingZoo .*; (a |F|J)\w+.* has one reward: leave it out"
    ):
        TeamQ(env, team_reward="sum")


def test_a_wrapper_that_changes_rewards_changes_what_is_learned() -> None:
    doubled = QLearning(lambda: TimeLimit(TransformReward(cliff(), lambda reward: 2.0 * float(reward)), 40), seed=2)
    plain = QLearning(cliff, seed=2)
    assert isinstance(doubled.problem, GymnasiumProblem)
    # Doubling is exact, so greedy actions are the same ones.
    np.testing.assert_array_equal(doubled.learn(5).q, 2 * plain.learn(5).q)


class Backwards(DynaMazeEnv):
    """A maze in which up is down, which its table does not know."""

    def __init__(self) -> None:
        maze = sutton_maze()
        super().__init__(maze.walls, start=maze.start, goal=maze.goal)

    def step(self, action: Any) -> Any:
        return super().step({0: 1, 1: 0}.get(int(action), action))


def test_an_environment_of_ours_that_a_user_has_altered_is_played_in_python() -> None:
    assert isinstance(QLearning(lambda: TimeLimit(Backwards(), 30)).problem, GymnasiumProblem)
    maze = sutton_maze()
    env = DynaMazeEnv(maze.walls, start=maze.start, goal=maze.goal)
    env.step = lambda action: (0, 0.0, True, False, {})  # type: ignore[method-assign]
    assert isinstance(QLearning(env).problem, GymnasiumProblem)


def test_truncation_bootstraps_and_termination_does_not() -> None:
    # One state that pays 1 and is worth 8 at first: it moves half of its way to 1 + 0.5 x 8, or to 1.
    for ends, expected in ((False, 6.5), (True, 4.5)):
        mdp = TabularMDP([[0]], [[1.0]], [[ends]], max_episode_steps=1)
        learner = QLearning(TableEnv(mdp), alpha=0.5, gamma=0.5, initial_q=8.0, seed=0).learn(1)
        assert learner.q[0, 0, 0] == expected


# Saving in the middle, and going on


class NoCopy(SeededTableEnv):
    """An environment that cannot be copied."""

    def __deepcopy__(self, memo: Any) -> Any:
        raise TypeError("I hold a window")


MDP = random_mdp(8, n_states=9, n_outcomes=3, random_start=True, limit=20)
MASKED = masked_mdp(8, n_outcomes=3, random_start=True, limit=20)
KINDS: dict[str, Any] = {
    "a generator": lambda: SeededTableEnv(MDP),
    "no generator": lambda: TableEnv(MDP),
    "masks": lambda: SeededTableEnv(MASKED),
    "a slippery lake": lambda: TransformReward(gymnasium.make("FrozenLake-v1"), float),
    "a team": lambda: JointEnv(Dice()),
}


def go_on_through_files(learner: Any, path: Path, env: Any, pieces: tuple[int, ...]) -> Any:
    for piece in pieces:
        learner.save(path)
        learner = type(learner).load(path, env=env).learn(piece)
    return learner


@pytest.mark.filterwarnings("ignore::tuckerl.errors.RankWarning")
@pytest.mark.parametrize(("n_agents", "step"), [(1, None), (2, STEP)])
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", ["q-learning", "accumulating and carried", "dyna-h"])
def test_going_on_equals_never_having_stopped(
    name: str, kind: str, n_agents: int, step: TensorStep | None, tmp_path: Path
) -> None:
    env = KINDS[kind]
    n_states = QLearning(env).problem.n_states

    def fresh() -> Any:
        return made(name, env, n_states, n_agents=n_agents, tensor_step=step)

    again = go_on_through_files(fresh(), tmp_path / "agent", env, (1, 5, 2, 5))
    assert_same(again, fresh().learn(13))
    assert_same(fresh().learn(6).learn(7), again)


def test_what_has_an_id_is_made_again_by_it(tmp_path: Path) -> None:
    def fresh() -> QLearning:
        return QLearning("FrozenLake-v1", compiled=False, seed=3, n_agents=2)

    again = go_on_through_files(fresh(), tmp_path / "agent", None, (2, 3))
    assert_same(again, fresh().learn(5))
    team = TeamQ("tuckerl/RobotRescue-v0", compiled=False, seed=3).learn(1)
    team.save(tmp_path / "team")
    assert_same(
        TeamQ.load(tmp_path / "team").learn(1), TeamQ("tuckerl/RobotRescue-v0", compiled=False, seed=3).learn(2)
    )


def test_bins_survive_a_file(tmp_path: Path) -> None:
    bins = [[-0.9, -0.5, -0.1], 4]

    def fresh() -> QLearning:
        return QLearning("MountainCar-v0", bins=bins, seed=3)

    learner = fresh().learn(2)
    learner.save(tmp_path / "agent")
    again = QLearning.load(tmp_path / "agent")
    assert_same(again.learn(2), fresh().learn(4))
    observation = np.array([-0.45, 0.01], dtype=np.float32)
    assert again.predict(observation) == fresh().learn(4).predict(observation)
    with pytest.raises(ParameterError, match=r"env must be the one that .* was saved with"):
        QLearning.load(tmp_path / "agent", env="CliffWalking-v1")


def test_another_environment_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "agent"
    QLearning(TableEnv(MDP), seed=1).learn(2).save(path)
    with pytest.raises(SavedFileError, match=r"learned on an environment that no file holds, TableEnv: pass load\(\)"):
        QLearning.load(path)
    for other in (TableEnv(random_mdp(1)), TimeLimit(TableEnv(MDP), 5), random_mdp(1)):
        with pytest.raises(ParameterError, match=r"was saved with: (observation n|time limit|kind) was .*; got "):
            QLearning.load(path, env=other)
    TeamQ(JointEnv(Dice()), seed=1).learn(1).save(path)
    turned = Dice()
    turned.possible_agents = turned.possible_agents[::-1]
    with pytest.raises(ParameterError, match=r"agents was left, right; got right, left"):
        TeamQ.load(path, env=JointEnv(turned))


def test_an_environment_that_lost_its_generator_is_refused(tmp_path: Path) -> None:
    QLearning(SeededTableEnv(MDP), seed=1).learn(2).save(tmp_path / "agent")
    with pytest.raises(SavedFileError, match="drew from np_random, a PCG64; this one does not"):
        QLearning.load(tmp_path / "agent", env=TableEnv(MDP))


# Copies


def test_agents_have_environments_of_their_own() -> None:
    env = SeededTableEnv(MDP)
    before = copy.deepcopy(env)
    learner = QLearning(env, n_agents=3, seed=5, epsilon=1.0).learn(6)
    assert len({tuple(column) for column in learner.returns.T.tolist()}) == 3
    assert learner._state.worlds[0].env is env  # type: ignore[attr-defined]  # played in Python
    by_callable = QLearning(lambda: SeededTableEnv(MDP), n_agents=3, seed=5, epsilon=1.0).learn(6)
    assert_learned_alike(learner, by_callable)
    assert before.state == 0


def test_what_cannot_be_copied_needs_a_callable() -> None:
    with pytest.raises(ValueError, match=r"NoCopy cannot be copied .*I hold a window.* callable that makes one"):
        QLearning(NoCopy(MDP), n_agents=2)
    assert QLearning(NoCopy(MDP), seed=1).learn(2).episodes == 2
    assert QLearning(lambda: NoCopy(MDP), n_agents=2, seed=1).learn(2).episodes == 2


def test_a_learned_lake_is_crossed_both_ways() -> None:
    for compiled in ("auto", False):
        learner = QLearning(dry_lake, compiled=compiled, alpha=0.5, initial_q=1.0, epsilon=0.1, seed=0).learn(300)
        assert learner.evaluate(3).returns.tolist() == [[1.0]] * 3
