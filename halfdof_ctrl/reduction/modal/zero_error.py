"""How far the antiresonances of a small model are from those of the full one, one solve with the full model each.

Where a transfer function is small, an error relative to its largest value says nothing of its notches. A zero z of the
small model's channel is not quite one of the full model's, and to first order that lies at

    z - H(z) / H_s'(z),

H of the full model, the slope of the small one. What rounding of the entries makes of H(z), (DATA), bounds what such a
shift can be told from.
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg

from halfdof_ctrl.base.arrays import ComplexArray, FloatArray
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.model.sparse_evaluation import SparseTransfer

ZERO_ERROR_MOST_CHANNELS = 4  #: whose zeros are looked at
MOST_ZEROS = 12  #: of a channel, those nearest to the end of the band
ZERO_ERROR_ZERO_EFFORT = 4e8  #: channels times cubed size of their pencils that this may take
LIGHT_ZERO = 0.1  #: damping ratio of what is no notch
SLOPE_STEP = 1e-6  #: of a zero: step of a difference quotient
ZERO_ERROR_BESIDE_POLE = 1e-4  #: relative slope that tells a zero from one that a pole cancels


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ZeroErrors:
    """Errors of k antiresonances in the band."""

    frequencies: FloatArray  #: (k,) of the small model [Hz]
    shift: FloatArray  #: (k,) relative to the frequency
    floor: FloatArray  #: (k,) relative shift that rounding of the full model's entries may make

    @property
    def worst(self) -> int | None:
        """Which is shifted most, by more than rounding where there is one; None where there are none."""
        if self.shift.size == 0:
            return None
        told = self.shift * (self.shift > self.floor)
        return int(told.argmax()) if told.any() else int(self.shift.argmax())


def zero_errors(
    full: SparseTransfer, small: SecondOrderModel, poles: ComplexArray, band: tuple[float, float]
) -> ZeroErrors:
    """Measure the shift of the antiresonances in a band.

    Parameters
    ----------
    full : SparseTransfer
        Evaluates the full model.
    small : SecondOrderModel
        Dense.
    poles : (k,) complex ndarray
        Of the small model, in the band [rad/s].
    band : (float, float)
        [Hz].
    """
    p, m = small.D.shape
    channels = [(i, j) for i in range(p) for j in range(m)][:ZERO_ERROR_MOST_CHANNELS]
    rows: list[tuple[float, float, float]] = []
    if len(channels) * (2.0 * len(small.dofs) + 1.0) ** 3 > ZERO_ERROR_ZERO_EFFORT:
        channels = []
    for i, j in channels:
        channel = small.select(small.inputs[j], small.outputs[i])
        for zero in _notches(channel, band).tolist():
            steps = zero * (1.0 + SLOPE_STEP * np.array([-1.0, 0.0, 1.0]))
            values = channel(steps, squeeze=False)[0, 0]
            slope = abs(values[2] - values[0]) / (2.0 * SLOPE_STEP)
            distance = float((np.abs(poles - zero) / abs(zero)).min(initial=np.inf))
            if not np.isfinite(slope) or slope == 0.0 or distance < ZERO_ERROR_BESIDE_POLE:
                continue
            found = full.at(zero)[i, j] - values[1]
            if np.isfinite(found):
                floor = float(full.limit.data[i, j]) / slope
                rows.append((abs(zero) / (2.0 * np.pi), float(abs(found)) / slope, floor))
    table = np.array(sorted(rows)).reshape(-1, 3)
    return ZeroErrors(frequencies=table[:, 0], shift=table[:, 1], floor=table[:, 2])


def _notches(channel: SecondOrderModel, band: tuple[float, float]) -> ComplexArray:
    """Return the lightly damped zeros of a channel in the band, those nearest to its end."""
    n, scale = len(channel.dofs), 2.0 * np.pi * band[1]
    parts = [
        np.block([[P, -B], [F, D]]) * scale**power
        for power, (P, B, F, D) in enumerate(zip(*channel.quadratics, strict=True))
    ]
    size = np.abs(parts[0]) + np.abs(parts[1]) + np.abs(parts[2])
    for _ in range(3):  # rows and columns of one size
        size = size / np.where((rows := size.max(axis=1)) > 0.0, rows, 1.0)[:, None]
        parts = [part / np.where(rows > 0.0, rows, 1.0)[:, None] for part in parts]
        size = size / np.where((columns := size.max(axis=0)) > 0.0, columns, 1.0)
        parts = [part / np.where(columns > 0.0, columns, 1.0) for part in parts]
    unit, none = np.eye(n + 1), np.zeros((n + 1, n + 1))
    left = np.block([[none, unit], [-parts[0], -parts[1]]])
    right = np.block([[unit, none], [none, parts[2]]])
    alpha, beta = scipy.linalg.eig(left, right, right=False, homogeneous_eigvals=True)
    with np.errstate(all="ignore"):
        zeros = scale * np.asarray(alpha / beta, dtype=np.complex128)
    zeros = zeros[np.isfinite(zeros)]
    frequency = np.abs(zeros) / (2.0 * np.pi)
    inside = (frequency >= band[0]) & (frequency <= band[1]) & (zeros.imag > 0.0)
    inside &= np.abs(zeros.real) < LIGHT_ZERO * np.abs(zeros)
    zeros = zeros[inside]
    return np.asarray(zeros[np.argsort(-np.abs(zeros))[:MOST_ZEROS]])
