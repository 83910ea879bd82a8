"""Learners with traces: the postponed sweep against the literal one, itself in C, and lists of active traces."""

import ctypes
from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks import c_peer
from benchmarks.timing import Row, compare, seconds
from tuckerl import SarsaLambda, TabularMDP, TrueOnlineSarsaLambda, WatkinsQLambda
from tuckerl.types import FloatArray, IntArray

SIZES = ((110, 21), (1404, 4), (36864, 25))
EPISODES, MORE, HORIZON = 200, 1000, 500
ALPHA, GAMMA, LAMBDA, EPSILON = 0.1, 0.95, 0.95, 0.1
PARAMETERS = {"alpha": ALPHA, "gamma": GAMMA, "lambda_": LAMBDA}
LISTS = "C, active list, cut 1e-6"


def rows() -> list[Row]:
    """Time a step at the sizes of the paper's three tables, and from 110 to a million states."""
    found = [row for size in SIZES for row in _rows(*size)]
    found += [row for size in SIZES[:2] for row in _further_rows(world(*size))]
    for name, make in (("a grid", grid), ("anywhere", world)):
        small, large = _step_seconds(make(110, 4), 400), _step_seconds(make(1_000_000, 4), 400)
        what = f"a step {name}: 1,000,000 states, 4 actions"
        found.append(Row(what, "step", large, "110 states", small, small / large))
    return found


def world(n_states: int, n_actions: int) -> TabularMDP:
    """Return a random table without ends: each pair leads anywhere, so that every step misses the caches."""
    rng = np.random.default_rng(0)
    return _table(rng.integers(n_states, size=(n_states, n_actions)), rng)


def grid(n_states: int, n_actions: int) -> TabularMDP:
    """Return a torus of cells without ends: each pair leads to a neighbour, as in most worlds."""
    columns = max(d for d in range(1, int(n_states**0.5) + 1) if n_states % d == 0)
    moves = np.array([-columns, columns, -1, 1])[:n_actions]
    return _table((np.arange(n_states)[:, None] + moves) % n_states, np.random.default_rng(0))


def _table(next_state: IntArray, rng: np.random.Generator) -> TabularMDP:
    endless = np.zeros(next_state.shape, dtype=bool)
    return TabularMDP(next_state, rng.normal(size=next_state.shape), endless, max_episode_steps=HORIZON)


def _learner(problem: TabularMDP, epsilon: float = EPSILON) -> SarsaLambda:
    return SarsaLambda(problem, alpha=ALPHA, gamma=GAMMA, lambda_=LAMBDA, epsilon=epsilon, seed=0)


def _step_seconds(problem: TabularMDP, episodes: int) -> float:
    learner = _learner(problem).learn(episodes // 4)  # first touches of memory are the operating system's work
    return min(seconds(lambda: learner.learn(episodes)) for _ in range(5)) / (episodes * HORIZON)


def against_c() -> list[Row]:
    """Time a step at the two smaller sizes against C alone."""
    problems = [world(*size) for size in SIZES[:2]]
    return [row for problem in problems for row in (*_rows_against_c(problem), *_further_rows(problem))]


def _rows(n_states: int, n_actions: int) -> list[Row]:
    problem = world(n_states, n_actions)
    few = 200 if n_states < 10_000 else 20

    def ours() -> None:
        _learner(problem).learn(EPISODES)

    def literal() -> None:
        _literal(problem, few)

    name, units = "the literal sweep in NumPy", EPISODES * HORIZON
    literally = compare(_name(problem), "step", ours, name, literal, units=units, peer_units=few, repeats=3)
    return [*_rows_against_c(problem), literally]


def _name(problem: TabularMDP) -> str:
    return f"SARSA(lambda), {problem.n_states} x {problem.n_actions}"


def _rows_against_c(problem: TabularMDP) -> list[Row]:
    what, steps = _name(problem), EPISODES * HORIZON

    def ours(epsilon: float = EPSILON) -> FloatArray:
        table: FloatArray = _learner(problem, epsilon).learn(EPISODES).q[0]
        return table

    source = "sarsa_lambda.c"
    same, lists = _in_c(problem, source, "postponed"), _in_c(problem, source, "active_list")
    wide = _in_c(problem, source, "active_list", epsilon=1.0)  # random actions visit the most pairs: long lists
    if same is None or lists is None or wide is None:
        return [Row(what, "step", seconds(ours) / steps, c_peer.NO_COMPILER, None, None)]
    if not np.allclose(same(), ours(), rtol=1e-9, atol=1e-9):
        raise RuntimeError("the loop in C does something else than the kernel: its time says nothing")
    return [
        compare(what, "step", ours, "the same in C", same, units=steps),
        compare(what, "step", ours, LISTS, lists, units=steps),
        compare(f"{what}, epsilon 1", "step", lambda: ours(1.0), LISTS, wide, units=steps),
    ]


def _further_rows(problem: TabularMDP) -> list[Row]:
    """Time Watkins' Q(lambda), whose traces are cut, and true online SARSA(lambda) against the same in C."""
    kinds = {
        "Watkins' Q(lambda)": (
            WatkinsQLambda,
            "watkins_q_lambda.c",
            {"the same in C": "postponed", LISTS: "active_list"},
        ),
        "true online": (TrueOnlineSarsaLambda, "true_online_sarsa_lambda.c", {"the same in C": "postponed"}),
    }
    found = []
    for name, (kind, source, peers) in kinds.items():
        what = f"{name}, {problem.n_states} x {problem.n_actions}"

        def ours(kind: Any = kind) -> FloatArray:
            table: FloatArray = kind(problem, **PARAMETERS, epsilon=EPSILON, seed=0).learn(MORE).q[0]
            return table

        for peer, function in peers.items():
            theirs = _in_c(problem, source, function, episodes=MORE)
            if theirs is None:
                return [Row(what, "step", seconds(ours) / (MORE * HORIZON), c_peer.NO_COMPILER, None, None)]
            if function == "postponed" and not np.allclose(theirs(), ours(), rtol=1e-9, atol=1e-9):
                raise RuntimeError("the loop in C does something else than the kernel: its time says nothing")
            found.append(compare(what, "step", ours, peer, theirs, units=MORE * HORIZON))
    return found


def _in_c(
    problem: TabularMDP, source: str, name: str, *, epsilon: float = EPSILON, episodes: int = EPISODES
) -> Callable[[], FloatArray] | None:
    library = c_peer.compiled(source)
    if library is None:
        return None
    outcomes = [np.ascontiguousarray(part) for part in (problem.arrays.next_state, problem.arrays.reward)]

    def play() -> FloatArray:
        q = np.zeros((problem.n_states, problem.n_actions))
        getattr(library, name)(
            *map(c_peer.pointer, outcomes),
            *map(ctypes.c_int64, (problem.n_states, problem.n_actions, HORIZON, episodes)),
            *map(ctypes.c_double, (ALPHA, GAMMA, LAMBDA, epsilon)),
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
