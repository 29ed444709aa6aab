"""The methods by one dense solve of (3): a selection of DOFs, or orthonormal bases of null spaces."""

import warnings
from dataclasses import replace

import numpy as np
import scipy.linalg

from halfdof_ctrl.base.arrays import FloatArray
from halfdof_ctrl.base.errors import CloseDecisionWarning, SingularLeadingMatrixError, callers_level
from halfdof_ctrl.base.names import listed
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.reduction.algebra.leading_matrix import (
    PLAINLY_REGULAR,
    PLAINLY_REGULAR_IF_SMALL,
    SINGULAR,
    SMALL,
    LeadingMatrix,
)
from halfdof_ctrl.reduction.algebra.scaling import equilibrating_factors
from halfdof_ctrl.reduction.dense.bases import orthonormal_bases
from halfdof_ctrl.reduction.dense.partition import DofPartition
from halfdof_ctrl.reduction.dense.selection import select_columns
from halfdof_ctrl.reduction.dense.single_solve import leading_columns, solved_at_once
from halfdof_ctrl.reduction.exact_reduction import ExactReduction
from halfdof_ctrl.reduction.method.evidence import CLOSE, LOST, Road, warn_of_close_decisions, warn_of_lost_digits
from halfdof_ctrl.reduction.method.proof import expected_loss, has_spectrum, loss
from halfdof_ctrl.reduction.method.signals import StateEquations
from halfdof_ctrl.reduction.sparse.single_solve import SparseReduction

NULL_VECTOR_SHARE = 1e-6  #: DOFs with more than this share of a null vector are named
SURELY_REGULAR = 1e-8  #: W of a selection with a smaller rcond is checked by equation (19)
SPREAD = 4.0  #: between singular values of a block of M or C, from which on it is mixed if DOFs lose digits ...
SAVED = 0.1  #: ... and the loss is then this part of what it was, or less


def by_leading_matrix(model: SecondOrderModel, tol: float | None, method: Road | None) -> ExactReduction | None:
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
    warn_of_close_decisions(reduction.partition.evidence)
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
        warn_of_lost_digits(loss(reduction.model, reduction.equations), reduction.rcond)  # type: ignore[arg-type]
    return reduction


def _in_better_coordinates(reduction: ExactReduction, equations: StateEquations) -> ExactReduction:
    """Return directions of little mass coordinates of their own, where that keeps digits that DOFs lose."""
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
