"""A step of Team-Q against the same in C, written to win: two agents of five actions, each exploring on its own."""

import ctypes
from collections.abc import Callable

import numpy as np

from benchmarks import c_peer
from benchmarks.timing import Row, compare, seconds
from tuckerl import TabularMDP, TeamQ
from tuckerl.types import FloatArray

ACTION_SIZES = (5, 5)
SIZES = ((1404, 400), (36864, 200))
"""How many joint states, and for how many episodes they are played: the larger table is robot rescue's."""

HORIZON = 500
ALPHA, GAMMA, LAMBDA, EPSILON = 0.1, 0.95, 0.95, 0.1


def rows() -> list[Row]:
    """Time a step on a small table and on one as large as robot rescue's."""
    return [_row(*size) for size in SIZES]


def against_c() -> list[Row]:
    """Time the small one: the large one is the memory's."""
    return [_row(*SIZES[0])]


def world(n_states: int) -> TabularMDP:
    """Return a random table without ends, whose actions are joint ones."""
    rng = np.random.default_rng(n_states)
    shape = (n_states, int(np.prod(ACTION_SIZES)))
    return TabularMDP(
        rng.integers(n_states, size=shape),
        rng.normal(size=shape),
        np.zeros(shape, dtype=bool),
        max_episode_steps=HORIZON,
        action_sizes=ACTION_SIZES,
    )


def _row(n_states: int, episodes: int) -> Row:
    problem, steps = world(n_states), float(episodes * HORIZON)
    what = f"Team-Q, {n_states} x {problem.n_actions}"

    def ours() -> FloatArray:
        team = TeamQ(problem, alpha=ALPHA, gamma=GAMMA, lambda_=LAMBDA, epsilon=EPSILON, seed=0)
        table: FloatArray = team.learn(episodes).q[0]
        return table

    in_c = _in_c(problem, episodes)
    if in_c is None:
        return Row(what, "step", seconds(ours) / steps, c_peer.NO_COMPILER, None, None)
    if not np.allclose(in_c(), ours(), rtol=1e-9, atol=1e-9):
        raise RuntimeError("the loop in C does something else than the kernel: its time says nothing")
    return compare(what, "step", ours, "the same in C", in_c, units=steps)


def _in_c(problem: TabularMDP, episodes: int) -> Callable[[], FloatArray] | None:
    library = c_peer.compiled("team_q.c")
    if library is None:
        return None
    sizes = np.array(ACTION_SIZES, dtype=np.int64)
    outcomes = [np.ascontiguousarray(part) for part in (problem.arrays.next_state, problem.arrays.reward)]

    def play() -> FloatArray:
        q = np.zeros((problem.n_states, problem.n_actions))
        library.play(
            *map(c_peer.pointer, (*outcomes, sizes)),
            *map(ctypes.c_int64, (sizes.size, *q.shape, HORIZON, episodes)),
            *map(ctypes.c_double, (ALPHA, GAMMA, LAMBDA, EPSILON)),
            *map(c_peer.pointer, (c_peer.agents_stream(0), q)),
        )
        return q

    return play
