"""A bound of what stored A, B, C, D lose, for models of which it says that nothing is lost.

Rounding that moves A and B by dA and dB, and displacements q = X x + U u by dX and dU, moves outputs
y = F q + G q' + D u, to first order, by

    |C (s I - A)^-1| (dA |x| + dB) + |F + s G| (dX |x| + dU) + eps (|C| |x| + |D|),    x = (s I - A)^-1 B.      (29a)

It takes a tenth of the time of a measurement, which ordinary models are spared; where it is no small part of the value,
that says nothing.
"""

import numpy as np

from halfdof_ctrl.base.arrays import EPS, ComplexArray, FloatArray
from halfdof_ctrl.base.spectrum import balanced_states
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.reduction.method.loss_points import BELOW_ALL, BESIDE_MODE
from halfdof_ctrl.reduction.method.signals import Signal, StateEquations

BOUNDED_AT = 8  #: modes, spread over all, at which it is worked out
BETWEEN = 4  #: frequencies between a decade below the slowest one and the fastest one, at which it is too
NO_LOSS = 1e-10  #: of the value: up to that a bound says that nothing is lost
SHALLOW_VALUE = 1e-3  #: of what a channel is at lower frequencies: below, it is relative to that


def is_bounded(model: SecondOrderModel, equations: StateEquations, output: Signal, errors: StateEquations) -> bool:
    """Return whether nothing worth a look is lost of any channel, at modes and between them.

    Parameters
    ----------
    model : SecondOrderModel
        Without accelerations as outputs.
    equations : StateEquations
        Of a model whose inputs have no derivatives.
    output : Signal
        Outputs of the state space.
    errors : StateEquations
        What the entries of the equations are known to.

    Examples
    --------
    A mass on a spring and a damper, known to rounding, and to twelve digits:

    >>> from dataclasses import replace
    >>> from halfdof_ctrl import exact_reduction, mechss
    >>> model = mechss([[1]], [[0.1]], [[4]])
    >>> reduction = exact_reduction(model)
    >>> equations = reduction.solution.equations
    >>> nothing = Signal(np.zeros((1, 2)), ())
    >>> [is_bounded(model, equations, reduction.output,
    ...             StateEquations(A=known * abs(equations.A), B=0 * equations.B, displacement=nothing, shift=()))
    ...  for known in (1e-16, 1e-9)]
    [True, False]
    """
    A, scale = balanced_states(equations.A)
    points = _points(A)
    if points.size == 0 or len(output.U) > 1:
        return False
    N, m = equations.B.shape
    dA, dB = errors.A * scale / scale[:, None], errors.B / scale[:, None]
    dX, dU, C = errors.displacement.X * scale, errors.displacement.direct(m), output.X * scale
    matrices = points[:, None, None] * np.eye(N) - A
    try:
        x = np.abs(np.linalg.solve(matrices, np.broadcast_to(equations.B / scale[:, None] + 0j, (points.size, N, m))))
        seen = np.linalg.solve(np.swapaxes(matrices, 1, 2), np.broadcast_to(C.T + 0j, (points.size, N, len(C))))
    except np.linalg.LinAlgError:  # an eigenvalue
        return False
    seen = np.swapaxes(seen, 1, 2)
    value = np.abs(seen @ (equations.B / scale[:, None]) + output.direct(m))
    lost = np.abs(seen) @ (dA @ x + dB) + EPS * (np.abs(C) @ x + np.abs(output.direct(m)))
    lost += _sizes(model, points) @ (dX @ x + dU)
    value = np.maximum(value, SHALLOW_VALUE * np.maximum.accumulate(value, axis=0))
    return bool((lost <= NO_LOSS * value).all())


def _sizes(model: SecondOrderModel, points: ComplexArray) -> FloatArray:
    """Return ``|F + s G|``, or what is no less, (points, p, n)."""
    return np.asarray(np.abs(model.F) + np.abs(points)[:, None, None] * np.abs(model.G))


def _points(A: FloatArray) -> ComplexArray:
    """Choose points beside modes, a decade below all and between, in rising order; none if a motion is free."""
    size = np.sort(np.abs(np.linalg.eigvals(A)))
    if not size[0] > NO_LOSS * size[-1]:
        return np.zeros(0, dtype=np.complex128)
    modes = size[np.unique(np.linspace(0.0, 1.0, BOUNDED_AT) ** 2 * (size.size - 1) // 1).astype(np.intp)]
    between = np.geomspace(BELOW_ALL * size[0], size[-1], BETWEEN)
    return np.asarray(1j * BESIDE_MODE * np.sort(np.append(modes, between)))
