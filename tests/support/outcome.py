"""What a reduction of a drawn model comes to: the reduction, what was said of its digits, and its improper pairs."""

import warnings

from halfdof_ctrl import ExactReduction, SecondOrderModel, exact_reduction, mech2ss
from halfdof_ctrl.base.errors import ImproperError, LostDigitsWarning


def reduced(model: SecondOrderModel) -> ExactReduction:
    """Reduce; that a decision was close may be said."""
    return reduced_aloud(model)[0]


def reduced_aloud(model: SecondOrderModel) -> tuple[ExactReduction, bool]:
    """Reduce, and tell whether it was said that digits are lost."""
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        reduction = exact_reduction(model)
    return reduction, any(issubclass(warning.category, LostDigitsWarning) for warning in said)


def pairs(reduction: ExactReduction) -> set[tuple[int, int, int]]:
    """Give the places and orders of the improper pairs."""
    model = reduction.model
    try:
        mech2ss(reduction)
    except ImproperError as refusal:
        return {(model.inputs.index(u), model.outputs.index(y), order) for u, y, order in refusal.pairs}
    return set()
