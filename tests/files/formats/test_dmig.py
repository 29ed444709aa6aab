"""Claims about DMIG and EXTRN entries: three kinds of fields read alike, pyyeti agrees, and damage is told."""

import numpy as np
import pytest

from halfdof_ctrl.base.errors import FileFormatError
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


def test_other_entries_and_rectangles_are_passed_over() -> None:
    """A bulk data file holds more."""
    text = "GRID,1,,0.,0.,0.\n" + FREE + "DMIG,BAAX,0,2,2,0\nDMIG,BAAX,1,1,,2,1,1.0\nENDDATA\n"
    assert [raw.title for raw in read_dmig(text.encode())] == ["kaax"]


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
    """Square and symmetric matrices of 15 DOFs, and their labels; a rectangular one is passed over."""
    found = {raw.title: raw for raw in read_dmig((exported.DATA / "forms.pch").read_bytes())}
    assert set(found) == {"patrn", "ident", "randm"}
    for title, raw in found.items():
        np.testing.assert_array_equal(raw.matrix.toarray(), exported.FORMS[title])
        assert raw.dofs == tuple(
            f"n{node}_{'ur'[dof > 3]}{(dof - 1) % 3 + 1}" if dof else f"n{node}" for node, dof in exported.FORM_PLACES
        )


def test_the_rows_of_a_superelement_are_those_that_pyyeti_wrote() -> None:
    """Four grid points and eight scalar points."""
    assert read_extrn((exported.DATA / "superelement.pch").read_bytes()) == exported.SUPERELEMENT_DOFS
