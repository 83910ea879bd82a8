"""Maps of the robot rescue world: what is read from text and what is refused."""

import dataclasses
import time
from typing import Any

import pytest

from tuckerl.environments.robot_rescue import robot_rescue
from tuckerl.environments.robot_rescue_map import RescueMap, as_rescue_map
from tuckerl.errors import ParameterTypeError, ProblemError

SMALL = ".H..\n#...\nAT.B"


def test_the_default_map() -> None:
    world = RescueMap()
    assert (world.rows, world.columns, world.n_cells) == (8, 8, 64)
    assert world.object_cell == (5, 3)
    assert world.robot_cells == ((7, 0), (7, 7))
    assert {tuple(cell) for cell in zip(*world.homes.nonzero(), strict=True)} == {(0, 3), (0, 4)}
    obstacles = {(2, 3), (2, 4), (4, 0), (4, 1), (4, 6), (4, 7), (6, 1), (6, 6)}
    assert {tuple(cell) for cell in zip(*world.obstacles.nonzero(), strict=True)} == obstacles


def test_other_sizes_and_space_around_the_lines() -> None:
    world = RescueMap(f"\n   {SMALL.replace(chr(10), chr(10) + '      ')}  \n\n")
    assert world == RescueMap(SMALL)
    assert hash(world) == hash(RescueMap(SMALL))
    assert world != RescueMap()
    assert (world.text, world.rows, world.columns) == (SMALL, 3, 4)
    assert world.number((2, 1)) == 9
    assert world.cell(9) == (2, 1) == world.object_cell
    assert robot_rescue(world).n_states == (12 * 3) ** 2


def test_maps_are_read_only() -> None:
    world = RescueMap()
    with pytest.raises(ValueError, match="read-only"):
        world.obstacles[0, 0] = True
    with pytest.raises(dataclasses.FrozenInstanceError):
        world.text = SMALL  # type: ignore[misc]  # that is the point


def test_what_may_be_given_for_a_map() -> None:
    world = RescueMap(SMALL)
    assert as_rescue_map(None) == RescueMap()
    assert as_rescue_map(world) is world
    assert as_rescue_map(SMALL) == world
    assert as_rescue_map(SMALL.split("\n")) == as_rescue_map(tuple(SMALL.split("\n"))) == world


@pytest.mark.parametrize("given", [3, b"ATB", [1, 2], {"map": SMALL}])
def test_other_things_are_no_maps(given: Any) -> None:
    with pytest.raises(ParameterTypeError, match="map must be a RescueMap, its text or a list of its rows; got"):
        as_rescue_map(given)
    with pytest.raises(ParameterTypeError, match="a map must be text, one line for each row; got"):
        RescueMap(given)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "at least one row; the text is empty"),
        (" \n ", "at least one row; the text is empty"),
        (".H..\nAT.B.", "equally long; row 0 has 4 cells and row 1 has 5"),
        (".H..\n\nAT.B", "equally long; row 0 has 4 cells and row 1 has 0"),
        (".H.x\nAT.B", r"made of \. # H T A B; got 'x' at \(0, 3\)"),
        (".H..\nAt.B", r"got 't' at \(1, 1\)"),
        (".H..\nA TB", r"got ' ' at \(1, 1\)"),
        ("....\nAT.B", "must have a home cell, 'H', .* it has none"),
        (".H..\nA..B", "exactly one 'T', the object; it has 0"),
        (".HT.\nAT.B", "exactly one 'T', the object; it has 2"),
        (".H..\n.T.B", "exactly one 'A', robot_0's first cell; it has 0"),
        (".H.A\nAT.B", "exactly one 'A', robot_0's first cell; it has 2"),
        (".H..\nAT..", "exactly one 'B', robot_1's first cell; it has 0"),
        (".H.B\nAT.B", "exactly one 'B', robot_1's first cell; it has 2"),
        ("." * 401, "at most 400 cells, .* got 1 rows of 401"),
        (("." * 1000 + "\n") * 1000, "at most 400 cells, .* got 1000 rows of 1000"),
    ],
)
def test_bad_maps_are_refused(text: str, message: str) -> None:
    with pytest.raises(ProblemError, match=message):
        RescueMap(text)


@pytest.mark.parametrize(
    "text",
    [
        ".H..\nT.AB",  # at the border
        "..H.\n...T\nAB..",
        ".H...\n.#T..\nA...B",  # an obstacle on one side
        ".H..#.\nAT.#.B",  # shut in
        "#####\nABT.H",  # both come from the left, and there is no way round
        ".H.#\nBAT.\n####",  # the one that is first grips at once and bars the way
    ],
)
def test_robots_that_cannot_grip_are_refused(text: str) -> None:
    with pytest.raises(ProblemError, match=r"the robots cannot come to stand left and right of the object at \("):
        RescueMap(text)


@pytest.mark.parametrize(
    "text",
    [
        "H....\n.ATB.\n.....",  # homes at the sides: a robot would have to be off the map
        "....H\n.ATB.\n.....",
        ".H...\n#.#..\nATB..",  # too narrow for three
        ".#H#.\n.....\n.ATB.",
        "H#...\n#....\nATB..",
    ],
)
def test_objects_that_cannot_be_carried_home_are_refused(text: str) -> None:
    with pytest.raises(ProblemError, match=r"the object cannot be carried from \(\d, \d\) to a home cell"):
        RescueMap(text)


def test_a_robot_may_have_to_make_way() -> None:
    # robot_0 is between robot_1 and the object, where robot_1 cannot pass it: robot_0 goes round, to the other side.
    RescueMap("......\n..##..\n..T.AB\n......\n.H....")
    RescueMap("BA.....\n###.T..\n.......\n...H...")


def test_the_largest_open_map_is_searched_in_a_moment() -> None:
    rows = [["."] * 20 for _ in range(20)]
    rows[0][1], rows[19][18], rows[19][0], rows[19][1] = "H", "T", "A", "B"
    start = time.process_time()
    RescueMap("\n".join("".join(row) for row in rows))
    # The worst there is: all pairs of cells are tried, and none will do.
    rows[18][19] = rows[19][19] = "#"
    with pytest.raises(ProblemError, match="the robots cannot come"):
        RescueMap("\n".join("".join(row) for row in rows))
    assert time.process_time() - start < 10
