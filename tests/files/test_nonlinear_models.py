"""Nonlinear models in files and on the command line."""

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

import halfdof_ctrl as hd
from halfdof_ctrl import Damper, Law, NonlinearModel, Spring, laws, load_model, mechss, nlmechss, save_model
from halfdof_ctrl.cli import main
from halfdof_ctrl.errors import FileFormatError, ParameterError
from support.mounts_with_laws import oil_mount


@pytest.mark.parametrize("ending", [".npz", ".mat"])
def test_a_nonlinear_model_comes_back_from_a_file(tmp_path: Path, ending: str) -> None:
    """Laws by name and numbers, to the last bit, beside M, C, K and the names."""
    curve = laws.table([-1, 0.1, 2], [-3, 0, 1 / 7], extend="linear")
    model = nlmechss(
        hd.hydromount(), [Damper("y2", law=laws.quadratic(1e4, 30)), Spring("y", "y2", curve), Spring("y", law=7)]
    )
    save_model(model, tmp_path / f"oil{ending}")
    found = load_model(tmp_path / f"oil{ending}")
    assert isinstance(found, NonlinearModel)
    assert (found.elements, found.dofs, found.inputs, found.name) == (
        model.elements,
        model.dofs,
        model.inputs,
        model.name,
    )
    assert found.linear.K.tolist() == model.linear.K.tolist()


def test_prescribed_motion_and_elements_share_a_file(tmp_path: Path) -> None:
    """The base stays a DOF, and its reaction an output."""
    base = mechss(np.eye(2), None, [[1.0, -1.0], [-1.0, 1.0]]).prescribe_motion("q1", "acceleration")
    model = nlmechss(base, Damper("q0", "q1", laws.quadratic(3)))
    save_model(model, tmp_path / "base.npz")
    assert repr(load_model(tmp_path / "base.npz")) == repr(model)


def test_a_function_is_not_kept(tmp_path: Path) -> None:
    """By its name, and no file is left."""
    with pytest.raises(ParameterError, match=r"the law sinh of Damper.* is a function of your own"):
        save_model(oil_mount(Law(np.sinh)), tmp_path / "oil.npz")
    assert not list(tmp_path.iterdir())


def test_elements_that_are_none_are_refused_by_the_file(tmp_path: Path) -> None:
    """Text in a file is parsed, never run."""
    np.savez(tmp_path / "bad.npz", K=np.eye(1), M=np.eye(1), elements=np.array(['["damper", "q0", null, "exec(1)"]']))
    with pytest.raises(FileFormatError, match=r"bad.npz: There is no law 'exec'"):
        load_model(tmp_path / "bad.npz")


def test_info_prints_the_nonlinear_model(capsys: pytest.CaptureFixture[str]) -> None:
    """With what the element made of its DOF."""
    assert main(["info", "hydromount", "-p", "C_h=0", "--element", "damper y2 quadratic(1e4,30)"]) == 0
    assert "y2: half, by damper 1 (quadratic); its column of C is null" in capsys.readouterr().out


def test_step_writes_the_nonlinear_response(tmp_path: Path) -> None:
    """The last row is the static deflection under the amplitude."""
    file = tmp_path / "step.csv"
    arguments = ["step", "hydromount", "-p", "C_h=0", "--element", "damper y2 quadratic(1e4,30)", "--outputs", "y"]
    assert main([*arguments, "--amplitude", "21", "--time", "30", "-o", str(file)]) == 0
    rows = np.loadtxt(file, delimiter=",", skiprows=1)
    assert_allclose(rows[-1, 1], 21.0 / 5250.0, rtol=1e-3)


def test_linear_commands_take_the_tangent_at_rest(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """`poles` of the oil mount are those of C_h = 30; elements of a file and of the line add up."""
    save_model(oil_mount(outputs=("y",)), tmp_path / "oil.npz")
    assert main(["poles", str(tmp_path / "oil.npz")]) == 0
    by_law = capsys.readouterr().out
    assert main(["poles", "hydromount", "-p", "C_h=30", "--inputs", "F_y", "--outputs", "y"]) == 0
    assert by_law == capsys.readouterr().out
    assert main(["info", str(tmp_path / "oil.npz"), "--element", "spring y gap(1e5, 0.01)"]) == 0
    assert 'spring 1: Spring("y", law=gap(1e5, 0.01))' in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--element", "damper y2 quadratic(x)"], "is no number"),
        (["--element", "damper z 3"], "no DOF for damper 1 (linear): 'z'"),
        (["--element", "damper y quadratic(1)", "--inputs", "F_y,F_y1"], "takes a step of one input"),
    ],
)
def test_refusals_are_one_line(
    arguments: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Exit code 2, and nothing is written."""
    assert main(["step", "hydromount", *arguments, "-o", str(tmp_path / "a.csv")]) == 2
    assert message in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_a_figure_of_a_nonlinear_step_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Numbers only."""
    arguments = ["step", "hydromount", "--element", "damper y quadratic(1)", "-o", str(tmp_path / "a.png")]
    assert main(arguments) == 2
    assert "written as numbers: give -o FILE.csv" in capsys.readouterr().err
