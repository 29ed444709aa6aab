"""The exact reduction of sparse models: one sparse factorization of W, a solution for each inertial or half DOF.

With the rows gamma and alpha of W^-1 that belong to p''_i and p'_c, equation (3) reads

    (p''_i; p'_c) = [gamma; alpha] (B u - C T_i p'_i - K T_i p_i - K T_c p_c),

so that n_i + n_c solutions of ``W^T z = e`` give all of A and B, whatever the number of inputs. They are worked a few
at a time and multiplied by the sparse C T_i, K T_i, K T_c and B at once: no n x n matrix is ever dense, and nothing
with n rows is kept but the factors. What the outputs need of the static coordinates takes a solution an output, or
one a state and input where those are fewer. Derivation: docs/explanation/reduction.md.
"""

import numpy as np
from scipy.sparse import csc_array

from halfdof_ctrl.base.progress import progress_bar
from halfdof_ctrl.base.sparse_arrays import SparseMatrix, as_sparse
from halfdof_ctrl.base.threads import limited_threads
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.reduction.algebra.sparse_lu import SparseLU, largest_of_columns
from halfdof_ctrl.reduction.method.signals import absorbed
from halfdof_ctrl.reduction.sparse.displacement import SparseDisplacement, SparseEquation, inverse_rows, require_room
from halfdof_ctrl.reduction.sparse.partition import HALF, INERTIAL, STATIC, SparsePartition


@limited_threads(1)
def solved_by_rows(model: SecondOrderModel, partition: SparsePartition, leading: SparseLU) -> SparseDisplacement:
    """Solve (3) row by row: A, B, and equation (4), which is worked out where it is asked for."""
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
    return SparseDisplacement(equation, leading, A, B, shift, sizes)


def require_states(model: SecondOrderModel, partition: SparsePartition) -> None:
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


def sparse_leading_columns(model: SecondOrderModel, partition: SparsePartition) -> SparseMatrix:
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
