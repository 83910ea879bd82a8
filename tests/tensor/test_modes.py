"""Unfolding, folding and mode products against their definitions."""

import numpy as np
import pytest

from tests.reference import tensor as reference
from tests.tensor.examples import random_tensor
from tuckerl.errors import ParameterError, ParameterTypeError, TensorError
from tuckerl.tensor import fold, mode_product, unfold

SHAPES = [(3, 4), (2, 3, 4), (4, 1, 2, 3), (2, 3, 2, 2, 2)]
CASES = [(shape, mode) for shape in SHAPES for mode in range(len(shape))]


@pytest.mark.parametrize(("shape", "mode"), CASES)
def test_unfold_is_its_definition_and_fold_undoes_it(shape: tuple[int, ...], mode: int) -> None:
    X = random_tensor(shape)
    matrix = unfold(X, mode)
    np.testing.assert_array_equal(matrix, reference.unfold(X, mode))
    np.testing.assert_array_equal(fold(matrix, mode, shape), X)


@pytest.mark.parametrize(("shape", "mode"), CASES)
@pytest.mark.parametrize("rows", [1, 5])
def test_mode_product_is_its_definition(shape: tuple[int, ...], mode: int, rows: int) -> None:
    X, matrix = random_tensor(shape), random_tensor((rows, shape[mode]), seed=1)
    product = mode_product(X, matrix, mode)
    np.testing.assert_allclose(product, reference.mode_product(X, matrix, mode), atol=1e-13)
    np.testing.assert_allclose(unfold(product, mode), matrix @ unfold(X, mode), atol=1e-13)


def test_unfolding_the_first_mode_copies_nothing() -> None:
    X = random_tensor((5, 2, 3))
    assert np.shares_memory(unfold(X, 0), X)


def test_products_in_different_modes_commute() -> None:
    X, A, B = random_tensor((3, 4, 5)), random_tensor((2, 3), 1), random_tensor((6, 5), 2)
    one = mode_product(mode_product(X, A, 0), B, 2)
    np.testing.assert_allclose(one, mode_product(mode_product(X, B, 2), A, 0), atol=1e-13)


def test_a_transposed_tensor_is_multiplied_like_a_copy_of_it() -> None:
    X, A = random_tensor((3, 4, 5)).transpose(2, 0, 1), random_tensor((2, 3))
    np.testing.assert_allclose(mode_product(X, A, 1), mode_product(X.copy(), A, 1), atol=1e-14)


@pytest.mark.parametrize("mode", [-1, 3])
def test_a_mode_that_is_not_there(mode: int) -> None:
    X = np.ones((2, 3, 4))
    with pytest.raises(ParameterError, match="mode must be a whole number from 0 to 2; got"):
        unfold(X, mode)
    with pytest.raises(ParameterError, match="mode must be a whole number from 0 to 2; got"):
        fold(X, mode, (2, 3, 4))
    with pytest.raises(ParameterError, match="mode must be a whole number from 0 to 2; got"):
        mode_product(X, np.eye(2), mode)


def test_a_mode_that_is_no_number() -> None:
    with pytest.raises(ParameterTypeError, match="mode must be a whole number"):
        unfold(np.ones((2, 3)), "rows")  # type: ignore[arg-type]


def test_a_matrix_that_does_not_fit() -> None:
    with pytest.raises(TensorError, match=r"must have shape \(any, 3\); got \(3, 2\): transpose it"):
        mode_product(np.ones((2, 3)), np.ones((3, 2)), 1)
    with pytest.raises(TensorError, match=r"must have shape \(any, 3\); got \(3,\)"):
        mode_product(np.ones((2, 3)), np.ones(3), 1)
    with pytest.raises(TensorError, match=r"has shape \(3, 8\); got a matrix of shape \(3, 4\)"):
        fold(np.ones((3, 4)), 1, (2, 3, 4))
