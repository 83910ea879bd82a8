from typing import Any

import pytest

import tuckerl
from tuckerl.errors import ParameterError, ParameterTypeError, UnknownNameError
from tuckerl.studies.algorithms import ALGORITHMS, named_algorithm, parameters_of, split_settings, tensor_step
from tuckerl.studies.cart_pole import CART_POLE
from tuckerl.studies.dyna_maze import DYNA_MAZE
from tuckerl.studies.robot_rescue import ROBOT_RESCUE
from tuckerl.studies.study import Scenario
from tuckerl.studies.training_config import TrainingConfig, build_learner

CONTRACT = """
    q-learning tq-learning
    sarsa
    sarsa-lambda tsarsa-lambda
    watkins-q-lambda t-watkins-q-lambda
    true-online-sarsa-lambda t-true-online-sarsa-lambda
    r-learning t-r-learning
    haql t-haql
    dyna-h dyna-ht
    team-q team-tq
    expected-sarsa t-expected-sarsa
    double-q-learning t-double-q-learning
    n-step-sarsa t-n-step-sarsa
    tree-backup t-tree-backup
    monte-carlo t-monte-carlo
"""


def test_the_algorithms_are_those_of_the_contract() -> None:
    assert set(CONTRACT.split()) <= set(ALGORITHMS)
    assert all(algorithm.name == name for name, algorithm in ALGORITHMS.items())


@pytest.mark.parametrize("scenario", [CART_POLE, DYNA_MAZE, ROBOT_RESCUE], ids=lambda scenario: scenario.name)
def test_the_default_step_is_the_papers_where_the_paper_gives_one(scenario: Scenario) -> None:
    family = scenario.algorithm
    algorithm = named_algorithm(family.t_version)
    step = tensor_step(algorithm, (1404, family.n_actions), {})
    assert algorithm.learner is family.learner
    assert (step.every, step.weights, step.share) == (family.step.every, family.step.weights, family.step.share)
    assert isinstance(step.ranks, tuple)
    assert isinstance(family.step.ranks, tuple)
    assert step.ranks[1:] == family.step.ranks[1:]


def test_ranks_are_never_above_the_sizes() -> None:
    assert tensor_step(ALGORITHMS["tq-learning"], (6, 1), {}).ranks == (6, 1, 9, 1)
    assert tensor_step(ALGORITHMS["tq-learning"], (6, 2), {"ranks": (3, 2, 5, 1)}).ranks == (3, 2, 5, 1)


def test_every_parameter_that_is_named_can_be_set() -> None:
    values: dict[str, Any] = {
        "alpha": 0.2,
        "lambda_": 0.5,
        "planning_steps": 2,
        "search_control": "restart",
        "cut_traces": False,
        "ties": "first",
    }
    for algorithm in ALGORITHMS.values():
        chosen = {name: value for name, value in values.items() if name in parameters_of(algorithm)}
        env = "tuckerl/RobotRescue-v0" if algorithm.plays_teams else tuckerl.sutton_maze()
        learner = algorithm.learner(env, **chosen)
        assert learner.alpha == 0.2
        assert {"seed", "n_agents", "tensor_step"}.isdisjoint(parameters_of(algorithm))
        assert ("ranks" in parameters_of(algorithm)) == algorithm.is_t_version


def test_settings_are_split_into_the_learners_and_the_steps() -> None:
    assert split_settings(ALGORITHMS["dyna-ht"], {"alpha": 0.2, "every": 5, "search_control": "random"}) == (
        {"alpha": 0.2, "search_control": "random"},
        {"every": 5},
    )


def test_agents_of_an_unmodified_algorithm_may_share() -> None:
    settings = {"alpha": 0.2, "share": "visits", "share_every": 5}
    of_step = {"share": "visits", "share_every": 5}
    assert split_settings(ALGORITHMS["q-learning"], settings) == ({"alpha": 0.2}, of_step)
    config = TrainingConfig("q-learning", "FrozenLake-v1", settings=settings, n_agents=3)
    step = build_learner(config, "FrozenLake-v1").tensor_step
    assert step is not None
    assert (step.every, step.weights, step.share, step.share_every) == (10, "none", "visits", 5)
    assert not step.needs_decomposition
    both = TrainingConfig("q-learning", "FrozenLake-v1", settings={"share": "max", "weights": "paper"}, n_agents=2)
    decomposed = build_learner(both, "FrozenLake-v1").tensor_step
    assert decomposed is not None
    assert (decomposed.weights, decomposed.ranks) == ("paper", (15, 3, 9, 1))
    assert build_learner(config._replace(settings={}), "FrozenLake-v1").tensor_step is None


def test_an_unknown_algorithm_is_said() -> None:
    with pytest.raises(UnknownNameError, match="unknown algorithm 'sarsa-lamda': did you mean 'sarsa-lambda'"):
        named_algorithm("sarsa-lamda")


@pytest.mark.parametrize(
    ("name", "error", "message"),
    [
        ("alhpa", ParameterTypeError, "sarsa has no parameter 'alhpa': did you mean 'alpha'"),
        ("nothing_like_it", ParameterTypeError, "known are alpha, "),
        ("seed", ParameterError, "give the seed with --seed"),
        ("n_agents", ParameterError, "give the number of agents with --agents"),
        ("every", ParameterError, "every belongs to the tensor step, which sarsa is without: tq-learning, "),
    ],
)
def test_what_cannot_be_set_is_said(name: str, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        split_settings(ALGORITHMS["sarsa"], {name: 1})
