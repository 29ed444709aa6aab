"""Which DOFs are inertial, half and static: by the whole equation, elements included.

An element counts as if it had a generic tangent, ``C+ = C + sum c e e'`` and ``K+ = K + sum k e e'``; the partition of
(M, C+, K+) is that of the nonlinear model. That is the changed criterion of which the paper speaks, and it needs no
second classifier. Two draws of the tangents must decide alike. Derivation: docs/explanation/nonlinear.md.
"""

from collections.abc import Sequence

import numpy as np

from halfdof_ctrl.base.arrays import FloatArray
from halfdof_ctrl.base.errors import LawError, UncertainRankError
from halfdof_ctrl.base.names import listed
from halfdof_ctrl.model.kinds import null_column_kinds
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.nonlinear.geometry import Geometry, Place
from halfdof_ctrl.reduction.algebra.leading_matrix import LeadingMatrix
from halfdof_ctrl.reduction.choose import exact_reduction
from halfdof_ctrl.reduction.dense.bases import orthonormal_bases
from halfdof_ctrl.reduction.dense.partition import DofPartition
from halfdof_ctrl.reduction.dense.selection import select_columns
from halfdof_ctrl.reduction.dense.single_solve import leading_columns

POINT_SEEDS = (20, 21)  #: of the two draws of generic tangents
MOVING = 1e-12  #: a variable whose part on T_c or T_k is below this share of its largest is a state's


def generic_slopes(base: SecondOrderModel, geometry: Geometry, seed: int) -> list[FloatArray]:
    """Draw a tangent for every element, of the size of what else acts on its DOFs."""
    draw = np.random.default_rng(seed)
    stiff, damped = _sizes(base)
    slopes = []
    for place in geometry.places:
        rows = np.flatnonzero(geometry.E[:, place.forces].any(axis=1))
        by_q = geometry.L_q[place.arguments].any(axis=1)
        scale = np.where(by_q, stiff[rows].max(initial=0.0), damped[rows].max(initial=0.0))
        slopes.append(scale * draw.uniform(0.5, 1.5, (geometry.E[:, place.forces].shape[1], by_q.size)))
    return slopes


def partition_of(model: SecondOrderModel) -> DofPartition | None:
    """Return the partition with a nonsingular W that the reduction takes; None above index 1."""
    for split in (select_columns, orthonormal_bases):
        partition = split(model)
        if not LeadingMatrix.factorized(leading_columns(model, partition)).is_singular:
            return partition
    return None


def require_index_one(base: SecondOrderModel, geometry: Geometry) -> list[FloatArray]:
    """Return generic tangents by which two draws decide alike.

    Raises
    ------
    LawError
        The model is above index 1 whatever the laws' slopes are.
    UncertainRankError
        The two draws decide differently.
    SingularPencilError
        Nothing resists a motion whatever the slopes are.
    """
    draws = [generic_slopes(base, geometry, seed) for seed in POINT_SEEDS]
    found = [partition_of(geometry.with_slopes(base, slopes)) for slopes in draws]
    if found[0] is None or found[1] is None:
        raise _index_error(base, geometry, draws[0])
    kinds = [(part.method, part.states, part.static) for part in found if part is not None]
    if kinds[0] != kinds[1]:
        names = tuple(dict.fromkeys(name for place in geometry.places for name in place.dofs))
        msg = (
            f"Two draws of generic slopes of the elements on {listed(names)} give states {listed(kinds[0][1])} and "
            f"{listed(kinds[1][1])}: the order of the model rests on entries that nearly cancel. Look for them in C "
            "and K."
        )
        raise UncertainRankError(msg, dofs=names, gap=1.0)
    return draws[0]


def moving_places(geometry: Geometry, partition: DofPartition) -> list[bool]:
    """Tell for each element whether its variables are unknowns of equation (3) rather than states.

    An elongation is one if it has a part on static coordinates, a rate if it has one on half ones.
    """
    T, first, last = partition.T, partition.n_inertial, partition.n_inertial + partition.n_half
    return [
        bool(
            _has_part(geometry.L_q[place.arguments] @ T[:, last:], T[:, last:])
            or _has_part(geometry.L_v[place.arguments] @ T[:, first:], T[:, first:])
        )
        for place in geometry.places
    ]


def made_by_elements(base: SecondOrderModel, geometry: Geometry, partition: DofPartition) -> tuple[str, ...]:
    """Say of each DOF that the elements made what it is, by which ones and why: a line a DOF."""
    inertial, half = null_column_kinds(base.M, base.C)
    kinds = partition.kinds_of(base.dofs)
    lines = []
    for i, dof in enumerate(base.dofs):
        kind = kinds.get(dof)
        letter, held = ("C", bool(half[i])) if kind == "half" else ("K", bool(base.K[:, i].any()))
        rows = geometry.L_v if kind == "half" else geometry.L_q
        if kind is None or inertial[i] or held:
            continue
        makers = [place.words for place in geometry.places if rows[place.arguments, i].any()]
        if makers:
            lines.append(f"{dof}: {kind}, by {listed(makers)}; its column of {letter} is null")
    return tuple(lines)


def massless_dofs(base: SecondOrderModel, place: Place) -> tuple[str, ...]:
    """Return the DOFs of an element whose column of M is null."""
    return tuple([dof for dof in place.dofs if not base.M[:, base.dofs.index(dof)].any()])


def keeps_states(
    base: SecondOrderModel, geometry: Geometry, slopes: Sequence[FloatArray | None], as_in: DofPartition
) -> bool:
    """Tell whether the model has the same states, and W is regular, where some elements have no slope."""
    try:
        partition = partition_of(geometry.with_slopes(base, slopes))
    except np.linalg.LinAlgError:
        return False
    return partition is not None and (partition.states, partition.static) == (as_in.states, as_in.static)


def _has_part(product: FloatArray, columns: FloatArray) -> bool:
    return bool(product.size) and float(np.abs(product).max()) > MOVING * float(np.abs(columns).max(initial=0.0))


def _sizes(base: SecondOrderModel) -> tuple[FloatArray, FloatArray]:
    """Return for each DOF the size of a stiffness and of a damping that is felt there."""
    stiff, damped, mass = (np.abs(X).max(axis=1) for X in base.quadratics.P)
    K, C, M = (float(X.max()) for X in (stiff, damped, mass))
    omega = np.sqrt(K / M) if K > 0.0 and M > 0.0 else K / C if K > 0.0 and C > 0.0 else 1.0
    stiff = np.where(stiff > 0.0, stiff, np.where(damped > 0.0, omega * damped, K or omega * C or omega**2 * M or 1.0))
    damped = np.where(damped > 0.0, damped, stiff / omega)
    return stiff, damped


def _index_error(base: SecondOrderModel, geometry: Geometry, slopes: list[FloatArray]) -> LawError:
    """Make the refusal of a model above index 1; a singular pencil raises its own error on the way."""
    reduction = exact_reduction(geometry.with_slopes(base, slopes))
    dofs = tuple([dof for dof in base.dofs if dof not in reduction.partition.inertial])
    words = listed([place.words for place in geometry.places])
    msg = (
        f"The model is of index {reduction.index} whatever the slopes of {words} are: DOFs {listed(dofs)} are tied by "
        "a rigid constraint or an algebraic loop, and a nonlinear model must be of index 1. Eliminate the "
        "constraint, or "
        "put a stiff spring in its place."
    )
    return LawError(msg, element=words, dofs=dofs)
