"""What may be passed in, what is said about ranks that are too high, and what is refused."""

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from tests.tensor.examples import low_rank, random_tensor
from tuckerl.errors import ParameterError, ParameterTypeError, RankWarning, TensorError
from tuckerl.tensor import decompose, tucker
from tuckerl.tensor.ranks import clip_ranks

EQUAL_SLICES = random_tensor((60, 3, 4))
EQUAL_SLICES[:, 2] = EQUAL_SLICES[:, 1]


@pytest.mark.parametrize(
    ("X", "asked", "used"),
    [
        pytest.param(random_tensor((4, 3, 3)), (9, 2, 3), (4, 2, 3), id="size"),
        pytest.param(random_tensor((30, 3, 4)), (13, 3, 4), (12, 3, 4), id="size-long-mode"),
        pytest.param(random_tensor((8, 5, 5)), (7, 2, 2), (4, 2, 2), id="product"),
        pytest.param(low_rank((8, 5, 5), (2, 3, 3)), (5, 4, 3), (2, 3, 3), id="numerical"),
        pytest.param(low_rank((90, 5, 5), (4, 3, 2)), (9, 3, 5), (4, 3, 2), id="numerical-long-mode"),
        pytest.param(EQUAL_SLICES, (2, 3, 4), (2, 2, 4), id="numerical-at-a-low-fit"),
        pytest.param(low_rank((8, 5, 5), (2, 2, 2)), (8, 5, 1), (2, 2, 1), id="numerical-then-product"),
    ],
)
def test_ranks_that_cannot_be_are_lowered_with_one_warning(
    X: np.ndarray[Any, np.dtype[np.float64]], asked: tuple[int, ...], used: tuple[int, ...]
) -> None:
    with pytest.warns(RankWarning) as caught:
        d = tucker(X, asked)
    assert len(caught) == 1
    assert f"ranks {asked} were asked of a tensor of shape {X.shape} and {used} used" in str(caught[0].message)
    assert caught[0].filename == __file__
    assert d.ranks == used
    for factor in d.factors:
        np.testing.assert_allclose(factor.T @ factor, np.eye(factor.shape[1]), atol=1e-12)


@pytest.mark.parametrize("rows", [20, 200])
@pytest.mark.parametrize(("least", "rank"), [(3e-10, 3), (3e-11, 2)])
def test_numerical_rank_is_counted_at_1e_10(rows: int, least: float, rank: int) -> None:
    left = np.linalg.qr(random_tensor((rows, 3)))[0]
    right = np.linalg.qr(random_tensor((20, 3), seed=1))[0]
    X = np.asarray((left * [1.0, 0.1, least]) @ right.T)
    assert decompose(X, (3, 3)).ranks == (rank, rank)


def test_decompose_warns_of_nothing() -> None:
    X = random_tensor((4, 3, 3))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert decompose(X, (9, 9, 9)).ranks == (4, 3, 3)


def test_clipping_by_the_product_leaves_ranks_that_can_be() -> None:
    assert clip_ranks((9, 9, 2), (9, 3, 9)) == (6, 3, 2)
    assert clip_ranks((8, 4, 1), (8, 8, 8)) == (4, 4, 1)
    assert clip_ranks((5, 1), (5, 5)) == (1, 1)


def test_a_tensor_of_zeros() -> None:
    d = tucker(np.zeros((5, 3, 2)), (2, 2, 1))
    assert (d.ranks, d.fit, d.iterations) == ((2, 2, 1), 1.0, 0)
    np.testing.assert_array_equal(d.factors[0], np.eye(5)[:, :2])
    np.testing.assert_array_equal(d.to_tensor(), np.zeros((5, 3, 2)))
    with pytest.warns(RankWarning, match=r"\(9, 2, 1\) were asked .* \(2, 2, 1\) used"):
        assert tucker(np.zeros((5, 3, 2)), (9, 2, 1)).ranks == (2, 2, 1)


FORMS: dict[str, Callable[[Any], Any]] = {
    "Fortran order": np.asfortranarray,
    "not contiguous": lambda X: np.repeat(X, 2, axis=1)[:, ::2],
    "transposed": lambda X: X.transpose(2, 0, 1).copy().transpose(1, 2, 0),
    "read-only": lambda X: np.frombuffer(X.tobytes()).reshape(X.shape),
    "lists": lambda X: X.tolist(),
}


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("shape", [(40, 3, 4), (3, 40, 4), (5, 4, 6)])
def test_the_layout_of_the_array_does_not_matter(form: str, shape: tuple[int, ...]) -> None:
    X = random_tensor(shape)
    expected = tucker(X, (3, 3, 3)).to_tensor()
    given: Any = FORMS[form](X)
    before = np.array(given)
    np.testing.assert_allclose(tucker(given, (3, 3, 3)).to_tensor(), expected, atol=1e-9)
    np.testing.assert_array_equal(given, before)


@pytest.mark.parametrize("dtype", [np.int64, np.uint8, np.float32, np.float16])
def test_other_number_types_are_taken_as_float64(dtype: type) -> None:
    X: Any = (10.0 * np.abs(random_tensor((40, 3, 4)))).astype(dtype)
    d = tucker(X, (4, 2, 3))
    assert X.dtype == dtype
    assert {part.dtype for part in (d.core, *d.factors)} == {np.dtype(np.float64)}
    np.testing.assert_array_equal(d.core, tucker(X.astype(np.float64), (4, 2, 3)).core)


def test_the_result_is_frozen_and_the_input_unchanged() -> None:
    X = random_tensor((40, 3, 4))
    before = X.copy()
    d = tucker(X, (4, 2, 3))
    np.testing.assert_array_equal(X, before)
    with pytest.raises(AttributeError):
        d.fit = 1.0  # type: ignore[misc]


CUBE = np.ones((2, 2, 2))


@pytest.mark.parametrize(
    ("X", "kind", "message"),
    [
        (np.full((2, 2), np.nan), TensorError, "must be finite; got NaN or infinity"),
        (np.array([[1.0, -np.inf]]), TensorError, "must be finite; got NaN or infinity"),
        (np.array([[np.inf, 1.0]]), TensorError, "must be finite; got NaN or infinity"),
        (np.ones(3), TensorError, r"at least two axes, none of them empty; got shape \(3,\)"),
        (np.ones((3, 0, 2)), TensorError, r"at least two axes, none of them empty; got shape \(3, 0, 2\)"),
        (np.ones((2, 2), dtype=complex), TensorError, "must hold real numbers; got dtype complex128"),
        (np.ones((2, 2), dtype=bool), TensorError, "must hold real numbers; got dtype bool"),
        ("tensor", ParameterTypeError, "must be an array of numbers; got str"),
        (None, ParameterTypeError, "must be an array of numbers; got NoneType"),
        (3.0, ParameterTypeError, "must be an array of numbers; got float"),
        ([["a", "b"]], ParameterTypeError, "must be an array of numbers; got list"),
        ([[1.0, 2.0], [3.0]], ParameterTypeError, "must be an array; got ragged lists"),
    ],
)
def test_tensors_that_are_refused(X: Any, kind: type[Exception], message: str) -> None:
    with pytest.raises(kind, match=message):
        tucker(X, (1, 1))


@pytest.mark.parametrize(
    ("arguments", "kind", "message"),
    [
        ({"ranks": (1, 1)}, ParameterError, r"ranks must be 3 whole numbers, .*; got 2: \(1, 1\)"),
        ({"ranks": (1, 1, 0)}, ParameterError, r"ranks\[2\] must be a whole number of at least 1; got 0"),
        ({"ranks": (1, -2, 1)}, ParameterError, r"ranks\[1\] must be a whole number of at least 1; got -2"),
        ({"ranks": (1, 1.5, 1)}, ParameterTypeError, r"ranks\[1\] must be a whole number .*; got 1.5"),
        ({"ranks": 2}, ParameterTypeError, "ranks must be 3 whole numbers, one for each mode .*; got 2"),
        ({"ranks": None}, ParameterTypeError, "ranks must be 3 whole numbers.*; got None"),
        (
            {"ranks": "abc"},
            ParameterTypeError,
            "or 'auto' or a share of the energy such as 0.95; got 'abc' of type str",
        ),
        ({"ranks": True}, ParameterTypeError, "ranks must be 3 whole numbers.*; got True of type bool"),
        ({"ranks": 0.0}, ParameterError, r"ranks, as a share of the energy, must be a number in \(0, 1\]; got 0.0"),
        ({"ranks": 1.5}, ParameterError, r"must be a number in \(0, 1\]; got 1.5"),
        ({"ranks": float("nan")}, ParameterError, r"must be a number in \(0, 1\]; got nan"),
        ({"tol": -1e-9}, ParameterError, r"tol must be a finite number of at least 0; got -1e-09"),
        ({"tol": float("nan")}, ParameterError, r"tol must be .*; got nan"),
        ({"tol": "small"}, ParameterTypeError, "tol must be .*; got 'small'"),
        (
            {"max_iterations": -1},
            ParameterError,
            "max_iterations must be a whole number of at least 0; got -1",
        ),
        ({"max_iterations": 2.5}, ParameterTypeError, "max_iterations must be a whole number .*; got 2.5"),
    ],
)
def test_parameters_that_are_refused(arguments: dict[str, Any], kind: type[Exception], message: str) -> None:
    with pytest.raises(kind, match=message):
        tucker(CUBE, **{"ranks": (1, 1, 1), **arguments})
