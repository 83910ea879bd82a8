"""The robot rescue world's table: against the rules read one by one, by hand, and through a delivery."""

import time
from collections.abc import Iterable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from tests.reference import robot_rescue as reference
from tuckerl.environments.robot_rescue import first_state, robot_rescue, scene
from tuckerl.environments.robot_rescue_map import DEFAULT_MAP, RescueMap
from tuckerl.errors import ParameterError, ProblemError
from tuckerl.problems.mdp import TabularMDP
from tuckerl.types import BoolArray

LEFT, RIGHT, UP, DOWN, STAY = range(5)

MAPS = {
    "default": DEFAULT_MAP,
    "one row": "AH.T.B",
    "first cells that grip": ".H.\nATB\n...",
    "one grips at first": ".H...\n.AT.B\n.....",
    "narrow ways": ".H.#\n....\n.T..\n....\nA##B",
    "the robots beside each other": "AB..\n.T..\n.HH.",
}


def shaped(mdp: TabularMDP) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
    shape = (mdp.n_states, mdp.n_actions)
    arrays = mdp.arrays
    return arrays.next_state.reshape(shape), arrays.reward.reshape(shape), arrays.terminated.reshape(shape)


def assert_same_as_the_rules(text: str, *, cost: float = 0.25, grip: float = 3.0, delivery: float = 7.0) -> int:
    """Compare all reachable joint states and all joint actions; return the number of those states."""
    mdp = robot_rescue(text, step_cost=cost, grip_reward=grip, delivery_reward=delivery)
    next_state, reward, terminated = shaped(mdp)
    world, first = reference.read(text)
    assert mdp.arrays.start_state.tolist() == [reference.number(world, first)]
    outcomes = reference.reachable(world, first)
    for now, then in outcomes.items():
        state = reference.number(world, now)
        if not then:
            assert (next_state[state] == state).all()
            assert (reward[state] == 0).all()
            assert terminated[state].all()
            continue
        assert next_state[state].tolist() == [reference.number(world, after) for after, _, _ in then], now
        expected = [grip * grips + delivery * home - cost for _, grips, home in then]
        assert reward[state].tolist() == expected, now
        assert terminated[state].tolist() == [home for _, _, home in then], now
    return len(outcomes)


@pytest.mark.parametrize("name", MAPS)
def test_every_reachable_step_is_what_the_rules_say(name: str) -> None:
    assert_same_as_the_rules(MAPS[name])


def test_sizes_of_the_default_world() -> None:
    mdp = robot_rescue()
    assert (mdp.n_states, mdp.n_actions, mdp.action_sizes) == (192 * 192, 25, (5, 5)) == (36_864, 25, (5, 5))
    assert mdp.arrays.next_state.size == 921_600
    assert mdp.max_episode_steps == 1000
    assert robot_rescue(max_episode_steps=None).max_episode_steps is None
    assert assert_same_as_the_rules(DEFAULT_MAP) == 3040


@st.composite
def small_maps(draw: st.DrawFn) -> str:
    rows, columns = draw(st.integers(1, 5)), draw(st.integers(3, 6))
    cells = [(row, column) for row in range(rows) for column in range(columns)]
    # A robot stands on either side of the object, so it is neither gripped nor delivered at the border.
    inner = draw(st.permutations([cell for cell in cells if 0 < cell[1] < columns - 1]))
    others = draw(st.permutations([cell for cell in cells if cell not in inner[:2]]))
    obstacles = draw(st.integers(0, len(cells) // 3))
    marks = dict(zip(inner[:2], "TH", strict=False)) | dict(zip(others, "ABH" + "#" * obstacles, strict=False))
    return "\n".join("".join(marks.get((row, column), ".") for column in range(columns)) for row in range(rows))


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(small_maps().filter(lambda text: all(text.count(mark) == 1 for mark in "TAB") and "H" in text))
def test_random_worlds_follow_the_rules(text: str) -> None:
    world, first = reference.read(text)
    if any(home for then in reference.reachable(world, first).values() for _, _, home in then):
        assert_same_as_the_rules(text)
    else:
        with pytest.raises(ProblemError, match=r"the robots cannot come|the object cannot be carried"):
            RescueMap(text)


def test_every_joint_state_leads_somewhere_possible_and_the_impossible_to_themselves() -> None:
    next_state, reward, terminated = shaped(robot_rescue(step_cost=0.1))
    states = np.arange(next_state.shape[0])[:, np.newaxis]
    dead: BoolArray = np.logical_and.reduce(terminated, axis=1)
    # Possible: neither grips, one does, both do with the object not home yet; counted by hand from the map.
    free_cells = 64 - 8
    apart = free_cells - 1 - 2  # cells for a robot that does not grip
    pairs = apart * (apart - 1) + 2 * 2 * apart
    assert (~dead).sum() == pairs + 2 * places_of_the_group()
    assert (next_state[dead] == states[dead]).all()
    assert (reward[dead] == 0).all()
    going_on: BoolArray = ~terminated
    assert not dead[next_state[going_on]].any()
    assert (reward[~dead] >= -0.1).all()


def places_of_the_group() -> int:
    """Cells for the object with free cells on both sides, homes left out (it is home there)."""
    lines = DEFAULT_MAP.split("\n")
    return sum("#" not in line[c - 1 : c + 2] and line[c] != "H" for line in lines for c in range(1, 7))


def test_robots_are_numbered_in_c_order() -> None:
    # robot_0 at (7, 0), robot_1 at (7, 7), nobody grips
    start = np.ravel_multi_index((56 * 3, 63 * 3), (192, 192))
    assert first_state(RescueMap()) == start
    next_state, _, _ = shaped(robot_rescue())
    action = np.ravel_multi_index((UP, LEFT), (5, 5))
    assert next_state[start, action] == np.ravel_multi_index((48 * 3, 62 * 3), (192, 192))


def steps(mdp: TabularMDP, actions: Iterable[tuple[int, int]]) -> list[tuple[int, int, float, bool]]:
    """Both robots' own states, the reward and the end after each step from the first state."""
    next_state, reward, terminated = shaped(mdp)
    own_size = round(mdp.n_states**0.5)
    state = int(mdp.arrays.start_state[0])
    seen = []
    for one, other in actions:
        action = one * 5 + other
        paid, end = float(reward[state, action]), bool(terminated[state, action])
        state = int(next_state[state, action])
        seen.append((*divmod(state, own_size), paid, end))
    return seen


DELIVERY = [
    (UP, UP),
    (UP, UP),
    (RIGHT, LEFT),
    (RIGHT, LEFT),  # robot_0 grips
    (DOWN, LEFT),  # robot_0 is pinned, robot_1 grips
    *[(move, move) for move in (UP, UP, LEFT, LEFT, UP, UP, UP, RIGHT, RIGHT)],
]


def test_golden_delivery() -> None:
    seen = steps(robot_rescue(), DELIVERY)
    # (cell, grip): the numbers 8 * row + column were read off the map.
    robot_0 = [48, 40, 41, 42, 42, 34, 26, 25, 24, 16, 8, 0, 1, 2]
    robot_1 = [55, 47, 46, 45, 44, 36, 28, 27, 26, 18, 10, 2, 3, 4]
    assert [own // 3 for own, *_ in seen] == robot_0
    assert [own // 3 for _, own, *_ in seen] == robot_1
    assert [own % 3 for own, *_ in seen] == [0] * 3 + [1] * 11
    assert [own % 3 for _, own, *_ in seen] == [0] * 4 + [2] * 10
    assert [paid for *_, paid, _ in seen] == [0, 0, 0, 1, 1, *[0] * 8, 10]
    assert [end for *_, end in seen] == [False] * 13 + [True]


def least_steps(mdp: TabularMDP) -> int:
    next_state, _, terminated = shaped(mdp)
    reached = np.zeros(mdp.n_states, dtype=np.bool_)
    reached[mdp.arrays.start_state] = True
    for count in range(1, mdp.n_states):
        if terminated[reached].any():
            return count
        reached[next_state[reached].ravel()] = True
    raise AssertionError("no delivery")


def test_the_shortest_delivery_takes_14_steps() -> None:
    assert least_steps(robot_rescue()) == 14 == len(DELIVERY)


def test_both_may_grip_at_once_and_homes_may_be_walked_on() -> None:
    seen = steps(robot_rescue("AH.T.HB"), [(LEFT, RIGHT), (RIGHT, LEFT), (RIGHT, LEFT)])
    assert seen == [(0, 18, 0.0, False), (3, 15, 0.0, False), (2 * 3 + 1, 4 * 3 + 2, 2.0, False)]


def own(*cells: int) -> list[int]:
    return [cell * 3 for cell in cells]


@pytest.mark.parametrize(
    ("text", "actions", "robots"),
    [
        # Row 0 is cells 0 to 5; a robot may follow into the cell that the other one leaves, in either order.
        ("AB....\n....H.\n...T..\n......", (RIGHT, RIGHT), (1, 2)),
        ("BA....\n....H.\n...T..\n......", (RIGHT, RIGHT), (2, 1)),
        ("AB....\n....H.\n...T..\n......", (RIGHT, DOWN), (1, 7)),
        ("AB....\n....H.\n...T..\n......", (RIGHT, LEFT), (0, 1)),  # swapping
        ("AB....\n....H.\n...T..\n......", (RIGHT, STAY), (0, 1)),
        ("AB....\n....H.\n...T..\n......", (RIGHT, UP), (0, 1)),  # held up by the border, it leaves nothing
        ("AB#...\n....H.\n...T..\n......", (RIGHT, RIGHT), (0, 1)),  # ... and by an obstacle
        ("A.B...\n....H.\n...T..\n......", (RIGHT, LEFT), (0, 2)),  # one cell for both
        ("A.....\nB...H.\n...T..\n......", (DOWN, DOWN), (6, 12)),
        ("A.....\nB...H.\n...T..\n......", (LEFT, UP), (0, 6)),
        ("...A..\n..B.H.\n...T..\n......", (DOWN, RIGHT), (3, 8)),
        ("......\n..BAH.\n...T..\n......", (DOWN, RIGHT), (9, 8)),  # held up by the object
    ],
)
def test_free_robots_by_hand(text: str, actions: tuple[int, int], robots: tuple[int, int]) -> None:
    (one, other, paid, end), *_ = steps(robot_rescue(text), [actions])
    assert [one, other] == own(*robots)
    assert (paid, end) == (0, False)


def test_a_robot_held_up_by_the_object_blocks_the_one_behind() -> None:
    mdp = robot_rescue(".A.\n.B.\n.T.\n.H.\n...")
    assert steps(mdp, [(DOWN, DOWN)]) == [(1 * 3, 4 * 3, 0.0, False)]


def test_one_gripping_robot_waits_for_the_other() -> None:
    mdp = robot_rescue(".H...\n.AT.B\n.....")
    assert mdp.arrays.start_state.tolist() == [(6 * 3 + 1) * 45 + 9 * 3]
    seen = steps(mdp, [(UP, STAY), (LEFT, UP), (DOWN, DOWN), (STAY, LEFT)])
    assert [one for one, *_ in seen] == [6 * 3 + 1] * 4
    assert [paid for *_, paid, _ in seen] == [0, 0, 0, 1]


@pytest.mark.parametrize("actions", [(LEFT, RIGHT), (UP, DOWN), (STAY, STAY), (UP, STAY), (STAY, UP)])
def test_the_group_moves_by_agreement_only(actions: tuple[int, int]) -> None:
    ((one, other, paid, end),) = steps(robot_rescue(".....\n.ATB.\n...H.\n....."), [actions])
    assert (one, other, paid, end) == (6 * 3 + 1, 8 * 3 + 2, 0.0, False)


def test_the_group_steps_into_its_own_cells_and_not_into_others() -> None:
    world = "..#....\n.ATB...\n....#..\n.H....."
    ways = [UP, RIGHT, UP, DOWN, RIGHT, DOWN, RIGHT, DOWN, RIGHT]
    seen = steps(robot_rescue(world), [(way, way) for way in ways])
    # In the way: the object's, the left one's, the right one's, the object's, the left one's; at last the border.
    assert [one // 3 - 7 for one, *_ in seen] == [1, 2, 2, 2, 3, 3, 4, 4, 4]
    assert [other - one for one, other, *_ in seen] == [2 * 3 + 1] * 9


def test_rewards_can_be_chosen_and_every_step_costs() -> None:
    seen = steps(robot_rescue(step_cost=0.5, grip_reward=2, delivery_reward=-3), DELIVERY)
    assert [paid for *_, paid, _ in seen] == [-0.5] * 3 + [1.5, 1.5] + [-0.5] * 8 + [-3.5]


def test_scenes() -> None:
    world = RescueMap()
    assert scene(world, first_state(world)) == ((56, 63), (0, 0), 43)
    for (one, other, *_), thing in zip(steps(robot_rescue(), DELIVERY)[3:6], (43, 43, 35), strict=True):
        shown = scene(world, one * 192 + other)
        assert shown.object == thing
        assert shown.robots == (one // 3, other // 3)
        assert shown.grips == (one % 3, other % 3)
    mirrored = RescueMap(".H.\nBTA\n...")
    assert scene(mirrored, first_state(mirrored)) == ((5, 3), (2, 1), 4)


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"step_cost": -0.1}, r"step_cost must be a finite number of at least 0; got -0.1"),
        ({"step_cost": float("nan")}, "step_cost must be"),
        ({"grip_reward": float("inf")}, "grip_reward must be a finite number; got inf"),
        ({"delivery_reward": float("nan")}, "delivery_reward must be a finite number; got nan"),
        ({"max_episode_steps": 0}, "max_episode_steps must be a whole number of at least 1; got 0"),
    ],
)
def test_bad_numbers_are_refused(parameters: Any, message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        robot_rescue(**parameters)


def test_the_table_is_made_in_a_moment() -> None:
    start = time.process_time()
    robot_rescue()
    assert time.process_time() - start < 1
