"""Tables that `save_response` and `save_gain` write: no spreadsheet takes a name for a formula."""

import csv
from pathlib import Path

import numpy as np
import pytest

from halfdof_ctrl import load_response, lqr, mechss, step_response
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
