"""Take T of equation (2a) as orthonormal bases of null(M) and of null(M) with null(C).

They are found block by block, in the connected components of the pattern of M and then of C, on scaled blocks.
Every coordinate that needs no mixing stays the DOF that it was. Derivation: docs/explanation/reduction.md.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
import scipy.linalg

from halfdof_ctrl.base.arrays import FloatArray, IndexArray, read_only, unit_matrix
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.reduction.algebra.blocks import (
    RANK_TOLERANCE,
    UNCLEAR,
    cancelled,
    connected_columns,
    lengths_of_columns,
    mixture_names,
)
from halfdof_ctrl.reduction.algebra.scaling import gap_threshold, levelling_factors, logarithmic_scaling
from halfdof_ctrl.reduction.dense.partition import DofPartition
from halfdof_ctrl.reduction.method.evidence import RankDecision


@dataclass(frozen=True, slots=True, eq=False)
class _Span:
    columns: FloatArray  #: (n, d) basis
    sizes: FloatArray  #: (n, d) what the rounding errors of its entries are relative to

    def part(self, which: IndexArray) -> "_Span":
        return _Span(self.columns[:, which], self.sizes[:, which])


def orthonormal_bases(
    model: SecondOrderModel, tol: float | None = None, *, widest: float = float("inf")
) -> DofPartition:
    """Split the motion into null(M) with null(C), the rest of null(M), and what is left.

    Parameters
    ----------
    model : SecondOrderModel
        A real model.
    tol : float, optional
        Singular values of an equilibrated block at most `tol` times its largest count as zero; by
        default 16 eps times the block's size.
    widest : float, optional
        A block whose singular values lie further apart than this is mixed although none of them is zero, so that
        directions of little mass stand alone and M T has columns that are far from each other.

    Returns
    -------
    DofPartition
        Within a block that needs mixing the columns of T are orthonormal in scaled units, the same whatever the
        model's units are; elsewhere they select DOFs.
    """
    unit = unit_matrix(len(model.dofs))
    row_logs, column_logs, time = logarithmic_scaling(np.stack([model.K, model.C, model.M]))
    rows, columns = np.exp2(row_logs)[:, None], np.exp2(column_logs)
    mass, damping = [rows * np.exp2(k * time) * matrix * columns for k, matrix in ((2.0, model.M), (1.0, model.C))]
    massive, massless, first = _null_split("M", mass, _Span(unit, unit), model.dofs, tol, widest)
    drag = cancelled(damping, massless.columns, massless.sizes)
    half, static, second = _null_split("C", drag, massless, model.dofs, tol, widest)
    basis = np.hstack([massive.columns, half.columns, static.columns]) * columns[:, None]
    sizes = np.hstack([massive.sizes, half.sizes, static.sizes]) * columns[:, None]
    lengths = lengths_of_columns(basis)
    basis, sizes = basis / lengths, sizes / np.abs(lengths)
    return DofPartition(
        method="orthogonal",
        order=np.arange(basis.shape[0]),
        basis=read_only(basis),
        sizes=read_only(sizes),
        in_order=False,
        n_inertial=massive.columns.shape[1],
        n_half=half.columns.shape[1],
        n_static=static.columns.shape[1],
        coordinates=_coordinate_names(basis, model.dofs),
        evidence=(*first, *second),
    )


def _null_split(
    letter: Literal["M", "C"], product: FloatArray, span: _Span, dofs: tuple[str, ...], tol: float | None, widest: float
) -> tuple[_Span, _Span, list[RankDecision]]:
    """Split a span of d vectors into a part where `product` (n, d) has full rank and its null space.

    A mixed column of the null space is known to rounding of the largest entry that its DOF has in the block, times
    the spread of the singular values that count; one of the other part may be any, so rounding alone counts. A column
    that is taken over is as exact as it was.
    """
    nothing = span.part(np.zeros(0, dtype=np.intp))
    ranging, null, evidence = [nothing], [nothing], []
    for block in connected_columns(product):
        own, part = span.part(block), product[:, block]
        part = part[part.any(axis=1)]
        if part.shape[0] == 0:
            null.append(own)
            continue
        row_factors, factors = levelling_factors(part)
        _, values, right = scipy.linalg.svd(part * row_factors[:, None] * factors)
        bound = tol
        if bound is None:
            bound = max(part.shape) * RANK_TOLERANCE
            bound = gap_threshold(values / values[0], bound, bound * UNCLEAR)
        rank = int(np.count_nonzero(values > bound * values[0]))
        concerned = tuple([dofs[index] for index in np.flatnonzero(own.columns.any(axis=1)).tolist()])
        evidence.append(
            RankDecision(
                matrix=letter, dofs=concerned, singular_values=values, rank=rank, bound=float(bound * values[0])
            )
        )
        spread = float(values[0] / values[rank - 1]) if rank else 1.0
        if rank == block.size and spread <= widest:
            ranging.append(own)
            continue
        speck = 4 * max(part.shape) * np.finfo(float).eps * spread
        clean = np.where(np.abs(right.T) <= speck, 0.0, right.T)  # what is rounding of zero is zero
        mixed = own.columns @ (factors[:, None] * clean)
        size = (own.sizes @ (factors[:, None] * np.ones_like(clean))).max(axis=1, keepdims=True)
        whole = _Span(mixed, size * np.where(np.arange(block.size) < rank, 1.0, spread))
        ranging.append(whole.part(np.arange(rank)))
        null.append(whole.part(np.arange(rank, block.size)))
    return _joined(ranging), _joined(null), evidence


def _joined(spans: list[_Span]) -> _Span:
    return _Span(np.hstack([span.columns for span in spans]), np.hstack([span.sizes for span in spans]))


def _coordinate_names(basis: FloatArray, dofs: tuple[str, ...]) -> tuple[str, ...]:
    """Name the columns of T."""
    selected: list[int | None] = []
    for column in basis.T:
        entries = np.flatnonzero(column)
        selected.append(int(entries[0]) if entries.size == 1 and column[entries[0]] == 1.0 else None)
    return mixture_names(selected, dofs)
