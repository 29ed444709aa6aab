"""How near a matrix polynomial is to a singular one, measured in rounding of its entries, for the oracle.

If every entry of R_0, R_1, R_2 may change by the part t of itself, P(s) stays nonsingular while

    t rho < 1,   rho = spectral radius of |P(s)^-1| (|R_0| + |s| |R_1| + |s|^2 |R_2|)            (34)

(J. Rohn, 1989). One s where that holds proves that ``det P`` does not vanish identically. Unlike a condition number,
rho does not depend on the units of rows and columns.
"""

from collections.abc import Sequence

import numpy as np

from halfdof_ctrl.base.arrays import EPS, ComplexArray, DenseMatrix, FloatArray
from halfdof_ctrl.base.errors import UncertainRankError
from halfdof_ctrl.base.names import listed
from halfdof_ctrl.descriptor.finite_part import GENERIC_POINTS
from halfdof_ctrl.descriptor.patterns import diagonal_blocks
from halfdof_ctrl.descriptor.scaled_polynomial import ScaledPolynomial

POWER_ITERATIONS = 12  #: of the power method, for a factor that need not be known well
UNDECIDED = 1e-2  #: a share of rounding above may hide that a model is singular: products round by tens of eps


@np.errstate(all="ignore")  # numbers near the largest and the smallest doubles
def share_of_rounding(coefficients: Sequence[DenseMatrix]) -> float:
    """Return ``eps rho`` of (34), the least over a few points: below one, no rounding of the entries makes P singular.

    Examples
    --------
    Two springs of 1 and 1e-15 N/m, each known to its last digit, are as far from singular as one of 1 N/m; two forces
    that differ by 1e-14 are not:

    >>> none = np.zeros((2, 2))
    >>> share_of_rounding([np.diag([1.0, 1e-15]), none, none]) < 1e-15
    True
    >>> share_of_rounding([np.array([[1.0, 1.0], [1.0, 1.0 + 1e-14]]), none, none]) > 1e-2
    True
    """
    worst = 0.0
    for rows, columns in diagonal_blocks(np.any([part != 0.0 for part in coefficients], axis=0)):
        if rows.size != columns.size:
            return float("inf")
        if rows.size > 1:
            polynomial = ScaledPolynomial.of([part[np.ix_(rows, columns)] for part in coefficients])
            worst = max(worst, _of_block(polynomial))
    return worst


def nearly_singular(share: float, what: str = "P(s)") -> str:
    """Say that a matrix polynomial is regular by no more than rounding."""
    return (
        f"the stored numbers are regular, but changes of {EPS / share:.1e} of each entry can make "
        f"det {what} vanish identically, and rounding is {EPS:.1e}"
    )


def undecided_regularity(share: float, dofs: Sequence[str]) -> UncertainRankError:
    """Refuse to tell whether a model is singular whose stored numbers are regular by no more than rounding."""
    msg = (
        f"Whether the pencil is singular cannot be told: the stored numbers are regular, but a change of each entry by "
        f"{EPS / share:.1e} of itself may make det P(s) vanish at every s, and rounding of an entry is {EPS:.1e} (of a "
        f"product of matrices tens of that). DOFs {listed(tuple(dofs))} take part in the motion that next to no force "
        "resists. Give the model in the coordinates in which its constraints are plain numbers, remove what is "
        "redundant, or give what is loose a stiffness that stands above rounding."
    )
    return UncertainRankError(msg, dofs=tuple(dofs), gap=1.0 / share)


def _of_block(polynomial: ScaledPolynomial) -> float:
    best = float("inf")
    for point in GENERIC_POINTS:
        P = polynomial.at(np.array([point]))[0]
        try:
            inverse = np.abs(_inverse(P))
        except np.linalg.LinAlgError:  # exactly singular
            continue
        if np.isfinite(inverse).all():
            best = min(best, EPS * _spectral_radius(inverse, polynomial.sizes_at(point)))
        if best <= UNDECIDED**2:
            break
    return best


def _inverse(P: ComplexArray) -> ComplexArray:
    return np.asarray(np.linalg.solve(P, np.eye(len(P), dtype=np.complex128)))


def _spectral_radius(left: FloatArray, right: FloatArray) -> float:
    """Return the spectral radius of a product of matrices without negative entries, by the power method."""
    vector, radius = np.ones(right.shape[1]), 0.0
    for _ in range(POWER_ITERATIONS):
        image = left @ (right @ vector)
        radius = float(image.max(initial=0.0))
        if not 0.0 < radius < np.inf:
            break
        vector = image / radius
    return radius
