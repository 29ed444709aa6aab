"""Prescribed motion: the displacement, velocity or acceleration of DOFs as an input of the model.

Let g be the DOFs whose motion is prescribed, f the others, and u = s^d q_g the input: displacements (d = 0),
velocities (1) or accelerations (2). In every column that belongs to q_g the coefficients of s^d and above go with
the input, the ones below stay with q_g:

    X(s) q_g = X_<(s) q_g + X_>(s) u,    X_<(s) = sum of X_k s^k, k < d,    X_>(s) = sum of X_k s^(k - d), k >= d

This makes of equation (1), with r for the reaction, the force on g that the motion takes,

    [ P_ff  P_fg< ] [ q_f ]   [ B_f  -P_fg> ] [ forces ]         y = F_f q_f + F_g< q_g + F_g> u + D forces
    [  0    s^d I ] [ q_g ] = [  0     I    ] [   u    ]         r = P_gf q_f + P_gg< q_g + P_gg> u - B_g forces

With displacements X_< is zero: q_g leaves the unknowns and the second row goes. With velocities and
accelerations q_g stays, with the integrators that the input needs, and no other equation contains the
derivatives of q_g that are known. Derivation: docs/explanation/motion.md.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, Protocol, TypeAlias, get_args

import numpy as np

from halfdof_ctrl.base.arrays import DenseMatrix, ModelMatrix
from halfdof_ctrl.base.doors import is_choice, shown
from halfdof_ctrl.base.errors import ParameterError, SignalNameError
from halfdof_ctrl.base.names import (
    Names,
    as_tuple,
    checked_names,
    force_names,
    listed,
    motion_names,
    physical_places,
    reaction_names,
    unknown_name_error,
)
from halfdof_ctrl.base.sparse_arrays import has_sparse, joined_sparse
from halfdof_ctrl.model.quadratics import Coefficients

MotionKind: TypeAlias = Literal["displacement", "velocity", "acceleration"]

KINDS: tuple[MotionKind, ...] = get_args(MotionKind)  # in the order of the derivative


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class PrescribedSignals:
    """Which DOFs get their motion from an input, and which signals the model has then, by name."""

    derivative: int  #: of the displacement that is the input: 0, 1, 2
    driven: tuple[int, ...]  #: positions of the DOFs
    names: tuple[str, ...]  #: of these DOFs
    motions: tuple[str, ...]  #: the inputs that prescribe the motion
    reactions: tuple[str, ...]  #: the forces that it takes
    inputs: tuple[str, ...]  #: all inputs of the new model, in order
    outputs: tuple[str, ...]  #: all outputs of the new model, in order

    @property
    def old_inputs(self) -> tuple[str, ...]:
        """Inputs that the new model takes over."""
        return tuple([name for name in self.inputs if name not in self.motions])

    @property
    def old_outputs(self) -> tuple[str, ...]:
        """Outputs that the new model takes over."""
        return tuple([name for name in self.outputs if name not in self.reactions])


class Named(Protocol):
    """What `prescribed_signals` needs of a model: its names."""

    @property
    def dofs(self) -> tuple[str, ...]: ...  # noqa: D102
    @property
    def inputs(self) -> tuple[str, ...]: ...  # noqa: D102
    @property
    def outputs(self) -> tuple[str, ...]: ...  # noqa: D102
    @property
    def prescribed(self) -> tuple[str, ...]: ...  # noqa: D102


def prescribed_signals(model: Named, dof: Names, kind: MotionKind, inputs: Names, outputs: Names) -> PrescribedSignals:
    """Name the signals of a model when the motion of some DOFs is prescribed.

    Parameters
    ----------
    model : SecondOrderModel
        As it is before.
    dof, kind, inputs, outputs
        As `SecondOrderModel.prescribe_motion` takes them.

    Raises
    ------
    ParameterError
        `kind` is none of the three.
    SignalNameError
        A DOF that is unknown, named twice or prescribed already; no DOF left; a name that is taken.
    """
    if not is_choice(kind, KINDS):
        msg = f"kind must be one of {listed(KINDS)}, not {shown(kind)}."
        raise ParameterError(msg, parameter="kind", value=kind)
    derivative = KINDS.index(kind)
    driven = places_of_dofs(model, dof)
    names = tuple([model.dofs[place] for place in driven])
    if derivative == 0 and len(driven) == len(model.dofs):
        msg = (
            f"With the displacement of {listed(names)} prescribed no DOF is left to move, and a model needs at least "
            "one. Prescribe the acceleration instead, or take dynamic_stiffness, which is K + C s + M s^2 here."
        )
        raise SignalNameError(msg, names=names)
    forces = physical_places(model.inputs, model.dofs, "input")
    moves = physical_places(model.outputs, model.dofs, "output")
    moved, reactions = motion_names(names, derivative), reaction_names(names)
    _require_new(moved, (*model.inputs, *physical_places(moved, model.dofs, "input")), "input")
    _require_new(reactions, (*model.outputs, *physical_places(reactions, model.dofs, "output")), "output")
    lasting_inputs = [name for name in model.inputs if name not in forces]
    lasting_outputs = [name for name in model.outputs if name not in moves]
    return PrescribedSignals(
        derivative=derivative,
        driven=driven,
        names=names,
        motions=moved,
        reactions=reactions,
        inputs=(*lasting_inputs, *moved) if inputs is None else as_tuple(inputs),
        outputs=(*lasting_outputs, *reactions) if outputs is None else as_tuple(outputs),
    )


def places_of_dofs(model: Named, dof: Names) -> tuple[int, ...]:
    """Return the positions of DOFs whose motion an input can prescribe.

    Raises
    ------
    SignalNameError
        A DOF that is unknown, named twice or prescribed already; none at all.
    """
    names = checked_names(as_tuple(dof, "DOFs"), len(as_tuple(dof)), "DOFs")
    if not names:
        msg = "No DOF is named whose motion is to be prescribed."
        raise SignalNameError(msg, names=())
    for name in names:
        if name in model.prescribed:
            msg = (
                f"The motion of {name} is prescribed already, and a DOF has but one. Start from the model before that."
            )
            raise SignalNameError(msg, names=(name,))
        if name not in model.dofs:
            raise unknown_name_error(name, "DOF", model.dofs)
    return tuple([model.dofs.index(name) for name in names])


def require_free(names: Names, inputs: tuple[str, ...], prescribed: tuple[str, ...]) -> None:
    """Refuse a force on a DOF whose motion is prescribed, unless the model has it among its inputs.

    Raises
    ------
    SignalNameError
        The force could not move the DOF.
    """
    bound = tuple([name for name in as_tuple(names) if name in force_names(prescribed) and name not in inputs])
    if bound:
        msg = (
            f"{listed(bound)} acts on a DOF whose motion is prescribed: it moves nothing and adds to the reaction "
            "alone. If that is what you want to see, name it among the inputs of prescribe_motion."
        )
        raise SignalNameError(msg, names=bound)


def with_motion_as_input(
    P: Coefficients, B: Coefficients, F: Coefficients, D: Coefficients, driven: Sequence[int], derivative: int
) -> tuple[Coefficients, Coefficients, Coefficients, Coefficients]:
    """Make the motion of some DOFs an input and their reactions outputs.

    Parameters
    ----------
    P, B, F, D : sequences of (n, n), (n, m), (p, n), (p, m) ndarrays
        Coefficients of 1, s, s^2 in equation (1); m and p may be zero.
    driven : sequence of int
        Positions of the k DOFs g.
    derivative : int
        Which derivative of their displacement the input is: 0, 1, 2.

    Returns
    -------
    P, B, F, D : tuples of ndarrays
        With k more inputs, the motions, and k more outputs, the reactions, behind those given; without the DOFs g if
        `derivative` is 0.

    Examples
    --------
    A mass of 2 kg on a spring of 8 N/m whose foot is moved: ``(2 s^2 + 8) q = 8 u``, and ``r = -8 q + 8 u``.

    >>> none = np.zeros((2, 2))
    >>> P = [[8, -8], [-8, 8]] * np.ones(1), none, np.diag([2.0, 0.0])
    >>> parts = with_motion_as_input(P, (none[:, :0],) * 3, (none[:0],) * 3, (none[:0, :0],) * 3, [1], 0)
    >>> [part[0].item() for part in parts]
    [8.0, 8.0, -8.0, 8.0]
    """
    g = np.array(driven, dtype=np.intp)
    f = np.setdiff1d(np.arange(P[0].shape[0]), g)
    u = g if derivative else g[:0]  # what of q_g stays unknown
    back = np.argsort(np.concatenate([f, u]))  # to the order of the model's DOFs
    in_others, by_others = _split([X[f][:, g] for X in P], u.size, derivative)
    in_reaction, by_reaction = _split([X[g][:, g] for X in P], u.size, derivative)
    in_outputs, by_outputs = _split([X[:, g] for X in F], u.size, derivative)
    unit = [np.eye(u.size, g.size) * (power == 0) for power in range(3)]
    motion = [np.eye(u.size) * (power == derivative) for power in range(3)]
    still = np.zeros((u.size, f.size)), np.zeros((u.size, B[0].shape[1]))
    powers = range(3)
    return (
        tuple([_joined([[P[k][f][:, f], in_others[k]], [still[0], motion[k]]])[back][:, back] for k in powers]),
        tuple([_joined([[B[k][f], 0.0 - by_others[k]], [still[1], unit[k]]])[back] for k in powers]),
        tuple([_joined([[F[k][:, f], in_outputs[k]], [P[k][g][:, f], in_reaction[k]]])[:, back] for k in powers]),
        tuple([_joined([[D[k], by_outputs[k]], [0.0 - B[k][g], by_reaction[k]]]) for k in powers]),
    )


def _split(X: Coefficients, staying: int, derivative: int) -> tuple[list[ModelMatrix], list[ModelMatrix]]:
    """Split the columns of q_g into what stays with it and what goes with its derivative, the input."""
    nothing = 0.0 * X[0]
    stays = [X[k] if k < derivative else nothing for k in range(3)]
    goes = [X[k + derivative] if k + derivative < len(X) else nothing for k in range(3)]
    return [part[:, :staying] for part in stays], goes


def _joined(blocks: list[list[ModelMatrix]]) -> ModelMatrix:
    """Join blocks to one matrix, complex only where there are imaginary parts; sparse if a block is."""
    if has_sparse([block for row in blocks for block in row]):
        return joined_sparse(blocks)
    whole: DenseMatrix = np.block(blocks)
    return whole if np.iscomplexobj(whole) and whole.imag.any() else whole.real


def _require_new(names: tuple[str, ...], taken: Sequence[str], what: str) -> None:
    """Refuse names of new signals that something else in the model has."""
    clash = tuple([name for name in names if name in taken])
    if clash:
        msg = (
            f"The new {what} would be called {listed(clash)}, which is the name of another signal of the model. Rename "
            "that signal or the DOF."
        )
        raise SignalNameError(msg, names=clash)
