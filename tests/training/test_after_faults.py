"""What a fault leaves behind: no traces, no old error, no reward of one who is gone; and how both flags at once end."""

from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces

from tests.adapters.parallel_worlds import World
from tuckerl import UCB, QLearning, SarsaLambda, TabularMDP, TensorStep
from tuckerl.errors import EnvironmentFaultError


class Round(gymnasium.Env[Any, Any]):
    """Five places in a ring; does something at chosen steps, counted over all episodes and from 1."""

    observation_space, action_space = spaces.Discrete(5), spaces.Discrete(2)

    def __init__(self, faults: dict[int, Any]) -> None:
        self.faults, self.n_steps, self.place = faults, 0, 0

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[int, dict[str, Any]]:
        super().reset(seed=seed)
        self.place = 0
        return 0, {}

    def step(self, action: int) -> Any:
        self.n_steps += 1
        self.place = (self.place + 1) % 5
        fault = self.faults.get(self.n_steps, 1.0)
        if isinstance(fault, Exception):
            raise fault
        return self.place, fault, self.place == 4, False, {}


def traces(learner: Any) -> list[list[int]]:
    """The states that have traces, of each agent."""
    return [held["traces"].to_arrays()["state"].tolist() for held in learner.declared]


def test_traces_that_go_on_from_episode_to_episode_end_where_one_is_broken_off() -> None:
    learner = SarsaLambda(Round({7: ZeroDivisionError("no road")}), seed=0, carry_trace=True).learn(1)
    before = traces(learner)
    assert before != [[]]
    with pytest.raises(EnvironmentFaultError):
        learner.learn(1)
    assert traces(learner) == before, "the episode has never been"


def test_rows_that_earlier_episodes_have_changed_are_brought_back_too() -> None:
    learner = QLearning(Round({7: ZeroDivisionError("no road")}), seed=0).learn(1)
    before = learner.q
    assert before[0, :2].any(axis=1).all(), "the rows that the broken episode changes, too"
    with pytest.raises(EnvironmentFaultError):
        learner.learn(1)
    np.testing.assert_array_equal(learner.q, before)


def test_choices_of_an_episode_that_is_broken_off_do_not_count() -> None:
    learner = QLearning(Round({7: ZeroDivisionError("no road")}), policy=UCB(1.0), seed=0).learn(1)
    before = learner.declared[0]["ucb.choices"].copy()
    assert before.sum() == 4
    with pytest.raises(EnvironmentFaultError):
        learner.learn(1)
    np.testing.assert_array_equal(learner.declared[0]["ucb.choices"], before)


class Narrowing(Round):
    """Allows everything in its first episode, and then action 0 alone."""

    def told(self) -> dict[str, Any]:
        return {"action_mask": np.array([1, self.n_steps <= 4], dtype=np.int8)}

    def reset(self, **given: Any) -> tuple[int, dict[str, Any]]:
        return super().reset(**given)[0], self.told()

    def step(self, action: int) -> Any:
        return *super().step(action)[:4], self.told()


def test_masks_of_an_episode_that_is_broken_off_are_neither_kept_nor_saved(tmp_path: Path) -> None:
    learner = QLearning(Narrowing({7: ZeroDivisionError("no road")}), seed=0).learn(1)
    assert learner.action_mask is not None
    assert learner.action_mask.all()
    with pytest.raises(EnvironmentFaultError):
        learner.learn(1)
    assert learner.action_mask.all(), "the episode has never been"
    learner.save(tmp_path / "learner")
    again = QLearning.load(tmp_path / "learner", env=Narrowing({}))
    assert again.action_mask is not None
    assert again.action_mask.all()
    learner.learn(1)
    assert not learner.action_mask.all(), "the next one has been"


class Together(World):
    """Three agents that see the clock; it fails in a chosen step."""

    def __init__(self, fails_at: int) -> None:
        names = ["a", "b", "c"]
        super().__init__(dict.fromkeys(names, spaces.Discrete(9)), dict.fromkeys(names, spaces.Discrete(2)))
        self.fails_at = fails_at

    def act(self, actions: dict[str, Any]) -> tuple[dict[str, float], set[str], set[str]]:
        if self.clock == self.fails_at:
            raise ZeroDivisionError("no road")
        return dict.fromkeys(actions, 1.0), set(), set()


def test_of_agents_in_one_world_nobodys_traces_outlive_a_fault() -> None:
    learner = SarsaLambda(Together(4), seed=0, initial_q=2.0, tensor_step=TensorStep(every=5, ranks=(2, 2, 2, 1)))
    with pytest.raises(EnvironmentFaultError):
        learner.learn(1)
    assert traces(learner) == [[], [], []]
    assert (learner.q == 2.0).all(), "the episode has never been"


class Departing(World):
    """The first agent is paid what is no number, and is not there in later episodes."""

    def __init__(self) -> None:
        names = ["a", "b"]
        super().__init__(dict.fromkeys(names, spaces.Discrete(3)), dict.fromkeys(names, spaces.Discrete(2)))

    def reset(self, seed: int | None = None, options: Any = None) -> Any:
        observations, infos = super().reset(seed, options)
        if len(self.reset_with) > 2:  # the first reset is the adapter's own
            self.agents = ["b"]
            observations.pop("a")
        return observations, infos

    def act(self, actions: dict[str, Any]) -> tuple[dict[str, float], set[str], set[str]]:
        return {agent: np.nan if agent == "a" else 1.0 for agent in actions}, set(actions), set()


def test_a_reward_that_was_no_number_is_forgotten_with_its_agent() -> None:
    learner = QLearning(Departing(), seed=0)
    with pytest.raises(EnvironmentFaultError, match="paid a reward that is not finite"):
        learner.learn(1)
    assert learner.learn(3).episodes == 3


def test_of_two_faults_the_second_does_not_name_the_first() -> None:
    learner = QLearning(Round({2: ZeroDivisionError("no road"), 3: np.nan}), seed=0)
    with pytest.raises(EnvironmentFaultError, match="no road") as first:
        learner.learn(1)
    assert isinstance(first.value.__cause__, ZeroDivisionError)
    with pytest.raises(EnvironmentFaultError, match="paid a reward that is not finite") as second:
        learner.learn(1)
    assert second.value.__cause__ is None


class BothFlags(World):
    """One step, which terminates and is truncated at once."""

    def __init__(self) -> None:
        super().__init__({"a": spaces.Discrete(2)}, {"a": spaces.Discrete(1)})

    def act(self, actions: dict[str, Any]) -> tuple[dict[str, float], set[str], set[str]]:
        return {"a": 0.5}, {"a"}, {"a"}


def test_what_terminates_and_is_truncated_at_once_has_no_value_after_it() -> None:
    learner = QLearning(BothFlags(), alpha=1.0, initial_q=[[0.0], [7.0]], seed=0).learn(1)
    assert learner.q[0, 0, 0] == 0.5


def test_a_floor_holds_for_weights_that_need_no_tables_where_nothing_was_learned() -> None:
    nothing = TabularMDP([[0, 0, 0, 0]], [[0.0] * 4], [[True] * 4])
    for floor, weight in ((0.9, 0.9), (0.1, 0.5)):  # 1/sqrt(4)
        step = TensorStep(every=2, ranks=(1, 1, 1, 1), weights="constant", share="consensus", floor=floor)
        learner = QLearning(nothing, n_agents=2, tensor_step=step, seed=0).learn(2)
        assert learner.action_weights.tolist() == [weight] * 4
