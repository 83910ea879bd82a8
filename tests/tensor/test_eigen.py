"""Eigenvectors by three ways, which agree; what follows where LAPACK gives up; a few of a large matrix."""

import ctypes
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

from tests.tensor.examples import Floats, random_tensor
from tuckerl import tucker
from tuckerl.errors import DecompositionError
from tuckerl.tensor import lanczos as lanczos_module
from tuckerl.tensor import lapack
from tuckerl.tensor.eigen import leading_eigenvectors
from tuckerl.tensor.lanczos import lanczos
from tuckerl.tensor.lapack import DSTERF, DSYEV, DSYEVD, eigenvectors, new_tools
from tuckerl.tensor.singular import room_for
from tuckerl.tensor.tail import energy_beyond
from tuckerl.tensor.tall import orthonormal


def clustered_grams(n: int) -> Iterator[Floats]:
    """Yield Gram matrices of the kind on which a build of LAPACK gave up: most eigenvalues 1, or next to nothing."""
    rng = np.random.default_rng(0)
    for i in range(n):
        size = int(rng.integers(20, 100))
        noise = 10.0 ** rng.integers(-18, -6) * rng.standard_normal((size, size))
        if i % 3 == 0:  # what a second pass sees: columns of length 1, or of rounding
            A = np.linalg.qr(rng.standard_normal((200, size)))[0]
            A[:, size // 3 :] *= 10.0 ** rng.uniform(-12, -6, size - size // 3)
            yield A.T @ A
        elif i % 3 == 1:  # the identity in a part, zeros in the rest, and rounding
            yield np.diag(np.arange(size) < size // 2).astype(np.float64) + (noise @ noise.T)
        else:  # tables that are equal over the episodes of a window
            A = np.repeat(rng.standard_normal((200, 5)), size // 5 + 1, axis=1)
            A += 1e-9 * rng.standard_normal(A.shape)
            yield A.T @ A


def leading(A: Floats, count: int) -> tuple[Floats, Floats] | None:
    """Return all eigenvalues of a symmetric matrix and the last vectors as rows, or None where none were found."""
    n = len(A)
    rows, values = np.triu(A).flatten(), np.empty(n)
    found = leading_eigenvectors(new_tools(n), rows, n, count, values, np.empty(room_for(n)))
    return (values, rows.reshape(n, n)[n - count :]) if found else None


def all_by(routine: int) -> Callable[[Floats], tuple[Floats, Floats]]:
    def way(A: Floats) -> tuple[Floats, Floats]:
        n = len(A)
        rows, values = np.triu(A).flatten(), np.empty(n)
        assert eigenvectors(new_tools(n), routine, rows, n, values, np.empty(room_for(n)))
        return values, rows.reshape(n, n)

    return way


@pytest.mark.parametrize("way", [all_by(DSYEVD), all_by(DSYEV)])
def test_every_way_finds_the_eigenvalues_of_clustered_matrices(way: Callable[[Floats], Any]) -> None:
    for A in clustered_grams(60):
        values, vectors = way(A)
        largest = np.abs(A).max() * len(A)
        assert np.all(np.diff(values) >= -1e-12 * largest), "smallest first"
        np.testing.assert_allclose((vectors.T * values) @ vectors, A, atol=1e-13 * largest)
        np.testing.assert_allclose(vectors @ vectors.T, np.eye(len(A)), atol=1e-12)


def check_leading(A: Floats, count: int) -> bool:
    """Compare leading vectors with NumPy's where they were found, and return whether they were."""
    found = leading(A, count)
    if found is None:
        return False
    values, rows = found
    exact, vectors = np.linalg.eigh(A)
    largest = exact[-1]
    np.testing.assert_allclose(values, exact, atol=1e-14 * len(A) * largest)
    np.testing.assert_allclose(rows @ rows.T, np.eye(count), atol=1e-13)
    # What the rows span loses nothing: the sum of the eigenvalues is the most that any such rows could have.
    np.testing.assert_allclose(np.trace(rows @ A @ rows.T), exact[-count:].sum(), atol=1e-14 * len(A) * largest)
    gap = exact[-count] - (exact[-count - 1] if count < len(A) else 0.0)
    projector = vectors[:, -count:] @ vectors[:, -count:].T
    np.testing.assert_allclose(rows.T @ rows, projector, atol=1e-14 * len(A) * largest / max(gap, 1e-300))
    return True


def test_leading_vectors_of_clustered_matrices_are_right_or_said_not_to_be_found() -> None:
    found = [check_leading(A, count) for A in clustered_grams(60) for count in (1, 4, len(A) // 2, len(A))]
    assert any(found)
    assert not all(found), "vectors of equal eigenvalues cannot be told apart"


@pytest.mark.parametrize("n", [1, 2, 3, 10, 40, 90])
@pytest.mark.parametrize("ratio", [0.5, 0.9, 0.99])
def test_leading_vectors_are_found_where_eigenvalues_differ(n: int, ratio: float) -> None:
    for count in {1, max(1, n // 3), n}:
        assert check_leading(graded(n, ratio), count) or ratio**n < 1e-15


@pytest.mark.long
def test_every_way_finds_them_in_thousands_of_matrices() -> None:
    for A in clustered_grams(5000):
        expected = np.linalg.eigh(A)[0]
        check_leading(A, len(A) // 3)
        for routine in (DSYEVD, DSYEV):
            np.testing.assert_allclose(all_by(routine)(A)[0], expected, atol=1e-12 * np.abs(A).max() * len(A))


_INFO_OF = {DSTERF: 3, DSYEVD: 10, DSYEV: 8}
_VALUES_OF = {DSTERF: 1, DSYEVD: 5, DSYEV: 5}


def broken(routine: int, *, by_nan: bool) -> Any:
    """Return a routine that gives up, or whose first eigenvalue is none."""
    n_arguments = _INFO_OF[routine] + 1

    def give_up(*pointers: int) -> None:
        ctypes.cast(pointers[-1], ctypes.POINTER(ctypes.c_int32))[0] = not by_nan
        if by_nan:
            ctypes.cast(pointers[_VALUES_OF[routine]], ctypes.POINTER(ctypes.c_double))[0] = np.nan

    return ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * n_arguments)(give_up)


def let_fail(monkeypatch: pytest.MonkeyPatch, routines: tuple[int, ...], *, by_nan: bool) -> list[Any]:
    head, functions = lapack._HEAD.copy(), [broken(routine, by_nan=by_nan) for routine in routines]
    for routine, function in zip(routines, functions, strict=True):
        head[routine] = ctypes.cast(function, ctypes.c_void_p).value or 0
    monkeypatch.setattr(lapack, "_HEAD", head)
    return functions  # to be kept as long as they may be called


@pytest.mark.parametrize("by_nan", [False, True])
@pytest.mark.parametrize("routines", [(DSTERF,), (DSTERF, DSYEVD)])
def test_a_tensor_is_decomposed_where_the_usual_way_fails(
    by_nan: bool, routines: tuple[int, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    X = random_tensor((40, 4, 5))
    expected = tucker(X, (3, 2, 2))
    kept = let_fail(monkeypatch, routines, by_nan=by_nan)
    found = tucker(X, (3, 2, 2))
    assert kept
    np.testing.assert_allclose(found.core, expected.core, atol=1e-10)
    for factor, other in zip(found.factors, expected.factors, strict=True):
        np.testing.assert_allclose(factor, other, atol=1e-10)


@pytest.mark.parametrize("by_nan", [False, True])
def test_where_no_way_leads_anywhere_it_is_said(by_nan: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    kept = let_fail(monkeypatch, (DSTERF, DSYEVD, DSYEV), by_nan=by_nan)
    with pytest.raises(DecompositionError, match=r"LAPACK gave no eigenvectors .* of shape \(20, 4, 5\).*: decompose"):
        tucker(random_tensor((40, 4, 5)), (3, 2, 2))
    assert kept


@pytest.mark.parametrize("count", [0, 1, 5, 12])
@pytest.mark.parametrize("rank", [4, 12])
def test_what_is_beyond_the_leading_values_is_not_underestimated(count: int, rank: int) -> None:
    for seed in range(10):
        A = random_tensor((12, rank), seed) * np.geomspace(1.0, 1e-3, rank) @ random_tensor((rank, 30), seed + 100)
        squares = np.linalg.svd(A, compute_uv=False) ** 2
        energy = energy_beyond(new_tools(12), A.reshape(-1), 12, count, np.empty(12 * 25 + 12))
        assert energy >= squares[count:].sum() - 1e-13 * squares.sum()
        assert energy <= 20.0 * squares[count:].sum() + 1e-13 * squares.sum(), "and is of use"


def test_orthonormal_goes_on_where_cholesky_gives_up() -> None:
    # Twelve columns whose products are all 0.0999: each is a small error, but together the matrix is indefinite.
    gram = np.full((12, 12), -0.0999)
    np.fill_diagonal(gram, 1.0)
    values, vectors = np.linalg.eigh(gram)
    A = np.zeros((20, 12))
    A[:12] = (vectors * np.sqrt(np.maximum(values, 0.0))).T
    assert np.abs(A.T @ A - np.eye(12)).max() < 0.1 + 1e-2
    mended = orthonormal(A)
    np.testing.assert_allclose(mended.T @ mended, np.eye(12), atol=1e-12)


@pytest.mark.parametrize("size", [1.7e308, 1e300, 1e-300, 3e-310, 5e-324])
def test_numbers_at_the_edges_of_float_have_the_factors_of_others(size: float) -> None:
    X = np.sign(random_tensor((9, 3, 4)))
    expected = tucker(X, (2, 2, 2))
    with np.errstate(over="ignore"):  # the norm of the largest lies beyond the floats, and so does the core
        found = tucker(X * size, (2, 2, 2))
    for factor, other in zip(found.factors, expected.factors, strict=True):
        np.testing.assert_allclose(factor, other, atol=1e-12)
    assert found.fit == pytest.approx(expected.fit)


def graded(n: int, ratio: float) -> Floats:
    """Return a symmetric matrix with eigenvalues that fall by `ratio` each."""
    Q = np.linalg.qr(np.random.default_rng(n).normal(size=(n, n)))[0]
    A: Floats = (Q * ratio ** np.arange(n)) @ Q.T
    return (A + A.T) / 2


@pytest.mark.parametrize(("n", "count"), [(200, 25), (400, 15), (600, 3)])
@pytest.mark.parametrize("ratio", [0.95, 0.99])
def test_few_eigenvectors_are_those_of_all(n: int, count: int, ratio: float) -> None:
    A = graded(n, ratio)
    found = lanczos(A, count)
    assert found is not None
    values, vectors = np.linalg.eigh(A @ A.T)
    np.testing.assert_allclose(found[0], values[-count:], rtol=1e-12)
    projected = found[1].T @ found[1]
    np.testing.assert_allclose(projected, vectors[:, -count:] @ vectors[:, -count:].T, atol=1e-11)


@pytest.mark.parametrize("A", [np.eye(300), np.kron(np.eye(100), np.ones((3, 3)))])
def test_few_eigenvectors_are_the_same_each_time(A: Floats) -> None:
    found = [lanczos(A, 15) for _ in range(3)]
    assert found[0] is not None
    assert len({vectors.tobytes() for _, vectors in filter(None, found)}) == 1


def test_few_of_a_small_matrix_or_many_of_a_large_one_are_left_to_the_other_way() -> None:
    assert lanczos(graded(199, 0.9), 2) is None
    assert lanczos(graded(200, 0.9), 26) is None


def test_what_lanczos_does_not_find_in_time_is_left_to_the_other_way(monkeypatch: pytest.MonkeyPatch) -> None:
    A = graded(300, 0.9999)
    X = np.stack([A, graded(300, 0.999)], axis=2)
    expected = tucker(X, (10, 10, 2), max_iterations=0)
    monkeypatch.setattr(lanczos_module, "_RESTARTS", 1)
    assert lanczos(A, 20) is None
    found = tucker(X, (10, 10, 2), max_iterations=0)
    np.testing.assert_allclose(found.factors[0], expected.factors[0], atol=1e-9)
