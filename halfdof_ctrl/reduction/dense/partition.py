"""Split the DOFs into inertial, half and static ones: the bases T_i, T_c, T_k of equation (2).

    q = T_i p_i + T_c p_c + T_k p_k,    M [T_c T_k] = 0,    C T_k = 0                    (2a)
    W = [ M T_i   C T_c   K T_k ]                                                          (2)

`select_columns` takes T as a selection of the DOFs: null columns of M are half or static, of these the
null columns of C static (Simionatto and others, section 2). `orthonormal_bases` serves models whose mass
is rank deficient without null columns: null(M) and null(M) with null(C) are found block by block, in the
connected components of the pattern of M and then of C, on equilibrated blocks. Every coordinate that
needs no mixing stays the DOF that it was. Derivation: docs/explanation/reduction.md.
"""

import warnings
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Literal, TypeAlias

import numpy as np
import numpy.typing as npt
import scipy.linalg
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from halfdof_ctrl.base.arrays import FloatArray, Matrix, read_only, unit_matrix
from halfdof_ctrl.base.errors import NearlyMasslessWarning, callers_level
from halfdof_ctrl.model.second_order import SecondOrderModel, null_column_kinds
from halfdof_ctrl.base.names import listed, motion_names
from halfdof_ctrl.reduction.algebra.scaling import gap_threshold, levelling_factors, logarithmic_scaling, time_log, unit_free_factors

IndexArray: TypeAlias = npt.NDArray[np.intp]

RANK_TOLERANCE = 16 * np.finfo(float).eps  #: times the block's size; singular values below are null
UNCLEAR = 1e3  #: singular values above that and below this times it are split at the widest gap
CANCELLATION = 16 * np.finfo(float).eps  #: times n: entries of C T and the like below this part of their terms are zero
NEARLY_MASSLESS = 1e-10  #: scaled mass of a DOF over the largest one, below which a warning is given
PLAIN_SPREAD = 1e5  #: of stiffness over mass between the DOFs; a smaller one needs no closer look


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class RankDecision:
    """The singular values by which one block of a matrix was split or found nonsingular."""

    matrix: Literal["M", "C", "W", "J"]  #: whose block; W of equation (2), J of equation (16)
    dofs: tuple[str, ...]  #: the DOFs of the block
    singular_values: FloatArray  #: of the scaled block, falling
    rank: int  #: how many of them count
    bound: float  #: those up to this one count as zero

    @property
    def gap(self) -> float:
        """Smallest singular value that counts over the largest that does not, or over the bound where all count.

        inf where the others are exactly zero or none counts.
        """
        values = self.singular_values
        if self.rank == 0:
            return float("inf")
        below = self.bound if self.rank == values.size else float(values[self.rank])
        return float(values[self.rank - 1]) / below if below > 0.0 else float("inf")


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
        """Give the states that belong to displacements and velocities of all n DOFs."""
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

    def times_basis(self, matrix: Matrix, first: int, stop: int | None) -> FloatArray:
        """Give the columns from `first` to before `stop` of ``matrix T``, for a matrix with n columns.

        Entries that are rounding of a sum whose terms cancel are zero.
        """
        if self.in_order:
            return matrix[:, first:stop]
        if self.basis is None or self.sizes is None:
            return np.asarray(matrix[:, self.order[first:stop]])
        return cancelled(matrix, self.basis[:, first:stop], self.sizes[:, first:stop])

    def to_coordinates(self, displacements: FloatArray) -> FloatArray:
        """Give ``p = T^-1 q`` for an (n, k) array."""
        if self.basis is None:
            return np.asarray(displacements[self.order])
        return np.asarray(np.linalg.solve(self.basis, displacements), dtype=np.float64)


def select_columns(model: SecondOrderModel, tol: float | None = None) -> DofPartition:
    """Split the DOFs by the null columns of M and C.

    Parameters
    ----------
    model : SecondOrderModel
        A real model.
    tol : float, optional
        A column of M counts as null where its scaled size is at most `tol` times the largest one. By
        default only exact zeros count. The scale is unit-free: see `mass_ratios`.

    Warns
    -----
    NearlyMasslessWarning
        A mass is not zero but below 1e-10 of the others in scaled units.
    """
    inertial, half = null_column_kinds(model.M, model.C)
    if tol is not None or spread_is_wide(model, inertial):
        inertial, half = _without_tiny_masses(model, inertial, 0.0 if tol is None else tol)
    return _selection(tuple(inertial.tolist()), tuple(half.tolist()), model.dofs)


@lru_cache(maxsize=32)
def _selection(massive: tuple[bool, ...], damped: tuple[bool, ...], dofs: tuple[str, ...]) -> DofPartition:
    every = range(len(massive))
    with_mass, with_damping = [i for i in every if massive[i]], [i for i in every if damped[i]]
    order = [*with_mass, *with_damping, *[i for i in every if not (massive[i] or damped[i])]]
    return DofPartition(
        method="selection",
        order=read_only(np.array(order)),
        basis=None,
        sizes=None,
        in_order=order == list(every),
        n_inertial=len(with_mass),
        n_half=len(with_damping),
        n_static=len(order) - len(with_mass) - len(with_damping),
        coordinates=tuple([dofs[i] for i in order]),
        evidence=(),
    )


def mass_ratios(model: SecondOrderModel) -> FloatArray:
    """Give each DOF's mass relative to the largest, free of units.

    At the slowest DOF's own frequency g the rows and columns of ``|K| + g |C| + g^2 |M|`` are scaled, first by the
    means of the logarithms of their entries and then until their largest entries are one; the ratio is between the
    largest entries of the columns of the scaled M. So it compares a DOF's inertia with what else acts on it, at the
    time scale of the heavy DOFs.

    Notes
    -----
    A light DOF and a slow one beside ordinary ones are the same model in other units: masses of 1 and 1e-13 kg on
    springs of 1 N/m are masses of 1 kg on springs of 1 and 1e13 N/m, with the second DOF in other units. So equal
    numbers in M can have any ratio: what is small is the share of the inertia in the equation of motion.
    """
    M, C, K = (np.abs(matrix) for matrix in (model.M, model.C, model.K))
    gamma = slowest_speed(model)
    rows, columns = unit_free_factors(K + gamma * C + gamma**2 * M)
    mass = (M * rows[:, None] * columns).max(axis=0)
    return np.asarray(mass / mass.max() if mass.max() > 0.0 else mass)


def without_light_masses(model: SecondOrderModel, tol: float) -> SecondOrderModel:
    """Take the mass from the DOFs whose `mass_ratios` are at most `tol`."""
    light = model.M.any(axis=0) & (mass_ratios(model) <= tol)
    return replace(model, M=read_only(np.where(light, 0.0, model.M))) if light.any() else model


def own_speeds(model: SecondOrderModel) -> FloatArray:
    """Give max(K_jj / M_jj, (C_jj / M_jj)^2) of the DOFs with M_jj, zero for others: the same in any unit of them."""
    mass, drag, stiffness = (np.abs(matrix.diagonal()) for matrix in (model.M, model.C, model.K))
    with_mass = np.where(mass > 0.0, mass, np.inf)
    return np.asarray(np.maximum(stiffness / with_mass, (drag / with_mass) ** 2))


def slowest_speed(model: SecondOrderModel) -> float:
    """Give the own frequency of the slowest DOF, or a mean frequency of the entries where no DOF has one by itself."""
    speeds = own_speeds(model)
    if (speeds > 0.0).any():
        return float(np.sqrt(speeds[speeds > 0.0].min()))
    return float(np.exp2(time_log([model.K, model.C, model.M])))


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


def spread_is_wide(model: SecondOrderModel, inertial: npt.NDArray[np.bool_]) -> bool:
    """Tell cheaply whether some mass might be tiny against the others in some unit."""
    if len(inertial) == 1 or np.count_nonzero(inertial) <= 1:
        return False
    speeds = own_speeds(model)[inertial]
    return bool(speeds.max() > PLAIN_SPREAD * speeds.min())


def _without_tiny_masses(
    model: SecondOrderModel, inertial: npt.NDArray[np.bool_], tol: float
) -> tuple[npt.NDArray[np.bool_], npt.NDArray[np.bool_]]:
    """Take masses up to `tol` as none, and warn of those that are tiny and stay."""
    ratio = mass_ratios(model)
    inertial = inertial & (ratio > tol)
    warn_of_tiny_masses(ratio, inertial, model.dofs)
    return inertial, model.C.any(axis=0) & ~inertial


def warn_of_tiny_masses(ratio: FloatArray, inertial: npt.NDArray[np.bool_], dofs: tuple[str, ...]) -> None:
    """Warn of DOFs whose mass is not zero but below 1e-10 of the largest, in the units of `mass_ratios`."""
    tiny = np.flatnonzero(inertial & (ratio < NEARLY_MASSLESS))
    if tiny.size:
        names = [dofs[index] for index in tiny.tolist()]
        largest = float(ratio[tiny].max())
        msg = (
            f"DOFs {listed(names)} have a mass of at most {largest:.1e} of the largest (in scaled units), but not "
            "zero: their two states are far faster than the others and cost digits. If they are meant to be "
            f"massless, set their mass to zero or pass tol={2.0 * largest:.0e}."
        )
        warnings.warn(msg, NearlyMasslessWarning, stacklevel=callers_level())


@dataclass(frozen=True, slots=True, eq=False)
class _Span:
    columns: FloatArray  #: (n, d) basis
    sizes: FloatArray  #: (n, d) what the rounding errors of its entries are relative to

    def part(self, which: IndexArray) -> "_Span":
        return _Span(self.columns[:, which], self.sizes[:, which])


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


def lengths_of_columns(basis: FloatArray) -> FloatArray:
    """Give what columns of T are divided by, so that one that selects a DOF is that, and others are about one.

    The single entry of a column, or a power of two near the largest of several.
    """
    size = np.abs(basis)
    places = size.argmax(axis=0)
    single = np.count_nonzero(basis, axis=0) == 1
    every = np.arange(basis.shape[1])
    return np.asarray(np.where(single, basis[places, every], np.exp2(np.ceil(np.log2(size[places, every])))))


def _joined(spans: list[_Span]) -> _Span:
    return _Span(np.hstack([span.columns for span in spans]), np.hstack([span.sizes for span in spans]))


def connected_columns(product: FloatArray) -> list[IndexArray]:
    """Group the columns that share nonzero rows, directly or through others."""
    rows, columns = product.shape
    i, j = np.nonzero(product)
    links = csr_array((np.ones(i.size), (i, rows + j)), shape=(rows + columns, rows + columns))
    _, label = connected_components(links, directed=False)
    groups: dict[int, list[int]] = {}
    for column, group in enumerate(label[rows:].tolist()):
        groups.setdefault(group, []).append(column)
    return [np.array(group) for group in groups.values()]


def cancelled(matrix: FloatArray, columns: FloatArray, sizes: FloatArray) -> FloatArray:
    """Multiply, and set entries to zero that are rounding of a sum whose terms cancel."""
    product = matrix @ columns
    noise = CANCELLATION * len(matrix) * (np.abs(matrix) @ sizes)
    return np.where(np.abs(product) <= noise, 0.0, product)


def _coordinate_names(basis: FloatArray, dofs: tuple[str, ...]) -> tuple[str, ...]:
    """Name the columns of T."""
    selected: list[int | None] = []
    for column in basis.T:
        entries = np.flatnonzero(column)
        selected.append(int(entries[0]) if entries.size == 1 and column[entries[0]] == 1.0 else None)
    return mixture_names(selected, dofs)


def mixture_names(selected: list[int | None], dofs: tuple[str, ...]) -> tuple[str, ...]:
    """Name a column of T by the DOF that it selects, else mix0, mix1, ... (clear of the DOFs' names)."""
    prefix = "mix"
    while any(dof.startswith(prefix) for dof in dofs):
        prefix += "_"
    names: list[str] = []
    mixtures = 0
    for place in selected:
        if place is None:
            names.append(f"{prefix}{mixtures}")
            mixtures += 1
        else:
            names.append(dofs[place])
    return tuple(names)
