"""What says that stored A, B, C, D lose nothing worth a look: their condition, or a bound of what rounding does.

Rounding that moves A and B by dA and dB, and displacements q = X x + U u by dX and dU, moves outputs
y = F q + G q' + D u, to first order, by

    |C (s I - A)^-1| (dA |x| + dB) + |F + s G| (dX |x| + dU) + eps (|C| |x| + |D|),    x = (s I - A)^-1 B.

The bound takes a tenth of the time of a measurement, which ordinary models are spared; where it is no small part of
the value, that says nothing. Derivation: docs/explanation/evaluation.md.
"""

import numpy as np

from halfdof_ctrl.base.arrays import (
    EPS,
    ComplexArray,
    FloatArray,
    IndexArray,
    as_dense,
    has_even_entries,
    is_zero,
    powers_of_two,
)
from halfdof_ctrl.base.spectrum import balanced_states
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.reduction.algebra.leading_matrix import FEW_DOFS, lu_and_rcond
from halfdof_ctrl.reduction.method.loss_points import BELOW_ALL, BESIDE_MODE
from halfdof_ctrl.reduction.method.signals import Signal, StateEquations

BOUNDED_AT = 8  #: modes, spread over all, at which it is worked out
BETWEEN = 4  #: frequencies between a decade below the slowest one and the fastest one, at which it is too
NO_LOSS = 1e-10  #: of the value: up to that a bound says that nothing is lost
SHALLOW_VALUE = 1e-3  #: of what a channel is at lower frequencies: below, it is relative to that
POWER_OF_TWO = 0.5  #: mantissa of a factor that rounds nothing
EVEN_STATES = 1e3  #: condition number of A, balanced, and share of what cancels, up to which few states lose nothing


def is_well_conditioned(A: FloatArray) -> bool:
    """Return whether the condition number of A is below a thousand, so that solving with it loses three digits at most.

    Examples
    --------
    >>> [is_well_conditioned(np.diag([1.0, part])) for part in (0.1, 1e-6)]
    [True, False]
    """
    return not len(A) or EVEN_STATES * lu_and_rcond(A)[2] >= 1.0


def loses_nothing(model: SecondOrderModel, equations: StateEquations, *, even: bool) -> bool:
    """Tell at once whether few states, of a plainly regular W, lose nothing that is worth a look.

    A is well conditioned, as it stands (`even`) or once its states are of one size and if no entry of M, C and K of few
    DOFs is tiny beside the others of its matrix; what static DOFs have of the states and of the inputs does not cancel,
    nor do accelerations towards rest.

    Examples
    --------
    A mass on a spring, and one of which nearly nothing is left:

    >>> from halfdof_ctrl import exact_reduction, mechss
    >>> [loses_nothing(model, exact_reduction(model).solution.equations, even=False)
    ...  for model in (mechss([[1]], [[0.1]], [[4]]), mechss([[1e-9]], [[0.1]], [[4]]))]
    [True, False]
    """
    A, q = equations.A, equations.displacement
    scale: FloatArray | float = 1.0
    if _mixes_accelerations(model):
        return False
    if not len(A) or equations.shift:
        return not len(A)
    if not even:
        if len(model.dofs) <= FEW_DOFS and not all(has_even_entries(part) for part in model.quadratics.P):
            return False
        A, factors = balanced_states(A)
        scale = factors[:, None]
        if not is_well_conditioned(A):
            return False
    plain = is_zero(model.G, model.H) and is_zero(model.D, model.Dv, model.Da)
    if not q.U and plain:
        return True
    x = np.asarray(scale * np.linalg.solve(A, equations.B / scale))
    return (not q.U or are_kept(q, x)) and (plain or _are_seen(model, equations, x))


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


def reads_rates_of_massless(model: SecondOrderModel, massless: IndexArray, static: IndexArray) -> bool:
    """Tell whether outputs read accelerations of DOFs without mass, or velocities of static ones.

    No state and no row of A is one of these. They are products of rows of A, whose terms cancel at slow modes though
    masses are of one size.

    Parameters
    ----------
    model : SecondOrderModel
    massless, static : (k,), (l,) ndarrays
        Places of the DOFs without mass, and of those of them without damping.
    """
    rates = ((model.H, massless), (model.G, static))
    return not all(is_zero(part) or is_zero(part[:, places]) for part, places in rates)


def are_kept(signal: Signal, x: FloatArray) -> bool:
    """Return whether signals at rest, where states are -x times inputs, are no small differences of their parts."""
    direct = signal.direct(x.shape[1])
    terms = np.abs(signal.X) @ np.abs(x)
    terms += np.abs(direct)
    left = signal.X @ x
    np.abs(np.subtract(direct, left, out=left), out=left)
    return bool((terms.max(axis=0, initial=0.0) <= EVEN_STATES * left.max(axis=0, initial=0.0)).all())


def _are_seen(model: SecondOrderModel, equations: StateEquations, x: FloatArray) -> bool:
    """Return whether outputs that mix displacements with others are no small differences of their parts at rest."""
    F, D, q = model.quadratics.F, np.asarray(model.quadratics.D[0]), equations.displacement
    terms, left = np.abs(D), D + F[0] @ (q.direct(x.shape[1]) - q.X @ x)
    for k, part in enumerate(F):
        if part.any():
            motion = equations.motion(k)
            terms = terms + np.abs(part) @ (np.abs(motion.X) @ np.abs(x) + np.abs(motion.direct(x.shape[1])))
    mixed = np.asarray(F[0].any(axis=1))[:, None] | (D != 0.0)
    return bool((~mixed | (terms <= EVEN_STATES * np.abs(left))).all())


def _mixes_accelerations(model: SecondOrderModel) -> bool:
    """Return whether an output is more than one acceleration, or has a factor that rounds a row of A."""
    if is_zero(model.H):
        return False
    H = as_dense(model.H)
    size = np.abs(H)
    return bool((np.count_nonzero(H, axis=1) > 1).any() or (size * powers_of_two(size) != POWER_OF_TWO)[H != 0.0].any())
