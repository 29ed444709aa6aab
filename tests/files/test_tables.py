"""Tables that `save_response` and `save_gain` write: no spreadsheet takes a name for a formula."""

import csv
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from halfdof_ctrl import load_response, lqr, mechss, step_response
from halfdof_ctrl.base.errors import FileFormatError, ImportedModelWarning
from halfdof_ctrl.files.tables import save_gain, save_response
from halfdof_ctrl.systems.frequency import frequency_response

FORMULAS = ("=", "+", "-", "@")


def cells(path: Path) -> list[list[str]]:
    """Read a table as a spreadsheet does."""
    with path.open(encoding="utf-8", newline="") as stream:
        return list(csv.reader(stream))


@pytest.mark.parametrize("dof", ["=1+1", "+x", "-x", "@x", "'=x", "'y", "y"])
def test_a_name_is_no_formula_and_comes_back(tmp_path: Path, dof: str) -> None:
    """An apostrophe stands before what begins like one, and `load_response` takes it away again."""
    model = mechss([[1.0]], [[1.0]], [[4.0]], dofs=[dof])
    path = tmp_path / "table.csv"
    for data in (frequency_response(model, np.array([1.0, 2.0])), step_response(model, 1.0)):
        save_response(data, path)
        assert not any(cell.startswith(FORMULAS) for cell in cells(path)[0])
        assert load_response(path).output_labels == data.output_labels
    save_gain(lqr(model, displacement={dof: 1.0}, effort={f"F_{dof}": 1.0}), path)
    assert not any(cell.startswith(FORMULAS) for cell in cells(path)[0])


def test_a_damaged_table_is_refused_with_its_line(tmp_path: Path) -> None:
    """Bytes that are no text, and a last line that is cut; a response of ours always ends with a line end."""
    path = tmp_path / "table.csv"
    save_response(frequency_response(mechss([[1.0]], [[1.0]], [[4.0]]), np.array([1.0, 2.0, 3.0])), path)
    content = path.read_bytes()
    path.write_bytes(content[:-3])
    with pytest.raises(FileFormatError, match=r"line 4: it does not end with a line end.*cut short"):
        load_response(path)
    path.write_bytes(content.replace(b"\n2.0", b"\n\xff2.0"))
    with pytest.raises(FileFormatError, match=r"line 3: bytes that are no text in UTF-8") as caught:
        load_response(path)
    assert caught.value.line == 3
    (tmp_path / "folder.csv").mkdir()
    with pytest.raises(FileFormatError, match="this is no file"):
        load_response(tmp_path / "folder.csv")


@pytest.mark.parametrize("column", range(6))
def test_numbers_of_a_row_that_contradict_each_other_are_refused(tmp_path: Path, column: int) -> None:
    """Omega and f, parts and magnitude and phase: a changed digit in any of them is found, in the order as saved."""
    path = tmp_path / "table.csv"
    model = mechss([[1.0]], [[1.0]], [[4.0]])
    data = frequency_response(model, np.array([3.0, 2.0, 1.0, 0.5]))
    save_response(data, path)
    np.testing.assert_array_equal(load_response(path).omega, data.omega)
    table = cells(path)
    table[3][column] = repr(float(table[3][column]) * 1.01)
    path.write_text("".join([",".join(row) + "\n" for row in table]))
    with pytest.raises(FileFormatError, match="line 4: its numbers contradict each other"):
        load_response(path)


@pytest.mark.parametrize(
    ("order", "message"),
    [
        ([0, 1, 2, 2, *range(3, 12)], "line 5: times do not rise"),
        ([0, 2, 1, *range(3, 12)], "line 4: times do not rise"),
        ([0, 1, 2, *range(5, 20)], "line 5: lines are missing before it"),
    ],
)
def test_rows_of_a_time_response_that_were_lost_doubled_or_moved_are_refused(
    tmp_path: Path, order: list[int], message: str
) -> None:
    """Times rise, in equal steps or in steps that all differ."""
    path = tmp_path / "table.csv"
    data = step_response(mechss([[1.0]], [[1.0]], [[4.0]]), np.linspace(0.0, 2.0, 20))
    save_response(data, path)
    head, *rows = path.read_text().splitlines()
    path.write_text("\n".join([head, *[rows[number] for number in order]]) + "\n")
    with pytest.raises(FileFormatError, match=message):
        load_response(path)
    path.write_text("\n".join([head, *[rows[number] for number in (0, 1, 3, 4, 8, 10, 11, 15, 16, 19)]]) + "\n")
    assert load_response(path).t.size == 10


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("x" * 200_000, "line 1: field larger than field limit"),
        ("(" * 100_000, "the first line is no header of a response"),
        ("t [s],y\n0,1_0\n", "line 2: could not convert string to float: '1_0'"),
        ("t [s],y\n0," + "1" * 200_000 + "\n", "line 2: field larger than field limit"),
        ("t [s],y\n0,1,2\n", "line 2: 3 entries where the header has 2"),
        ("", "the first line is no header of a response"),
    ],
    ids=range(6),
)
def test_what_is_no_table_is_refused(tmp_path: Path, content: str, message: str) -> None:
    """Cells without an end, brackets without an end, and numbers of another language."""
    path = tmp_path / "table.csv"
    path.write_text(content)
    with pytest.raises(FileFormatError, match=message):
        load_response(path)


@pytest.mark.parametrize(
    ("omega", "message"),
    [
        ([1.0, 2.0, 2.0, 3.0], "line 4: the same row as before"),
        ([1.0, 3.0, 2.0, 4.0], "line 4: a frequency below the one before it, while others rise"),
    ],
)
def test_rows_of_a_frequency_response_that_were_doubled_or_moved_are_told(
    tmp_path: Path, omega: list[float], message: str
) -> None:
    """They come back as they stand, since such a response can be saved; one that falls throughout is as good."""
    path = tmp_path / "table.csv"
    data = frequency_response(mechss([[1.0]], [[1.0]], [[4.0]]), np.array(omega))
    save_response(data, path)
    with pytest.warns(ImportedModelWarning, match=message):
        np.testing.assert_array_equal(load_response(path).omega, data.omega)
    table = ["f [Hz],K' [N/m],K'' [N/m]", *[f"{value},{value + 9.0},1.0" for value in omega]]
    path.write_text("\n".join(table) + "\n")
    with pytest.warns(ImportedModelWarning, match=message):
        load_response(path)


@pytest.mark.parametrize("spacing", [np.linspace, np.geomspace])
def test_rows_of_a_frequency_response_that_are_missing_are_told(tmp_path: Path, spacing: Callable[..., Any]) -> None:
    """A gap in a grid that is even otherwise; grids without a rule and even ones say nothing."""
    path = tmp_path / "table.csv"
    omega = spacing(1.0, 100.0, 25)
    model = mechss([[1.0]], [[1.0]], [[4.0]])
    save_response(frequency_response(model, np.delete(omega, [7, 8])), path)
    with pytest.warns(ImportedModelWarning, match="line 9: the frequencies leave a gap before it"):
        assert load_response(path).omega.size == 23
    for whole in (omega, np.sort(np.random.default_rng(3).uniform(1.0, 100.0, 25))):
        save_response(frequency_response(model, whole), path)
        np.testing.assert_array_equal(load_response(path).omega, whole)
