"""Responses of the descriptor form with what the entries of a model determine of them, (DATA).

A soft spring beside one 1e14 times stiffer, or the mass of a beam cut into thousands of elements, is lost when entries
are rounded. Then every solver that sees only these numbers errs alike, and a check of one against another proves
nothing. So (DATA) is found where P(s) is nearly singular, and said where it matters.
"""

import numpy as np

from halfdof_ctrl.base.arrays import EPS, LARGEST_DENSE_COPY, ComplexArray, FloatArray
from halfdof_ctrl.base.digits import digits_in_words
from halfdof_ctrl.base.errors import DataLimitWarning, give_warning
from halfdof_ctrl.model.evaluation import data_limit, transfer_and_growth
from halfdof_ctrl.model.refinement import SUSPECT_GROWTH, DataLimit
from halfdof_ctrl.model.second_order import SecondOrderModel

WARNED_DATA = 1e-6  #: part of the value from which (DATA) is told
AMPLIFIED = 100.0  #: and times the rounding of a file with few digits, which no one expects to see less of
MOST_LOOKED, MOST_CHANNELS = 16, 32  #: frequencies, and outputs or inputs, at which (DATA) is found beside a response
LAST_DIGIT = "their last digit (2.2e-16)"
SMALL_SHIFT = 1e-8  #: relative change of frequency that nobody notices: what it makes beside a pole or zero is no loss


def dense_frequency_response(model: SecondOrderModel, frequencies: FloatArray) -> ComplexArray:
    """Evaluate equation (1) of a dense model at frequencies [rad/s], (p, m, k).

    Warns
    -----
    DataLimitWarning
        Entries known to their last digit do not determine it to 1e-6 of its value.
    """
    points = np.asarray(1j * frequencies, dtype=np.complex128)
    coefficients = model.quadratics
    values, growth = transfer_and_growth(*coefficients, points)
    suspect = np.flatnonzero(growth > SUSPECT_GROWTH * EPS / model.known_to)
    if suspect.size:
        limit = data_limit(*coefficients, points[suspect]).of_entries_known_to(model.known_to)
        warn_of_data(model, frequencies[suspect], values[:, :, suspect], limit, frequencies.size)
    return values


def warn_of_digits(model: SecondOrderModel, frequencies: FloatArray, values: ComplexArray) -> None:
    """Warn of a response, however it was found, of a model whose entries have the digits of a file.

    Parameters
    ----------
    model : SecondOrderModel
    frequencies : (k,) ndarray
        [rad/s], of which at most 16 are looked at.
    values : (p, m, k) complex ndarray
        Of which the first 32 outputs and inputs are.

    Warns
    -----
    DataLimitWarning
    """
    if model.known_to <= EPS or len(model.dofs) > LARGEST_DENSE_COPY or not frequencies.size:
        return
    looked = np.unique(np.linspace(0, frequencies.size - 1, MOST_LOOKED).round().astype(int))
    few = model.select(model.inputs[:MOST_CHANNELS], model.outputs[:MOST_CHANNELS]).as_dense()
    limit = data_limit(*few.quadratics, np.asarray(1j * frequencies[looked])).of_entries_known_to(model.known_to)
    shown = values[:MOST_CHANNELS, :MOST_CHANNELS][:, :, looked]
    warn_of_data(few, frequencies[looked], shown, limit, looked.size)


def warn_of_data(
    model: SecondOrderModel, frequencies: FloatArray, values: ComplexArray, limit: DataLimit, asked: int
) -> None:
    """Warn where (DATA) exceeds 1e-6 of the value, with the frequency where it is worst.

    Parameters
    ----------
    model : SecondOrderModel
    frequencies : (k,) ndarray
        [rad/s]
    values : (p, m, k) complex ndarray
    limit : DataLimit
        Of the same.
    asked : int
        Frequencies in all.
    """
    known = model.known_to if model.known_to > EPS else 0.0
    size = np.abs(values)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        told = (size > 0.0) & np.isfinite(size) & (limit.data > max(SMALL_SHIFT, AMPLIFIED * known) * limit.slope)
        share = np.where(told, limit.data / size, 0.0)
    warned = max(WARNED_DATA, AMPLIFIED * known)
    if not share.size or not share.max() > warned:
        return
    i, j, k = np.unravel_index(int(np.argmax(share)), share.shape)
    worst, count = float(share[i, j, k]), int(np.count_nonzero((share > warned).any(axis=(0, 1))))
    digits = f"to {worst:.1e} of its value" if worst < 1.0 else "not at all"
    entries = f"the digits of the file ({digits_in_words(known)}, {known:.0e})" if known else LAST_DIGIT
    channel = f"{model.outputs[i]} to {model.inputs[j]}"
    msg = (
        f"Entries of M, C, K known to {entries} determine the response of {channel} at {frequencies[k]:.4g} rad/s "
        f"{digits} ((DATA), an upper bound; above {warned:.0e} at {count} of {asked} frequencies). "
        "Small masses or springs were lost beside stiff ones when the entries were rounded, and every solver that sees "
        "these numbers errs alike. Solutions are refined for the numbers as they are stored; for more digits "
        f"{'write the file with more of them, ' if known else ''}use fewer elements, or take out what is stiff as a "
        "rigid connection."
    )
    give_warning(msg, DataLimitWarning)
