"""From a model to a plain `control.StateSpace` with physical names.

    x' = A x + B u,    y = F q + G q' + H q'' + D u + Dv u' + Da u''

with q = X x + U_0 u + U_1 u' + ... of equation (4). What remains of u', u'', ... in y makes a transfer
function improper: it grows with frequency, and no state space has it.
"""

from typing import Literal, TypeAlias

import control
import numpy as np

from halfdof_ctrl.base.arrays import FloatArray
from halfdof_ctrl.base.doors import is_choice, shown
from halfdof_ctrl.base.errors import (
    CloseDecisionWarning,
    ImproperError,
    NoStateSpaceError,
    ParameterError,
    SignalNameError,
    UncertainRankError,
    give_warning,
    recording_warnings,
)
from halfdof_ctrl.base.names import Names, control_label, control_labels, listed
from halfdof_ctrl.base.sparse_arrays import MatrixLike
from halfdof_ctrl.descriptor.exact_counts import were_rounded
from halfdof_ctrl.descriptor.structure import pencil_structure
from halfdof_ctrl.model.doors import require_matrix
from halfdof_ctrl.model.mechss import mechss
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.reduction.choose import exact_reduction, reduced
from halfdof_ctrl.reduction.energy.form import EnergyForm, energy_form
from halfdof_ctrl.reduction.energy.modal import modal_form
from halfdof_ctrl.reduction.energy.rigid import NEARLY_FREE
from halfdof_ctrl.reduction.exact_reduction import ExactReduction
from halfdof_ctrl.reduction.method.signals import Signal
from halfdof_ctrl.systems.handover import warn_of_python_control, warn_of_stored
from halfdof_ctrl.systems.state_map import StateMap, States, require_kind, require_same_order, scaled_units

REDUCIBLE = (SecondOrderModel, ExactReduction)  #: what brings its matrices and names with it
DOF_STATES = ("dofs", "scaled")  #: kinds of states that are displacements and velocities, but for powers of two
MOST_CONFIRMED = 60  #: DOFs of a model up to which the oracle is asked to confirm a refusal
NOT_GIVEN = frozenset({type(None)})  #: the type of what is not given

Improper: TypeAlias = Literal["refuse", "drop"]


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
    improper: Improper = "refuse",
    states: States = "dofs",
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
    improper : {"refuse", "drop"}, optional
        What to do where an output follows the derivative of an input: refuse the model by name (default), or
        give the proper part ``C (s I - A)^-1 B + D`` alone; what is dropped is
        `ExactReduction.polynomial_part`.
    states : {"dofs", "scaled", "energy", "modal"}, optional
        What the states are; `state_map` has the way to all DOFs and back for each.

        - ``"dofs"``: displacements of inertial and half DOFs and velocities of inertial ones, in their units. Motions
          without stiffness are known to rounding only: poles at 1e-8 of the others instead of 0, a finite static gain.
        - ``"scaled"``: the same, each DOF measured in a power of two of its unit and time in one power of two, which
          python-control's evaluations need where stiffness ranges over many decades. The labels say which:
          ``y_dot/2^7`` is the velocity over 2^7.
        - ``"energy"``: strain and momentum; half the sum of their squares is the energy. Motions without stiffness
          stand first, with columns of exact zeros. Keeps most digits; for symmetric models.
        - ``"modal"``: energy states turned to the modes of the undamped structure, strain and momentum of each.

    Returns
    -------
    control.StateSpace
        Labels are the model's names, with ``.`` written as ``:`` (see `~halfdof_ctrl.base.names.control_label`).

    Raises
    ------
    MatrixError, SignalNameError
        What `mechss` refuses.
    ComplexModelError, SingularPencilError, UncertainRankError
        What `exact_reduction` refuses.
    ImproperError
        An output follows the derivative of an input, such as the velocity of a static DOF under a
        force of its own, and `improper` does not say that it is to be dropped.
    ParameterError
        `improper` or `states` is none of what it can be.
    EnergyFormError
        The model has no energy or modal states: M or K unsymmetric or indefinite (constraints, follower forces), or no
        mass or damping of its own for each DOF.

    Warns
    -----
    CloseDecisionWarning
        In energy or modal states, K nearly leaves a motion free.
    LostDigitsWarning
        A, B, C and D in the states that are asked for lose more than 1e-9 of an output; poles at the origin, of motions
        that K and C leave free, are moved by rounding; or python-control's evaluation of this system (``sys(s)``,
        `control.bode_plot`) will lose more than 1e-6, since it does not balance states of different sizes. Measured
        beside modes and below them, for up to 1000 states, and estimated beyond.

    Examples
    --------
    >>> mech2ss([[2]], [[0]], [[8]], [[1]]).A
    array([[ 0.,  1.],
           [-4.,  0.]])
    """
    if not is_choice(improper, ("refuse", "drop")):
        msg = f"improper must be 'refuse' or 'drop', not {shown(improper)}."
        raise ParameterError(msg, parameter="improper", value=improper)
    require_kind(states)
    if isinstance(model, REDUCIBLE):
        if not NOT_GIVEN.issuperset(map(type, (C, K, B, F, G, H, D, dofs, inputs, outputs, name))):
            msg = "A model brings its matrices and names with it: use model.select() or mechss() to change them."
            raise SignalNameError(msg, names=())
    else:
        require_matrix(model, "mech2ss", parameter="model")
        model = mechss(model, C, K, B, F, G, H=H, D=D, dofs=dofs, inputs=inputs, outputs=outputs, name=name)
    in_dofs = states in DOF_STATES
    if not isinstance(model, ExactReduction):
        model = exact_reduction(model) if in_dofs else reduced(model)
    system = system_of_model(model, improper=improper, states=states)
    if not in_dofs:
        warn_of_stored(model, system)
    if not (states == "dofs" and model.solution.is_even):
        warn_of_python_control(model.model, system, states)
    return system


def system_of_model(
    model: SecondOrderModel | ExactReduction, *, improper: Improper = "refuse", states: States = "dofs"
) -> control.StateSpace:
    """Make the state space of a model as `mech2ss` does, for use inside: nobody is told what may be lost with it."""
    reduction = model if isinstance(model, ExactReduction) else reduced(model)
    output = reduction.output
    if len(output.U) > 1 and improper == "refuse":
        raise _refusal(reduction.model, output)
    model = reduction.model
    if states not in DOF_STATES:
        return _in_energy_states(reduction, states)
    size, names = (None, reduction.states) if states == "dofs" else scaled_units(reduction)
    return labelled_system(
        reduction.A if size is None else reduction.A * size / size[:, None],
        reduction.B if size is None else reduction.B / size[:, None],
        output.X if size is None else output.X * size,
        output.direct(len(model.inputs)),
        states=names,
        inputs=model.inputs,
        outputs=model.outputs,
        name=model.name,
    )


def _in_energy_states(reduction: ExactReduction, states: States) -> control.StateSpace:
    """Make the state space in energy or modal states, of a reduction that was found to be proper."""
    form = energy_form(reduction.model)
    require_same_order(form, reduction)
    if form.nearest <= NEARLY_FREE:
        msg = (
            f"K nearly leaves a motion free: its energy is {form.nearest:.1e} eps of the terms that it is summed from, "
            "so that rounding of the entries of K changes it. It is kept as it stands; fewer elements, or the "
            "stiffness in other coordinates, determine it better."
        )
        give_warning(msg, CloseDecisionWarning)
    direct = reduction.output.direct(len(reduction.model.inputs))
    return energy_state_space(modal_form(form) if states == "modal" else form, direct)


def system_of_map(states: StateMap) -> control.StateSpace:
    """Make the state space in the states of a map; what is improper in it is left out."""
    model, output = states.model, states.output
    return labelled_system(
        states.A,
        states.B,
        output.X,
        output.direct(len(model.inputs)),
        states=states.states,
        inputs=model.inputs,
        outputs=model.outputs,
        name=model.name,
    )


def energy_state_space(form: EnergyForm, direct: FloatArray | None = None) -> control.StateSpace:
    """Make the state space of a model in energy coordinates; what is improper in it is left out.

    D does not depend on the states. Where it is exactly zero in those of the reduction, `direct`, (p, m), it is zero
    here, and not what rounding leaves of sums over the coordinates, which alone would be left in deep roll-off.
    """
    model, output = form.model, form.output
    D = output.direct(len(model.inputs))
    return labelled_system(
        form.A,
        form.B,
        output.X,
        D if direct is None else np.where(direct == 0.0, 0.0, D),
        states=form.states,
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


def _refusal(model: SecondOrderModel, output: Signal) -> NoStateSpaceError:
    """Make the refusal of improper pairs, or of telling which ones are, where the oracle cannot confirm them.

    Entries that were not rounded are what they say, and their ranks are found in exact arithmetic.
    """
    improper = _improper_error(model, output)
    if model.is_sparse or len(model.dofs) > MOST_CONFIRMED or not were_rounded(model.quadratics.P):
        return improper
    with recording_warnings():
        structure = pencil_structure(model)
    if structure.is_certain:
        return improper
    try:
        pairs = structure.improper_pairs
    except UncertainRankError as doubt:
        return doubt
    if {pair[:2] for pair in pairs} == {pair[:2] for pair in improper.pairs}:
        return improper
    shown = listed([f"{result} from {cause}" for cause, result, _ in improper.pairs], most=4)
    msg = (
        f"Whether the transfer functions {shown} grow with frequency cannot be told: by the state equations they do, "
        f"by the pencil {'others' if pairs else 'none'} do, and {structure.uncertainty[0]}. Give the model in the "
        "coordinates in which its constraints are plain numbers, or in units in which its entries are of one size."
    )
    return UncertainRankError(msg, dofs=improper.pairs[0][:2], gap=1.0)


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
