"""The plant that a regulator is designed for, without what is only rounding in A.

The condensed stiffness of springs in series on a free body is zero, and what stands there is a rounding error. It would
make a mode of its own that no input reaches. An entry of the solution Z = W^-1 R of equation (3) is known to

    u |W^-1| (|W| |W^-1| |R| + |R|)

times a small number, entry by entry; one below this is zero.
"""

from dataclasses import dataclass

import numpy as np

from halfdof_ctrl.base.arrays import EPS, FloatArray
from halfdof_ctrl.reduction.algebra.leading_matrix import LeadingMatrix
from halfdof_ctrl.reduction.dense.partition import DofPartition
from halfdof_ctrl.reduction.dense.single_solve import leading_columns
from halfdof_ctrl.reduction.exact_reduction import ExactReduction

SAFETY = 4.0  #: times eps: what an entry is known to, of the terms that it came from


@dataclass(frozen=True, slots=True, eq=False)
class Plant:
    """``x' = A x + B u``."""

    A: FloatArray  #: (N, N)
    B: FloatArray  #: (N, m)


def plant_of(reduction: ExactReduction) -> Plant:
    """Return A and B of a reduction, entries of A that are rounding of nothing set to zero."""
    partition, leading = reduction.partition, reduction.leading
    if not isinstance(partition, DofPartition) or not isinstance(leading, LeadingMatrix):
        return Plant(reduction.A, reduction.B)
    model, n_i, moving = reduction.model, partition.n_inertial, partition.n_inertial + partition.n_half
    size_of_W = np.abs(leading_columns(model, partition))
    inverse = np.abs(leading.solve(np.eye(len(size_of_W))))
    right = np.abs(np.hstack([partition.times_basis(model.K, 0, moving), partition.times_basis(model.C, 0, n_i)]))
    doubt = SAFETY * EPS * (inverse @ (size_of_W @ (inverse @ right) + right))
    A = reduction.A.copy()
    rows = np.vstack([doubt[n_i:moving], doubt[:n_i]])
    A[n_i:][np.abs(A[n_i:]) <= rows] = 0.0
    return Plant(A, reduction.B)
