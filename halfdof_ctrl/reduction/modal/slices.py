"""Spectrum slicing: the modes of intervals, each checked by how many there must be.

The number of negative pivots of ``K - sigma M = L D L^T`` is the number of modes below sigma (J. J. Sylvester, 1852),
so an interval that holds too many is cut in two. Shift-and-invert Lanczos with the shift inside a slice finds clustered
modes that one shift at zero does not tell apart, and a slice with fewer than its count is cut again (R. G. Grimes,
J. G. Lewis and H. D. Simon, A shifted block Lanczos algorithm, 1994).
"""

import numpy as np
from scipy.sparse import csc_array
from scipy.sparse.linalg import ArpackError, LinearOperator, eigsh

from halfdof_ctrl.base.arrays import FloatArray
from halfdof_ctrl.base.errors import ParameterError
from halfdof_ctrl.base.progress import progress_bar
from halfdof_ctrl.base.sparse_arrays import SparseMatrix
from halfdof_ctrl.base.sparse_factors import PIVOTINGS, sparse_lu
from halfdof_ctrl.base.sparse_products import times

MODES_IN_SLICE = 60  #: modes of a slice
SPARE = 4  #: modes that are asked for beyond a slice, so that its ends are not the last to converge
NARROW = 1e-7  #: relative width of a slice that is not cut further
OFFSET = 0.013  #: of a slice's width: its shift lies so far off the middle, where symmetric spectra have a mode
SLICES_BELOW = 1e-3  #: of the smallest stiffness over mass: so far below zero the first slice begins
CUTS = 60  #: of an interval, until the frequency is found that the wanted number of modes lies below
SLICE_PLACES = (0.513, 0.487, 0.531, 0.469, 0.557, 0.443)  #: parts of a slice at which it may be cut
FAR_APART = 4.0  #: ratio of the ends of a slice from which it is cut at a mean of logarithms
GROWTH = 1e4  #: of the largest entry in an elimination without interchanges: beyond, a count of its pivots is in doubt
NUDGES = (0.0, 1.7e-6, 1.3e-5, 1.1e-4, 1.1e-3, 1.1e-2)  #: relative moves away from where a count is in doubt
TRIES = 3  #: at a slice, with a larger subspace each


def modes_by_slices(K: SparseMatrix, M: SparseMatrix, count: int) -> tuple[FloatArray, FloatArray]:
    """Find the lowest modes of a symmetric pair, slice by slice.

    Parameters
    ----------
    K, M : (n, n) csc_arrays
        Positive semidefinite.
    count : int
        Number of modes.

    Returns
    -------
    squares : (count,) ndarray
        omega^2, rising [rad^2/s^2].
    shapes : (n, count) ndarray
        phi, ``phi^T M phi = 1``.

    Raises
    ------
    ParameterError
        There are not so many modes, or a slice does not give what it must hold.
    """
    low, high = _ends(K, M, count)
    squares, shapes = [], []
    left = [(*low, *high)]
    with progress_bar(high[1], "modes") as advance:
        while left:
            start, below, stop, above = left.pop()
            if above == below:
                continue
            is_narrow = stop - start <= NARROW * max(abs(stop), abs(start))
            found = None
            if above - below <= MODES_IN_SLICE or is_narrow:
                found = _in_slice(K, M, (start, stop), above - below)
            if found is not None:
                squares.append(found[0])
                shapes.append(found[1])
                advance(above - below)
                continue
            if is_narrow:
                msg = (
                    f"The Lanczos iteration does not find the {above - below} modes that lie between "
                    f"{_hertz(start):.6g} and {_hertz(stop):.6g} Hz. See that M and K are positive semidefinite."
                )
                raise ParameterError(msg, parameter="n_modes", value=count)
            middle, between = _cut(K, M, (start, below, stop, above))
            left += [(middle, between, stop, above), (start, below, middle, between)]
    every = np.concatenate(squares)
    order = np.argsort(every)[:count]
    return every[order], np.hstack(shapes)[:, order]


def _ends(K: SparseMatrix, M: SparseMatrix, count: int) -> tuple[tuple[float, int], tuple[float, int]]:
    """Return two places [rad^2/s^2] with the modes below: none below the first, as many as wanted below the second."""
    stiffness, mass = np.abs(K.diagonal()), M.diagonal()
    speeds = stiffness[mass > 0.0] / mass[mass > 0.0]
    positive = speeds[speeds > 0.0]
    low = _sound(K, M, -SLICES_BELOW * float(positive.min(initial=1.0)))
    high = _sound(K, M, float(positive.max(initial=1.0)))
    for _ in range(CUTS):
        if high[1] >= count:
            break
        high = _sound(K, M, 4.0 * high[0])
    else:
        msg = f"There are fewer than {count} modes."
        raise ParameterError(msg, parameter="n_modes", value=count)
    start = float(positive.min(initial=1.0)) * 2.0**-CUTS
    for _ in range(CUTS):
        middle = _sound(K, M, float(np.sqrt(start * high[0])))
        if middle[0] >= high[0]:
            break
        if middle[1] < count:
            start = middle[0]
        else:
            high = middle
        if count <= high[1] <= count + MODES_IN_SLICE or high[0] <= start * (1.0 + NARROW):
            break
    return low, high


def _sound(K: SparseMatrix, M: SparseMatrix, sigma: float) -> tuple[float, int]:
    """Return a place at or just beyond sigma at which the modes below are counted soundly, and their number."""
    best = sigma, 0, np.inf
    for shift in NUDGES:
        place = sigma * (1.0 + shift)
        count, growth = _inertia(K, M, place)
        if growth < best[2]:
            best = place, count, growth
        if growth < GROWTH:
            break
    return best[:2]


def _cut(K: SparseMatrix, M: SparseMatrix, ends: tuple[float, int, float, int]) -> tuple[float, int]:
    """Return a place inside a slice, and the number of modes below it, where that is counted soundly."""
    start, below, stop, above = ends
    even = start <= 0.0 or stop < FAR_APART * start
    best = 0.5 * (start + stop), (below + above) // 2, np.inf
    for part in SLICE_PLACES:
        middle = start + part * (stop - start) if even else float(start ** (1.0 - part) * stop**part)
        count, growth = _inertia(K, M, middle)
        if below <= count <= above and growth < best[2]:
            best = middle, count, growth
            if growth < GROWTH:
                break
    return best[:2]


def _inertia(K: SparseMatrix, M: SparseMatrix, sigma: float) -> tuple[int, float]:
    """Count negative pivots of ``K - sigma M``, and how much its elimination without interchanges grows."""
    shifted = csc_array(K - sigma * M)
    try:
        factors = sparse_lu(shifted, *PIVOTINGS[0])
    except RuntimeError:  # a mode to the last bit
        return 0, np.inf
    if (factors.perm_r != factors.perm_c).any():  # rows were interchanged, and pivots are no longer those of D
        return 0, np.inf
    growth = float(np.abs(factors.U.data).max(initial=0.0)) / (float(np.abs(shifted.data).max(initial=0.0)) or 1.0)
    return int(np.count_nonzero(factors.U.diagonal() < 0.0)), growth


def _in_slice(
    K: SparseMatrix, M: SparseMatrix, ends: tuple[float, float], count: int
) -> tuple[FloatArray, FloatArray] | None:
    """Find the modes of a slice; None where it does not give as many as it must hold."""
    n = K.shape[0]
    sigma = ends[0] + (0.5 + OFFSET) * (ends[1] - ends[0])
    try:
        factors = sparse_lu(csc_array(K - sigma * M))
    except RuntimeError:  # a mode to the last bit
        sigma += OFFSET * (ends[1] - ends[0])
        factors = sparse_lu(csc_array(K - sigma * M))
    inverse = LinearOperator((n, n), matvec=factors.solve, dtype=np.float64)
    for attempt in range(1, TRIES + 1):
        k = min(count + SPARE * attempt, n - 1)
        start = factors.solve(times(M, np.random.default_rng(attempt).standard_normal((n, 1)))[:, 0])
        try:
            squares, shapes = eigsh(
                K, k=k, M=M, sigma=sigma, OPinv=inverse, v0=start, ncv=min(2 * attempt * (k + SPARE), n)
            )
        except ArpackError:  # ArpackNoConvergence is one
            continue
        inside = (squares >= ends[0]) & (squares < ends[1])
        if np.count_nonzero(inside) == count:
            return squares[inside], shapes[:, inside]
    return None


def _hertz(square: float) -> float:
    return float(np.sqrt(max(square, 0.0)) / (2.0 * np.pi))
