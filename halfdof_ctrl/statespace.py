"""From a model to a plain `control.StateSpace` with physical names.

    x' = A x + B u,    y = F q + G q' + H q'' + D u + Dv u' + Da u''

with q = X x + U_0 u + U_1 u' + ... of equation (4). What remains of u', u'', ... in y makes a transfer
function improper: it grows with frequency, and no state space has it.
"""

from itertools import zip_longest

import control
import numpy as np

from halfdof_ctrl.arrays import FloatArray, is_zero, unit_matrix
from halfdof_ctrl.errors import ImproperError, SignalNameError
from halfdof_ctrl.model import SecondOrderModel, mechss
from halfdof_ctrl.names import Names, control_label, control_labels, listed
from halfdof_ctrl.reduction import ExactReduction, exact_reduction
from halfdof_ctrl.signals import Signal, trimmed
from halfdof_ctrl.sparsearrays import MatrixLike
from halfdof_ctrl.sparsedisplacement import SparseDisplacement
from halfdof_ctrl.sparsepartition import SparsePartition

ROUNDING = 32 * np.finfo(float).eps  #: times n: a coefficient of u' below this part of its terms is rounding


def mech2ss(
    model: SecondOrderModel | ExactReduction | MatrixLike | None,
    C: MatrixLike | None = None,
    K: MatrixLike | None = None,
    B: MatrixLike | None = None,
    F: MatrixLike | None = None,
    G: MatrixLike | None = None,
    *,
    H: MatrixLike | None = None,
    D: MatrixLike | None = None,
    dofs: Names = None,
    inputs: Names = None,
    outputs: Names = None,
    name: str | None = None,
) -> control.StateSpace:
    """Convert a mechanical model to state space, exactly.

    Parameters
    ----------
    model : SecondOrderModel, ExactReduction, or (n, n) array_like
        A model, a reduction of one, or the mass matrix M; with M the other arguments are those of
        `mechss`.
    C, K, B, F, G, H, D : array_like, optional
        As in `mechss`; only with M.
    dofs, inputs, outputs, name : optional
        As in `mechss`; only with M, since a model has its names already.

    Returns
    -------
    control.StateSpace
        States are the displacements of inertial and half DOFs and the velocities of inertial ones. Labels
        are the model's names, with ``.`` written as ``:`` (see `names.control_label`).

    Raises
    ------
    MatrixError, SignalNameError
        What `mechss` refuses.
    ComplexModelError, SingularLeadingMatrixError
        What `exact_reduction` refuses.
    ImproperError
        An output follows the derivative of an input, such as the velocity of a static DOF under a
        force of its own.

    Examples
    --------
    >>> mech2ss([[2]], [[0]], [[8]], [[1]]).A
    array([[ 0.,  1.],
           [-4.,  0.]])
    """
    if isinstance(model, SecondOrderModel | ExactReduction):
        if any([value is not None for value in (C, K, B, F, G, H, D, dofs, inputs, outputs, name)]):  # noqa: C419
            msg = "A model brings its matrices and names with it: use model.select() or mechss() to change them."
            raise SignalNameError(msg, names=())
        reduction = model if isinstance(model, ExactReduction) else exact_reduction(model)
    else:
        reduction = exact_reduction(
            mechss(model, C, K, B, F, G, H=H, D=D, dofs=dofs, inputs=inputs, outputs=outputs, name=name)
        )
    output = output_signal(reduction)
    if len(output.U) > 1 and not isinstance(reduction.displacement, SparseDisplacement):
        output = _without_rounding(reduction, output)
    if len(output.U) > 1:
        raise _improper_error(reduction.model, output)
    model = reduction.model
    return labelled_system(
        reduction.A,
        reduction.B,
        output.X,
        output.direct(len(model.inputs)),
        states=reduction.states,
        inputs=model.inputs,
        outputs=model.outputs,
        name=model.name,
    )


def labelled_system(
    A: FloatArray,
    B: FloatArray,
    C: FloatArray,
    D: FloatArray,
    *,
    states: tuple[str, ...],
    inputs: tuple[str, ...],
    outputs: tuple[str, ...],
    name: str | None,
) -> control.StateSpace:
    """Make a state space whose labels are the given names, written as python-control takes them."""
    labels = {} if name is None else {"name": control_label(name)}
    return control.StateSpace(
        A,
        B,
        C,
        D,
        states=list(control_labels(states)),
        inputs=list(control_labels(inputs)),
        outputs=list(control_labels(outputs)),
        **labels,
    )


def output_signal(reduction: ExactReduction) -> Signal:
    """Give the outputs of the reduced model as functions of the state, the inputs and their derivatives."""
    model, q = reduction.model, reduction.displacement
    if isinstance(q, SparseDisplacement):
        return q.output(model)
    output = q if model.F is unit_matrix(len(model.F)) else q.combined(model.F)  # all displacements, mostly
    if not is_zero(model.G):
        output = output.plus(q.combined(model.G).derivative(reduction.A, reduction.B))
    if not is_zero(model.H):
        acceleration = q.combined(model.H).derivative(reduction.A, reduction.B).derivative(reduction.A, reduction.B)
        output = output.plus(acceleration)
    direct = trimmed((model.D, model.Dv, model.Da))
    return output.plus(Signal(np.zeros_like(output.X), direct)) if direct else output


def _without_rounding(reduction: ExactReduction, output: Signal) -> Signal:
    """Drop coefficients of u', u'', ... that are rounding errors of sums that cancel.

    The bound evaluates (6) and (7) with absolute values, where an input's column in the solution of (3) is
    known to 32 n eps of its largest entry, measured in the scaled unknowns.
    """
    model, A = reduction.model, np.abs(reduction.A)
    B, q = _sizes(reduction)
    bound = q.combined(np.abs(model.F))
    for order, matrix in ((1, model.G), (2, model.H)):
        term = q.combined(np.abs(matrix))
        for _ in range(order):
            term = term.derivative(A, B)
        bound = bound.plus(term)
    rounding = ROUNDING * len(model.dofs)
    kept = [
        np.where(np.abs(part) <= rounding * size, 0.0, part)
        for part, size in zip_longest(output.U, bound.U[: len(output.U)], fillvalue=np.zeros_like(output.U[0]))
    ]
    return Signal(output.X, trimmed((output.U[0], *kept[1:])))


def _sizes(reduction: ExactReduction) -> tuple[FloatArray, Signal]:
    """Give what rounding errors in B and in equation (4) are relative to: (3) and (5) with absolute values."""
    part, model, A = reduction.partition, reduction.model, np.abs(reduction.A)
    n_i, moving = part.n_inertial, part.n_inertial + part.n_half
    scale = np.ones(len(model.dofs)) if reduction.leading.columns is None else reduction.leading.columns
    known_to = np.abs(part.T) if part.sizes is None or isinstance(part, SparsePartition) else part.sizes
    rates, statics = [], []
    for force in (model.B, model.Bv, model.Ba):
        solution = np.abs(reduction.leading.solve(np.asfortranarray(force))) / scale[:, None]
        size = scale[:, None] * solution.max(axis=0)
        rates.append(np.vstack([np.zeros_like(size[:n_i]), size[n_i:moving], size[:n_i]]))
        statics.append(known_to[:, moving:] @ size[moving:])
    shift = rates[1] + A @ rates[2]
    X = np.abs(reduction.displacement.X)
    X[:, :moving] = np.maximum(X[:, :moving], known_to[:, :moving])
    return rates[0] + A @ shift, Signal(X, (statics[0] + X @ shift, statics[1] + X @ rates[2], statics[2]))


def _improper_error(model: SecondOrderModel, output: Signal) -> ImproperError:
    """Make the refusal of improper pairs, by name and with the order of growth."""
    order = np.zeros(output.U[0].shape, dtype=int)
    for power, part in enumerate(output.U):
        order[part != 0.0] = power
    pairs = tuple([(model.inputs[j], model.outputs[i], int(order[i, j])) for i, j in np.argwhere(order > 0).tolist()])
    shown = listed([f"{result} from {cause} (grows as s^{power})" for cause, result, power in pairs], most=4)
    msg = (
        f"No state space has the improper transfer functions {shown}: the output follows a derivative of the input, as "
        "the velocity of a static DOF or the acceleration of a half DOF does under a force of its own. Take another "
        "output or input by select(), give the DOF its mass or damping, prescribe the acceleration "
        "instead of the displacement, or filter the input; "
        "model(s) and descriptor_response evaluate it as it is."
    )
    return ImproperError(msg, pairs=pairs)
