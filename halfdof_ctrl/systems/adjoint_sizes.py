"""How large the adjoint solutions are that say what rounding does to a response: two points tell.

With (s I - A) x = b and (s I - A)^T y = c, reciprocity says that |y| |b| is about |x| |c|, as it is where forces and
motions change places. Where one acts on another and not back (filters in a row, a companion form), y may be larger by
any factor, and with it what rounding does to c x; at the ends of a list of points more than between, but for
resonances that b does not excite. In the coordinates of a Hessenberg form H a solution takes as many
operations as H has entries, by the LU decomposition of a band of one subdiagonal.
"""

import numpy as np
from numpy.lib.stride_tricks import as_strided
from scipy.linalg.lapack import zgbtrf, zgbtrs

from halfdof_ctrl.base.arrays import ComplexArray, FloatArray

FULL_STATES = 60  #: up to which solving both points at once takes less time than the band
ENDS = [0, -1]  #: places of the points that are looked at


def beyond_reciprocity(
    H: FloatArray, beta: float, outputs: FloatArray, lengths: FloatArray, points: ComplexArray, sizes: FloatArray
) -> FloatArray:
    """Return how much larger than reciprocity says the adjoint solutions of p outputs are, where that is most.

    Parameters
    ----------
    H : (n, n) ndarray
        Upper Hessenberg, in coordinates in which b is beta times the first unit vector.
    beta : float
    outputs : (p, n) ndarray
        Rows c in these coordinates.
    lengths : (p,) ndarray
        Their norms.
    points : (k,) complex ndarray
    sizes : (k,) ndarray
        Norms of the solutions x.

    Returns
    -------
    (p,) ndarray
        At least 1.

    Examples
    --------
    Two lags, the second of which acts on the first much more than the first on it:

    >>> H, c, s = np.array([[-1.0, 1e3], [1e-9, -1e-3]]), np.array([[1.0, 0.0]]), np.zeros(1, dtype=complex)
    >>> x = np.linalg.solve(-H, [1.0, 0.0])
    >>> float(beyond_reciprocity(H, 1.0, c, np.ones(1), s, np.linalg.norm(x, keepdims=True))[0].round(-3))
    1000000.0
    """
    y = _solutions(H, outputs.T[None].astype(np.complex128), points[ENDS])
    with np.errstate(all="ignore"):
        ratios = np.linalg.norm(y, axis=1) * (abs(beta) / sizes[ENDS])[:, None] / lengths
    return np.asarray(np.where(ratios < np.inf, ratios, 1.0).max(axis=0, initial=1.0))


def _solutions(H: FloatArray, right: ComplexArray, points: ComplexArray) -> ComplexArray:
    """Solve ``(s I - H)^T y = right`` at each point; not finite where it is an eigenvalue."""
    if len(H) <= FULL_STATES:
        try:
            return np.asarray(np.linalg.solve(points[:, None, None] * np.eye(len(H)) - H.T, right), dtype=np.complex128)
        except np.linalg.LinAlgError:  # at one of them: the band goes on
            pass
    return np.stack([_by_band(H, right[0], s) for s in points.tolist()])


def _by_band(H: FloatArray, right: ComplexArray, s: complex) -> ComplexArray:
    """Solve at one point: LAPACK holds entry (i, j) of a band matrix in row n + i - j of column j."""
    n = len(H)
    band = np.zeros((n + 2, n), dtype=np.complex128, order="F")
    step = band.itemsize
    as_strided(band[n:, 0], shape=(n, n), strides=(step, (n + 1) * step))[:] = -H  # below the band there are zeros
    band[n] += s
    factors, pivots, _ = zgbtrf(band, 1, n - 1, overwrite_ab=True)
    return np.asarray(zgbtrs(factors, 1, n - 1, right, pivots, trans=1)[0])
