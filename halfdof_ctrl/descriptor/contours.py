"""Counting eigenvalues by circles: the mean of ``(s - c) p'(s)/p(s)`` over a circle, p = det P, for the oracle.

By Cauchy's formula the mean over the circle ``|s - c| = r`` is the number of eigenvalues within; with
``(s - c)^(k + 1)`` in place of ``s - c`` it is the sum of the k-th powers of their distances from c. The error of m
points falls as the m-th power of the ratio of r to the distances of the eigenvalues, inner and outer. So the mean is an
integer where there is a gap, and no integer where there is none: it needs no pencil, no vectors and no rank.
"""

from dataclasses import dataclass

import numpy as np

from halfdof_ctrl.base.arrays import ComplexArray
from halfdof_ctrl.descriptor.scaled_polynomial import ScaledPolynomial

CIRCLE_POINTS = 12  #: on a circle
WHOLE_COUNT = 0.05  #: a mean that is farther from an integer counts nothing
TURN = 0.37  #: of the angle between points: keeps them off the real and the imaginary axis


@dataclass(frozen=True, slots=True, eq=False)
class Contour:
    """Sums of powers over the eigenvalues in a circle."""

    radius: float
    moments: ComplexArray  #: mean of (s - c)^(k + 1) p'/p, divided by r^k, k = 0, 1, 2

    @property
    def count(self) -> int | None:
        """How many eigenvalues are within; None where the mean is no integer."""
        mean = complex(self.moments[0])
        if not np.isfinite(mean):
            return None
        nearest = round(mean.real)
        return nearest if abs(mean - nearest) <= WHOLE_COUNT and nearest >= 0 else None


def contour(polynomial: ScaledPolynomial, center: complex, radius: float) -> Contour:
    """Sum over the eigenvalues in a circle."""
    directions = np.exp(2j * np.pi * (np.arange(CIRCLE_POINTS) + TURN) / CIRCLE_POINTS)
    if polynomial.is_real and complex(center).imag == 0.0:  # points in conjugate pairs: half of them say all
        half = np.exp(2j * np.pi * (np.arange(CIRCLE_POINTS // 2) + 0.5) / CIRCLE_POINTS)
        slopes = polynomial.logarithmic_derivative(center + radius * half)
        directions, slopes = np.concatenate([half, half.conj()]), np.concatenate([slopes, slopes.conj()])
    else:
        slopes = polynomial.logarithmic_derivative(center + radius * directions)
    with np.errstate(all="ignore"):
        moments = [radius * np.mean(directions ** (k + 1) * slopes) for k in range(3)]
    return Contour(radius, np.array(moments))
