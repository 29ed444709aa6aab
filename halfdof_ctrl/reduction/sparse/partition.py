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
from typing import Literal

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array, csc_array
from scipy.sparse.csgraph import connected_components

from halfdof_ctrl.base.arrays import FloatArray, IndexArray
from halfdof_ctrl.base.errors import ModelSizeError
from halfdof_ctrl.base.names import motion_names
from halfdof_ctrl.base.sparse_arrays import SparseMatrix, as_sparse, column_of_entries, sparse_unit
from halfdof_ctrl.base.sparse_factors import sparse_lu
from halfdof_ctrl.reduction.algebra.blocks import CANCELLATION, mixture_names
from halfdof_ctrl.reduction.method.evidence import LightMasses, RankDecision

Mask = npt.NDArray[np.bool_]
INERTIAL, HALF, STATIC = 0, 1, 2  #: kinds of columns
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
    light: LightMasses | None = None  #: inertial DOFs whose mass hardly counts

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
        """Return names without making those of all coordinates, where they are DOFs."""
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
        """Return the states that belong to displacements and velocities of all n DOFs."""
        p = self.to_coordinates(displacements[:, None])[: self.n_inertial + self.n_half, 0]
        return np.concatenate([p, self.to_coordinates(velocities[:, None])[: self.n_inertial, 0]])

    def state_maps(self) -> tuple[FloatArray, FloatArray]:
        """Return L_q and L_v, (N, n) each, of x = L_q q + L_v q'; dense, of small models."""
        moving, n_i = self.n_inertial + self.n_half, self.n_inertial
        self._require_small("L_q and L_v")
        to_coordinates = self.to_coordinates(np.eye(len(self.dofs)))
        from_q, from_v = np.zeros((2, moving + n_i, len(self.dofs)))
        from_q[:moving], from_v[moving:] = to_coordinates[:moving], to_coordinates[:n_i]
        return from_q, from_v

    @property
    def T(self) -> FloatArray:  # noqa: N802
        """(n, n) transformation q = T p, its columns in the order inertial, half, static; dense, of small models."""
        self._require_small("T")
        columns = as_sparse(sparse_unit(len(self.dofs))) if self.columns is None else self.columns
        return np.asarray(columns.toarray()[:, self.order])

    def _require_small(self, what: str) -> None:
        n = len(self.dofs)
        if n > LARGEST_BASIS:
            msg = (
                f"{what} of {n} DOFs would take {8e-9 * n**2:.3g} GB as a dense matrix. `columns` has T sparse, and "
                "`order` the order of its columns."
            )
            raise ModelSizeError(msg, size=n, limit=LARGEST_BASIS)

    def of_kind(self, kind: int) -> IndexArray:
        """Return the positions of the coordinates of one kind."""
        return np.flatnonzero(self.kinds == kind)

    def mapped(self, matrix: SparseMatrix, which: IndexArray | None = None) -> SparseMatrix:
        """Return ``matrix T``, for n columns, or those of its columns that `which` picks.

        Entries that are rounding of a sum whose terms cancel are zero; T is what it is here, however well it is known.
        Only the columns of T that are mixed are multiplied: the others leave those of the matrix as they are.
        """
        product = matrix if which is None else csc_array(matrix[:, which])
        if self.columns is None or self.sizes is None:
            return product
        places = np.arange(len(self.dofs)) if which is None else which
        mixed = np.flatnonzero(~self._unit_columns[places])
        if mixed.size == 0:
            return product
        columns = self.columns[:, places[mixed]]
        own = cancelled(matrix, columns, abs(columns))
        lengths = np.zeros(places.size, dtype=own.indptr.dtype)
        lengths[mixed] = np.diff(own.indptr)
        starts = np.concatenate([own.indptr[:1], np.cumsum(lengths, dtype=own.indptr.dtype)])
        kept = csc_array(product, copy=True)
        kept.data[~self._unit_columns[places][column_of_entries(kept)]] = 0.0
        kept.eliminate_zeros()
        return csc_array(kept + csc_array((own.data, own.indices, starts), shape=kept.shape))

    def to_coordinates(self, displacements: FloatArray) -> FloatArray:
        """Return ``p = T^-1 q`` for an (n, k) array."""
        if self.columns is None:
            return np.asarray(displacements[self.order])
        return np.asarray(sparse_lu(self.columns).solve(displacements)[self.order])


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


def linked_columns(product: SparseMatrix, which: IndexArray) -> list[IndexArray]:
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
