"""Outputs of a reduced model as functions of its state, its inputs and their derivatives.

    y = F q + G q' + H q'' + D u + Dv u' + Da u''

with q = X x + U_0 u + U_1 u' + ... of equation (4). What remains of u', u'', ... in y is the polynomial part of the
transfer function, which grows with frequency and which no state space has.
"""

from collections.abc import Callable
from itertools import zip_longest

import numpy as np

from halfdof_ctrl.base.arrays import is_zero, unit_matrix
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.reduction.method.signals import Rounding, Signal, StateEquations, trimmed


def output_signal(model: SecondOrderModel, equations: StateEquations, rounding: Callable[[], Rounding]) -> Signal:
    """Give the outputs; of u', u'', ... only what is more than a rounding error.

    Parameters
    ----------
    model : SecondOrderModel
    equations : StateEquations
        Of the model.
    rounding : callable
        Gives the rounding errors of the equations; called where derivatives of the inputs show at all.
    """
    q = equations.displacement
    output = q if model.F is unit_matrix(len(model.F)) else q.combined(model.F)  # all displacements, mostly
    if not is_zero(model.G):
        output = output.plus(q.combined(model.G).derivative(equations.A, equations.B))
    if not is_zero(model.H):
        velocity = q.combined(model.H).derivative(equations.A, equations.B)
        output = output.plus(velocity.derivative(equations.A, equations.B))
    direct = trimmed((model.D, model.Dv, model.Da))
    if direct:
        output = output.plus(Signal(np.zeros_like(output.X), direct))
    if len(output.U) <= 1:
        return output
    kept = without_rounding(model, output, rounding()).U
    return Signal(output.X, trimmed((output.U[0], *kept[1:])))


def without_rounding(model: SecondOrderModel, output: Signal, rounding: Rounding) -> Signal:
    """Drop coefficients of u, u', ... that are rounding errors of sums that cancel.

    The bound evaluates (6) and (7) with the sizes that the rounding errors are relative to.
    """
    if not output.U:
        return output
    q = rounding.displacement
    bound = q.combined(np.abs(model.F))
    for order, matrix in ((1, model.G), (2, model.H)):
        term = q.combined(np.abs(matrix))
        for _ in range(order):
            term = term.derivative(rounding.A, rounding.B)
        bound = bound.plus(term)
    kept = [
        np.where(np.abs(part) <= rounding.relative * size, 0.0, part)
        for part, size in zip_longest(output.U, bound.U[: len(output.U)], fillvalue=np.zeros_like(output.U[0]))
    ]
    return Signal(output.X, trimmed(tuple(kept)))
