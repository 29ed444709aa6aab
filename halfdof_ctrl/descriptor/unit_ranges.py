"""Eigenvalues over more decades than QZ has digits: one unit of time for the slow ones, one for the fast ones.

QZ is as accurate as the largest entries of the scaled pencil let it be. Eigenvalues that are 16 decades below the mean
are nothing to it, and those that are so much larger are infinite, although the entries that make them may be known
to the last digit. In the unit that is the mean of the tropical eigenvalues beyond what is known they stand alone.
"""

import numpy as np

from halfdof_ctrl.descriptor.quotients import Estimates, eigenvalue_estimates
from halfdof_ctrl.descriptor.scaled_polynomial import FAR_SCALE, ScaledPolynomial, mean_frequency_between

BEYOND_RANGE = 10.0  #: binary logarithm of the distance from the known ones at which others are looked for


def over_more_decades(polynomial: ScaledPolynomial, estimates: Estimates) -> Estimates:
    """Look for eigenvalues far below and far above the known ones in units of their own."""
    for is_below in (True, False):
        size = np.abs(estimates.values[estimates.is_known & (estimates.values != 0.0)])
        edge = float(np.log2(size.min() if is_below else size.max())) if size.size else 0.0
        edge += -BEYOND_RANGE if is_below else BEYOND_RANGE
        low, high = (-FAR_SCALE, edge) if is_below else (edge, FAR_SCALE)
        unit = mean_frequency_between(polynomial.coefficients, low, high)
        if unit == 1.0 or (unit > 2.0**edge) == is_below:
            continue
        found = _in_unit(eigenvalue_estimates(polynomial.in_unit(unit)), unit)
        border = 2.0**edge
        estimates = _joined(found, estimates, border) if is_below else _joined(estimates, found, border)
    return estimates


def _in_unit(estimates: Estimates, unit: float) -> Estimates:
    return Estimates(
        estimates.values * unit, estimates.bounds * unit, estimates.radii * unit, estimates.is_settled.copy()
    )


def _joined(slow: Estimates, fast: Estimates, border: float) -> Estimates:
    """Take the estimates below a border from one and those above from the other."""
    parts = [(slow, np.abs(slow.values) <= border), (fast, ~(np.abs(fast.values) <= border))]
    return Estimates(
        np.concatenate([part.values[which] for part, which in parts]),
        np.concatenate([part.bounds[which] for part, which in parts]),
        np.concatenate([part.radii[which] for part, which in parts]),
        np.concatenate([part.is_settled[which] for part, which in parts]),
    )
