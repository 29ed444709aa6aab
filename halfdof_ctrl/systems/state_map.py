"""States other than displacements and velocities, and the way between them and all DOFs.

    x = T x_dofs,    q = X x + U_0 u + ...,    q' = Y x + V_0 u + ...,    x = L_q q + L_v q' - E_0 u

Gains on x are gains K T on the DOF states, and weights Q of these are T^-T Q T^-1 on x.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from halfdof_ctrl.base.arrays import FloatArray, checked_matrix, read_only
from halfdof_ctrl.base.doors import is_choice, real_numbers, shown
from halfdof_ctrl.base.errors import EnergyFormError, InconsistentStateError, MatrixError, ParameterError
from halfdof_ctrl.base.names import motion_names
from halfdof_ctrl.model.doors import checked_model
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.reduction.choose import reduced
from halfdof_ctrl.reduction.energy.form import EnergyForm, energy_form, motion_output
from halfdof_ctrl.reduction.energy.modal import modal_form
from halfdof_ctrl.reduction.exact_reduction import ExactReduction
from halfdof_ctrl.reduction.method.recovery import (
    RecoveredMotion,
    TimeResponse,
    forward_slope,
    given_inputs,
    given_values,
    require_consistent,
    require_response,
)
from halfdof_ctrl.reduction.method.signals import Signal
from halfdof_ctrl.systems.scaled_states import unit_exponents

States: TypeAlias = Literal["dofs", "scaled", "energy", "modal"]
STATE_KINDS: tuple[States, ...] = ("dofs", "scaled", "energy", "modal")


@dataclass(frozen=True, slots=True, eq=False, kw_only=True, repr=False)
class StateMap:
    """``x' = A x + B u`` in chosen states, and the way to all DOFs and back; N states, n DOFs, m inputs.

    Made by `state_map`.
    """

    kind: States  #: what the states are
    model: SecondOrderModel  #: whose states they are
    states: tuple[str, ...]  #: names of the N states
    dof_states: tuple[str, ...]  #: names of the states of ``mech2ss(model)``, x_dofs
    A: FloatArray  #: (N, N)
    B: FloatArray  #: (N, m)
    T: FloatArray  #: (N, N) x = T x_dofs
    T_inverse: FloatArray  #: (N, N) x_dofs = T_inverse x
    displacement: Signal  #: all n displacements in terms of x and the inputs
    velocity: Signal  #: all n velocities
    from_q: FloatArray  #: (N, n) L_q and ...
    from_v: FloatArray  #: (N, n) L_v of x = L_q q + L_v q' - E_0 u
    shift: tuple[FloatArray, ...]  #: E_0, E_1, ... of equation (5), (N, m) each

    def to_dofs(self, x: npt.ArrayLike) -> FloatArray:
        """Return the displacements and velocities that are the states of ``mech2ss(model)``, for (N, ...) states."""
        return np.asarray(np.tensordot(self.T_inverse, self._numbers(x, "x", 0), axes=1))

    def from_dofs(self, x: npt.ArrayLike) -> FloatArray:
        """Return these states for (N, ...) states of ``mech2ss(model)``."""
        return np.asarray(np.tensordot(self.T, self._numbers(x, "x", 0), axes=1))

    def gain_on_dofs(self, K: npt.ArrayLike) -> FloatArray:
        """Return the gain on the states of ``mech2ss(model)`` that does what K, (m, N), does on these."""
        return np.asarray(self._numbers(K, "K", -1) @ self.T)

    def weight_from_dofs(self, Q: npt.ArrayLike) -> FloatArray:
        """Return the weight on these states that is Q, (N, N), on those of ``mech2ss(model)``."""
        return np.asarray(self.T_inverse.T @ checked_matrix(Q, "Q", self.A.shape) @ self.T_inverse)

    def _numbers(self, value: npt.ArrayLike, letter: str, axis: int) -> FloatArray:
        """Read numbers of which one axis is that of the states."""
        numbers = real_numbers(value, letter, "real numbers")
        if numbers.ndim == 0 or numbers.shape[axis] != len(self.A):
            where = "row" if axis == 0 else "column"
            msg = f"{letter} must have a {where} for each of {len(self.A)} states, but its shape is {numbers.shape}."
            raise MatrixError(msg, matrix=letter)
        return numbers

    @property
    def output(self) -> Signal:
        """The model's outputs as functions of state, inputs and derivatives of inputs."""
        model = self.model.as_dense()
        return motion_output(model, self.A, self.B, self.displacement, self.velocity)

    def state(
        self,
        q0: npt.ArrayLike | Mapping[str, float],
        v0: npt.ArrayLike | Mapping[str, float] | None = None,
        u0: npt.ArrayLike = 0.0,
    ) -> FloatArray:
        """Return the state for displacements and velocities, as `ExactReduction.state` does for DOF states.

        Parameters
        ----------
        q0, v0 : (n,) array_like or mapping from DOF to value
            Displacements [m] and velocities [m/s]; NaN, or a DOF that is missing, is open: zero where it is a state.
        u0 : (m,) array_like or float, optional
            Inputs at that time.

        Raises
        ------
        InconsistentStateError
            A given value differs from what the half and static equations require.
        """
        model = self.model
        q = given_values(q0, model.dofs, "displacement")
        v = given_values({} if v0 is None else v0, model.dofs, "velocity")
        u = given_inputs(u0, len(model.inputs))
        x = self.from_q @ np.nan_to_num(q) + self.from_v @ np.nan_to_num(v)
        if self.shift:
            x = x - self.shift[0] @ u
        for derivative, (given, motion) in enumerate(((q, self.displacement), (v, self.velocity))):
            required = motion.X @ x + motion.direct(u.size) @ u
            require_consistent(motion_names(model.dofs, derivative), given, required)
        return np.asarray(x)

    def recover(self, response: TimeResponse) -> RecoveredMotion:
        """Return displacements and velocities of all DOFs for a time response in these states.

        Velocities of static DOFs under a force of their own take the slope of the inputs, as `ExactReduction.recover`.

        Raises
        ------
        InconsistentStateError
            The response has another number of states or inputs.
        """
        require_response(response)
        x = np.asarray(response.x, dtype=float)
        free = np.zeros((len(self.model.inputs), *x.shape[1:]))
        u = free if response.u is None else np.asarray(response.u, dtype=float)
        if x.shape[0] != len(self.A) or u.shape[0] != len(self.model.inputs):
            msg = (
                f"The response has {x.shape[0]} states and {u.shape[0]} inputs, these states {len(self.A)} and "
                f"{len(self.model.inputs)}. Recover a response of mech2ss(model, states={self.kind!r}) of this model."
            )
            raise InconsistentStateError(msg, names=self.states, given=(), required=())
        time = np.asarray(response.t, dtype=float)
        slopes, histories = [u], []
        for motion in (self.displacement, self.velocity):
            history = np.tensordot(motion.X, x, axes=1)
            for power, part in enumerate(motion.U):
                if power == len(slopes):
                    slopes.append(forward_slope(slopes[-1], time))
                history += np.tensordot(part, slopes[power], axes=1)
            histories.append(history)
        return RecoveredMotion(time=time, displacement=histories[0], velocity=histories[1], dofs=self.model.dofs)

    def __repr__(self) -> str:
        """Say what the states are."""
        return f"StateMap: {len(self.A)} states of kind {self.kind!r} for {len(self.model.dofs)} DOFs"


def state_map(model: SecondOrderModel | ExactReduction, states: States = "energy") -> StateMap:
    """Choose states for a model, with the way to all DOFs and back.

    Parameters
    ----------
    model : SecondOrderModel or ExactReduction
    states : {"dofs", "scaled", "energy", "modal"}
        As in `mech2ss`.

    Returns
    -------
    StateMap

    Raises
    ------
    ParameterError
        `states` is none of these.
    EnergyFormError
        Energy or modal states of a model that has none.
    ComplexModelError, SingularPencilError, UncertainRankError
        What `exact_reduction` refuses.

    Examples
    --------
    A mass of 4 kg on a spring of 9 N/m: displaced by 1 m, it holds 4.5 J.

    >>> energy = state_map(mechss([[4]], None, [[9]], dofs="y"))
    >>> x = energy.state({"y": 1.0})
    >>> energy.states, x.tolist(), float(x @ x / 2)
    (('strain_y', 'momentum_y'), [3.0, 0.0], 4.5)
    """
    require_kind(states)
    reduction = model if isinstance(model, ExactReduction) else reduced(checked_model(model, "state_map"))
    if states in ("dofs", "scaled"):
        if reduction is not model:
            reduction.solution.evidence.warn_of_loss()
        return _map_of_dofs(reduction, states)
    form = energy_form(reduction.model)
    return map_of_form(modal_form(form) if states == "modal" else form, states, reduction)


def require_kind(states: str) -> None:
    """Refuse a kind of states that there is not."""
    if not is_choice(states, STATE_KINDS):
        msg = f"states must be one of {', '.join(map(repr, STATE_KINDS))}, not {shown(states)}."
        raise ParameterError(msg, parameter="states", value=states)


def scaled_units(reduction: ExactReduction) -> tuple[FloatArray, tuple[str, ...]]:
    """Return the units 2^e of the states of a reduction, (N,), and the names of the states measured in them."""
    places = _places(reduction)
    dof, order = (
        (np.array(part, dtype=np.intp) for part in zip(*places, strict=True)) if places else (np.zeros(0, int),) * 2
    )
    exponents, _ = unit_exponents(reduction.A, dof, order)
    names = [
        name if exponent == 0 else f"{name}/2^{exponent}"
        for name, exponent in zip(reduction.states, exponents.tolist(), strict=True)
    ]
    return np.ldexp(1.0, exponents), tuple(names)


def _places(reduction: ExactReduction) -> list[tuple[int, int]]:
    """Return (DOF, order of the derivative) of each state."""
    places = getattr(reduction.partition, "places", None)
    if places is not None:
        known = {dof: k for k, dof in enumerate(sorted({dof for dof, _ in places}))}
        return [(known[dof], order) for dof, order in places]
    part = reduction.partition
    n_i, n_c = len(part.inertial), len(part.half)
    return [(k, 0) for k in range(n_i + n_c)] + [(k, 1) for k in range(n_i)]


def _map_of_dofs(reduction: ExactReduction, states: States) -> StateMap:
    """Return the map of displacements and velocities, in their own units or in powers of two of them."""
    model = reduction.model
    size, names = (np.ones(reduction.order), reduction.states) if states == "dofs" else scaled_units(reduction)
    maps = () if reduction.order == 0 else _state_maps(reduction)
    from_q, from_v = maps[:2] if maps else np.zeros((2, 0, len(model.dofs)))
    motions = [Signal(motion.X * size, motion.U) for motion in (reduction.motion(0), reduction.motion(1))]
    return StateMap(
        kind=states,
        model=model,
        states=names,
        dof_states=reduction.states,
        A=read_only(reduction.A * size / size[:, None]),
        B=read_only(reduction.B / size[:, None]),
        T=read_only(np.diag(1.0 / size)),
        T_inverse=read_only(np.diag(size)),
        displacement=motions[0],
        velocity=motions[1],
        from_q=read_only(from_q / size[:, None]),
        from_v=read_only(from_v / size[:, None]),
        shift=tuple([part / size[:, None] for part in reduction.shift]),
    )


def _state_maps(reduction: ExactReduction) -> tuple[FloatArray, ...]:
    """Return L_q and L_v column by column where the partition has no matrices of them."""
    if hasattr(reduction.partition, "state_maps"):
        return tuple(reduction.partition.state_maps())
    n = len(reduction.model.dofs)
    unit, none = np.eye(n), np.zeros(n)
    of_q = np.column_stack([reduction.partition.state_of(column, none) for column in unit])
    of_v = np.column_stack([reduction.partition.state_of(none, column) for column in unit])
    return of_q, of_v


def map_of_form(form: EnergyForm, states: States, reduction: ExactReduction) -> StateMap:
    """Return the map of energy coordinates, its T on the states that `mech2ss` gives by default."""
    require_same_order(form, reduction)
    if reduction.states == form.dofs:
        T, T_inverse = form.T, form.T_inverse
    else:  # coordinates that are mixed, or in another order
        from_q, from_v = _state_maps(reduction)[:2]
        T_inverse = from_q @ form.displacement.X + from_v @ form.velocity.X
        T = form.from_q @ reduction.motion(0).X + form.from_v @ reduction.motion(1).X
    return StateMap(
        kind=states,
        model=form.model,
        states=form.states,
        dof_states=reduction.states,
        A=form.A,
        B=form.B,
        T=T,
        T_inverse=T_inverse,
        displacement=form.displacement,
        velocity=form.velocity,
        from_q=form.from_q,
        from_v=form.from_v,
        shift=form.shift,
    )


def require_same_order(form: EnergyForm, reduction: ExactReduction) -> None:
    """Refuse energy states beside a reduction that took small masses as none."""
    if len(form.A) != reduction.order:
        msg = (
            f"There are no energy coordinates for this reduction: it has {reduction.order} states where M, C, K as "
            f"they stand have {len(form.A)} (tol = {reduction.tol}). Set the small masses to zero in the model itself."
        )
        raise EnergyFormError(msg, reason="tol", dofs=reduction.model.dofs)
