"""Everything that the library ships passes its own checks."""

from collections.abc import Callable
from typing import Any

import gymnasium
import pytest

import tuckerl
from tests.testing.learners import ExpectedSarsa
from tests.testing.test_environments import Pair
from tuckerl.environments import ENVIRONMENTS, PARALLEL_ENVIRONMENTS
from tuckerl.testing import check_learner, check_problem
from tuckerl.training.learner import Learner

PROBLEMS: dict[str, Callable[[], Any]] = {
    "Sutton's maze": tuckerl.sutton_maze,
    "a random maze": lambda: tuckerl.random_maze(seed=1),
    "cart pole": tuckerl.cart_pole,
    "cart pole, uniform start": lambda: tuckerl.cart_pole(start="uniform"),
    "cart pole, reward by sign": lambda: tuckerl.cart_pole(reward="sign"),
    "cart pole, failures in the grid": lambda: tuckerl.cart_pole(absorbing=False),
    "cart pole without a time limit": lambda: tuckerl.cart_pole(max_episode_steps=None),
    "cart pole, observed as numbers": lambda: gymnasium.make("tuckerl/CartPole-v0", discrete=False),
    "robot rescue": tuckerl.robot_rescue,
}


@pytest.mark.parametrize("name", [*ENVIRONMENTS, *PARALLEL_ENVIRONMENTS])
def test_every_registered_environment_is_right(name: str) -> None:
    check_problem(name, episodes=3)


@pytest.mark.parametrize("name", PROBLEMS)
def test_every_built_in_problem_is_right(name: str) -> None:
    check_problem(PROBLEMS[name](), episodes=5)


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["FrozenLake-v1", "Taxi-v4", "CliffWalking-v1", "Blackjack-v1", "MountainCar-v0", "CartPole-v1"]
)
def test_environments_of_gymnasium_are_right(name: str) -> None:
    check_problem(name, episodes=2)


LEARNERS: list[tuple[type[Learner], dict[str, Any]]] = [
    (tuckerl.QLearning, {}),
    (tuckerl.QLearning, {"ties": "first"}),
    (tuckerl.Sarsa, {}),
    (tuckerl.SarsaLambda, {"lambda_": 0.8, "trace": "accumulating"}),
    (tuckerl.SarsaLambda, {"carry_trace": True}),
    (tuckerl.TeamQ, {}),
    (tuckerl.NStepSarsa, {"n": 3}),
    (tuckerl.DynaQPlus, {"planning_steps": 3}),
]
SLOWER: list[tuple[type[Learner], dict[str, Any]]] = [
    (tuckerl.DynaH, {"planning_steps": 5}),
    (tuckerl.DynaQ, {"planning_steps": 5}),
    (tuckerl.PrioritizedSweeping, {"theta": 0.0}),
    (tuckerl.RMax, {"r_max": 100.0, "m": 2}),
    (ExpectedSarsa, {}),
    (tuckerl.ExpectedSarsa, {}),
    (tuckerl.DoubleQLearning, {}),
    (tuckerl.TreeBackup, {"n": 3}),
    (tuckerl.TreeBackup, {"n": 3, "target": "policy"}),
    (tuckerl.MonteCarlo, {}),
    (tuckerl.MonteCarlo, {"visits": "every"}),
    (tuckerl.WatkinsQLambda, {"carry_trace": True}),
    (tuckerl.TrueOnlineSarsaLambda, {"lambda_": 0.8}),
    (tuckerl.HAQL, {}),
]


@pytest.mark.parametrize(
    ("learner", "parameters"),
    [*LEARNERS, *(pytest.param(*one, marks=pytest.mark.long) for one in SLOWER)],
    ids=lambda part: getattr(part, "__name__", str(part)),
)
def test_every_learner_is_right(learner: type[Learner], parameters: dict[str, Any]) -> None:
    check_learner(learner, parameters=parameters)


@pytest.mark.long
def test_a_learner_of_the_average_reward_is_right() -> None:
    check_learner(tuckerl.RLearning, discounts=False)


def test_a_learner_is_checked_on_a_problem_of_ones_own_too() -> None:
    check_learner(tuckerl.QLearning, env="FrozenLake-v1")


def test_a_learner_is_checked_among_agents_that_learn_side_by_side() -> None:
    check_learner(tuckerl.SarsaLambda, env=lambda: Pair())
