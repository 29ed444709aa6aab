"""Whether det P(s) vanishes at every s, told by the oracle for itself, dense and sparse."""

from typing import Any, cast

import numpy as np
from scipy.sparse import csc_array, diags_array

from halfdof_ctrl.base.arrays import EPS, LARGEST_DENSE_COPY, FloatArray, IndexArray
from halfdof_ctrl.base.errors import SingularPencilError
from halfdof_ctrl.base.names import listed, removal_of
from halfdof_ctrl.base.sparse_arrays import SparseMatrix, as_sparse
from halfdof_ctrl.base.sparse_factors import PIVOTINGS, sparse_lu
from halfdof_ctrl.base.threads import limited_threads
from halfdof_ctrl.descriptor.exact_counts import normal_rank
from halfdof_ctrl.descriptor.finite_part import GENERIC_POINTS
from halfdof_ctrl.descriptor.first_order import typical_frequency
from halfdof_ctrl.descriptor.nearness import UNDECIDED, share_of_rounding, undecided_regularity
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.model.singular import NULL_VECTOR_SHARE, causes, null_spaces, singular_pencil_error
from halfdof_ctrl.model.sparse_evaluation import PointFactors, SparsePencil

SINGULAR_PENCIL = 64 * EPS  #: of the largest singular value: a smallest one below is rounding of zero
PENCIL_NUDGE = 2.0**-40  #: times the scaled matrix: what is added to its diagonal to find a null vector
REGULARITY_STEPS = 4  #: of inverse iteration


@limited_threads(1)
def require_regular_sparse(model: SecondOrderModel) -> None:
    """Refuse a singular pencil of a sparse model, naming the DOFs that nothing holds.

    A smallest singular value says nothing of it: a slender beam of thousands of elements and a constraint that stands
    nearly twice have one below rounding, and are regular. It says where to look: the columns of a null vector are
    dependent at every s exactly or not. Where they are not, a model of up to 2000 DOFs is asked as a dense one is; a
    larger one, of which nothing is proved, is no reason to refuse.

    Raises
    ------
    SingularPencilError
        ``P(s)`` is singular to working precision at three generic points, and exactly.
    UncertainRankError
        As for dense models.
    """
    coefficients = [as_sparse(matrix) for matrix in model.quadratics.P]
    gamma, pencil = _time_scale(coefficients), SparsePencil.on_one_pattern(coefficients)
    for point in GENERIC_POINTS:
        ratio, null = _smallest_singular_value(pencil, gamma * point)
        if ratio > SINGULAR_PENCIL:
            return
    concerned = np.flatnonzero(null > NULL_VECTOR_SHARE * null.max())
    if not _are_dependent(coefficients, concerned):
        if len(model.dofs) <= LARGEST_DENSE_COPY:
            _require_regular_dense(model.as_dense())
        return
    dofs = tuple([model.dofs[k] for k in concerned.tolist()])
    msg = (
        f"The pencil is singular: det P(s) vanishes at every s (smallest singular value {ratio:.1e} of the largest "
        f"after scaling). DOFs {listed(dofs)} can move together in any way without a force: a node without spring, "
        "damper or mass, a constraint that stands twice, or two identical equations. Remove what is redundant, give "
        f"what is loose a stiffness, or take it out: {removal_of(dofs)}."
    )
    raise SingularPencilError(msg, dofs=dofs)


def _are_dependent(coefficients: list[SparseMatrix], which: IndexArray) -> bool:
    """Return whether columns of P(s) are dependent at every s, by their rank modulo primes."""
    if which.size > LARGEST_DENSE_COPY:
        return False
    columns = [csc_array(part[:, which]) for part in coefficients]
    rows = np.unique(np.concatenate([part.indices for part in columns]))
    if rows.size < which.size or rows.size > LARGEST_DENSE_COPY:
        return bool(rows.size < which.size)
    return normal_rank([np.asarray(part.tocsr()[rows].toarray()) for part in columns]) < which.size


def _smallest_singular_value(pencil: SparsePencil, s: complex) -> tuple[float, FloatArray]:
    """Estimate the smallest singular value of the scaled P(s), relative to the largest, and give its right vector."""
    ordering, threshold = PIVOTINGS[1 if pencil.is_nearly_symmetric else -1]
    try:
        factors = PointFactors.of(pencil, s, ordering, threshold)
        matrix, lu, known = factors.matrix, cast("Any", factors.lu), 1.0
    except RuntimeError:  # exactly singular
        matrix, _, _ = pencil.scaled_at(s)
        nudge = diags_array(PENCIL_NUDGE * np.random.default_rng(0).uniform(1.0, 2.0, matrix.shape[0]))
        lu, known = sparse_lu(csc_array(matrix + nudge)), 0.0
    generator = np.random.default_rng(0)
    vector = generator.standard_normal(matrix.shape[0]) + 1j * generator.standard_normal(matrix.shape[0])
    length = 1.0
    with np.errstate(all="ignore"):
        for _ in range(REGULARITY_STEPS):
            vector = lu.solve(lu.solve(vector / np.linalg.norm(vector), trans="H"))
            length = float(np.linalg.norm(vector))
    largest = float(np.sqrt(abs(matrix).sum(axis=0).max() * abs(matrix).sum(axis=1).max()))
    ratio = known / np.sqrt(length) / largest if np.isfinite(length) and largest > 0.0 else 0.0
    return float(ratio), np.abs(np.nan_to_num(vector))


def _time_scale(coefficients: list[SparseMatrix]) -> float:
    """Return a frequency [rad/s], a power of two, at which the largest entries of K and M (or C) balance."""
    K, C, M = (float(np.abs(matrix.data).max(initial=0.0)) for matrix in coefficients)
    if K > 0.0 and M > 0.0:
        return float(2.0 ** np.round(np.log2(K / M) / 2.0))
    if K > 0.0 and C > 0.0:
        return float(2.0 ** np.round(np.log2(K / C)))
    return float(2.0 ** np.round(np.log2(C / M))) if C > 0.0 and M > 0.0 else 1.0


def require_regular(model: SecondOrderModel) -> None:
    """Refuse a singular pencil, naming the DOFs that nothing holds and the equations that say too little.

    Raises
    ------
    SingularPencilError
        ``det P(s)`` of the stored numbers vanishes at every s, exactly.
    UncertainRankError
        It does not, but changes of the size of rounding could make it vanish.
    """
    if model.is_sparse:
        require_regular_sparse(model)
    else:
        _require_regular_dense(model)


def _require_regular_dense(model: SecondOrderModel) -> None:
    coefficients = model.quadratics.P
    share = share_of_rounding(coefficients)
    if share <= UNDECIDED:
        return
    n, rank = len(model.dofs), normal_rank(coefficients)
    s = typical_frequency(model) * GENERIC_POINTS[0]
    null = null_spaces(model.K + s * model.C + s**2 * model.M)
    dofs = [model.dofs[index] for index in sorted(frozenset().union(*null.unknowns))]
    if rank == n:
        raise undecided_regularity(share, dofs)
    raise singular_pencil_error(
        dofs=dofs,
        equations=[model.dofs[index] for index in sorted(frozenset().union(*null.equations))],
        fact=f"its rank is {rank} of {n}",
        causes=causes(null, coefficients, model.dofs),
    )
