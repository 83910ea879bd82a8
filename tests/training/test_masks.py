"""The mask is law: predictions and evaluations never take what a mask forbids, wherever the mask came from."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces

from tests.adapters.parallel_worlds import Masked, MaskedInObservation, World
from tests.learners.worlds import corridor
from tuckerl import EpsilonGreedy, Greedy, OwnDistribution, QLearning, TabularMDP, TeamQ, kernel
from tuckerl.errors import ObservationError, SpaceError
from tuckerl.learners.q_learning import QLearningState
from tuckerl.training.agent_arrays import AgentArrays
from tuckerl.training.declared_state import Declaration, DeclaredArray
from tuckerl.training.policies.policy import Policy, register_policy
from tuckerl.types import FloatArray

MODES = (None, True, False)


class Alternating(World):
    """Two agents that see nothing: even actions may be taken at even times, odd ones at odd times; six steps.

    It refuses what is forbidden.
    """

    def __init__(self, n_actions: int = 4) -> None:
        seen = spaces.Dict({"observation": spaces.Discrete(3), "action_mask": spaces.MultiBinary(n_actions)})
        super().__init__(dict.fromkeys("ab", seen), dict.fromkeys("ab", spaces.Discrete(n_actions)))
        self.n_actions = n_actions

    def observe(self, agent: str) -> Any:
        return seen_at(self.clock, self.n_actions)

    def act(self, actions: dict[str, Any]) -> tuple[dict[str, float], set[str], set[str]]:
        assert all((action - self.clock + 1) % 2 == 0 for action in actions.values()), "forbidden"
        return dict.fromkeys(actions, 1.0), set(self.agents) if self.clock == 6 else set(), set()


def seen_at(clock: int, n_actions: int = 4, state: int = 0) -> dict[str, Any]:
    """Return what an agent of `Alternating` observes."""
    return {"observation": state, "action_mask": ((np.arange(n_actions) - clock) % 2 == 0).astype(np.int8)}


class Observing(gymnasium.Env[Any, Any]):
    """Observes three states, with a mask beside them where `masked`, and takes any actions; one step that pays 1."""

    def __init__(self, action_space: Any, *, masked: bool = False, n_masked: int = 0) -> None:
        self.action_space = action_space
        self.masked = np.ones(n_masked or int(getattr(action_space, "n", 1)), dtype=np.int8) if masked else None
        plain: Any = spaces.Discrete(3)
        parts = {"observation": plain, "action_mask": spaces.MultiBinary(n_masked or 1)}
        self.observation_space = spaces.Dict(parts) if masked else plain

    def reset(self, *, seed: int | None = None, options: Any = None) -> Any:
        return 0 if self.masked is None else {"observation": 0, "action_mask": self.masked}, {}

    def step(self, action: Any) -> Any:
        return self.reset()[0], 1.0, True, False, {}


@pytest.mark.parametrize("kind", [QLearning, TeamQ])
@pytest.mark.parametrize("deterministic", MODES)
def test_a_game_played_by_hand_keeps_to_the_masks_that_observations_carry(kind: Any, deterministic: Any) -> None:
    agent = kind(Alternating(), epsilon=0.5, seed=0).learn(episodes=20)
    env = Alternating()
    for _ in range(5):
        observations, _ = env.reset()
        while env.agents:
            observations, *_ = env.step(agent.predict(observations, deterministic=deterministic)[0])
    assert agent.evaluate(5, deterministic=deterministic).returns.min() == 6.0


@pytest.mark.parametrize("deterministic", MODES)
@pytest.mark.parametrize("kind", [QLearning, TeamQ])
def test_masks_are_obeyed_in_states_never_seen(kind: Any, deterministic: Any) -> None:
    agent = kind(Alternating(), seed=0).learn(episodes=3)
    for clock in (0, 1):
        observations = {name: seen_at(clock, state=2) for name in "ab"}
        for _ in range(10):
            assert {action % 2 for action in agent.predict(observations, deterministic=deterministic)[0].values()} == {
                clock
            }


def test_what_was_seen_while_learning_holds_only_without_another_mask() -> None:
    agent = QLearning(Masked(), seed=0).learn(episodes=3)  # "first" may not do 0 at clock 0
    agent._state.q[0, 0] = [3.0, 2.0, 1.0]
    assert agent.predict({"first": 0})[0] == {"first": 1}
    assert agent.predict({"first": 0}, action_masks={"first": [1, 0, 1]})[0] == {"first": 0}
    assert agent.predict({"first": 0}, action_masks={"first": None})[0] == {"first": 1}
    assert agent.predict({"first": 0}, action_masks={"second": [0, 0, 1]})[0] == {"first": 1}


def test_masks_of_observations_and_of_the_caller_both_hold() -> None:
    agent = QLearning(Alternating(), seed=0)
    seen = {"a": seen_at(0)}
    assert agent.predict(seen, action_masks={"a": [0, 1, 1, 1]})[0] == {"a": 2}
    with pytest.raises(ObservationError, match="or both together, allows none"):
        agent.predict(seen, action_masks={"a": [0, 1, 0, 1]})


@pytest.mark.parametrize("deterministic", MODES)
@pytest.mark.parametrize("env", [corridor(), Observing(spaces.Discrete(2))], ids=["compiled", "stepped"])
def test_a_mask_given_to_one_and_to_many(env: Any, deterministic: Any) -> None:
    agent = QLearning(env, epsilon=0.5, seed=0, initial_q=[[0.0, 1.0]] * (5 if isinstance(env, TabularMDP) else 3))
    predict = {"deterministic": deterministic}
    assert agent.predict(1, action_masks=[1, 0], **predict)[0] == 0
    assert agent.predict(np.int64(1), action_masks=np.array([False, True]), **predict)[0] == 1
    masks = np.array([[1, 0], [0, 1]] * 20, dtype=np.int8)
    states = np.zeros(40, dtype=np.int64)  # one state, under two masks
    assert agent.predict(states, action_masks=masks, **predict)[0].tolist() == [0, 1] * 20
    assert agent.predict(np.zeros(0, np.int64), action_masks=np.zeros((0, 2)), **predict)[0].shape == (0,)


@pytest.mark.parametrize("deterministic", MODES)
def test_batches_carry_their_masks(deterministic: Any) -> None:
    agent = QLearning(Alternating(), epsilon=0.5, seed=0)
    batch = {
        "observation": np.array([0, 0, 2]),
        "action_mask": np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 1]], dtype=np.int8),
    }
    actions = agent.predict({"b": batch}, deterministic=deterministic)[0]["b"]
    assert actions[:2].tolist() == [0, 1]
    assert actions[2] in (2, 3)
    team = TeamQ(Alternating(), epsilon=0.5, seed=0)
    other = {"observation": np.array([1, 1, 1]), "action_mask": np.array([[0, 0, 0, 1]] * 3)}
    joint = team.predict({"a": batch, "b": other}, deterministic=deterministic)[0]
    assert joint["a"][:2].tolist() == [0, 1]
    assert joint["b"].tolist() == [3, 3, 3]


def test_a_teams_masks_are_those_of_all_agents() -> None:
    team = TeamQ(Masked(), seed=0)
    seen = {"first": 0, "second": 0}
    assert team.predict(seen, action_masks={"second": [0, 0, 1], "first": [0, 1, 1]})[0] == {"first": 1, "second": 2}
    assert team.predict(seen, action_masks={"second": [0, 1, 0]})[0] == {"first": 0, "second": 1}
    assert team.predict((0, 0), action_masks=([0, 0, 1], None))[0] == (2, 0)
    carrying = TeamQ(MaskedInObservation(), seed=0)
    seen = MaskedInObservation().reset()[0]  # first may not do 0, second not 1
    assert carrying.predict(seen, action_masks={"first": [1, 0, 1], "second": [0, 1, 1]})[0] == {
        "first": 2,
        "second": 2,
    }


def test_a_team_on_an_extracted_table_is_asked_by_agent_and_by_number() -> None:
    team = TeamQ("tuckerl/RobotRescue-v0", seed=0)
    team._state.q[0, 32445, 7] = 1.0  # 7 = 5 + 2: robot_0 goes right, robot_1 up
    seen = {"robot_0": 168, "robot_1": 189}
    assert team.predict(32445)[0] == 7
    assert team.predict(seen)[0] == {"robot_0": 1, "robot_1": 2}
    assert team.predict(seen, action_masks={"robot_0": [0, 0, 1, 1, 1]})[0] == {"robot_0": 2, "robot_1": 0}
    assert team.predict(32445, action_masks=([0, 0, 1, 1, 1], None))[0] == 10
    assert team.predict(32445, action_masks=np.arange(25) == 24)[0] == 24
    stepped = TeamQ("tuckerl/RobotRescue-v0", compiled=False, seed=0)
    stepped._state.q[:] = team._state.q
    many = {"robot_0": np.array([168, 3]), "robot_1": np.array([189, 4])}
    for learner in (team, stepped):
        assert {name: actions.tolist() for name, actions in learner.predict(many)[0].items()} == {
            "robot_0": [1, 0],
            "robot_1": [2, 0],
        }


def test_masks_of_several_dimensions() -> None:
    agent = QLearning(Observing(spaces.MultiDiscrete([2, 3])), seed=0)
    agent._state.q[0, 1] = [6.0, 5.0, 4.0, 3.0, 2.0, 1.0]
    rows = {
        (1, 1, 0, 1, 1): [0, 1],  # those of both dimensions in one row, as sb3-contrib has them
        (0, 1, 0, 0, 1): [1, 2],
        (0, 0, 0, 0, 1, 1): [1, 1],  # of the joint actions
    }
    for given, action in rows.items():
        assert agent.predict(1, action_masks=np.array(given, dtype=bool))[0].tolist() == action
    assert agent.predict(1, action_masks=([0, 1], [0, 1, 1]))[0].tolist() == [1, 1]  # as the space's `sample` has it
    assert agent.predict(1, action_masks=(None, [0, 0, 1]))[0].tolist() == [0, 2]
    batch = np.array([[1, 0, 0, 0, 1], [0, 1, 1, 0, 0]])
    assert agent.predict(np.array([1, 1]), action_masks=batch)[0].tolist() == [[0, 2], [1, 0]]
    # Where both lengths are equal, it is a row of the dimensions.
    square = QLearning(Observing(spaces.MultiDiscrete([2, 2])), seed=0)
    assert square.predict(0, action_masks=[0, 1, 1, 0])[0].tolist() == [1, 0]
    bits = QLearning(Observing(spaces.MultiBinary(3)), seed=0)
    assert bits.predict(0, action_masks=[0, 1, 1, 1, 0, 1])[0].tolist() == [1, 0, 1]
    carried = QLearning(Observing(spaces.MultiDiscrete([2, 3]), masked=True, n_masked=5), seed=0)
    seen = {"observation": 2, "action_mask": np.array([0, 1, 0, 1, 1])}
    assert carried.predict(seen)[0].tolist() == [1, 1]


def test_batches_of_actions_are_what_gymnasium_makes_of_them() -> None:
    pair = QLearning(Observing(spaces.Tuple([spaces.Discrete(2, start=5), spaces.MultiDiscrete([2, 2])])), seed=0)
    first, second = pair.predict(np.array([0, 1, 2]))[0]
    assert first.tolist() == [5, 5, 5]
    assert second.tolist() == [[0, 0]] * 3
    first, second = pair.predict(np.zeros(0, dtype=np.int64))[0]
    assert (first.shape, second.shape) == ((0,), (0, 2))


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ([1, 0, 1], "must be a row of 2 entries, 1 where an action may be taken and 0 where not; got"),
        (1, "must be a row of 2 entries"),
        ([[1, 0]], "must be a row of 2 entries"),
        ("10", "must be a row of 2 entries"),
        ([1, 0.5], "entries of an action mask must be 0 or 1"),
        ([1, np.nan], "entries of an action mask must be 0 or 1"),
        ([0, 0], "must allow an action in every state that is asked for"),
        (np.zeros(10_000), "must be a row of 2 entries"),
    ],
)
@pytest.mark.parametrize("env", [corridor(), Observing(spaces.Discrete(2))], ids=["compiled", "stepped"])
def test_masks_of_no_use_are_refused(env: Any, given: Any, message: str) -> None:
    agent = QLearning(env, seed=0)
    for deterministic in MODES:
        with pytest.raises(ObservationError, match=message) as error:
            agent.predict(0, action_masks=given, deterministic=deterministic)
        assert len(str(error.value)) < 600


def test_masks_of_a_batch_that_are_of_no_use_are_refused() -> None:
    agent = QLearning(corridor(), seed=0)
    for given in ([1, 0], [[1, 0]], [[1, 0]] * 3):
        with pytest.raises(ObservationError, match="a row of 2 entries for each of the 2 observations"):
            agent.predict([0, 1], action_masks=given)
    with pytest.raises(ObservationError, match="must allow an action in every state"):
        agent.predict([0, 1], action_masks=[[1, 0], [0, 0]])
    with pytest.raises(ObservationError, match=r"3 entries, those of 2 parts .*, or 2|a row of"):
        QLearning(Observing(spaces.MultiDiscrete([2, 3])), seed=0).predict(0, action_masks=[1, 0])


def test_masks_of_nobody_are_refused() -> None:
    for agent in (QLearning(Masked(), seed=0), TeamQ(Masked(), seed=0)):
        seen = {"first": 0, "second": 0}
        with pytest.raises(ObservationError, match="action_masks must be a dict by agent, of first, second; got"):
            agent.predict(seen, action_masks={"third": [1, 1, 1]})
    with pytest.raises(ObservationError, match="action_masks must be a dict by agent"):
        QLearning(Masked(), seed=0).predict({"first": 0}, action_masks=[1, 1, 1])
    plane = spaces.Tuple([spaces.Discrete(2), spaces.MultiBinary(2)])
    with pytest.raises(SpaceError, match="action masks must belong to an action space that is Discrete"):
        QLearning(Observing(plane), seed=0).predict(0, action_masks=([1, 1], None))


# Policies


class HeedlessArrays(NamedTuple):
    """A policy that looks at nothing."""


@kernel
def _always_the_last(policy: HeedlessArrays, agent: AgentArrays, state: int) -> int:
    return int(agent.q.shape[1]) - 1


@kernel
def _last_for_certain(policy: HeedlessArrays, agent: AgentArrays, state: int, out: FloatArray) -> None:
    out[:] = 0.0
    out[out.size - 1] = 1.0


register_policy(HeedlessArrays, choose=_always_the_last, probabilities=_last_for_certain)


class Heedless(Policy):
    """Takes the last action, whatever the masks say."""

    def arrays(self, scheduled: FloatArray, declared: Mapping[str, Any]) -> HeedlessArrays:
        """Return nothing."""
        return HeedlessArrays()


class Dealing(QLearning):
    """Plays a distribution of its own."""

    state_type = QLearningState

    def declare_state(self) -> tuple[Declaration, ...]:
        """Return the chances of each action."""
        return (DeclaredArray("chances", "by_row", initial=0.25),)


def frequencies(agent: Any, mask: Any, n: int = 20_000) -> list[float]:
    """Return how often each of four actions is drawn in state 0 under a mask."""
    masks = np.tile(mask, (n, 1))
    actions = agent.predict(np.zeros(n, dtype=np.int64), deterministic=False, action_masks=masks)[0]
    return [float((actions == action).mean()) for action in range(4)]


ONE = TabularMDP([[0] * 4], [[0.0] * 4], [[True] * 4])
FIRST = [[4.0, 3.0, 2.0, 1.0]]


@pytest.mark.parametrize(
    ("policy", "expected"),
    [
        (EpsilonGreedy(0.4), [0.0, 0.8, 0.0, 0.2]),
        (Greedy(), [0.0, 1.0, 0.0, 0.0]),
        (Heedless(), [0.0, 0.0, 0.0, 1.0]),
    ],
    ids=["epsilon-greedy", "greedy", "heedless"],
)
def test_probabilities_are_those_of_the_allowed_actions(policy: Policy, expected: list[float]) -> None:
    agent = QLearning(ONE, policy=policy, initial_q=FIRST, seed=1)
    np.testing.assert_allclose(frequencies(agent, [0, 1, 0, 1]), expected, atol=0.015)


def test_what_a_policy_leaves_is_drawn_evenly() -> None:
    agent = QLearning(ONE, policy=Heedless(), seed=1)
    np.testing.assert_allclose(frequencies(agent, [1, 1, 1, 0]), [1 / 3] * 3 + [0.0], atol=0.015)


def test_a_distribution_of_the_learners_own_is_renormalised() -> None:
    agent = Dealing(ONE, policy=OwnDistribution("chances"), seed=1)
    agent.declared[0]["chances"][:] = [0.1, 0.3, 0.6, 0.0]
    np.testing.assert_allclose(frequencies(agent, [1, 1, 0, 1]), [0.25, 0.75, 0.0, 0.0], atol=0.015)
    np.testing.assert_allclose(frequencies(agent, [0, 0, 0, 1]), [0.0, 0.0, 0.0, 1.0])
    assert agent.predict(0, action_masks=[1, 1, 0, 0], deterministic=True)[0] == 1
    drawn = agent.predict(np.zeros(20_000, dtype=np.int64), action_masks=np.tile([0, 1, 1, 1], (20_000, 1)))[0]
    np.testing.assert_allclose([(drawn == action).mean() for action in range(4)], [0, 1 / 3, 2 / 3, 0], atol=0.015)


def test_joint_masks_hold_for_agents_that_explore_on_their_own() -> None:
    # Both may do 0 or 1, but not the same: each on its own cannot know, the draw does.
    team = TeamQ(TabularMDP([[0] * 4], [[0.0] * 4], [[True] * 4], action_sizes=(2, 2)), epsilon=0.5, seed=0)
    drawn = frequencies(team, [0, 1, 1, 0])
    assert drawn[0] == drawn[3] == 0.0
    assert min(drawn[1:3]) > 0.1


def test_asking_under_a_mask_leaves_what_was_learned_alone() -> None:
    agent = QLearning(Masked(), epsilon=0.5, seed=0).learn(episodes=5)
    before = [mask.copy() for mask in agent._state.action_masks]
    agent.predict({"first": 0, "second": 0}, action_masks={"first": [1, 0, 0]}, deterministic=False)
    for mask, held in zip(agent._state.action_masks, before, strict=True):
        np.testing.assert_array_equal(mask, held)
    assert agent.predict({"first": 0})[0]["first"] != 0
