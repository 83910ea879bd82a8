"""From observations as environments give them to actions as they take them; and greedy episodes."""

from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces

from tests.adapters.parallel_worlds import Dice, MaskedInObservation, Unequal
from tests.learners.stepped_worlds import TableEnv
from tests.learners.worlds import corridor, random_mdp
from tuckerl import JointEnv, Linear, QLearning, TabularMDP, TeamQ
from tuckerl.errors import ObservationError, ParameterTypeError, ProblemError
from tuckerl.training.evaluation import mean_interval


class Signs(gymnasium.Env[Any, Any]):
    """Observes two signs by a Dict, moves by a MultiDiscrete; each episode is one step that pays nothing."""

    observation_space = spaces.Dict({"a": spaces.Discrete(2, start=-1), "b": spaces.MultiBinary(2)})
    action_space = spaces.MultiDiscrete([2, 3], start=[0, -1])

    def reset(self, *, seed: int | None = None, options: Any = None) -> Any:
        return {"a": 0, "b": np.array([1, 0], dtype=np.int8)}, {}

    def step(self, action: Any) -> Any:
        return {"a": -1, "b": np.array([0, 0], dtype=np.int8)}, 0.0, True, False, {}


def with_table(learner: Any, table: Any) -> Any:
    learner._state.q[0] = table
    return learner


def test_observations_and_actions_are_the_environments_own() -> None:
    # States: a + 1 is the first digit, b the two others; actions: 3 x first + (second + 1).
    table = np.zeros((8, 6))
    table[6, 5] = table[0, 1] = 1.0
    learner = with_table(QLearning(Signs(), seed=0), table)
    action, nothing = learner.predict({"a": 0, "b": np.array([1, 0])})
    assert (action.tolist(), nothing) == ([1, 1], None)
    assert action in Signs.action_space
    assert learner.predict({"a": -1, "b": [0, 0]})[0].tolist() == [0, 0]
    batch = {"a": np.array([0, -1, -1]), "b": np.array([[1, 0], [0, 0], [1, 1]])}
    assert learner.predict(batch)[0].tolist() == [[1, 1], [0, 0], [0, -1]]
    with pytest.raises(ObservationError, match="observation"):
        learner.predict({"a": 5, "b": [0, 0]})


def test_one_and_many_agree_on_every_state() -> None:
    mdp = random_mdp(3)
    extracted, in_python = QLearning(mdp, seed=1).learn(9), QLearning(TableEnv(mdp), seed=1)
    in_python._state.q[:] = extracted.q
    states = np.arange(7)
    expected = extracted.q[0].argmax(axis=1)
    for learner in (extracted, in_python):
        assert [learner.predict(int(state))[0] for state in states] == expected.tolist()
        np.testing.assert_array_equal(learner.predict(states)[0], expected)
        assert learner.predict(np.zeros(0, dtype=np.int64))[0].shape == (0,)


def test_random_predictions_follow_the_schedule() -> None:
    learner = with_table(
        QLearning(TableEnv(corridor()), epsilon=Linear(1.0, 0.0, episodes=4), seed=0), [[0.0, 1.0]] * 5
    )
    states = np.zeros(4000, dtype=np.int64)
    for expected in (0.5, 0.375):
        lazy = (learner.predict(states, deterministic=False)[0] == 0).mean()
        assert abs(lazy - expected) < 0.04
        learner.learn(1)
        learner._state.q[0] = [[0.0, 1.0]] * 5
    learner.learn(3)
    learner._state.q[0] = [[0.0, 1.0]] * 5
    assert (learner.predict(states, deterministic=False)[0] == 1).all()


def test_teams_take_joint_observations_as_dicts_and_tuples() -> None:
    table = np.zeros((16, 24))
    table[2 * 4 + 1, 1 * 8 + 6] = 1.0  # scout sees 1 (its third), the carrier 01; scout chooses 0, the carrier 1, 2
    team = with_table(TeamQ(Unequal(), seed=0), table)
    seen = {"scout": 1, "carrier": np.array([0, 1])}
    joint = team.predict(seen)[0]
    assert joint["scout"] == 0
    assert joint["carrier"].tolist() == [1, 2]
    first, second = team.predict((1, np.array([0, 1])))[0]
    assert (first, second.tolist()) == (0, [1, 2])
    with pytest.raises(ObservationError, match="must have one of each agent, scout, carrier; carrier has none"):
        team.predict({"scout": 1})


def test_teams_take_observations_with_masks_in_them() -> None:
    team = TeamQ(MaskedInObservation(), seed=0, epsilon=0.5).learn(30)
    observations = MaskedInObservation().reset()[0]
    actions = team.predict(observations)[0]
    assert actions["first"] != 0
    assert actions["second"] != 1
    assert team.returns.min() >= 0


def test_actions_of_teams_in_a_batch() -> None:
    team = TeamQ(JointEnv(Dice()), seed=0).learn(3)
    batch = (np.array([0, 3, 5]), np.array([1, 1, 0]))
    rows = [team.predict((int(a), int(b)))[0] for a, b in zip(*batch, strict=True)]
    left, right = team.predict(batch)[0]
    assert list(zip(left.tolist(), right.tolist(), strict=True)) == rows
    by_agent = team.predict({"left": batch[0], "right": batch[1]})[0]
    assert (by_agent["left"].tolist(), by_agent["right"].tolist()) == (left.tolist(), right.tolist())


# Greedy episodes


def test_greedy_episodes_are_those_of_the_policy() -> None:
    for env in (corridor(), TableEnv(corridor())):
        learner = with_table(QLearning(env, seed=0, epsilon=1.0), [[0.0, 1.0]] * 5)
        before = learner.q
        evaluation = learner.evaluate(7)
        assert evaluation.steps.tolist() == [[5]] * 7
        assert evaluation.returns.tolist() == [[-5.0]] * 7
        assert (evaluation.mean, evaluation.low, evaluation.high) == (-5.0, -5.0, -5.0)
        np.testing.assert_array_equal(learner.q, before)
        assert learner.episodes == 0


@pytest.mark.parametrize("in_python", [False, True])
def test_evaluating_changes_nothing_and_repeats_itself(in_python: bool) -> None:
    mdp = random_mdp(4, n_outcomes=3, random_start=True)
    looked, other = (QLearning(TableEnv(mdp) if in_python else mdp, seed=2, n_agents=2) for _ in range(2))
    evaluations = []
    for _ in range(3):
        looked.learn(4)
        evaluations.append(looked.evaluate(5))
        np.testing.assert_array_equal(looked.evaluate(5).returns, evaluations[-1].returns)
        other.learn(4)
    np.testing.assert_array_equal(looked.q, other.q)
    np.testing.assert_array_equal(looked.returns, other.returns)
    assert (looked.evaluate(5, seed=1).returns != looked.evaluate(5, seed=2).returns).any()
    np.testing.assert_array_equal(looked.evaluate(5, seed=1).returns, looked.evaluate(5, seed=1).returns)


def test_environments_made_for_an_evaluation_are_closed() -> None:
    made: list[Any] = []

    class Closes(TableEnv):
        closed = 0

        def __init__(self) -> None:
            super().__init__(corridor())
            made.append(self)

        def close(self) -> None:
            self.closed += 1

    learner = QLearning(Closes, seed=0).learn(1)
    learner.evaluate(2)
    assert [env.closed for env in made] == [0] + [1] * (len(made) - 1)


def test_the_mean_of_an_evaluation_lies_in_its_interval() -> None:
    mdp = random_mdp(4, n_outcomes=3, random_start=True)
    evaluation = QLearning(mdp, seed=2).learn(50).evaluate(60)
    assert evaluation.low < evaluation.mean < evaluation.high
    assert evaluation.mean == pytest.approx(evaluation.returns.mean())


def test_intervals_cover_the_mean_as_often_as_they_say() -> None:
    rng = np.random.default_rng(0)
    covered = 0
    for _ in range(60):
        low, high = mean_interval(rng.normal(3.0, 2.0, size=40), rng)
        covered += low <= 3.0 <= high
    assert covered >= 51, "57 are expected; fewer than 51 would come once in ten thousand times"
    assert all(np.isnan(mean_interval(np.array([1.0]), rng)))
    assert mean_interval(np.array([0.0, 1.0]), rng) == (0.0, 1.0)


def test_an_environment_that_cannot_be_copied_is_not_evaluated() -> None:
    class Alone(TableEnv):
        def __deepcopy__(self, memo: Any) -> Any:
            raise TypeError("one of a kind")

    with pytest.raises(ProblemError, match=r"Alone cannot be copied .*one of a kind"):
        QLearning(Alone(TabularMDP([[0]], [[1.0]], [[True]])), seed=0).evaluate(3)


def test_a_team_on_a_table_of_its_own_says_what_it_observes() -> None:
    table = TabularMDP([[0] * 4], [[0.0] * 4], [[True] * 4], action_sizes=(2, 2))
    with pytest.raises(
        ParameterTypeError, match=r"a state's number; got .*env\.state\(\), or learn with compiled=False"
    ):
        TeamQ(table, seed=0).predict({"robot_0": 168, "robot_1": 189})
