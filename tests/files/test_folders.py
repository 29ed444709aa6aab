"""Claims about folders: the models in them, files that are not read, options that are none."""

from pathlib import Path

import numpy as np
import pytest

from halfdof_ctrl import load_model
from halfdof_ctrl.base.errors import FileFormatError, ImportedModelWarning, ParameterError
from halfdof_ctrl.cli import main
from halfdof_ctrl.files.folders import models_in
from halfdof_ctrl.files.foreign import FOREIGN_ENDINGS

K = np.array([[2.0, -1.0], [-1.0, 2.0]])


def table(folder: Path, *names: str) -> None:
    """Write dense tables."""
    for name in names:
        np.savetxt(folder / name, K)


def test_the_models_of_a_folder_are_told_apart(tmp_path: Path) -> None:
    """By their names; notes and figures are none."""
    table(tmp_path, "K_car.txt", "M_car.txt", "K_bus.txt", "M_bus.txt", "C_bus.txt")
    np.savez(tmp_path / "plane.npz", K=K, M=K)
    np.savez(tmp_path / "states.npz", A=K, B=K, C=K, D=K)
    (tmp_path / "notes.txt").write_text("nothing")
    found = [[path.name for path in files] for files in models_in(tmp_path)]
    assert found == [["C_bus.txt", "K_bus.txt", "M_bus.txt"], ["K_car.txt", "M_car.txt"], ["plane.npz"]]


def test_info_lists_the_models_of_a_folder(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Each with the file to give."""
    table(tmp_path, "K_car.txt", "M_car.txt", "K_bus.txt", "M_bus.txt")
    assert main(["info", str(tmp_path)]) == 0
    out = capsys.readouterr().out
    assert "2 models" in out
    assert "K_car.txt: K_car.txt, M_car.txt" in out


def test_a_folder_with_one_archive_is_that_model(tmp_path: Path) -> None:
    """Beside a state space, whose C is no damping."""
    np.savez(tmp_path / "model.npz", K=K, M=K, C=K)
    np.savez(tmp_path / "states.npz", A=K, B=K, C=3 * K, D=K, inputs=["a", "b"], states=["c", "d"])
    np.testing.assert_array_equal(load_model(tmp_path).C, K)


@pytest.mark.parametrize("ending", sorted(FOREIGN_ENDINGS))
def test_files_that_are_not_read_are_called_by_their_name(tmp_path: Path, ending: str) -> None:
    """With the way to what is read."""
    path = tmp_path / f"job{ending}"
    path.write_bytes(b"\x00\x01\x02 whatever")
    with pytest.raises(FileFormatError, match=r"this is .*, which is not read. Instead: "):
        load_model(path)


def test_a_workspace_of_octave_is_no_table(tmp_path: Path) -> None:
    """Its numbers stand behind comments."""
    (tmp_path / "a.mat").write_text("# Created by Octave 8\n# name: K\n# type: matrix\n# rows: 1\n# columns: 1\n 3\n")
    with pytest.raises(FileFormatError, match="workspace of Octave"):
        load_model(tmp_path / "a.mat")


def test_numbers_that_matlab_saves_as_text_are_a_table(tmp_path: Path) -> None:
    """By save -ascii K.mat."""
    np.savetxt(tmp_path / "K.mat", K)
    model = load_model(tmp_path / "K.mat", matrices={"M": None, "C": None})
    assert model.K.toarray().tolist() == K.tolist()  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("options", "name"),
    [
        ({"triangle": "left"}, "triangle"),
        ({"triangle": True}, "triangle"),
        ({"remove_fixed": "yes"}, "remove_fixed"),
        ({"matrices": "K"}, "matrices"),
        ({"matrices": {"K": 3}}, "matrices"),
    ],
)
def test_wrong_options_are_refused(tmp_path: Path, options: dict[str, object], name: str) -> None:
    """For every kind of file."""
    table(tmp_path, "K.txt")
    np.savez(tmp_path / "K.npz", K=K)
    for path in (tmp_path / "K.txt", tmp_path / "K.npz"):
        with pytest.raises(ParameterError, match=name):
            load_model(path, **options)  # type: ignore[arg-type]


@pytest.mark.parametrize("path", [3, None, [3], {"K": 3}, {"a"}])
def test_what_is_no_path_is_refused(path: object) -> None:
    """By its type."""
    with pytest.raises(ParameterError, match="take a path"):
        load_model(path)  # type: ignore[arg-type]
    with pytest.raises(FileFormatError, match="No file is given"):
        load_model({})


def test_the_command_takes_what_the_refusal_says(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """--matrix C=D, and C= for none."""
    np.savez(tmp_path / "a.npz", K=K, M=K, D=0.1 * K)
    assert main(["info", str(tmp_path / "a.npz")]) == 2
    assert main(["info", str(tmp_path / "a.npz"), "--matrix", "C=D"]) == 0
    assert "4 states" in capsys.readouterr().out
    assert main(["info", str(tmp_path / "a.npz"), "--matrix", "D=", "--matrix", "C="]) == 0
    assert main(["info", str(tmp_path / "a.npz"), "--matrix", "C"]) == 2
    assert main(["info", "hydromount", "--triangle", "lower"]) == 2
    assert "is built in" in capsys.readouterr().err


def test_notes_about_damping_are_no_damping(tmp_path: Path) -> None:
    """Beside matrices in a folder."""
    table(tmp_path, "K.txt", "M.txt")
    (tmp_path / "damping.txt").write_text("The damping was not measured.\n")
    with pytest.warns(ImportedModelWarning, match=r"no damping C in K\.txt, M\.txt"):
        load_model(tmp_path)
