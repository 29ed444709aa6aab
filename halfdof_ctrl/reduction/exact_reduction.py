"""The result of the exact reduction: A, B, the way back to all DOFs, and the evidence.

All of q follows from the state and the inputs:

    q = X x + U_0 u + U_1 u' + ...                                                         (4)

Derivatives of the inputs (Bv, Ba) are absorbed by x = x~ + E_0 u + E_1 u' (5), so that x~' = A x~ + B u.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from halfdof_ctrl.base.arrays import FloatArray
from halfdof_ctrl.base.errors import InconsistentStateError
from halfdof_ctrl.base.names import listed, motion_names
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.reduction.method.evidence import RankDecision
from halfdof_ctrl.reduction.method.protocol import Coordinates, MethodName, ReductionMethod
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


@dataclass(frozen=True, slots=True, eq=False, kw_only=True, repr=False)
class ExactReduction:
    """``x' = A x + B u`` with the finite eigenvalues of the model, and the way back to q.

    For n DOFs, N states and m inputs. Made by `exact_reduction`.
    """

    model: SecondOrderModel  #: the model that was reduced
    solution: ReductionMethod  #: what the method that was taken gave
    tol: float | None = None  #: what `exact_reduction` was given

    @property
    def A(self) -> FloatArray:  # noqa: N802
        """(N, N) state matrix."""
        return self.solution.A

    @property
    def B(self) -> FloatArray:  # noqa: N802
        """(N, m) input matrix."""
        return self.solution.B

    @property
    def partition(self) -> Coordinates:
        """Which coordinates are inertial, half and static."""
        return self.solution.coordinates

    @property
    def shift(self) -> tuple[FloatArray, ...]:
        """E_0, E_1, ... of equation (5), (N, m) each; empty unless derivatives of inputs reach the states."""
        return self.solution.shift

    @property
    def order(self) -> int:
        """Number of states, which is the number of finite eigenvalues."""
        return len(self.A)

    @property
    def n_infinite(self) -> int:
        """Number of infinite eigenvalues of the 2n-dimensional pencil that are gone."""
        return 2 * len(self.model.dofs) - self.order

    @property
    def index(self) -> int:
        """Index of the first-order pencil (8): one more than the order of growth of its inverse, 0 if that vanishes.

        Constraints of displacements give 3, of velocities 2.
        """
        return self.solution.index()

    @property
    def method(self) -> MethodName:
        """Which method was taken: `selection` of DOFs, `orthogonal` bases or `deflation`."""
        return self.solution.name

    @property
    def rcond(self) -> float:
        """Reciprocal condition number of W, or the smallest of the systems (18), on which the states rest."""
        return self.solution.evidence.rcond

    @property
    def evidence(self) -> tuple[RankDecision, ...]:
        """The singular values that decisions about ranks rest on, block by block; those of W come last."""
        return self.solution.decisions()

    @property
    def displacement(self) -> Signal:
        """All n displacements as functions of state and inputs, equation (4).

        Raises
        ------
        ModelSizeError
            A sparse model with so many DOFs and states that this is too large.
        """
        return self.solution.motion(0)

    @property
    def output(self) -> Signal:
        """The model's outputs as functions of state, inputs and, where they are improper, derivatives of inputs."""
        return self.solution.output(self.model)

    @property
    def polynomial_part(self) -> tuple[FloatArray, ...]:
        """D_1, D_2, ... of ``H(s) = C (s I - A)^-1 B + D + D_1 s + D_2 s^2 + ...``, (p, m) each; empty if proper."""
        return self.output.U[1:]

    @property
    def gamma(self) -> FloatArray:
        """(n_i, n) rows of W^-1 for p''_i: the paper's gamma, equations (11), (20), (31).

        Raises
        ------
        SingularLeadingMatrixError
            The method is `deflation`, since W is singular.
        """
        return self.solution.inverse_rows()[: len(self.partition.inertial)]

    @property
    def alpha(self) -> FloatArray:
        """(n_c, n) rows of W^-1 for p'_c: the paper's alpha, equations (12), (32).

        Raises
        ------
        SingularLeadingMatrixError
            The method is `deflation`, since W is singular.
        """
        return self.solution.inverse_rows()[len(self.partition.inertial) :]

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the states: displacements, then velocities."""
        return self.partition.states

    def motion(self, derivative: int) -> Signal:
        """Return q, q' or q'' (derivative 0, 1, 2) of all n DOFs as functions of state and inputs.

        Raises
        ------
        ModelSizeError
            A sparse model with so many DOFs and states that this is too large.
        """
        return self.solution.motion(derivative)

    def state(
        self,
        q0: npt.ArrayLike | Mapping[str, float],
        v0: npt.ArrayLike | Mapping[str, float] | None = None,
        u0: npt.ArrayLike = 0.0,
    ) -> FloatArray:
        """Return the state for displacements and velocities, and refuse those that cannot be.

        Parameters
        ----------
        q0 : (n,) array_like or mapping from DOF to displacement [m]
            NaN, or a DOF that is missing, leaves a displacement open: it is zero where it is a state
            and follows from the equations where it is not.
        v0 : (n,) array_like or mapping from DOF to velocity [m/s], optional
            Likewise; all open by default.
        u0 : (m,) array_like or float, optional
            Inputs at that time, which the half and static equations contain; their derivatives are
            taken as zero.

        Returns
        -------
        (N,) ndarray
            ``initial_state`` for python-control's time responses.

        Raises
        ------
        InconsistentStateError
            A given value differs from what the half and static equations require, by more than 1e-9
            of the largest value of its kind.
        """
        model = self.model
        q = given_values(q0, model.dofs, "displacement")
        v = given_values({} if v0 is None else v0, model.dofs, "velocity")
        u = given_inputs(u0, len(model.inputs))
        x = self.partition.state_of(np.nan_to_num(q), np.nan_to_num(v))
        if self.shift:
            x = x - self.shift[0] @ u
        for derivative, given in enumerate((q, v)):
            required = self.solution.motion_at(x[:, None], [u[:, None]], derivative)[:, 0]
            require_consistent(motion_names(model.dofs, derivative), given, required)
        return x

    def recover(self, response: TimeResponse) -> RecoveredMotion:
        """Return the displacements and velocities of all DOFs for a time response of the state space.

        Where a velocity follows the derivative of an input (a static DOF under a force of its own), the
        input's slope until the next time is used, as python-control interpolates inputs linearly; the
        impulse that a jump of the input causes cannot appear in it.

        Parameters
        ----------
        response : control.TimeResponseData
            Of the system that `mech2ss` made of this model.

        Returns
        -------
        RecoveredMotion
        """
        require_response(response)
        x = np.asarray(response.x, dtype=float)
        free = np.zeros((len(self.model.inputs), *x.shape[1:]))
        u = free if response.u is None else np.asarray(response.u, dtype=float)
        if x.shape[0] != self.order or u.shape[0] != len(self.model.inputs):
            msg = (
                f"The response has {x.shape[0]} states and {u.shape[0]} inputs, the reduced model {self.order} and "
                f"{len(self.model.inputs)}. Recover a response of the state space of this very model."
            )
            raise InconsistentStateError(msg, names=self.states, given=(), required=())
        time = np.asarray(response.t, dtype=float)
        slopes = [u]
        for _ in range(self.solution.input_derivatives):
            slopes.append(forward_slope(slopes[-1], time))
        samples = math.prod(x.shape[1:])
        flat = [values.reshape(len(values), samples) for values in slopes]
        shape = (len(self.model.dofs), *x.shape[1:])
        displacement, velocity = [
            self.solution.motion_at(x.reshape(self.order, samples), flat, derivative).reshape(shape)
            for derivative in range(2)
        ]
        return RecoveredMotion(time=time, displacement=displacement, velocity=velocity, dofs=self.model.dofs)

    def __repr__(self) -> str:
        """Say how many states came of which DOFs, and how sure that is."""
        part = self.partition
        rests_on = "J" if self.method == "deflation" else "W"
        return (
            f"ExactReduction by {self.method}: {self.order} states, {self.n_infinite} infinite eigenvalues removed, "
            f"index {self.index}, rcond({rests_on}) = {self.rcond:.1e}\n"
            f"  inertial: {listed(part.inertial) or '-'}\n"
            f"  half:     {listed(part.half) or '-'}\n"
            f"  static:   {listed(part.static) or '-'}"
        )
