"""What a triangular factor leaves of a symmetric matrix, ``K - U^T U``, in twice the working precision.

As `exact_products` has it for any two matrices, with less than a quarter of the work: one factor instead of two is cut
into slices, of its square one triangle is needed, and triangular products do a half or a third of the work of full ones.

    U = U_1 + U_2 + W,    U^T U = U_1^T U_1 + (U_1^T U_2 + U_2^T U_1) + (X^T W + W^T X) + U_2^T U_2,    X = U_1 + U_2 + W / 2

The leading bits U_1 and the next ones U_2 are so few that their products are exact, in whatever order a library sums
them, but for that of U_2 with itself, which is small, as W is.
"""

import numpy as np
from scipy.linalg.blas import dtrmm
from scipy.linalg.lapack import dlauum
from scipy.sparse import csc_array

from halfdof_ctrl.base.arrays import FloatArray, powers_of_two
from halfdof_ctrl.base.double_double import BITS, two_sum

FEW_ENTRIES = 0.05  #: a factor with a smaller share of entries that are not zero is multiplied as a sparse one


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
    few = np.count_nonzero(U) <= FEW_ENTRIES * U.size
    terms = int(np.count_nonzero(U, axis=0).max(initial=1)) if few else len(U)
    bits = (BITS - 1 - int(np.ceil(np.log2(max(terms, 1))))) // 2
    unit = powers_of_two(np.abs(U).max(axis=0, initial=0.0)) * 2.0**bits
    first = np.rint(U * unit) / unit
    left = U - first
    unit *= 2.0**bits
    second = np.rint(left * unit) / unit
    rest = left - second
    product, square = (_sparse_product, _sparse_square) if few else (_product, _square)
    total, lost = two_sum(K, -square(first))
    across = product(first, second)
    for part in (across, across.T):
        total, more = two_sum(total, -part)
        lost += more
    small = product(first + second + rest / 2.0, rest)
    return np.asarray(total + (lost - square(second) - small - small.T))


def _square(U: FloatArray) -> FloatArray:
    """Return the upper triangle of ``U^T U`` for an upper triangular U."""
    return np.asarray(dlauum(np.asfortranarray(U[::-1, ::-1]), lower=1, overwrite_c=1)[0][::-1, ::-1])


def _product(X: FloatArray, W: FloatArray) -> FloatArray:
    """Return ``X^T W`` for upper triangular X and W."""
    return np.asarray(dtrmm(1.0, X, W, trans_a=1))


def _sparse_square(U: FloatArray) -> FloatArray:
    return _sparse_product(U, U)


def _sparse_product(X: FloatArray, W: FloatArray) -> FloatArray:
    return np.asarray((csc_array(X).T @ csc_array(W)).toarray())
