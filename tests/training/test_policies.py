"""Policies draw what they say that they draw, for learning, predictions and evaluations alike, and go into files."""

import copy
import math
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from scipy.stats import chisquare

from tests.learners.worlds import agent_of, corridor, random_maze, random_mdp, world_of
from tests.reference.policies import SoftmaxLearner, UCBLearner
from tests.reference.rng import Stream
from tests.training.test_resume import LEARNERS, assert_same
from tuckerl import DynaH, Linear, QLearning, Sarsa, TabularMDP, TeamQ, TensorStep, kernel
from tuckerl.errors import ParameterError, ParameterTypeError
from tuckerl.generalization.change_log import record_change
from tuckerl.learners.team_policy import TeamEpsilonGreedy
from tuckerl.training.agent_arrays import AgentArrays, Transition
from tuckerl.training.algorithm import register_algorithm
from tuckerl.training.declared_state import Declaration, DeclaredArray
from tuckerl.training.learner import Learner
from tuckerl.training.policies import POLICIES, policy_class
from tuckerl.training.policies.epsilon_greedy import EpsilonGreedy
from tuckerl.training.policies.greedy import Greedy
from tuckerl.training.policies.own_distribution import OwnDistribution
from tuckerl.training.policies.policy import Policy, choose, write_probabilities
from tuckerl.training.policies.softmax import Softmax
from tuckerl.training.policies.ucb import UCB
from tuckerl.types import BoolArray, FloatArray

TABLE = np.array([[9.0] * 6, [2.0, 0.0, 2.0, 1.0, 2.0, 0.0]])  # in state 1, three actions are greedy
FREE = None
MASK = np.array([[True] * 6, [True, True, False, False, True, True]])  # of a team, too: its first agent may not do 1
STATE = {"chances": np.array([[1 / 6] * 6, [0.1, 0.0, 0.2, 0.3, 0.4, 0.0]])}
NOTHING = {"chances": np.array([[1 / 6] * 6, [0.0, 0.0, 1.0, 0.0, 0.0, 0.0]])}  # but for what the mask forbids

CASES: dict[str, tuple[Policy, Mapping[str, Any]]] = {
    "Greedy": (Greedy(), {}),
    "EpsilonGreedy": (EpsilonGreedy(0.3), {}),
    "EpsilonGreedy, never": (EpsilonGreedy(0.0), {}),
    "EpsilonGreedy, always": (EpsilonGreedy(1.0), {}),
    "OwnDistribution": (OwnDistribution("chances"), STATE),
    "OwnDistribution, explored": (OwnDistribution("chances", 0.3), STATE),
    "OwnDistribution, of what is forbidden": (OwnDistribution("chances", 0.3), NOTHING),
    "Softmax": (Softmax(2.0), {}),
    "Softmax, cold": (Softmax(1e-300), {}),
    "UCB": (UCB(1.5), {"ucb.choices": np.array([[1] * 6, [9, 3, 8, 0, 2, 2]])}),
    "UCB, all untried": (UCB(1.5), {"ucb.choices": np.zeros((2, 6), dtype=np.int64)}),
    "a team": (TeamEpsilonGreedy(EpsilonGreedy(0.3), (3, 2)), {}),
    "a team, never": (TeamEpsilonGreedy(EpsilonGreedy(0.0), (3, 2)), {}),
    "a team, always": (TeamEpsilonGreedy(EpsilonGreedy(1.0), (3, 2)), {}),
    "a team of three": (TeamEpsilonGreedy(EpsilonGreedy(0.5), (3, 1, 2)), {}),
}
DRAWS = 6000
SOFT = np.exp([0.0, -1.0, 0.0, -0.5, 0.0, -1.0])  # e^((Q - 2) / 2) in state 1


def acting(name: str, action_mask: BoolArray | None, ties: str) -> AgentArrays:
    policy, state = CASES[name]
    scheduled = np.array([schedule.values(1)[0] for schedule in policy.schedules().values()])
    arrays = policy.arrays(scheduled, copy.deepcopy(state))
    return agent_of(TABLE.copy(), policy=arrays, action_mask=action_mask, random_ties=ties == "random", seed=2)


def probabilities_of(agent: AgentArrays, state: int = 1) -> FloatArray:
    out = np.full(6, np.nan)
    write_probabilities(agent.policy, agent, state, out)
    return out


def test_every_shipped_policy_is_among_the_cases() -> None:
    assert {type(policy).__name__ for policy, _ in CASES.values()} == {*POLICIES, "TeamEpsilonGreedy"}


@pytest.mark.parametrize("ties", ["first", "random"])
@pytest.mark.parametrize("action_mask", [FREE, MASK], ids=["free", "masked"])
@pytest.mark.parametrize("name", CASES)
def test_what_is_drawn_agrees_with_the_probabilities(name: str, action_mask: BoolArray | None, ties: str) -> None:
    agent = acting(name, action_mask, ties)
    probabilities = probabilities_of(agent)
    assert probabilities.sum() == pytest.approx(1.0, abs=1e-12)
    assert (probabilities >= 0).all()
    if action_mask is not None:
        assert (probabilities[~action_mask[1]] == 0).all()
    # Each time as if for the first time: some policies count what they choose.
    counts = np.bincount([choose(copy.deepcopy(agent.policy), agent, 1) for _ in range(DRAWS)], minlength=6)
    possible = probabilities > 0
    assert not counts[~possible].any()
    if possible.sum() > 1:
        expected = DRAWS * probabilities[possible] / probabilities.sum()
        assert chisquare(counts[possible], expected).pvalue > 1e-3


@pytest.mark.parametrize(
    ("name", "action_mask", "ties", "expected"),
    [
        ("Greedy", FREE, "first", [1, 0, 0, 0, 0, 0]),
        ("Greedy", FREE, "random", [1 / 3, 0, 1 / 3, 0, 1 / 3, 0]),
        ("Greedy", MASK, "random", [1 / 2, 0, 0, 0, 1 / 2, 0]),
        ("EpsilonGreedy", FREE, "first", [0.75, 0.05, 0.05, 0.05, 0.05, 0.05]),
        ("EpsilonGreedy", MASK, "random", [0.425, 0.075, 0, 0, 0.425, 0.075]),
        ("OwnDistribution", FREE, "random", [0.1, 0, 0.2, 0.3, 0.4, 0]),
        ("OwnDistribution", MASK, "random", [0.2, 0, 0, 0, 0.8, 0]),
        ("OwnDistribution, explored", MASK, "random", [0.215, 0.075, 0, 0, 0.635, 0.075]),
        ("OwnDistribution, of what is forbidden", MASK, "random", [0.25, 0.25, 0, 0, 0.25, 0.25]),
        ("Softmax", FREE, "first", SOFT / SOFT.sum()),
        ("Softmax", MASK, "random", SOFT * MASK[1] / SOFT[MASK[1]].sum()),
        ("Softmax, cold", FREE, "first", [1 / 3, 0, 1 / 3, 0, 1 / 3, 0]),
        ("UCB", FREE, "random", [0, 0, 0, 1, 0, 0]),  # action 3 was never chosen
        # Of the others, n is 9, 3, 2, 2 and t is 17: 2 + 1.5 sqrt(ln 17 / 2) = 3.79 is the most, of action 4.
        ("UCB", MASK, "random", [0, 0, 0, 0, 1, 0]),
        ("UCB, all untried", MASK, "random", [1 / 4, 1 / 4, 0, 0, 1 / 4, 1 / 4]),
        ("UCB, all untried", MASK, "first", [1, 0, 0, 0, 0, 0]),
        # An agent of the team plays its greedy part with 0.7 + 0.3 / size: 0.8 of three, 0.85 of two.
        ("a team", FREE, "first", [0.8 * 0.85, 0.8 * 0.15, 0.1 * 0.85, 0.1 * 0.15, 0.1 * 0.85, 0.1 * 0.15]),
        # Greedy are (0, 0) and (2, 0), and the first agent may do 0 and 2 only.
        ("a team", MASK, "random", [0.5 * 0.85, 0.5 * 0.15, 0, 0, 0.5 * 0.85, 0.5 * 0.15]),
    ],
)
def test_probabilities_by_hand(name: str, action_mask: BoolArray | None, ties: str, expected: Any) -> None:
    np.testing.assert_allclose(probabilities_of(acting(name, action_mask, ties)), expected, rtol=1e-12, atol=0)


# What a learner takes, and how it learns


@pytest.mark.parametrize("given", [{"epsilon": 0.2}, {"epsilon_decay": 0.5}, {"epsilon": Linear(1.0, 0.0, episodes=3)}])
def test_a_policy_and_epsilon_together_are_refused(given: Any) -> None:
    with pytest.raises(
        ParameterError,
        match=r"epsilon belongs to the default policy: leave it out, or leave out policy=EpsilonGreedy\(",
    ):
        QLearning(corridor(), policy=EpsilonGreedy(0.1), **given)


@pytest.mark.parametrize("given", ["greedy", Greedy, 0.1])
def test_what_is_no_policy_is_refused(given: Any) -> None:
    with pytest.raises(ParameterTypeError, match=r"policy must be a policy such as tuckerl.EpsilonGreedy\(0.1\); got "):
        QLearning(corridor(), policy=given)


@pytest.mark.parametrize(
    ("made", "error", "message"),
    [
        (lambda: EpsilonGreedy(1.5), ParameterError, r"epsilon must be a number in \[0, 1\]; got 1.5"),
        (lambda: EpsilonGreedy("much"), ParameterTypeError, "epsilon must be .* got 'much'"),  # type: ignore[arg-type]  # wrong on purpose
        (lambda: EpsilonGreedy(Linear(1, 0, 5), 0.5), ParameterError, "epsilon is a schedule already"),
        (lambda: Softmax(0.0), ParameterError, "temperature must be a finite number above 0; got 0.0"),
        (lambda: Softmax(-1.0), ParameterError, "temperature must be a finite number above 0; got -1.0"),
        (lambda: Softmax(Linear(9, 0, 5)), ParameterError, "temperature must stay above 0 in all episodes; Linear"),
        (lambda: UCB(-0.1), ParameterError, "c must be a finite number of at least 0; got -0.1"),
        (lambda: UCB(math.inf), ParameterError, "c must be a finite number of at least 0; got inf"),
        (lambda: OwnDistribution("chances", -1.0), ParameterError, r"epsilon must be a number in \[0, 1\]; got -1.0"),
    ],
)
def test_numbers_of_policies_are_checked(made: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        made()


@pytest.mark.parametrize("learner", LEARNERS)
@pytest.mark.parametrize("epsilon", [0.3, Linear(1.0, 0.1, episodes=8)])
def test_epsilon_is_the_short_way_to_the_default_policy(learner: Any, epsilon: Any) -> None:
    problem = random_mdp(7, n_actions=6, action_sizes=(3, 2))
    short = learner(problem, epsilon=epsilon, n_agents=2, seed=3).learn(15)
    long = learner(problem, policy=EpsilonGreedy(epsilon), n_agents=2, seed=3).learn(15)
    np.testing.assert_array_equal(long.q, short.q)
    np.testing.assert_array_equal(long.scheduled("epsilon"), short.scheduled("epsilon"))
    decayed = learner(problem, epsilon=0.5, epsilon_decay=0.9, seed=3).learn(15)
    np.testing.assert_array_equal(learner(problem, policy=EpsilonGreedy(0.5, 0.9), seed=3).learn(15).q, decayed.q)


@pytest.mark.parametrize("learner", [LEARNERS[0], *(pytest.param(one, marks=pytest.mark.long) for one in LEARNERS[1:])])
def test_greedy_learns_as_epsilon_0_does(learner: Any) -> None:
    # Epsilon-greedy draws whether to explore even where it never does. Where nothing else is drawn, that is no matter.
    maze = random_maze(3).to_mdp(max_episode_steps=60)
    # Planning draws among the modelled actions, from the same stream.
    common: dict[str, Any] = {"planning_steps": 0} if learner is DynaH else {}
    common |= {"ties": "first", "alpha": 0.5, "n_agents": 2, "seed": 3}
    greedy = learner(maze, policy=Greedy(), **common).learn(30)
    never = learner(maze, epsilon=0.0, **common).learn(30)
    np.testing.assert_array_equal(greedy.q, never.q)
    np.testing.assert_array_equal(greedy.steps, never.steps)
    for ours, theirs in zip(greedy.trajectories, never.trajectories, strict=True):
        np.testing.assert_array_equal(ours, theirs)
    assert greedy.q.any()


@pytest.mark.parametrize(
    ("learner", "policy"),
    [
        *((learner, EpsilonGreedy(0.3, 0.9)) for learner in (QLearning, Sarsa, TeamQ)),
        (QLearning, EpsilonGreedy(Linear(0.9, 0.1, episodes=8))),
        (QLearning, Greedy()),
        (QLearning, Softmax(Linear(5.0, 0.1, episodes=8))),
        (QLearning, UCB(2.0)),
        (Sarsa, UCB(Linear(3.0, 0.0, episodes=8))),
    ],
)
def test_a_policy_goes_into_a_file(learner: Any, policy: Policy, tmp_path: Path) -> None:
    problem = random_mdp(8, n_actions=6, n_outcomes=2, action_sizes=(3, 2))
    whole = learner(problem, policy=policy, seed=2, n_agents=2).learn(12)
    part = learner(problem, policy=policy, seed=2, n_agents=2).learn(5)
    part.save(tmp_path / "agent")
    again = learner.load(tmp_path / "agent")
    assert type(again.policy) is type(policy)
    assert repr(again.policy) == repr(policy)
    assert again.epsilon is None
    assert_same(again.learn(7), whole)


class Own(Greedy):
    """A policy that no file knows."""


def test_a_policy_of_ones_own_goes_into_no_file(tmp_path: Path) -> None:
    learner = QLearning(corridor(), policy=Own(), seed=1).learn(3)
    with pytest.raises(ParameterError, match=r"only tuckerl's own policies can be saved in a file; .* is none of them"):
        learner.save(tmp_path / "agent")
    with pytest.raises(ParameterError, match="only tuckerl's own policies"):
        QLearning(corridor(), policy=type("Greedy", (Own,), {})(), seed=1).save(tmp_path / "agent")


# Softmax and upper confidence bounds

RNG = np.random.default_rng(9)
MASKED = TabularMDP(
    RNG.integers(7, size=(7, 3)),
    RNG.normal(size=(7, 3)),
    RNG.random((7, 3)) < 0.08,
    action_mask=[[True, state % 2 == 0, state % 3 > 0] for state in range(7)],
    max_episode_steps=60,
)


@pytest.mark.parametrize("problem", [random_mdp(2, n_outcomes=3), MASKED], ids=["free", "masked"])
@pytest.mark.parametrize(
    ("policy", "slow"),
    [(Softmax(0.7), partial(SoftmaxLearner, temperature=0.7)), (UCB(0.5), partial(UCBLearner, c=0.5))],
    ids=["Softmax", "UCB"],
)
def test_policies_equal_their_twins(policy: Policy, slow: Any, problem: TabularMDP) -> None:
    learner = QLearning(problem, alpha=0.3, gamma=0.9, policy=policy, n_agents=2, seed=5).learn(12)
    for agent in range(2):
        numbers = (0.3, 0.9, 0.0, 1.0, "random", np.zeros(learner.q[0].shape))
        one = slow(world_of(problem), Stream(5, agent), *numbers)
        steps = [one.episode(np.ones(problem.n_actions))[0] for _ in range(12)]
        assert learner.steps[:, agent].tolist() == steps
        assert learner.trajectories[agent].tolist() == one.trajectory
        np.testing.assert_allclose(learner.q[agent], one.q, rtol=1e-9, atol=1e-9)


def test_bounds_count_what_they_choose_and_nothing_else() -> None:
    learner = QLearning(ONE, policy=UCB(1.0), n_agents=2, seed=1).learn(40)
    for held in learner.declared:
        assert held["ucb.choices"].sum() == 40
        assert held["ucb.choices"].min() > 0
    before = copy.deepcopy(learner.declared[0]["ucb.choices"])
    learner.predict(np.zeros(50, dtype=np.int64), deterministic=False)
    learner.evaluate(50, deterministic=False)
    np.testing.assert_array_equal(learner.declared[0]["ucb.choices"], before)


def test_worse_actions_are_chosen_as_often_as_the_bounds_say() -> None:
    # Two actions that pay 0 and 1: the worse one is chosen whenever its bound, c sqrt(ln t / n), is above the other's.
    bandit = TabularMDP([[0, 0]], [[0.0, 1.0]], [[True, True]])
    for n in (500, 5000):
        learner = QLearning(bandit, alpha=1.0, policy=UCB(3.0), seed=1).learn(n)
        worse, better = learner.declared[0]["ucb.choices"][0].tolist()
        bounds = 3.0 * np.sqrt(np.log(n) / worse), 1.0 + 3.0 * np.sqrt(np.log(n) / better)
        assert bounds[0] == pytest.approx(bounds[1], rel=0.02)


@pytest.mark.parametrize("share", ["max", "mean"])
def test_counts_go_along_with_shared_tables(share: str) -> None:
    step = TensorStep(every=5, ranks=(3, 3, 3, 2), weights="none", share=share)
    learner = QLearning(random_mdp(3), policy=UCB(1.0), n_agents=3, tensor_step=step, seed=4).learn(5)
    first, *others = (held["ucb.choices"] for held in learner.declared)
    assert first.any()
    for other in others:
        np.testing.assert_array_equal(other, first)


# A learner that has a distribution of its own


class ChancesState(NamedTuple):
    """What `Chances` keeps for one agent."""

    chances: FloatArray  # (S, A)


@kernel
def update(algorithm: ChancesState, agent: AgentArrays, transition: Transition, next_action: int) -> bool:
    """Count each action that was taken, in a distribution that stays as it is otherwise."""
    chances, state = algorithm.chances, transition.state
    record_change(agent.log, state)
    for action in range(chances.shape[1]):
        chances[state, action] *= 0.9
    chances[state, transition.action] += 0.1
    agent.q[state, transition.action] += 1.0
    return True


register_algorithm(ChancesState, update=update)


class Chances(Learner):
    """Learns what it has done, and does it more often."""

    state_type = ChancesState

    def declare_state(self) -> tuple[Declaration, ...]:
        return (DeclaredArray("chances", "by_row", initial=1 / self.problem.n_actions),)

    def default_policy(self, policy: Policy) -> Policy:
        return OwnDistribution("chances", self.epsilon if self.epsilon is not None else 0.0)


ONE = TabularMDP([[0, 0, 0]], [[0.0, 1.0, 2.0]], [[True, True, True]], max_episode_steps=3)


def with_chances(chances: list[float], **parameters: Any) -> Chances:
    learner = Chances(ONE, seed=1, **parameters)
    learner.declared[0]["chances"][0] = chances
    return learner


def frequencies(learner: Learner, deterministic: bool | None) -> FloatArray:
    actions, _ = learner.predict(np.zeros(20_000, dtype=np.int64), deterministic=deterministic)
    return np.bincount(actions, minlength=3) / 20_000


def test_predictions_follow_a_distribution_of_the_learners_own() -> None:
    learner = with_chances([0.5, 0.2, 0.3], epsilon=0.3)
    np.testing.assert_allclose(frequencies(learner, None), [0.5, 0.2, 0.3], atol=0.015)
    np.testing.assert_allclose(frequencies(learner, False), [0.45, 0.24, 0.31], atol=0.015)
    assert frequencies(learner, True).tolist() == [1, 0, 0]
    learner._state.q[0, 0] = [0.0, 0.0, 9.0]  # its values are not what it acts by
    assert learner.predict(0, deterministic=True)[0] == 0
    assert {learner.predict(0)[0] for _ in range(100)} == {0, 1, 2}


class Aiming(Greedy):
    """Acts greedily, to learn what to do by the distribution."""

    def target(self) -> Policy:
        return OwnDistribution("chances")


def test_what_is_learned_is_the_target_of_a_policy() -> None:
    learner = with_chances([0.5, 0.2, 0.3], policy=Aiming())
    learner._state.q[0, 0] = [0.0, 0.0, 9.0]
    np.testing.assert_allclose(frequencies(learner, None), [0.5, 0.2, 0.3], atol=0.015)
    assert frequencies(learner, False).tolist() == [0, 0, 1]
    assert set(learner.evaluate(200).returns.ravel().tolist()) == {0.0, 1.0, 2.0}
    assert set(learner.evaluate(200, deterministic=False).returns.ravel().tolist()) == {2.0}


@pytest.mark.slow
def test_evaluations_follow_a_distribution_of_the_learners_own() -> None:
    learner = with_chances([0.5, 0.2, 0.3], epsilon=0.3)
    for deterministic, chances in ((None, [0.5, 0.2, 0.3]), (False, [0.45, 0.24, 0.31]), (True, [1, 0, 0])):
        returns = learner.evaluate(20_000, deterministic=deterministic).returns[:, 0]
        found = [(returns == reward).mean() for reward in range(3)]
        np.testing.assert_allclose(found, chances, atol=0.015)


@pytest.mark.slow
def test_learning_follows_a_distribution_of_the_learners_own(tmp_path: Path) -> None:
    learner = with_chances([0.0, 1.0, 0.0], epsilon=0.0).learn(20)
    assert learner.returns.ravel().tolist() == [1.0] * 20
    learner.save(tmp_path / "agent")
    assert_same(Chances.load(tmp_path / "agent").learn(5), learner.learn(5))
    given = Chances(ONE, policy=OwnDistribution("chances", 0.5), seed=2).learn(20)
    given.save(tmp_path / "agent")
    again = Chances.load(tmp_path / "agent")
    assert repr(again.policy) == repr(given.policy) == "OwnDistribution('chances', 0.5, 1.0)"
    assert_same(again.learn(9), given.learn(9))


def test_drawn_predictions_take_any_of_equal_actions_where_the_policy_does() -> None:
    problem = TabularMDP([[0] * 4], [[0.0] * 4], [[True] * 4], action_mask=[[True, True, False, True]])
    for ties, equal in (("random", {0, 1, 3}), ("first", {0})):
        learner = QLearning(problem, policy=Greedy(), ties=ties, seed=1)  # type: ignore[arg-type]  # a variable
        drawn, _ = learner.predict(np.zeros(200, dtype=np.int64), deterministic=False)
        assert set(drawn.tolist()) == equal
        for deterministic in (None, True):
            actions, _ = learner.predict(np.zeros(200, dtype=np.int64), deterministic=deterministic)
            assert set(actions.tolist()) == {0}


def test_drawn_predictions_follow_the_present_epsilon() -> None:
    learner = QLearning(ONE, policy=EpsilonGreedy(Linear(0.9, 0.3, episodes=2)), initial_q=[[0.0, 0.0, 1.0]], seed=1)
    np.testing.assert_allclose(frequencies(learner, False), [0.3, 0.3, 0.4], atol=0.015)
    assert frequencies(learner, None).tolist() == [0, 0, 1]
    learner.learn(2)
    learner._state.q[0, 0] = [0.0, 0.0, 1.0]
    np.testing.assert_allclose(frequencies(learner, False), [0.1, 0.1, 0.8], atol=0.015)


def test_a_policy_that_is_registered_has_a_class_of_its_name() -> None:
    for name, entry in POLICIES.items():
        assert policy_class(name).__name__ == name
        assert entry.description
