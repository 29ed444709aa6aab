"""The door for systems of python-control: what is no state space or response is refused by name."""

import control
import numpy as np

from halfdof_ctrl.base.doors import wrong_object
from halfdof_ctrl.base.errors import MatrixError
from halfdof_ctrl.model.second_order import SecondOrderModel


def checked_system(
    value: object, function: str, *, parameter: str = "sys", wanted: str = "a control.StateSpace"
) -> control.StateSpace:
    """Return a state space of python-control, or refuse what is none.

    Raises
    ------
    WrongObjectError
        Anything but a `control.StateSpace`.
    MatrixError
        NaN or Inf in A, B, C or D.
    """
    if isinstance(value, control.StateSpace):
        require_finite_system(value)
        return value
    remedy = "Convert it by control.ss." if isinstance(value, control.TransferFunction) else ""
    if isinstance(value, SecondOrderModel):
        remedy = "Convert the model by hd.mech2ss."
    raise wrong_object(function, wanted, value, remedy, parameter=parameter)


def require_finite_system(sys: control.StateSpace) -> None:
    """Refuse NaN and Inf, which python-control takes and LAPACK does not.

    Raises
    ------
    MatrixError
        The matrix that holds one.
    """
    for letter in "ABCD":
        if not np.isfinite(getattr(sys, letter)).all():
            msg = f"{letter} of the state space holds NaN or Inf. Look at the numbers that it was made of."
            raise MatrixError(msg, matrix=letter)


def checked_time_response(value: object, function: str) -> control.TimeResponseData:
    """Return a time response of python-control, or refuse what is none.

    Raises
    ------
    WrongObjectError
        Anything but a `control.TimeResponseData`.
    """
    if isinstance(value, control.TimeResponseData):
        return value
    remedy = "Compute it by control.forced_response of the system that mech2ss made."
    raise wrong_object(function, "a control.TimeResponseData", value, remedy, parameter="response")
