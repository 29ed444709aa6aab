"""Claims about DMIG and EXTRN entries: three kinds of fields read alike, pyyeti agrees, and damage is told."""

from pathlib import Path

import numpy as np
import pytest

from halfdof_ctrl import inspect_files, load_model
from halfdof_ctrl.base.errors import FileFormatError, ImportedModelWarning
from halfdof_ctrl.files.formats.dmig import has_dmig, has_extrn, read_dmig, read_extrn
from support import exported_files as exported
from support.fe_files import NAMES, C, K, M, dmig

SMALL = """\
DMIG    KAAX           0       6       1       0
DMIG    KAAX           1       1               1       1     6.0
*
DMIG    KAAX           1       1               2       1   -2.+0
DMIG    KAAX           2       1               2       1   3.0-0
               3       1    -1.0
DMIG    KAAX           3       1               3       1   1.D+0
"""
FREE = """\
DMIG,KAAX,0,6,2,0
DMIG,KAAX,1,1,,1,1,6.0,,+A
+A,2,1,-2.0
DMIG,KAAX,2,1,,2,1,3.0
,3,1,-1.0 $ comment
DMIG,KAAX,3,1,,3,1,1.0
"""


@pytest.mark.parametrize("text", [dmig({"KAAX": K}), dmig({"KAAX": K}, form=1), SMALL, FREE])
def test_large_small_and_free_fields_read_alike(text: str) -> None:
    """Symmetric with one entry a pair, or square with all."""
    assert has_dmig(text.encode())
    (found,) = read_dmig(text.encode())
    np.testing.assert_array_equal(found.matrix.toarray(), K)
    assert (found.title, found.dofs) == ("kaax", NAMES)


def test_matrices_are_told_apart_by_their_names() -> None:
    """Mass, damping and stiffness in one punch file; a null column is no DOF of its matrix."""
    found = {raw.title: raw for raw in read_dmig(dmig({"KAAX": K, "MAAX": M, "BAAX": C}).encode())}
    assert found["maax"].dofs == NAMES[:2]
    np.testing.assert_array_equal(found["maax"].matrix.toarray(), M[:2, :2])
    np.testing.assert_array_equal(found["baax"].matrix.toarray(), C[1:, 1:])


def test_scalar_points_and_complex_values_are_read() -> None:
    """Component 0, and the imaginary part where TIN says complex."""
    (found,) = read_dmig(b"DMIG,K2PP,0,6,4,0\nDMIG,K2PP,9,0,,9,0,2.0,0.5\n")
    assert found.dofs == ("n9",)
    assert found.matrix.toarray().tolist() == [[2.0 + 0.5j]]


def test_other_entries_are_passed_over_and_rectangles_are_no_matrices_of_the_equations() -> None:
    """A bulk data file holds more; rows and columns of form 2 have DOFs of their own."""
    text = "GRID,1,,0.,0.,0.\n" + FREE + "DMIG,BAAX,0,2,2,0\nDMIG,BAAX,1,1,,2,1,1.0\nENDDATA\n"
    square, rectangle = read_dmig(text.encode())
    assert (square.title, square.rectangular) == ("kaax", False)
    assert (rectangle.title, rectangle.rectangular, rectangle.dofs) == ("baax", True, ("n2_u1",))


def test_columns_of_a_load_are_numbered_up_to_ncol(tmp_path: Path) -> None:
    """Form 9: the second of three columns is null, and column 3 has a force on another DOF."""
    load = "DMIG,PAX,0,9,2,0,,,3\nDMIG,PAX,1,0,,2,1,5.0\nDMIG,PAX,3,0,,1,1,-2.0\n"
    (tmp_path / "job.pch").write_text(FREE + load)
    with pytest.warns(ImportedModelWarning, match="no (mass|damping)"):
        model = load_model(tmp_path / "job.pch", matrices={"B": "pax"})
    np.testing.assert_array_equal(model.B.toarray(), [[0.0, 0.0, -2.0], [5.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    assert "pax (2 x 3)" in repr(inspect_files(tmp_path / "job.pch"))


@pytest.mark.parametrize(
    "load",
    [
        "DMIG,PAX,0,9,2,0,,,2\nDMIG,PAX,3,0,,2,1,5.0\n",
        "DMIG,PAX,0,9,2,0,,,-2\n",
        "DMIG,PAX,0,9,2,0,,,99999999\nDMIG,PAX,3,0,,2,1,5.0\n",
    ],
)
def test_a_column_beyond_ncol_is_refused(load: str) -> None:
    """The header says how many there are."""
    with pytest.raises(
        FileFormatError, match=r"pax has a column 3, but its header says NCOL = (2|9{8})\.|-2 columns, which"
    ):
        read_dmig((FREE + load).encode())


def test_a_load_without_ncol_is_doubted() -> None:
    """Form 9 needs it; the last columns may be null."""
    (_, load) = read_dmig((FREE + "DMIG,PAX,0,9,2,0\nDMIG,PAX,2,0,,2,1,5.0\n").encode())
    assert load.matrix.shape == (1, 2)
    assert "does not say how many columns it has (NCOL), so there may be more" in load.doubts


def test_the_number_of_dofs_that_nastran_punches_is_compared() -> None:
    """NCOL of a square matrix counts the DOFs of its set, which only all matrices together have."""
    text = dmig({"MAAX": M, "KAAX": K}).replace(f"{2:8d}{0:8d}\n", f"{2:8d}{0:8d}{'':16s}{len(K):8d}\n")
    assert text.count(f"{len(K):8d}\n") == 2
    assert not any(raw.doubts for raw in read_dmig(text.encode()))
    cut = "DMIG*".join(text.split("DMIG*")[:-2])
    doubts = [doubt for raw in read_dmig(cut.encode()) for doubt in raw.doubts]
    assert doubts == ["belongs to 3 DOFs by its header (NCOL), but there are entries for 2: it may be cut short"]
    more = text.replace(f"{len(K):8d}\n", f"{2:8d}\n")
    doubts = [doubt for raw in read_dmig(more.encode()) for doubt in raw.doubts]
    assert doubts == ["belongs to 2 DOFs by its header (NCOL), but there are entries for 3: something was added"]


def test_lines_that_stand_twice_are_told() -> None:
    """The entries would be doubled in silence."""
    (found,) = read_dmig((FREE + FREE.split("\n", 1)[1]).encode())
    assert found.doubts[0].startswith("has 5 entries at places that have one already")


@pytest.mark.parametrize("text", [dmig({"KAAX": K}), FREE])
@pytest.mark.parametrize("mark", ["#", "%", "7", "-"])
def test_a_line_that_is_none_of_nastran_is_refused(text: str, mark: str) -> None:
    """Rows behind it would belong to no entry."""
    lines = text.split("\n")
    with pytest.raises(FileFormatError, match="an entry goes on or another one begins here") as caught:
        read_dmig("\n".join([*lines[:2], mark, *lines[2:]]).encode())
    assert caught.value.line == 3


@pytest.mark.parametrize("text", [dmig({"KAAX": K}), FREE])
def test_another_entry_between_the_columns_is_told(text: str) -> None:
    """As one whose keyword is damaged."""
    lines = text.split("\n")
    second = [number for number, line in enumerate(lines) if line.startswith("DMIG")][2]
    damaged = [*lines[:second], lines[second].replace("DMIG", "DMHG"), *lines[second + 1 :]]
    (found,) = read_dmig("\n".join(damaged).encode())
    assert found.doubts[0].startswith("has another entry between its columns: 'DMHG")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (FREE.replace("6.0", "6.x"), "fields that are no numbers"),
        (FREE.replace("6.0", "1.+999"), "fields that are no numbers"),
        (FREE.replace("DMIG,KAAX,0,6,2,0\n", ""), "a column of 'kaax' before its header"),
        (FREE.replace("2,1,,2,1", "2,1,,x,1"), "fields that are no numbers"),
        (FREE.replace("2,1,,2,1", "2,1,,2,9"), "fields that are no numbers"),
        (FREE.replace("KAAX,0,6,2,0", "KAAX,0,2,2,0"), r"no square DMIG matrix in it \(found: kaax\)"),
        (FREE.split("\n", 1)[0], r"no square DMIG matrix in it \(found: kaax\)"),
        ("DMIG,K,0\n", "fields that are no numbers"),
        ("GRID,1\n", r"no square DMIG matrix in it \(found: none\)"),
    ],
)
def test_a_damaged_entry_is_refused(text: str, message: str) -> None:
    """With the line that it starts at."""
    with pytest.raises(FileFormatError, match=message):
        read_dmig(text.encode())


def test_the_line_of_a_wrong_entry_is_told() -> None:
    """The fourth."""
    with pytest.raises(FileFormatError, match="no numbers") as caught:
        read_dmig(FREE.replace("3.0", "x").encode())
    assert caught.value.line == 4


def test_extrn_names_the_rows_of_output4_matrices() -> None:
    """Components of a grid point in one field, over several lines."""
    text = "EXTRN          3      13      11  123456\n              19       2 2995001       0\nGRID,3\n"
    assert has_extrn(text.encode())
    assert read_extrn(text.encode())[:3] == ("n3_u1", "n3_u3", "n11_u1")
    assert read_extrn(text.encode())[-2:] == ("n19_u2", "n2995001")


@pytest.mark.parametrize(
    ("text", "message"), [("EXTRN,3\n", "nodes and components belong"), ("EXTRN,3,x\n", "belong"), ("", "no EXTRN")]
)
def test_a_damaged_extrn_is_refused(text: str, message: str) -> None:
    """Rather than naming the wrong DOF."""
    with pytest.raises(FileFormatError, match=message):
        read_extrn(text.encode())


def test_a_punch_file_of_pyyeti_reads_as_it_was_written() -> None:
    """Square and symmetric matrices of 15 DOFs, and their labels; a rectangular one has as many columns as it says."""
    found = {raw.title: raw for raw in read_dmig((exported.DATA / "forms.pch").read_bytes())}
    cmplx = found.pop("cmplx")
    assert (cmplx.rectangular, cmplx.matrix.shape[1]) == (True, 2)
    assert set(found) == {"patrn", "ident", "randm"}
    for title, raw in found.items():
        np.testing.assert_array_equal(raw.matrix.toarray(), exported.FORMS[title])
        assert raw.dofs == tuple(
            f"n{node}_{'ur'[dof > 3]}{(dof - 1) % 3 + 1}" if dof else f"n{node}" for node, dof in exported.FORM_PLACES
        )


def test_the_rows_of_a_superelement_are_those_that_pyyeti_wrote() -> None:
    """Four grid points and eight scalar points."""
    assert read_extrn((exported.DATA / "superelement.pch").read_bytes()) == exported.SUPERELEMENT_DOFS
