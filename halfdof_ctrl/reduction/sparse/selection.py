"""Take T of equation (2a) as a selection of the DOFs of a sparse model."""

import numpy as np
from scipy.sparse import csc_array

from halfdof_ctrl.base.arrays import EPS, FloatArray, read_only
from halfdof_ctrl.base.sparse_arrays import as_sparse, largest_by_row_and_column
from halfdof_ctrl.model.kinds import null_column_kinds
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.reduction.algebra.blocks import split_block
from halfdof_ctrl.reduction.algebra.scaling import ROUGHLY_SETTLED, unit_free_scaling
from halfdof_ctrl.reduction.method.evidence import LightMasses
from halfdof_ctrl.reduction.method.masses import slowest_speed, spread_is_wide
from halfdof_ctrl.reduction.sparse.partition import HALF, INERTIAL, STATIC, SparsePartition, linked_columns

LARGEST_GLANCE = 100  #: the same before W is factorized


def select_sparse_columns(model: SecondOrderModel, tol: float | None = None) -> SparsePartition:
    """Split the DOFs of a sparse model by the null columns of M and C, as `dense.selection.select_columns` does."""
    light = None
    inertial, half = null_column_kinds(model.M, model.C)
    if tol is not None or spread_is_wide(model, inertial):
        ratio = _mass_ratios(model)
        inertial &= ratio > (0.0 if tol is None else tol)
        light = LightMasses.among(ratio, inertial, model.dofs)
        half = (np.diff(as_sparse(model.C).indptr) > 0) & ~inertial
    kinds = np.where(inertial, INERTIAL, np.where(half, HALF, STATIC)).astype(np.int8)
    return SparsePartition(
        method="selection",
        dofs=model.dofs,
        kinds=read_only(kinds),
        columns=None,
        sizes=None,
        evidence=(),
        light=light,
    )


def has_dependent_columns(model: SecondOrderModel, partition: SparsePartition) -> bool:
    """Return whether W by null columns is singular for sure, since columns of M or C in a small connected part depend.

    Dampers and masses that act along slanted directions are of this kind. Seen here, it saves a factorization.
    """
    for matrix, kind in ((model.M, INERTIAL), (model.C, HALF)):
        part = as_sparse(matrix)
        for block in linked_columns(part, partition.of_kind(kind)):
            if block.size <= LARGEST_GLANCE:
                linked = part[:, block]
                if split_block(np.asarray(linked[np.unique(linked.indices)].toarray()), EPS).rank < block.size:
                    return True
    return False


def _mass_ratios(model: SecondOrderModel) -> FloatArray:
    """Return each DOF's mass relative to the largest, free of units, as `method.masses.mass_ratios` does."""
    M, C, K = (abs(as_sparse(matrix)) for matrix in (model.M, model.C, model.K))
    gamma = slowest_speed(model)
    total = csc_array(K + gamma * C + gamma**2 * M)
    _, mass = largest_by_row_and_column(unit_free_scaling(total, ROUGHLY_SETTLED).of_sparse(csc_array(M)))
    return np.asarray(mass / mass.max() if mass.max() > 0.0 else mass)
