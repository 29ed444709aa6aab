"""The mechanical model: four quadratic matrix polynomials and the names of their signals.

    P(s) q = B(s) u,    y = F(s) q + D(s) u,    H(s) = F(s) P(s)^-1 B(s) + D(s)          (1)

    P(s) = K + C s + M s^2        B(s) = B + Bv s + Ba s^2
    F(s) = F + G s + H s^2        D(s) = D + Dv s + Da s^2

The letters are those of MATLAB's `mechss`. `mechss` is the one door through which models come in; what
it has checked is not checked again. Derivation of all that follows: docs/explanation/reduction.md.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy.typing as npt

from halfdof_ctrl.base.arrays import DENSE_ROW_LIMIT, EPS, REAL, ComplexArray, ModelMatrix, is_complex, read_only
from halfdof_ctrl.base.errors import ModelSizeError, WrongObjectError
from halfdof_ctrl.base.names import Names, as_tuple, listed, picked_places
from halfdof_ctrl.base.sparse_arrays import (
    as_sparse,
    is_sparse,
    locked,
    picked_below,
    picked_beside,
    unit_like,
    zeros_like,
)
from halfdof_ctrl.model.descriptor_form import DescriptorForm, descriptor_form
from halfdof_ctrl.model.evaluation import checked_points, quadratic_transfer, squeezed
from halfdof_ctrl.model.free_motions import free_motions_in_words
from halfdof_ctrl.model.kinds import split_in_words
from halfdof_ctrl.model.motion import MotionKind, prescribed_signals, require_free, with_motion_as_input
from halfdof_ctrl.model.oddities import oddities
from halfdof_ctrl.model.quadratics import Quadratics
from halfdof_ctrl.model.removal import kept_without, picked

LETTERS = ("M", "C", "K", "B", "Bv", "Ba", "F", "G", "H", "D", "Dv", "Da")


@dataclass(frozen=True, slots=True, eq=False, kw_only=True, repr=False)
class SecondOrderModel:
    """``M q'' + C q' + K q = B u``, ``y = F q + G q' + H q'' + D u`` with named signals.

    Made by `mechss`, not directly. For n DOFs, m inputs and p outputs; all arrays are read-only. Units
    are those of the user; with SI units and forces as inputs they read as given here.
    """

    M: ModelMatrix  #: (n, n) mass [kg]; all matrices are `scipy.sparse.csc_array` in a sparse model (`is_sparse`)
    C: ModelMatrix  #: (n, n) damping [N s/m]
    K: ModelMatrix  #: (n, n) stiffness [N/m]
    B: ModelMatrix  #: (n, m) what an input does to the equations [N per unit of input]
    Bv: ModelMatrix  #: (n, m) the same for its first derivative
    Ba: ModelMatrix  #: (n, m) the same for its second derivative
    F: ModelMatrix  #: (p, n) displacements in the outputs
    G: ModelMatrix  #: (p, n) velocities in the outputs
    H: ModelMatrix  #: (p, n) accelerations in the outputs
    D: ModelMatrix  #: (p, m) direct term
    Dv: ModelMatrix  #: (p, m) the same for the first derivative of the inputs
    Da: ModelMatrix  #: (p, m) the same for the second derivative of the inputs
    dofs: tuple[str, ...]  #: names of the n DOFs
    inputs: tuple[str, ...]  #: names of the m inputs
    outputs: tuple[str, ...]  #: names of the p outputs
    name: str | None = None  #: name of the model, which the state space takes over
    prescribed: tuple[str, ...] = ()  #: DOFs, here or removed, whose motion is an input (see `prescribe_motion`)
    known_to: float = EPS  #: relative rounding of the entries of M, C, K; 5e-10 from a file with ten digits

    @property
    def is_complex(self) -> bool:
        """Whether any matrix has imaginary parts (structural damping)."""
        return any([X.dtype is not REAL and is_complex(X) for X in self._matrices()])  # noqa: C419  # faster

    @property
    def is_sparse(self) -> bool:
        """Whether the matrices are sparse, all of them, since one of M, C, K was given so to `mechss`."""
        return is_sparse(self.K)

    @property
    def complex_matrices(self) -> tuple[str, ...]:
        """Letters of the complex matrices."""
        return tuple([letter for letter, matrix in zip(LETTERS, self._matrices(), strict=True) if is_complex(matrix)])

    @property
    def quadratics(self) -> Quadratics:
        """Coefficients of 1, s, s^2 in P, B, F and D of equation (1): ``(K, C, M)``, ``(B, Bv, Ba)`` and so on."""
        P, B, F = (self.K, self.C, self.M), (self.B, self.Bv, self.Ba), (self.F, self.G, self.H)
        return Quadratics(P, B, F, (self.D, self.Dv, self.Da))

    def _matrices(self) -> tuple[ModelMatrix, ...]:
        return (self.M, self.C, self.K, self.B, self.Bv, self.Ba, self.F, self.G, self.H, self.D, self.Dv, self.Da)

    def __call__(
        self,
        s: npt.ArrayLike,
        squeeze: bool | None = None,  # noqa: FBT001  # as in control
        *update: object,
    ) -> ComplexArray:
        """Transfer function H(s) of equation (1) by a direct solve at each `s`.

        Parameters
        ----------
        s : complex or 1D array_like of complex
            Points in the complex plane [rad/s].
        squeeze : bool, optional
            As in `control.StateSpace.__call__`: by default a single-input single-output model gives
            a scalar or 1D array; False keeps (p, m, len(s)), True drops every axis of length one.
        *update
            Nothing: python-control gives more where it takes the model for a function of time, as `control.ss` does.

        Returns
        -------
        complex ndarray
            (p, m) for a scalar `s`, (p, m, len(s)) for an array, less the axes that `squeeze` drops.
            ``inf + nan j`` where P(s) is exactly singular, as python-control has it.

        Examples
        --------
        A spring of 4 N/m under 2 N gives 0.5 m:

        >>> complex(mechss([[1]], [[0]], [[4]], [[2]])(0))
        (0.5+0j)
        """
        if update:
            taker = "A model is a function of s alone, so control.ss and control.nlsys cannot take it"
            msg = f"{taker}: use hd.mech2ss(model), which gives the state space."
            raise WrongObjectError(msg, parameter="s", value=s)
        points = checked_points(s)
        values = quadratic_transfer(*self.quadratics, points.reshape(-1))
        return squeezed(values, scalar=points.ndim == 0, squeeze=squeeze)

    def select(self, inputs: Names = None, outputs: Names = None) -> "SecondOrderModel":
        """Return the model with other inputs and outputs, picked by name.

        Parameters
        ----------
        inputs : str or sequence of str, optional
            Inputs of this model, or ``F_<dof>``, the unit force on any DOF. All inputs by default.
        outputs : str or sequence of str, optional
            Outputs of this model, or ``<dof>``, ``<dof>_dot``, ``<dof>_ddot``: displacement,
            velocity or acceleration of any DOF. All outputs by default.

        Raises
        ------
        SignalNameError
            A name that is neither, or one that stands twice.
        """
        model = self if inputs is None else _with_inputs(self, inputs)
        return model if outputs is None else _with_outputs(model, outputs)

    def prescribe_motion(
        self, dof: Names, kind: MotionKind = "displacement", *, inputs: Names = None, outputs: Names = None
    ) -> "SecondOrderModel":
        """Make the motion of DOFs an input and the force that it takes an output (base excitation).

        Parameters
        ----------
        dof : str or sequence of str
            DOFs whose motion is prescribed.
        kind : {"displacement", "velocity", "acceleration"}
            What the input is, named ``<dof>``, ``<dof>_dot`` or ``<dof>_ddot``. With displacements the DOFs leave
            the model; else they stay, with the equation ``q' = u`` or ``q'' = u`` in place of their own.
        inputs, outputs : str or sequence of str, optional
            All signals of the new model, in order: the new ones (motions, reactions ``R_<dof>``) and whatever
            `select` finds in this model, motions of `dof` itself among them. By default the new ones alone,
            behind what `select` could not bring back later: inputs that are no forces on DOFs (motions
            prescribed before) and outputs that are no motions. Inputs that are left out are zero.

        Returns
        -------
        SecondOrderModel
            ``R_<dof>`` is the force on the DOF that must act besides those of the other inputs.

        Raises
        ------
        SignalNameError
            A DOF that is unknown, named twice or prescribed already; no DOF left; an unknown or taken name.
        ParameterError
            `kind` is none of the three.

        Examples
        --------
        The foot of a spring of 8 N/m under 2 kg: at s = 1 the mass follows by 8 / (2 + 8), and it takes 1.6 N/m.

        >>> model = mechss([[2, 0], [0, 0]], None, [[8, -8], [-8, 8]], dofs=["mass", "foot"])
        >>> model.prescribe_motion("foot", outputs=["mass", "R_foot"])(1.0).real.round(12).tolist()
        [[0.8], [1.6]]
        """
        new = prescribed_signals(self, dof, kind, inputs, outputs)
        base = self.select(new.old_inputs or self.inputs[:1], new.old_outputs or self.outputs[:1])
        P, B, F, D = with_motion_as_input(*base.quadratics, new.driven, new.derivative)
        letters = ("K", "C", "M", "B", "Bv", "Ba", "F", "G", "H", "D", "Dv", "Da")
        matrices: dict[str, Any] = dict(zip(letters, map(locked, (*P, *B, *F, *D)), strict=True))
        model = replace(
            base,
            **matrices,
            dofs=tuple([name for name in self.dofs if new.derivative or name not in new.names]),
            inputs=(*base.inputs, *new.motions),
            outputs=(*base.outputs, *new.reactions),
            prescribed=(*self.prescribed, *new.names),
        )
        return model.select(new.inputs, new.outputs)

    def without(self, dofs: Names) -> "SecondOrderModel":
        """Return the model without some DOFs: without their rows, columns and signals.

        Parameters
        ----------
        dofs : str or sequence of str
            Those to be taken out. What is tied to them sees them held at rest, as if their displacements were zero. A
            DOF to which nothing is attached, such as a rotation of a solid element, leaves no trace.

        Returns
        -------
        SecondOrderModel
            Inputs that act, and outputs that show, nothing but these DOFs are left out too; the others stay, less the
            part that these DOFs had in them. The remaining DOFs are inertial, half or static by what the remaining
            matrices say.

        Raises
        ------
        SignalNameError
            A DOF that is unknown, named twice or prescribed; no DOF, no input or no output left.

        Examples
        --------
        A mass on a spring of 8 N/m, and a DOF to which nothing is attached:

        >>> model = mechss([2, 0], None, [[8, 0], [0, 0]], dofs=["mass", "rotation"])
        >>> model.without("rotation")
        SecondOrderModel: 1 DOFs: 1 inertial, 0 half, 0 static; 2 states
          dofs:    mass
          inputs:  F_mass
          outputs: mass
        """
        dof, m, p = kept_without(self, dofs, self.quadratics)
        axes = {"B": (dof, m), "F": (p, dof), "G": (p, dof), "H": (p, dof), "D": (p, m)}
        matrices: dict[str, Any] = {
            letter: picked(matrix, *axes.get(letter[0], (dof, dof)))
            for letter, matrix in zip(LETTERS, self._matrices(), strict=True)
        }
        return replace(
            self,
            **matrices,
            dofs=tuple([self.dofs[place] for place in dof]),
            inputs=tuple([self.inputs[place] for place in m]),
            outputs=tuple([self.outputs[place] for place in p]),
        )

    def as_descriptor(self) -> DescriptorForm:
        """Give the model as a descriptor system ``E x' = A x + B u``, ``y = C x + D u`` of first order.

        Returns
        -------
        DescriptorForm
            Named tuple (E, A, B, C, D), sparse if the model is, for other tools that take a singular E (DAE,
            semistate form). How to hand it on: docs/howto/descriptor-systems.md.
        """
        return descriptor_form(self)

    def as_dense(self) -> "SecondOrderModel":
        """Return the model with dense matrices: itself if they are.

        Raises
        ------
        ModelSizeError
            A matrix would have more than 5000 x 5000 entries.
        """
        if not self.is_sparse:
            return self
        n, m, p = (len(names) for names in (self.dofs, self.inputs, self.outputs))
        largest = max(n, m, p)
        if largest > DENSE_ROW_LIMIT:
            msg = (
                f"Dense matrices of {n} DOFs, {m} inputs and {p} outputs would take up to {8e-9 * largest**2:.3g} GB "
                f"each; the limit is {DENSE_ROW_LIMIT} of each. Select fewer signals, or stay with the sparse model."
            )
            raise ModelSizeError(msg, size=largest, limit=DENSE_ROW_LIMIT)
        dense: dict[str, Any] = {letter: read_only(as_sparse(getattr(self, letter)).toarray()) for letter in LETTERS}
        return replace(self, **dense)

    def __repr__(self) -> str:
        """Return the model on a few lines: its name, how its DOFs split, its signals, free motions, what is unusual."""
        title = f"{type(self).__name__} {self.name!r}" if self.name else type(self).__name__
        complex_part = f"\n  complex: {', '.join(self.complex_matrices)}" if self.is_complex else ""
        prescribed_part = f"\n  motion prescribed: {listed(self.prescribed)}" if self.prescribed else ""
        free = free_motions_in_words(self.M, self.C, self.K, self.known_to)
        free_part = f"\n  {free}" if free else ""
        rounded_part = f"\n  entries known to {self.known_to:.0e}" if self.known_to > EPS else ""
        found = unusual_in_words(self)
        unusual_part = f"\n  unusual: {found}" if found else ""
        return (
            f"{title}: {len(self.dofs)} DOFs: {split_in_words(self.M, self.C, self.K)}\n"
            f"  dofs:    {listed(self.dofs)}\n"
            f"  inputs:  {listed(self.inputs)}\n"
            f"  outputs: {listed(self.outputs)}{prescribed_part}{complex_part}{free_part}{rounded_part}{unusual_part}"
        )


def unusual_in_words(model: SecondOrderModel) -> str:
    """Say on one line what is unusual about M, C and K, if no motion is prescribed; nothing where they are as usual."""
    parts = {} if model.prescribed else {"M": model.M, "C": model.C, "K": model.K}
    return "; ".join(oddities(parts, model.dofs, model.known_to))


def _with_inputs(model: SecondOrderModel, names: Names) -> SecondOrderModel:
    require_free(names, model.inputs, model.prescribed)
    picked = picked_places(names, model.inputs, model.dofs, "input")
    n, p = model.M.shape[0], model.F.shape[0]
    unit, no_force, no_feed = unit_like(model.K, n), zeros_like(model.K, n, n), zeros_like(model.K, p, n)
    return replace(
        model,
        inputs=as_tuple(names),
        B=picked_beside([model.B, unit], picked),
        Bv=picked_beside([model.Bv, no_force], picked),
        Ba=picked_beside([model.Ba, no_force], picked),
        D=picked_beside([model.D, no_feed], picked),
        Dv=picked_beside([model.Dv, no_feed], picked),
        Da=picked_beside([model.Da, no_feed], picked),
    )


def _with_outputs(model: SecondOrderModel, names: Names) -> SecondOrderModel:
    picked = picked_places(names, model.outputs, model.dofs, "output")
    n, m = model.M.shape[0], model.B.shape[1]
    unit, no_motion, no_feed = unit_like(model.K, n), zeros_like(model.K, n, n), zeros_like(model.K, 3 * n, m)
    return replace(
        model,
        outputs=as_tuple(names),
        F=picked_below([model.F, unit, no_motion, no_motion], picked),
        G=picked_below([model.G, no_motion, unit, no_motion], picked),
        H=picked_below([model.H, no_motion, no_motion, unit], picked),
        D=picked_below([model.D, no_feed], picked),
        Dv=picked_below([model.Dv, no_feed], picked),
        Da=picked_below([model.Da, no_feed], picked),
    )
