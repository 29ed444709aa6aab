"""Take T of equation (2a) as orthonormal bases of the few blocks of a sparse model that need mixing."""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from scipy.sparse import coo_array, csc_array

from halfdof_ctrl.base.arrays import FloatArray, IndexArray, read_only
from halfdof_ctrl.base.errors import ModelSizeError
from halfdof_ctrl.base.names import listed
from halfdof_ctrl.base.sparse_arrays import SparseMatrix, as_sparse, column_of_entries, sparse_unit
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.reduction.algebra.blocks import lengths_of_columns, split_block
from halfdof_ctrl.reduction.method.evidence import RankDecision
from halfdof_ctrl.reduction.sparse.partition import (
    HALF,
    INERTIAL,
    STATIC,
    Mask,
    SparsePartition,
    cancelled,
    linked_columns,
)

LARGEST_MIXED = 1000  #: columns of a connected part of M or C whose rank is decided by a singular value decomposition


@dataclass(frozen=True, slots=True, eq=False)
class _Span:
    columns: SparseMatrix  #: (n, n) basis, its columns in the order of the DOFs
    sizes: SparseMatrix  #: (n, n) what the rounding errors of its entries are relative to

    def replaced(self, mixtures: list["_Mixture"]) -> "_Span":
        """Put mixtures in the place of the columns that they mix."""
        if not mixtures:
            return self
        kept = np.ones(self.columns.shape[1], dtype=bool)
        for mixture in mixtures:
            kept[mixture.block] = False
        return _Span(
            _with_columns(self.columns, kept, [(mix.rows, mix.block, mix.columns) for mix in mixtures]),
            _with_columns(self.sizes, kept, [(mix.rows, mix.block, mix.sizes) for mix in mixtures]),
        )


@dataclass(frozen=True, slots=True, eq=False)
class _Mixture:
    """Columns of T that are mixed: `columns` stands in the rows `rows` and columns `block`."""

    rows: IndexArray
    block: IndexArray
    columns: FloatArray
    sizes: FloatArray


def sparse_bases(model: SecondOrderModel, tol: float | None = None, *, widest: float = float("inf")) -> SparsePartition:
    """Split the motion of a sparse model into null(M) with null(C), the rest of null(M), and what is left.

    As `dense.bases.orthonormal_bases` does, and with the same columns.

    Raises
    ------
    ModelSizeError
        M, or C on what has no mass, connects more than 1000 coordinates.
    """
    unit = as_sparse(sparse_unit(len(model.dofs)))
    every = np.ones(len(model.dofs), dtype=bool)
    span, massless, first = _null_split("M", as_sparse(model.M), _Span(unit, unit), every, model.dofs, tol, widest)
    drag = cancelled(as_sparse(model.C), span.columns, span.sizes)
    span, static, second = _null_split("C", drag, span, massless, model.dofs, tol, widest)
    kinds = np.where(static, STATIC, np.where(massless, HALF, INERTIAL)).astype(np.int8)
    return SparsePartition(
        method="orthogonal",
        dofs=model.dofs,
        kinds=read_only(kinds),
        columns=span.columns,
        sizes=span.sizes,
        evidence=(*first, *second),
    )


def _null_split(
    letter: Literal["M", "C"],
    product: SparseMatrix,
    span: _Span,
    which: Mask,
    dofs: tuple[str, ...],
    tol: float | None,
    widest: float,
) -> tuple[_Span, Mask, list[RankDecision]]:
    """Split the columns of a span that `which` picks into a part where `product` has full rank and its null space.

    The null space is the second mask.
    """
    filled = which & (np.diff(product.indptr) > 0)
    null = which & ~filled
    mixtures: list[_Mixture] = []
    evidence: list[RankDecision] = []
    for block in linked_columns(product, np.flatnonzero(filled)):
        if block.size > LARGEST_MIXED:
            raise _block_error(letter, block, dofs)
        rows, own, sizes = _dense_block(span, block)
        linked = product[:, block]
        split = split_block(np.asarray(linked[np.unique(linked.indices)].toarray()), tol)
        evidence.append(RankDecision.of(letter, tuple([dofs[index] for index in rows.tolist()]), split))
        if split.rank == block.size and split.spread <= widest:
            continue
        mixed, size = split.mixed(own, sizes)
        lengths = lengths_of_columns(mixed)
        mixtures.append(_Mixture(rows, block, mixed / lengths, size / np.abs(lengths)))
        null[block[split.rank :]] = True
    return span.replaced(mixtures), null, evidence


def _dense_block(span: _Span, block: IndexArray) -> tuple[IndexArray, FloatArray, FloatArray]:
    """Return the rows in which some columns of a span have entries, and these entries and their sizes, dense."""
    columns, sizes = span.columns[:, block], span.sizes[:, block]
    rows = np.unique(columns.indices).astype(np.intp)
    return rows, np.asarray(columns[rows].toarray()), np.asarray(sizes[rows].toarray())


def _with_columns(
    matrix: SparseMatrix, kept: Mask, others: list[tuple[IndexArray, IndexArray, FloatArray]]
) -> SparseMatrix:
    """Keep some columns of a matrix and put dense blocks in the place of the others."""
    column = column_of_entries(matrix)
    stay = kept[column]
    data, row, place = [matrix.data[stay]], [matrix.indices[stay]], [column[stay]]
    for rows, block, values in others:
        data.append(values.ravel())
        row.append(np.repeat(rows, block.size))
        place.append(np.tile(block, rows.size))
    entries: Any = (np.concatenate(data), (np.concatenate(row), np.concatenate(place)))
    whole = csc_array(coo_array(entries, shape=matrix.shape))
    whole.eliminate_zeros()
    return whole


def _block_error(letter: str, block: IndexArray, dofs: tuple[str, ...]) -> ModelSizeError:
    names = listed([dofs[index] for index in block.tolist()])
    msg = (
        f"W is singular by null columns, and {letter} connects {block.size} DOFs ({names}): whether it has full rank "
        f"there can be decided for up to {LARGEST_MIXED} DOFs only. If it is a consistent mass, lump it, or take "
        "truncate_modes."
    )
    return ModelSizeError(msg, size=block.size, limit=LARGEST_MIXED)
