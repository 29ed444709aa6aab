"""Responses as tables: what `files.save_response` writes, under the names of the model."""

from typing import Any

import control
import numpy as np

from halfdof_ctrl.base.names import name_from_label


def frequency_table(data: control.FrequencyResponseData) -> tuple[list[str], list[Any]]:
    """Give the header and the columns: frequencies, and each channel four times."""
    omega = np.asarray(data.omega, dtype=float)
    header, columns = ["omega [rad/s]", "f [Hz]"], [omega, omega / (2.0 * np.pi)]
    values = np.asarray(data.frdata)
    for i, result in enumerate(data.output_labels):
        for j, cause in enumerate(data.input_labels):
            channel = f"{name_from_label(result)}/{name_from_label(cause)}"
            header += [f"{channel} {part}" for part in ("real", "imag", "magnitude", "phase [deg]")]
            value = values[i, j]
            columns += [value.real, value.imag, np.abs(value), np.degrees(_unwrapped(np.angle(value)))]
    return header, columns


def _unwrapped(phase: Any) -> Any:  # noqa: ANN401 - an array of floats, which control leaves untyped
    """Remove jumps of whole turns, leaving out values at poles, which have no phase."""
    known = np.isfinite(phase)
    unwrapped = phase.copy()
    unwrapped[known] = np.unwrap(phase[known])
    return unwrapped


def time_table(data: control.TimeResponseData) -> tuple[list[str], list[Any]]:
    """Give the header and the columns: times, and a trace a column."""
    time = np.asarray(data.t, dtype=float)
    results = [name_from_label(label) for label in data.output_labels]
    if data.ntraces:
        causes = [name_from_label(label) for label in data.trace_labels or data.input_labels]
        causes = [cause.removeprefix("From ") for cause in causes]
        header = [f"{result}/{cause}" for result in results for cause in causes]
    else:
        header = results
    histories = np.asarray(data.y, dtype=float).reshape(-1, time.size)
    return ["t [s]", *header], [time, *histories]
