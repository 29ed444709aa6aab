"""Zeros of single channels, of a model or of a state space."""

import numpy as np

from halfdof_ctrl.base.arrays import ComplexArray
from halfdof_ctrl.base.spectrum import balanced_states
from halfdof_ctrl.descriptor.finite_part import finite_part
from halfdof_ctrl.descriptor.first_order import first_order_pencil
from halfdof_ctrl.descriptor.growth import system_pencil
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.systems.state_space_data import StateSpaceData


def descriptor_zeros(model: SecondOrderModel, output: int, source: int) -> ComplexArray:
    """Find the invariant zeros of one channel of a dense model.

    Parameters
    ----------
    model : SecondOrderModel
    output, source : int
        Numbers of the output and of the input.

    Examples
    --------
    Two oscillators; the second absorbs at 2 rad/s:

    >>> model = mechss(np.eye(2), None, [[5, -4], [-4, 4]])
    >>> descriptor_zeros(model, 0, 0).imag.round(9).tolist()
    [2.0, -2.0]
    """
    pencil = first_order_pencil(system_pencil(model, [output], [source]))
    return np.asarray(finite_part(pencil.A, pencil.E).eigenvalues * pencil.scale)


def system_zeros(channel: StateSpaceData) -> ComplexArray:
    """Find the invariant zeros of a state space with one input and one output.

    Examples
    --------
    >>> lag = StateSpaceData(np.array([[-1.0]]), np.array([[1.0]]), np.array([[2.0]]), np.array([[1.0]]))
    >>> system_zeros(lag).real.tolist()
    [-3.0]
    """
    A, b, c, d = channel
    matrix, scale = balanced_states(A)
    E = np.zeros((len(A) + 1, len(A) + 1))
    E[: len(A), : len(A)] = np.eye(len(A))
    size = float(np.abs(matrix).max(initial=0.0)) or 1.0
    row, column = c * scale, b / scale[:, None]
    out, drive = (float(np.abs(part).max(initial=0.0)) or 1.0 for part in (row, column))
    feed = d * size / out / drive
    pencil = np.block([[matrix / size, column / drive], [row / out, feed]])
    return np.asarray(finite_part(pencil, E).eigenvalues * size)
