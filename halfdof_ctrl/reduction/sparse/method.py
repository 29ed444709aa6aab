"""The methods by one sparse solve of (3), for models whose matrices are sparse.

Up to 500 DOFs a sparse model is reduced here only where nothing is near a decision: where W by a selection is plainly
regular. Otherwise its dense copy is, so that both give the same.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from halfdof_ctrl.base.arrays import ComplexArray, FloatArray, has_even_entries
from halfdof_ctrl.base.errors import ModelSizeError, SingularLeadingMatrixError
from halfdof_ctrl.base.names import listed
from halfdof_ctrl.base.sparse_arrays import as_sparse
from halfdof_ctrl.base.spectrum import balanced_states
from halfdof_ctrl.base.threads import limited_threads
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.model.singular import NULL_VECTOR_SHARE
from halfdof_ctrl.reduction.algebra.leading_matrix import FEW_DOFS, LEAST_SIZE, SINGULAR_RCOND, plainly_regular
from halfdof_ctrl.reduction.algebra.scaling import ROUGHLY_SETTLED, unit_free_scaling
from halfdof_ctrl.reduction.algebra.sparse_lu import SparseLU
from halfdof_ctrl.reduction.method.evidence import ALLOWED_LOSS, Evidence, RankDecision
from halfdof_ctrl.reduction.method.loss import (
    ASKED_STATES,
    NOTHING_LOST,
    SAVED,
    SPREAD,
    TEN_TIMES_DATA,
    Loss,
    loss_of,
    measured_loss,
)
from halfdof_ctrl.reduction.method.loss_bound import are_kept, is_well_conditioned, reads_rates_of_massless
from halfdof_ctrl.reduction.method.masses import spread_is_wide
from halfdof_ctrl.reduction.method.protocol import MethodName
from halfdof_ctrl.reduction.method.refined_answers import Solver, StateSolver
from halfdof_ctrl.reduction.method.signals import Signal
from halfdof_ctrl.reduction.sparse.bases import sparse_bases
from halfdof_ctrl.reduction.sparse.displacement import SparseDisplacement
from halfdof_ctrl.reduction.sparse.loss import measured_sparsely
from halfdof_ctrl.reduction.sparse.partition import INERTIAL, STATIC, SparsePartition
from halfdof_ctrl.reduction.sparse.selection import has_dependent_columns, select_sparse_columns
from halfdof_ctrl.reduction.sparse.single_solve import require_states, solved_by_rows, sparse_leading_columns

ALWAYS_TOLD = 1e-6  #: part of a value: a larger loss is told of, whatever the entries determine
DENSE_COPY_DOFS = 500  #: DOFs up to which a sparse model is reduced densely where a decision is near


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class SparseSolve:
    """A reduction by one sparse solve of (3): a `ReductionMethod`."""

    model: SecondOrderModel
    coordinates: SparsePartition
    leading: SparseLU  #: W of equation (2), factorized
    displacement: SparseDisplacement  #: equation (4), worked out where it is asked for
    loss: Loss = NOTHING_LOST  #: measured where W asks for it

    @property
    def name(self) -> MethodName:
        """`selection` or `orthogonal`."""
        return self.coordinates.method

    @property
    def is_even(self) -> bool:
        """Nobody has looked."""
        return False

    @property
    def A(self) -> FloatArray:  # noqa: N802
        """(N, N) state matrix."""
        return self.displacement.A

    @property
    def B(self) -> FloatArray:  # noqa: N802
        """(N, m) input matrix."""
        return self.displacement.B

    @property
    def shift(self) -> tuple[FloatArray, ...]:
        """E_0, E_1 of equation (5)."""
        return self.displacement.shift

    @property
    def evidence(self) -> Evidence:
        """What the states rest on."""
        part = self.coordinates
        return Evidence(decisions=part.evidence, light=part.light, rcond=self.leading.rcond, loss=self.loss)

    @property
    def input_derivatives(self) -> int:
        """How many derivatives of the inputs the velocities may contain."""
        return len(self.displacement.equation.forces)

    def index(self) -> int:
        """Return 1 where there are static coordinates, else 0."""
        return int(self.coordinates.n_static > 0)

    def output(self, model: SecondOrderModel) -> Signal:
        """Return the outputs of a model that differs in them alone."""
        return self.displacement.output(model)

    def motion(self, derivative: int) -> Signal:
        """Return a derivative of all DOFs, where that is no matrix too large."""
        signal = self.displacement.whole()
        for _ in range(derivative):
            signal = signal.derivative(self.A, self.B)
        return signal

    def motion_at(self, x: FloatArray, inputs: Sequence[FloatArray], derivative: int) -> FloatArray:
        """Return a derivative of all DOFs for given states and inputs."""
        return self.displacement.motion_at(x, inputs, derivative)

    def without_rounding(self) -> FloatArray:
        """Return A as it is: what of it is rounding is not followed entry by entry."""
        return self.A

    def rounding_sizes(self) -> FloatArray:
        """Return the sizes of the entries of A."""
        return np.abs(self.A)

    def decisions(self) -> tuple[RankDecision, ...]:
        """Return the decisions of the coordinates."""
        return self.coordinates.evidence

    def answers(self, states: StateSolver) -> Solver:
        """Return what gives the response of all DOFs to forces, by the factors of W."""
        return partial(self._answer, states)

    def _answer(self, states: StateSolver, force: ComplexArray) -> ComplexArray:
        part = self.coordinates
        both = np.hstack([force.real, force.imag]) * self.leading.rows[:, None]
        real, imag = np.hsplit(self.leading.solve(both), 2)
        solved = (real + 1j * imag)[part.order]
        n_i, moving = part.n_inertial, part.n_inertial + part.n_half
        moved = states.solve(np.concatenate([np.zeros_like(solved[:n_i]), solved[n_i:moving], solved[:n_i]]))
        rest = [np.zeros((self.B.shape[1], force.shape[1]))]
        q = self.motion_at(moved.real, rest, 0) + 1j * self.motion_at(moved.imag, rest, 0)
        static = np.zeros_like(solved)
        static[part.order[moving:]] = solved[moving:]
        return np.asarray(q + (static if part.columns is None else part.columns @ static))

    def inverse_rows(self) -> FloatArray:
        """Return gamma and alpha."""
        return self.displacement.inverse_rows()


def by_sparse_selection(model: SecondOrderModel, tol: float | None, *, asked: bool) -> SparseSolve | None:
    """Propose a selection of DOFs; None if W is singular, or too near it for a model that a dense copy can serve.

    Raises
    ------
    SingularLeadingMatrixError
        It was asked for, and W is singular to working precision.
    ModelSizeError
        A or B would be too large.
    """
    coordinates = select_sparse_columns(model, tol)
    require_states(model, coordinates)
    if not asked and has_dependent_columns(model, coordinates):
        return None
    found = _solved(model, coordinates, asked=asked)
    if found is None or asked or tol is not None or found.loss.value <= ALLOWED_LOSS:
        return found
    return _in_better_coordinates(found) or found


def _in_better_coordinates(found: SparseSolve) -> SparseSolve | None:
    """Give directions of little mass or damping coordinates of their own, where that keeps digits that DOFs lose.

    With another number of states only where W of the DOFs is singular by the measure of dense models.
    """
    n = len(found.model.dofs)
    if found.leading.rcond >= plainly_regular(n):
        return None
    try:
        coordinates = sparse_bases(found.model, widest=SPREAD)
    except ModelSizeError:
        return None
    if not any(decision.singular_values.size > 1 for decision in coordinates.evidence):
        return None
    other = _solved(found.model, coordinates, asked=False)
    if other is None or not other.loss.value <= SAVED * found.loss.value:
        return None
    is_singular = found.leading.rcond < max(n, LEAST_SIZE) * SINGULAR_RCOND
    return other if is_singular or len(other.A) == len(found.A) else None


def by_sparse_bases(model: SecondOrderModel, tol: float | None, *, asked: bool) -> SparseSolve | None:
    """Propose orthonormal bases; None if W is singular, or for a model that a dense copy can serve.

    Raises
    ------
    SingularLeadingMatrixError
        They were asked for, and W is singular to working precision.
    ModelSizeError
        A or B would be too large, or M or C connects too many coordinates.
    """
    if not asked and len(model.dofs) <= DENSE_COPY_DOFS:
        return None
    coordinates = sparse_bases(model, tol)
    require_states(model, coordinates)
    return _solved(model, coordinates, asked=asked)


@limited_threads(1)
def _solved(model: SecondOrderModel, coordinates: SparsePartition, *, asked: bool) -> SparseSolve | None:
    n = len(model.dofs)
    leading = SparseLU.factorized(sparse_leading_columns(model, coordinates))
    if leading.is_singular:
        if asked:
            raise _singular_error(model, coordinates, leading)
        return None
    if not asked and n <= DENSE_COPY_DOFS and leading.rcond < plainly_regular(n):
        return None
    displacement = solved_by_rows(model, coordinates, leading)
    found = SparseSolve(model=model, coordinates=coordinates, leading=leading, displacement=displacement)
    if n > DENSE_COPY_DOFS:
        return replace(found, loss=_lost(found))
    if asked:
        return found if leading.rcond >= plainly_regular(n) else replace(found, loss=measured_loss(found))
    return found if _loses_nothing(found) else None


def _lost(found: SparseSolve) -> Loss:
    """Measure what is lost; what rounding of the entries of an ordinary structure does as well is a loss if it is much.

    As the dense method does, which looks at no more than a few states of masses of similar sizes.
    """
    measurement = measured_sparsely(found)
    loss = loss_of(measurement)
    if not ALLOWED_LOSS < loss.value <= ALWAYS_TOLD or not _is_ordinary(found):
        return loss
    return loss_of(measurement, allowed=TEN_TIMES_DATA)


def _is_ordinary(found: SparseSolve) -> bool:
    """Return whether M, C and K are those of an ordinary structure in odd units, which lets no more digits be lost."""
    if found.leading.rcond < plainly_regular(len(found.model.dofs)) or found.coordinates.columns is not None:
        return False
    if not spread_is_wide(found.model, found.coordinates.kinds == INERTIAL):
        return True
    parts = [as_sparse(part) for part in found.model.quadratics.P]
    return all(
        has_even_entries(unit_free_scaling(part, ROUGHLY_SETTLED).of_sparse(part).data) for part in parts if part.nnz
    )


def _loses_nothing(found: SparseSolve) -> bool:
    """Tell whether nothing is lost of a small model; whatever is no plain case is left to its dense copy."""
    model, N = found.model, len(found.A)
    if N > ASKED_STATES:
        kinds = found.coordinates.kinds
        rates = reads_rates_of_massless(model, np.flatnonzero(kinds != INERTIAL), np.flatnonzero(kinds == STATIC))
        return not (rates or spread_is_wide(model, kinds == INERTIAL))
    parts = [as_sparse(part) for part in model.quadratics.P]
    others = (*model.quadratics.F[1:], *model.quadratics.D)
    if not N or found.shift or any(as_sparse(part).nnz for part in others):
        return not N
    if len(model.dofs) <= FEW_DOFS and not all(has_even_entries(part.data) for part in parts):
        return False
    A, scale = balanced_states(found.A)
    if not is_well_conditioned(A):
        return False
    try:
        output = found.output(model)
    except ModelSizeError:  # whoever asks for the outputs will hear of it
        return True
    x = scale[:, None] * np.linalg.solve(A, found.B / scale[:, None])
    return are_kept(output, x)


def _singular_error(
    model: SecondOrderModel, partition: SparsePartition, leading: SparseLU
) -> SingularLeadingMatrixError:
    """Make the refusal of a singular W, naming the DOFs of its null vector."""
    null = np.abs(leading.null_vector())
    concerned = np.flatnonzero(null > NULL_VECTOR_SHARE * null.max())
    if partition.columns is not None:
        concerned = np.unique(partition.columns[:, concerned].indices)
    dofs = tuple([model.dofs[index] for index in concerned.tolist()])
    msg = (
        f"The leading matrix W = [M T_i, C T_c, K T_k] is singular to working precision (rcond {leading.rcond:.1e}, "
        f"by {partition.method}): the equations of motion do not determine the highest derivatives of DOFs "
        f"{listed(dofs)}. Either a rigid constraint or an algebraic loop of dampers or springs ties them (index "
        "above one), or nothing resists their motion. Give them the mass, damper or spring that the model left out, "
        "or eliminate the constraint."
    )
    return SingularLeadingMatrixError(msg, dofs=dofs, rcond=leading.rcond)
