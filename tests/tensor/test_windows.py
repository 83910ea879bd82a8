"""What a learner's windows are like, decomposed as by exact singular vectors, each of the whole unfolding."""

from collections.abc import Iterator

import numpy as np
import pytest

from tests.tensor.examples import Floats
from tuckerl.tensor import decompose, tucker, unfold
from tuckerl.tensor.ranks import Ranks, clip_ranks
from tuckerl.tensor.start import Start


def exactly(X: Floats, ranks: Ranks, tol: float) -> tuple[list[Floats], float, int]:
    """Return factors, fit and sweeps of HOOI from the truncated HOSVD, by full SVDs."""
    spectra = [np.linalg.svd(unfold(X, mode), compute_uv=False) for mode in range(X.ndim)]
    ranks = clip_ranks(ranks, [int((s > 1e-10 * s[0]).sum()) for s in spectra])

    def leading(A: Floats, rank: int) -> Floats:
        return np.asarray(np.linalg.svd(A, full_matrices=False)[0][:, :rank])

    def project(skip: int | None) -> Floats:
        P = X
        for mode, U in enumerate(factors):
            if mode != skip:
                P = np.moveaxis(np.tensordot(U, P, axes=(0, mode)), 0, mode)
        return P

    def fit() -> float:
        residual = project(None)
        for mode, U in enumerate(factors):
            residual = np.moveaxis(np.tensordot(U, residual, axes=(1, mode)), 0, mode)
        return 1.0 - float(np.linalg.norm(X - residual) / np.linalg.norm(X))

    factors = [leading(unfold(X, mode), rank) for mode, rank in enumerate(ranks)]
    now = fit()
    sweeps = 0
    while sweeps < 50:
        sweeps += 1
        for mode, rank in enumerate(ranks):
            factors[mode] = leading(unfold(project(mode), mode), rank)
        before, now = now, fit()
        if abs(now - before) < tol:
            break
    return factors, now, sweeps


def windows(n: int, first: int = 0) -> Iterator[tuple[Floats, Ranks]]:
    """Yield tables as of windows: rows that change now and then, alike over agents, of few directions, or tiny."""
    for seed in range(first, first + n):
        rng = np.random.default_rng(seed)
        n_actions, n_episodes, n_agents = (int(rng.integers(low, high)) for low, high in ((1, 9), (1, 8), (1, 4)))
        n_rows = int(rng.integers(1, 70))
        values = (
            rng.standard_normal((n_rows, n_actions)) * np.geomspace(1.0, 10.0 ** -rng.integers(0, 3), n_rows)[:, None]
        )
        X = np.repeat(np.repeat(values[:, :, None, None], n_episodes, axis=2), n_agents, axis=3)
        for episode in range(n_episodes):
            for agent in range(n_agents):
                moved = rng.random(n_rows) < rng.choice([0.0, 0.2, 0.9])
                size = rng.choice([0.3, 1e-2])
                X[moved, :, episode:, agent] += size * rng.standard_normal((int(moved.sum()), n_actions))[:, :, None]
        if seed % 4 == 0:
            X[:, :, :, :] = X[:, :, :, :1]  # equal agents
        if seed % 5 == 0:
            X[n_rows // 2 :] = X[: n_rows - n_rows // 2] * 2.0  # rows that say nothing new
        if seed % 7 == 0:
            X[:, n_actions // 2] = 0.0  # an action without values
        if X.any():
            yield (
                X,
                tuple(int(rng.integers(1, size + 2)) for size in (min(n_rows, 15), n_actions, n_episodes, n_agents)),
            )


def check(X: Floats, ranks: Ranks) -> bool:
    """Compare with exact singular vectors; return whether they are well determined, so that all can be compared."""
    factors, fit, sweeps = exactly(X, ranks, 1e-4)
    d = decompose(X, ranks)
    assert d.ranks == tuple(U.shape[1] for U in factors)
    for U in d.factors:
        np.testing.assert_allclose(U.T @ U, np.eye(U.shape[1]), atol=1e-10)
    assert d.iterations == sweeps
    moved = X * (1.0 + 1e-10 * np.random.default_rng(0).standard_normal(X.shape))
    others, _, _ = exactly(moved, d.ranks, 1e-4)
    read = (1, 3)  # of which the weights are made, and the choice of an agent
    if any(np.abs(_row_norms(factors[mode]) - _row_norms(others[mode])).max() > 1e-8 for mode in read):
        return False
    assert d.fit > fit - 1e-9
    for mode in read:
        np.testing.assert_allclose(_row_norms(d.factors[mode]), _row_norms(factors[mode]), atol=1e-9)
    return True


def _row_norms(U: Floats) -> Floats:
    return np.asarray(np.linalg.norm(U, axis=1))


@pytest.mark.parametrize("first", range(0, 300, 100))
def test_windows_have_the_factors_that_exact_singular_vectors_give(first: int) -> None:
    assert sum(check(X, ranks) for X, ranks in windows(100, first)) > 80


@pytest.mark.long
def test_thousands_of_windows_do() -> None:
    assert sum(check(X, ranks) for X, ranks in windows(5000, 1000)) > 4000


@pytest.mark.parametrize("seed", range(20))
def test_on_which_side_of_a_limit_the_starts_fit_lies(seed: int) -> None:
    rng = np.random.default_rng(seed)
    shape, ranks = ((80, 5, 6, 3), (6, 2, 3, 1)) if seed % 2 else ((40, 6, 7), (20, 4, 5))
    X = rng.standard_normal(shape) * np.geomspace(1.0, 1e-3, shape[0]).reshape(-1, *[1] * (len(shape) - 1))
    start = Start(X, ranks)
    own = start.fit
    for gain in (1e-6, 1e-4, 1e-2, 0.1):
        for tol in gain * np.array([0.0, 0.5, 0.99, 1.01, 2.0]):
            assert start.is_within(float(tol), own + gain) == (gain < tol), (gain, tol)


@pytest.mark.parametrize("tol", [1e-8, 1e-12])
def test_a_start_that_is_exact_needs_one_sweep(tol: float) -> None:
    rng = np.random.default_rng(4)
    core, *factors = (rng.normal(size=shape) for shape in ((2, 2, 2), (8, 2), (7, 2), (6, 2)))
    X = np.einsum("abc,ia,jb,kc", core, *factors)
    assert tucker(X, (2, 2, 2), tol=tol).iterations == 1
