"""Histories of all DOFs, and initial values that agree with the equations without inertia."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from halfdof_ctrl.base.arrays import FloatArray
from halfdof_ctrl.base.by_name import by_name
from halfdof_ctrl.base.doors import is_mapping, real_number, real_numbers, shown, wrong_object
from halfdof_ctrl.base.errors import InconsistentStateError, MatrixError, ParameterError
from halfdof_ctrl.base.names import listed, motion_names, unknown_name_error

CONSISTENT = 1e-9  #: given initial values may differ by this part of the largest of their kind


class TimeResponse(Protocol):
    """What `ExactReduction.recover` reads of a `control.TimeResponseData`."""

    t: FloatArray  #: (k,) times [s]
    x: FloatArray  #: (N, k) or (N, traces, k) states
    u: FloatArray | None  #: (m, k) or (m, traces, k) inputs, None for none


def require_response(response: object) -> None:
    """Refuse what is no time response with states.

    Raises
    ------
    WrongObjectError
        It has no times, or no states.
    """
    try:
        whole = not isinstance(response, type) and all(getattr(response, part, None) is not None for part in ("t", "x"))
    except Exception:  # noqa: BLE001  # the object is the user's
        whole = False
    if not whole:
        remedy = "Compute it by control.forced_response of the system that mech2ss made, with its states."
        raise wrong_object("recover", "a control.TimeResponseData", response, remedy, parameter="response")


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class RecoveredMotion:
    """Histories of all n DOFs at k times, with an axis for the traces where the response has one."""

    time: FloatArray  #: (k,) [s]
    displacement: FloatArray  #: (n, k) or (n, traces, k) [m]
    velocity: FloatArray  #: (n, k) or (n, traces, k) [m/s]
    dofs: tuple[str, ...]  #: names of the n DOFs

    def __getitem__(self, name: str) -> FloatArray:
        """Return the history of ``<dof>`` or ``<dof>_dot``.

        Raises
        ------
        SignalNameError
            The name is neither.
        """
        for derivative, history in enumerate((self.displacement, self.velocity)):
            names = motion_names(self.dofs, derivative)
            if isinstance(name, str) and name in names:
                return np.asarray(history[names.index(name)])
        raise unknown_name_error(name, "motion", (*self.dofs, *motion_names(self.dofs, 1)))


def given_inputs(given: npt.ArrayLike, count: int) -> FloatArray:
    """Read the inputs at one time, (m,), from as many numbers or one for all.

    Raises
    ------
    ParameterError
        Another count, or what is no finite real number.
    """
    numbers = real_numbers(given, "u0", f"{count} real numbers, the inputs at that time")
    if numbers.shape not in {(), (1,), (count,)} or not np.isfinite(numbers).all():
        msg = f"u0 must be {count} finite numbers, the inputs at that time, or one for all, not {shown(given)}."
        raise ParameterError(msg, parameter="u0", value=given)
    return np.broadcast_to(numbers, (count,))


def given_values(given: npt.ArrayLike | Mapping[str, float], dofs: tuple[str, ...], what: str) -> FloatArray:
    """Read displacements or velocities as an array with NaN where they are open."""
    if is_mapping(given):
        values = np.full(len(dofs), np.nan)
        for name, value in by_name(given, dofs, "DOF").items():
            values[dofs.index(name)] = real_number(value, f"{what} of {name}")
    else:
        values = real_numbers(given, what, f"one real number for each of the {len(dofs)} DOFs")
    if values.shape != (len(dofs),):
        msg = f"{what} must have one value for each of the {len(dofs)} DOFs, but its shape is {values.shape}."
        raise MatrixError(msg, matrix=what)
    if np.isinf(values).any():
        places = np.flatnonzero(np.isinf(values)).tolist()
        msg = f"{what} is infinite at {listed([dofs[place] for place in places])}. Give finite numbers."
        raise MatrixError(msg, matrix=what)
    return values


def require_consistent(names: tuple[str, ...], given: FloatArray, required: FloatArray) -> None:
    """Refuse given values that differ from the required ones, NaN standing for what was left open."""
    stated = ~np.isnan(given)
    scale = max(np.abs(given[stated]).max(initial=0.0), np.abs(required[stated]).max(initial=0.0))
    wrong = np.flatnonzero(stated & (np.abs(np.nan_to_num(given) - required) > CONSISTENT * scale)).tolist()
    if not wrong:
        return
    text = ", ".join(f"{names[i]} = {given[i]:.6g} (must be {required[i]:.6g})" for i in wrong)
    msg = (
        f"The initial values contradict the equations of the DOFs without inertia: {text}. "
        "Such a value follows from the others and from the inputs; leave it out, or give u0."
    )
    raise InconsistentStateError(
        msg,
        names=tuple([names[i] for i in wrong]),
        given=tuple(given[wrong].tolist()),
        required=tuple(required[wrong].tolist()),
    )


def forward_slope(values: FloatArray, time: FloatArray) -> FloatArray:
    """Slope of a piecewise linear history after each time (before it, at the last)."""
    if time.size < 2:  # noqa: PLR2004
        return np.zeros_like(values)
    slope = np.diff(values, axis=-1) / np.diff(time)
    return np.concatenate([slope, slope[..., -1:]], axis=-1)
