"""Responses of the descriptor form with what the entries of a model determine of them, (DATA).

A soft spring beside one 1e14 times stiffer, or the mass of a beam cut into thousands of elements, is lost when entries
are rounded. Then every solver that sees only these numbers errs alike, and a check of one against another proves
nothing. So (DATA) is found where P(s) is nearly singular, and said where it matters.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from halfdof_ctrl.base.arrays import EPS, LARGEST_DENSE_COPY, ComplexArray, FloatArray
from halfdof_ctrl.base.digits import digits_in_words
from halfdof_ctrl.base.errors import DataLimitWarning, give_warning
from halfdof_ctrl.model.evaluation import data_limit, random_growth, transfer_and_growth
from halfdof_ctrl.model.quadratics import Quadratics
from halfdof_ctrl.model.refinement import SUSPECT_GROWTH, DataLimit
from halfdof_ctrl.model.second_order import SecondOrderModel

WARNED_DATA = 1e-6  #: part of the value from which (DATA) is told
AMPLIFIED = 100.0  #: and times the rounding of a file with few digits, which no one expects to see less of
MOST_LOOKED, MOST_CHANNELS = 16, 32  #: frequencies, and outputs or inputs, at which (DATA) is found beside a response
FEED_CANCELLED = 1e8  #: times the value, what passes directly from input to output and is taken away again
SPANNED = 8  #: frequencies at which a motion is looked at
BELOW_SLOWEST = 0.7  #: of the slowest eigenvalue, where the response is that of springs and of its own
LAST_DIGIT = "their last digit (2.2e-16)"
SMALL_SHIFT = 1e-8  #: relative change of frequency that nobody notices: what it makes beside a pole or zero is no loss


@dataclass(frozen=True, slots=True)
class Channels:
    """What a warning says of a response: the names of its channels, and to what its entries are known."""

    outputs: Sequence[str]
    inputs: Sequence[str]
    known_to: float = EPS

    @classmethod
    def of(cls, model: SecondOrderModel) -> "Channels":
        """Take those of a model."""
        return cls(model.outputs, model.inputs, model.known_to)


def dense_frequency_response(model: SecondOrderModel, frequencies: FloatArray) -> ComplexArray:
    """Evaluate equation (1) of a dense model at frequencies [rad/s], (p, m, k).

    Warns
    -----
    DataLimitWarning
        Entries known to their last digit do not determine it to 1e-6 of its value.
    """
    return warned_response(model.quadratics, frequencies, Channels.of(model))


def warned_response(quadratics: Quadratics, frequencies: FloatArray, channels: Channels) -> ComplexArray:
    """Evaluate ``F(s) P(s)^-1 B(s) + D(s)``, dense, at frequencies [rad/s], (p, m, k).

    Parameters
    ----------
    quadratics : tuple of P, B, F, D
        Coefficients of 1, s, s^2 each.
    frequencies : (k,) ndarray
    channels : Channels

    Warns
    -----
    DataLimitWarning
    """
    points = np.asarray(1j * frequencies, dtype=np.complex128)
    values, growth = transfer_and_growth(*quadratics, points)
    suspect = np.flatnonzero(
        _cancels(quadratics, frequencies, values) | (growth > SUSPECT_GROWTH * EPS / channels.known_to)
    )
    if suspect.size:
        limit = data_limit(*quadratics, points[suspect]).of_entries_known_to(channels.known_to)
        warn_of_data(channels, frequencies[suspect], values[:, :, suspect], limit, frequencies.size)
    return values


def _cancels(quadratics: Quadratics, frequencies: FloatArray, values: ComplexArray) -> npt.NDArray[np.bool_]:
    """Tell at which frequencies (k,) what passes directly from input to output is taken away again."""
    parts = [np.abs(np.asarray(part))[:, :, None] * frequencies**k for k, part in enumerate(quadratics.D)]
    with np.errstate(invalid="ignore"):
        return np.asarray((np.sum(parts, axis=0) > FEED_CANCELLED * np.abs(values)).any(axis=(0, 1)))


def amplifies(model: SecondOrderModel, frequencies: FloatArray) -> bool:
    """Tell whether rounding of a dense model's entries may be amplified to a part of the response that counts.

    P(s) is looked at, at the ends of the frequencies and between.

    Examples
    --------
    >>> from halfdof_ctrl.model.mechss import mechss
    >>> springs = [np.array([[1.0 + k, -k], [-k, k]]) for k in (4.0, 1e9)]
    >>> [amplifies(mechss(np.eye(2), None, K), np.array([0.1])) for K in springs]
    [False, True]
    """
    if model.known_to > EPS:
        return True
    points = np.asarray(1j * frequencies[[0, frequencies.size // 2, -1]], dtype=np.complex128)
    return bool((random_growth(model.quadratics.P, points) > SUSPECT_GROWTH).any())


def warn_of_values(model: SecondOrderModel, frequencies: FloatArray, values: ComplexArray) -> None:
    """Warn of a response (p, m, k) of a model, dense or of a size that its dense copy serves.

    Warns
    -----
    DataLimitWarning
    """
    if len(model.dofs) > LARGEST_DENSE_COPY:
        return
    dense = model.as_dense()
    if _cancels(dense.quadratics, frequencies, values).any() or amplifies(dense, frequencies):
        warn_of_digits(dense, frequencies, values, amplified=True)


def warn_of_span(model: SecondOrderModel, lowest: float, highest: float) -> None:
    """Warn of what is made of a model's motion between two frequencies [rad/s], such as a time response.

    Warns
    -----
    DataLimitWarning
    """
    if len(model.dofs) > LARGEST_DENSE_COPY:
        return
    few = model.select(model.inputs[:MOST_CHANNELS], model.outputs[:MOST_CHANNELS]).as_dense()
    frequencies = np.geomspace(lowest, highest, SPANNED)
    if amplifies(few, frequencies):
        warn_of_digits(few, frequencies, few(1j * frequencies, squeeze=False), amplified=True)


def warn_of_eigenvalues(model: SecondOrderModel, eigenvalues: ComplexArray) -> None:
    """Warn of eigenvalues of a model that are shown, by its response from below the slowest to the fastest of them.

    Warns
    -----
    DataLimitWarning
    """
    speeds = np.abs(eigenvalues)[(eigenvalues != 0.0) & np.isfinite(eigenvalues)]
    if speeds.size:
        warn_of_span(model, BELOW_SLOWEST * float(speeds.min()), float(speeds.max()))


def warn_of_digits(
    model: SecondOrderModel, frequencies: FloatArray, values: ComplexArray, *, amplified: bool = False
) -> None:
    """Warn of a response, however it was found, of a model whose entries do not determine it.

    Parameters
    ----------
    model : SecondOrderModel
    frequencies : (k,) ndarray
        [rad/s], of which at most 16 are looked at.
    values : (p, m, k) complex ndarray
        Of which the first 32 outputs and inputs are.
    amplified : bool
        Look at a model whose entries are known to their last digit as well.

    Warns
    -----
    DataLimitWarning
    """
    known = model.known_to <= EPS and not amplified
    if known or len(model.dofs) > LARGEST_DENSE_COPY or not frequencies.size:
        return
    looked = np.unique(np.linspace(0, frequencies.size - 1, MOST_LOOKED).round().astype(int))
    few = model.select(model.inputs[:MOST_CHANNELS], model.outputs[:MOST_CHANNELS]).as_dense()
    limit = data_limit(*few.quadratics, np.asarray(1j * frequencies[looked])).of_entries_known_to(model.known_to)
    shown = values[:MOST_CHANNELS, :MOST_CHANNELS][:, :, looked]
    warn_of_data(Channels.of(few), frequencies[looked], shown, limit, looked.size)


def warn_of_data(
    channels: Channels, frequencies: FloatArray, values: ComplexArray, limit: DataLimit, asked: int
) -> None:
    """Warn where (DATA) exceeds 1e-6 of the value, with the frequency where it is worst.

    Parameters
    ----------
    channels : Channels
    frequencies : (k,) ndarray
        [rad/s]
    values : (p, m, k) complex ndarray
    limit : DataLimit
        Of the same.
    asked : int
        Frequencies in all.
    """
    known = channels.known_to if channels.known_to > EPS else 0.0
    size = np.abs(values)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        told = (size > 0.0) & np.isfinite(size) & (limit.data > max(SMALL_SHIFT, AMPLIFIED * known) * limit.slope)
        share = np.where(told, limit.data / size, 0.0)
    warned = max(WARNED_DATA, AMPLIFIED * known)
    if not share.size or not share.max() > warned:
        return
    i, j, k = (int(place) for place in np.unravel_index(int(np.argmax(share)), share.shape))
    worst, count = float(share[i, j, k]), int(np.count_nonzero((share > warned).any(axis=(0, 1))))
    digits = f"to {worst:.1e} of its value" if worst < 1.0 else "not at all"
    entries = f"the digits of the file ({digits_in_words(known)}, {known:.0e})" if known else LAST_DIGIT
    channel = f"{channels.outputs[i]} to {channels.inputs[j]}"
    msg = (
        f"Entries of M, C, K known to {entries} determine the response of {channel} at {frequencies[k]:.4g} rad/s "
        f"{digits} ((DATA), an upper bound; above {warned:.0e} at {count} of {asked} frequencies). "
        "Small masses or springs were lost beside stiff ones when the entries were rounded, and every solver that sees "
        "these numbers errs alike. Solutions are refined for the numbers as they are stored; for more digits "
        f"{'write the file with more of them, ' if known else ''}use fewer elements, or take out what is stiff as a "
        "rigid connection."
    )
    give_warning(msg, DataLimitWarning)
