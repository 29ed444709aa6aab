"""Coordinates of a dense model: the bases T_i, T_c, T_k of equation (2).

    q = T_i p_i + T_c p_c + T_k p_k,    M [T_c T_k] = 0,    C T_k = 0                    (2a)
    W = [ M T_i   C T_c   K T_k ]                                                          (2)

They are made by `selection.select_columns` or by `bases.orthonormal_bases`.
"""

from dataclasses import dataclass
from typing import Literal, TypeVar

import numpy as np

from halfdof_ctrl.base.arrays import ComplexArray, DenseMatrix, FloatArray, IndexArray, unit_matrix
from halfdof_ctrl.base.names import motion_names
from halfdof_ctrl.reduction.algebra.blocks import cancelled
from halfdof_ctrl.reduction.method.evidence import LightMasses, RankDecision

Numbers = TypeVar("Numbers", FloatArray, ComplexArray)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class DofPartition:
    """Coordinates p = (p_i, p_c, p_k) of q = T p, equation (2a), for n DOFs."""

    method: Literal["selection", "orthogonal"]
    order: IndexArray  #: (n,) selection: the DOFs in the order inertial, half, static
    basis: FloatArray | None  #: (n, n) T, or None where T is the selection by `order`
    sizes: FloatArray | None  #: (n, n) what the rounding errors of the entries of T are relative to; None if exact
    in_order: bool  #: selection that leaves the DOFs in their order
    n_inertial: int
    n_half: int
    n_static: int
    coordinates: tuple[str, ...]  #: names of p: DOFs, or mix0, mix1, ... for combinations
    evidence: tuple[RankDecision, ...]  #: what the orthonormal bases rest on
    light: LightMasses | None = None  #: inertial DOFs whose mass hardly counts

    @property
    def inertial(self) -> tuple[str, ...]:
        """Names of the coordinates with mass, p_i."""
        return self.coordinates[: self.n_inertial]

    @property
    def half(self) -> tuple[str, ...]:
        """Names of the damped coordinates without mass, p_c."""
        return self.coordinates[self.n_inertial : self.n_inertial + self.n_half]

    @property
    def static(self) -> tuple[str, ...]:
        """Names of the coordinates with neither, p_k."""
        return self.coordinates[self.n_inertial + self.n_half :]

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the states: inertial and half displacements, then inertial velocities."""
        return (*self.inertial, *self.half, *motion_names(self.inertial, 1))

    def kinds_of(self, dofs: tuple[str, ...]) -> dict[str, str]:
        """Tell for each of the model's DOFs that is not wholly inertial whether it is half or static."""
        moving = self.n_inertial + self.n_half
        return {
            dof: "half" if row[self.n_inertial : moving].any() else "static"
            for dof, row in zip(dofs, self.T, strict=True)
            if row[self.n_inertial :].any()
        }

    def state_of(self, displacements: FloatArray, velocities: FloatArray) -> FloatArray:
        """Return the states that belong to displacements and velocities of all n DOFs."""
        from_q, from_v = self.state_maps()
        return np.asarray(from_q @ displacements + from_v @ velocities)

    def state_maps(self) -> tuple[FloatArray, FloatArray]:
        """Give L_q and L_v, (N, n) each, of x = L_q q + L_v q'."""
        moving = self.n_inertial + self.n_half
        to_coordinates = self.to_coordinates(unit_matrix(self.order.size))
        from_q, from_v = np.zeros((2, moving + self.n_inertial, self.order.size))
        from_q[:moving] = to_coordinates[:moving]
        from_v[moving:] = to_coordinates[: self.n_inertial]
        return from_q, from_v

    @property
    def T(self) -> FloatArray:  # noqa: N802
        """(n, n) transformation q = T p, its columns in the order inertial, half, static."""
        if self.basis is not None:
            return self.basis
        unit = unit_matrix(self.order.size)
        return unit if self.in_order else np.asarray(unit[:, self.order])

    def times_basis(self, matrix: DenseMatrix, first: int, stop: int | None) -> FloatArray:
        """Return the columns from `first` to before `stop` of ``matrix T``, for a matrix with n columns.

        Entries that are rounding of a sum whose terms cancel are zero. How well T spans the null spaces is no matter
        here: (3) holds for the T that there is, and an entry that its null vectors leave is one of the model.
        """
        if self.in_order:
            return matrix[:, first:stop]
        if self.basis is None:
            return np.asarray(matrix[:, self.order[first:stop]])
        basis = self.basis[:, first:stop]
        return cancelled(matrix, basis, np.abs(basis))

    def from_static(self, static: Numbers) -> Numbers:
        """Return ``T_k p_k``, (n, k), for static coordinates p_k, (n_k, k)."""
        if self.basis is not None:
            return np.asarray(self.basis[:, self.n_inertial + self.n_half :] @ static)
        q = np.zeros((self.order.size, static.shape[1]), dtype=static.dtype)
        q[self._static] = static
        return q

    def add_static(self, moved: FloatArray, static: FloatArray) -> None:
        """Add ``T_k p_k`` in place to what other coordinates move, (n, k); in a selection that is nothing there."""
        if self.basis is not None:
            moved += self.basis[:, self.n_inertial + self.n_half :] @ static
        else:
            moved[self._static] = static

    @property
    def _static(self) -> IndexArray | slice:
        """The static DOFs of a selection."""
        first = self.n_inertial + self.n_half
        return slice(first, None) if self.in_order else self.order[first:]

    def to_coordinates(self, displacements: FloatArray) -> FloatArray:
        """Return ``p = T^-1 q`` for an (n, k) array."""
        if self.basis is None:
            return np.asarray(displacements[self.order])
        return np.asarray(np.linalg.solve(self.basis, displacements), dtype=np.float64)
