"""The result of the exact reduction: A, B, the way back to all DOFs, and the evidence.

All of q follows from the state and the inputs:

    q = X x + U_0 u + U_1 u' + ...                                                         (4)

Derivatives of the inputs (Bv, Ba) are absorbed by x = x~ + E_0 u + E_1 u' (5), so that x~' = A x~ + B u.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from halfdof_ctrl.base.arrays import FloatArray
from halfdof_ctrl.base.errors import InconsistentStateError, SingularLeadingMatrixError
from halfdof_ctrl.base.names import listed, motion_names
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.reduction.algebra.leading_matrix import SINGULAR, LeadingMatrix
from halfdof_ctrl.reduction.algebra.sparse_lu import SparseLU
from halfdof_ctrl.reduction.deflation.states import StateSelection
from halfdof_ctrl.reduction.dense.partition import DofPartition
from halfdof_ctrl.reduction.dense.single_solve import rounding_of_solve
from halfdof_ctrl.reduction.method.evidence import RankDecision, Road
from halfdof_ctrl.reduction.method.recovery import (
    RecoveredMotion,
    TimeResponse,
    forward_slope,
    given_values,
    require_consistent,
)
from halfdof_ctrl.reduction.method.signals import Rounding, Signal, StateEquations, output_signal
from halfdof_ctrl.reduction.sparse.displacement import SparseDisplacement
from halfdof_ctrl.reduction.sparse.partition import SparsePartition
from halfdof_ctrl.reduction.sparse.single_solve import SparseReduction


@dataclass(frozen=True, slots=True, eq=False, kw_only=True, repr=False)
class ExactReduction:
    """``x' = A x + B u`` with the finite eigenvalues of the model, and the way back to q.

    For n DOFs, N states and m inputs. Made by `exact_reduction`.
    """

    model: SecondOrderModel  #: the model that was reduced
    partition: DofPartition | SparsePartition | StateSelection  #: which coordinates are inertial, half and static
    leading: LeadingMatrix | SparseLU | None  #: W of equation (2), factorized; None where the road is `deflation`
    equations: StateEquations | SparseReduction  #: A, B and the way back to q
    rcond: float  #: reciprocal condition number of W, or the smallest of the systems (18), on which the states rest
    known_rounding: Rounding | None = None  #: rounding errors of the equations, where the road has followed them
    tol: float | None = None  #: what `exact_reduction` was given

    @property
    def A(self) -> FloatArray:  # noqa: N802
        """(N, N) state matrix."""
        return self.equations.A

    @property
    def B(self) -> FloatArray:  # noqa: N802
        """(N, m) input matrix."""
        return self.equations.B

    @property
    def displacement(self) -> Signal | SparseDisplacement:
        """All n displacements as functions of state and inputs, equation (4)."""
        return self.equations.displacement

    @property
    def shift(self) -> tuple[FloatArray, ...]:
        """E_0, E_1, ... of equation (5), (N, m) each; empty unless derivatives of inputs reach the states."""
        return self.equations.shift

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
        if isinstance(self.partition, StateSelection):
            from halfdof_ctrl.reduction.deflation.method import index_of  # noqa: PLC0415

            return index_of(self)
        return int(self.partition.n_static > 0)

    @property
    def method(self) -> Road:
        """Which road was taken: `selection` of DOFs, `orthogonal` bases or `deflation`."""
        return self.partition.method

    @property
    def evidence(self) -> tuple[RankDecision, ...]:
        """The singular values that decisions about ranks rest on, block by block; those of W come last."""
        if not isinstance(self.leading, LeadingMatrix) or not isinstance(self.partition, DofPartition):
            return self.partition.evidence
        values = self.leading.singular_values()
        bound = len(values) * SINGULAR * float(values.max(initial=0.0))
        regular = RankDecision(matrix="W", dofs=self.model.dofs, singular_values=values, rank=values.size, bound=bound)
        return (*self.partition.evidence, regular)

    @property
    def output(self) -> Signal:
        """The model's outputs as functions of state, inputs and, where they are improper, derivatives of inputs."""
        if isinstance(self.equations, SparseReduction):
            return self.equations.displacement.output(self.model)
        return output_signal(self.model, self.equations, self._rounding)

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
            The road is `deflation`, since W is singular.
        """
        return self._inverse_rows()[: len(self.partition.inertial)]

    @property
    def alpha(self) -> FloatArray:
        """(n_c, n) rows of W^-1 for p'_c: the paper's alpha, equations (12), (32).

        Raises
        ------
        SingularLeadingMatrixError
            The road is `deflation`, since W is singular.
        """
        first = len(self.partition.inertial)
        return self._inverse_rows()[first : first + len(self.partition.half)]

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
        signal = self.displacement.whole() if isinstance(self.displacement, SparseDisplacement) else self.displacement
        for _ in range(derivative):
            signal = signal.derivative(self.A, self.B)
        return signal

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
        u = np.broadcast_to(np.asarray(u0, dtype=float), (len(model.inputs),))
        x = self.partition.state_of(np.nan_to_num(q), np.nan_to_num(v))
        if self.shift:
            x = x - self.shift[0] @ u
        for derivative, given in enumerate((q, v)):
            if isinstance(self.displacement, SparseDisplacement):
                at_rest = [np.zeros((u.size, 1))] * 3
                required = self.displacement.motion_at(x[:, None], [u[:, None], *at_rest], derivative)[:, 0]
            else:
                motion = self.motion(derivative)
                required = motion.X @ x + motion.direct(u.size) @ u
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
        if isinstance(self.displacement, SparseDisplacement):
            displacement, velocity = self.displacement.histories(x, u, time)
            return RecoveredMotion(time=time, displacement=displacement, velocity=velocity, dofs=self.model.dofs)
        slopes = [u]
        histories = []
        for derivative in range(2):
            motion = self.motion(derivative)
            history = np.tensordot(motion.X, x, axes=1)
            for power, part in enumerate(motion.U):
                if power == len(slopes):
                    slopes.append(forward_slope(slopes[-1], time))
                history += np.tensordot(part, slopes[power], axes=1)
            histories.append(history)
        return RecoveredMotion(time=time, displacement=histories[0], velocity=histories[1], dofs=self.model.dofs)

    def __repr__(self) -> str:
        """Say how many states came of which DOFs, and how sure that is."""
        part = self.partition
        rests_on = "W" if self.leading is not None else "J"
        return (
            f"ExactReduction by {self.method}: {self.order} states, {self.n_infinite} infinite eigenvalues removed, "
            f"index {self.index}, rcond({rests_on}) = {self.rcond:.1e}\n"
            f"  inertial: {listed(part.inertial) or '-'}\n"
            f"  half:     {listed(part.half) or '-'}\n"
            f"  static:   {listed(part.static) or '-'}"
        )

    def _rounding(self) -> Rounding:
        equations, partition, leading = self.equations, self.partition, self.leading
        known = isinstance(equations, SparseReduction) or not isinstance(partition, DofPartition)
        if known or not isinstance(leading, LeadingMatrix) or self.known_rounding is not None:
            return self.known_rounding  # type: ignore[return-value]
        return rounding_of_solve(self.model, partition, leading, equations)  # type: ignore[arg-type]

    def _inverse_rows(self) -> FloatArray:
        if self.leading is None:
            msg = "W of equation (2) is singular, so that alpha and gamma, the rows of its inverse, do not exist."
            raise SingularLeadingMatrixError(msg, dofs=(), rcond=0.0)
        if isinstance(self.displacement, SparseDisplacement):
            return self.displacement.inverse_rows()
        return self.leading.solve(np.eye(len(self.model.dofs)))
