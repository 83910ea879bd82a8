"""A learner goes on with the problem that it was saved with, or is told what differs."""

from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces

import tuckerl
from tests.adapters.parallel_worlds import Meeting
from tuckerl.adapters.kinds import restore_problem, save_problem
from tuckerl.adapters.resolve import AdapterOptions, Agents, as_problem
from tuckerl.errors import ParameterError
from tuckerl.problems.mdp import TabularMDP
from tuckerl.problems.simulator import Simulator

PATH = Path("agent.tuckerl")
DEFAULT = AdapterOptions()


class World(gymnasium.Env[Any, Any]):
    """An environment of any spaces, whose episodes end after a step."""

    def __init__(self, observed: Any, acted: Any, mask: Any = None) -> None:
        self.observation_space, self.action_space, self.mask = observed, acted, mask

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[Any, dict[str, Any]]:
        super().reset(seed=seed)
        self.observation_space.seed(seed)
        return self.observation_space.sample(), {} if self.mask is None else {"action_mask": self.mask}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        return self.observation_space.sample(), 1.0, True, False, {}


def restored(env: Any, given: Any, options: AdapterOptions = DEFAULT) -> Any:
    header, arrays = save_problem(as_problem(env, options))
    return restore_problem(header, dict(arrays), given, PATH, options)


TWO, THREE = spaces.Discrete(2), spaces.Discrete(3)
WIDE = spaces.Box(-1, 1, (2,))
WRONG = {
    "observation nvec was 2, 3; got 3, 2": (
        World(spaces.MultiDiscrete([2, 3]), TWO),
        World(spaces.MultiDiscrete([3, 2]), TWO),
    ),
    "action start was 0; got 5": (World(THREE, TWO), World(THREE, spaces.Discrete(2, start=5))),
    "observation high was 1.0; got 2.0": (World(WIDE, TWO), World(spaces.Box(-1, 2, (2,)), TWO)),
    "observation dtype was float32": (World(WIDE, TWO), World(spaces.Box(-1, 1, (2,), np.float64), TWO)),
    "observation keys was a, b; got a, c": (
        World(spaces.Dict(a=TWO, b=TWO), TWO),
        World(spaces.Dict(a=TWO, c=TWO), TWO),
    ),
    "action masks was False; got True": (World(THREE, TWO), World(THREE, TWO, np.array([1, 0], np.int8))),
    "time limit was 7; got 8": (
        gymnasium.wrappers.TimeLimit(World(THREE, TWO), 7),
        gymnasium.wrappers.TimeLimit(World(THREE, TWO), 8),
    ),
}


@pytest.mark.parametrize("difference", WRONG)
def test_what_differs_in_an_environment_is_named(difference: str) -> None:
    right, wrong = WRONG[difference]
    options = AdapterOptions(bins=4 if right.observation_space is WIDE else None)
    said = f"env must be the one that agent.tuckerl was saved with: {difference}.*evaluate\\(env=.*initial_q="
    with pytest.raises(ParameterError, match=said):
        restored(right, wrong, options)
    assert as_problem(right, options).difference(restored(right, right, options)) is None


def test_agents_are_compared_by_name_order_and_spaces() -> None:
    turned, renamed, wider = Meeting(), Meeting(), Meeting()
    turned.possible_agents.reverse()
    wider.action_space = lambda agent: spaces.Discrete(3 if agent == "east" else 2)  # type: ignore[method-assign]  # another space, as is meant
    del renamed.possible_agents[1]
    for wrong, difference in ((turned, "was west, east; got east, west"), (renamed, "was west, east; got west")):
        with pytest.raises(ParameterError, match=f"saved with: agents {difference}"):
            restored(Meeting(), wrong)
    assert "spaces of west action n was 3; got 2" in str(as_problem(Meeting()).difference(as_problem(wider)))


def lake(**keywords: Any) -> Any:
    return gymnasium.make("FrozenLake-v1", **keywords)


def test_an_extracted_table_is_known_by_its_digest(tmp_path: Path) -> None:
    agent = tuckerl.QLearning(lake(), seed=0).learn(20)
    agent.save(tmp_path / "agent")
    for right in (None, lake(), "FrozenLake-v1", agent.problem):
        again = tuckerl.QLearning.load(tmp_path / "agent", env=right).learn(20)
        assert np.array_equal(again.q, tuckerl.QLearning(lake(), seed=0).learn(40).q)
    slick = lake(is_slippery=False)
    wrong = {
        "transitions was sha256": slick,
        "observation n was 16; got 64": lake(map_name="8x8"),
        "time limit was 100; got 9": lake(max_episode_steps=9),
        "kind was table; got gymnasium": gymnasium.wrappers.TransformReward(lake(), float),
    }
    for difference, env in wrong.items():
        with pytest.raises(ParameterError, match=f"agent was saved with: {difference}"):
            tuckerl.QLearning.load(tmp_path / "agent", env=env)


def reset(parameters: Any, state: Any, rng: Any) -> None:
    state[0] = parameters[0]


def step(parameters: Any, state: Any, action: Any, rng: Any) -> tuple[float, bool]:
    return 0.0, True


def test_a_simulator_is_known_by_its_numbers() -> None:
    sizes: Any = {"n_states": 3, "n_actions": 2, "max_episode_steps": 5}
    saved = Simulator(reset, step, **sizes, parameters=[1.0, 2.0])
    assert restored(saved, saved) is saved
    with pytest.raises(ParameterError, match=r"saved with: parameters was 1.0, 2.0; got 1.0, 2.5"):
        restored(saved, Simulator(reset, step, **sizes, parameters=[1.0, 2.5]))
    with pytest.raises(ParameterError, match="saved with: state size was 1; got 2"):
        restored(saved, Simulator(reset, step, **sizes, parameters=[1.0, 2.0], state_size=2))


def test_files_without_a_description_are_compared_by_sizes() -> None:
    header, arrays = save_problem(as_problem(World(spaces.MultiDiscrete([2, 3]), TWO)))
    del header["held"]["description"]
    turned = World(spaces.MultiDiscrete([3, 2]), TWO)
    assert restore_problem(header, dict(arrays), turned, PATH, DEFAULT).n_states == 6
    with pytest.raises(ParameterError, match=r"\(states, actions, time limit\) \[6, 2, 100000\]; got GymnasiumProblem"):
        restore_problem(header, dict(arrays), World(spaces.MultiDiscrete([3, 3]), TWO), PATH, DEFAULT)


def test_spaces_alone_may_be_compared() -> None:
    table = as_problem("FrozenLake-v1")
    stepped = as_problem(gymnasium.wrappers.TransformReward(lake(max_episode_steps=9), float))
    assert table.difference_of_spaces(stepped) is None
    assert stepped.difference_of_spaces(as_problem(lake(is_slippery=False))) is None
    assert table.difference_of_spaces(as_problem(lake(map_name="8x8"))) == "observation n was 16; got 64"
    moved = as_problem(World(spaces.Discrete(16), spaces.Discrete(4, start=1)))
    assert table.difference_of_spaces(moved) == "action start was 0; got 1"
    box = [as_problem(World(WIDE, TWO), AdapterOptions(bins=bins)) for bins in (4, [4, [0.0]])]
    assert str(box[0].difference_of_spaces(box[1])).startswith("bins was -0.5, 0.0, 0.5, -0.5, 0.0, 0.5; got")


def test_a_joint_table_has_the_spaces_of_its_agents() -> None:
    rescue = "tuckerl/RobotRescue-v0"
    table = as_problem(rescue, AdapterOptions(Agents.JOINT))
    stepped = as_problem(rescue, AdapterOptions(Agents.JOINT, compiled=False))
    assert table.difference_of_spaces(stepped) is None
    assert stepped.difference_of_spaces(table) is None
    assert table.difference(stepped) == "kind was table; got gymnasium"
    assert table.difference_of_spaces(as_problem(rescue)) is not None
    assert isinstance(table, TabularMDP)
