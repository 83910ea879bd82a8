"""A step of Q-learning and SARSA on random tables, against Q-learning in C++: written plainly, and with every trick."""

import ctypes
from collections.abc import Callable

import numpy as np

from benchmarks import c_peer
from benchmarks.timing import Row, compare, seconds
from tuckerl import QLearning, Sarsa, TabularMDP
from tuckerl.training.learner import Learner
from tuckerl.training.row_maxima import ROW

SIZES = ((110, 21), (1404, 4), (36864, 25))
STEPS, SEED = 500, 88172645463325252


def rows() -> list[Row]:
    """Time a step at three sizes: episodes of 500 steps that never end before, epsilon 0.1."""
    return [row for size in SIZES for row in _rows(*size)]


def against_c() -> list[Row]:
    """Time a step at the two smaller sizes: the largest is the memory's."""
    return [row for size in SIZES[:2] for row in _rows(*size)]


def random_table(n_states: int, n_actions: int) -> TabularMDP:
    """Return a problem in which every pair leads anywhere and pays anything from 0 to 1."""
    rng = np.random.default_rng(n_states)
    shape = (n_states, n_actions)
    return TabularMDP(
        rng.integers(0, n_states, shape), rng.random(shape), np.zeros(shape, bool), max_episode_steps=STEPS
    )


def _rows(n_states: int, n_actions: int) -> list[Row]:
    problem, episodes = random_table(n_states, n_actions), 2000
    size, library = f"{n_states} x {n_actions}", c_peer.compiled("q_learning.cpp")
    learners: list[Learner] = [kind(problem, alpha=0.1, gamma=0.95, epsilon=0.1, seed=0) for kind in (QLearning, Sarsa)]

    def in_cpp(name: str) -> Callable[[], object]:
        arrays, state = problem.arrays, np.array([SEED], dtype=np.uint64)
        parts = [np.ascontiguousarray(part) for part in (arrays.next_state, arrays.reward)]
        if name == "followed":
            parts = [arrays.outcomes, np.zeros(n_states, dtype=ROW)]
        table, numbers = np.zeros((n_states, n_actions)), (n_actions, episodes, STEPS)
        play = getattr(library, name)
        return lambda: play(
            *map(c_peer.pointer, (*parts, table)), *map(ctypes.c_size_t, numbers), c_peer.pointer(state)
        )

    found = []
    for learner in learners:
        what = f"{type(learner).__name__}, {size}"

        def ours(learner: Learner = learner) -> object:
            return learner.learn(episodes)

        if library is None:
            found.append(Row(what, "step", seconds(ours) / (episodes * STEPS), c_peer.NO_COMPILER, None, None))
            continue
        for peer, name in (("Q-learning in C++, two passes", "two_passes"), ("in C++, maxima followed", "followed")):
            found.append(compare(what, "step", ours, peer, in_cpp(name), units=episodes * STEPS, repeats=7))
    return found
