"""`tuckerl.solve` against QuantEcon's DiscreteDP and pymdptoolbox, to the same guaranteed error, and against C."""

import ctypes
import json
import subprocess
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from quantecon.markov import DiscreteDP
from scipy.sparse import csr_matrix

from benchmarks import c_peer
from benchmarks.peer_environment import own_python
from benchmarks.timing import Row, compare, seconds
from tuckerl import Maze, TabularMDP, solve
from tuckerl.solving.bounds import lowest_values
from tuckerl.solving.model import model_of
from tuckerl.solving.sweeps import sweep

GAMMA, TOL = 0.95, 1e-8
METHODS = ("value-iteration", "policy-iteration", "modified-policy-iteration")
MDPTOOLBOX = ("pymdptoolbox==4.0b3", "numpy<2", "scipy", "setuptools<80")
SIDE = 1000  # of the grid


def rows() -> list[Row]:
    """Time the three methods on a maze, a sparse and a full random problem, and value iteration on a large grid."""
    problems = {
        "maze 39 x 36": open_maze(39, 36),
        "random 1000 x 5, 10 outcomes": random_problem(1000, 5, 10),
        "random 300 x 10, full": random_problem(300, 10, 300),
    }
    found = [row for name, problem in problems.items() for row in _against_quantecon(name, problem)]
    found += [row for name, problem in list(problems.items())[:2] for row in _against_mdptoolbox(name, problem)]
    return [*found, *_large_grid()]


def open_maze(rows: int, columns: int) -> TabularMDP:
    """Return a grid without walls, from one corner to the other, at a cost for each step."""
    walls = np.zeros((rows, columns), dtype=bool)
    return Maze(walls, (0, 0), (rows - 1, columns - 1)).to_mdp()


def random_problem(n_states: int, n_actions: int, n_outcomes: int) -> TabularMDP:
    """Return a problem without an end whose pairs lead to as many states, and pay anything from 0 to 1."""
    rng = np.random.default_rng(n_states)
    shape = n_states, n_actions, n_outcomes
    nexts = np.stack([rng.permutation(n_states)[:n_outcomes] for _ in range(n_states * n_actions)]).reshape(shape)
    probability = rng.dirichlet(np.ones(n_outcomes), size=shape[:2])
    reward = np.broadcast_to(rng.random(shape[:2])[..., np.newaxis], shape)
    return TabularMDP(nexts, reward, np.zeros(shape, bool), probability)


def transitions(problem: TabularMDP) -> tuple[Any, Any]:
    """Return a peer's transitions, (S * A, S) sparse, and rewards, (S, A), with the end as one more state."""
    model, n = model_of(problem), problem.n_states
    pairs = model.transitions()
    is_used = model.has_ends
    total, n_actions = n + is_used, problem.n_actions
    reward = np.zeros((total, n_actions))
    reward[:n] = model.reward.reshape(n, n_actions)
    entries = pairs.tocoo()
    rows, columns, data = entries.row, entries.col, entries.data
    if is_used:
        end = np.arange(n * n_actions, total * n_actions)
        rows, columns = np.concatenate([rows, end]), np.concatenate([columns, np.full(n_actions, n)])
        data = np.concatenate([data, np.ones(n_actions)])
    return csr_matrix((data, (rows, columns)), shape=(total * n_actions, total)), reward


def _against_quantecon(name: str, problem: TabularMDP) -> list[Row]:
    pairs, reward = transitions(problem)
    states, actions = np.divmod(np.arange(pairs.shape[0]), problem.n_actions)
    if pairs.nnz == pairs.shape[0] * pairs.shape[1]:
        peer = DiscreteDP(reward, pairs.toarray().reshape(*reward.shape, -1), GAMMA)
    else:
        peer = DiscreteDP(reward.ravel(), pairs, GAMMA, states, actions)
    found = []
    for method in METHODS:
        # Its values are within epsilon / 2 of the optimal ones.
        given = {"method": method.replace("-", "_"), "epsilon": 2 * TOL, "max_iter": 10**6}
        ours = partial(solve, problem, GAMMA, method, TOL)
        theirs = partial(peer.solve, **given)
        scale = float(1e-6 * np.abs(ours().v).max())
        np.testing.assert_allclose(theirs().v[: problem.n_states], ours().v, rtol=0, atol=scale)
        found.append(compare(f"{name}, {method}", "solution", ours, "QuantEcon DiscreteDP", theirs))
    return found


def _against_mdptoolbox(name: str, problem: TabularMDP) -> list[Row]:
    python = own_python("mdptoolbox", MDPTOOLBOX)
    times: dict[str, float | None] = dict.fromkeys(METHODS)
    if python is not None:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "problem.npz"
            _write(path, problem)
            command = [str(python), str(Path(__file__).with_name("mdptoolbox_peer.py")), str(path), str(2 * TOL)]
            done = subprocess.run(command, check=True, capture_output=True, text=True)
            times |= json.loads(done.stdout.splitlines()[-1])
    found = []
    for method in METHODS:
        ours = min(seconds(partial(solve, problem, GAMMA, method, TOL)) for _ in range(7))
        peer, label = times[method], "pymdptoolbox" if python else "pymdptoolbox: not installed"
        ratio = None if peer is None else peer / ours
        found.append(Row(f"{name}, {method}", "solution", ours, label, peer, ratio))
    return found


def _write(path: Path, problem: TabularMDP) -> None:
    pairs, reward = transitions(problem)
    arrays: dict[str, Any] = {"reward": reward}
    for action in range(problem.n_actions):
        entries = pairs[action :: problem.n_actions].tocoo()
        arrays |= {f"rows{action}": entries.row, f"columns{action}": entries.col, f"probability{action}": entries.data}
    np.savez(path, **arrays)


def _large_grid() -> list[Row]:
    """Time a million cells: all of `solve`, and one sweep beside the same sweep in C."""
    problem = open_maze(SIDE, SIDE)
    whole = min(seconds(lambda: solve(problem, 0.999, tol=TOL)) for _ in range(3))
    alone = Row(f"grid {SIDE} x {SIDE}, gamma 0.999", "solution", whole, "-", None, None)
    in_c, library = c_sweep(problem), c_peer.compiled("sweep.c")
    if library is None or in_c is None:
        return [alone, Row("a sweep of it", "state", whole, c_peer.NO_COMPILER, None, None)]
    model, policy = model_of(problem), np.zeros(problem.n_states, dtype=np.int64)
    v = lowest_values(model, GAMMA)
    ours = lambda: sweep(model, v, GAMMA, policy, 0, 10)  # noqa: E731  # as short as its peer
    return [alone, compare("a sweep of it", "state", ours, "C", in_c, units=10.0 * problem.n_states)]


def c_sweep(problem: TabularMDP) -> Callable[[], object] | None:
    """Return a function that does ten sweeps in C, from values that do not stop changing; None without a compiler."""
    library = c_peer.compiled("sweep.c")
    if library is None:
        return None
    model, v = model_of(problem), lowest_values(model_of(problem), GAMMA)
    policy = np.zeros(problem.n_states, dtype=np.int64)
    reward, nexts = (np.array(part) for part in (model.reward, model.next_state))
    return lambda: library.sweep(
        *map(c_peer.pointer, (reward, nexts, v, policy)),
        *map(ctypes.c_int64, (problem.n_states, problem.n_actions, 10)),
        ctypes.c_double(GAMMA),
    )
