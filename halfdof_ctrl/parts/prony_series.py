"""A Prony series on a measured curve: its columns, the best sizes at given rates, and all of it refined.

    K(s) = k0 + c0 s + sum of k_i s / (s + w_i),    k0, c0, k_i, w_i >= 0                  (P1)

At given rates w_i, (P1) is linear in its sizes, and non-negative least squares finds the best of them. Rates and sizes
together are refined in their logarithms, which keeps them positive, with the derivatives

    d/d(log k_i) = k_i s / (s + w_i),    d/d(log w_i) = -k_i s w_i / (s + w_i)^2
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.optimize

from halfdof_ctrl.base.arrays import ComplexArray, FloatArray
from halfdof_ctrl.parts.measured_curve import MeasuredCurve

OUTSIDE = 30.0  #: rates lie within the band and this factor below and above it: beyond, nothing shows them
TINY_BRANCH = 1e-14  #: of the largest column: a size below is a zero of the least squares
TOLERANCE = 1e-15  #: of the least squares, so that exact curves give parameters to rounding
ROUNDS = 6  #: of refinement and non-negative least squares in turns
WORTHWHILE = 0.99  #: of the cost: a round that lowers it by less is the last
POLISH = 4  #: plain Gauss-Newton steps at the end, which make no more compromise with a trust region
LARGEST_STEP = 1e-3  #: in the logarithm of a parameter that such a step may make


@dataclass(frozen=True, slots=True, eq=False)
class Series:
    """Sizes and rates of (P1) in the units of the curve, with what is left of the curve."""

    k0: float
    c0: float
    k: FloatArray  #: (N,)
    w: FloatArray  #: (N,), rising
    cost: float  #: sum of squares of the weighted residual

    def values(self, omega: FloatArray) -> ComplexArray:
        """Give K, less a static stiffness that is given."""
        s = 1j * omega
        return np.asarray(self.k0 + self.c0 * s + relaxing(omega, self.w) @ self.k)


def relaxing(omega: FloatArray, w: FloatArray) -> ComplexArray:
    """Give the columns ``s / (s + w_i)`` at s = j omega."""
    s = 1j * omega[:, None]
    return np.asarray(s / (s + w))


def best_sizes(curve: MeasuredCurve, w: FloatArray, extra: Sequence[ComplexArray] = ()) -> tuple[Series, FloatArray]:
    """Find the best sizes at given rates, and those of further columns; branches of size zero are dropped.

    Returns
    -------
    series : Series
        Its `cost` counts the further columns too.
    sizes : (k,) ndarray
        Of the further columns.
    """
    w = np.sort(w)
    fixed = ([] if curve.static is not None else [np.ones(curve.omega.size, dtype=complex)]) + [1j * curve.omega]
    columns = curve.weighted(np.column_stack([*fixed, relaxing(curve.omega, w), *extra]))
    norms = np.linalg.norm(columns, axis=0)
    norms[norms == 0.0] = 1.0
    scaled = columns / norms
    target = curve.weighted(curve.values)
    found, _ = scipy.optimize.nnls(scaled, target, maxiter=max(100, 20 * norms.size))
    active = found > TINY_BRANCH * found.max(initial=0.0)
    if active.any():  # once more by orthogonal factors, which keep the digits that normal equations lose
        again = np.linalg.lstsq(scaled[:, active], target, rcond=None)[0]
        if (again >= 0.0).all():
            found = np.zeros_like(found)
            found[active] = again
    cost = float(np.sum((scaled @ found - target) ** 2))
    sizes = found / norms
    first = len(fixed)
    k = sizes[first : first + w.size]
    kept = active[first : first + w.size] & (k > 0.0)
    k0 = 0.0 if curve.static is not None else float(sizes[0])
    return Series(k0, float(sizes[first - 1]), k[kept], w[kept], cost), sizes[first + w.size :]


def refined(curve: MeasuredCurve, series: Series) -> Series:
    """Move sizes and rates to the nearest minimum, and drop branches that vanish there.

    A size on its way to zero is slow in its logarithm; the least squares at the new rates drop it, and the next round
    goes on without it.
    """
    for _ in range(ROUNDS):
        before = series
        series = _refined_once(curve, before)
        if series.k.size == 0 or not series.cost < WORTHWHILE * before.cost:
            break
    return series


def _refined_once(curve: MeasuredCurve, series: Series) -> Series:
    if series.k.size == 0:
        return series
    low, high = curve.omega[0] / OUTSIDE, curve.omega[-1] * OUTSIDE
    fixed = np.array([value for value in (series.k0, series.c0) if value > 0.0])
    places = np.array([place for place, value in enumerate((series.k0, series.c0)) if value > 0.0], dtype=int)
    start = np.log(np.concatenate([fixed, series.k, np.clip(series.w, low * 1.0001, high / 1.0001)]))
    bounds = np.full(start.size, -np.inf), np.full(start.size, np.inf)
    bounds[0][fixed.size + series.k.size :], bounds[1][fixed.size + series.k.size :] = np.log(low), np.log(high)
    problem = _Problem(curve, places)
    with np.errstate(all="ignore"):  # a trial step may overflow, which the trust region answers
        solution = scipy.optimize.least_squares(
            problem.residual, start, problem.jacobian, bounds, x_scale="jac",
            ftol=TOLERANCE, xtol=TOLERANCE, gtol=TOLERANCE, max_nfev=300,
        )  # fmt: skip
    theta = _polished(problem, np.asarray(solution.x), bounds)
    w = np.exp(theta[fixed.size + series.k.size :])
    found, _ = best_sizes(curve, w)
    return found if found.cost < series.cost or found.k.size < series.k.size else series


def _polished(problem: "_Problem", theta: FloatArray, bounds: tuple[FloatArray, FloatArray]) -> FloatArray:
    """Make plain Gauss-Newton steps while they lower the residual."""
    cost = float(np.sum(problem.residual(theta) ** 2))
    for _ in range(POLISH):
        jacobian = problem.jacobian(theta)
        size = np.linalg.norm(jacobian, axis=0)
        size[size == 0.0] = 1.0
        step = np.linalg.lstsq(jacobian / size, -problem.residual(theta), rcond=None)[0] / size
        if not np.isfinite(step).all() or np.abs(step).max(initial=0.0) > LARGEST_STEP:
            return theta
        trial = np.clip(theta + step, *bounds)
        new = float(np.sum(problem.residual(trial) ** 2))
        if new >= cost:
            return theta
        theta, cost = trial, new
    return theta


@dataclass(frozen=True, slots=True, eq=False)
class _Problem:
    """The weighted residual of (P1) and its derivatives in logarithms of the positive parameters."""

    curve: MeasuredCurve
    fixed: FloatArray  # which of k0 (0) and c0 (1) are parameters

    def _columns(self, theta: FloatArray) -> tuple[ComplexArray, ComplexArray]:
        n = (theta.size - self.fixed.size) // 2
        omega, values = self.curve.omega, np.exp(theta)
        s = 1j * omega[:, None]
        steady = np.hstack([np.ones((omega.size, 1)), s])[:, self.fixed] * values[: self.fixed.size]
        k, w = values[self.fixed.size : self.fixed.size + n], values[self.fixed.size + n :]
        branch = k * s / (s + w)
        return np.hstack([steady, branch]), -branch * w / (s + w)

    def residual(self, theta: FloatArray) -> FloatArray:
        sizes, _ = self._columns(theta)
        return self.curve.weighted(sizes.sum(axis=1) - self.curve.values)

    def jacobian(self, theta: FloatArray) -> FloatArray:
        return self.curve.weighted(np.hstack(self._columns(theta)))
