"""Reports and the command show the package's warnings, each once, and no other package's."""

import subprocess
import sys
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import halfdof_ctrl.report
from halfdof_ctrl import mechss
from halfdof_ctrl.base.errors import give_warning, own_messages, recording_warnings
from halfdof_ctrl.cli import main
from halfdof_ctrl.errors import HalfdofWarning, LostDigitsWarning, NearlyMasslessWarning
from halfdof_ctrl.files.models import save_model
from halfdof_ctrl.report import write_report
from support.warned import raised_in

COMMAND = [sys.executable, "-c", "from halfdof_ctrl.cli import main; raise SystemExit(main())"]
LIGHT = mechss(np.diag([1.0, 1e-13]), np.eye(2), np.diag([4.0, 1.0]), dofs=["a", "b"]).select("F_a", "a")
FOREIGN = "by control.statesp"  #: the words of a warning that python-control raises


@pytest.fixture
def _control_warns(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let python-control deprecate something, and doubt something, while a model is reduced."""
    before: Any = vars(halfdof_ctrl.report)["exact_reduction"]

    def warning(*arguments: object) -> object:
        for kind in (DeprecationWarning, UserWarning):
            raised_in("control.statesp", kind)()
        return before(*arguments)

    monkeypatch.setattr("halfdof_ctrl.report.exact_reduction", warning)


@pytest.mark.usefixtures("_control_warns")
def test_a_report_notes_the_packages_own_warnings_only(tmp_path: Path) -> None:
    """All are passed on to who called; the page has ours."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        report = write_report(LIGHT, tmp_path / "report")
    assert {DeprecationWarning, UserWarning, NearlyMasslessWarning} <= {warning.category for warning in caught}
    page = (tmp_path / "report" / "index.html").read_text(encoding="utf-8")
    for words in (page, *report.notes):
        assert FOREIGN not in words
    assert "DOFs b have a mass" in page


@pytest.mark.usefixtures("_control_warns")
def test_the_command_shows_the_packages_own_warnings_only(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """On stderr, once, though the same is said by the reduction and by the report."""
    monkeypatch.chdir(tmp_path)
    save_model(LIGHT, "model.npz")
    with warnings.catch_warnings():
        warnings.simplefilter("always")
        assert main(["report", "model.npz", "-o", "report"]) == 0
    printed = capsys.readouterr()
    assert printed.err.count("\n") == 1
    assert printed.err.startswith("halfdof-ctrl: warning: DOFs b have a mass of at most")
    assert FOREIGN not in printed.out


def test_a_spring_without_mass_is_reported_without_a_word_on_stderr(tmp_path: Path) -> None:
    """Without states, python-control does what NumPy 2.5 deprecates, and only python-control can cure that."""
    save_model(mechss([[0]], [[0]], [[2]]), tmp_path / "model.npz")
    command = [*COMMAND, "report", "model.npz", "-o", "report"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False, timeout=120)
    assert (done.returncode, done.stderr) == (0, "")
    assert "eprecat" not in (tmp_path / "report" / "index.html").read_text(encoding="utf-8") + done.stdout


def test_own_warnings_are_recorded_each_time_and_told_once() -> None:
    """Also where the same place warned before; what filters make of other packages' warnings stays as it is."""
    filters = list(warnings.filters)
    with recording_warnings() as caught:
        assert warnings.filters == filters
        for _ in range(2):
            give_warning("few digits", LostDigitsWarning)
        with pytest.raises(RuntimeWarning, match=FOREIGN):
            raised_in("control.statesp", RuntimeWarning)()
        raised_in("control.statesp", DeprecationWarning)()
    assert [warning.category for warning in caught] == [LostDigitsWarning] * 2
    assert own_messages(caught) == ["few digits"]


def test_every_warning_of_the_package_has_its_base_class() -> None:
    """By which the report and the command tell it from others."""
    kinds = [kind for kind in vars(halfdof_ctrl.errors).values() if isinstance(kind, type)]
    ours = [kind for kind in kinds if issubclass(kind, Warning)]
    assert len(ours) > 7
    assert all(issubclass(kind, HalfdofWarning) for kind in ours)
