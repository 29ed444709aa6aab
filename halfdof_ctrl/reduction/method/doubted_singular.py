"""Whether a pencil that seems singular is: what rounding of the entries can make of it, and what it cannot.

In rotated coordinates and beside stiff parts a soft one is lost to working precision: P(s) then seems singular at every
s, though no rounding of the entries makes it so. A model that was singular before its entries were rounded, in decimals
or by a change of coordinates, is within half a rounding of that. So the smallest change of the entries that makes P(s)
singular tells the two apart.
"""

import numpy as np

from halfdof_ctrl.base.arrays import EPS, FloatArray
from halfdof_ctrl.base.errors import SingularPencilError, UncertainRankError
from halfdof_ctrl.base.names import listed
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.reduction.algebra.integers import as_floats, as_integers, is_regular, solved_exactly
from halfdof_ctrl.reduction.method.proof import SINGULAR_AT_POINTS, scaled_pencil

MOST_INVERTED = 30  #: DOFs up to which P(s) is inverted in integers, in less than a second
ROUNDED_ENTRIES = 2 * EPS  #: of the largest singular value: rounding of the entries of a singular P(s) left at most 0.8
REAL_POINTS = (1, 3)  #: of s, in units in which it is near one
SURELY_APART = 8 * EPS  #: times n: what rounding of coordinates makes of an entry is less by far, 0.8 eps as measured
MOST_LOOKED_AT = 500  #: DOFs up to which a model that seems singular is looked at, in a second


def not_singular_error(model: SecondOrderModel, refusal: SingularPencilError) -> UncertainRankError | None:
    """Make the refusal of a dense model that no rounding of its entries makes singular; None if it is singular.

    A model that was singular before its entries were rounded stays called that, though the stored numbers are regular.
    """
    n = len(model.dofs)
    if n > MOST_LOOKED_AT:
        return None
    pencil = scaled_pencil(model)[2]
    if not is_regular(np.stack(model.quadratics.P)):
        return None
    size, change = pencil.regularity(), change_to_singular(pencil.P) if n <= MOST_INVERTED else None
    if size <= ROUNDED_ENTRIES if change is None else change <= EPS:
        return None
    by_entries = (
        "" if change is None else f", and no change of each entry by less than {change:.1e} of itself undoes that"
    )
    msg = (
        f"Whether the pencil is singular cannot be told: det P(s) vanishes at every s to working precision, but the "
        f"numbers as they are stored are regular{by_entries}. The smallest singular value of P(s) after scaling is "
        f"{size:.1e} of the largest; rounding of an entry is {EPS:.1e}, and sums and products of {n} DOFs round by up "
        f"to {SINGULAR_AT_POINTS / EPS * n:.0f} times that. DOFs {listed(refusal.dofs)} are held by a part of M, C, K "
        "alone that rounding could have made. Look for entries that nearly cancel: give those DOFs the mass, damper or "
        "spring that is meant, take out what is redundant, or take coordinates in which constraints are plain numbers."
    )
    return UncertainRankError(msg, dofs=refusal.dofs, gap=max(1.0, size / (SINGULAR_AT_POINTS * n)))


def is_apart_from_singular(coefficients: FloatArray) -> bool:
    """Tell whether P(s) is regular for certain, however nearly singular it is to working precision.

    Each entry but exact zeros may change by the rounding of sums and products of as large ones as there are, as a
    change of coordinates rounds them, 8 n eps. Two constraints that differ by 1e-10 are two, though a direct solve,
    which squares that, takes them for one.

    Parameters
    ----------
    coefficients : (3, n, n) ndarray
        In units in which s and the largest entries are near one.

    Examples
    --------
    >>> P = np.zeros((3, 3, 3))
    >>> P[0] = [[1.0, 1.0, 1.0], [1.0, 0.0, 0.0], [1.0, 1e-10, 0.0]]
    >>> is_apart_from_singular(P), is_apart_from_singular(P @ np.diag([1.0, 1.0, 1e-10]))
    (True, True)
    """
    n = coefficients.shape[1]
    if n > MOST_INVERTED:
        return False
    largest = np.maximum(np.abs(coefficients).max(initial=0.0), 1.0)
    return bool(change_to_singular(coefficients, np.where(coefficients != 0.0, largest, 0.0)) > SURELY_APART * n)


def change_to_singular(coefficients: FloatArray, sizes: FloatArray | None = None) -> float:
    """Return the part of itself by which each entry of ``P_0 + P_1 s + P_2 s^2`` may change with P(s) still regular.

    That is one over the spectral radius of ``|P(s)^-1| (|P_0| + s |P_1| + s^2 |P_2|)`` (J. Rohn, 1989), the better of
    two points, with an inverse of integers: eps / 2 or less if P(s) was singular before its entries were rounded.

    Parameters
    ----------
    coefficients : (3, n, n) ndarray
        In units in which s is near one.
    sizes : (3, n, n) ndarray, optional
        Of what entries change by a part; by default themselves.

    Examples
    --------
    >>> P = np.zeros((3, 2, 2))
    >>> P[0] = [[1.0, 1.0], [1.0, 1.0 + 2.0**-40]]
    >>> round(change_to_singular(P) * 2.0**42, 9)
    1.0
    """
    P, times = as_integers(coefficients)
    size, by = as_integers(np.abs(coefficients) if sizes is None else sizes)
    best = 0.0
    for s in REAL_POINTS:
        matrix, size_at = (part[0] + part[1] * s + part[2] * s**2 for part in (P, size))
        try:
            inverse, factor = solved_exactly(matrix, as_integers(np.eye(len(matrix)))[0])
            product = as_floats((abs(inverse) @ size_at) << times, abs(factor) << by)
        except (np.linalg.LinAlgError, OverflowError):
            continue
        best = max(best, 1.0 / float(np.abs(np.linalg.eigvals(product)).max(initial=EPS)))
    return best
