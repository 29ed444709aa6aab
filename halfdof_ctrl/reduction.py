"""The exact reduction: one solve turns M, C, K into A and B.

With the partition q = T p of equation (2a) and W of equation (2), the equation of motion reads

    W (p''_i; p'_c; p_k) = B u - C T_i p'_i - K T_i p_i - K T_c p_c                        (3)

If W is nonsingular, (3) gives p''_i, p'_c and p_k at once. The state is x = (p_i, p_c, p'_i), its order
2 n_i + n_c is exactly the number of finite eigenvalues, and the rows of W^-1 are gamma, alpha and the
static recovery of Simionatto and others, sections 2.1 to 2.3. All of q follows from x and u:

    q = X x + U_0 u + U_1 u' + ...                                                         (4)

Derivatives of the inputs (Bv, Ba) are absorbed by x = x~ + E_0 u + E_1 u' (5), so that x~' = A x~ + B u.
Derivation: docs/explanation/reduction.md.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
import numpy.typing as npt
import scipy.linalg

from halfdof_ctrl.arrays import LARGEST_DENSE_COPY, FloatArray, is_zero, read_only, unit_matrix
from halfdof_ctrl.errors import (
    ComplexModelError,
    InconsistentStateError,
    ModelSizeError,
    ParameterError,
    SingularLeadingMatrixError,
)
from halfdof_ctrl.leading import LeadingMatrix
from halfdof_ctrl.model import SecondOrderModel
from halfdof_ctrl.names import listed, motion_names
from halfdof_ctrl.partition import DofPartition, orthonormal_bases, select_columns
from halfdof_ctrl.recovery import RecoveredMotion, TimeResponse, forward_slope, given_values, require_consistent
from halfdof_ctrl.scaling import equilibrating_factors
from halfdof_ctrl.signals import Signal, absorbed, trimmed
from halfdof_ctrl.sparsedisplacement import SparseDisplacement
from halfdof_ctrl.sparselu import SparseLU
from halfdof_ctrl.sparsepartition import SparsePartition
from halfdof_ctrl.sparsereduction import sparse_reduction

Road: TypeAlias = Literal["selection", "orthogonal"]

NULL_VECTOR_SHARE = 1e-6  #: DOFs with more than this share of a null vector are named


@dataclass(frozen=True, slots=True, eq=False, kw_only=True, repr=False)
class ExactReduction:
    """``x' = A x + B u`` with the finite eigenvalues of the model, and the way back to q.

    For n DOFs, N states and m inputs. Made by `exact_reduction`.
    """

    model: SecondOrderModel  #: the model that was reduced
    partition: DofPartition | SparsePartition  #: which coordinates are inertial, half and static
    leading: LeadingMatrix | SparseLU  #: W of equation (2), factorized
    A: FloatArray  #: (N, N) of x = (p_i, p_c, p'_i)
    B: FloatArray  #: (N, m)
    displacement: Signal | SparseDisplacement  #: all n displacements, equation (4)
    shift: tuple[FloatArray, ...]  #: E_0, E_1 of equation (5), (N, m) each; empty unless Bv or Ba is there

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
        """Index of the first-order pencil in (p_i, p_c, p_k, p'_i): 1 with static coordinates, else 0."""
        return int(self.partition.n_static > 0)

    @property
    def rcond(self) -> float:
        """Reciprocal condition number of W, on which the count of states rests (see `LeadingMatrix`)."""
        return self.leading.rcond

    @property
    def method(self) -> Road:
        """Which road was taken: `selection` of DOFs or `orthogonal` bases."""
        return self.partition.method

    @property
    def gamma(self) -> FloatArray:
        """(n_i, n) rows of W^-1 for p''_i: the paper's gamma, equations (11), (20), (31)."""
        return self._inverse_rows()[: self.partition.n_inertial]

    @property
    def alpha(self) -> FloatArray:
        """(n_c, n) rows of W^-1 for p'_c: the paper's alpha, equations (12), (32)."""
        first = self.partition.n_inertial
        return self._inverse_rows()[first : first + self.partition.n_half]

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the states: inertial and half displacements, then inertial velocities."""
        return (*self.partition.inertial, *self.partition.half, *motion_names(self.partition.inertial, 1))

    def motion(self, derivative: int) -> Signal:
        """Give q, q' or q'' (derivative 0, 1, 2) of all n DOFs as functions of state and inputs.

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
        """Give the state for displacements and velocities, and refuse those that cannot be.

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
        moving = self.partition.n_inertial + self.partition.n_half
        p = self.partition.to_coordinates(np.nan_to_num(q)[:, None])[:moving, 0]
        p_dot = self.partition.to_coordinates(np.nan_to_num(v)[:, None])[: self.partition.n_inertial, 0]
        x = np.concatenate([p, p_dot])
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
        """Give the displacements and velocities of all DOFs for a time response of the state space.

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
        return (
            f"ExactReduction by {self.method}: {self.order} states, {self.n_infinite} infinite eigenvalues removed, "
            f"index {self.index}, rcond(W) = {self.rcond:.1e}\n"
            f"  inertial: {listed(part.inertial) or '-'}\n"
            f"  half:     {listed(part.half) or '-'}\n"
            f"  static:   {listed(part.static) or '-'}"
        )

    def _inverse_rows(self) -> FloatArray:
        if isinstance(self.displacement, SparseDisplacement):
            return self.displacement.inverse_rows()
        return self.leading.solve(np.eye(len(self.model.dofs)))


def exact_reduction(model: SecondOrderModel, *, tol: float | None = None, method: Road | None = None) -> ExactReduction:
    """Reduce a model with singular mass to its exact states.

    Parameters
    ----------
    model : SecondOrderModel
        A real model with n DOFs.
    tol : float, optional
        Size of a mass, relative to the largest in scaled units, up to which it counts as none
        (see `partition.select_columns` and `partition.orthonormal_bases`). By default only exact
        zeros and rounding count as none.
    method : {"selection", "orthogonal"}, optional
        Road to take; by default selection of DOFs, and orthonormal bases where that leaves W singular.

    Returns
    -------
    ExactReduction
        A, B, the way back to all DOFs, and the evidence.

    Raises
    ------
    ComplexModelError
        The model has structural damping or other imaginary parts.
    ParameterError
        `tol` or `method` is none of what they can be.
    SingularLeadingMatrixError
        W of equation (2) is singular to working precision (rcond below n eps after equilibration): a
        constraint, an algebraic loop through dampers, or a motion that nothing resists.

    Notes
    -----
    Source: Simionatto, Miyasato, Melo and Dias Junior, "Singular mass matrices and half degrees of
    freedom", section 2; the single solve (3) and the orthonormal bases are this package's.

    Examples
    --------
    A damper of 5 N s/m against a spring of 10 N/m, no mass: one state with eigenvalue -2:

    >>> exact_reduction(mechss([[0]], [[5]], [[10]])).A
    array([[-2.]])
    """
    if model.is_complex:
        raise complex_model_error(model)
    _require_options(tol, method)
    if model.is_sparse:
        reduced = _sparsely_reduced(model, tol, method)
        if reduced is not None:
            return reduced
        model = model.as_dense()
    partition, leading = _partitioned(model, tol, method)
    n_i, moving = partition.n_inertial, partition.n_inertial + partition.n_half
    m, N = model.B.shape[1], moving + n_i
    forces = (model.B,) if is_zero(model.Bv) and is_zero(model.Ba) else trimmed((model.B, model.Bv, model.Ba))
    right = np.empty((model.M.shape[0], N + m * len(forces)), order="F")
    np.negative(partition.times_basis(model.K, 0, moving), out=right[:, :moving])
    np.negative(partition.times_basis(model.C, 0, n_i), out=right[:, moving:N])
    for k, matrix in enumerate(forces):
        right[:, N + k * m : N + (k + 1) * m] = matrix
    solved = leading.solve(right)
    rate = np.zeros((N, right.shape[1]), order="F")  # x' as function of x, u, u', ...
    rate[:n_i, moving:N] = unit_matrix(n_i)
    rate[n_i:moving] = solved[n_i:moving]
    rate[moving:] = solved[:n_i]
    rate += 0.0  # leaves no negative zeros to be printed
    A = rate[:, :N]
    B, shift = absorbed(A, [rate[:, start : start + m] for start in range(N, right.shape[1], m)])
    return ExactReduction(
        model=model,
        partition=partition,
        leading=leading,
        A=read_only(A),
        B=read_only(B),
        displacement=_displacement(partition, solved, m, shift),
        shift=shift,
    )


def complex_model_error(model: SecondOrderModel) -> ComplexModelError:
    """Make the refusal of a real state space for a complex model."""
    letters = model.complex_matrices
    msg = (
        f"{listed(letters)} has imaginary parts (structural damping), which no real state space can represent at all "
        "frequencies. descriptor_response computes such a model exactly; for a state space replace the loss "
        "factor eta by a viscous damper, C = eta K / omega at the frequency that matters."
    )
    return ComplexModelError(msg, matrices=letters)


def _require_options(tol: float | None, method: Road | None) -> None:
    if method not in (None, "selection", "orthogonal"):
        msg = f"method must be 'selection', 'orthogonal' or None, not {method!r}."
        raise ParameterError(msg, parameter="method", value=method)
    if tol is not None and not (isinstance(tol, int | float) and 0.0 <= tol < 1.0):
        msg = f"tol = {tol!r}, but it is a relative size: a number from 0 to below 1, such as 1e-12."
        raise ParameterError(msg, parameter="tol", value=tol)


def _sparsely_reduced(model: SecondOrderModel, tol: float | None, method: Road | None) -> ExactReduction | None:
    """Reduce a sparse model; None where W is singular but the model small enough for the dense roads."""
    try:
        parts = sparse_reduction(model, tol, method)
    except (SingularLeadingMatrixError, ModelSizeError):
        sizes = len(model.dofs), len(model.inputs), len(model.outputs)
        if method is None and max(sizes) <= LARGEST_DENSE_COPY:
            return None
        raise
    return ExactReduction(
        model=model,
        partition=parts.partition,
        leading=parts.leading,
        A=read_only(parts.A),
        B=read_only(parts.B),
        displacement=parts.displacement,
        shift=parts.shift,
    )


def _partitioned(model: SecondOrderModel, tol: float | None, method: Road | None) -> tuple[DofPartition, LeadingMatrix]:
    """Take the first road whose W is nonsingular."""
    if method != "orthogonal":
        partition = select_columns(model, tol)
        W = _leading_columns(model, partition)
        leading = LeadingMatrix.factorized(W)
        if not leading.is_singular:
            return partition, leading
        if method == "selection":
            raise _singular_error(model, partition, W, leading)
    partition = orthonormal_bases(model, tol)
    W = _leading_columns(model, partition)
    leading = LeadingMatrix.factorized(W)
    if leading.is_singular:
        raise _singular_error(model, partition, W, leading)
    return partition, leading


def _leading_columns(model: SecondOrderModel, partition: DofPartition) -> FloatArray:
    """Assemble W = [M T_i, C T_c, K T_k]."""
    n_i, moving = partition.n_inertial, partition.n_inertial + partition.n_half
    W = np.empty(model.M.shape, order="F")
    W[:, :n_i] = partition.times_basis(model.M, 0, n_i)
    W[:, n_i:moving] = partition.times_basis(model.C, n_i, moving)
    W[:, moving:] = partition.times_basis(model.K, moving, None)
    return W


def _displacement(partition: DofPartition, solved: FloatArray, m: int, shift: tuple[FloatArray, ...]) -> Signal:
    """Assemble equation (4) from the states and the static rows of the solution of (3)."""
    n, n_i, moving = solved.shape[0], partition.n_inertial, partition.n_inertial + partition.n_half
    N = moving + n_i
    X = np.zeros((n, N))
    X[:, :moving] = partition.T[:, :moving]
    inputs: tuple[FloatArray, ...] = ()
    if moving < n:
        T_k = partition.T[:, moving:]
        X += T_k @ solved[moving:, :N]
        inputs = tuple([T_k @ solved[moving:, start : start + m] for start in range(N, solved.shape[1], m)])
    q = Signal(X, trimmed(inputs))
    return q.plus(Signal(np.zeros_like(X), tuple([X @ part for part in shift]))) if shift else q


def _singular_error(
    model: SecondOrderModel, partition: DofPartition, W: FloatArray, leading: LeadingMatrix
) -> SingularLeadingMatrixError:
    """Make the refusal of a singular W, naming the DOFs of its null vector."""
    rows, columns = equilibrating_factors(W)
    _, _, right = scipy.linalg.svd(W * rows[:, None] * columns)
    null = np.abs(right[-1])
    concerned = partition.T[:, null > NULL_VECTOR_SHARE * null.max()].any(axis=1)
    dofs = tuple([model.dofs[index] for index in np.flatnonzero(concerned).tolist()])
    msg = (
        f"The leading matrix W = [M T_i, C T_c, K T_k] is singular to working precision (rcond {leading.rcond:.1e}, "
        f"by {partition.method}): the equations of motion do not determine the highest derivatives of DOFs "
        f"{listed(dofs)}. Either a rigid constraint or an algebraic loop of dampers or springs ties them (index "
        "above one), or nothing resists their motion; pencil_structure tells which. Give them the mass, damper or "
        "spring that the model left out, or eliminate the constraint."
    )
    return SingularLeadingMatrixError(msg, dofs=dofs, rcond=leading.rcond)
