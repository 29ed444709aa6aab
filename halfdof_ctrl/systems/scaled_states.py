"""Units for the states, powers of two: one for each DOF and one for time.

A displacement is measured in 2^d of its unit, a velocity of the same DOF in 2^(d + b), so that A holds 2^b where
``q' = 1 v`` stood. Powers of two round nothing. Those of the DOFs bring rows and columns of A to one size
(E. E. Osborne, 1960), one DOF after the other. Time that does so favours the fastest modes: on cantilevers of 10
to 80 elements python-control's evaluation is best, over a broad range, midway between that and the slowest mode.
"""

import numpy as np
import numpy.typing as npt
import scipy.linalg

from halfdof_ctrl.base.arrays import FloatArray, IndexArray
from halfdof_ctrl.base.dense_lu import lu_factors

MOST_SWEEPS = 50  #: through all DOFs; some ten are enough
SETTLED_EXPONENT = 0.25  #: a change of an exponent by less is none
DEEPEST_SCALE = 20  #: powers of two below the balanced time: slower modes, and those at the origin, count as there
POWER_STEPS = 16  #: of the iteration for the size of the slowest mode, the second half of which counts

Mask = npt.NDArray[np.bool_]


def unit_exponents(A: FloatArray, dof: IndexArray, order: IndexArray) -> tuple[IndexArray, int]:
    """Choose exponents of two for the states of ``x' = A x``.

    Parameters
    ----------
    A : (N, N) ndarray
    dof : (N,) ndarray of int
        Which DOF a state belongs to, counted from zero.
    order : (N,) ndarray of int
        0 for a displacement, 1 for a velocity, 2 for an acceleration.

    Returns
    -------
    (N,) ndarray of int
        e of ``x = 2^e x~``.
    int
        b: time is measured in 2^-b s.

    Examples
    --------
    >>> exponents, time = unit_exponents(np.array([[0.0, 1.0], [-(2.0**40), 0.0]]), np.zeros(2, int), np.arange(2))
    >>> exponents.tolist(), time
    ([0, 20], 20)
    """
    if A.size == 0:
        return np.zeros(0, dtype=np.intp), 0
    with np.errstate(divide="ignore"):
        log = np.log2(np.abs(A) * ~np.eye(len(A), dtype=bool))
    units, time = _balanced(log, dof, order, None)
    slowest = _slowest(A, units[dof] + order * time, time)
    time = float(np.rint((time + slowest) / 2.0))
    units, _ = _balanced(log, dof, order, time)
    return np.asarray(np.rint(units)[dof] + order * time).astype(np.intp), int(time)


def _balanced(log: FloatArray, dof: IndexArray, order: IndexArray, time: float | None) -> tuple[FloatArray, float]:
    """Return exponents of DOFs and of time that bring rows and columns to one size; time stays if it is given."""
    units, rate = np.zeros(int(dof.max()) + 1), 0.0 if time is None else time
    for _ in range(MOST_SWEEPS):
        change = 0.0
        for place in range(units.size):
            step = _step(log, units[dof] + order * rate, dof == place)
            units[place] += step
            change = max(change, abs(step))
        if time is None:
            step = _step(log, units[dof] + order * rate, order > 0)
            rate += step
            change = max(change, abs(step))
        if change < SETTLED_EXPONENT:
            break
    return units, rate


def _step(log: FloatArray, exponents: FloatArray, own: Mask) -> float:
    """Return the exponent that brings what enters and what leaves a group of states to one size."""
    mine, others = np.flatnonzero(own), np.flatnonzero(~own)
    entering = log[np.ix_(mine, others)] + exponents[others] - exponents[mine, None]
    leaving = log[np.ix_(others, mine)] + exponents[mine] - exponents[others, None]
    peaks = [float(part.max(initial=-np.inf)) for part in (entering, leaving)]
    if not np.isfinite(peaks).all():
        return 0.0
    rows, columns = (
        peak + 0.5 * np.log2(np.sum(4.0 ** (part - peak)))
        for peak, part in zip(peaks, (entering, leaving), strict=True)
    )
    return float(rows - columns) / 2.0


def _slowest(A: FloatArray, exponents: FloatArray, time: float) -> float:
    """Return log2 of the size of the slowest mode, by the power method on the inverse; at least time - DEEPEST."""
    scale = 2.0**exponents
    shift = 2.0 ** (time - DEEPEST_SCALE)
    factors = lu_factors(A * scale / scale[:, None] - shift * np.eye(len(A)))
    x = np.random.default_rng(0).standard_normal(len(A))
    growth = []
    for _ in range(POWER_STEPS):
        x = scipy.linalg.lu_solve(factors, x / np.linalg.norm(x), check_finite=False)
        growth.append(float(np.log2(np.linalg.norm(x))))
    return float(np.clip(-np.mean(growth[POWER_STEPS // 2 :]), time - DEEPEST_SCALE, time))
