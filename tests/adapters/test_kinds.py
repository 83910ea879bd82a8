"""Every kind of problem says of itself how it is played, named and saved; a new one is one file and one line."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pettingzoo
import pytest
from gymnasium.spaces import Box, Dict, Discrete, Tuple

from tests.adapters.parallel_worlds import Dice, Unequal
from tests.learners.worlds import drift, random_mdp
from tuckerl import Maze, QLearning, TabularMDP, robot_rescue
from tuckerl.adapters.kinds import PROBLEM_KINDS, restore_problem, save_problem
from tuckerl.adapters.resolve import AdapterOptions, Agents, Environment, as_problem
from tuckerl.errors import ObservationError, ParameterError, ParameterTypeError, ProblemError, SavedFileError
from tuckerl.problems.parts import StateFactor, joint_names
from tuckerl.problems.problem import Problem
from tuckerl.types import IntArray

SMALL_RESCUE = "ATBH."
PATH = Path("agent.tuckerl")
MADE: dict[str, Callable[[], Any]] = {
    "table": lambda: random_mdp(2),
    "simulator": drift,
    "gymnasium": lambda: gymnasium.make("Blackjack-v1"),
    "pettingzoo": lambda: Dice(),
}


def problem_of(kind: str) -> Problem:
    return as_problem(MADE[kind]())


def test_every_kind_is_registered_under_its_own_name() -> None:
    assert set(MADE) == set(PROBLEM_KINDS)
    for kind, entry in PROBLEM_KINDS.items():
        assert entry.load().kind == kind
        assert entry.description
        assert isinstance(problem_of(kind), entry.load())


def test_problems_describe_themselves() -> None:
    told = {kind: problem_of(kind).describe() for kind in MADE}
    assert told == {
        "table": "its transition table (7 states, 3 actions) is played in compiled code",
        "simulator": "its simulator (12 states, 3 actions) is played in compiled code",
        "gymnasium": "stepped in Python (704 states, 2 actions)",
        "pettingzoo": "stepped in Python (6 states, 6 actions); each of its 2 agents has a table of its own",
    }
    one = TabularMDP([[0]], [[0]], [[True]])
    assert one.describe() == "its transition table (1 state, 1 action) is played in compiled code"


def test_only_agents_of_one_world_decide_how_many_tables_there_are() -> None:
    assert [problem_of(kind).n_tables(3) for kind in ("table", "simulator", "gymnasium")] == [3, 3, 3]
    together = problem_of("pettingzoo")
    assert together.n_tables(1) == 2
    with pytest.raises(ParameterError, match="n_agents must stay 1 where each of the environment's 2 agents has a tab"):
        together.n_tables(2)
    assert [kind for kind, entry in PROBLEM_KINDS.items() if entry.load().shares_world] == ["pettingzoo"]
    assert not as_problem(Unequal()).has_equal_spaces


# What things are called


def test_actions_are_named() -> None:
    assert as_problem("Blackjack-v1").action_names == ("stick", "hit")
    assert as_problem("tuckerl/CartPole-v0").action_names == tuple(map(str, range(21)))
    assert Maze(np.zeros((2, 2), dtype=bool), (0, 0), (1, 1)).to_mdp().action_names == ("up", "down", "left", "right")
    rescue = robot_rescue(SMALL_RESCUE)
    assert rescue.action_names == joint_names([("left", "right", "up", "down", "stay")] * 2)
    for compiled in ("auto", False):
        made: Any = pettingzoo.make("parallel", "tuckerl/RobotRescue-v0", map=SMALL_RESCUE)
        assert as_problem(made, AdapterOptions(Agents.JOINT, compiled=compiled)).action_names == rescue.action_names
    maze = as_problem("tuckerl/DynaMaze-v0", AdapterOptions(compiled=False))
    assert maze.action_names == ("up", "down", "left", "right")
    with pytest.raises(ProblemError, match="action_names must be 2 names, one for each action; got 3"):
        TabularMDP([[0, 0]], [[0, 0]], [[True, True]], action_names=("a", "b", "c"))


def test_environments_of_users_name_their_actions() -> None:
    class Lamp(gymnasium.Env[Any, Any]):
        observation_space, action_space = Discrete(2), Discrete(2)
        action_names = ("off", "on")

        def reset(self, *, seed: int | None = None, options: Any = None) -> Any:
            return 0, {}

        def step(self, action: Any) -> Any:
            return action, 0.0, True, False, {}

    assert as_problem(Lamp()).action_names == ("off", "on")
    Lamp.action_names = ("off", "on", "broken")  # type: ignore[assignment]  # one too many is no name for any
    assert as_problem(Lamp()).action_names == ("0", "1")


class Observes(gymnasium.Env[Any, Any]):
    """Ends at once."""

    def __init__(self, space: Any) -> None:
        self.observation_space, self.action_space = space, Discrete(2)

    def reset(self, *, seed: int | None = None, options: Any = None) -> Any:
        return self.observation_space.sample(), {}

    def step(self, action: Any) -> Any:
        return self.observation_space.sample(), 0.0, True, False, {}


@pytest.mark.parametrize(
    ("space", "factors"),
    [
        (Discrete(5), [("state", 5)]),
        (Box(-1.0, 1.0, (2,)), [("observation[0]", 3), ("observation[1]", 3)]),
        (Box(-1.0, 1.0, (1, 2)), [("observation[0, 0]", 3), ("observation[0, 1]", 3)]),
        (
            Dict({"b": Tuple([Discrete(2), Box(0.0, 1.0, (1,))]), "a": Discrete(4)}),
            [("observation['a']", 4), ("observation['b'][0]", 2), ("observation['b'][1][0]", 3)],
        ),
    ],
)
def test_states_have_the_factors_of_their_observations(space: Any, factors: list[tuple[str, int]]) -> None:
    bins = 3 if "Box" in repr(space) else None
    if isinstance(space, Dict):
        bins = {"b": (None, 3)}  # type: ignore[assignment]  # as a Dict takes them
    problem = as_problem(Observes(space), AdapterOptions(bins=bins))
    assert problem.state_factors == tuple(StateFactor(*factor) for factor in factors)
    assert np.prod([factor.size for factor in problem.state_factors]) == problem.n_states


def test_factors_of_tables_are_given_or_one() -> None:
    assert problem_of("table").state_factors == (("state", 7),)
    assert problem_of("simulator").state_factors == (("state", 12),)
    maze = Maze(np.zeros((2, 3), dtype=bool), (0, 0), (1, 1)).to_mdp()
    assert maze.state_factors == (("row", 2), ("column", 3))
    assert robot_rescue(SMALL_RESCUE).state_factors == (("robot_0", 15), ("robot_1", 15))
    made: Any = pettingzoo.make("parallel", "tuckerl/RobotRescue-v0", map=SMALL_RESCUE)
    stepped = as_problem(made, AdapterOptions(Agents.JOINT, compiled=False))
    assert stepped.state_factors == robot_rescue(SMALL_RESCUE).state_factors
    assert as_problem(Unequal()).state_factors == (("state", 4),)
    with pytest.raises(ProblemError, match="must multiply to the number of states, 2; got"):
        TabularMDP([[0], [0]], [[0], [0]], [[True], [True]], state_factors=[("a", 3)])


def test_first_and_unreachable_states_are_known_of_tables_alone() -> None:
    chain = TabularMDP([[1], [1], [0]], [[0]] * 3, [[True]] * 3, start=[0.25, 0.75, 0.0])
    start = chain.start_distribution()
    assert start is not None
    assert (start[0].tolist(), start[1].tolist()) == ([0, 1], [0.25, 0.75])
    assert chain.unreachable_states().tolist() == [False, False, True]  # type: ignore[union-attr]  # there is one
    for kind in ("simulator", "gymnasium", "pettingzoo"):
        assert problem_of(kind).start_distribution() is None
        assert problem_of(kind).unreachable_states() is None
    assert chain.action_mask is None
    masked = TabularMDP([[0, 0]], [[0, 0]], [[True, True]], action_mask=[[True, False]])
    assert masked.action_mask.tolist() == [[True, False]]  # type: ignore[union-attr]  # there is one


def test_a_problem_with_another_limit_or_source_is_another_one() -> None:
    for kind in MADE:
        problem = problem_of(kind)
        other = problem.with_time_limit(3, is_capped=True).with_source("elsewhere", id="elsewhere-v0")
        assert (other.max_episode_steps, other.is_capped, other.source, other.id) == (
            3,
            True,
            "elsewhere",
            "elsewhere-v0",
        )
        assert (problem.max_episode_steps, problem.source) != (3, "elsewhere")
        assert other.world().arrays.max_episode_steps == 3
        assert not problem.with_time_limit(5).is_capped


# Decisions


def recorded(calls: list[Any], actions: Any) -> Any:
    def choose(table: int, states: IntArray, action_mask: Any) -> IntArray:
        calls.append((table, states.tolist(), action_mask))
        return np.broadcast_to(np.array(actions), states.shape)

    return choose


def test_states_are_decided_by_number() -> None:
    for kind in ("table", "simulator"):
        calls: list[Any] = []
        action = problem_of(kind).decide(3, recorded(calls, 2))
        assert (type(action), action) == (int, 2)
        assert problem_of(kind).decide([1, 2], recorded(calls, 2)).tolist() == [2, 2]
        assert calls == [(0, 3, None), (0, [1, 2], None)]
        with pytest.raises(ParameterError, match=r"a state from 0 to \d+; got 99"):
            problem_of(kind).decide(99, recorded(calls, 0))
        with pytest.raises(ParameterTypeError, match=r"must be a state's number; got 0\.5"):
            problem_of(kind).decide(0.5, recorded(calls, 0))


def test_observations_are_decided_as_the_environment_gives_them() -> None:
    calls: list[Any] = []
    blackjack = problem_of("gymnasium")
    assert blackjack.decide((14, 10, 1), recorded(calls, 1)) == 1
    batch = (np.array([14, 0]), np.array([10, 0]), np.array([1, 0]))
    assert blackjack.decide(batch, recorded(calls, 1)).tolist() == [1, 1]
    assert calls == [(0, 329, None), (0, [329, 0], None)]


def test_agents_are_decided_by_their_tables() -> None:
    calls: list[Any] = []
    together = as_problem(Unequal())
    actions = together.decide({"carrier": np.array([0, 1]), "scout": 1}, recorded(calls, 1))
    assert [(table, state) for table, state, _ in calls] == [(1, 1), (0, 2)]
    assert list(actions) == ["carrier", "scout"]
    with pytest.raises(ObservationError, match="must be a dict by agent, of scout, carrier; got 3"):
        together.decide(3, recorded(calls, 1))


# Files


@pytest.mark.parametrize("kind", MADE)
def test_saved_problems_come_back(kind: str) -> None:
    env = MADE[kind]()
    problem = as_problem(env)
    header, arrays = save_problem(problem)
    given: Environment | None = None if problem.is_data else env
    again = restore_problem(json.loads(json.dumps(header)), dict(arrays), given, PATH, AdapterOptions())
    assert (again.kind, again.sizes, again.source) == (kind, problem.sizes, problem.source)
    assert (again.action_names, again.state_factors) == (problem.action_names, problem.state_factors)
    others = [made for other, made in MADE.items() if other != kind]
    for wrong in [made() for made in others]:
        with pytest.raises(ParameterError, match=r"env must be the one that agent.* was saved with: kind was "):
            restore_problem(header, dict(arrays), wrong, PATH, AdapterOptions())
    if not problem.is_data:
        with pytest.raises(SavedFileError, match="pass load\\(\\) its env"):
            restore_problem(header, dict(arrays), None, PATH, AdapterOptions())


def test_headers_are_those_of_format_3() -> None:
    headers = {kind: save_problem(problem_of(kind)) for kind in MADE}
    assert [header["kind"] for header, _ in headers.values()] == list(MADE)
    simulator = problem_of("simulator").description()
    held: dict[str, Any] = {"simulator": [12, 3, 80], "source": None, "description": simulator}
    assert headers["simulator"] == ({"kind": "simulator", "held": held}, {})
    stepped: dict[str, Any] = {"id": None, "source": "Blackjack-v1", "sizes": [704, 2, 100_000], "agents": []}
    stepped["description"] = problem_of("gymnasium").description()
    assert headers["gymnasium"] == ({"kind": "gymnasium", "held": stepped}, {})
    header, arrays = headers["table"]
    assert header["held"].keys() == {
        *("n_states", "n_actions", "max_episode_steps", "action_sizes", "layout", "is_capped", "source")
    }
    assert "action_mask" in arrays
    binned = as_problem("CartPole-v1", AdapterOptions(bins=[[0.0], 1, [-0.1, 0.1], [0.0]])).save()[1]
    assert {name: edges.tolist() for name, edges in binned.items()} == {
        "edges/0/000000": [0.0],
        "edges/0/000001": [],
        "edges/0/000002": [-0.1, 0.1],
        "edges/0/000003": [0.0],
    }


def test_names_that_a_user_gave_are_saved() -> None:
    lamp = TabularMDP([[0, 1]] * 2, [[0, 1]] * 2, [[True] * 2] * 2, action_names="ab", state_factors=[("lit", 2)])
    header, arrays = save_problem(lamp)
    again = restore_problem(json.loads(json.dumps(header)), arrays, None, PATH, AdapterOptions())
    assert (again.action_names, again.state_factors) == (("a", "b"), (("lit", 2),))


def test_a_file_with_a_kind_that_is_not_known_is_refused() -> None:
    with pytest.raises(SavedFileError, match="a problem of an unknown kind: import the module that registers it"):
        restore_problem({"kind": "lottery", "held": {}}, {}, None, PATH, AdapterOptions())


def test_a_heuristic_may_go_with_an_environment() -> None:
    from tuckerl.adapters.gymnasium_problem import GymnasiumProblem

    heuristic = np.arange(5.0)
    problem = GymnasiumProblem(Observes(Discrete(5)), "observes", heuristic=heuristic)
    np.testing.assert_array_equal(QLearning(problem, seed=0).problem.heuristic, heuristic)
    with pytest.raises(ProblemError, match="heuristic must be 5 finite numbers"):
        GymnasiumProblem(Observes(Discrete(5)), "observes", heuristic=heuristic[:3])
