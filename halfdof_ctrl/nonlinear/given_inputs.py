"""Inputs as users give them: numbers that are held, samples joined linearly, functions of time, by order or by name."""

from bisect import bisect_right
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from halfdof_ctrl.base.arrays import FloatArray
from halfdof_ctrl.base.doors import answer_of, is_mapping, real_numbers, shown
from halfdof_ctrl.base.errors import MatrixError, ParameterError
from halfdof_ctrl.base.names import unknown_name_error

STRAIGHT = 1e-12  #: change of slope, relative to the steepest, that is none
QUIET = 3  #: samples on a straight line after which the integration starts anew at a kink


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Inputs:
    """The m inputs of a run as a function of time."""

    at: Callable[[float], FloatArray]  #: (m,) values
    samples: FloatArray | None  #: (m, k) at the times asked for, None where functions are among them
    kinks: tuple[float, ...]  #: times at which an input begins to move after it was straight for a while
    largest: FloatArray  #: (m,) size of each input at the times asked for


def read_inputs(given: Any, names: tuple[str, ...], times: FloatArray) -> Inputs:  # noqa: ANN401  # whatever the user gave
    """Read what `nonlinear_response` takes as `inputs`.

    Raises
    ------
    MatrixError
        Arrays that fit neither the inputs nor the times, NaN or Inf.
    SignalNameError
        A name that is no input.
    """
    m = len(names)
    parts = _parts(given, names, times)
    functions = [part for part in parts if callable(part)]
    if functions:
        every = given if callable(given) and m != 1 else None
        return _of_functions(parts, every, times, m)
    samples = np.array([np.broadcast_to(_numbers(part, times), times.shape) for part in parts]).reshape(m, times.size)
    if not np.isfinite(samples).all():
        msg = (
            f"inputs hold NaN or Inf ({names[int(np.argwhere(~np.isfinite(samples))[0, 0])]}): every value must be "
            "finite."
        )
        raise MatrixError(msg, matrix="inputs")
    return Inputs(
        at=joined(times, samples), samples=samples, kinks=_kinks(times, samples), largest=np.abs(samples).max(axis=1)
    )


def constant_inputs(given: Any, names: tuple[str, ...]) -> FloatArray:  # noqa: ANN401
    """Read inputs at one time: a number for all, one for each, or some by name.

    Raises
    ------
    MatrixError
        Wrong count, NaN or Inf.
    SignalNameError
        A name that is no input.
    """
    if is_mapping(given):
        _require_known(given, names)
        given = [given.get(name, 0.0) for name in names]
    try:
        values = real_numbers(0.0 if given is None else given, "inputs", "numbers")
        values = np.array(np.broadcast_to(values, (len(names),)))
    except (ParameterError, ValueError) as cause:
        msg = f"inputs must be a number, or one for each of {len(names)} inputs, not {shown(given)}."
        raise MatrixError(msg, matrix="inputs") from cause
    if not np.isfinite(values).all():
        msg = f"inputs must be finite numbers, not {shown(given)}."
        raise MatrixError(msg, matrix="inputs")
    return values


def joined(times: FloatArray, samples: FloatArray) -> Callable[[float], FloatArray]:
    """Return samples joined linearly, held before the first and after the last time."""
    if (samples == samples[:, :1]).all():
        held = samples[:, 0].copy()
        return lambda _: held
    grid = times.tolist()
    starts = np.ascontiguousarray(samples.T)
    slopes = np.ascontiguousarray((np.diff(samples) / np.diff(times)).T)
    last = len(grid) - 2

    def at(t: float) -> FloatArray:
        k = min(max(bisect_right(grid, t) - 1, 0), last)
        return np.asarray(starts[k] + (t - grid[k]) * slopes[k])

    return at


def _parts(given: Any, names: tuple[str, ...], times: FloatArray) -> list[Any]:  # noqa: ANN401
    """Return a number, row of samples or function for each input."""
    m = len(names)
    if is_mapping(given):
        _require_known(given, names)
        return [given.get(name, 0.0) for name in names]
    if given is None or np.isscalar(given) or callable(given):
        return [0.0 if given is None else given] * m
    if isinstance(given, Sequence) and len(given) == m and (m > 1 or not np.isscalar(given[0])):
        return list(given)
    array = (
        real_numbers(given, "inputs", "numbers, samples or functions of time")
        if not isinstance(given, Sequence)
        else _ragged(given, m, times)
    )
    if m == 1 and array.shape in {times.shape, (1, times.size)}:
        return [array.reshape(-1)]
    if array.shape == (m, times.size):
        return list(array)
    if array.shape == (m,) and m != times.size:
        return list(array)
    raise _shape_error(array.shape, m, times)


def _ragged(given: Sequence[Any], m: int, times: FloatArray) -> npt.NDArray[Any]:
    try:
        return real_numbers(given, "inputs", "numbers, samples or functions of time")
    except ParameterError as cause:
        raise _shape_error((len(given),), m, times) from cause


def _shape_error(shape: tuple[int, ...], m: int, times: FloatArray) -> MatrixError:
    msg = (
        f"inputs have the shape {shape}, but there are {m} inputs and {times.size} times. Give a number, {m} x "
        f"{times.size} "
        "samples, a function of time, or one of these for each input by name."
    )
    return MatrixError(msg, matrix="inputs")


def _numbers(part: Any, times: FloatArray) -> FloatArray:  # noqa: ANN401
    values = real_numbers(part, "inputs", "numbers, samples or functions of time")
    if values.ndim and values.shape != times.shape:
        msg = f"An input has {values.shape} samples for {times.size} times. Give one for each time."
        raise MatrixError(msg, matrix="inputs")
    return values


def _of_functions(parts: list[Any], every: Callable[[float], Any] | None, times: FloatArray, m: int) -> Inputs:
    """Join functions of time with samples and numbers."""
    pieces = [
        part if callable(part) else joined(times, np.broadcast_to(_numbers(part, times), times.shape)[None])
        for part in parts
    ]

    def answers(t: float) -> FloatArray:
        if every is not None:
            return real_numbers(every(t), "inputs(t)", f"{m} numbers").reshape(-1)
        return np.array([float(np.asarray(piece(t)).reshape(-1)[0]) for piece in pieces])

    meaning = f"a function of the time alone that gives {m} numbers"

    def at(t: float) -> FloatArray:
        values: FloatArray = answer_of(answers, t, parameter="inputs", meaning=meaning)
        if values.size != m or not np.isfinite(values).all():
            msg = f"inputs(t) gives {values} at t = {t:.6g} s, but must give {m} finite numbers."
            raise ParameterError(msg, parameter="inputs", value=t)
        return values

    seen = np.abs(np.array([at(float(t)) for t in times]))
    return Inputs(at=at, samples=None, kinks=(), largest=seen.max(axis=0, initial=0.0))


def _require_known(given: Mapping[str, Any], names: tuple[str, ...]) -> None:
    for name in given:
        if name not in names:
            raise unknown_name_error(name, "input", names)


def _kinks(times: FloatArray, samples: FloatArray) -> tuple[float, ...]:
    """Find the times at which an input begins to bend after it was straight for some samples.

    A long step over a quiet stretch would not see what comes after it, so the integration starts anew there.
    """
    if times.size < QUIET + 1:
        return tuple(times[1:-1].tolist()) if np.ptp(samples, axis=1).any() else ()
    slope = np.diff(samples) / np.diff(times)
    bend = np.abs(np.diff(slope)) > STRAIGHT * np.abs(slope).max(axis=1, keepdims=True, initial=0.0)
    bends = bend.any(axis=0)  # at times[1:-1]
    since, found = QUIET, []
    for k, bent in enumerate(bends.tolist()):
        if bent and since >= QUIET:
            found.append(float(times[k + 1]))
        since = 0 if bent else since + 1
    return tuple(found)
