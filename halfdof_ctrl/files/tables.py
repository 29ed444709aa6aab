"""Tables in files: responses and gains as rows of text."""

import csv
import io
from collections.abc import Iterable, Sequence
from typing import Any

import control
import numpy as np

from halfdof_ctrl.base.doors import wrong_object
from halfdof_ctrl.base.names import name_from_label
from halfdof_ctrl.design.lqr import StateFeedback
from halfdof_ctrl.files.containers import MATRIX_ENDINGS, PathLike, ending
from halfdof_ctrl.files.writing import replacing, save_matrices
from halfdof_ctrl.systems.phase import response_phase

TABLE_ENDINGS = (".csv",)
#: of a cell that a spreadsheet works out, and the mark that keeps it from that
GUARD, FORMULA_STARTS = "'", ("=", "+", "-", "@", "'")
FREQUENCY_HEAD = ("omega [rad/s]", "f [Hz]")  #: first columns of a frequency response
PARTS = ("real", "imag", "magnitude", "phase [deg]")  #: columns of a channel
TIME_HEAD = "t [s]"  #: first column of a time response
GAIN_ENDINGS = (*MATRIX_ENDINGS, *TABLE_ENDINGS)


def frequency_table(data: control.FrequencyResponseData) -> tuple[list[str], list[Any]]:
    """Return the header and the columns: frequencies, and each channel four times."""
    omega = np.asarray(data.omega, dtype=float)
    header, columns = list(FREQUENCY_HEAD), [omega, omega / (2.0 * np.pi)]
    values, phase = np.asarray(data.frdata), response_phase(data)
    for i, result in enumerate(data.output_labels):
        for j, cause in enumerate(data.input_labels):
            channel = f"{name_from_label(result)}/{name_from_label(cause)}"
            header += [f"{channel} {part}" for part in PARTS]
            value = values[i, j]
            columns += [value.real, value.imag, np.abs(value), np.degrees(phase[i, j])]
    return header, columns


def time_table(data: control.TimeResponseData) -> tuple[list[str], list[Any]]:
    """Return the header and the columns: times, and a trace a column."""
    time = np.asarray(data.t, dtype=float)
    results = [name_from_label(label) for label in data.output_labels]
    if data.ntraces:
        causes = [name_from_label(label) for label in data.trace_labels or data.input_labels]
        causes = [cause.removeprefix("From ") for cause in causes]
        header = [f"{result}/{cause}" for result in results for cause in causes]
    else:
        header = results
    histories = np.asarray(data.y, dtype=float).reshape(-1, time.size)
    return [TIME_HEAD, *header], [time, *histories]


def save_gain(feedback: StateFeedback, path: PathLike) -> None:
    """Write the gain K of ``u = -K x`` with the names of its inputs (rows) and states (columns).

    Raises
    ------
    FileFormatError
        The ending is not ``.npz``, ``.mat`` or ``.csv``.
    OSError
        The file cannot be written.
    """
    if ending(path, GAIN_ENDINGS) not in TABLE_ENDINGS:
        names = {"inputs": feedback.inputs, "states": feedback.states}
        save_matrices(path, {"K": np.asarray(feedback.K)}, names, None)
        return
    rows = (
        [_no_formula(name), *map(repr, row)] for name, row in zip(feedback.inputs, feedback.K.tolist(), strict=True)
    )
    _save_table(path, ["input", *feedback.states], rows)


def without_guard(cell: str) -> str:
    """Take away what `_no_formula` put before a name."""
    return cell[1:] if cell.startswith(GUARD) and cell[1:].startswith(FORMULA_STARTS) else cell


def _no_formula(cell: str) -> str:
    """Put an apostrophe before a name that a spreadsheet would take for a formula."""
    return GUARD + cell if cell.startswith(FORMULA_STARTS) else cell


def save_response(data: control.FrequencyResponseData | control.TimeResponseData, path: PathLike) -> None:
    """Write the numbers of a response as a table with full precision.

    Parameters
    ----------
    data : control.FrequencyResponseData or control.TimeResponseData
        A frequency response gives ``omega [rad/s]``, ``f [Hz]`` and for each channel ``y/F_y`` its real and
        imaginary part, magnitude, and phase [deg] on the branch of `bode_plot`. A time response gives ``t [s]`` and
        its outputs, ``y``, or ``y/F_y`` where there is a trace for each input. `load_response` is the way back.
    path : path-like
        Ends in ``.csv``. Names are those of the model (``101.1``), not python-control's labels.

    Raises
    ------
    FileFormatError
        Another ending.
    OSError
        The file cannot be written.
    """
    ending(path, TABLE_ENDINGS)
    if not isinstance(data, control.FrequencyResponseData | control.TimeResponseData):
        wanted = "a response of python-control, of frequency_response or step_response"
        raise wrong_object("save_response", wanted, data, parameter="data")
    header, columns = time_table(data) if isinstance(data, control.TimeResponseData) else frequency_table(data)
    _save_table(path, header, (map(repr, row) for row in np.column_stack(columns).tolist()))


def _save_table(path: PathLike, header: Sequence[str], rows: Iterable[Iterable[str]]) -> None:
    with replacing(path) as stream:
        text = io.TextIOWrapper(stream, encoding="utf-8", newline="")
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow([_no_formula(cell) for cell in header])
        writer.writerows(rows)
        text.detach()
