"""Tables that `save_response` and `save_gain` write: no spreadsheet takes a name for a formula."""

import csv
from pathlib import Path

import numpy as np
import pytest

from halfdof_ctrl import load_response, lqr, mechss, step_response
from halfdof_ctrl.base.errors import FileFormatError
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
