"""R-learning: against its twin, by hand, on Mahadevan's two loops in closed form, and the access-control queue."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.learners.average_reward import (
    ACCEPT,
    access_control,
    average_of,
    best_average,
    queue_chances,
    two_loops,
)
from tests.learners.matching import compare, compare_with_step, goes_on_through_files
from tests.learners.test_masks import masked_mdp
from tests.learners.worlds import corridor, random_maze, random_mdp
from tuckerl import Harmonic, Linear, QLearning, RLearning, TabularMDP, TensorStep
from tuckerl.errors import DivergenceWarning, ParameterError, ParameterTypeError, SavedFileError

PROBLEMS = {
    "one outcome": random_mdp(1),
    "stochastic": random_mdp(2, n_states=11, n_outcomes=3, random_start=True),
    "one action": random_mdp(4, n_actions=1),
    "ends at once": random_mdp(5, limit=3, ends=0.7),
    "maze": random_maze(6).to_mdp(max_episode_steps=80),
    "many actions": random_mdp(8, n_states=9, n_actions=12, limit=40),
    "masked": masked_mdp(3, n_outcomes=2),
}
NUMBERS = [(0.1, 0.01, False), (1.0, 0.5, False), (0.5, 1.0, True)]


@pytest.mark.parametrize("name", PROBLEMS)
def test_it_equals_its_twin(name: str) -> None:
    for alpha, beta, bootstrap_terminal in NUMBERS:
        parameters: dict[str, Any] = {"alpha": alpha, "beta": beta, "bootstrap_terminal": bootstrap_terminal}
        learner: Any
        learner, twins = compare(
            RLearning, PROBLEMS[name], 9, n_agents=2, gamma=1.0, epsilon=1.0, initial_q=0.25, **parameters
        )
        np.testing.assert_allclose(learner.rho, [slow.rho for slow in twins], rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("ties", ["first", "random"])
def test_greedy_actions_and_decay_equal_the_twin(ties: str) -> None:
    # Halves of whole numbers: no sum rounds.
    parameters: dict[str, Any] = {"alpha": 0.5, "beta": 0.5, "gamma": 1.0, "epsilon": 0.5, "epsilon_decay": 0.75}
    compare(RLearning, corridor(4, limit=8), 4, ties=ties, **parameters)


@pytest.mark.filterwarnings("ignore::tuckerl.errors.RankWarning")
@pytest.mark.parametrize("share", ["max", "none"])
def test_the_tensor_step_equals_its_twin(share: str) -> None:
    # A twin's average does not travel, so with sharing there is one agent.
    step = TensorStep(every=4, ranks=(3, 2, 2, 2), share=share, floor=0.1)
    n_agents = 1 if share == "max" else 3
    compare_with_step(RLearning, random_mdp(11, n_outcomes=2, limit=15), step, n_agents, gamma=1.0, beta=0.1)


@pytest.mark.filterwarnings("ignore::tuckerl.errors.RankWarning")
def test_it_goes_on_through_files(tmp_path: Path) -> None:
    goes_on_through_files(RLearning, random_mdp(31, n_states=9, n_outcomes=2), tmp_path, beta=Linear(0.5, 0.1, 10))


def test_the_average_travels_as_the_tables_do() -> None:
    def after(share: str) -> Any:
        step = TensorStep(every=5, ranks=(3, 2, 2, 2), share=share, floor=0.1)
        return RLearning(random_mdp(11, n_outcomes=2), beta=0.1, tensor_step=step, n_agents=3, seed=1).learn(5)

    apart, mean, copied = after("none"), after("mean"), after("max")
    assert len(set(apart.rho.tolist())) == 3
    np.testing.assert_allclose(mean.rho, np.full(3, apart.rho.mean()), rtol=1e-12)
    assert copied.rho.tolist() == [apart.rho[copied.tensor_step_history.chosen[0]]] * 3
    apart.rho[:] = 99.0  # a copy
    assert apart.rho.max() < 99.0


def test_a_step_by_hand() -> None:
    # It stays and is paid 1. Q: 0.5 x 1. What is left of the error, 1 - 0 + 0.5 - 0.5, moves rho: 0.25 x 1.
    problem = TabularMDP([[0]], [[1.0]], [[False]], max_episode_steps=1)
    learner = RLearning(problem, alpha=0.5, beta=0.25, seed=0).learn(1)
    assert (learner.q.item(), learner.rho.item()) == (0.5, 0.25)
    # Q: 0.5 + 0.5 x (1 - 0.25 + 0.5 - 0.5); rho: 0.25 + 0.25 x (1 - 0.25).
    learner.learn(1)
    assert (learner.q.item(), learner.rho.item()) == (0.875, 0.4375)


def test_an_end_leads_to_the_next_start() -> None:
    # 0 -> 1 -> end, which pays 4. The last step is learned from when the second episode begins, by Q(0).
    problem = TabularMDP([[1], [1]], [[0.0], [4.0]], [[False], [True]])
    learner = RLearning(problem, alpha=0.5, beta=0.25, initial_q=np.array([[2.0], [0.0]]), seed=0).learn(1)
    # Step 1: Q(0) = 2 + 0.5 x (0 - 0 + 0 - 2) = 1, rho = 0.25 x (0 + 0 - 1) = -0.25. Step 2 waits.
    assert learner.q[0, :, 0].tolist() == [1.0, 0.0]
    assert learner.rho.item() == -0.25
    learner.learn(1)
    # Q(1) = 0.5 x (4 + 0.25 + 1) = 2.625, rho = -0.25 + 0.25 x (4.25 + 1 - 2.625) = 0.40625; then step 1 again.
    assert learner.q[0, 1, 0] == 2.625
    assert learner.q[0, 0, 0] == 1.0 + 0.5 * (-0.40625 + 2.625 - 1.0)


def test_in_the_long_run_the_average_of_episodes_is_earned() -> None:
    # Seven steps of -1 and one that pays 9: 2 / 8 a step, episode after episode, if an end is no end.
    states = np.arange(8)
    problem = TabularMDP(
        np.minimum(states + 1, 7)[:, None], np.where(states == 7, 9.0, -1.0)[:, None], (states == 7)[:, None]
    )
    learner = RLearning(problem, alpha=0.5, beta=0.05, seed=0).learn(2000)
    assert learner.rho.item() == pytest.approx(0.25, abs=1e-6)
    # Relative values: each step costs 1 + 0.25, and the last one brings back what all cost.
    np.testing.assert_allclose(np.diff(learner.q[0, :, 0]), 1.25, atol=1e-6)


def test_two_loops_have_the_values_of_the_closed_form() -> None:
    learner = RLearning(two_loops(), alpha=0.5, beta=0.01, n_agents=3, seed=0).learn(300)
    np.testing.assert_allclose(learner.rho, 2.0, atol=1e-6)
    for q in learner.q:
        assert q[0, 1] - q[0, 0] == pytest.approx(5.0, abs=1e-5)  # 20 - 10 x 2 against 5 - 5 x 2
        np.testing.assert_allclose(np.diff(q[5:, 0]), 2.0, atol=1e-5)  # each step on is one of average less to come
    # Discounted returns prefer the short loop as long as gamma^5 is below 1/3, where gamma is 0.803.
    for gamma, action in ((0.79, 0), (0.81, 1)):
        table = QLearning(two_loops(), alpha=0.5, gamma=gamma, seed=0).learn(500).q[0, 0]
        assert table.argmax() == action


def test_the_access_control_queue_is_learned() -> None:
    chances, rewards, mask = queue_chances()
    gain, _, policy = best_average(chances, rewards, mask)
    assert gain == pytest.approx(average_of(policy, chances, rewards), abs=1e-9)  # two ways to solve it
    problem = access_control(10_000)
    learner = RLearning(problem, alpha=Harmonic(0.05, 10), beta=Harmonic(0.002, 10), n_agents=4, seed=0).learn(30)
    assert learner.rho.mean() == pytest.approx(gain, rel=0.02)
    for q in learner.q:
        learned = np.where(mask, q, -np.inf).argmax(axis=1)
        assert average_of(learned, chances, rewards) > 0.985 * gain
    # More is accepted the higher the priority is, and the more servers are free (the book's figure 10.5).
    mean = np.where(mask, learner.q.mean(axis=0), -np.inf)
    accepts = (mean.argmax(axis=1) == ACCEPT).reshape(11, 4)
    assert (np.diff(accepts.sum(axis=0)) >= 0).all()
    assert accepts[1:, 2:].mean() > 0.9
    assert not accepts[:3, :2].any()
    assert accepts[8:, 1:].all()


def test_gamma_is_refused_and_stays_refused() -> None:
    learner = RLearning(random_mdp(1), seed=0)
    assert learner.gamma == 1.0
    message = (
        r"gamma of RLearning must be 1, as it maximises the average reward and has no discount; got 0.9: leave gamma"
    )
    with pytest.raises(ParameterError, match=message):
        learner.gamma = 0.9
    with pytest.raises(ParameterError, match=message):
        RLearning(random_mdp(1), gamma=0.9)
    assert learner.gamma == 1.0


@pytest.mark.parametrize(
    ("parameters", "error", "message"),
    [
        ({"beta": 0.0}, ParameterError, r"beta must be a number in \(0, 1\]; got 0.0"),
        ({"beta": 1.5}, ParameterError, r"beta must be a number in \(0, 1\]; got 1.5"),
        ({"beta": "slow"}, ParameterTypeError, "beta must be a number.*; got 'slow'"),
        ({"beta": Linear(0.1, 0.0, 5)}, ParameterError, "beta must stay above 0 in all episodes"),
        ({"gamma": "none"}, ParameterTypeError, r"gamma must be a number in \[0, 1\]; got 'none'"),
        ({"rho": 1.0}, ParameterTypeError, "RLearning has no parameter 'rho'"),
    ],
)
def test_bad_input_is_said(parameters: dict[str, Any], error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        RLearning(random_mdp(1), **parameters)


def test_a_file_must_hold_a_finite_average(tmp_path: Path) -> None:
    learner = RLearning(random_mdp(1), seed=0).learn(3)
    learner.declared[0]["rho"][0] = np.inf
    with pytest.raises(SavedFileError, match="the average reward of R-learning, and the reward that waits, must be"):
        learner.save(tmp_path / "learner")


def test_divergence_stops_learning() -> None:
    problem = TabularMDP([[0, 0]], [[1e308, 1e308]], [[False, False]], max_episode_steps=50)
    with pytest.warns(DivergenceWarning, match="not finite any more in episode 0"):
        RLearning(problem, alpha=1.0, seed=0).learn(5)
