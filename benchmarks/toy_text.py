"""Gymnasium's toy-text environments, lifted into the kernel: Q-learning against the plain loop and against table-rl."""

import json
import statistics
import subprocess
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path

import gymnasium
import numpy as np

from benchmarks.peer_environment import own_python
from benchmarks.timing import Row, compare, seconds
from tuckerl import QLearning, TabularMDP
from tuckerl.adapters.transition_tables import extract_transition_table

EPISODES = {"FrozenLake8x8-v1": 30_000, "CliffWalking-v1": 50_000, "Taxi-v4": 50_000}  # a million steps and more
PEER_STEPS = 20_000
ALPHA, GAMMA, EPSILON, INITIAL_Q = 0.1, 0.99, 0.1, 1.0
PEER = "table-rl"
# On the same Gymnasium and NumPy, so that environments take the same time.
REQUIREMENTS = ("table-rl==0.3.0", *(f"{name}=={version(name)}" for name in ("gymnasium", "numpy")))
REPEATS = 5


def rows() -> list[Row]:
    """Time a step of Q-learning; what is lifted once, in milliseconds, is left out."""
    return [row for name in EPISODES for row in _rows(name)]


def _rows(name: str) -> list[Row]:
    problem, what = _lifted(name), f"Q-learning, {name}"

    def ours() -> QLearning:
        learner = QLearning(problem, alpha=ALPHA, gamma=GAMMA, epsilon=EPSILON, initial_q=INITIAL_Q, seed=0)
        return learner.learn(EPISODES[name])

    steps = float(ours().steps.sum())
    plain = compare(
        what,
        "step",
        ours,
        "NumPy and Gymnasium",
        lambda: plain_loop(name, PEER_STEPS),
        units=steps,
        peer_units=PEER_STEPS,
        repeats=REPEATS,
    )
    return [plain, _peer_row(what, name, lambda: seconds(ours) / steps)]


def _lifted(name: str) -> TabularMDP:
    env = gymnasium.make(name)
    problem = extract_transition_table(env.unwrapped)
    if problem is None or env.spec is None:
        raise RuntimeError(f"{name} was expected to carry its table")
    return problem.with_time_limit(env.spec.max_episode_steps)


def plain_loop(name: str, steps: int) -> None:
    """Learn as it is written everywhere: a NumPy table and the environment's own step."""
    env = gymnasium.make(name)
    n_states, n_actions = int(env.observation_space.n), int(env.action_space.n)  # type: ignore[attr-defined]
    rng = np.random.default_rng(0)
    q = np.full((n_states, n_actions), INITIAL_Q)
    state, _ = env.reset(seed=0)
    for _ in range(steps):
        action = int(rng.integers(n_actions)) if rng.random() < EPSILON else int(q[state].argmax())
        next_state, reward, terminated, truncated, _ = env.step(action)
        target = float(reward) + (0.0 if terminated else GAMMA * q[next_state].max())
        q[state, action] += ALPHA * (target - q[state, action])
        state = env.reset()[0] if terminated or truncated else next_state


def _peer_row(what: str, name: str, ours: Callable[[], float]) -> Row:
    python = own_python(PEER, REQUIREMENTS)
    if python is None:
        return Row(what, "step", ours(), f"{PEER} (left out: not installable)", None, None)
    script = str(Path(__file__).with_name("table_rl_peer.py"))
    command = [str(python), script, name, *map(str, (PEER_STEPS, ALPHA, GAMMA, EPSILON, INITIAL_Q))]

    def peer() -> float:
        printed = subprocess.run(command, check=True, capture_output=True, text=True).stdout
        return 1.0 / float(json.loads(printed)["steps_per_second"])

    pairs = [(ours(), peer()) for _ in range(REPEATS)]
    times = [statistics.median(side) for side in zip(*pairs, strict=True)]
    return Row(what, "step", times[0], PEER, times[1], statistics.median(b / a for a, b in pairs))
