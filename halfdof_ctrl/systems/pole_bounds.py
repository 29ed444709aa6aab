"""Poles of a state matrix, each with the distance that rounding alone may have moved it.

With right and left eigenvectors v and w of A, balanced by powers of two, first order says

    lambda - w^H (A v - lambda v) / (w^H v),    data = 2 u |w|^T |A| |v| / |w^H v|

for a better eigenvalue and for what rounding of the entries of A moves it. The residual is formed in about twice the
working precision, so the correction is an error and no rounding. Where it is large the vectors are improved by inverse
iteration from both sides (A. M. Ostrowski, 1957). Small eigenvalues beside large ones keep the digits that the entries
of A give them: an eigenvalue solver alone leaves u |A| in each. First order says nothing of eigenvalues that rounding
does not tell apart; `pole_clusters` bounds these together.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy.linalg

from halfdof_ctrl.base.arrays import UNIT_ROUNDOFF, ComplexArray, FloatArray
from halfdof_ctrl.base.dense_lu import lu_factors
from halfdof_ctrl.base.double_double import added, matrix_product, two_product
from halfdof_ctrl.base.spectrum import balanced_states
from halfdof_ctrl.systems.pole_clusters import clusters

STEPS = 4  #: inverse iterations at most
COARSE_BOUND = 1e-3  #: a correction above this part of the eigenvalue calls for an iteration ...
DAMPING = 0.1  #: ... or above this part of its real part, which a picture of its peak rests on ...
RESOLVED = 1e-11  #: ... unless it is below this part of the eigenvalue
POLE_BOUNDS_MOST_REFINED = 150  #: states up to which the digits of the damping alone, or a bound, call for one
STEP = 4.0  #: an iteration that moves the eigenvalue farther, in units of its doubt or its size, went to another one


@dataclass(frozen=True, slots=True, eq=False)
class BoundedPoles:
    """The N eigenvalues of a matrix with their bounds."""

    values: ComplexArray  #: (N,) [rad/s], those that are not told from zero exactly zero
    bounds: FloatArray  #: (N,) what rounding of the matrix moves each [rad/s]

    @property
    def at_origin(self) -> npt.NDArray[np.bool_]:
        """Which are not told from zero."""
        return np.asarray(self.values == 0.0)


def bounded_poles(A: FloatArray) -> BoundedPoles:
    """Find the eigenvalues of a real matrix, and how far rounding of its entries may have moved each.

    Parameters
    ----------
    A : (N, N) ndarray

    Returns
    -------
    BoundedPoles

    Examples
    --------
    An eigenvalue of 1e-9 beside one of -1e9 is known to all digits; that of an integrator is zero:

    >>> bounded_poles(np.array([[-1e9, 1.0], [0.0, 1e-9]])).values.real.tolist()
    [-1000000000.0, 1e-09]
    >>> bounded_poles(np.array([[0.0, 1.0], [0.0, 0.0]])).at_origin.tolist()
    [True, True]

    A critically damped oscillator has a double pole, which rounding of its entries moves by the root of that:

    >>> twice = bounded_poles(np.array([[0.0, 1.0], [-1.0, -2.0]]))
    >>> twice.values.real.round(6).tolist(), bool((twice.bounds < 1e-6).all())
    ([-1.0, -1.0], True)
    """
    if A.size == 0:
        return BoundedPoles(np.zeros(0, dtype=np.complex128), np.zeros(0))
    matrix = balanced_states(np.asarray(A, dtype=float))[0]
    triple = scipy.linalg.eig(matrix, left=True, right=True)
    values, left, right = (np.asarray(part, dtype=np.complex128) for part in triple)
    values, bounds = _with_bounds(matrix, values, left, right)
    at_origin = np.abs(values) <= bounds
    return BoundedPoles(np.where(at_origin, 0.0, values), bounds)


def _with_bounds(
    A: FloatArray, values: ComplexArray, left: ComplexArray, right: ComplexArray
) -> tuple[ComplexArray, FloatArray]:
    """Correct the eigenvalues, and bound what is left."""
    upper = np.flatnonzero(values.imag >= 0.0)
    found, bounds = values.copy(), np.empty(values.size)
    v, w = right[:, upper].astype(np.complex128), left[:, upper].astype(np.complex128)
    correction, data = _first_order(A, values[upper], v, w)
    together = clusters(A, values, *_of_all(values, upper, data, np.abs(np.einsum("ij,ij->j", w.conj(), v))))
    shared = {place for cluster in together for place in cluster.places.tolist()}
    for k, place in enumerate(upper.tolist()):
        if place in shared:
            continue
        value, step, rounding = complex(values[place]), complex(correction[k]), float(data[k])
        if _is_coarse(value, step, rounding, fine=len(A) <= POLE_BOUNDS_MOST_REFINED):
            value, step, rounding = _iterated(A, value, (v[:, k], w[:, k]), step, rounding)
        doubt = abs(step)
        if doubt <= STEP * max(rounding, COARSE_BOUND * abs(value)):
            value += step
        found[place], bounds[place] = value, rounding + doubt
    _mirror(values, upper, found, bounds)
    for cluster in together:
        found[cluster.places], bounds[cluster.places] = cluster.values, cluster.bounds
    return found, bounds


def _of_all(
    values: ComplexArray, upper: npt.NDArray[np.intp], data: FloatArray, cosine: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Give what the upper halves of conjugate pairs have to the lower ones too."""
    both = np.empty((2, values.size))
    both[:, upper] = data, cosine
    pairs = upper[values[upper].imag > 0.0]
    both[:, pairs + 1] = both[:, pairs]
    return both[0], both[1]


def _mirror(values: ComplexArray, upper: npt.NDArray[np.intp], found: ComplexArray, bounds: FloatArray) -> None:
    """Give the lower halves of conjugate pairs what the upper ones have; LAPACK puts them side by side."""
    for place in upper[values[upper].imag > 0.0].tolist():
        found[place + 1], bounds[place + 1] = found[place].conjugate(), bounds[place]


def _is_coarse(value: complex, step: complex, rounding: float, *, fine: bool = True) -> bool:
    size = abs(step)
    if max(size, rounding if fine else 0.0) > COARSE_BOUND * abs(value):
        return True
    return fine and size > DAMPING * abs(value.real) and size > RESOLVED * abs(value)


def _iterated(
    A: FloatArray, value: complex, vectors: tuple[ComplexArray, ComplexArray], step: complex, rounding: float
) -> tuple[complex, complex, float]:
    """Improve an eigenvalue by inverse iteration from both sides, while it stays near."""
    unit, (v, w) = np.eye(A.shape[0]), vectors
    for _ in range(STEPS):
        shift = value + UNIT_ROUNDOFF * np.linalg.norm(A, 1) if value == 0.0 else value
        with np.errstate(all="ignore"):
            factors = lu_factors(A - shift * unit)
            v_new = scipy.linalg.lu_solve(factors, v, check_finite=False)
            w_new = scipy.linalg.lu_solve(factors, w, trans=2, check_finite=False)
            v_new, w_new = v_new / np.linalg.norm(v_new), w_new / np.linalg.norm(w_new)
        if not (np.isfinite(v_new).all() and np.isfinite(w_new).all()):
            break
        if value.imag == 0.0:
            v_new, w_new = _real(v_new), _real(w_new)
        correction, data = _first_order(A, np.array([value]), v_new[:, None], w_new[:, None])
        moved = complex(correction[0])
        if not abs(moved) <= STEP * max(rounding, abs(step), abs(value)):
            break
        v, w, better = v_new, w_new, value + moved
        correction, data = _first_order(A, np.array([better]), v[:, None], w[:, None])
        if not np.isfinite(data[0]):
            break
        value, step, rounding = better, complex(correction[0]), float(data[0])
        if not _is_coarse(value, step, 0.0):
            break
    return value, step, rounding


def _real(vector: ComplexArray) -> ComplexArray:
    """Turn the eigenvector of a real eigenvalue so that it is real."""
    largest = vector[np.argmax(np.abs(vector))]
    return np.asarray((vector * (abs(largest) / largest)).real.astype(np.complex128))


def _first_order(
    A: FloatArray, values: ComplexArray, right: ComplexArray, left: ComplexArray
) -> tuple[ComplexArray, FloatArray]:
    """Return the corrections of eigenvalues, and what rounding of A moves them."""
    residual = _residual(A, values, right)
    product = np.einsum("ik,ik->k", left.conj(), right)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        correction = np.einsum("ik,ik->k", left.conj(), residual) / product
        data = 2.0 * UNIT_ROUNDOFF * np.einsum("ik,ik->k", np.abs(left), np.abs(A) @ np.abs(right)) / np.abs(product)
    largest = np.finfo(float).max
    return np.where(np.isfinite(correction), correction, 0.0), np.minimum(np.nan_to_num(data, nan=largest), largest)


def _residual(A: FloatArray, values: ComplexArray, vectors: ComplexArray) -> ComplexArray:
    """Return ``A v - lambda v`` for the columns v, in about twice the working precision."""
    k = values.size
    parts = np.ascontiguousarray(np.hstack([vectors.real, vectors.imag]))
    high, low = matrix_product(A, parts)
    a, b, x, y = values.real, values.imag, vectors.real, vectors.imag
    real, imag = (high[:, :k], low[:, :k]), (high[:, k:], low[:, k:])
    for factor, vector in ((-a, x), (b, y)):
        real = added(real, two_product(np.broadcast_to(factor, vector.shape), vector))
    for factor, vector in ((-a, y), (-b, x)):
        imag = added(imag, two_product(np.broadcast_to(factor, vector.shape), vector))
    return np.asarray((real[0] + real[1]) + 1j * (imag[0] + imag[1]))
