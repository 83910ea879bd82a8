"""The robot rescue world as one table over joint states and joint actions (the paper's section IV.C, Figures 12, 13).

Two robots bring an object home together. A robot's own state is ``cell * 3 + grip``: 0 free, 1 the object is on its
right, 2 on its left. A joint state is ``own_0 * 3 * cells + own_1``, a joint action ``a_0 * 5 + a_1``: on 8 x 8 cells
192 x 192 = 36,864 states and 25 actions, the paper's 921,600 entries. One step is:

* A free robot moves where its action points, unless that cell is outside, an obstacle or the object. Then the other
  robot is asked: if both would come to stand on one cell, or would swap, both stay where they are. So a robot follows
  into the cell that the other really leaves, and a robot that stays, or is held up, keeps its cell.
* A free robot that stands directly left or right of the object after the step grips it in that same step, for good:
  it keeps its place until the other one grips, too. Until then the object is on its first cell.
* Once both grip, the three move together if both robots choose the same direction and the object's and both robots'
  new cells are on the map and no obstacles (the cells that they leave are in nobody's way). Else nothing moves.
* The episode ends when the object comes to a home cell.

A robot whose first cell is beside the object grips from the start; no step brought it there, so none pays for it.
A pair of own states that cannot be (two robots on one cell, a free one beside the object, grips that put the object on
different cells, ...) and one whose object is home already lead to themselves, pay nothing and end at once.
(L. Busoniu, R. Babuska, B. De Schutter, Multi-agent reinforcement learning: an overview, 2010.)
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tuckerl.checks import check_real
from tuckerl.environments.robot_rescue_map import (
    ACTION_NAMES,
    AGENTS,
    MOVES,
    NOWHERE,
    RescueMap,
    as_rescue_map,
    neighbours,
)
from tuckerl.problems.mdp import TabularMDP
from tuckerl.problems.parts import joint_names
from tuckerl.types import BoolArray, FloatArray, IntArray

GRIPS = 3
NOT_GRIPPING, ON_ITS_RIGHT, ON_ITS_LEFT = range(GRIPS)

_Pair = tuple[IntArray, IntArray]
"""Of each robot, in each of n joint states."""


@np.errstate(over="ignore")  # such rewards are refused with the table
def robot_rescue(
    map: RescueMap | str | Sequence[str] | None = None,  # noqa: A002  # the environment's own word
    *,
    step_cost: float = 0.0,
    grip_reward: float = 1.0,
    delivery_reward: float = 10.0,
    max_episode_steps: int | None = 1000,
) -> TabularMDP:
    """Return the robot rescue world as a finite MDP whose actions are joint ones.

    Parameters
    ----------
    map : RescueMap, str or list of str, optional
        Where everything is at first; by default a map of 8 x 8 cells.
    step_cost : float
        What every step costs, the last one too.
    grip_reward : float
        What each robot's grip pays the team.
    delivery_reward : float
        What the step that brings the object home pays.
    max_episode_steps : int, optional
        An episode is truncated after as many steps; None: never.

    Returns
    -------
    TabularMDP
        With ``action_sizes`` (5, 5).

    Raises
    ------
    ProblemError
        If the map cannot be used (see :class:`~tuckerl.environments.robot_rescue_map.RescueMap`).

    Examples
    --------
    >>> mdp = robot_rescue()
    >>> mdp.n_states, mdp.n_actions, mdp.action_sizes
    (36864, 25, (5, 5))
    """
    world = as_rescue_map(map)
    cost = check_real("step_cost", step_cost, 0.0)
    grip_reward = check_real("grip_reward", grip_reward)
    delivery_reward = check_real("delivery_reward", delivery_reward)
    n_states = (world.n_cells * GRIPS) ** 2
    n_actions = len(MOVES) ** 2
    next_state = np.repeat(np.arange(n_states, dtype=np.uint32)[:, np.newaxis], n_actions, axis=1)
    reward = np.zeros((n_states, n_actions))
    terminated = np.ones((n_states, n_actions), dtype=np.bool_)
    table = _Table(world)
    apart, together = table.possible_states()
    for action in range(n_actions):
        moves = divmod(action, len(MOVES))
        next_state[apart, action], grips = table.move_apart(apart, moves)
        reward[apart, action] = grip_reward * grips - cost
        terminated[apart, action] = False
        next_state[together, action], delivered = table.move_together(together, moves)
        reward[together, action] = delivery_reward * delivered - cost
        terminated[together, action] = delivered
    return TabularMDP(
        next_state,
        reward,
        terminated,
        start=first_state(world),
        max_episode_steps=max_episode_steps,
        action_sizes=(len(MOVES), len(MOVES)),
        action_names=joint_names([ACTION_NAMES] * len(AGENTS)),
        state_factors=[(agent, world.n_cells * GRIPS) for agent in AGENTS],
    )


def first_state(world: RescueMap) -> int:
    """Return the number of the joint state that episodes begin in."""
    beside = _grip_at(world)
    first, second = (world.number(cell) for cell in world.robot_cells)
    return int(np.ravel_multi_index((first, beside[first], second, beside[second]), _digits(world)))


class Scene(NamedTuple):
    """What a joint state shows."""

    robots: tuple[int, int]  # the numbers of their cells
    grips: tuple[int, int]
    object: int  # the number of its cell


def scene(world: RescueMap, state: int) -> Scene:
    """Return what the joint state number `state` shows; it must be a possible one."""
    first, first_grip, second, second_grip = (int(digit) for digit in np.unravel_index(state, _digits(world)))
    where = world.number(world.object_cell)
    if NOT_GRIPPING not in (first_grip, second_grip):
        where = first + (1 if first_grip == ON_ITS_RIGHT else -1)
    return Scene((first, second), (first_grip, second_grip), where)


def _digits(world: RescueMap) -> tuple[int, int, int, int]:
    """Return how many values each digit of a joint state's number has: cell and grip of either robot."""
    return world.n_cells, GRIPS, world.n_cells, GRIPS


class _Table:
    """The rules, for many joint states at once."""

    def __init__(self, world: RescueMap) -> None:
        self.digits = _digits(world)
        self.free: BoolArray = ~world.obstacles.ravel()
        self.home: BoolArray = world.homes.ravel()
        self.first: int = world.number(world.object_cell)
        self.grip_at = _grip_at(world)
        self.to = neighbours(world)

    def robots(self, states: IntArray) -> tuple[_Pair, _Pair]:
        """Return the cells of both robots, and their grips."""
        first, first_grip, second, second_grip = np.unravel_index(states, self.digits)
        return (first, second), (first_grip, second_grip)

    def numbers(self, cell: _Pair, grip: _Pair) -> IntArray:
        """Return the numbers of joint states; of one with a robot nowhere, any."""
        return np.ravel_multi_index((cell[0], grip[0], cell[1], grip[1]), self.digits, mode="clip")

    def possible_states(self) -> tuple[IntArray, IntArray]:
        """Return the joint states in which something can happen: not both grip; both grip and it is not home yet."""
        states = np.arange(math.prod(self.digits))
        cell, grip = self.robots(states)
        right = cell[0] != cell[1]
        # A free robot says that the object is where it was at first; a gripping one says where it holds it.
        places = []
        for c, g in zip(cell, grip, strict=True):
            right &= self.free[c] & ((g != NOT_GRIPPING) | ((self.grip_at[c] == NOT_GRIPPING) & (c != self.first)))
            places.append(np.where(g == NOT_GRIPPING, self.first, self.held(c, g)))
        right &= (places[0] == places[1]) & (places[0] != NOWHERE)
        both = (grip[0] != NOT_GRIPPING) & (grip[1] != NOT_GRIPPING)
        where = places[0]
        return states[right & ~both], states[right & both & ~self.home[where]]

    def held(self, cell: IntArray, grip: IntArray) -> IntArray:
        """Return the cell of the object that a robot grips; NOWHERE beyond the map or in an obstacle."""
        return self.to[cell, np.where(grip == ON_ITS_RIGHT, 1, 0)]

    def move_apart(self, states: IntArray, moves: tuple[int, int]) -> tuple[IntArray, FloatArray]:
        """Return the next states where not both robots grip, and how many grips each step makes."""
        cell, grip = self.robots(states)
        target = []
        for c, g, move in zip(cell, grip, moves, strict=True):
            to = self.to[c, move]
            target.append(np.where((to == NOWHERE) | (to == self.first) | (g != NOT_GRIPPING), c, to))
        clash = (target[0] == target[1]) | ((target[0] == cell[1]) & (target[1] == cell[0]))
        stand = np.where(clash, cell[0], target[0]), np.where(clash, cell[1], target[1])
        # A pinned robot stands beside the object, too: its grip comes out as it was.
        grips = self.grip_at[stand[0]], self.grip_at[stand[1]]
        made = (grips[0] != grip[0]).astype(np.float64) + (grips[1] != grip[1])
        return self.numbers(stand, grips), made

    def move_together(self, states: IntArray, moves: tuple[int, int]) -> tuple[IntArray, BoolArray]:
        """Return the next states where both robots grip, and whether the object comes home."""
        if moves[0] != moves[1]:
            return states, np.zeros(states.size, dtype=np.bool_)
        cell, grip = self.robots(states)
        to_0, to_1 = self.to[cell[0], moves[0]], self.to[cell[1], moves[0]]
        where = self.to[self.held(cell[0], grip[0]), moves[0]]
        goes = (to_0 != NOWHERE) & (to_1 != NOWHERE) & (where != NOWHERE)
        return np.where(goes, self.numbers((to_0, to_1), grip), states), goes & self.home[where]


def _grip_at(world: RescueMap) -> IntArray:
    """Return the grip of a robot on each cell while the object is on its first one."""
    grip = np.full((world.rows, world.columns), NOT_GRIPPING)
    row, column = world.object_cell
    grip[row, max(column - 1, 0) : column] = ON_ITS_RIGHT
    grip[row, column + 1 : column + 2] = ON_ITS_LEFT
    return grip.ravel()
