"""A step of Expected SARSA, Double Q-learning and n-step SARSA against the same in C, written to win."""

import ctypes
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from benchmarks import c_peer
from benchmarks.timing import Row, compare, seconds
from tuckerl import DoubleQLearning, ExpectedSarsa, NStepSarsa, TabularMDP
from tuckerl.training.learner import Learner
from tuckerl.types import FloatArray

SIZES = ((110, 21), (1404, 4))
EPISODES, LONGEST, ENDS = 5000, 500, 0.002
ALPHA, GAMMA, EPSILON = 0.1, 0.95, 0.1


class Peer(NamedTuple):
    """A learner and the same in C."""

    kind: type[Learner]
    own: dict[str, Any]
    function: str


PEERS = (
    Peer(ExpectedSarsa, {}, "expected_sarsa"),
    Peer(DoubleQLearning, {}, "double_q"),
    Peer(NStepSarsa, {"n": 4}, "n_step_sarsa"),
    Peer(NStepSarsa, {"n": 64}, "n_step_sarsa"),
)


def rows() -> list[Row]:
    """Time a step at two sizes, and with four steps and with many."""
    return [_row(world(*size), peer) for size in SIZES for peer in PEERS]


def against_c() -> list[Row]:
    """Time the learners at the smaller size, n-step SARSA with few steps, each a few times."""
    return [_row(world(*SIZES[0]), peer, repeats=3) for peer in PEERS[:3]]


def world(n_states: int, n_actions: int) -> TabularMDP:
    """Return a random table in which an episode ends after some hundred steps."""
    rng = np.random.default_rng(n_states)
    shape = (n_states, n_actions)
    return TabularMDP(
        rng.integers(n_states, size=shape), rng.random(shape), rng.random(shape) < ENDS, max_episode_steps=LONGEST
    )


def _row(problem: TabularMDP, peer: Peer, repeats: int = 15) -> Row:
    sizes = f"{problem.n_states} x {problem.n_actions}"
    what = ", ".join([peer.kind.__name__, *(f"{name}={value}" for name, value in peer.own.items()), sizes])

    def ours() -> Learner:
        own = {"alpha": ALPHA, "gamma": GAMMA, "epsilon": EPSILON, "seed": 0}
        return peer.kind(problem, **own | peer.own).learn(EPISODES)

    learner = ours()
    steps = float(learner.steps.sum())
    in_c = _in_c(problem, peer)
    if in_c is None:
        return Row(what, "step", seconds(ours) / steps, c_peer.NO_COMPILER, None, None)
    if not np.allclose(in_c(), learner.q[0], rtol=1e-9, atol=1e-9):
        raise RuntimeError("the loop in C does something else than the kernel: its time says nothing")
    return compare(what, "step", ours, "the same in C", in_c, units=steps, repeats=repeats)


def _in_c(problem: TabularMDP, peer: Peer) -> Callable[[], FloatArray] | None:
    library = c_peer.compiled("n_step.c")
    if library is None:
        return None
    arrays = problem.arrays
    outcomes = np.zeros(arrays.reward.size, [("reward", "f8"), ("next", "u4"), ("ends", "u4")])
    outcomes["reward"], outcomes["next"], outcomes["ends"] = arrays.reward, arrays.next_state, arrays.terminated

    def play() -> FloatArray:
        q = np.zeros((problem.n_states, problem.n_actions))
        getattr(library, peer.function)(
            c_peer.pointer(outcomes),
            *map(ctypes.c_int64, (*q.shape, *peer.own.values(), LONGEST, EPISODES)),
            *map(ctypes.c_double, (ALPHA, GAMMA, EPSILON)),
            *map(c_peer.pointer, (c_peer.agents_stream(0), q)),
        )
        return q

    return play
