"""Rates of a curve without scatter: poles of the rational functions that interpolate it.

With the points of the curve and their conjugates dealt alternately to a left set (mu, v) and a right set (lambda, u),

    L_ij = (v_i - u_j) / (mu_i - lambda_j),    S_ij = (mu_i v_i - lambda_j u_j) / (mu_i - lambda_j)

the pencil ``S - s L``, compressed to its rank, has the poles of the function behind the points (A. J. Mayo and A. C.
Antoulas, A framework for the solution of the generalized realization problem, Linear Algebra Appl. 425, 2007). Rows and
columns are divided by the square roots of their frequencies, since rates span decades. This gives rates to some digits,
for the refinement to start from; under scatter poles are anywhere.
"""

from collections.abc import Iterator

import numpy as np
import scipy.linalg

from halfdof_ctrl.base.arrays import FloatArray
from halfdof_ctrl.parts.measured_curve import MeasuredCurve

FEWEST_ORDERS = 2  #: points of either set
REAL_SHARE = 0.3  #: of its size: the imaginary part of a pole that may be real but for rounding
EXTRA_ORDERS = 2  #: ranks beyond the branches, for the stiffness when fast and the damper


def rational_rates(curve: MeasuredCurve, most: int) -> Iterator[FloatArray]:
    """Give the rates of rational functions of rising order, those that a passive series can have."""
    s, K = 1j * curve.omega, curve.values
    if s.size < 2 * FEWEST_ORDERS:
        return
    mu, v = (np.concatenate([part[::2], part[::2].conj()]) for part in (s, K))
    sigma, u = (np.concatenate([part[1::2], part[1::2].conj()]) for part in (s, K))
    scale = np.sqrt(np.abs(mu))[:, None] * np.sqrt(np.abs(sigma))
    gap = mu[:, None] - sigma
    first = (v[:, None] - u) / gap * scale
    second = ((mu * v)[:, None] - sigma * u) / gap * scale
    left = scipy.linalg.svd(np.hstack([first, second]))[0]
    right = scipy.linalg.svd(np.vstack([first, second]))[2].conj().T
    for rank in range(1, min(*first.shape, most + EXTRA_ORDERS) + 1):
        Y, X = left[:, :rank].conj().T, right[:, :rank]
        with np.errstate(divide="ignore", invalid="ignore"):
            poles = np.asarray(scipy.linalg.eigvals(Y @ second @ X, Y @ first @ X), dtype=np.complex128)
        rates = -poles.real
        sound = np.isfinite(poles) & (rates > 0.0) & (np.abs(poles.imag) < REAL_SHARE * np.abs(rates))
        if sound.any():
            yield np.sort(rates[sound])
