"""Split the DOFs of a sparse model: the bases T_i, T_c, T_k of equation (2a), read from the structure.

As in `partition`, with one difference: the columns of T stand in the order of the DOFs, each with its kind, so that
the matrices keep their pattern about the diagonal,

    W = M T E_i + C T E_c + K T E_k,

E_i, E_c, E_k picking the columns of a kind. By null columns T is the identity. Where the mass is rank deficient without
null columns, columns of T are mixed within the connected components of the pattern of M, then of C on what has no
mass, by one small singular value decomposition each. Derivation: docs/explanation/reduction.md.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
import scipy.linalg
from scipy.sparse import coo_array, csc_array
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import splu

from halfdof_ctrl.base.arrays import FloatArray, read_only
from halfdof_ctrl.base.errors import ModelSizeError
from halfdof_ctrl.model.second_order import SecondOrderModel, null_column_kinds
from halfdof_ctrl.base.names import listed, motion_names
from halfdof_ctrl.reduction.dense.partition import (
    CANCELLATION,
    RANK_TOLERANCE,
    IndexArray,
    RankDecision,
    lengths_of_columns,
    mixture_names,
    slowest_speed,
    spread_is_wide,
    warn_of_tiny_masses,
)
from halfdof_ctrl.reduction.algebra.scaling import evening_logs, unit_free_factors
from halfdof_ctrl.base.sparse_arrays import SparseMatrix, as_sparse, column_of_entries, largest_by_row_and_column, sparse_unit
from halfdof_ctrl.reduction.algebra.sparse_lu import scaled_matrix, sparse_levelling_factors

Mask = npt.NDArray[np.bool_]

INERTIAL, HALF, STATIC = 0, 1, 2  #: kinds of columns
LARGEST_BLOCK = 1000  #: columns of a connected part of M or C whose rank is decided by a singular value decomposition
SETTLED = 1e-8  #: accuracy of the scaling in which masses are compared, squared residual over the first one
LARGEST_GLANCE = 100  #: the same before W is factorized
LARGEST_BASIS = 5000  #: DOFs up to which T is given as a dense matrix


@dataclass(frozen=True, eq=False, kw_only=True)
class SparsePartition:
    """Coordinates p = (p_i, p_c, p_k) of q = T p for a sparse model of n DOFs."""

    method: Literal["selection", "orthogonal"]
    dofs: tuple[str, ...]  #: names of the n DOFs
    kinds: npt.NDArray[np.int8]  #: (n,) kind of each column of `columns`: inertial, half, static
    columns: SparseMatrix | None  #: (n, n) T with its columns in the order of the DOFs; None for the identity
    sizes: SparseMatrix | None  #: (n, n) what the rounding errors of these entries are relative to; None if exact
    evidence: tuple[RankDecision, ...]  #: what the orthonormal bases rest on

    @cached_property
    def order(self) -> IndexArray:
        """(n,) positions of the coordinates in the order inertial, half, static."""
        return np.argsort(self.kinds, kind="stable")

    @property
    def n_inertial(self) -> int:
        """Number of coordinates with mass."""
        return int(np.count_nonzero(self.kinds == INERTIAL))

    @property
    def n_half(self) -> int:
        """Number of damped coordinates without mass."""
        return int(np.count_nonzero(self.kinds == HALF))

    @property
    def n_static(self) -> int:
        """Number of coordinates with neither."""
        return int(np.count_nonzero(self.kinds == STATIC))

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of p: DOFs, or mix0, mix1, ... for combinations."""
        return self._names(self.order) if self.columns is None else self._mixed_names

    @property
    def inertial(self) -> tuple[str, ...]:
        """Names of the coordinates with mass, p_i."""
        return self._some(0, self.n_inertial)

    @property
    def half(self) -> tuple[str, ...]:
        """Names of the damped coordinates without mass, p_c."""
        return self._some(self.n_inertial, self.n_inertial + self.n_half)

    @property
    def static(self) -> tuple[str, ...]:
        """Names of the coordinates with neither, p_k."""
        return self._some(self.n_inertial + self.n_half, len(self.dofs))

    def _some(self, first: int, stop: int) -> tuple[str, ...]:
        """Give names without making those of all coordinates, where they are DOFs."""
        if self.columns is not None:
            return self._mixed_names[first:stop]
        return self._names(self.order[first:stop])

    def _names(self, places: IndexArray) -> tuple[str, ...]:
        return tuple([self.dofs[place] for place in places.tolist()])

    @cached_property
    def _unit_columns(self) -> Mask:
        """(n,) which columns of T are those of the identity."""
        columns = as_sparse(sparse_unit(len(self.dofs))) if self.columns is None else self.columns
        single = np.diff(columns.indptr) == 1
        first = np.minimum(columns.indptr[:-1], columns.nnz - 1)
        return np.asarray(single & (columns.indices[first] == np.arange(single.size)) & (columns.data[first] == 1.0))

    @cached_property
    def _mixed_names(self) -> tuple[str, ...]:
        columns = as_sparse(sparse_unit(len(self.dofs))) if self.columns is None else self.columns
        single = (np.diff(columns.indptr) == 1) & (columns.max(axis=0).toarray().ravel() == 1.0)
        selected = [int(columns.indices[columns.indptr[j]]) if single[j] else None for j in self.order.tolist()]
        return mixture_names(selected, self.dofs)

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the states: inertial and half displacements, then inertial velocities."""
        return (*self.inertial, *self.half, *motion_names(self.inertial, 1))

    def kinds_of(self, dofs: tuple[str, ...]) -> dict[str, str]:
        """Tell for each of the model's DOFs that is not wholly inertial whether it is half or static."""
        columns = as_sparse(sparse_unit(len(dofs))) if self.columns is None else self.columns
        kinds = self.kinds[column_of_entries(columns)]
        half, static = (set(columns.indices[kinds == kind].tolist()) for kind in (HALF, STATIC))
        return {dofs[i]: "half" if i in half else "static" for i in sorted(half | static)}

    def state_of(self, displacements: FloatArray, velocities: FloatArray) -> FloatArray:
        """Give the states that belong to displacements and velocities of all n DOFs."""
        p = self.to_coordinates(displacements[:, None])[: self.n_inertial + self.n_half, 0]
        return np.concatenate([p, self.to_coordinates(velocities[:, None])[: self.n_inertial, 0]])

    @property
    def T(self) -> FloatArray:  # noqa: N802
        """(n, n) transformation q = T p, its columns in the order inertial, half, static; dense, of small models."""
        n = len(self.dofs)
        if n > LARGEST_BASIS:
            msg = (
                f"T of {n} DOFs would take {8e-9 * n**2:.3g} GB as a dense matrix. `columns` has it sparse, and "
                "`order` the order of its columns."
            )
            raise ModelSizeError(msg, size=n, limit=LARGEST_BASIS)
        columns = as_sparse(sparse_unit(n)) if self.columns is None else self.columns
        return np.asarray(columns.toarray()[:, self.order])

    def of_kind(self, kind: int) -> IndexArray:
        """Give the positions of the coordinates of one kind."""
        return np.flatnonzero(self.kinds == kind)

    def mapped(self, matrix: SparseMatrix, which: IndexArray | None = None) -> SparseMatrix:
        """Give ``matrix T``, for n columns, or those of its columns that `which` picks.

        Entries that are rounding of a sum whose terms cancel are zero. Only the columns of T that are mixed are
        multiplied: the others leave those of the matrix as they are.
        """
        product = matrix if which is None else csc_array(matrix[:, which])
        if self.columns is None or self.sizes is None:
            return product
        places = np.arange(len(self.dofs)) if which is None else which
        mixed = np.flatnonzero(~self._unit_columns[places])
        if mixed.size == 0:
            return product
        own = cancelled(matrix, self.columns[:, places[mixed]], self.sizes[:, places[mixed]])
        lengths = np.zeros(places.size, dtype=own.indptr.dtype)
        lengths[mixed] = np.diff(own.indptr)
        starts = np.concatenate([own.indptr[:1], np.cumsum(lengths, dtype=own.indptr.dtype)])
        kept = csc_array(product, copy=True)
        kept.data[~self._unit_columns[places][column_of_entries(kept)]] = 0.0
        kept.eliminate_zeros()
        return csc_array(kept + csc_array((own.data, own.indices, starts), shape=kept.shape))

    def to_coordinates(self, displacements: FloatArray) -> FloatArray:
        """Give ``p = T^-1 q`` for an (n, k) array."""
        if self.columns is None:
            return np.asarray(displacements[self.order])
        return np.asarray(splu(self.columns).solve(displacements)[self.order])


def select_sparse_columns(model: SecondOrderModel, tol: float | None = None) -> SparsePartition:
    """Split the DOFs of a sparse model by the null columns of M and C, as `partition.select_columns` does.

    Warns
    -----
    NearlyMasslessWarning
        A mass is not zero but below 1e-10 of the others in scaled units.
    """
    inertial, half = null_column_kinds(model.M, model.C)
    if tol is not None or spread_is_wide(model, inertial):
        ratio = _mass_ratios(model)
        inertial &= ratio > (0.0 if tol is None else tol)
        warn_of_tiny_masses(ratio, inertial, model.dofs)
        half = (np.diff(as_sparse(model.C).indptr) > 0) & ~inertial
    kinds = np.where(inertial, INERTIAL, np.where(half, HALF, STATIC)).astype(np.int8)
    return SparsePartition(
        method="selection", dofs=model.dofs, kinds=read_only(kinds), columns=None, sizes=None, evidence=()
    )


def has_dependent_columns(model: SecondOrderModel, partition: SparsePartition) -> bool:
    """Tell whether W by null columns is singular for sure, since columns of M or C in a small connected part depend.

    Dampers and masses that act along slanted directions are of this kind. Seen here, it saves a factorization.
    """
    for matrix, kind in ((model.M, INERTIAL), (model.C, HALF)):
        part = as_sparse(matrix)
        for block in _linked_columns(part, partition.of_kind(kind)):
            if block.size <= LARGEST_GLANCE:
                linked = part[:, block]
                dense = np.asarray(linked[np.unique(linked.indices)].toarray())
                rows, columns = unit_free_factors(dense)
                values = scipy.linalg.svd(dense * rows[:, None] * columns, compute_uv=False)
                if values.size < block.size or values[-1] <= np.finfo(float).eps * values[0]:
                    return True
    return False


def sparse_bases(model: SecondOrderModel, tol: float | None = None) -> SparsePartition:
    """Split the motion of a sparse model into null(M) with null(C), the rest of null(M), and what is left.

    As `partition.orthonormal_bases` does.

    Raises
    ------
    ModelSizeError
        M, or C on what has no mass, connects more than 1000 coordinates.
    """
    unit = as_sparse(sparse_unit(len(model.dofs)))
    every = np.ones(len(model.dofs), dtype=bool)
    span, massless, first = _null_split("M", as_sparse(model.M), _Span(unit, unit), every, model.dofs, tol)
    drag = cancelled(as_sparse(model.C), span.columns, span.sizes)
    span, static, second = _null_split("C", drag, span, massless, model.dofs, tol)
    kinds = np.where(static, STATIC, np.where(massless, HALF, INERTIAL)).astype(np.int8)
    return SparsePartition(
        method="orthogonal",
        dofs=model.dofs,
        kinds=read_only(kinds),
        columns=span.columns,
        sizes=span.sizes,
        evidence=(*first, *second),
    )


def cancelled(matrix: SparseMatrix, columns: SparseMatrix, sizes: SparseMatrix) -> SparseMatrix:
    """Multiply, and set entries to zero that are rounding of a sum whose terms cancel."""
    product = csc_array(matrix @ columns)
    product.eliminate_zeros()
    product.sort_indices()
    present = csc_array((np.ones(product.nnz), product.indices, product.indptr), shape=product.shape)
    terms = int(np.bincount(matrix.indices, minlength=1).max()) if matrix.nnz else 1
    noise = csc_array((abs(matrix) @ sizes).multiply(present))
    noise.sort_indices()
    product.data[np.abs(product.data) <= CANCELLATION * terms * noise.data] = 0.0
    product.eliminate_zeros()
    return product


def _mass_ratios(model: SecondOrderModel) -> FloatArray:
    """Give each DOF's mass relative to the largest, free of units, as `partition.mass_ratios` does."""
    M, C, K = (abs(as_sparse(matrix)) for matrix in (model.M, model.C, model.K))
    gamma = slowest_speed(model)
    total = csc_array(K + gamma * C + gamma**2 * M)
    rows, columns = [np.exp2(logs) for logs in evening_logs(total, settled=SETTLED)]
    down, across = sparse_levelling_factors(scaled_matrix(total, rows, columns))
    _, mass = largest_by_row_and_column(scaled_matrix(csc_array(M), down * rows, across * columns))
    return np.asarray(mass / mass.max() if mass.max() > 0.0 else mass)


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


def _null_split(
    letter: Literal["M", "C"],
    product: SparseMatrix,
    span: _Span,
    which: Mask,
    dofs: tuple[str, ...],
    tol: float | None,
) -> tuple[_Span, Mask, list[RankDecision]]:
    """Split the columns of a span that `which` picks into a part where `product` has full rank and its null space.

    The null space is the second mask. See `partition._null_split` for what is known to which rounding.
    """
    filled = which & (np.diff(product.indptr) > 0)
    null = which & ~filled
    mixtures: list[_Mixture] = []
    evidence: list[RankDecision] = []
    for block in _linked_columns(product, np.flatnonzero(filled)):
        if block.size > LARGEST_BLOCK:
            raise _block_error(letter, block, dofs)
        own_rows, own, own_sizes = _dense_block(span, block)
        linked = product[:, block]
        part = np.asarray(linked[np.unique(linked.indices)].toarray())
        row_factors, factors = unit_free_factors(part)
        _, values, right = scipy.linalg.svd(part * row_factors[:, None] * factors)
        bound = max(part.shape) * RANK_TOLERANCE if tol is None else tol
        rank = int(np.count_nonzero(values > bound * values[0]))
        concerned = tuple([dofs[index] for index in own_rows.tolist()])
        evidence.append(
            RankDecision(
                matrix=letter, dofs=concerned, singular_values=values, rank=rank, bound=float(bound * values[0])
            )
        )
        if rank == block.size:
            continue
        spread = values[0] / values[rank - 1]
        speck = 4 * max(part.shape) * np.finfo(float).eps * spread
        clean = np.where(np.abs(right.T) <= speck, 0.0, right.T)
        size = (own_sizes @ (factors[:, None] * np.ones_like(clean))).max(axis=1, keepdims=True) * spread
        mixed = own @ (factors[:, None] * clean)
        lengths = lengths_of_columns(mixed)
        mixtures.append(_Mixture(own_rows, block, mixed / lengths, size / np.abs(lengths)))
        null[block[rank:]] = True
    return span.replaced(mixtures), null, evidence


def _linked_columns(product: SparseMatrix, which: IndexArray) -> list[IndexArray]:
    """Group columns that share nonzero rows, directly or through others; columns that share none are left out."""
    if which.size == 0:
        return []
    rows = product.shape[0]
    part = product[:, which]
    links = coo_array(
        (np.ones(part.nnz, dtype=np.int8), (part.indices, rows + column_of_entries(part))),
        shape=(rows + which.size, rows + which.size),
    )
    _, label = connected_components(links, directed=False)
    group = label[rows:]
    shared = np.flatnonzero(np.bincount(group)[group] > 1)
    order = shared[np.argsort(group[shared], kind="stable")]
    starts = np.flatnonzero(np.diff(group[order])) + 1
    return [which[members] for members in np.split(order, starts) if members.size]


def _dense_block(span: _Span, block: IndexArray) -> tuple[IndexArray, FloatArray, FloatArray]:
    """Give the rows in which some columns of a span have entries, and these entries and their sizes, dense."""
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
        f"there can be decided for up to {LARGEST_BLOCK} DOFs only. If it is a consistent mass, lump it, or take "
        "truncate_modes."
    )
    return ModelSizeError(msg, size=block.size, limit=LARGEST_BLOCK)
