"""Parts joined by names to one model.

    diag(M_1, M_2, ...) -> T^T M T, likewise C and K,    with the ties q = T p of `ties`

    [ K  G^T ]            for ties that substitution does not reach: G p = 0 with multipliers
    [ G   0  ]

Springs and dampers between points add ``k e e^T`` with ``e = r_a - r_b``; a joint with a model of its own is one more
part, tied to both points.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, cast, overload

import numpy as np
from scipy.sparse import coo_array, csc_array
from scipy.sparse.csgraph import connected_components

from halfdof_ctrl.base.doors import items_of, require_mapping, shown
from halfdof_ctrl.base.errors import AssemblyError, ParameterError, SignalNameError
from halfdof_ctrl.base.names import Names, as_tuple, listed
from halfdof_ctrl.base.sparse_arrays import SparseMatrix, as_sparse, joined_sparse, sparse_zeros
from halfdof_ctrl.model.elements import Damper, Spring
from halfdof_ctrl.model.mechss import mechss
from halfdof_ctrl.model.nonlinear import NonlinearModel, nlmechss
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.parts.joints import AnyJoint, Joint, Rigid
from halfdof_ctrl.parts.part_signals import assembled_signals
from halfdof_ctrl.parts.points import Points, block_diagonal, points_of
from halfdof_ctrl.parts.ties import Row, Ties

SQUARE_LETTERS = ("M", "C", "K")


@overload
def assemble(
    parts: Mapping[str, SecondOrderModel],
    *,
    joints: Sequence[Rigid | Joint] | Rigid | Joint = (),
    ground: Names = (),
    name: str | None = None,
) -> SecondOrderModel: ...
@overload
def assemble(
    parts: Mapping[str, SecondOrderModel],
    *,
    joints: Sequence[AnyJoint] | AnyJoint,
    ground: Names = (),
    name: str | None = None,
) -> SecondOrderModel | NonlinearModel: ...
def assemble(
    parts: Mapping[str, SecondOrderModel],
    *,
    joints: Sequence[AnyJoint] | AnyJoint = (),
    ground: Names = (),
    name: str | None = None,
) -> SecondOrderModel | NonlinearModel:
    """Join parts by names to one model.

    Parameters
    ----------
    parts : mapping from name to SecondOrderModel
        Any models: `point_mass`, `rigid_body`, mounts, `mechss`, a finite-element model, one that `truncate_modes` made
        with its interface kept.
    joints : sequence of Rigid, Spring, Damper or Joint, optional
        Between points called ``part_dof``; a name without its axis means all axes that both points have.
    ground : str or sequence of str, optional
        Points that are held at zero and leave the model. A point that is to be moved stays free: it goes to
        `SecondOrderModel.prescribe_motion`.
    name : str, optional
        Name of the model.

    Returns
    -------
    SecondOrderModel or NonlinearModel
        DOFs are called ``part_dof``; of DOFs that a rigid tie joins the first name stays; a DOF
        tied to a point of a rigid body goes, whichever stands first. A tie that no substitution
        reaches has the force in it as the DOF ``tie_<point>``, which is index 3. Inputs are forces on all DOFs and
        on points of rigid bodies, and whatever else was an input of a part; outputs likewise. Nonlinear
        if the law of a spring or damper is. Sparse if a part is.

    Raises
    ------
    SignalNameError
        An unknown point, points whose axes do not match, or names that meet.
    AssemblyError
        Joints that are redundant or contradict the parts, a part that nothing is joined to, or nothing left to move.
    ParameterError
        No parts, or a joint of another kind.

    Examples
    --------
    >>> from halfdof_ctrl.parts.masses import point_mass
    >>> from halfdof_ctrl.parts.rubber import kelvin_voigt
    >>> parts = {"body": point_mass(400), "spring": kelvin_voigt(k=2e4, c=1500)}
    >>> model = assemble(parts, joints=[Rigid("body_z", "spring_top")], ground="spring_bottom")
    >>> model.dofs, model.K.tolist()
    (('body_z',), [[20000.0]])
    """
    parts, every = _with_joined_models(parts, joints)
    points = points_of(parts)
    held = as_tuple(ground)
    _require_joined(parts, points, every, held)
    ties = Ties(points.dofs)
    for joint in every:
        if isinstance(joint, Rigid):
            _tie(ties, points, joint)
    for point in held:
        for each in points.named(point):
            ties.hold(points.rows[each], f"The ground of {each}", f"tie_{each}")
    T, kept = ties.substitution()
    if not kept:
        msg = f"The ground and the joints leave nothing to move of {listed(list(parts))}. Free one of the points."
        raise AssemblyError(msg, names=held)
    linear = [joint for joint in every if isinstance(joint, Spring | Damper) and joint.is_linear]
    model = _joined(parts, points, ties, (T, kept), linear, name)
    others = [joint for joint in every if isinstance(joint, Spring | Damper) and not joint.is_linear]
    if not others:
        return model
    return nlmechss(model, [_renamed(element, points, ties) for element in others], name=name)


def _with_joined_models(
    parts: Mapping[str, SecondOrderModel], joints: Sequence[AnyJoint] | AnyJoint
) -> tuple[dict[str, SecondOrderModel], list[AnyJoint]]:
    """Make every joint with a model a part with two ties."""
    found: list[AnyJoint] = []
    if isinstance(parts, Mapping):
        require_mapping(parts, "parts", "from names to models")
    every = dict(parts) if isinstance(parts, Mapping) else parts  # `points_of` refuses what are no parts
    number = 0
    for joint in (
        (joints,)
        if isinstance(joints, Rigid | Spring | Damper | Joint)
        else items_of(joints, "joints", "a list of Rigid, Spring, Damper and Joint", parameter="joints")
    ):
        if not isinstance(cast("object", joint), Rigid | Spring | Damper | Joint):
            msg = f"{shown(joint)} is no joint: take Rigid, Spring, Damper or Joint."
            raise ParameterError(msg, parameter="joints", value=joint)
        if not isinstance(joint, Joint):
            found.append(joint)
            continue
        number += 1
        own = joint.name or f"joint{number}"
        if own in every:
            msg = f"The joint {own} is called like a part. Give it another name."
            raise SignalNameError(msg, names=(own,))
        every[own] = joint.model
        found += _port_ties(joint, own)
    return every, found


def _port_ties(joint: Joint, own: str) -> list[AnyJoint]:
    ends = [(joint.a, joint.ports[0]), (joint.b, joint.ports[1])]
    ties: list[AnyJoint] = [Rigid(end, f"{own}_{port}") for end, port in ends if end is not None]
    if joint.b is None:
        ties.append(Rigid("", f"{own}_{joint.ports[1]}"))
    return ties


def _tie(ties: Ties, points: Points, joint: Rigid) -> None:
    if not joint.a:  # the ground of a joint
        for each in points.named(joint.b):
            ties.hold(points.rows[each], f"The ground of {each}", f"tie_{each}")
        return
    for a, b in points.pairs(joint.a, joint.b):
        words = f'Rigid("{a}", "{b}")'
        part = points.part_of[a]
        if a == b or (part == points.part_of[b] and {a, b} <= set(points.outputs)):
            msg = (
                f"{words} contradicts part {part}: both are points of one rigid body, and cannot move as one unless it "
                "stops turning. Hold its rotation by ground, or join it to another part."
            )
            raise AssemblyError(msg, names=(a, b))
        ties.tie(points.rows[a], points.rows[b], words, f"tie_{a}")


def _require_joined(
    parts: Mapping[str, SecondOrderModel], points: Points, joints: Sequence[AnyJoint], held: tuple[str, ...]
) -> None:
    """Refuse a part that no joint and no ground touches."""
    touched = {points.part_of[each] for point in held for each in points.named(point)}
    for joint in joints:
        ends = [end for end in (joint.a, cast("Rigid", joint).b) if end]
        touched |= {points.part_of[each] for end in ends for each in points.named(end)}
    loose = tuple([part for part in parts if part not in touched])
    if loose and len(parts) > 1:
        msg = (
            f"Nothing holds {'part' if len(loose) == 1 else 'parts'} {listed(loose)}: no joint and no ground names a "
            "point of it. Join it, or leave it out."
        )
        raise AssemblyError(msg, names=loose)


def _joined(
    parts: Mapping[str, SecondOrderModel],
    points: Points,
    ties: Ties,
    substitution: tuple[SparseMatrix, list[int]],
    elements: Sequence[Spring | Damper],
    name: str | None,
) -> SecondOrderModel:
    T, kept = substitution
    models = list(parts.values())
    M, C, K = (block_diagonal([getattr(model, letter) for model in models]) for letter in SQUARE_LETTERS)
    K = csc_array(K + _of_elements([each for each in elements if isinstance(each, Spring)], points, ties))
    C = csc_array(C + _of_elements([each for each in elements if isinstance(each, Damper)], points, ties))
    squares = [csc_array(T.T @ X @ T) for X in (M, C, K)]
    G = ties.constraints(kept)
    count = G.shape[0]
    names = [points.dofs[place] for place in kept] + [tie for tie, _ in ties.equations]
    _require_held(squares, G, names)
    if count:
        empty = sparse_zeros(count, count)
        zero = sparse_zeros(count, len(kept))
        borders = [zero, zero, G]
        squares = [
            as_sparse(joined_sparse([[X, csc_array(border.T)], [border, empty]]))
            for X, border in zip(squares, borders, strict=True)
        ]
    wide = csc_array(joined_sparse([[T, sparse_zeros(T.shape[0], count)]]))
    signals = assembled_signals(parts, wide, tuple(names), len(kept))
    dense = not any(model.is_sparse for model in models)
    matrices: dict[str, Any] = dict(zip(SQUARE_LETTERS, squares, strict=True)) | signals
    if dense:
        matrices = {key: value.toarray() if hasattr(value, "toarray") else value for key, value in matrices.items()}
    return replace(mechss(**matrices, name=name), known_to=max([model.known_to for model in models]))


def _of_elements(elements: Sequence[Spring | Damper], points: Points, ties: Ties) -> SparseMatrix:
    """Give ``sum of k e e^T`` over linear springs or dampers between two points, on every axis that both have."""
    entries: list[tuple[int, int, float]] = []
    sizes: list[float] = []
    for element in elements:
        pairs = [(a, "") for a in points.named(element.a)] if element.b is None else points.pairs(element.a, element.b)
        for a, b in pairs:
            row = _elongation(element, a, b, points, ties)
            entries += [(place, len(sizes), value) for place, value in row.items()]
            sizes.append(cast("float", element.law))
    size = len(points.dofs)
    if not sizes:
        return csc_array((size, size))
    rows, columns, values = zip(*entries, strict=True)
    e = csc_array(coo_array((values, (rows, columns)), shape=(size, len(sizes))))
    return csc_array((e * np.array(sizes)) @ e.T)


def _elongation(element: Spring | Damper, a: str, b: str, points: Points, ties: Ties) -> Row:
    """Give ``r_a - r_b``, and refuse an element that never stretches."""
    row, other = dict(points.rows[a]), points.rows[b] if b else {}
    if ties.is_one(row, other):
        msg = (
            f"{element!r} contradicts the rigid ties: {a} and {b or 'the ground'} move as one, so that it never "
            "stretches. Leave out the tie or the element."
        )
        raise AssemblyError(msg, names=(a, b) if b else (a,))
    for place, value in other.items():
        row[place] = row.get(place, 0.0) - value
    return row


def _renamed(element: Spring | Damper, points: Points, ties: Ties) -> Spring | Damper:
    """Put an element with a law on the DOFs that are left.

    Raises
    ------
    AssemblyError
        An end is no DOF, or both ends are one.
    """
    ends: list[str | None] = []
    for end in (element.a, element.b):
        if end is None:
            ends.append(None)
            continue
        named = points.named(end)
        row: Row = ties.reduced(points.rows[named[0]]) if len(named) == 1 else {}
        if len(named) > 1 or len(row) > 1 or set(row.values()) - {1.0}:
            msg = (
                f"{element!r}: {end} is {'a point with several axes' if len(named) > 1 else 'no DOF of its own'}, and "
                "a law that is no number acts on DOFs alone. Name one axis, or put a point_mass at the point."
            )
            raise AssemblyError(msg, names=(end,))
        ends.append(points.dofs[next(iter(row))] if row else None)
    if ends[0] == ends[1]:
        msg = f"{element!r} contradicts the rigid ties: its ends move as one. Leave out the tie or the element."
        raise AssemblyError(msg, names=(element.a, *([element.b] if element.b else [])))
    first, second = (ends[1], ends[0]) if ends[0] is None else (ends[0], ends[1])
    return type(element)(cast("str", first), second, element.law)


def _require_held(squares: Sequence[SparseMatrix], G: SparseMatrix, names: Sequence[str]) -> None:
    """Refuse DOFs without mass that nothing holds: a group that springs and dampers tie to nothing else."""
    M, C, K = squares
    size = M.shape[0]
    touched = csc_array(abs(M) + abs(C) + abs(K))
    _, labels = connected_components(touched, directed=False)
    constrained = set(labels[np.flatnonzero(np.diff(G.indptr))].tolist())
    massive = set(labels[np.flatnonzero(np.diff(M.indptr))].tolist())
    sums = [np.abs(np.asarray(X.sum(axis=1)).ravel()) for X in (C, K)]
    sizes = [np.asarray(abs(X).sum(axis=1)).ravel() for X in (C, K)]
    held = np.zeros(size, dtype=bool)
    for total, scale in zip(sums, sizes, strict=True):
        held |= total > size * np.finfo(float).eps * scale
    grounded = set(labels[held].tolist())
    for label in sorted(set(labels.tolist()) - constrained - massive - grounded):
        group = tuple([names[place] for place in np.flatnonzero(labels == label).tolist()])
        msg = (
            f"Nothing holds {listed(group)}: springs and dampers tie them to each other alone, and they have no mass. "
            "Join them to a part with mass, or name one of them in ground."
        )
        raise AssemblyError(msg, names=group)
