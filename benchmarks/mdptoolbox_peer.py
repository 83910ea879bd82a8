"""pymdptoolbox, in its own environment: solves the problem in a file, prints its seconds by method as JSON."""

import json
import sys
import time
from collections.abc import Callable
from typing import Any

import mdptoolbox.mdp as peer  # type: ignore[import-not-found]  # only there
import numpy as np
import scipy.sparse as sparse

GAMMA, REPEATS = 0.95, 3


def problem(path: str) -> tuple[list[Any], Any]:
    """Return the transitions of each action, (S, S) sparse, and the rewards, (S, A)."""
    held = np.load(path)
    n_states, n_actions = held["reward"].shape
    matrices = []
    for action in range(n_actions):
        rows, columns, probability = (held[f"{name}{action}"] for name in ("rows", "columns", "probability"))
        matrices.append(sparse.csr_matrix((probability, (rows, columns)), shape=(n_states, n_states)))
    return matrices, held["reward"]


def seconds(make: Callable[[], Any]) -> float:
    """Return how long a solution takes, its solver's checks and preparations included: the best of some."""
    best = float("inf")
    for _ in range(REPEATS):
        before = time.perf_counter()
        make().run()
        best = min(best, time.perf_counter() - before)
    return best


if __name__ == "__main__":
    transitions, reward = problem(sys.argv[1])
    epsilon = float(sys.argv[2])
    given: tuple[Any, ...] = (transitions, reward, GAMMA)
    print(
        json.dumps(
            {
                "value-iteration": seconds(lambda: peer.ValueIteration(*given, epsilon=epsilon)),
                "policy-iteration": seconds(lambda: peer.PolicyIteration(*given)),
                "modified-policy-iteration": seconds(lambda: peer.PolicyIterationModified(*given, epsilon=epsilon)),
            }
        )
    )
