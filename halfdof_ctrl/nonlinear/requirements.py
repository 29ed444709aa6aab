"""Refuse the laws that cannot be solved for where they stand, before anything is computed."""

import math
from collections.abc import Sequence

from halfdof_ctrl.base.arrays import FloatArray
from halfdof_ctrl.base.errors import LawError
from halfdof_ctrl.base.names import listed
from halfdof_ctrl.model.elements import Damper
from halfdof_ctrl.model.law import Law
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.nonlinear.classification import keeps_states, massless_dofs
from halfdof_ctrl.nonlinear.geometry import Geometry, Place
from halfdof_ctrl.nonlinear.judgement import Judgement, judged
from halfdof_ctrl.reduction.dense.partition import DofPartition


def require_answers(
    base: SecondOrderModel,
    geometry: Geometry,
    slopes: Sequence[FloatArray],
    moving: Sequence[bool],
    partition: DofPartition,
) -> list[bool]:
    """Refuse laws that are no answer where they must be solved for.

    Returns
    -------
    list of bool
        For each element, whether the model has its states only because of it.

    Raises
    ------
    LawError
        A law that is solved for falls somewhere, or a law that is bounded or flat is all that holds a DOF without
        mass.
    """
    places = geometry.places
    needed = [
        moving[k] and not keeps_states(base, geometry, [G if j != k else None for j, G in enumerate(slopes)], partition)
        for k in range(len(places))
    ]
    judgements = [judged(place.element.law) if place.is_scalar else None for place in places]  # type: ignore[union-attr,arg-type]
    weak = []
    for k, (place, found) in enumerate(zip(places, judgements, strict=True)):
        if not moving[k] or found is None:
            continue
        if not found.rises:
            raise _falling_error(base, place)
        if not found.answers_all:
            weak.append(k)
            if needed[k]:
                raise _weak_error(base, place, found)
    strong_alone = [None if k in weak else G for k, G in enumerate(slopes)]
    if weak and not keeps_states(base, geometry, strong_alone, partition):
        found = judgements[weak[0]]
        raise _weak_error(base, places[weak[0]], found)  # type: ignore[arg-type]  # weak ones have been judged
    return needed


def _falling_error(base: SecondOrderModel, place: Place) -> LawError:
    dofs, what, whats = _what(base, place)
    msg = (
        f"The law of {place.words} is not monotone, and it must be solved for, since it acts on the {what} of "
        f"{listed(dofs)}, without mass: several {whats} answer the same force, and the motion would jump between them. "
        "Give the DOF a mass, or take a law that rises."
    )
    return LawError(msg, element=place.words, dofs=dofs)


def _weak_error(base: SecondOrderModel, place: Place, found: Judgement) -> LawError:
    dofs, what, _ = _what(base, place)
    low, high = found.bounds
    part = "a viscous part" if isinstance(place.element, Damper) else "a linear spring"
    law = place.element.law.name if place.is_scalar and isinstance(place.element.law, Law) else ""  # type: ignore[union-attr]
    if math.isfinite(low) or math.isfinite(high):
        side, bound = ("above", high) if math.isfinite(high) else ("below", low)
        fact = f"a force {side} {bound:g} N has no answering {what}"
    else:
        where = "inside a gap" if law == "gap" else "where the law is flat"
        fact = f"{where} nothing holds {listed(dofs)}"
    if law == "gap" and math.isfinite(low):
        fact = f"inside a gap nothing holds {listed(dofs)}, and {fact}"
    msg = f"{place.words} alone holds {listed(dofs)}, without mass: {fact}; add {part}, or give the DOF a mass."
    return LawError(msg, element=place.words, dofs=dofs)


def _what(base: SecondOrderModel, place: Place) -> tuple[tuple[str, ...], str, str]:
    dofs = massless_dofs(base, place) or place.dofs
    return (
        (dofs, "velocity", "velocities")
        if isinstance(place.element, Damper)
        else (dofs, "displacement", "displacements")
    )
