"""Units for the states, powers of two: one for each DOF and one for time.

A displacement is measured in 2^d of its unit, a velocity of the same DOF in 2^(d + b), so that A holds 2^b where
``q' = 1 v`` stood. Powers of two round nothing. They are chosen so that rows and columns of A are of one size (E. E. Osborne,
1960), one DOF after the other and then time, which python-control's own routines, without balancing of their own, need.
"""

import numpy as np

from halfdof_ctrl.base.arrays import FloatArray, IndexArray

MOST_SWEEPS = 50  #: through all DOFs; some ten are enough
SETTLED = 0.25  #: a change of an exponent by less is none


def unit_exponents(A: FloatArray, dof: IndexArray, order: IndexArray) -> tuple[IndexArray, int]:
    """Choose exponents of two for the states of ``x' = A x``.

    Parameters
    ----------
    A : (N, N) ndarray
    dof : (N,) ndarray of int
        Which DOF a state belongs to, counted from zero.
    order : (N,) ndarray of int
        0 for a displacement, 1 for a velocity.

    Returns
    -------
    (N,) ndarray of int
        e of ``x = 2^e x~``.
    int
        b of the unit of time 2^-b s.

    Examples
    --------
    >>> exponents, time = unit_exponents(np.array([[0.0, 1.0], [-(2.0**40), 0.0]]), np.zeros(2, int), np.arange(2))
    >>> exponents.tolist(), time
    ([0, 20], 20)
    """
    size = np.abs(A) * ~np.eye(len(A), dtype=bool)
    with np.errstate(divide="ignore"):
        log = np.log2(size)
    units, time = np.zeros(int(dof.max(initial=-1)) + 1), 0.0
    for _ in range(MOST_SWEEPS):
        change = 0.0
        for place in range(units.size):
            step = _step(log, units[dof] + order * time, dof == place)
            units[place] += step
            change = max(change, abs(step))
        step = _step(log, units[dof] + order * time, order == 1)
        time += step
        if max(change, abs(step)) < SETTLED:
            break
    units, b = np.rint(units).astype(np.intp), int(np.rint(time))
    return np.asarray(units[dof] + order * b), b


def _step(log: FloatArray, exponents: FloatArray, own: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> float:
    """Return the exponent that brings what enters and what leaves a group of states to one size."""
    mine, others = np.flatnonzero(own), np.flatnonzero(~own)
    entering = log[np.ix_(mine, others)] + exponents[others] - exponents[mine, None]
    leaving = log[np.ix_(others, mine)] + exponents[mine] - exponents[others, None]
    sizes = [float(part.max(initial=-np.inf)) for part in (entering, leaving)]
    if not np.isfinite(sizes).all():
        return 0.0
    rows, columns = (
        peak + 0.5 * np.log2(np.sum(4.0 ** (part - peak)))
        for part, peak in zip((entering, leaving), sizes, strict=True)
    )
    return float(rows - columns) / 2.0
