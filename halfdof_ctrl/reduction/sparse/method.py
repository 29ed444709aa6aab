"""The method by one sparse solve of (3)."""

from halfdof_ctrl.base.arrays import LARGEST_DENSE_COPY
from halfdof_ctrl.base.errors import ModelSizeError, SingularLeadingMatrixError
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.reduction.exact_reduction import ExactReduction
from halfdof_ctrl.reduction.method.evidence import Road, warn_of_close_decisions
from halfdof_ctrl.reduction.sparse.single_solve import sparse_reduction

LARGEST_CERTIFIED = 500  #: DOFs up to which a sparse model with mixed coordinates is reduced densely


def sparsely_reduced(model: SecondOrderModel, tol: float | None, method: Road | None) -> ExactReduction | None:
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
    warn_of_close_decisions(parts.partition.evidence)
    return ExactReduction(
        model=model,
        partition=parts.partition,
        leading=parts.leading,
        equations=parts,
        rcond=parts.leading.rcond,
        tol=tol,
    )
