"""What is seen inside of learners: whose actions are called what, where nobody can stand, what may not be done."""

import re
from pathlib import Path

import gymnasium
import numpy as np
import pettingzoo
import pytest

import tuckerl
from tests.learners.worlds import corridor
from tuckerl import QLearning, TabularMDP
from tuckerl.adapters.resolve import AdapterOptions, Agents, as_problem
from tuckerl.errors import ParameterError, ProblemError, SavedFileError
from tuckerl.reports.inspect import inspect_learner, inspection_figures
from tuckerl.reports.inspect.figures import FIGURES
from tuckerl.reports.inspect.file import learner_lines
from tuckerl.reports.inspect.greedy import NO_PREFERENCE, greedy, shares_first_place, values
from tuckerl.reports.learner_text import name_of
from tuckerl.reports.text import number
from tuckerl.training import learner_file as saved

STEP = tuckerl.TensorStep(every=5, ranks=(3, 2, 3, 1), floor=0.1)
SMALL_RESCUE = ".H..\n#...\nAT.B"


def test_forbidden_actions_are_never_greedy() -> None:
    q = np.array([[1.0, 5.0, 2.0], [3.0, 0.0, 3.0], [0.0, 9.0, 0.0], [4.0, np.nan, 1.0], [7.0, 8.0, 2.0], [0, 1, 2]])
    mask = np.ones(q.shape, dtype=np.bool_)
    mask[:4, 1] = False
    mask[4, :2] = mask[5, 1:] = False  # one action is left: preferred as soon as its value is not 0
    assert greedy(q, mask).tolist() == [2, NO_PREFERENCE, NO_PREFERENCE, 0, 2, NO_PREFERENCE]
    np.testing.assert_array_equal(values(q, mask), [2.0, np.nan, np.nan, 4.0, 2.0, np.nan])
    assert not shares_first_place(q, mask).any()
    assert shares_first_place(np.array([[1.0, 1.0, 5.0, 0.0]]), np.array([[True, True, False, True]])).all()


def test_masks_of_a_learner_reach_the_figures() -> None:
    mdp = tuckerl.TabularMDP(
        [[1, 1, 0], [1, 1, 1]],
        [[1.0, 2.0, 0.0], [0.0, 0.0, 0.0]],
        [[True, True, False], [True, True, True]],
        action_mask=[[True, False, True], [True, True, True]],
    )
    inspection = inspect_learner(tuckerl.QLearning(mdp, alpha=0.5, initial_q=0.1, seed=0, n_agents=2).learn(20))
    assert inspection.allowed.shape == (2, 2, 3)
    assert not inspection.allowed[:, 0, 1].any()
    assert (~inspection.allowed).sum() == 2
    assert greedy(inspection.q, inspection.allowed)[:, 0].tolist() == [0, 0]
    (plain,) = [one for one in inspection_figures(inspection) if one.name == "policy"]
    assert re.search(r"Greedy: 0 in \d", plain.alt)
    assert inspect_learner(tuckerl.Sarsa("FrozenLake-v1", seed=0)).action_mask is None


def test_masks_of_stepped_taxis_are_those_that_were_seen() -> None:
    learner = tuckerl.QLearning("Taxi-v4", compiled=False, seed=0).learn(2)
    visited = np.unique(np.concatenate(learner.trajectories))
    masked = inspect_learner(learner).allowed[0]
    whole = inspect_learner(tuckerl.QLearning("Taxi-v4", seed=0)).allowed[0]
    np.testing.assert_array_equal(masked[visited], whole[visited])
    assert not whole[visited].all()
    assert masked.sum() > whole.sum()


@pytest.mark.parametrize(
    ("env", "names"),
    [
        ("FrozenLake-v1", ["left", "down", "right", "up"]),
        ("CliffWalking-v1", ["up", "right", "down", "left"]),
        ("tuckerl/DynaMaze-v0", ["up", "down", "left", "right"]),
        (tuckerl.sutton_maze(), ["up", "down", "left", "right"]),
        (lambda: gymnasium.make("MountainCar-v0"), ["push left", "no push", "push right"]),
        ("tuckerl/RobotRescue-v0", ["left", "right", "up", "down", "stay"]),
        ("CliffWalkingSlippery-v1", ["up", "right", "down", "left"]),
        (tuckerl.TabularMDP([[0, 0]], [[0, 0]], [[True, True]]), ["0", "1"]),
    ],
)
def test_actions_are_called_as_their_environment_means_them(env: object, names: list[str]) -> None:
    bins = 3 if callable(env) else None
    assert list(as_problem(env, AdapterOptions(bins=bins)).action_names) == names  # type: ignore[arg-type]  # all are


@pytest.mark.parametrize("env", ["FrozenLake-v1", "CliffWalking-v1"])
def test_the_names_of_moves_are_where_the_moves_lead(env: str) -> None:
    made: object = gymnasium.make(env, **({"is_slippery": False} if env.startswith("Frozen") else {})).unwrapped
    problem = as_problem(made)  # type: ignore[arg-type]  # it is an environment
    assert isinstance(problem, tuckerl.TabularMDP)
    columns = problem.layout[1] if problem.layout else 0
    ways = {"up": -columns, "down": columns, "left": -1, "right": 1}
    state = columns + 1 if env.startswith("Cliff") else 9
    next_state = made.P[state]  # type: ignore[attr-defined]
    assert [next_state[action][0][1] - state for action in range(4)] == [ways[n] for n in problem.action_names]


def test_joint_actions_name_every_members_part() -> None:
    made = pettingzoo.make("parallel", "tuckerl/RobotRescue-v0", map=SMALL_RESCUE)
    names = as_problem(made, AdapterOptions(Agents.JOINT)).action_names
    assert (len(names), names[1], names[5]) == (25, "left, right", "right, left")


def test_where_no_start_leads_is_blocked() -> None:
    maze = tuckerl.sutton_maze()
    inspection = inspect_learner(tuckerl.QLearning(maze, seed=0))
    np.testing.assert_array_equal(inspection.walls, maze.walls.ravel())
    cliff = inspect_learner(tuckerl.QLearning("CliffWalking-v1", seed=0))
    assert np.flatnonzero(cliff.walls).tolist() == list(range(37, 47)), "who steps there stands at the start again"
    assert inspect_learner(tuckerl.QLearning("FrozenLake-v1", seed=0)).blocked is None, "one can stand in a hole"


def test_what_lies_behind_an_end_is_blocked_but_the_end_is_not() -> None:
    chain = tuckerl.TabularMDP([[1], [2], [3], [3]], [[0]] * 4, [[False], [True], [False], [False]])
    walls = inspect_learner(tuckerl.QLearning(chain, seed=0)).walls
    assert walls.tolist() == [False, False, False, True]


def test_a_learner_is_all_shown_after_a_file_as_before(tmp_path: Path) -> None:
    learner = tuckerl.SarsaLambda(tuckerl.sutton_maze(), n_agents=2, tensor_step=STEP, seed=1, alpha=0.3).learn(103)
    learner.save(tmp_path / "agent.tuckerl")
    before, after = inspect_learner(learner), inspect_learner(tuckerl.load(tmp_path / "agent.tuckerl"))
    assert before.title == after.title == "SarsaLambda with a tensor step on Maze"
    assert before.layout == after.layout == (6, 9)
    assert before.loadings is not None
    assert before.loadings.episode == 100
    shown = [
        [(spec.caption(one), spec.alt(one), spec.live and spec.live(one)) for spec in FIGURES if spec.applies(one)]
        for one in (before, after)
    ]
    assert shown[0] == shown[1]
    assert len(shown[0]) >= 6


def test_layout_and_names_must_fit() -> None:
    learner = tuckerl.Sarsa("FrozenLake-v1", seed=0)
    assert inspect_learner(learner, layout=(2, 8), action_names="abcd", title="t").layout == (2, 8)
    with pytest.raises(ProblemError, match=r"layout must be \(rows, columns\) of 16 cells; got \(3, 8\)"):
        inspect_learner(learner, layout=(3, 8))
    with pytest.raises(ProblemError, match="action_names must be 4 names, one for each action; got 2"):
        inspect_learner(learner, action_names=["a", "b"])


def test_the_value_of_the_start_is_its_mean_over_the_starts() -> None:
    mdp = tuckerl.TabularMDP([[0, 0], [1, 1]], [[0, 0], [0, 0]], [[True, True]] * 2, start=[0.25, 0.75])
    q = np.array([[1.0, 2.0], [6.0, 4.0]])
    lines = learner_lines(tuckerl.Sarsa(mdp, initial_q=q, seed=0))
    assert lines[-1] == "Greedy value of the start (agent 0): 5"
    assert lines[0] == "Sarsa"
    assert name_of(tuckerl.Sarsa("Blackjack-v1", seed=0)) == "Sarsa on Blackjack-v1"


class Own(tuckerl.Sarsa):
    """A learner that its user wrote."""


def test_any_learner_is_loaded_by_what_its_file_says(tmp_path: Path) -> None:
    path = tmp_path / "agent.tuckerl"
    for kind in (tuckerl.QLearning, tuckerl.Sarsa, tuckerl.SarsaLambda, Own):
        learner = kind("FrozenLake-v1", seed=0).learn(5)
        learner.save(path)
        again = tuckerl.load(path)
        assert type(again) is kind
        np.testing.assert_array_equal(again.learn(5).q, learner.learn(5).q)
    content = saved.read(path)
    saved.write(path, content.header | {"learner": "Lost"}, content.arrays)
    with pytest.raises(
        SavedFileError, match=r"holds a Lost, which is none of QLearning, Sarsa, .*TeamQ.*: import the module"
    ):
        tuckerl.load(path)
    tuckerl.Sarsa("tuckerl/CartPole-v0", seed=0).save(path)
    with pytest.raises(SavedFileError, match="pass load\\(\\) its env"):
        tuckerl.load(path)
    assert tuckerl.load(path, env="tuckerl/CartPole-v0").problem.source == "tuckerl/CartPole-v0"
    with pytest.raises(ParameterError, match="kind was simulator; got table"):
        tuckerl.load(path, env="FrozenLake-v1")


def test_problems_remember_their_environment(tmp_path: Path) -> None:
    lake = as_problem("FrozenLake-v1")
    assert isinstance(lake, tuckerl.TabularMDP)
    assert lake.source == lake.with_time_limit(3).source == "FrozenLake-v1"
    assert as_problem(gymnasium.make("FrozenLake-v1")).source == "FrozenLake-v1"
    pole = as_problem("tuckerl/CartPole-v0")
    assert isinstance(pole, tuckerl.Simulator)
    assert pole.source == pole.with_time_limit(3).source == "tuckerl/CartPole-v0"
    assert tuckerl.cart_pole().source is None, "the environment's own, which all share, stays as it is"
    tuckerl.Sarsa("FrozenLake-v1", seed=0).save(tmp_path / "a")
    assert tuckerl.load(tmp_path / "a").problem.source == "FrozenLake-v1"


def test_optimal_values_stand_beside_the_learned_ones_where_the_transitions_are_known() -> None:
    agent = QLearning(corridor(), alpha=0.5, gamma=0.5, seed=0).learn(episodes=30)
    inspection = inspect_learner(agent)
    assert inspection.optimal is not None
    np.testing.assert_allclose(inspection.optimal, [-1.9375, -1.875, -1.75, -1.5, -1.0], atol=1e-6)
    (figure,) = [one for one in inspection_figures(inspection) if one.name == "optimum"]
    largest = np.nanmax(np.abs(inspection.optimum - inspection.known[0]))
    assert f"by {number(float(largest))} at most" in figure.caption
    assert "in state 4" in figure.alt
    assert inspect_learner(QLearning("FrozenLake-v1", compiled=False, seed=0)).optimal is None
    assert inspect_learner(QLearning(TabularMDP([[0]], [[1.0]], [[False]]), gamma=1.0, seed=0)).optimal is None
    with pytest.raises(ProblemError, match=r"optimal must fit tables"):
        inspection_figures(inspection._replace(optimal=np.zeros(3)))


def test_the_greedy_path_says_how_it_ends() -> None:
    grid = TabularMDP([[1], [2], [2]], [[0], [0], [0]], [[False], [True], [True]], layout=(1, 3))
    agent = QLearning(grid, initial_q=np.array([[1.0], [1.0], [0.0]]), seed=0)
    (path,) = inspect_learner(agent).paths
    assert (path.states[0].tolist(), path.words) == ([0, 1, 2], "it ends after 2 steps")
    circle = TabularMDP([[1], [0]], [[0], [0]], [[False], [False]], layout=(1, 2))
    (path,) = inspect_learner(QLearning(circle, initial_q=np.ones((2, 1)), seed=0)).paths
    assert (path.states[0].tolist(), path.words) == ([0, 1, 0], "it goes in a circle from step 2 on and never ends")
    (path,) = inspect_learner(QLearning(circle, initial_q=np.array([[1.0], [0.0]]), seed=0)).paths
    assert path.words == "it stops after 1 step, where no action is preferred"


def test_no_greedy_path_is_drawn_where_chance_decides_but_the_latest_episode_is() -> None:
    learner = tuckerl.QLearning("FrozenLake-v1", seed=0).learn(3)
    (path,) = inspect_learner(learner).paths
    assert path.name == "latest episode of learning"
    np.testing.assert_array_equal(path.states[0], learner.trajectories[0])
    assert list(inspect_learner(tuckerl.QLearning("Taxi-v4", seed=0).learn(3)).paths) == []
