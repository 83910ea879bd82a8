"""The robot rescue world rule by rule, for one joint state at a time.

Written from the rules in words: dictionaries and conditions, no arrays. Cells are pairs (row, column).
"""

from dataclasses import dataclass, replace

Cell = tuple[int, int]

DIRECTIONS = {0: (0, -1), 1: (0, 1), 2: (-1, 0), 3: (1, 0)}  # left, right, up, down; 4 stays


@dataclass(frozen=True)
class Situation:
    """Who is where, and who has gripped."""

    robots: tuple[Cell, Cell]
    gripped: tuple[bool, bool]
    object: Cell


@dataclass(frozen=True)
class World:
    """What never changes."""

    rows: int
    columns: int
    obstacles: frozenset[Cell]
    homes: frozenset[Cell]

    def stands(self, cell: Cell) -> bool:
        """Whether somebody can stand there."""
        return 0 <= cell[0] < self.rows and 0 <= cell[1] < self.columns and cell not in self.obstacles


def read(text: str) -> tuple[World, Situation]:
    """Return the world that a map shows, and the first situation in it."""
    lines = text.split("\n")
    marks = {(r, c): mark for r, line in enumerate(lines) for c, mark in enumerate(line)}
    at = {mark: cell for cell, mark in marks.items()}
    world = World(
        len(lines),
        len(lines[0]),
        frozenset(cell for cell, mark in marks.items() if mark == "#"),
        frozenset(cell for cell, mark in marks.items() if mark == "H"),
    )
    first = Situation((at["A"], at["B"]), (False, False), at["T"])
    return world, replace(first, gripped=(beside(first, 0), beside(first, 1)))


def beside(now: Situation, robot: int) -> bool:
    """Whether a robot stands directly left or right of the object."""
    row, column = now.object
    return now.robots[robot] in ((row, column - 1), (row, column + 1))


def step(world: World, now: Situation, actions: tuple[int, int]) -> tuple[Situation, int, bool]:
    """Return what comes next, how many robots have gripped in this step, and whether the object has come home."""
    if now.gripped == (True, True):
        moved = carry(world, now, actions)
        return moved, 0, moved.object in world.homes
    walked = search_control(world, now, actions)
    gripped = (beside(walked, 0), beside(walked, 1))
    new = sum(after and not before for before, after in zip(now.gripped, gripped, strict=True))
    return replace(walked, gripped=gripped), new, False


def carry(world: World, now: Situation, actions: tuple[int, int]) -> Situation:
    """Both have gripped: all three move, or nothing does."""
    if actions[0] != actions[1] or actions[0] == 4:
        return now
    down, right = DIRECTIONS[actions[0]]
    left_robot, right_robot, thing = ((r + down, c + right) for r, c in (*now.robots, now.object))
    if not (world.stands(left_robot) and world.stands(right_robot) and world.stands(thing)):
        return now
    return Situation((left_robot, right_robot), now.gripped, thing)


def search_control(world: World, now: Situation, actions: tuple[int, int]) -> Situation:
    """Robots that have not gripped move each for itself."""
    wishes = {}
    for robot in (0, 1):
        wishes[robot] = now.robots[robot]
        if not now.gripped[robot] and actions[robot] != 4:
            row, column = now.robots[robot]
            down, right = DIRECTIONS[actions[robot]]
            cell = (row + down, column + right)
            if world.stands(cell) and cell != now.object:
                wishes[robot] = cell
    moving = [robot for robot in (0, 1) if wishes[robot] != now.robots[robot]]
    if moving == [0, 1]:
        swap = wishes[0] == now.robots[1] and wishes[1] == now.robots[0]
        if swap or wishes[0] == wishes[1]:
            moving = []
    elif moving:
        (mover,) = moving
        if wishes[mover] == now.robots[1 - mover]:  # the other one stays there
            moving = []
    places = [wishes[robot] if robot in moving else now.robots[robot] for robot in (0, 1)]
    return replace(now, robots=(places[0], places[1]))


def number(world: World, now: Situation) -> int:
    """Return the joint state's number."""
    own = []
    for (row, column), gripped in zip(now.robots, now.gripped, strict=True):
        grip = 0
        if gripped:
            grip = 1 if now.object == (row, column + 1) else 2
            assert now.object in ((row, column + 1), (row, column - 1))
        own.append((row * world.columns + column) * 3 + grip)
    return own[0] * world.rows * world.columns * 3 + own[1]


def reachable(world: World, first: Situation) -> dict[Situation, list[tuple[Situation, int, bool]]]:
    """Return what each of the 25 joint actions does in every situation that can come up; nothing once it is home."""
    outcomes: dict[Situation, list[tuple[Situation, int, bool]]] = {}
    waiting = [first]
    while waiting:
        now = waiting.pop()
        if now in outcomes:
            continue
        outcomes[now] = []
        if now.object in world.homes:
            continue
        outcomes[now] = [step(world, now, (a, b)) for a in range(5) for b in range(5)]
        waiting += [then for then, _, _ in outcomes[now] if then not in outcomes]
    return outcomes
