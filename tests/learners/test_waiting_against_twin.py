"""Expected SARSA, Double Q-learning, n-step SARSA, tree backup and Monte Carlo against twins from the book's boxes.

With epsilon 1 each action comes from the stream alone, so that rounding cannot change a trajectory; the tables agree to
1e-9. Where greedy actions are compared as well, no sum rounds.
"""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.learners.test_masks import masked_mdp
from tests.learners.waiting import TWINS, VARIANTS, compare, waiting_twin
from tests.learners.worlds import corridor, random_maze, random_mdp
from tests.reference import tensor_step
from tuckerl import DoubleQLearning, MonteCarlo, NStepSarsa, TensorStep, TreeBackup

PROBLEMS = {
    "one outcome": random_mdp(1),
    "stochastic": random_mdp(2, n_outcomes=3, random_start=True),
    "one action": random_mdp(4, n_actions=1),
    "one step": random_mdp(5, limit=1),
    "as long as n": random_mdp(5, limit=5, ends=0.3),
    "maze": random_maze(6).to_mdp(max_episode_steps=80),
    "masked": masked_mdp(3, n_outcomes=2),
    "corridor": corridor(),
}
NUMBERS = [(0.1, 0.95, False), (1.0, 0.9, True), (0.3, 0.0, False), (0.5, 1.0, False)]


@pytest.mark.parametrize("name", PROBLEMS)
@pytest.mark.parametrize("variant", VARIANTS)
def test_it_equals_its_twin(variant: str, name: str) -> None:
    made, own = VARIANTS[variant]
    for number, (alpha, gamma, bootstrap_terminal) in enumerate(NUMBERS):
        parameters: dict[str, Any] = {"alpha": alpha, "gamma": gamma, "bootstrap_terminal": bootstrap_terminal} | own
        compare(made, PROBLEMS[name], 8, n_agents=1 + number % 2, epsilon=1.0, initial_q=0.25, **parameters)


@pytest.mark.parametrize(
    "variant",
    [
        "expected",
        *(pytest.param(name, marks=pytest.mark.long) for name in ("double", "2-step", "tree 3", "every visit")),
    ],
)
def test_rows_whose_maxima_are_followed_equal_the_twin(variant: str) -> None:
    made, own = VARIANTS[variant]
    problem = random_mdp(8, n_actions=12, n_outcomes=2, limit=40)
    compare(made, problem, 6, epsilon=1.0, ties="first", **{"alpha": 0.3} | own)


@pytest.mark.parametrize("ties", ["first", "random"])
@pytest.mark.parametrize("variant", ["expected", "double", "2-step", "tree 3", "tree of the policy", "first visits"])
def test_greedy_actions_and_decay_equal_the_twin(variant: str, ties: str) -> None:
    made, own = VARIANTS[variant]
    dyadic: dict[str, Any] = {"alpha": 0.5, "gamma": 0.5, "epsilon": 0.5, "epsilon_decay": 0.5, "ties": ties}
    compare(made, corridor(4, limit=8), 4, **dyadic | own)


@pytest.mark.filterwarnings("ignore::tuckerl.errors.RankWarning")
@pytest.mark.parametrize("share", ["max", "mean", "none"])
@pytest.mark.parametrize("variant", ["expected", "2-step", "tree 3", "first visits by alpha"])
def test_the_tensor_step_equals_its_twin(variant: str, share: str) -> None:
    made, own = VARIANTS[variant]
    _compare_with_step(made, TensorStep(every=4, ranks=(3, 2, 2, 2), share=share, floor=0.1), 3, **own)


@pytest.mark.filterwarnings("ignore::tuckerl.errors.RankWarning")
@pytest.mark.parametrize(("made", "weights"), [(DoubleQLearning, "paper"), (MonteCarlo, "none")])
def test_the_tensor_step_of_what_keeps_more_than_a_table_equals_its_twin(made: Any, weights: str) -> None:
    own = {"alpha": None} if made is MonteCarlo else {}
    _compare_with_step(made, TensorStep(4, (3, 2, 2, 2), weights=weights, share="none", floor=0.1), 2, **own)


def _compare_with_step(made: Any, step: TensorStep, n_agents: int, **own: Any) -> None:
    problem = random_mdp(11, n_outcomes=2, limit=15)
    parameters: dict[str, Any] = {"alpha": 0.3, "gamma": 0.9, "epsilon": 1.0, "seed": 3} | own
    learner = made(problem, n_agents=n_agents, tensor_step=step, **parameters).learn(10)
    twins = [waiting_twin(made, problem, agent=agent, **parameters) for agent in range(n_agents)]
    assert isinstance(step.weights, str)
    assert isinstance(step.share, str)
    steps, windows = tensor_step.play(
        twins,
        10,
        seed=3,
        every=4,
        ranks=step.ranks or (),
        weights=step.weights,
        sharing=step.share,
        floor=step.floor,
    )
    assert learner.steps.tolist() == steps
    np.testing.assert_allclose(learner.action_weights, windows[-1].omega, rtol=0, atol=1e-9)
    for agent, slow in enumerate(twins):
        # The weights themselves agree to 1e-9 only: decompositions differ.
        np.testing.assert_allclose(learner.q[agent], slow.q, rtol=1e-8, atol=1e-9)


@settings(deadline=None, max_examples=60)
@given(
    made=st.sampled_from(list(TWINS)),
    n=st.integers(1, 12),
    gamma=st.floats(0, 1),
    limit=st.integers(1, 25),
    episodes=st.integers(1, 4),
    seed=st.integers(0, 2**32),
    bootstrap_terminal=st.booleans(),
)
def test_any_numbers_equal_the_twin(made: Any, n: int, seed: int, limit: int, episodes: int, **parameters: Any) -> None:
    problem = random_mdp(seed, n_states=6, limit=limit, n_outcomes=1 + seed % 2, ends=0.1)
    if made in (NStepSarsa, TreeBackup):
        parameters["n"] = n
    compare(made, problem, episodes, alpha=0.2, epsilon=1.0, **parameters)
