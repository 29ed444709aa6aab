"""Responses of the descriptor form with what the entries of a model determine of them, (DATA).

A soft spring beside one 1e14 times stiffer, or the mass of a beam cut into thousands of elements, is lost when entries
are rounded. Then every solver that sees only these numbers errs alike, and a check of one against another proves
nothing. So (DATA) is found where P(s) is nearly singular, and said where it matters.
"""

import numpy as np

from halfdof_ctrl.base.arrays import ComplexArray, FloatArray
from halfdof_ctrl.base.errors import DataLimitWarning, give_warning
from halfdof_ctrl.model.evaluation import data_limit, transfer_and_growth
from halfdof_ctrl.model.refinement import SUSPECT_GROWTH, DataLimit
from halfdof_ctrl.model.second_order import SecondOrderModel

WARNED = 1e-6  #: part of the value from which (DATA) is told
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
    suspect = np.flatnonzero((growth > SUSPECT_GROWTH) & np.isfinite(growth))
    if suspect.size:
        limit = data_limit(*coefficients, points[suspect])
        warn_of_data(model, frequencies[suspect], values[:, :, suspect], limit, frequencies.size)
    return values


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
    size = np.abs(values)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        told = (size > 0.0) & np.isfinite(size) & (limit.data > SMALL_SHIFT * limit.slope)
        share = np.where(told, limit.data / size, 0.0)
    if not share.size or not share.max() > WARNED:
        return
    i, j, k = np.unravel_index(int(np.argmax(share)), share.shape)
    worst, count = float(share[i, j, k]), int(np.count_nonzero((share > WARNED).any(axis=(0, 1))))
    digits = f"to {worst:.1e} of its value" if worst < 1.0 else "not at all"
    channel = f"{model.outputs[i]} to {model.inputs[j]}"
    msg = (
        f"Entries of M, C, K known to their last digit (2.2e-16) determine the response of {channel} at "
        f"{frequencies[k]:.4g} rad/s {digits} ((DATA), an upper bound; above 1e-6 at {count} of {asked} frequencies). "
        "Small masses or springs were lost beside stiff ones when the entries were rounded, and every solver that sees "
        "these numbers errs alike. Solutions are refined for the numbers as they are stored; for more digits use fewer "
        "elements, or take out what is stiff as a rigid connection."
    )
    give_warning(msg, DataLimitWarning)
