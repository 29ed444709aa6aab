"""Take T of equation (2a) as orthonormal bases of null(M) and of null(M) with null(C).

They are found block by block, in the connected components of the pattern of M and then of C, on scaled blocks.
Every coordinate that needs no mixing stays the DOF that it was. Derivation: docs/explanation/reduction.md.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from halfdof_ctrl.base.arrays import FloatArray, IndexArray, read_only, unit_matrix
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.reduction.algebra.blocks import (
    cancelled,
    connected_columns,
    lengths_of_columns,
    mixture_names,
    split_block,
)
from halfdof_ctrl.reduction.dense.partition import DofPartition
from halfdof_ctrl.reduction.method.evidence import RankDecision


@dataclass(frozen=True, slots=True, eq=False)
class _Span:
    columns: FloatArray  #: (n, d) basis
    sizes: FloatArray  #: (n, d) what the rounding errors of its entries are relative to
    places: IndexArray  #: (d,) DOFs in whose places the columns stand

    def part(self, which: IndexArray) -> "_Span":
        return _Span(self.columns[:, which], self.sizes[:, which], self.places[which])


def orthonormal_bases(
    model: SecondOrderModel, tol: float | None = None, *, widest: float = float("inf")
) -> DofPartition:
    """Split the motion into null(M) with null(C), the rest of null(M), and what is left.

    Parameters
    ----------
    model : SecondOrderModel
        A real model.
    tol : float, optional
        Singular values of a scaled block at most `tol` times its largest count as zero; by
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
    every = _Span(unit, unit, np.arange(len(unit)))
    massive, massless, first = _null_split("M", model.M, every, model.dofs, tol, widest)
    drag = cancelled(model.C, massless.columns, massless.sizes)
    half, static, second = _null_split("C", drag, massless, model.dofs, tol, widest)
    basis = np.hstack([massive.columns, half.columns, static.columns])
    sizes = np.hstack([massive.sizes, half.sizes, static.sizes])
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

    A column that is taken over is as exact as it was; of mixed ones see `blocks.BlockSplit`.
    """
    nothing = span.part(np.zeros(0, dtype=np.intp))
    ranging, null, evidence = [nothing], [nothing], []
    for block in connected_columns(product):
        own, part = span.part(block), product[:, block]
        part = part[part.any(axis=1)]
        if part.shape[0] == 0:
            null.append(own)
            continue
        split = split_block(part, tol)
        concerned = tuple([dofs[index] for index in np.flatnonzero(own.columns.any(axis=1)).tolist()])
        evidence.append(RankDecision.of(letter, concerned, split))
        if split.rank == block.size and split.spread <= widest:
            ranging.append(own)
            continue
        whole = _Span(*split.mixed(own.columns, own.sizes), own.places)
        ranging.append(whole.part(np.arange(split.rank)))
        null.append(whole.part(np.arange(split.rank, block.size)))
    return _joined(ranging), _joined(null), evidence


def _joined(spans: list[_Span]) -> _Span:
    """Put spans beside each other, their columns in the order of the DOFs in whose places they stand."""
    places = np.concatenate([span.places for span in spans])
    order = np.argsort(places, kind="stable")
    columns, sizes = np.hstack([span.columns for span in spans]), np.hstack([span.sizes for span in spans])
    return _Span(columns[:, order], sizes[:, order], places[order])


def _coordinate_names(basis: FloatArray, dofs: tuple[str, ...]) -> tuple[str, ...]:
    """Name the columns of T."""
    selected: list[int | None] = []
    for column in basis.T:
        entries = np.flatnonzero(column)
        selected.append(int(entries[0]) if entries.size == 1 and column[entries[0]] == 1.0 else None)
    return mixture_names(selected, dofs)
