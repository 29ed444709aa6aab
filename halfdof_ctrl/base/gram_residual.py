"""What a triangular factor leaves of a symmetric matrix, ``K - U^T U``, in twice the working precision.

As `exact_products` has it for any two matrices, with less than a quarter of the work: one factor instead of two is
cut into slices, of its square one triangle is needed, and triangular products do a half or a third of full ones.

    U = U_1 + U_2 + W,    X = U_1 + U_2 + W / 2
    U^T U = U_1^T U_1 + (U_1^T U_2 + U_2^T U_1) + (X^T W + W^T X) + U_2^T U_2

The leading bits U_1 and the next ones U_2 are so few that their products are exact, in whatever order a library sums
them, but for that of U_2 with itself, which is small, as W is.
"""

from collections.abc import Callable

import numpy as np
from scipy.linalg.blas import dtrmm
from scipy.linalg.lapack import dlauum
from scipy.sparse import csc_array

from halfdof_ctrl.base.arrays import FloatArray, powers_of_two
from halfdof_ctrl.base.double_double import BITS, two_sum
from halfdof_ctrl.base.matrix_residual import by_columns, has_few_entries


def gram_residual(K: FloatArray, U: FloatArray) -> FloatArray:
    """Return the upper triangle of ``K - U^T U``.

    Parameters
    ----------
    K : (n, n) ndarray
        Symmetric.
    U : (n, n) ndarray
        Upper triangular, ``U^T U`` near K.

    Returns
    -------
    (n, n) ndarray
        What stands below its diagonal has no meaning.

    Examples
    --------
    >>> U = np.array([[3.0, 1.0 / 3.0], [0.0, 1.0]])
    >>> float(gram_residual(np.array([[9.0, 1.0], [1.0, 2.0]]), U)[0, 1]) == 2.0**-54
    True
    """
    if has_few_entries(U):
        return _sparse_residual(K, by_columns(U))
    scale = powers_of_two(np.abs(U).max(axis=0, initial=0.0))
    return _residual(K, _slices(U, scale, len(U)), _product, _square)


def _residual(
    target: FloatArray,
    slices: tuple[FloatArray, FloatArray, FloatArray],
    product: Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]],
    square: Callable[[FloatArray], FloatArray],
) -> FloatArray:
    """Sum what is left of entries of K; products give themselves and their transpose."""
    first, second, rest = slices
    total, lost = two_sum(target, -square(first))
    for part in product(first, second):
        total, more = two_sum(total, -part)
        lost += more
    small, transposed = product(first + second + rest / 2.0, rest)
    return np.asarray(total + (lost - square(second) - small - transposed))


def _slices(values: FloatArray, scale: FloatArray, terms: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Cut numbers below 1 / scale into leading bits, the next ones and the rest, for exact sums of so many products."""
    bits = (BITS - 1 - int(np.ceil(np.log2(max(terms, 1))))) // 2
    unit = scale * 2.0**bits
    first = np.rint(values * unit) / unit
    left = values - first
    unit = unit * 2.0**bits
    second = np.rint(left * unit) / unit
    return first, second, left - second


def _square(U: FloatArray) -> FloatArray:
    """Return the upper triangle of ``U^T U`` for an upper triangular U."""
    return np.asarray(dlauum(np.asfortranarray(U[::-1, ::-1]), lower=1, overwrite_c=1)[0][::-1, ::-1])


def _product(X: FloatArray, W: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return ``X^T W`` for upper triangular X and W, and its transpose."""
    both = np.asarray(dtrmm(1.0, X, W, trans_a=1))
    return both, both.T


def _sparse_residual(K: FloatArray, U: csc_array) -> FloatArray:
    """Do so at the places that a sparse factor reaches alone."""
    count = np.diff(U.indptr)
    scale = powers_of_two(np.maximum.reduceat(np.abs(U.data), U.indptr[:-1]))
    i, j = (abs(U).T @ abs(U) + abs(by_columns(K))).nonzero()

    def matrix(values: FloatArray) -> csc_array:
        return csc_array((values, U.indices, U.indptr), shape=U.shape)

    def product(X: FloatArray, W: FloatArray) -> tuple[FloatArray, FloatArray]:
        both = (matrix(X).T @ matrix(W)).toarray()
        return both[i, j], both[j, i]

    slices = _slices(U.data, np.repeat(scale, count), int(count.max(initial=1)))
    left = np.zeros(K.shape)
    left[i, j] = _residual(K[i, j], slices, product, lambda X: product(X, X)[0])
    return left
