"""Models of thousands of DOFs with few states, through the command: what is small about them is what counts."""

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from halfdof_ctrl import crosscheck, lqr, mech2ss, save_model
from halfdof_ctrl.cli import main
from support.nets import net

SIDE = 47  #: 2209 DOFs
STATES = 14


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Write a net with two signals, and one with all."""
    folder = tmp_path_factory.mktemp("nets")
    save_model(net(SIDE).select(["F_q3"], ["q3", "q2000"]), folder / "two.npz")
    save_model(net(SIDE), folder / "all.npz")
    return folder


@pytest.mark.parametrize(
    ("command", "said"),
    [
        (["poles"], "14 finite and 4404 infinite"),
        (["check"], "Cross-check passed"),
        (["info"], "14 states, 4404 infinite eigenvalues removed, index 1"),
        (["lqr"], "StateFeedback"),
        (["lqr", "--displacement", "q77=1e6", "--effort", "F_q3=1e-4"], "StateFeedback u = -K x, 1 x 14"),
        (["ss", "-o", "ss.npz"], ""),
        (["step", "-o", "step.csv"], ""),
        (["bode", "--points", "20", "-o", "bode.csv"], ""),
        (["poles", "-o", "poles.svg"], "4404 infinite"),
    ],
)
def test_commands_take_a_model_with_two_signals(
    files: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    command: list[str],
    said: str,
) -> None:
    """Each does what it does for a small model."""
    monkeypatch.chdir(tmp_path)
    assert main([command[0], str(files / "two.npz"), *command[1:]]) == 0
    out, err = capsys.readouterr()
    assert said in out
    assert err == ""
    assert all(Path(name).stat().st_size > 0 for name in command if name.startswith(f"{command[0]}."))


@pytest.mark.parametrize("command", [["poles"], ["check"], ["lqr"], ["ss", "-o", "ss.npz"]])
def test_commands_choose_signals_where_nobody_does(
    files: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], command: list[str]
) -> None:
    """Those of the first masses, and they say so."""
    monkeypatch.chdir(tmp_path)
    assert main([command[0], str(files / "all.npz"), *command[1:]]) == 0
    err = capsys.readouterr().err
    assert err.startswith(
        "halfdof-ctrl: warning: The model has 2209 inputs and 2209 outputs, too many for this command"
    )
    assert "Choose others by --inputs and --outputs" in err


def test_a_report_says_that_it_is_of_a_condensed_model(files: Path, tmp_path: Path) -> None:
    """With how many DOFs were condensed, on the page."""
    assert main(["report", str(files / "two.npz"), "-o", str(tmp_path / "report")]) == 0
    assert "static ones, that no input or output is about, were condensed" in (
        tmp_path / "report/index.html"
    ).read_text("utf-8")


def test_the_check_sees_a_wrong_state_space() -> None:
    """A stiffness that is wrong by a hundred-thousandth."""
    model = net(SIDE).select("F_q3", "q2000")
    sys = mech2ss(model)
    assert crosscheck(model, sys).passed
    sys.A = sys.A * (1.0 + 1e-5)
    assert not crosscheck(model, sys).passed


def test_a_regulator_of_a_large_model_stabilizes_the_whole() -> None:
    """Its poles make the closed loop of the sparse model singular: det(1 + K x(s)) = 0."""
    model = net(SIDE).select("F_q3", "q3")
    feedback = lqr(model, displacement={"q3": 1e6}, effort={"F_q3": 1e-4})
    sys = mech2ss(model)
    closed = np.linalg.eigvals(np.asarray(sys.A) - np.asarray(sys.B) @ np.asarray(feedback.K))
    assert_allclose(np.sort_complex(closed), np.sort_complex(feedback.poles), rtol=1e-6)
    assert (closed.real < 0.0).all()
