"""The tangent of a nonlinear model: M, C and K for small motions about a state."""

from typing import TYPE_CHECKING, Any

import numpy as np

from halfdof_ctrl.base.errors import LostStateWarning, give_warning
from halfdof_ctrl.base.names import listed
from halfdof_ctrl.model.nonlinear import Values
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.nonlinear.classification import partition_of
from halfdof_ctrl.nonlinear.equilibrium import Equilibrium
from halfdof_ctrl.nonlinear.given_inputs import constant_inputs
from halfdof_ctrl.nonlinear.initial import initial_state
from halfdof_ctrl.nonlinear.small_motion import infinite_slope

if TYPE_CHECKING:
    from halfdof_ctrl.nonlinear.reduction import NonlinearReduction


def tangent_model(reduction: "NonlinearReduction", state: Any, inputs: Values) -> SecondOrderModel:  # noqa: ANN401
    """Return the tangent, as `NonlinearModel.tangent` describes it."""
    if inputs is None and isinstance(state, Equilibrium):
        inputs = state.inputs
    u = constant_inputs(inputs, reduction.model.inputs)
    x = initial_state(reduction, state, u)
    w, _ = reduction.solved(0.0, x, u)
    geometry = reduction.geometry
    slopes = geometry.slopes(w, 0.0)
    for place, slope in zip(geometry.places, slopes, strict=True):
        if not np.isfinite(slope).all():
            raise infinite_slope(place.words, place.dofs, "its slope there is infinite")
    model = geometry.with_slopes(reduction.model.with_linear_elements, slopes)
    _warn_of_lost_states(reduction, model, slopes)
    return model


def _warn_of_lost_states(reduction: "NonlinearReduction", model: SecondOrderModel, slopes: list[Any]) -> None:
    found = partition_of(model)
    if found is not None and (found.states, found.static) == (reduction.states, reduction.partition.static):
        return
    lost = [name for name in reduction.states if found is None or name not in found.states]
    flat = [
        place
        for place, slope, moves in zip(reduction.geometry.places, slopes, reduction.moving, strict=True)
        if moves and not slope.any()
    ]
    words = listed([place.words for place in flat]) or "the elements"
    dofs = tuple(dict.fromkeys(name for place in flat for name in place.dofs))
    what = f"without the state {listed(lost)}" if lost else "with other DOFs held than in the model"
    msg = (
        f"The slope of {words} is zero at this state, so the tangent of {listed(dofs)} is {what}: the nonlinear "
        "model has "
        f"{len(reduction.states)} states, the tangent another structure. Take the tangent where it moves, or give "
        "the law "
        "a linear part."
    )
    give_warning(msg, LostStateWarning)
