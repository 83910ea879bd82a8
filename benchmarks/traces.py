"""SARSA(lambda): the postponed sweep against the literal one, itself in C, and lists of active traces."""

import ctypes
from collections.abc import Callable

import numpy as np

from benchmarks import c_peer
from benchmarks.timing import Row, compare, seconds
from tuckerl import SarsaLambda, TabularMDP
from tuckerl.types import FloatArray

SIZES = ((110, 21), (1404, 4), (36864, 25))
HORIZON, ALPHA, GAMMA, LAMBDA, EPSILON = 500, 0.1, 0.95, 0.95, 0.1


def rows() -> list[Row]:
    """Time a step at the sizes of the paper's three tables, and from 110 to a million states."""
    found = [row for size in SIZES for row in _rows(*size)]
    small, large = (_step_seconds(world(n, 4), 400) for n in (110, 1_000_000))
    return [
        *found,
        Row("a step, 1,000,000 states against 110, 4 actions", "step", large, "110 states", small, small / large),
    ]


def world(n_states: int, n_actions: int) -> TabularMDP:
    """Return a random table without ends: each pair leads somewhere and pays something."""
    rng = np.random.default_rng(0)
    shape = (n_states, n_actions)
    next_state, reward = rng.integers(n_states, size=shape), rng.normal(size=shape)
    return TabularMDP(next_state, reward, np.zeros(shape, dtype=bool), max_episode_steps=HORIZON)


def _learner(problem: TabularMDP) -> SarsaLambda:
    return SarsaLambda(problem, alpha=ALPHA, gamma=GAMMA, lambda_=LAMBDA, epsilon=EPSILON, seed=0)


def _step_seconds(problem: TabularMDP, episodes: int) -> float:
    learner = _learner(problem).learn(episodes // 4)  # first touches of memory are the operating system's work
    return min(seconds(lambda: learner.learn(episodes)) for _ in range(5)) / (episodes * HORIZON)


def _rows(n_states: int, n_actions: int) -> list[Row]:
    problem, episodes = world(n_states, n_actions), 200
    steps = episodes * HORIZON
    what = f"SARSA(lambda), {n_states} x {n_actions}"

    def ours() -> FloatArray:
        table: FloatArray = _learner(problem).learn(episodes).q[0]
        return table

    found = []
    for name, peer in (("postponed", "the same in C"), ("active_list", "C, active list, cut 1e-6")):
        in_c = _in_c(problem, name, episodes)
        if in_c is None:
            found.append(Row(what, "step", seconds(ours) / steps, c_peer.NO_COMPILER, None, None))
            continue
        if name == "postponed" and not np.allclose(in_c(), ours(), rtol=1e-9, atol=1e-9):
            raise RuntimeError("the loop in C does something else than the kernel: its time says nothing")
        found.append(compare(what, "step", ours, peer, in_c, units=steps))
    few = 200 if n_states < 10_000 else 20
    literal = compare(
        what,
        "step",
        ours,
        "the literal sweep in NumPy",
        lambda: _literal(problem, few),
        units=steps,
        peer_units=few,
        repeats=3,
    )
    return [*found, literal]


def _in_c(problem: TabularMDP, name: str, episodes: int) -> Callable[[], FloatArray] | None:
    library = c_peer.compiled("sarsa_lambda")
    if library is None:
        return None

    def play() -> FloatArray:
        q = np.zeros((problem.n_states, problem.n_actions))
        getattr(library, name)(
            *map(c_peer.pointer, (problem.arrays.next_state, problem.arrays.reward)),
            *map(ctypes.c_int64, (problem.n_states, problem.n_actions, HORIZON, episodes)),
            *map(ctypes.c_double, (ALPHA, GAMMA, LAMBDA, EPSILON)),
            *map(c_peer.pointer, (c_peer.agents_stream(0), q)),
        )
        return q

    return play


def _literal(problem: TabularMDP, n_steps: int) -> None:
    """Do the steps of Figure 2 as they are printed, over the whole table."""
    rng = np.random.default_rng(0)
    q, trace = np.zeros((2, problem.n_states, problem.n_actions))
    next_state = problem.arrays.next_state.reshape(q.shape)
    reward = problem.arrays.reward.reshape(q.shape)
    state, action = 0, 0
    for _ in range(n_steps):
        there = next_state[state, action]
        after = int(rng.integers(q.shape[1])) if rng.random() < EPSILON else int(q[there].argmax())
        delta = reward[state, action] + GAMMA * q[there, after] - q[state, action]
        trace[state, action] = 1.0
        q += ALPHA * delta * trace
        trace *= GAMMA * LAMBDA
        state, action = there, after
