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

import warnings
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

import numpy as np
import numpy.typing as npt
import scipy.linalg

from halfdof_ctrl.base.arrays import LARGEST_DENSE_COPY, FloatArray, Matrix, read_only, unit_matrix, zero_matrix
from halfdof_ctrl.reduction.deflation.method import StateSelection, deflated, expected_loss, has_spectrum, loss
from halfdof_ctrl.base.errors import (
    CloseDecisionWarning,
    ComplexModelError,
    InconsistentStateError,
    LostDigitsWarning,
    ModelSizeError,
    ParameterError,
    SingularLeadingMatrixError,
    callers_level,
)
from halfdof_ctrl.reduction.algebra.leading_matrix import PLAINLY_REGULAR, PLAINLY_REGULAR_IF_SMALL, SINGULAR, SMALL, LeadingMatrix
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.base.names import listed, motion_names
from halfdof_ctrl.reduction.method.outputs import output_signal, without_rounding
from halfdof_ctrl.reduction.dense.partition import (
    DofPartition,
    RankDecision,
    orthonormal_bases,
    select_columns,
    without_light_masses,
)
from halfdof_ctrl.reduction.method.recovery import RecoveredMotion, TimeResponse, forward_slope, given_values, require_consistent
from halfdof_ctrl.reduction.algebra.scaling import equilibrating_factors
from halfdof_ctrl.reduction.method.signals import Rounding, Signal, StateEquations
from halfdof_ctrl.reduction.dense.single_solve import leading_columns, rounding_of_solve, solved_at_once
from halfdof_ctrl.reduction.sparse.displacement import SparseDisplacement
from halfdof_ctrl.reduction.algebra.sparse_lu import SparseLU
from halfdof_ctrl.reduction.sparse.partition import SparsePartition
from halfdof_ctrl.reduction.sparse.single_solve import SparseReduction, sparse_reduction

Road: TypeAlias = Literal["selection", "orthogonal", "deflation"]

ROADS: tuple[Road | None, ...] = ("selection", "orthogonal", "deflation", None)
NULL_VECTOR_SHARE = 1e-6  #: DOFs with more than this share of a null vector are named
CLOSE = 1e3  #: a decision about a rank with a smaller gap between singular values is warned of
SURELY_REGULAR = 1e-8  #: W of a selection with a smaller rcond is checked by equation (19)
SPREAD = 4.0  #: between singular values of a block of M or C, from which on it is mixed if DOFs lose digits ...
SAVED = 0.1  #: ... and the loss is then this part of what it was, or less
LARGEST_CERTIFIED = 500  #: DOFs up to which a sparse model with mixed coordinates is reduced densely
LOST = 1e-9  #: a state space that loses more than this against a direct solve is warned of


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
            return _index(self)
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


def exact_reduction(model: SecondOrderModel, *, tol: float | None = None, method: Road | None = None) -> ExactReduction:
    """Reduce a model with singular mass to its exact states.

    Parameters
    ----------
    model : SecondOrderModel
        A real model with n DOFs.
    tol : float, optional
        Size of a mass, relative to the largest in scaled units, up to which it counts as none
        (see `partition.select_columns` and `partition.orthonormal_bases`), and of singular values in
        deflation. By default only exact zeros and rounding count as none.
    method : {"selection", "orthogonal", "deflation"}, optional
        Road to take; by default selection of DOFs, orthonormal bases where that leaves W singular, and
        deflation where they do too (index above one). The default also takes orthonormal bases where DOFs as
        states would lose digits that those keep.

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
    SingularPencilError
        No motion follows from the equations: ``det P(s)`` vanishes at every s, as with a redundant constraint or
        a motion that nothing resists.
    UncertainRankError
        Entries nearly cancel, so that the number of states cannot be told to working precision.
    SingularLeadingMatrixError
        `method` asks for a road on which W of equation (2) is singular to working precision (rcond below
        max(n, 256) eps after scaling).

    Warns
    -----
    NearlyMasslessWarning
        A mass is not zero but below 1e-10 of the others in scaled units.
    CloseDecisionWarning
        A decision about a rank rests on singular values less than 1e3 apart, or W is hardly regular, or `tol`
        is so large that deflation gives the state space of another model.
    LostDigitsWarning
        A and B lose more than 1e-9 of the largest entry of the transfer function, because W, or J after
        deflation, is ill conditioned.

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
    _require_valid(tol, method)
    if model.is_sparse:
        reduced = _sparsely_reduced(model, tol, method)
        if reduced is not None:
            return reduced
        model = model.as_dense()
    found = None if method == "deflation" else _by_leading_matrix(model, tol, method)
    return _by_deflation(model, tol) if found is None else found


def complex_model_error(model: SecondOrderModel) -> ComplexModelError:
    """Make the refusal of a real state space for a complex model."""
    letters = model.complex_matrices
    msg = (
        f"{listed(letters)} has imaginary parts (structural damping), which no real state space can represent at all "
        "frequencies. descriptor_response computes such a model exactly; for a state space replace the loss "
        "factor eta by a viscous damper, C = eta K / omega at the frequency that matters."
    )
    return ComplexModelError(msg, matrices=letters)


def _require_valid(tol: float | None, method: Road | None) -> None:
    if method not in ROADS:
        msg = f"method must be 'selection', 'orthogonal', 'deflation' or None, not {method!r}."
        raise ParameterError(msg, parameter="method", value=method)
    if tol is not None and not (isinstance(tol, int | float) and 0.0 <= tol < 1.0):
        msg = f"tol = {tol!r}, but it is a relative size: a number from 0 to below 1, such as 1e-12."
        raise ParameterError(msg, parameter="tol", value=tol)


def _sparsely_reduced(model: SecondOrderModel, tol: float | None, method: Road | None) -> ExactReduction | None:
    """Reduce a sparse model; None for the dense roads: a small one with a singular W or mixed coordinates."""
    if method == "deflation":
        return None
    try:
        parts = sparse_reduction(model, tol, method)
    except (SingularLeadingMatrixError, ModelSizeError):
        sizes = len(model.dofs), len(model.inputs), len(model.outputs)
        if method is None and max(sizes) <= LARGEST_DENSE_COPY:
            return None
        raise
    if parts.partition.method == "orthogonal" and method is None and len(model.dofs) <= LARGEST_CERTIFIED:
        return None
    _warn_of_close_decisions(parts.partition.evidence)
    return ExactReduction(
        model=model,
        partition=parts.partition,
        leading=parts.leading,
        equations=parts,
        rcond=parts.leading.rcond,
        tol=tol,
    )


def _by_leading_matrix(model: SecondOrderModel, tol: float | None, method: Road | None) -> ExactReduction | None:
    """Take the first road whose W is nonsingular; None if there is none and no road was asked for."""
    if method != "orthogonal":
        partition = select_columns(model, tol)
        W = leading_columns(model, partition)
        leading = LeadingMatrix.factorized(W)
        if not leading.is_singular:
            reduction = _reduced(model, partition, leading, tol)
            sure = method == "selection" or tol is not None or leading.rcond > SURELY_REGULAR
            if sure or has_spectrum(model, reduction.A):
                return _warned(reduction, method)
        elif method == "selection":
            raise _singular_error(model, partition, W, leading)
    partition = orthonormal_bases(model, tol)
    W = leading_columns(model, partition)
    leading = LeadingMatrix.factorized(W)
    if not leading.is_singular:
        reduction = _reduced(model, partition, leading, tol)
        sure = method == "orthogonal" or tol is not None
        if sure or has_spectrum(model, reduction.A):  # bases of null spaces rest on rank decisions
            return _warned(reduction, method)
    elif method == "orthogonal":
        raise _singular_error(model, partition, W, leading)
    return None


def _reduced(
    model: SecondOrderModel, partition: DofPartition, leading: LeadingMatrix, tol: float | None
) -> ExactReduction:
    return ExactReduction(
        model=model,
        partition=partition,
        leading=leading,
        equations=solved_at_once(model, partition, leading),
        rcond=leading.rcond,
        tol=tol,
    )


def _warned(reduction: ExactReduction, method: Road | None) -> ExactReduction:
    """Warn of close decisions behind a W that is taken as nonsingular, and of lost digits that no coordinates save."""
    _warn_of_close_decisions(reduction.partition.evidence)
    if reduction.rcond < CLOSE * len(reduction.model.dofs) * SINGULAR:
        msg = (
            f"The leading matrix W is regular, but hardly (rcond {reduction.rcond:.1e}): the number of states rests on "
            "its smallest singular value. Look for entries that nearly cancel and DOFs with hardly any mass or damping."
        )
        warnings.warn(msg, CloseDecisionWarning, stacklevel=callers_level())
    equations = reduction.equations
    suspect = PLAINLY_REGULAR_IF_SMALL if len(reduction.model.dofs) <= SMALL else PLAINLY_REGULAR
    if reduction.rcond < suspect and reduction.tol is None and not isinstance(equations, SparseReduction):
        if method is None:
            reduction = _in_better_coordinates(reduction, equations)
        _warn_of_lost_digits(loss(reduction.model, reduction.equations), reduction.rcond)  # type: ignore[arg-type]
    return reduction


def _in_better_coordinates(reduction: ExactReduction, equations: StateEquations) -> ExactReduction:
    """Give directions of little mass coordinates of their own, where that keeps digits that DOFs lose."""
    model, lost = reduction.model, expected_loss(reduction.model, equations)
    if lost <= LOST:
        return reduction
    partition = orthonormal_bases(model, widest=SPREAD)
    leading = LeadingMatrix.factorized(leading_columns(model, partition))
    if leading.is_singular or len(partition.states) != reduction.order:
        return reduction
    solved = solved_at_once(model, partition, leading)
    if expected_loss(model, solved) > SAVED * lost:
        return reduction
    return replace(reduction, partition=partition, leading=leading, equations=solved, rcond=leading.rcond)


def _by_deflation(model: SecondOrderModel, tol: float | None) -> ExactReduction:
    result = deflated(model if tol is None else without_light_masses(model, tol), tol)
    if result.certified:
        _warn_of_close_decisions(result.selection.evidence)
        _warn_of_lost_digits(result.loss, result.rcond)
    else:
        msg = (
            f"With tol={tol:g} singular values count as zero on which the spectrum depends: the state space is not "
            "that of this model but of one that differs by as much. Pass a smaller tol, unless that is what you mean."
        )
        warnings.warn(msg, CloseDecisionWarning, stacklevel=callers_level())
    return ExactReduction(
        model=model,
        partition=result.selection,
        leading=None,
        equations=result.equations,
        rcond=result.rcond,
        known_rounding=result.rounding,
        tol=tol,
    )


def _warn_of_lost_digits(lost: float, rcond: float) -> None:
    if lost > LOST:
        msg = (
            f"The state space is exact, but A and B in double precision lose {lost:.1e} of the largest entry of the "
            "transfer function: the equations for the highest derivatives are ill conditioned "
            f"(reciprocal condition number {rcond:.1e}). descriptor_response keeps the digits."
        )
        warnings.warn(msg, LostDigitsWarning, stacklevel=callers_level())


def _warn_of_close_decisions(evidence: tuple[RankDecision, ...]) -> None:
    for decision in evidence:
        if decision.gap < CLOSE:
            values, rank = decision.singular_values, decision.rank
            zero = f"{values[rank]:.1e} as zero" if rank < values.size else f"none as zero (bound {decision.bound:.1e})"
            msg = (
                f"A decision about a rank is close: of the singular values of a block of {decision.matrix}, "
                f"{values[rank - 1]:.1e} counts and {zero}. It concerns DOFs {listed(decision.dofs)}: look for entries "
                "that nearly cancel, or pass tol."
            )
            warnings.warn(msg, CloseDecisionWarning, stacklevel=callers_level())


def _index(reduction: ExactReduction) -> int:
    """Find the index of the pencil (8) from the growth of its inverse.

    With ``[1, s M]`` as forces and ``[1; s M]`` as outputs of P(s)^-1, less the identity that belongs to the mass, the
    transfer function grows as the inverse of (8) does.
    """
    model = reduction.model if reduction.tol is None else without_light_masses(reduction.model, reduction.tol)
    unit, zero = unit_matrix(len(model.M)), zero_matrix(*model.M.shape)
    probe = replace(
        model,
        B=_beside(unit, zero),
        Bv=_beside(zero, model.M),
        Ba=_beside(zero, zero),
        F=_beside(unit, zero).T,
        G=_beside(zero, model.M.T).T,
        H=_beside(zero, zero).T,
        D=np.block([[zero, zero], [zero, -model.M]]),
        Dv=np.zeros((2 * len(model.M), 2 * len(model.M))),
        Da=np.zeros((2 * len(model.M), 2 * len(model.M))),
    )
    result = deflated(probe, reduction.tol)
    grown = output_signal(probe, result.equations, lambda: result.rounding)
    return len(without_rounding(probe, grown, result.rounding).U)


def _beside(left: Matrix, right: Matrix) -> Matrix:
    return read_only(np.hstack([left, right]))


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
        "above one), or nothing resists their motion; pencil_structure tells which. Leave method out, so that "
        "deflation is tried, or give them the mass, damper or spring that the model left out."
    )
    return SingularLeadingMatrixError(msg, dofs=dofs, rcond=leading.rcond)
