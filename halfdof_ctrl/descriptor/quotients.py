"""Eigenvalues of a matrix polynomial by QZ, each made sharper by two-sided quotients, each with its bound.

With right and left vectors x and y of QZ, one Newton step on ``y^T P(s) x`` takes the error to second order,

    s <- s - y^T P(s) x / y^T P'(s) x                                                      (32)

and what relative errors of eps in every entry move the eigenvalue by is known for nothing,

    eps |y|^T (|R_0| + |s| |R_1| + |s|^2 |R_2|) |x| / |y^T P'(s) x|                        (33)

(F. Tisseur, 2000), which is (DATA) of an eigenvalue. Where the step was not small, x and y are found anew by inverse
iteration, and the residual is summed in twice the working precision.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy.linalg
from scipy.linalg.lapack import zgetrf, zgetrs

from halfdof_ctrl.base.arrays import EPS, ComplexArray, FloatArray
from halfdof_ctrl.base.exact_products import ExactPolynomial
from halfdof_ctrl.descriptor.scaled_polynomial import ScaledPolynomial

SMALL_STEP = 1e-8  #: relative: a step below needs no better vectors
STEP_IN_BOUNDS = 1000.0  #: nor does one within so many bounds
QUOTIENT_ROUNDS = 4  #: of inverse iteration at most
INVERSE_ITERATIONS = 2  #: of inverse iteration from each side
SETTLED_BOUNDS = 4.0  #: a step within so many bounds ends the rounds
SLOW = 0.3  #: rounds end where a step is not smaller by this factor, and not within the bound
MOST_ITERATED = 100  #: eigenvalues that are iterated, each of which takes factorizations
FARTHEST = 1e100  #: starts beyond are infinite
KNOWN = 0.05  #: an eigenvalue is told from others where its bound is below this part of its size
STRAYED = 0.3  #: a start that moves by more than this part of its size belongs to no eigenvalue nearby


@dataclass(frozen=True, slots=True, eq=False)
class Estimates:
    """Eigenvalues in the unit of the polynomial, conjugates left out where it is real."""

    values: ComplexArray  #: (k,) in order of size
    bounds: FloatArray  #: (k,) of what rounding of the entries moves each in first order
    radii: FloatArray  #: (k,) the same for motions without force at s = 0, whose eigenvalue is double
    is_settled: npt.NDArray[np.bool_]  #: (k,) whether the last step was small against the value or within its bound

    @property
    def is_known(self) -> npt.NDArray[np.bool_]:
        """Whether an eigenvalue is told from zero, infinity and noise."""
        return np.asarray(self.is_settled & (self.bounds <= KNOWN * np.abs(self.values)))


def eigenvalue_estimates(polynomial: ScaledPolynomial) -> Estimates:
    """Return all that QZ finds at finite places, made sharper; some of it may stand for infinite eigenvalues."""
    starts, x, y = _starts(polynomial)
    values, bounds, steps, radii = _quotients(polynomial, starts, x, y)
    is_settled = _is_small(steps, values, bounds)
    unsettled = np.flatnonzero(~is_settled)
    if unsettled.size:
        exact = ExactPolynomial(polynomial.coefficients)
        worth = unsettled[bounds[unsettled] <= np.abs(starts[unsettled])]
        worth = worth[np.argsort(bounds[worth] / np.abs(starts[worth]), kind="stable")][:MOST_ITERATED]
        for k in worth.tolist():
            value, bound, is_settled[k] = _iterated(polynomial, exact, starts[k], x[:, k], y[:, k])
            if is_settled[k]:
                values[k], bounds[k] = value, bound
        unsettled = np.flatnonzero(~is_settled)  # multiple or none: where QZ has it, uncertain by the step to be taken
        values[unsettled] = starts[unsettled]
        bounds[unsettled] = np.fmax(bounds[unsettled], np.fmin(steps[unsettled], np.abs(starts[unsettled])))
    order = np.argsort(np.abs(values), kind="stable")
    return Estimates(values[order], bounds[order], np.minimum(radii, bounds)[order], is_settled[order])


def _is_small(steps: FloatArray, values: ComplexArray, bounds: FloatArray) -> npt.NDArray[np.bool_]:
    size = np.abs(values)
    return np.asarray((steps <= SMALL_STEP * size) & (steps <= STEP_IN_BOUNDS * bounds) & np.isfinite(size))


def _starts(polynomial: ScaledPolynomial) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """Solve the pencil in q and the velocities of the columns of R_2 that are not zero, by QZ with vectors."""
    R0, R1, R2 = polynomial.coefficients
    n = len(R0)
    moving = np.flatnonzero(R2.any(axis=0))
    unit = np.eye(n)[moving]
    corner = np.zeros((moving.size, moving.size))
    E = np.block([[R1, R2[:, moving]], [unit, corner]])
    A = np.block([[-R0, np.zeros((n, moving.size))], [np.zeros((moving.size, n)), np.eye(moving.size)]])
    (top, bottom), left, right = scipy.linalg.eig(A, E, left=True, right=True, homogeneous_eigvals=True)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        found = top / bottom
    kept = np.flatnonzero(np.abs(found) < FARTHEST)
    if polynomial.is_real:
        kept = kept[found[kept].imag >= 0.0]
    return found[kept], right[:n, kept].astype(np.complex128), left[:n, kept].conj().astype(np.complex128)


def _quotients(
    polynomial: ScaledPolynomial, s: ComplexArray, x: ComplexArray, y: ComplexArray
) -> tuple[ComplexArray, FloatArray, FloatArray, FloatArray]:
    """Take the step (32) for all at once; return values, bounds (33), sizes of the steps, and radii.

    Where the slope vanishes, the square says how far an eigenvalue moves: ``|y^T R_2 x| r^2`` equals the same sum.
    """
    R0, R1, R2 = polynomial.coefficients
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        Dx, Mx = R1 @ x, R2 @ x
        value = np.einsum("ij,ij->j", y, R0 @ x + s * (Dx + s * Mx))
        slope = np.einsum("ij,ij->j", y, Dx + 2.0 * s * Mx)
        steps = value / slope
        ax, size = np.abs(x), np.abs(s)
        terms = np.abs(R0) @ ax + size * (np.abs(R1) @ ax + size * (np.abs(R2) @ ax))
        rounding = EPS * np.einsum("ij,ij->j", np.abs(y), terms)
        bounds = rounding / np.abs(slope)
        radii = 2.0 * np.sqrt(rounding / np.abs(np.einsum("ij,ij->j", y, Mx)))
    moved = np.where(np.isfinite(steps), s - steps, s)
    without_nan = [np.where(np.isnan(part), np.inf, part) for part in (bounds, np.abs(steps), radii)]
    return moved, without_nan[0], without_nan[1], without_nan[2]


def _iterated(
    polynomial: ScaledPolynomial, exact: ExactPolynomial, start: complex, x: ComplexArray, y: ComplexArray
) -> tuple[complex, float, bool]:
    """Improve one eigenvalue by inverse iteration and quotients whose residual is exact but for one rounding."""
    s, last = complex(start), float("inf")
    with np.errstate(all="ignore"):
        for _ in range(QUOTIENT_ROUNDS):
            x, y = _inverse_iteration(polynomial, s, x, y)
            step, bound = _exact_step(polynomial, exact, s, x, y)
            if not np.isfinite(step) or abs(step) > 2.0 * abs(s):
                break
            is_settled = abs(step) <= max(SETTLED_BOUNDS * bound, 2.0 * EPS * abs(s))
            if not is_settled and abs(step) > SLOW * last:  # a multiple eigenvalue is not found in this way
                break
            s, last = s - step, abs(step)
            if is_settled:
                return s, bound, abs(s - start) <= STRAYED * abs(s)
    return s, float("inf"), False


def _exact_step(
    polynomial: ScaledPolynomial, exact: ExactPolynomial, s: complex, x: ComplexArray, y: ComplexArray
) -> tuple[complex, float]:
    """Return the step (32) and the bound (33)."""
    _, R1, R2 = polynomial.coefficients
    slope = complex(y @ (R1 @ x + 2.0 * s * (R2 @ x)))
    if slope == 0.0 or not np.isfinite(slope):
        return complex(np.inf), float("inf")
    residual = complex(y @ -exact.residual(s, x[:, None])[:, 0])
    rounding = EPS * float(np.abs(y) @ polynomial.sizes_at(s) @ np.abs(x))
    return residual / slope, rounding / abs(slope)


def _inverse_iteration(
    polynomial: ScaledPolynomial, s: complex, x: ComplexArray, y: ComplexArray
) -> tuple[ComplexArray, ComplexArray]:
    """Return better right and left vectors; a pivot that vanishes is as good as the last digit of the largest."""
    lu, pivots, _ = zgetrf(polynomial.at(np.array([s]))[0])
    diagonal = np.diagonal(lu)
    tiny = EPS * np.abs(diagonal).max(initial=0.0) * EPS
    weak = np.flatnonzero(np.abs(diagonal) <= tiny)
    lu[weak, weak] = tiny if tiny > 0.0 else 1.0
    for _ in range(INVERSE_ITERATIONS):
        x, _ = zgetrs(lu, pivots, x, trans=0)
        y, _ = zgetrs(lu, pivots, y, trans=1)
        x, y = (vector / np.abs(vector).max(initial=0.0) for vector in (x, y))
    return x, y
