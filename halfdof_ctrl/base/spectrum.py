"""Eigenvalues of a state matrix, and how far rounding alone may have moved each of them."""

import numpy as np
import numpy.typing as npt
import scipy.linalg
from scipy.linalg.lapack import dgebal

from halfdof_ctrl.base.arrays import EPS, ComplexArray, FloatArray

ROUNDING_OF_A = 16 * EPS  #: relative errors in A that are no fault


def eigenvalues_and_rounding(A: FloatArray) -> tuple[ComplexArray, FloatArray]:
    """Return the eigenvalues and the first-order bound of what rounding in A moves each.

    The bound is 16 eps |A| over the cosine between left and right eigenvector, A balanced by powers of two. It
    holds for multiple eigenvalues as well: where rounding splits a double one by sqrt(eps), the computed
    vectors are so close to orthogonal that the bound is of that size.

    Parameters
    ----------
    A : (N, N) ndarray

    Returns
    -------
    (N,) complex ndarray
        Eigenvalues [rad/s].
    (N,) ndarray
        Bounds [rad/s].

    Examples
    --------
    >>> values, bounds = eigenvalues_and_rounding(np.array([[0.0, 1.0], [0.0, 0.0]]))
    >>> values.tolist(), bool(bounds.min() > 0.1)
    ([0j, 0j], True)
    """
    if A.size == 0:
        return np.zeros(0, dtype=np.complex128), np.zeros(0)
    matrix = balanced(A)
    values, left, right = scipy.linalg.eig(matrix, left=True, right=True)  # type: ignore[misc]  # stubs lack this case
    cosine = np.abs(np.einsum("ij,ij->j", left.conj(), right))
    with np.errstate(divide="ignore", over="ignore"):  # vectors that are orthogonal but for a denormal number
        return values, np.minimum(ROUNDING_OF_A * np.linalg.norm(matrix, 2) / cosine, np.finfo(float).max)


def balanced(A: FloatArray) -> FloatArray:
    """Scale the states by powers of two until rows and columns of A are of one size."""
    return balanced_states(A)[0]


def balanced_states(A: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Scale the states by powers of two and give the scaled A and the factors, ``x = factors x~``.

    LAPACK's gebal itself: `scipy.linalg.matrix_balance` turns the factors into integers too, which fails beyond 2^63.

    Examples
    --------
    >>> matrix, factors = balanced_states(np.array([[1.0, 2.0**80], [0.0, 1.0]]))
    >>> matrix.shape, factors.shape
    ((2, 2), (2,))
    """
    if A.size == 0:
        return A, np.ones(0)
    matrix, _, _, factors, _ = dgebal(A, scale=1, permute=0)
    return np.asarray(matrix), np.asarray(factors)


def sorted_eigenvalues(values: ComplexArray) -> ComplexArray:
    """Sort by size, conjugate pairs with the positive imaginary part first."""
    return values[order_by_size(values)]


def order_by_size(values: ComplexArray) -> npt.NDArray[np.intp]:
    """Return the order by size, conjugate pairs with the positive imaginary part first."""
    with np.errstate(divide="ignore"):
        size = np.log(np.abs(values)).round(9)  # conjugates may differ by rounding
    return np.lexsort((-values.imag, size))
