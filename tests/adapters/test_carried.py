"""A table is played instead of an environment only where it is known to be what the environment's steps do."""

import functools
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.envs.toy_text import FrozenLakeEnv
from gymnasium.spaces import Discrete
from gymnasium.wrappers import RecordEpisodeStatistics, TimeLimit, TransformReward

from tuckerl.adapters.gymnasium_problem import GymnasiumProblem
from tuckerl.adapters.resolve import AdapterOptions, Agents, as_problem
from tuckerl.environments.dyna_maze import DynaMazeEnv
from tuckerl.environments.robot_rescue_env import RobotRescueEnv
from tuckerl.errors import ProblemError
from tuckerl.problems.maze import sutton_maze
from tuckerl.problems.mdp import TabularMDP
from tuckerl.problems.simulator import Simulator

COMPILED = AdapterOptions(compiled=True)


class Walk(gymnasium.Env[Any, Any]):
    """Four places in toy text's form; the last is the goal."""

    bonus = 0.0

    def __init__(self) -> None:
        self.observation_space, self.action_space = Discrete(4), Discrete(2)
        self.P: Any = {
            s: {a: [(1.0, n := min(max(s + 2 * a - 1, 0), 3), float(n == 3), n == 3)] for a in range(2)}
            for s in range(4)
        }
        self.initial_state_distrib: Any = np.array([1.0, 0, 0, 0])

    def reset(self, *, seed: int | None = None, options: Any = None) -> Any:
        super().reset(seed=seed)
        self.place = 0
        return 0, {}

    def step(self, action: Any) -> Any:
        _, self.place, reward, end = self.P[self.place][int(action)][0]
        return self.place, reward + self.bonus, end, False, {}


class Shaped(Walk):
    bonus = -0.5


class StartsElsewhere(Walk):
    def reset(self, *, seed: int | None = None, options: Any = None) -> Any:
        super().reset(seed=seed)
        self.place = 1
        return 1, {}


class Lake(FrozenLakeEnv):
    """Overrides how it is made, shown and closed."""

    def __init__(self) -> None:
        super().__init__(is_slippery=False)

    def render(self) -> Any:
        return None

    def close(self) -> None:
        """Leave all open."""


class PaidLake(Lake):
    def step(self, a: Any) -> Any:
        observation, reward, *rest = super().step(a)  # type: ignore[no-untyped-call]  # Gymnasium's own has no types
        return observation, reward - 1.0, *rest


class MovedLake(Lake):
    def reset(self, **given: Any) -> Any:
        return super().reset(**given)


class SmallMaze(DynaMazeEnv):
    def __init__(self) -> None:
        maze = sutton_maze()
        super().__init__(maze.walls, start=maze.start, goal=maze.goal)


class BlindRescue(RobotRescueEnv):
    """Overrides what a step asks for."""

    def __init__(self) -> None:
        super().__init__(".H.\nATB", max_cycles=7)

    def _observations(self) -> Any:
        return super()._observations()


def replaced(env: Any, name: str) -> Any:
    setattr(env, name, functools.wraps(getattr(env, name))(lambda *_, **__: None))
    return env


@pytest.mark.parametrize("env", [Lake(), SmallMaze(), gymnasium.make("FrozenLake-v1"), gymnasium.make("Taxi-v4")])
def test_known_steps_are_played_from_their_table(env: Any) -> None:
    assert isinstance(as_problem(env), TabularMDP)
    assert isinstance(as_problem(env, COMPILED), TabularMDP)


@pytest.mark.parametrize("kind", [Walk, Shaped, StartsElsewhere, PaidLake, MovedLake])
def test_steps_that_are_not_known_are_taken_in_python(kind: Any) -> None:
    assert isinstance(as_problem(kind()), GymnasiumProblem)


def test_methods_that_were_replaced_are_not_known(monkeypatch: pytest.MonkeyPatch) -> None:
    class Fine(Lake):
        """As it is."""

    assert isinstance(as_problem(Fine()), TabularMDP)
    watched: Any = functools.wraps(FrozenLakeEnv.step)(lambda self, a: (0, 0.0, True, False, {}))
    monkeypatch.setattr(FrozenLakeEnv, "step", watched)
    assert isinstance(as_problem(Fine()), GymnasiumProblem)
    monkeypatch.undo()
    maze: Any = SmallMaze()
    maze.step = lambda action: (0, 0.0, True, False, {})
    assert isinstance(as_problem(maze), GymnasiumProblem)


def test_teams_are_played_from_their_table_if_nobody_changed_it() -> None:
    joint = AdapterOptions(Agents.JOINT)
    assert isinstance(as_problem(BlindRescue(), joint), GymnasiumProblem)
    rescue: Any = RobotRescueEnv(".H.\nATB", max_cycles=7)
    assert isinstance(as_problem(rescue, joint), TabularMDP)
    rescue.step = lambda actions: RobotRescueEnv.step(rescue, actions)
    assert isinstance(as_problem(rescue, joint), GymnasiumProblem)


def test_compiled_is_a_word_that_is_tried_out() -> None:
    assert isinstance(as_problem(Walk(), COMPILED), TabularMDP)
    assert isinstance(as_problem(lambda: TimeLimit(Walk(), 9), COMPILED), TabularMDP)
    wrong = {
        r"action 1 in state 0 led to 1 with reward -0\.5|action 0 in state 0 led to 0 with reward -0\.5": Shaped,
        "it began in state 1, which is no first state of its table": StartsElsewhere,
    }
    for message, kind in wrong.items():
        with pytest.raises(ProblemError, match=f"compiled=True plays {kind.__name__} from the table .*({message})"):
            as_problem(kind(), COMPILED)
    for env in ("Blackjack-v1", PaidLake()):
        with pytest.raises(ProblemError, match="no transition table that is known to be its own steps"):
            as_problem(env, COMPILED)


def reset(parameters: Any, state: Any, rng: Any) -> None:
    state[0] = 0.0


def step(parameters: Any, state: Any, action: Any, rng: Any) -> tuple[float, bool]:
    return 0.0, True


def test_a_simulator_of_a_users_environment_is_passed_itself() -> None:
    env: Any = Walk()
    env.simulator = Simulator(reset, step, n_states=4, n_actions=2)
    assert isinstance(as_problem(env), GymnasiumProblem)
    with pytest.raises(ProblemError, match="cannot be compared with what it carries: pass its simulator itself as env"):
        as_problem(env, COMPILED)


@pytest.mark.parametrize(
    "attributes",
    [
        {"mdp": np.zeros((2, 3))},
        {"simulator": np.zeros(3)},
        {"mdp": [], "simulator": "mine"},
        {"P": {s: {a: {0: 0.5, 1: 0.5} for a in range(2)} for s in range(4)}},
        {"P": 3, "initial_state_distrib": None},
    ],
)
def test_attributes_of_the_same_name_and_another_kind_do_not_matter(attributes: dict[str, Any]) -> None:
    env = Walk()
    vars(env).update(attributes)
    env.step = lambda action: (0, 0.0, True, False, {})  # type: ignore[method-assign]  # it does not read P
    assert isinstance(as_problem(env), GymnasiumProblem)


def test_a_time_limit_below_other_wrappers_is_found() -> None:
    lake = gymnasium.make("FrozenLake-v1")
    limits = {
        100: TransformReward(lake, float),
        7: RecordEpisodeStatistics(TransformReward(TimeLimit(lake, 7), float)),
        5: TimeLimit(TransformReward(lake, float), 5),
    }
    for limit, env in limits.items():
        problem = as_problem(env)
        assert (problem.max_episode_steps, problem.is_capped) == (limit, False)


class Twice(gymnasium.Wrapper[Any, Any, Any, Any]):
    def step(self, action: Any) -> Any:
        self.env.step(action)
        return self.env.step(action)


def test_a_time_limit_below_a_wrapper_that_steps_by_itself_is_not_ours() -> None:
    assert as_problem(Twice(gymnasium.make("FrozenLake-v1"))).is_capped
    assert as_problem(gymnasium.wrappers.Autoreset(gymnasium.make("FrozenLake-v1"))).is_capped
