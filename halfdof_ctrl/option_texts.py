"""What the options of the command mean: lists, assignments and frequencies as text."""

import argparse
import math
from collections.abc import Callable, Sequence
from typing import overload

import numpy as np
import numpy.typing as npt

from halfdof_ctrl.base.errors import ParameterError
from halfdof_ctrl.files.containers import ending
from halfdof_ctrl.systems.frequency import DEFAULT_POINTS

OPTION_TEXTS_FEWEST_POINTS, MOST_ASKED = 2, 1_000_000


def _one_limit(omega: float | None, frequency: float | None, which: str) -> float | None:
    """Return a limit [rad/s] that is given in rad/s or in Hz."""
    if omega is not None and frequency is not None:
        msg = f"--omega-{which} and --f-{which} are the same limit, in rad/s and in Hz. Give one of them."
        raise ParameterError(msg, parameter=f"--f-{which}", value=frequency)
    return omega if frequency is None else 2.0 * math.pi * frequency


def assignments(given: Sequence[str], option: str) -> dict[str, float]:
    """Read NAME=VALUE texts."""
    values: dict[str, float] = {}
    for text in given:
        name, _, value = text.rpartition("=")
        if not name:
            msg = f"{option} takes a name and a number, NAME=VALUE, not {text!r}."
            raise ParameterError(msg, parameter=option, value=text)
        if name in values:
            msg = f"{option} gives {name} twice."
            raise ParameterError(msg, parameter=option, value=text)
        values[name] = _number(value, f"{option} {name}")
    return values


def _number(text: str, what: str) -> float:
    try:
        return float(text)
    except ValueError as cause:
        msg = f"{what} must be a number, not {text!r}."
        raise ParameterError(msg, parameter=what, value=text) from cause


@overload
def listed_names(given: Sequence[str] | None, default: Sequence[str]) -> list[str]: ...


@overload
def listed_names(given: Sequence[str] | None, default: None) -> list[str] | None: ...


def listed_names(given: Sequence[str] | None, default: Sequence[str] | None) -> list[str] | None:
    """Split lists with commas; None where nothing is given and there is no default."""
    if given is None:
        return None if default is None else list(default)
    return [name.strip() for text in given for name in text.split(",") if name.strip()]


def chosen_frequencies(
    default: Callable[[], np.ndarray],
    arguments: argparse.Namespace,
    *,
    linear: bool = False,
    usual: int = DEFAULT_POINTS,
) -> np.ndarray | None:
    """Choose the frequencies [rad/s] if any of the limits or their number is given, the others from a default grid."""
    low = _one_limit(arguments.omega_min, arguments.f_min, "min")
    high, points = _one_limit(arguments.omega_max, arguments.f_max, "max"), arguments.points
    if low is None and high is None and points is None:
        return None
    around = default() if low is None or high is None else np.zeros(0)
    low = around[0] if low is None else low
    high = around[-1] if high is None else high
    if not (math.isfinite(high) and 0.0 <= low < high and (linear or low > 0.0)):
        msg = f"The frequencies from --omega-min {low:.4g} to --omega-max {high:.4g} rad/s must be positive and rise."
        raise ParameterError(msg, parameter="--omega-min", value=low)
    points = usual if points is None else points
    if not OPTION_TEXTS_FEWEST_POINTS <= points <= MOST_ASKED:
        msg = f"--points {points}, but a range of frequencies has {OPTION_TEXTS_FEWEST_POINTS} to {MOST_ASKED} of them."
        raise ParameterError(msg, parameter="--points", value=points)
    return np.linspace(low, high, points) if linear else np.geomspace(low, high, points)


def require_finite(times: npt.ArrayLike, values: npt.ArrayLike) -> None:
    """Refuse a response that is beyond the largest number."""
    traces = np.asarray(values, dtype=float)
    bad = ~np.isfinite(traces).reshape(-1, traces.shape[-1]).all(axis=0)
    if bad.any():
        last = float(np.asarray(times, dtype=float)[bad][0])
        msg = (
            f"The step response is beyond the largest number from t = {last:.4g} s on: the model is unstable. "
            "Give a shorter --time."
        )
        raise ParameterError(msg, parameter="--time", value=last)


def require_ending(path: str | None, known: Sequence[str]) -> str | None:
    """Refuse an ending before anything is computed."""
    return None if path is None else ending(path, known)
