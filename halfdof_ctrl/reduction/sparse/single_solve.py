"""The exact reduction of sparse models: one sparse factorization of W, a solution for each inertial or half DOF.

With the rows gamma and alpha of W^-1 that belong to p''_i and p'_c, equation (3) reads

    (p''_i; p'_c) = [gamma; alpha] (B u - C T_i p'_i - K T_i p_i - K T_c p_c),

so that n_i + n_c solutions of ``W^T z = e`` give all of A and B, whatever the number of inputs. They are worked a few
at a time and multiplied by the sparse C T_i, K T_i, K T_c and B at once: no n x n matrix is ever dense, and nothing
with n rows is kept but the factors. What the outputs need of the static coordinates takes a solution an output, or
one a state and input where those are fewer. Derivation: docs/explanation/reduction.md.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.sparse import csc_array

from halfdof_ctrl.base.arrays import FloatArray
from halfdof_ctrl.base.errors import SingularLeadingMatrixError
from halfdof_ctrl.base.names import listed
from halfdof_ctrl.base.progress import progress_bar
from halfdof_ctrl.base.sparse_arrays import SparseMatrix, as_sparse
from halfdof_ctrl.base.threads import limited_threads
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.reduction.algebra.sparse_lu import SparseLU, largest_of_columns
from halfdof_ctrl.reduction.method.signals import absorbed
from halfdof_ctrl.reduction.sparse.bases import sparse_bases
from halfdof_ctrl.reduction.sparse.displacement import SparseDisplacement, SparseEquation, inverse_rows, require_room
from halfdof_ctrl.reduction.sparse.partition import HALF, INERTIAL, STATIC, SparsePartition
from halfdof_ctrl.reduction.sparse.selection import has_dependent_columns, select_sparse_columns

NULL_VECTOR_SHARE = 1e-6  #: DOFs with more than this share of a null vector are named


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class SparseReduction:
    """What the reduction of a sparse model with N states and m inputs gives."""

    partition: SparsePartition
    leading: SparseLU  #: W of equation (2), factorized
    A: FloatArray  #: (N, N)
    B: FloatArray  #: (N, m)
    displacement: SparseDisplacement  #: equation (4), worked out where it is asked for
    shift: tuple[FloatArray, ...]  #: E_0, E_1 of equation (5)


@limited_threads(1)
def sparse_reduction(
    model: SecondOrderModel, tol: float | None, method: Literal["selection", "orthogonal"] | None
) -> SparseReduction:
    """Reduce a real sparse model to its exact states.

    Raises
    ------
    ModelSizeError
        A or B would be too large.
    SingularLeadingMatrixError
        W is singular to working precision, by both roads.
    """
    partition, leading = _partitioned(model, tol, method)
    equation = SparseEquation.of(model, partition, leading.rows)
    n_i, moving = partition.n_inertial, partition.n_inertial + partition.n_half
    N = moving + n_i
    A, driven = np.zeros((N, N)), [np.zeros((N, len(model.inputs))) for _ in equation.forces]
    A[:n_i, moving:] = np.eye(n_i)
    sizes = np.zeros(moving)
    with progress_bar(moving, "solutions") as advance:
        for block, z in inverse_rows(leading, partition.order[:moving]):
            rows = np.where(block < n_i, moving + block, block)
            A[rows] = -equation.transposes[0].times(z).T
            for force, part in zip(equation.transposes[1:], driven, strict=True):
                part[rows] = force.times(z).T
            sizes[block] = largest_of_columns(z)
            advance(block.size)
    A += 0.0  # leaves no negative zeros to be printed
    B, shift = absorbed(A, driven)
    displacement = SparseDisplacement(equation, leading, A, B, shift, sizes)
    return SparseReduction(partition=partition, leading=leading, A=A, B=B, displacement=displacement, shift=shift)


def _partitioned(
    model: SecondOrderModel, tol: float | None, method: Literal["selection", "orthogonal"] | None
) -> tuple[SparsePartition, SparseLU]:
    """Take the first road whose W is nonsingular."""
    if method != "orthogonal":
        partition = select_sparse_columns(model, tol)
        _require_states(model, partition)
        if method == "selection" or not has_dependent_columns(model, partition):
            leading = SparseLU.factorized(_leading_columns(model, partition))
            if not leading.is_singular:
                return partition, leading
            if method == "selection":
                raise _singular_error(model, partition, leading)
    partition = sparse_bases(model, tol)
    _require_states(model, partition)
    leading = SparseLU.factorized(_leading_columns(model, partition))
    if leading.is_singular:
        raise _singular_error(model, partition, leading)
    return partition, leading


def _require_states(model: SecondOrderModel, partition: SparsePartition) -> None:
    """Refuse an A or B that is too large."""
    n_i, n_c = partition.n_inertial, partition.n_half
    N, m = 2 * n_i + n_c, len(model.inputs)
    require_room(
        N,
        N,
        f"The model has {n_i} DOFs with mass and {n_c} half DOFs, hence {N} states: A",
        "truncate_modes(model, f_max=...) gives a small model of the modes that matter and measures its error; "
        "descriptor_response and bode_plot take the model as it is.",
    )
    require_room(N, m, "B", "Select the inputs that matter: model.select(inputs=[...]).")


def _leading_columns(model: SecondOrderModel, partition: SparsePartition) -> SparseMatrix:
    """Assemble W, its columns in the order of the DOFs."""
    places = [partition.of_kind(kind) for kind in (INERTIAL, HALF, STATIC)]
    matrices = as_sparse(model.M), as_sparse(model.C), as_sparse(model.K)
    parts = [partition.mapped(matrix, own) for matrix, own in zip(matrices, places, strict=True)]
    lengths = np.empty(len(model.dofs) + 1, dtype=np.int64)
    lengths[0] = 0
    for part, own in zip(parts, places, strict=True):
        lengths[own + 1] = np.diff(part.indptr)
    starts = np.cumsum(lengths)
    data, rows = np.empty(starts[-1]), np.empty(starts[-1], dtype=np.int32)
    for part, own in zip(parts, places, strict=True):
        into = np.repeat(starts[own] - part.indptr[:-1], np.diff(part.indptr)) + np.arange(part.nnz)
        data[into], rows[into] = part.data, part.indices
    return csc_array((data, rows, starts.astype(np.int32)), shape=matrices[0].shape)


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
