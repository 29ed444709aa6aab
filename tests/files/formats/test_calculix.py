"""Claims about CalculiX: the upper triangle, names from .dof, and frequencies as its own."""

from pathlib import Path

import numpy as np
import pytest
import scipy.linalg

from halfdof_ctrl import load_model
from halfdof_ctrl.base.errors import FileFormatError, ImportedModelWarning
from halfdof_ctrl.files.formats.calculix import read_calculix, read_dofs

K = np.array([[4.0, -1.0, 0.0], [-1.0, 3.0, -0.5], [0.0, -0.5, 2.0]])
STI = b"1 1  4.0e+00\n1 2 -1.0e+00\n2 2  3.0e+00\n1 3  0.0e+00\n2 3 -5.0e-01\n3 3  2.0e+00\n"
MAS = b"1 1  1.0e+00\n1 2  0.0e+00\n2 2  1.0e+00\n1 3  0.0e+00\n2 3  0.0e+00\n3 3  0.0e+00\n"  # zeros have lines too
DOF = b"5.1\n5.3\n60.2\n"
BEAM = Path(__file__).parents[2] / "data" / "calculix" / "beam.sti"  # of beam.inp, as CalculiX 2.20 writes it


@pytest.mark.parametrize("given", ["job.sti", "job.mas", "job.dof", "."])
def test_the_three_files_are_one_model(tmp_path: Path, given: str) -> None:
    """From any of them, or the folder."""
    for name, content in (("job.sti", STI), ("job.mas", MAS), ("job.dof", DOF), ("other.sti.bak", b"")):
        (tmp_path / name).write_bytes(content)
    with pytest.warns(ImportedModelWarning, match="no damping C"):
        model = load_model(tmp_path / given)
    assert model.dofs == ("n5_u1", "n5_u3", "n60_u2")
    np.testing.assert_array_equal(model.K.toarray(), K)
    np.testing.assert_array_equal(model.M.toarray(), np.diag([1.0, 1.0, 0.0]))


@pytest.mark.parametrize(("name", "lines"), [("job.mas", 3), ("job.sti", 3)])
def test_a_file_that_ends_before_the_last_row_was_cut(tmp_path: Path, name: str, lines: int) -> None:
    """CalculiX writes the zeros of each row too, so that every row that the .dof file names has its lines."""
    files = {"job.sti": STI, "job.mas": MAS, "job.dof": DOF}
    files[name] = b"".join(files[name].splitlines(keepends=True)[:lines])
    for each, content in files.items():
        (tmp_path / each).write_bytes(content)
    with pytest.raises(FileFormatError, match=r"2 rows, but job\.dof names 3"):
        load_model(tmp_path)


def test_a_row_without_a_line_was_lost() -> None:
    """Somewhere in the middle, as where a part of a file is missing."""
    with pytest.raises(FileFormatError, match="row 2 has no line on its diagonal"):
        read_calculix(STI.replace(b"2 2  3.0e+00\n", b""), ".sti", 99)


@pytest.mark.parametrize("name", ["job.sti", "job.mas"])
def test_a_line_that_only_one_of_the_files_has_is_told(tmp_path: Path, name: str) -> None:
    """Off the diagonal: zeros are written, so that both files have lines for the same places."""
    files = {"job.sti": STI, "job.mas": MAS, "job.dof": DOF}
    files[name] = b"".join([line for line in files[name].splitlines(keepends=True) if not line.startswith(b"2 3")])
    for each, content in files.items():
        (tmp_path / each).write_bytes(content)
    with pytest.warns(ImportedModelWarning, match="1 are in one of them alone, the first in row 2 and column 3"):
        load_model({"K": tmp_path / "job.sti", "M": tmp_path / "job.mas"})


def test_a_beam_has_the_frequencies_that_calculix_found() -> None:
    """105.425, 665.943, 1891.57 Hz, each twice; six digits are known."""
    with pytest.warns(ImportedModelWarning, match="no damping C"):
        model = load_model(BEAM)
    inverse = scipy.linalg.eigh(model.M.toarray(), model.K.toarray(), eigvals_only=True)[::-1][:6]
    expected = np.repeat([105.425, 665.943, 1891.57], 2)
    np.testing.assert_allclose(np.sqrt(1.0 / inverse) / (2.0 * np.pi), expected, rtol=3e-6)
    assert model.known_to == 5e-14


def test_both_triangles_are_taken_as_they_are() -> None:
    """Nothing is completed that is there."""
    raw = read_calculix(b"1 1 4.\n1 2 -1.\n2 1 -3.\n2 2 3.\n", ".sti", 9)
    np.testing.assert_array_equal(raw.matrix.toarray(), [[4.0, -1.0], [-3.0, 3.0]])
    assert not raw.is_half_stored


@pytest.mark.parametrize("content", [b"0 0 4.\n", b"1 20 4.\n", b"", b"1.5 1 4.\n"])
def test_places_that_are_none_are_refused(content: bytes) -> None:
    """From zero, too large, none, fractions."""
    with pytest.raises(FileFormatError, match=r"do not make a matrix|must be whole"):
        read_calculix(content, ".sti", 9)


@pytest.mark.parametrize("content", [b"5.1\n5\n", b"", b"5.1\n-5.2\n"])
def test_labels_that_are_none_are_refused(content: bytes) -> None:
    """With the line."""
    with pytest.raises(FileFormatError, match=r"a node and its DOF"):
        read_dofs(content)
