"""The door for models: what is no model of `mechss` is refused by name, with what to pass instead."""

import os

from halfdof_ctrl.base.doors import wrong_object
from halfdof_ctrl.model.nonlinear import NonlinearModel
from halfdof_ctrl.model.second_order import SecondOrderModel

DOORS_REMEDIES = {
    "StateSpace": "A state space has lost M, C and K: pass the model that it was made of, or hd.dss2ss for E x' = A x.",
    "TransferFunction": "It has no M, C and K: make the model by hd.mechss(M, C, K, ...).",
    "FrequencyResponseData": "It has no M, C and K: make the model by hd.mechss(M, C, K, ...).",
    "ExactReduction": "Pass its `model`.",
    "StateMap": "Pass its `model`.",
    "StateFeedback": "Pass its `model`, or its `closed_loop` where a state space will do.",
    "PencilStructure": "Pass its `model`.",
    "NonlinearModel": "Pass its `linear` part, or linearize hd.mech2nlsys(model).",
    "type": "Call it first, or make the model by hd.mechss(M, C, K, ...).",
    "function": "Call it first: pass what it returns.",
}
PLAIN_REMEDY = "Make one by hd.mechss(M, C, K, ...), or load one by hd.load_model(path)."


def checked_model(value: object, function: str, *, parameter: str = "model") -> SecondOrderModel:
    """Return a model of `mechss`, or refuse what is none.

    Parameters
    ----------
    value : object
        What was given.
    function : str
        Name of the function that takes it.
    parameter : str, optional
        Name of its argument.

    Raises
    ------
    WrongObjectError
        Anything but a `SecondOrderModel`.

    Examples
    --------
    >>> from halfdof_ctrl.model.mechss import mechss
    >>> checked_model(mechss([[1]], None, None), "zeros").dofs
    ('q0',)
    """
    if isinstance(value, SecondOrderModel):
        return value
    remedy = DOORS_REMEDIES.get(type(value).__name__, PLAIN_REMEDY)
    raise wrong_object(function, "a model of mechss", value, remedy, parameter=parameter)


def require_matrix(value: object, function: str, *, parameter: str) -> None:
    """Refuse what is neither a model nor a matrix where either may stand, such as a state space or a path.

    Raises
    ------
    WrongObjectError
        It is one of these.
    """
    is_path = isinstance(value, str | os.PathLike)
    if is_path or type(value).__name__ in DOORS_REMEDIES:
        remedy = "Load a file by hd.load_model(path)." if is_path else DOORS_REMEDIES[type(value).__name__]
        raise wrong_object(function, "a model of mechss, or matrices", value, remedy, parameter=parameter)


def checked_nonlinear(value: object, function: str) -> NonlinearModel:
    """Return a model of `nlmechss`, or refuse what is none.

    Raises
    ------
    WrongObjectError
        Anything but a `NonlinearModel`.
    """
    if isinstance(value, NonlinearModel):
        return value
    remedy = "Give its elements by hd.nlmechss(model, elements)." if isinstance(value, SecondOrderModel) else ""
    raise wrong_object(function, "a model of nlmechss", value, remedy, parameter="nonlinear")
