"""Expected SARSA, Double Q-learning, n-step SARSA, tree backup, Monte Carlo: the book's results, files, bad input."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.learners.textbook import maximisation_bias, random_walk, there_and_back
from tests.learners.waiting import VARIANTS
from tests.learners.worlds import random_mdp
from tests.training.test_going_on import Disturbed, Interrupts, assert_all_same, fail, learned, press_twice
from tests.training.test_resume import assert_same
from tuckerl import (
    UCB,
    DoubleQLearning,
    EpsilonGreedy,
    ExpectedSarsa,
    Greedy,
    Harmonic,
    MonteCarlo,
    NStepSarsa,
    QLearning,
    Sarsa,
    Softmax,
    TabularMDP,
    TensorStep,
    TreeBackup,
)
from tuckerl.errors import ParameterError, ParameterTypeError, SavedFileError, UnknownNameError
from tuckerl.learners import monte_carlo
from tuckerl.training.policies.policy import Policy

MDP = random_mdp(31, n_states=9, n_outcomes=2, random_start=True)
STEP = TensorStep(every=5, ranks=(3, 2, 2, 2), weights="none", share="random")

pytestmark = pytest.mark.filterwarnings("ignore::tuckerl.errors.RankWarning")


def test_one_step_ahead_they_are_the_one_step_algorithms() -> None:
    forced: dict[str, Any] = {"epsilon": 1.0, "alpha": 0.3, "seed": 2}
    sarsa, n_step = (made.learn(20).q for made in (Sarsa(MDP, **forced), NStepSarsa(MDP, n=1, **forced)))
    np.testing.assert_array_equal(n_step, sarsa)
    targets: list[tuple[Any, Any]] = [(QLearning, "greedy"), (ExpectedSarsa, "policy")]
    for made, target in targets:
        tree = TreeBackup(MDP, n=1, target=target, **forced).learn(1)  # then it draws an action more
        np.testing.assert_allclose(tree.q, made(MDP, **forced).learn(1).q, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize(
    "policy",
    [EpsilonGreedy(0.3), Softmax(0.5), *(pytest.param(one, marks=pytest.mark.long) for one in (Greedy(), UCB(1.0)))],
    ids=repr,
)
@pytest.mark.parametrize("allowed", [(True, True, True), (False, True, True)])
def test_the_expectation_is_over_any_policys_own_probabilities(policy: Policy, allowed: tuple[bool, ...]) -> None:
    # One step, from state 0 to state 1, whose values are known: two of them tie.
    first = np.array([[0.0, 0.0, 0.0], [4.0, 1.0, 1.0]])
    nowhere = np.zeros((2, 3))
    problem = TabularMDP(
        np.ones((2, 3), int), nowhere, nowhere > 0, action_mask=[(True,) * 3, allowed], max_episode_steps=1
    )
    learner = ExpectedSarsa(problem, policy=policy, alpha=1.0, gamma=0.5, initial_q=first, seed=0).learn(1)
    best = np.where(first[1] == first[1][list(allowed)].max(), allowed, 0.0)
    weights = {
        Greedy: best,
        EpsilonGreedy: 0.7 * best / best.sum() + 0.3 * np.array(allowed) / sum(allowed),
        Softmax: np.where(allowed, np.exp(first[1] / 0.5), 0.0),
        UCB: np.where(allowed, 1.0, 0.0),  # nothing there was chosen so far
    }
    chances = weights[type(policy)] / weights[type(policy)].sum()
    (changed,) = np.flatnonzero(learner.q[0, 0])
    np.testing.assert_allclose(learner.q[0, 0, changed], 0.5 * chances @ first[1], rtol=1e-12)


@pytest.mark.parametrize(
    ("visits", "alpha", "expected"),
    [
        ("first", None, (2.5, 3.0)),
        ("every", None, (2.25, 2.5)),
        ("first", 0.5, (1.25, 1.5)),
        ("every", 0.5, (1.75, 2.0)),  # the last visit first
    ],
)
def test_returns_by_hand(visits: Any, alpha: float | None, expected: tuple[float, float]) -> None:
    # Rewards 1, 2, 1, 2 and nothing bootstrapped, as all values are 0: returns 2.5, 3, 2, 2.
    learner = MonteCarlo(there_and_back(), visits=visits, alpha=alpha, gamma=0.5, seed=0).learn(1)
    assert tuple(learner.q[0, :, 0]) == expected


def test_an_episode_without_room_is_learned_in_pieces(monkeypatch: pytest.MonkeyPatch) -> None:
    # Of two steps: returns 2, 2; then, as state 0 is worth 2, 1 + (2 + 1) / 2 and 2 + 1.
    monkeypatch.setattr(monte_carlo, "MOST_STEPS", 2)
    learner = MonteCarlo(there_and_back(), gamma=0.5, seed=0).learn(1)
    assert tuple(learner.q[0, :, 0]) == (2.25, 2.5)


@pytest.mark.parametrize(
    ("made", "own"),
    [
        (MonteCarlo, {}),
        (MonteCarlo, {"visits": "every"}),
        (NStepSarsa, {"n": 3, "alpha": Harmonic(0.5, half_after=20)}),
        (ExpectedSarsa, {"alpha": Harmonic(0.5, half_after=20)}),
    ],
)
def test_the_random_walk_has_known_values(made: Any, own: dict[str, Any]) -> None:
    learner = made(random_walk(5), gamma=1.0, n_agents=20, seed=1, **own).learn(300)
    np.testing.assert_allclose(learner.q[:, :, 0].mean(axis=0), np.arange(1, 6) / 6, atol=0.02)


@pytest.mark.compiled  # interpreted, it would take long
def test_the_error_of_the_random_walk_is_least_for_some_steps_ahead() -> None:
    # Figure 7.2: RMS errors of the first ten episodes, by n and alpha; each line has its own minimum.
    walk, true = random_walk(19, left=-1.0), np.arange(-9, 10) / 10
    errors = {}
    for n in (1, 4, 32):
        for alpha in (0.1, 0.4, 0.9):
            learner = NStepSarsa(walk, n=n, alpha=alpha, gamma=1.0, n_agents=30, seed=1)
            each = [np.sqrt(((learner.learn(1).q[:, :, 0] - true) ** 2).mean(axis=1)).mean() for _ in range(10)]
            errors[n, alpha] = float(np.mean(each))
    least = {n: min((errors[n, alpha], alpha) for alpha in (0.1, 0.4, 0.9)) for n in (1, 4, 32)}
    assert least[4][0] < least[1][0] - 0.03
    assert least[4][0] < least[32][0] - 0.03
    assert (least[1][1], least[4][1], least[32][1]) == (0.9, 0.4, 0.1)


@pytest.mark.compiled  # interpreted, it would take long
def test_by_the_cliff_the_greedy_path_is_short_and_the_careful_one_pays() -> None:
    # Example 6.6 and figure 6.3, epsilon 0.1.
    parameters: dict[str, Any] = {"alpha": 0.5, "gamma": 1.0, "epsilon": 0.1, "n_agents": 10, "seed": 0}
    learners = {made: made("CliffWalking-v1", **parameters).learn(400) for made in (QLearning, Sarsa, ExpectedSarsa)}
    online = {made: learner.returns[-100:].mean() for made, learner in learners.items()}
    assert (learners[QLearning].evaluate(1).returns == -13.0).all()
    assert learners[ExpectedSarsa].evaluate(1).returns.max() < -13.0  # it keeps away from the edge
    assert online[QLearning] < online[Sarsa] - 10 < online[ExpectedSarsa] - 10


@pytest.mark.compiled  # interpreted, it would take long
def test_the_largest_of_noisy_values_misleads_one_table_and_not_two() -> None:
    # Example 6.7: the best share of left is 5 %.
    left = {}
    for made in (QLearning, DoubleQLearning):
        agents = made(maximisation_bias(), alpha=0.1, gamma=1.0, epsilon=0.1, n_agents=300, seed=0).learn(120)
        left[made] = (agents.steps == 2).mean(axis=1)
    assert left[QLearning][10:30].mean() > 0.8
    assert left[QLearning][80:].mean() > 0.35
    assert left[DoubleQLearning].max() < 0.65  # about half at first, by chance
    assert left[DoubleQLearning][80:].mean() < 0.15


@pytest.mark.parametrize("variant", ["expected", "double", "5-step", "tree 3", "first visits"])
def test_pieces_through_files_equal_the_whole(variant: str, tmp_path: Path) -> None:
    made, own = VARIANTS[variant]
    parameters: dict[str, Any] = {"epsilon": 0.4, "n_agents": 3, "tensor_step": STEP, "seed": 6} | own
    whole, pieces = made(MDP, **parameters).learn(14), made(MDP, **parameters)
    for piece in (3, 4, 7):
        pieces.save(tmp_path / "agent")
        pieces = made.load(tmp_path / "agent").learn(piece)
    assert_same(pieces, whole)
    assert_all_same(pieces, whole, tmp_path)


@pytest.mark.parametrize("total", [100.0, np.nan])
def test_a_file_in_which_rewards_of_no_episode_wait_is_refused(total: float) -> None:
    learner = NStepSarsa(MDP, seed=0).learn(2)
    held = learner.declared[0]
    learner.check_declared(held)
    with pytest.raises(SavedFileError, match="the sum of their rewards must be 0"):
        learner.check_declared(held | {"block": np.array([total])})


@pytest.mark.parametrize("does", [fail, press_twice])
@pytest.mark.parametrize(
    "variant", ["5-step", "first visits", *(pytest.param(one, marks=pytest.mark.long) for one in ("double", "tree 3"))]
)
def test_what_is_broken_off_has_never_been(variant: str, does: Any, tmp_path: Path) -> None:
    made, own = VARIANTS[variant]
    parameters: dict[str, Any] = {"seed": 3, "epsilon": 0.4, "initial_q": 0.5} | own
    whole = made(lambda: Disturbed(Interrupts(None)), **parameters).learn(12)
    disturb = Interrupts(does, 1, 7, 8, 40, 77, 78)
    learner, n_stops = learned(made(lambda: Disturbed(disturb), **parameters), 12)
    assert n_stops >= 4
    assert_all_same(learner, whole, tmp_path)
    record = learner.declared[0]["steps"]
    assert not record.cursor.any()
    assert record.to_arrays() == {}


@pytest.mark.parametrize("share", ["max", "mean"])
def test_both_tables_are_shared_as_their_mean_is(share: str) -> None:
    step = TensorStep(every=5, ranks=(3, 2, 2, 2), share=share)
    learner = DoubleQLearning(MDP, n_agents=3, tensor_step=step, seed=0).learn(5)
    first, second = (np.stack([held[name] for held in learner.declared]) for name in ("first", "second"))
    np.testing.assert_allclose(learner.q, 0.5 * first + 0.5 * second, rtol=1e-12, atol=1e-15)
    for table in (first, second, learner.q):
        assert (table == table[0]).all()
    assert (first != second).any()


def test_counts_of_returns_go_along_with_a_copy() -> None:
    step = TensorStep(every=5, ranks=(3, 2, 2, 2), weights="none", share="max")
    learner = MonteCarlo(MDP, n_agents=3, tensor_step=step, seed=0).learn(5)
    chosen = int(learner.tensor_step_history.chosen[0])
    alone = MonteCarlo(MDP, n_agents=3, seed=0).learn(5)
    for held in learner.declared:
        np.testing.assert_array_equal(held["n_returns"], alone.declared[chosen]["n_returns"])


def test_how_far_ahead_can_change() -> None:
    learner = NStepSarsa(MDP, n=2, epsilon=1.0, seed=0).learn(5)
    learner.n = 7
    learner.learn(5)
    other = NStepSarsa(MDP, n=7, epsilon=1.0, seed=0).learn(10)
    assert learner.steps.tolist() == other.steps.tolist()
    assert learner.n == 7
    assert learner.declared[0]["steps"].ring.size == 7
    learner = NStepSarsa(MDP, n=2, gamma=0.9, epsilon=1.0, seed=0)
    learner.n, learner.gamma = 3, 0.5  # before the first episode
    fresh = NStepSarsa(MDP, n=3, gamma=0.5, epsilon=1.0, seed=0).learn(5)
    np.testing.assert_array_equal(learner.learn(5).q, fresh.q)


def test_means_have_no_step_size_and_a_number_has() -> None:
    learner = MonteCarlo(MDP, seed=0)
    assert learner.alpha is None
    assert learner.learn(3).parameters["alpha"] is None
    learner.alpha = 0.5
    assert learner.learn(3).scheduled("alpha").tolist() == [1.0, 1.0, 1.0, 0.5, 0.5, 0.5]
    step = TensorStep(every=5, ranks=(3, 2, 2, 2))
    with pytest.raises(ParameterError, match=r'weights="none": values that are means .*alpha=0.1 would be one\); got'):
        MonteCarlo(MDP, tensor_step=step)
    assert (MonteCarlo(MDP, alpha=0.1, tensor_step=step, seed=0).learn(5).action_weights != 1.0).any()


@pytest.mark.parametrize(
    ("made", "parameters", "error", "message"),
    [
        (NStepSarsa, {"n": 0}, ParameterError, "n must be a whole number from 1 to 1000000; got 0"),
        (NStepSarsa, {"n": 2_000_000}, ParameterError, "n must be a whole number from 1 to 1000000; got 2000000"),
        (NStepSarsa, {"n": 1.5}, ParameterTypeError, "n must be a whole number"),
        (NStepSarsa, {"alpha": None}, ParameterTypeError, "alpha must be"),
        (TreeBackup, {"n": -1}, ParameterError, "n must be a whole number from 1 to 1000000; got -1"),
        (TreeBackup, {"target": "best"}, UnknownNameError, "unknown target 'best': use one of greedy, policy"),
        (MonteCarlo, {"visits": "last"}, UnknownNameError, "unknown visits 'last': use one of every, first"),
        (MonteCarlo, {"alpha": 0.0}, ParameterError, "alpha must be"),
        (MonteCarlo, {"n": 3}, ParameterTypeError, "MonteCarlo has no parameter 'n'"),
        (ExpectedSarsa, {"alpha": None}, ParameterTypeError, "alpha must be"),
    ],
)
def test_bad_input_is_refused(made: Any, parameters: dict[str, Any], error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        made(MDP, **parameters)
