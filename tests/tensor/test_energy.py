"""Ranks by explained energy: closed forms, what a share promises of the fit, and the ends of the range."""

import warnings

import numpy as np
import pytest

from tests.tensor.examples import low_rank, random_tensor
from tuckerl.tensor import decompose, tucker
from tuckerl.tensor.energy import ranks_by_energy

TENSOR = random_tensor((6, 5, 4, 3))


def superdiagonal(squares: list[float]) -> np.ndarray:
    """Make a cube whose every unfolding has singular values of these squares."""
    n = len(squares)
    X = np.zeros((n, n, n))
    X[range(n), range(n), range(n)] = np.sqrt(squares)
    return X


@pytest.mark.parametrize(
    ("share", "rank"),
    [(0.01, 1), (0.5, 1), (0.500001, 2), (0.8, 2), (0.95, 3), (0.9500001, 4), (1.0, 4)],
)
def test_the_least_rank_that_carries_the_share_is_taken(share: float, rank: int) -> None:
    X = superdiagonal([50.0, 30.0, 15.0, 5.0])
    assert ranks_by_energy(X, share) == (rank,) * 3
    assert decompose(X, share).ranks == (rank,) * 3


def test_each_mode_has_a_rank_of_its_own() -> None:
    # One vector times a matrix with squares of 90, 8 and 2: there is nothing to choose in the vector's mode.
    matrix = np.linalg.qr(random_tensor((7, 3)))[0] * np.sqrt([90.0, 8.0, 2.0])
    X = np.multiply.outer(np.array([0.6, 0.8]), matrix)
    assert [tucker(X, share).ranks for share in (0.9, 0.95, 0.99)] == [(1, 1, 1), (1, 2, 2), (1, 3, 3)]


@pytest.mark.parametrize("share", [0.3, 0.8, 0.95, 0.999])
@pytest.mark.parametrize("max_iterations", [0, 50])
def test_the_error_is_at_most_what_the_share_leaves_of_each_mode(share: float, max_iterations: int) -> None:
    d = tucker(TENSOR, share, max_iterations=max_iterations)
    assert 1.0 - d.fit <= np.sqrt(4 * (1.0 - share)) + 1e-12
    assert d.fit == pytest.approx(1.0 - np.linalg.norm(TENSOR - d.to_tensor()) / np.linalg.norm(TENSOR), abs=1e-9)


def test_auto_is_95_percent_and_the_same_as_the_ranks_that_it_finds() -> None:
    found = tucker(TENSOR, "auto")
    assert found.ranks == ranks_by_energy(TENSOR, 0.95) == tucker(TENSOR, np.float64(0.95)).ranks
    np.testing.assert_array_equal(found.core, tucker(TENSOR, found.ranks).core)


def test_all_of_the_energy_is_the_numerical_rank_without_a_warning() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert tucker(low_rank((8, 5, 5), (2, 3, 3)), 1.0).ranks == (2, 3, 3)
        # A share of a long mode may ask for more than the product of the others, which is all that there can be.
        assert tucker(random_tensor((90, 2, 2)), 1.0).ranks == (4, 2, 2)


@pytest.mark.parametrize("scale", [1e-200, 1e200])
def test_the_size_of_the_numbers_does_not_matter(scale: float) -> None:
    assert tucker(scale * TENSOR, 0.8).ranks == tucker(TENSOR, 0.8).ranks


def test_zeros_have_one_column_of_each() -> None:
    d = tucker(np.zeros((5, 3, 2)), "auto")
    assert (d.ranks, d.fit) == ((1, 1, 1), 1.0)
