"""Poles of a state matrix for the cross-check: isolated ones refined, the others as they are, each with its bound.

With right and left eigenvectors v and w of A, balanced by powers of two, first order says

    lambda - w^H (lambda v - A v) / (w^H v),    eps |w|^T |A| |v| / |w^H v|

for a better eigenvalue and for what rounding of the entries of A moves it. The residual is summed in twice the working
precision. A correction is taken where it is small against the distance to the other eigenvalues. Multiple ones keep
what QR gives, with a normwise bound, which is of the size by which rounding splits double ones.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy.linalg

from halfdof_ctrl.base.arrays import EPS, ComplexArray, FloatArray
from halfdof_ctrl.base.dense_lu import lu_factors
from halfdof_ctrl.base.exact_products import ExactPolynomial
from halfdof_ctrl.base.spectrum import balanced

ISOLATED = 0.1  #: of the distance to the next eigenvalue: a larger correction mixes with that one
SETTLED = 1e-12  #: relative error left, by second order, above which the vectors are found anew
SPLIT = EPS**0.5  #: of the size of A: rounding splits double eigenvalues by as much, and P(s) must excuse others
REFINED_POLES_MOST_ITERATED = 30  #: eigenvalues whose vectors are found anew, each of which takes a factorization


@dataclass(frozen=True, slots=True, eq=False)
class RefinedPoles:
    """The N eigenvalues of a matrix with their bounds."""

    values: ComplexArray  #: (N,) [rad/s]
    bounds: FloatArray  #: (N,) what relative errors of eps in A move each [rad/s]
    at_origin: npt.NDArray[np.bool_]  #: (N,) which are not told from zero
    gaps: FloatArray  #: (N,) distance of each from the next [rad/s]


def refined_poles(A: FloatArray) -> RefinedPoles:
    """Find the eigenvalues of a real matrix, and how far rounding of its entries may have moved each.

    Examples
    --------
    >>> poles = refined_poles(np.array([[-1e3, 1.0], [0.0, 1e-9]]))
    >>> poles.values.real.tolist(), poles.at_origin.tolist()
    ([-1000.0, 1e-09], [False, False])
    """
    if A.size == 0:
        return RefinedPoles(np.zeros(0, dtype=np.complex128), np.zeros(0), np.zeros(0, dtype=bool), np.zeros(0))
    matrix = balanced(np.asarray(A, dtype=float))
    triple = scipy.linalg.eig(matrix, left=True, right=True)
    values, left, right = (np.asarray(part, dtype=np.complex128) for part in triple)
    with np.errstate(all="ignore"):
        cosine = np.abs(np.einsum("ij,ij->j", left.conj(), right))
        size = float(np.linalg.norm(matrix, 2))
        coarse = np.minimum(EPS * size / cosine, np.finfo(float).max)
        exact = ExactPolynomial([-matrix, np.eye(len(matrix))])
        steps, fine = _first_order(matrix, exact, values, right, left)
        gaps = _gaps(values)
        isolated = np.abs(steps) <= ISOLATED * gaps
        found, bounds = (
            np.where(isolated, values + steps, values),
            np.where(isolated, fine, np.minimum(coarse, SPLIT * size)),
        )
        left_over = np.abs(steps) ** 2 / gaps / np.abs(values)
        rough = np.flatnonzero(isolated & (left_over > SETTLED) & (values.imag >= 0.0))
        for place in rough[np.argsort(left_over[rough])[::-1]][:REFINED_POLES_MOST_ITERATED].tolist():
            _iterate(matrix, exact, (found, bounds), place, gaps[place])
        conjugates = np.flatnonzero((values.imag > 0.0) & isolated)
        found[conjugates + 1], bounds[conjugates + 1] = found[conjugates].conj(), bounds[conjugates]
        # LAPACK puts conjugates side by side
    return RefinedPoles(found, bounds, (np.abs(found) <= bounds) | (np.abs(values) <= coarse), gaps)


def _first_order(
    A: FloatArray, exact: ExactPolynomial, values: ComplexArray, right: ComplexArray, left: ComplexArray
) -> tuple[ComplexArray, FloatArray]:
    """Return the corrections of eigenvalues, and what relative errors of eps in A move them by."""
    product = np.einsum("ij,ij->j", left.conj(), right)
    steps = np.einsum("ij,ij->j", left.conj(), exact.residual(values, right)) / product
    data = EPS * np.einsum("ij,ij->j", np.abs(left), np.abs(A) @ np.abs(right)) / np.abs(product)
    largest = np.finfo(float).max
    return np.where(np.isfinite(steps), steps, np.inf), np.minimum(np.nan_to_num(data, nan=largest), largest)


def _gaps(values: ComplexArray) -> FloatArray:
    """Return the distance of each eigenvalue from the next one."""
    if values.size == 1:
        return np.array([np.inf])
    distance = np.abs(values[:, None] - values)
    np.fill_diagonal(distance, np.inf)
    return np.asarray(distance.min(axis=1))


def _iterate(
    A: FloatArray, exact: ExactPolynomial, found: tuple[ComplexArray, FloatArray], place: int, gap: float
) -> None:
    """Find the vectors of one eigenvalue anew by inverse iteration from both sides, and correct it once more."""
    values, bounds = found
    start = np.random.default_rng(0).standard_normal((len(A), 1)).astype(np.complex128)
    factors = lu_factors(A - values[place] * np.eye(len(A)))
    v, w = start, start
    for _ in range(2):
        v = np.asarray(scipy.linalg.lu_solve(factors, v / np.linalg.norm(v), check_finite=False))
        w = np.asarray(scipy.linalg.lu_solve(factors, w / np.linalg.norm(w), trans=2, check_finite=False))
    steps, data = _first_order(A, exact, values[[place]], v / np.linalg.norm(v), w / np.linalg.norm(w))
    if np.abs(steps[0]) <= ISOLATED * gap:
        values[place] += steps[0]
        bounds[place] = data[0]
