"""Invariant zeros: the finite eigenvalues of the second-order system pencil.

[ P(s)  -B(s) ]
[ F(s)   D(s) ]                                                                        (9)
"""

import numpy as np
import scipy.linalg

from halfdof_ctrl.base.arrays import EPS, ComplexArray, DenseMatrix
from halfdof_ctrl.base.errors import CloseDecisionWarning, DataLimitWarning, HalfdofError, MatrixError, give_warning
from halfdof_ctrl.base.progress import shows_activity
from halfdof_ctrl.base.spectrum import sorted_eigenvalues
from halfdof_ctrl.base.words import complex_in_words
from halfdof_ctrl.descriptor.balancing import scaling_powers
from halfdof_ctrl.descriptor.data_limit import AMPLIFIED, WARNED_DATA
from halfdof_ctrl.descriptor.growth import system_pencil
from halfdof_ctrl.descriptor.minors import Zeros, invariant_zeros
from halfdof_ctrl.descriptor.regularity import require_regular
from halfdof_ctrl.descriptor.staircase import ZERO_PIVOT
from halfdof_ctrl.model.dense_copy import dense_copy
from halfdof_ctrl.model.doors import checked_model
from halfdof_ctrl.model.second_order import SecondOrderModel


@shows_activity("zeros")
def zeros(model: SecondOrderModel) -> ComplexArray:
    """Find the invariant zeros from the second-order system pencil.

    The pencil keeps the mechanical form, so that no zeros are lost or invented where a state space
    would have long chains at infinity.

    Parameters
    ----------
    model : SecondOrderModel
        Of any index, with any number of inputs and outputs, dependent or not.

    Returns
    -------
    (k,) complex ndarray
        Where the system pencil has a lower rank than almost everywhere [rad/s], as often as the greatest common
        divisor of its largest minors has that root, sorted by size; zeros at the origin are exactly zero. Among them
        are poles of motions that the inputs do not reach or the outputs do not show; the others are the transmission
        zeros.

    Warns
    -----
    CloseDecisionWarning
        Inputs or outputs are so nearly dependent, or so nearly blind to a motion, that the number of zeros may be
        wrong; those that are zeros but for rounding are among them.
    DataLimitWarning
        Rounding of the entries moves some of them by more than 1e-6 of their size.

    Raises
    ------
    SingularPencilError
        ``det P(s)`` vanishes identically.

    Notes
    -----
    Their number is exact for the stored numbers, and their values are refined as those of `pencil_structure` are. For
    other numbers of outputs than inputs, and for dependent ones, zeros are what two random combinations of the largest
    minors have in common (`minors`). Two outputs together vanish less often than one alone, and a model that does not
    respond at all has the zeros of the rank that is left.

    Examples
    --------
    A mass on a damper and a spring, velocity as output: one zero, at the origin.

    >>> zeros(mechss([[1]], [[2]], [[3]], [[1]], G=[[1]]))
    array([0.+0.j])

    Two oscillators; the force on the first cannot be seen in the first where the second stands still as an absorber,
    at 2 rad/s:

    >>> zeros(mechss(np.eye(2), None, [[5, -4], [-4, 4]], [1, 0], [1, 0])).imag.round(9).tolist()
    [2.0, -2.0]
    """
    model = dense_copy(
        checked_model(model, "zeros"), "zeros", "Take those of a reduced model: zeros(truncate_modes(...))."
    )
    require_regular(model)
    try:
        every = _independent(model)
        found = invariant_zeros(system_pencil(model, *every))
    except (ValueError, np.linalg.LinAlgError) as cause:
        if isinstance(cause, HalfdofError):
            raise
        msg = (
            f"Products of the entries of B, F and D overflow or vanish, so that zeros cannot be computed ({cause}). "
            "Choose other units for inputs and outputs, or write what is nothing as 0."
        )
        raise MatrixError(msg, matrix="B") from cause
    if found.doubts:
        msg = (
            f"The number of zeros, {found.values.size}, is in doubt: {'; '.join(found.doubts)}. Inputs or outputs "
            "depend on each other but for rounding, or the model is rounded; leave one out by select() and compare."
        )
        give_warning(msg, CloseDecisionWarning)
    _warn_of_bounds(model, found)
    return sorted_eigenvalues(found.values)


def _warn_of_bounds(model: SecondOrderModel, found: Zeros) -> None:
    """Warn of zeros that the entries of the model do not determine."""
    away = found.values != 0.0
    size, known = np.abs(found.values[away]), model.known_to
    share = found.bounds[away] * max(known / EPS, 1.0) / size
    vague = share > max(WARNED_DATA, AMPLIFIED * known)
    if vague.any():
        worst = int(share.argmax())
        to = f"to {share[worst]:.1e} of its size" if share[worst] < 1.0 else "not at all"
        msg = (
            f"Entries of the model known to {known:.1e} determine {int(vague.sum())} of {found.values.size} zeros to "
            f"less than {max(WARNED_DATA, AMPLIFIED * known):.0e} of their size, the one at "
            f"{complex_in_words(complex(found.values[away][worst]))} rad/s {to}: terms far larger than what they leave "
            "make it. Other programs that see these numbers err alike."
        )
        give_warning(msg, DataLimitWarning)


def _independent(model: SecondOrderModel) -> tuple[list[int], list[int]]:
    """Pick outputs and inputs of which no one is a constant combination of others, as those change no zero."""
    inputs = np.vstack([model.B, model.Bv, model.Ba, model.D, model.Dv, model.Da])
    outputs = np.hstack([model.F, model.G, model.H, model.D, model.Dv, model.Da])
    return _independent_columns(outputs.T), _independent_columns(inputs)


def _independent_columns(matrix: DenseMatrix) -> list[int]:
    """Pick columns that span the range."""
    rows, columns = scaling_powers(np.abs(matrix))
    _, triangle, order = scipy.linalg.qr(matrix * rows[:, None] * columns, mode="economic", pivoting=True)
    pivots = np.abs(np.diagonal(triangle))
    rank = int(np.count_nonzero(pivots > ZERO_PIVOT * max(matrix.shape) * pivots[0]))
    return sorted(order[:rank].tolist())
