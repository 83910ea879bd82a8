"""Learners that plan against the same loops in C: Dyna-Q, and the queue of prioritized sweeping by its length."""

import ctypes
from collections.abc import Callable

import numpy as np

from benchmarks import c_peer
from benchmarks.c_peer import Played, agents_stream, pointer
from benchmarks.timing import Row, compare, seconds
from tuckerl import DynaQ, PrioritizedSweeping
from tuckerl._jit import kernel
from tuckerl.learners.priority_queue import PriorityQueue, empty_queue, insert, take_first
from tuckerl.problems.maze import random_maze
from tuckerl.problems.mdp import TabularMDP
from tuckerl.rng import uniform
from tuckerl.types import Stream

EPISODES, PLANNING_STEPS = 1000, 10
SOURCE = "dyna_q.c"
LENGTHS = (10**2, 10**3, 10**4, 10**5, 10**6)


def rows() -> list[Row]:
    """Time an update of Dyna-Q, one of prioritized sweeping, and a turn of queues of 100 to a million pairs."""
    problem = random_maze(seed=0).to_mdp()
    return [_dyna_q_row(problem), _sweeping_row(problem), *(_queue_row(n) for n in LENGTHS)]


def against_c() -> list[Row]:
    """Time an update of Dyna-Q alone, a few times."""
    return [_dyna_q_row(random_maze(seed=0).to_mdp(), repeats=3)]


def _dyna_q_row(problem: TabularMDP, repeats: int = 9) -> Row:
    what = f"Dyna-Q, {PLANNING_STEPS} planning steps"
    played = DynaQ(problem, planning_steps=PLANNING_STEPS, seed=0).learn(EPISODES)
    updates = (1 + PLANNING_STEPS) * float(played.steps.sum())

    def ours() -> None:
        DynaQ(problem, planning_steps=PLANNING_STEPS, seed=0).learn(EPISODES)

    in_c = _dyna_q_in_c(problem)
    if in_c is None:
        return Row(what, "update", seconds(ours) / updates, c_peer.NO_COMPILER, None, None)
    q, steps = in_c()
    if not (np.array_equal(q, played.q[0]) and np.array_equal(steps, played.steps[:, 0])):
        raise RuntimeError("the loop in C does something else than the kernel: its time says nothing")
    return compare(what, "update", ours, "the same loop in C", in_c, units=updates, repeats=repeats)


def _dyna_q_in_c(problem: TabularMDP) -> Callable[[], Played] | None:
    library = c_peer.compiled(SOURCE)
    if library is None:
        return None
    arrays = problem.arrays
    outcomes = [np.ascontiguousarray(part) for part in (arrays.next_state, arrays.reward, arrays.terminated)]
    weights = np.ones(problem.n_actions)

    def play() -> Played:
        q, steps = np.zeros((problem.n_states, problem.n_actions)), np.zeros(EPISODES, dtype=np.int64)
        rng = agents_stream(0)
        library.play(
            *map(pointer, outcomes),
            *map(ctypes.c_int64, (problem.n_states, problem.n_actions, int(arrays.start_state[0]))),
            *map(ctypes.c_int64, (arrays.max_episode_steps, EPISODES, PLANNING_STEPS)),
            *map(ctypes.c_double, (0.1, 0.95, 0.1)),
            *map(pointer, (weights, rng, q, steps)),
        )
        return q, steps

    return play


def _sweeping_row(problem: TabularMDP) -> Row:
    """Time a real step of prioritized sweeping: how many updates it makes depends on the queue."""

    def ours() -> None:
        PrioritizedSweeping(problem, planning_steps=PLANNING_STEPS, seed=0).learn(EPISODES)

    steps = float(PrioritizedSweeping(problem, planning_steps=PLANNING_STEPS, seed=0).learn(EPISODES).steps.sum())
    what = f"Prioritized sweeping, up to {PLANNING_STEPS}"
    return Row(what, "real step", min(seconds(ours) for _ in range(3)) / steps, "-", None, None)


@kernel
def turn_over(queue: PriorityQueue, n: int, n_turns: int, rng: Stream) -> float:
    """Fill a queue, then take the first pair out and put it in again with a lower priority; `rng` is (4,) uint64."""
    total: float = 0.0
    for turn in range(n + n_turns):
        pair, priority = turn, uniform(rng)
        if turn >= n:
            priority *= queue.entry[0]["priority"]
            pair = take_first(queue)
            total += pair
        insert(queue, pair, priority)
    total += queue.place[n - 1]
    return total


def _queue_row(n: int) -> Row:
    n_turns = max(200_000, 2 * n)

    def ours() -> float:
        return turn_over(empty_queue(n, 1), n, n_turns, agents_stream(0))

    library, what = c_peer.compiled(SOURCE), f"a queue of {n:,}: take and insert"
    if library is None:
        return Row(what, "turn", seconds(ours) / n_turns, c_peer.NO_COMPILER, None, None)
    library.turn_over.restype = ctypes.c_double

    def in_c() -> float:
        rng = agents_stream(0)
        found: float = library.turn_over(ctypes.c_int64(n), ctypes.c_int64(n_turns), pointer(rng))
        return found

    if ours() != in_c():
        raise RuntimeError("the queue in C does something else than the kernels: its time says nothing")
    return compare(what, "turn", ours, "the same queue in C", in_c, units=float(n_turns), repeats=3)
