"""The points on the imaginary axis at which a loss of digits shows.

They lie beside the slowest modes of a state space. In a model of few DOFs, where a point costs next to nothing, also at
its typical frequencies, where an output or an input turns from displacements to velocities or accelerations, towards
rest, and in every decade between the slowest and the fastest of them: a mass that is tiny makes a pole that says
nothing of where the model is looked at.
"""

import sys
from collections.abc import Sequence
from itertools import combinations, pairwise
from typing import NamedTuple

import numpy as np
import scipy.linalg
from scipy.linalg.lapack import dgetrf
from scipy.sparse.linalg import ArpackError, ArpackNoConvergence, LinearOperator, eigs

from halfdof_ctrl.base.arrays import EPS, ComplexArray, FloatArray, IndexArray, as_dense
from halfdof_ctrl.base.spectrum import balanced_states, eigenvalues_and_rounding
from halfdof_ctrl.model.free_motions import free_motion_count
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.reduction.algebra.integers import degree_of_determinant, has_short_entries
from halfdof_ctrl.reduction.algebra.scaling import log_scaling_with_time
from halfdof_ctrl.reduction.method.masses import slowest_speed

ALL_EIGENVALUES = 60  #: up to which all eigenvalues are computed to choose the frequencies
SLOW_MODES = 6  #: of more states, that are looked for
SLOW_MODES_ACCURACY = 1e-3  #: accuracy of these
MOST_FREQUENCIES = 4  #: frequencies that are chosen
BESIDE_MODE = 1.003  #: times the frequency of a mode: an undamped resonance itself determines nothing
MODES_TRIED = 6  #: besides the slowest ones, over all: what is lost may show at any mode
BELOW_ALL = 0.1  #: times the slowest of them, where responses begin to be looked at
AT_ORIGIN = 1e-12  #: of the largest eigenvalue found: one below is no frequency
TYPICAL_SPEEDS = (0.2, 0.55, 1.6, 4.4)  #: looked at in a model of few DOFs as well, in units of its time scale
ANOTHER_SCALE = 3.0  #: binary logarithm of the ratio of two typical frequencies, from which on both are looked at
SLOWEST_SPEED = 1e-6  #: slower modes of such a model, in these units, are free motions that rounding has moved
TOWARDS_REST = (1e-12, 1e-8, 1e-4, 0.1)  #: of the slowest frequency of a model of few DOFs without free motions
EXACTLY_COUNTED = 20  #: DOFs up to which poles at the origin are counted exactly, in a few milliseconds
TOWARDS_FREE = 0.2  #: of the slowest other frequency of one with free motions, or, if the next is less, ...
DRIFT = 1e-11  #: part of a value that poles of free motions, which rounding has moved from the origin, may change there
NEAR_ORIGIN = 1e-3  #: of the slowest frequency: a slower pole may be one at the origin that rounding has moved
BESIDE_CORNER = 1.2  #: times the frequency at which terms of a signal are of one size, for they may cancel there
SAME_SPEED = 4.0  #: ratio of two frequencies of signals of which one is enough
MOST_OF_SIGNALS = 8  #: frequencies of signals that are looked at, spread over all
DECADE = 10.0  #: ratio of neighbouring frequencies at most, as far as ...
MOST_BETWEEN = 24  #: ... so many more allow
FEW_BITS = 10  #: bits of a frequency, so that exact arithmetic has short numbers
BESIDE_ZERO = 1e-3  #: of the mean size of the eigenvalues: where slow ones are looked for if A is singular


def loss_points(A: FloatArray) -> ComplexArray:
    """Choose points on the imaginary axis: beside the slowest oscillations and at the slowest real pole."""
    poles, bounds = _slow_eigenvalues(A)
    return beside_modes(poles[np.abs(poles) > bounds])


def beside_modes(moving: ComplexArray) -> ComplexArray:
    """Choose points beside the slowest oscillations among some poles and at the slowest real one."""
    moving = moving[np.argsort(np.abs(moving))]
    swinging, real = np.abs(moving[moving.imag > 0.0]), np.abs(moving[moving.imag == 0.0])
    chosen = np.concatenate([swinging[: MOST_FREQUENCIES - 1], real[:1]])
    return np.asarray(1j * BESIDE_MODE * (chosen if chosen.size else np.ones(1)))


def over_modes(sizes: FloatArray) -> ComplexArray:
    """Choose points beside some of the modes whose sizes are given in rising order, spread over all."""
    return np.asarray(1j * BESIDE_MODE * sizes[looked_at(sizes.size, MODES_TRIED)])


def looked_at(count: int, most: int) -> IndexArray:
    """Choose some of many, spread over all."""
    return np.unique(np.linspace(0, count - 1, min(count, most)).astype(np.intp))


def one_below(points: ComplexArray) -> ComplexArray:
    """Return, for channels that fall towards rest, as accelerations do, and their digits with them, a point below all.

    A decade below the slowest oscillation, which comes first, responses begin to be looked at.
    """
    return np.asarray(BELOW_ALL * points[:1])


def _slow_eigenvalues(A: FloatArray) -> tuple[ComplexArray, FloatArray]:
    """Return all eigenvalues of a small matrix or the smallest ones, and up to which size they may be zero."""
    N = len(A)
    if N <= ALL_EIGENVALUES:
        poles, rounding = eigenvalues_and_rounding(A)
        return poles, rounding + AT_ORIGIN * np.abs(poles).max(initial=0.0)
    matrix, _ = balanced_states(A)
    factors, shift = dgetrf(matrix)[:2], 0.0  # says nothing of free motions, which are looked after below
    pivots = np.abs(np.diag(factors[0]))
    if not pivots.any():  # nothing but free motions
        return np.zeros(0, dtype=np.complex128), np.zeros(0)
    if pivots.min() <= N * EPS * pivots.max():  # free motions: look beside zero
        shift = -BESIDE_ZERO * float(np.exp(np.log(np.maximum(pivots, EPS * pivots.max())).mean()))
        factors = dgetrf(matrix - shift * np.eye(N))[:2]
    inverse = LinearOperator(
        (N, N), matvec=lambda v: scipy.linalg.lu_solve(factors, v, check_finite=False), dtype=np.float64
    )
    start = np.random.default_rng(0).standard_normal(N)
    try:
        found = eigs(inverse, k=SLOW_MODES, v0=start, tol=SLOW_MODES_ACCURACY, return_eigenvectors=False)
    except ArpackNoConvergence as some:
        found = np.asarray(some.eigenvalues)
    except ArpackError:
        found = np.zeros(0, dtype=complex)
    poles = np.asarray(shift + 1.0 / found[found != 0.0], dtype=np.complex128)
    return poles, np.full(
        poles.size, (AT_ORIGIN if shift == 0.0 else SLOW_MODES_ACCURACY) * np.abs(poles).max(initial=0.0)
    )


class Slow(NamedTuple):
    """Frequencies [rad/s] below which little is looked at."""

    least: float  #: of what moves and where signals change their kind
    typical: float  #: of what moves


NOTHING_SLOW = Slow(0.0, 0.0)


def points_of_few(
    model: SecondOrderModel, A: FloatArray, speeds: Sequence[float], signals: Sequence[float]
) -> tuple[ComplexArray, Slow]:
    """Choose points for a model of few DOFs, and say which are slow for it.

    Parameters
    ----------
    model : SecondOrderModel
    A : (N, N) ndarray
    speeds : sequence of float
        `typical_speeds`.
    signals : sequence of float
        `signal_speeds`.
    """
    sizes = np.sort(np.abs(np.linalg.eigvals(A)))
    at_origin, exactly = _poles_at_origin(model, sizes, SLOWEST_SPEED * min(speeds))
    slowest = sizes[at_origin] / 2.0 if exactly and at_origin < sizes.size else SLOWEST_SPEED * min(speeds)
    slow = np.abs(loss_points(A)) if len(A) else np.zeros(0)
    if exactly:
        slow = np.append(slow, BESIDE_MODE * sizes[at_origin : at_origin + 1])
    own = np.concatenate([slow[slow > slowest], np.outer(speeds, TYPICAL_SPEEDS).ravel()])
    corners = _apart(np.asarray(signals))
    chosen = np.unique(np.concatenate([own, [slowest_speed(model) * BESIDE_MODE], corners]))
    if at_origin:
        others = next(part for part in (sizes[at_origin:], corners, own) if part.size)
        least = min(_end_of_drift(sizes[:at_origin]), TOWARDS_FREE * float(others.min()))
        if exactly:  # typical frequencies are no rounding of free motions: they are looked at whatever drifts there
            least = min(least, TYPICAL_SPEEDS[0] * min(speeds))
        chosen = np.append(chosen[chosen > least], max(least, TOWARDS_FREE * chosen[0]))
        chosen.sort()
    still = at_origin > 0 or float(sizes.min(initial=np.inf)) < NEAR_ORIGIN * chosen[0]
    rest = chosen[0] * np.array(() if still else TOWARDS_REST)
    step = max(DECADE, float(chosen[-1] / chosen[0]) ** (1.0 / MOST_BETWEEN))
    between = [
        low * (high / low) ** (np.arange(1, count) / count)
        for low, high in pairwise(chosen)
        if (count := int(np.ceil(np.log(high / low) / np.log(step)))) > 1
    ]
    mantissa, exponent = np.frexp(np.concatenate([rest, chosen, *between]))
    every = np.unique(np.ldexp(np.rint(np.ldexp(mantissa, FEW_BITS)), exponent - FEW_BITS))
    return np.asarray(1j * every), Slow(float(every[len(rest)]), float(own.min()))


def _poles_at_origin(model: SecondOrderModel, sizes: FloatArray, slowest: float) -> tuple[int, bool]:
    """Count the poles that should be at the origin, and say whether exactly: where no entry was rounded.

    Otherwise those of free motions, or the poles that are slower than any by which rounding may have moved them.
    """
    P = np.stack([as_dense(part) for part in model.quadratics.P])
    if P.shape[1] <= EXACTLY_COUNTED and has_short_entries(P):
        degree = degree_of_determinant(P[::-1])  # of s^2n det P(1 / s), without the factors s of det P(s)
        if degree >= 0:
            return min(2 * P.shape[1] - degree, sizes.size), True
    free = free_motion_count(model.M, model.C, model.K)
    return (int(np.count_nonzero(sizes < slowest)) if free is None else free.poles), False


def typical_speeds(model: SecondOrderModel) -> list[float]:
    """Return the typical frequency of a model of few DOFs, and that of its springs and dampers, where that is another.

    A single mass that is tiny makes the first one very large, though what moves without it is as slow as before.
    """
    K, C, M = (model.as_dense() if model.is_sparse else model).quadratics.P
    logs = [log_scaling_with_time(np.stack([K, C, M]))[2]]
    if K.any() and C.any():
        slow = log_scaling_with_time(np.stack([K, C]))[2]
        logs += [slow] if abs(slow - logs[0]) > ANOTHER_SCALE else []
    return [float(np.exp2(log)) for log in logs]


def signal_speeds(coefficients: Sequence[FloatArray]) -> list[float]:
    """Return the frequencies at which two entries of ``X_0 + X_1 s + X_2 s^2`` in one place are of one size.

    What stands in one place is measured in one unit, so that these do not depend on units.

    Examples
    --------
    A displacement and its acceleration, weighted with 1e-4 s^2:

    >>> signal_speeds([np.array([[1.0, 2.0]]), np.array([[0.0, 0.0]]), np.array([[1e-4, 0.0]])])
    [100.0]
    """
    found: list[float] = []
    for (j, low), (k, high) in combinations(enumerate(coefficients), 2):
        both = (low != 0.0) & (high != 0.0)
        found += (np.abs(low[both] / high[both]) ** (1.0 / (k - j))).tolist()
    return found


def _apart(speeds: FloatArray) -> FloatArray:
    """Return some frequencies that differ."""
    logs = np.unique(np.rint(np.log(speeds) / np.log(SAME_SPEED)))
    return np.asarray(BESIDE_CORNER * SAME_SPEED ** logs[looked_at(logs.size, MOST_OF_SIGNALS)])


def _end_of_drift(moved: FloatArray) -> float:
    """Return from which frequency on it is nothing that rounding has moved the poles of free motions from the origin.

    A pole p that should be at 0 changes the value at s by p / s of itself, two that should be there by (p / s)^2.
    """
    twice = (np.abs(moved[:, None] - moved) <= moved / 2.0).sum(axis=1) > 1
    return float((moved / np.where(twice, np.sqrt(DRIFT), DRIFT)).max(initial=sys.float_info.min))
