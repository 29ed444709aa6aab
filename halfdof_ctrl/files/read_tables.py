"""The way back of `save_response`: tables of frequency and time responses."""

import csv
import io
from array import array
from collections.abc import Iterator, Sequence
from pathlib import Path

import control
import numpy as np
import numpy.typing as npt

from halfdof_ctrl.base.arrays import ComplexArray, FloatArray
from halfdof_ctrl.base.errors import FileFormatError, ImportedModelWarning, give_warning
from halfdof_ctrl.base.names import control_labels
from halfdof_ctrl.files.containers import PathLike, ending
from halfdof_ctrl.files.formats.text_blocks import is_cut_short
from halfdof_ctrl.files.stiffness_tables import frequency_column, is_stiffness_table, stiffness_response
from halfdof_ctrl.files.tables import FREQUENCY_HEAD, PARTS, TABLE_ENDINGS, TIME_HEAD, without_guard

EVEN_STEPS = 1e-3  #: relative difference of steps that are equal but for the digits that are printed
ROW_AGREEMENT = 1e-6  #: relative; tables that went through a spreadsheet have lost digits
MANY_STEPS, FEW_GAPS, LONG_STEP = 8, 2, 1.5  #: steps of time that tell what is usual, and longer ones that are not


def load_response(path: PathLike) -> control.FrequencyResponseData | control.TimeResponseData:
    """Read a response that `save_response` wrote, or a table of a measured dynamic stiffness.

    Parameters
    ----------
    path : path-like
        Ends in ``.csv``. Columns of a measured stiffness have names and units, such as ``f [Hz], K' [N/mm], K''
        [N/mm]``, ``frequency [Hz]; modulus [N/m]; loss angle [deg]`` or ``f [Hz], storage [MPa], loss factor [-]``,
        with commas, semicolons or tabs between.

    Returns
    -------
    control.FrequencyResponseData or control.TimeResponseData
        With the values and names that were saved, to the last bit. Of a time response outputs and times; its states
        and inputs are not in the table. A stiffness has the output ``stiffness`` [N/m] or [Pa]: for `fit_prony` take
        ``data.omega / (2 * pi)`` and ``data.frdata[0, 0]``.

    Raises
    ------
    FileFormatError
        Another ending, a table of neither kind, a stiffness without units, rows whose numbers contradict each other,
        times that do not rise or have a gap; `line` says where.
    OSError
        The file cannot be read.

    Warns
    -----
    ImportedModelWarning
        A row stands twice, or frequencies turn back where others rise.

    Examples
    --------
    >>> import tempfile
    >>> data = frequency_response(hydromount().select("F_y", "y"), [1.0, 2.0])
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     save_response(data, f"{folder}/h.csv")
    ...     back = load_response(f"{folder}/h.csv")
    >>> bool((back.frdata == data.frdata).all()), back.output_labels
    (True, ['y'])
    """
    ending(path, TABLE_ENDINGS)
    text = _text(Path(path))
    header = next(_rows(text, path), [])
    rows = _rows(text, path)
    if header[: len(FREQUENCY_HEAD)] == list(FREQUENCY_HEAD):
        values = _numbers(rows, path)
        _doubt_order(values[0], values, path)
        return _frequency_response(list(map(without_guard, header)), values, path)
    if header[:1] == [TIME_HEAD]:
        return _time_response(list(map(without_guard, header[1:])), _numbers(rows, path), path)
    if is_stiffness_table(header):
        values = _numbers(rows, path)
        response = stiffness_response(header, values, path)
        _doubt_order(values[frequency_column(header)], values, path)
        return response
    msg = (
        f"{path}: the first line is no header of a response: it must begin with {FREQUENCY_HEAD[0]!r} and "
        f"{FREQUENCY_HEAD[1]!r}, or with {TIME_HEAD!r}, as save_response writes it; or name the columns of a measured "
        "stiffness with their units, such as f [Hz], K' [N/m], K'' [N/m]."
    )
    raise FileFormatError(msg, path=str(path), line=1)


def _text(path: Path) -> str:
    """Read the text of a table, and refuse what is none or was cut short."""
    if path.exists() and not path.is_file():
        msg = f"{path}: this is no file. Give a table that ends in .csv."
        raise FileFormatError(msg, path=str(path))
    content = path.read_bytes()
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as cause:
        line = content.count(b"\n", 0, cause.start) + 1
        msg = f"{path}, line {line}: bytes that are no text in UTF-8. The file is damaged, or of another kind."
        raise FileFormatError(msg, path=str(path), line=line) from cause
    own = text.startswith((FREQUENCY_HEAD[0], TIME_HEAD))
    if (own and not text.endswith("\n")) or is_cut_short(content):
        line = text.count("\n") + 1
        msg = f"{path}, line {line}: it does not end with a line end. The file is cut short: write or copy it anew."
        raise FileFormatError(msg, path=str(path), line=line)
    return text


def _rows(text: str, path: PathLike) -> Iterator[list[str]]:
    """Cut a table into cells."""
    rows = csv.reader(io.StringIO(text, newline=None), delimiter=_separator(text))
    try:
        yield from rows
    except csv.Error as cause:
        msg = f"{path}, line {rows.line_num}: {cause}. The file is damaged, or no table."
        raise FileFormatError(msg, path=str(path), line=rows.line_num) from cause


def _separator(text: str) -> str:
    """Tell what stands between the columns of the first line."""
    first = text.partition("\n")[0]
    return next((mark for mark in (";", "\t") if mark in first), ",")


def _numbers(rows: Iterator[Sequence[str]], path: PathLike) -> FloatArray:
    """Read all lines but the first as numbers, (columns, rows)."""
    width = len(next(rows))
    values = array("d")
    for number, row in enumerate(rows, start=2):
        if len(row) != width:
            msg = f"{path}, line {number}: {len(row)} entries where the header has {width}. Is the file whole?"
            raise FileFormatError(msg, path=str(path), line=number)
        try:
            values.extend([_number(entry) for entry in row])
        except ValueError as cause:
            msg = f"{path}, line {number}: {cause}."
            raise FileFormatError(msg, path=str(path), line=number) from cause
    return np.array(values).reshape(-1, width).T


def _number(entry: str) -> float:
    """Read a number, without the underscores that Python allows."""
    if "_" in entry:
        msg = f"could not convert string to float: {entry!r}"
        raise ValueError(msg)
    return float(entry)


def _frequency_response(header: Sequence[str], values: FloatArray, path: PathLike) -> control.FrequencyResponseData:
    first, count = len(FREQUENCY_HEAD), len(PARTS)
    channels = [name.removesuffix(f" {PARTS[0]}") for name in header[first::count]]
    expected = [f"{channel} {part}" for channel in channels for part in PARTS]
    grid = _grid(channels)
    if list(header[first:]) != expected or not channels or grid is None:
        msg = (
            f"{path}: the columns are not {', '.join(PARTS)} of channels 'output/input', as save_response writes them."
        )
        raise FileFormatError(msg, path=str(path), line=1)
    outputs, inputs = grid
    parts = values[first:].reshape(len(outputs), len(inputs), count, -1)
    response = np.empty(parts[:, :, 0].shape, dtype=np.complex128)
    response.real, response.imag = parts[:, :, 0], parts[:, :, 1]
    _require_agreement(values, response, parts, path)
    return control.FrequencyResponseData(
        response,
        values[0],
        0,
        inputs=list(control_labels(inputs)),
        outputs=list(control_labels(outputs)),
        plot_type="bode",
    )


def _doubt_order(frequencies: FloatArray, values: FloatArray, path: PathLike) -> None:
    """Warn of a row that stands twice, and of frequencies that turn back: rows may have been doubled or moved."""
    steps = np.diff(frequencies)
    same = (values[:, 1:] == values[:, :-1]).all(axis=0)
    turns = (steps < 0.0) & (steps > 0.0).any()
    if not (same | turns).any():
        _doubt_gaps(frequencies, path)
        return
    line = int(np.argmax(same | turns)) + 3
    what = "the same row as before" if same[line - 3] else "a frequency below the one before it, while others rise"
    msg = f"{path}, line {line}: {what}. If the table was not measured so, rows of it were doubled or moved."
    give_warning(msg, ImportedModelWarning)


def _doubt_gaps(frequencies: FloatArray, path: PathLike) -> None:
    """Warn of a few steps that are longer than all others, which are equal or have equal ratios."""
    grids = [frequencies, *([np.log(frequencies)] if (frequencies > 0.0).all() else [])]
    for grid in grids if frequencies.size > MANY_STEPS else ():
        gaps = _gaps(np.diff(grid), EVEN_STEPS)
        if gaps.any():
            line = int(np.argmax(gaps)) + 3
            msg = (
                f"{path}, line {line}: the frequencies leave a gap before it, and all others are spaced alike. If the "
                "table was not measured so, rows of it are missing."
            )
            give_warning(msg, ImportedModelWarning)
            return


def _gaps(steps: FloatArray, even: float) -> npt.NDArray[np.bool_]:
    """Tell which steps are longer than all others, if they are few and the others are equal, relatively."""
    ratio = steps / (float(np.median(steps)) or np.inf)
    long = ratio > LONG_STEP
    is_gap = 0 < int(long.sum()) <= FEW_GAPS and bool((np.abs(ratio[~long] - 1.0) <= even).all())
    return long & is_gap


def _require_agreement(values: FloatArray, response: ComplexArray, parts: FloatArray, path: PathLike) -> None:
    """Refuse a row whose numbers contradict each other: all of them say everything twice."""
    with np.errstate(invalid="ignore"):
        sound = _close(values[0], 2.0 * np.pi * values[1]) & _close(np.abs(response), parts[:, :, 2]).all(axis=(0, 1))
        turned = parts[:, :, 2] * np.exp(1j * np.radians(parts[:, :, 3]))
        off = np.abs(turned - response) > ROW_AGREEMENT * np.abs(response)
    sound &= ~off.any(axis=(0, 1))
    if not sound.all():
        line = int(np.argmin(sound)) + 2
        msg = (
            f"{path}, line {line}: its numbers contradict each other: omega is 2 pi f, magnitude and phase are those "
            "of the real and imaginary part. The file is damaged, or was changed by hand."
        )
        raise FileFormatError(msg, path=str(path), line=line)


def _close(found: FloatArray, expected: FloatArray) -> npt.NDArray[np.bool_]:
    return np.isclose(found, expected, rtol=ROW_AGREEMENT, atol=0.0, equal_nan=True)


def _require_times(times: FloatArray, path: PathLike) -> None:
    """Refuse times that do not rise, and a few steps among equal ones that are multiples of these."""
    steps = np.diff(times)
    wrong = ~(steps > 0.0)
    what = "times do not rise"
    if not wrong.any() and steps.size >= MANY_STEPS:
        wrong = _gaps(steps, ROW_AGREEMENT)
        what = "lines are missing before it: all other steps of time are equal and shorter"
    if wrong.any():
        line = int(np.argmax(wrong)) + 3
        msg = f"{path}, line {line}: {what}. The file is damaged: write or copy it anew."
        raise FileFormatError(msg, path=str(path), line=line)


def _time_response(names: Sequence[str], values: FloatArray, path: PathLike) -> control.TimeResponseData:
    _require_times(values[0], path)
    grid = _grid(names)
    if grid is None:
        return control.TimeResponseData(
            values[0], values[1:], output_labels=list(control_labels(tuple(names))), issiso=len(names) == 1
        )
    outputs, inputs = grid
    return control.TimeResponseData(
        values[0],
        values[1:].reshape(len(outputs), len(inputs), -1),
        output_labels=list(control_labels(outputs)),
        trace_labels=[f"From {label}" for label in control_labels(inputs)],
        trace_types=["step"] * len(inputs),
        multi_trace=True,
        issiso=len(outputs) == len(inputs) == 1,
    )


def _grid(channels: Sequence[str]) -> tuple[tuple[str, ...], tuple[str, ...]] | None:
    """Split channels ``output/input`` into names, which may hold slashes themselves; None where they are no grid."""
    pieces = channels[0].split("/") if channels else []
    for cut in range(1, len(pieces)):
        output = "/".join(pieces[:cut])
        inputs = []
        for channel in channels:
            if not channel.startswith(f"{output}/"):
                break
            inputs.append(channel.removeprefix(f"{output}/"))
        for count in range(len(inputs), 0, -1):
            last = f"/{inputs[0]}"
            outputs = [name.removesuffix(last) for name in channels[::count]]
            if [f"{out}/{source}" for out in outputs for source in inputs[:count]] == list(channels):
                return tuple(outputs), tuple(inputs[:count])
    return None
