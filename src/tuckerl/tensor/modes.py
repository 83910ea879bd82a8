"""Unfolding, folding and the mode product: the three moves between tensors and matrices.

The mode-n unfolding of a tensor of shape (I_0, ..., I_{N-1}) is the matrix of shape (I_n, prod of the others)
whose columns are the mode-n fibres. Kolda and Bader [1]_ let the *first* of the remaining modes run fastest along
the columns; here the *last* one does (C order), so that unfolding mode 0 of a C-ordered array copies nothing. The
order of the columns changes neither singular values nor left singular vectors, and folding undoes it.

References
----------
.. [1] T. G. Kolda, B. W. Bader (2009). Tensor decompositions and applications. SIAM Review 51(3), 455-500,
   sections 2.4 and 2.5.
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tuckerl.checks import check_int, check_sequence, to_array
from tuckerl.errors import TensorError

Floats = NDArray[np.float64]


def unfold(X: NDArray[Any], mode: int) -> NDArray[Any]:
    """Lay a tensor out as a matrix with one mode along the rows.

    Parameters
    ----------
    X : (I_0, ..., I_{N-1}) array
    mode : int
        The mode n of the rows, from 0 to N-1.

    Returns
    -------
    (I_n, prod of the other sizes) array
        The mode-n unfolding, the other modes in their own order, last one fastest; a view where NumPy can give
        one, which it can for mode 0 of a C-ordered array.

    Raises
    ------
    ParameterTypeError, ParameterError
        If there is no such mode.

    Examples
    --------
    >>> import numpy as np
    >>> unfold(np.arange(8).reshape(2, 2, 2), mode=1)
    array([[0, 1, 4, 5],
           [2, 3, 6, 7]])
    """
    X = to_array("X", X, "an array")
    mode = _check_mode(mode, X.ndim)
    return np.moveaxis(X, mode, 0).reshape(X.shape[mode], math.prod(X.shape[:mode] + X.shape[mode + 1 :]))


def fold(matrix: NDArray[Any], mode: int, shape: Sequence[int]) -> NDArray[Any]:
    """Undo :func:`unfold`: make a tensor of a matrix that has one mode along its rows.

    Parameters
    ----------
    matrix : (I_n, prod of the other sizes) array
    mode : int
        The mode n of the rows, from 0 to N-1.
    shape : sequence of N int
        The shape (I_0, ..., I_{N-1}) of the tensor.

    Returns
    -------
    (I_0, ..., I_{N-1}) array
        A view of `matrix` where NumPy can give one.

    Raises
    ------
    ParameterTypeError, ParameterError
        If there is no such mode.
    TensorError
        If the matrix is not an unfolding of a tensor of that shape.

    Examples
    --------
    >>> import numpy as np
    >>> X = np.arange(24).reshape(2, 3, 4)
    >>> np.array_equal(fold(unfold(X, 2), 2, (2, 3, 4)), X)
    True
    """
    matrix = to_array("matrix", matrix, "an array")
    sizes = tuple(check_int("each of shape", size, 0) for size in check_sequence("shape", shape, "a tensor's sizes"))
    mode = _check_mode(mode, len(sizes))
    others = sizes[:mode] + sizes[mode + 1 :]
    if matrix.shape != (sizes[mode], math.prod(others)):
        raise TensorError(
            f"the mode-{mode} unfolding of a tensor of shape {sizes} has shape "
            f"{(sizes[mode], math.prod(others))}; got a matrix of shape {matrix.shape}: pass the shape that "
            "the tensor had when it was unfolded"
        )
    return np.moveaxis(matrix.reshape(sizes[mode], *others), 0, mode)


def mode_product(X: NDArray[Any], matrix: NDArray[Any], mode: int) -> NDArray[Any]:
    """Multiply a tensor by a matrix along one mode: ``unfold(Y, n) = matrix @ unfold(X, n)``.

    Parameters
    ----------
    X : (I_0, ..., I_{N-1}) array
    matrix : (J, I_n) array
    mode : int
        The mode n, from 0 to N-1.

    Returns
    -------
    (I_0, ..., I_{n-1}, J, I_{n+1}, ..., I_{N-1}) array
        The mode product ``Y = X x_n matrix``.

    Raises
    ------
    ParameterTypeError, ParameterError
        If there is no such mode.
    TensorError
        If the matrix does not have I_n columns, there are other things than numbers, or the product is not finite.

    Examples
    --------
    >>> import numpy as np
    >>> mode_product(np.arange(6).reshape(2, 3), np.ones((1, 3)), mode=1)
    array([[ 3.],
           [12.]])
    """
    X, matrix = to_array("X", X, "an array"), to_array("matrix", matrix, "an array")
    mode = _check_mode(mode, X.ndim)
    for name, array in (("X", X), ("matrix", matrix)):
        if array.dtype.kind not in "biufc":
            raise TensorError(f"{name} of a mode product must hold numbers; got dtype {array.dtype}")
    if matrix.ndim != 2 or matrix.shape[1] != X.shape[mode]:
        raise TensorError(
            f"the matrix of a mode-{mode} product with a tensor of shape {X.shape} must have shape "
            f"(any, {X.shape[mode]}); got {matrix.shape}: transpose it or choose another mode"
        )
    with np.errstate(over="ignore", invalid="ignore"):
        product = multiply_mode(X, matrix, mode)
    if not np.isfinite(product).all() and np.isfinite(X).all() and np.isfinite(matrix).all():
        raise TensorError(
            "a mode product must be finite where X and the matrix are; it leaves the range of floats: "
            "divide one of them by its largest entry"
        )
    return product


def _check_mode(mode: object, order: int) -> int:
    if order == 0:
        raise TensorError("a tensor must have at least one mode; got none: a single number has no unfolding")
    return check_int("mode", mode, 0, order - 1)


def multiply_mode(X: NDArray[Any], matrix: NDArray[Any], mode: int) -> NDArray[Any]:
    """Return :func:`mode_product` of arguments known to be right, without a transposed copy of the tensor."""
    before, after = X.shape[:mode], X.shape[mode + 1 :]
    blocks = X.reshape(math.prod(before), X.shape[mode], math.prod(after))
    product: NDArray[Any] = matrix @ blocks if after else blocks[:, :, 0] @ matrix.T
    return product.reshape(*before, matrix.shape[0], *after)


def multiply_all(X: Floats, matrices: Sequence[Floats]) -> Floats:
    """Multiply every mode by its matrix, those that make it shortest first to keep what lies between small."""
    for mode in sorted(range(X.ndim), key=lambda n: matrices[n].shape[0] / matrices[n].shape[1]):
        X = multiply_mode(X, matrices[mode], mode)
    return X
