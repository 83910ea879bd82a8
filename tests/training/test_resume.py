"""Learning in pieces equals learning at once, to the last bit, also through a file."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.learners.worlds import corridor, drift, random_maze, random_mdp
from tuckerl import DynaH, QLearning, Sarsa, SarsaLambda, TabularMDP, TeamQ, TensorStep
from tuckerl.errors import ParameterError, SavedFileError
from tuckerl.training.learner import Learner

PROBLEM = random_mdp(31, n_states=9, n_outcomes=2, random_start=True)
STEPS = {
    "no step": None,
    "paper": TensorStep(every=10, ranks=(4, 2, 3, 1)),
    "permuted and random": TensorStep(every=10, ranks=(4, 2, 3, 1), weights="permuted", share="random", floor=0.1),
    "constant and mean": TensorStep(every=10, ranks=(4, 2, 3, 1), weights="constant", share="mean"),
    "visits": TensorStep(every=10, weights="none", share="visits"),
    "consensus": TensorStep(every=10, ranks=(4, 2, 3, 1), weights="relative", share="consensus"),
}
LEARNERS = [QLearning, DynaH, Sarsa, SarsaLambda, TeamQ]


def assert_same(one: Learner, other: Learner) -> None:
    for name in ("q", "steps", "returns", "action_weights"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name), err_msg=name)
    for ours, theirs in zip(one.tensor_step_history, other.tensor_step_history, strict=True):
        np.testing.assert_array_equal(ours, theirs)
        assert ours.dtype == theirs.dtype
    for ours, theirs in zip(one.trajectories, other.trajectories, strict=True):
        np.testing.assert_array_equal(ours, theirs)
    assert one.diverged_at == other.diverged_at
    assert one.episodes == other.episodes
    assert repr(one) == repr(other)


def make(learner: type[Learner], step: TensorStep | None, n_agents: int, problem: TabularMDP = PROBLEM) -> Learner:
    settings: dict[str, Any] = {"alpha": 0.3, "epsilon": 0.4, "epsilon_decay": 0.97, "n_agents": n_agents, "seed": 6}
    return learner(problem, tensor_step=step, **settings)


@pytest.mark.parametrize("pieces", [(10, 10), (3, 4, 13), (19, 1)])
@pytest.mark.parametrize("n_agents", [1, 3])
@pytest.mark.parametrize("step", STEPS)
@pytest.mark.parametrize("learner", LEARNERS)
def test_pieces_equal_the_whole(
    learner: type[Learner], step: str, n_agents: int, pieces: tuple[int, ...], tmp_path: Path
) -> None:
    whole = make(learner, STEPS[step], n_agents).learn(20)
    in_memory = make(learner, STEPS[step], n_agents)
    through_files = make(learner, STEPS[step], n_agents)
    for piece in pieces:
        in_memory.learn(piece)
        through_files.save(tmp_path / "learner")
        through_files = learner.load(tmp_path / "learner").learn(piece)
    assert_same(in_memory, whole)
    assert_same(through_files, whole)


TIMES = {
    "twice a window": TensorStep(8, (4, 2, 3, 1), share="visits", share_every=4),
    "mean twice a window": TensorStep(8, (4, 2, 3, 1), share="mean", share_every=2),
    "every other window": TensorStep(4, (4, 2, 3, 1), weights="permuted", share="visits", share_every=8),
    "without windows": TensorStep(8, weights="constant", share="visits", share_every=4),
    "shrunk": TensorStep(4, (4, 2, 3, 1), share="visits", share_every=8, shrink=0.25),
}


@pytest.mark.filterwarnings("ignore::tuckerl.errors.RankWarning")
@pytest.mark.parametrize("pieces", [(5, 2, 13), (6, 5, 9), (4, 7, 9)])
@pytest.mark.parametrize("step", TIMES)
@pytest.mark.parametrize("learner", [QLearning, SarsaLambda])
def test_pieces_equal_the_whole_however_often_agents_share(
    learner: type[Learner], step: str, pieces: tuple[int, ...], tmp_path: Path
) -> None:
    whole = make(learner, TIMES[step], 3).learn(20)
    through_files = make(learner, TIMES[step], 3)
    for piece in pieces:
        through_files.save(tmp_path / "learner")
        through_files = learner.load(tmp_path / "learner").learn(piece)
    assert_same(through_files, whole)


@pytest.mark.filterwarnings("ignore::tuckerl.errors.RankWarning")
@pytest.mark.parametrize("learner", LEARNERS)
def test_fifty_and_fifty_are_a_hundred(learner: type[Learner]) -> None:
    maze = random_maze(2, 6, 6).to_mdp(max_episode_steps=300)
    step = TensorStep(every=10, ranks=(15, 3, 9, 1))
    assert_same(make(learner, step, 3, maze).learn(50).learn(50), make(learner, step, 3, maze).learn(100))
    # Without a step, kernels are called for 100 episodes at a time.
    assert_same(make(learner, None, 1, maze).learn(70).learn(70), make(learner, None, 1, maze).learn(140))


@pytest.mark.filterwarnings("ignore::tuckerl.errors.RankWarning")
@pytest.mark.parametrize("pieces", [(10, 10), (3, 4, 13)])
@pytest.mark.parametrize("share", ["min", "mean", "none"])
@pytest.mark.parametrize("simulated", [False, True])
@pytest.mark.parametrize("learner", [SarsaLambda, TeamQ])
def test_carried_traces_survive_a_file(
    learner: Any, simulated: bool, share: str, pieces: tuple[int, ...], tmp_path: Path
) -> None:
    step = TensorStep(every=8, ranks=(4, 2, 3, 2), share=share, floor=0.1)
    parameters = {"trace": "accumulating", "carry_trace": True, "gamma": 0.9, "lambda_": 0.8, "n_agents": 3}

    def fresh() -> Any:
        problem = drift(limit=15) if simulated else random_mdp(34, limit=12, action_sizes=(3, 1))
        return learner(problem, tensor_step=step, alpha=0.1, epsilon=0.3, seed=2, **parameters)

    env = drift(limit=15) if simulated else None
    through_files = fresh()
    for piece in pieces:
        through_files.save(tmp_path / "learner")
        through_files = learner.load(tmp_path / "learner", env=env).learn(piece)
    assert_same(through_files, fresh().learn(20))


def test_parameters_of_teams_survive_a_file(tmp_path: Path) -> None:
    problem = random_mdp(35, n_actions=6, action_sizes=(3, 2))
    team = TeamQ(problem, cut_traces=False, exploration="joint", lambda_=0.5, bootstrap_terminal=True, seed=1).learn(3)
    team.save(tmp_path / "team")
    again = TeamQ.load(tmp_path / "team")
    assert (again.cut_traces, again.exploration, again.lambda_, again.trace) == (False, "joint", 0.5, "replacing")
    assert again.bootstrap_terminal
    assert_same(again.learn(4), team.learn(4))
    by_agent = TeamQ(problem, seed=1).learn(3)
    by_agent.save(tmp_path / "team")
    assert_same(TeamQ.load(tmp_path / "team").learn(4), by_agent.learn(4))


def test_a_simulator_must_be_given_again(tmp_path: Path) -> None:
    path = tmp_path / "learner"
    Sarsa(drift(), seed=1).learn(3).save(path)
    with pytest.raises(SavedFileError, match=r"learned on a simulator, whose functions no file holds: pass load\(\)"):
        Sarsa.load(path)
    differences = {r"time limit was 80; got 81": drift(limit=81), "kind was simulator; got table": random_mdp(1)}
    for difference, wrong in differences.items():
        with pytest.raises(ParameterError, match=f"was saved with: {difference}"):
            Sarsa.load(path, env=wrong)
    assert_same(Sarsa.load(path, env=drift()).learn(3), Sarsa(drift(), seed=1).learn(6))
    Sarsa(random_mdp(1), seed=1).learn(3).save(path)
    assert_same(Sarsa.load(path, env=random_mdp(1)).learn(3), Sarsa(random_mdp(1), seed=1).learn(6))
    with pytest.raises(ParameterError, match=r"was saved with: transitions was sha256 \w{12}\.\.\.; got sha256"):
        Sarsa.load(path, env=random_mdp(2))


@pytest.mark.filterwarnings("ignore::tuckerl.errors.RankWarning")
@pytest.mark.parametrize("initial_q", [-0.5, np.arange(27.0).reshape(9, 3) / 30])
def test_first_tables_survive_a_file(initial_q: Any, tmp_path: Path) -> None:
    def fresh() -> QLearning:
        return QLearning(
            random_mdp(32, n_states=9, limit=4), initial_q=initial_q, n_agents=2, seed=1, tensor_step=STEPS["paper"]
        )

    fresh().learn(14).save(tmp_path / "learner")
    assert_same(QLearning.load(tmp_path / "learner").learn(16), fresh().learn(30))


def test_all_parameters_survive_a_file(tmp_path: Path) -> None:
    problem = random_mdp(33)
    learner = DynaH(
        problem,
        planning_steps=3,
        search_control="random",
        heuristic=np.arange(7.0),
        gamma=0.5,
        ties="first",
        seed=np.random.SeedSequence([1, 2**70], spawn_key=(3, 4)),
    )
    learner.learn(5).save(tmp_path / "learner")
    again = DynaH.load(tmp_path / "learner")
    assert (again.planning_steps, again.gamma, again.ties) == (3, 0.5, "first")
    assert again.search_control == learner.search_control == "random"
    ours, theirs = again.constants(), learner.constants()
    np.testing.assert_array_equal(ours.pop("heuristic"), np.arange(7.0))
    np.testing.assert_array_equal(theirs.pop("heuristic"), np.arange(7.0))
    assert ours == theirs
    np.testing.assert_array_equal(again.problem.heuristic, problem.heuristic)
    assert_same(again.learn(5), learner.learn(5))


def test_random_predictions_go_on_through_a_file(tmp_path: Path) -> None:
    learner = QLearning(PROBLEM, epsilon=0.5, seed=1).learn(5)
    states = np.arange(9)
    learner.predict(states, deterministic=False)
    learner.save(tmp_path / "learner")
    again = QLearning.load(tmp_path / "learner")
    for _ in range(5):
        np.testing.assert_array_equal(
            learner.predict(states, deterministic=False)[0], again.predict(states, deterministic=False)[0]
        )


def test_what_is_handed_out_is_a_copy() -> None:
    learner = make(QLearning, STEPS["paper"], 2).learn(10)
    for name in ("q", "steps", "returns", "action_weights"):
        before = getattr(learner, name)
        getattr(learner, name)[...] = 99
        np.testing.assert_array_equal(getattr(learner, name), before)
    learner.tensor_step_history.weights[...] = 99
    learner.trajectories[0][...] = 99
    assert learner.tensor_step_history.weights.max() <= 1
    assert learner.trajectories[0].max() < 9


def test_trajectories_of_a_problem_without_a_limit() -> None:
    learner = QLearning(corridor(limit=None), epsilon=1.0, seed=0).learn(3)
    assert learner.trajectories[0].size == learner.steps[-1, 0] + 1 > 2
