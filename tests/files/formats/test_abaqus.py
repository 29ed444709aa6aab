"""Claims about Abaqus text matrices: labels, internal nodes, triangles, and what is refused."""

import numpy as np
import pytest

from halfdof_ctrl.base.errors import FileFormatError
from halfdof_ctrl.files.formats.abaqus import data_columns, read_abaqus
from support.fe_files import NAMES, K, abaqus, matrix_market


@pytest.mark.parametrize("side", ["lower", "upper", "both"])
def test_a_symmetric_matrix_is_whole_whatever_triangle_is_written(side: str) -> None:
    """Of a symmetric matrix Abaqus writes one entry a pair."""
    found = read_abaqus(abaqus(K, side).encode())
    np.testing.assert_array_equal(found.matrix.toarray(), K)
    assert (found.dofs, found.stored, found.completed) == (NAMES, side, side != "both")


def test_an_unsymmetric_matrix_stays_so() -> None:
    """Contact with friction, acoustics: both entries of a pair are written, and differ."""
    unsymmetric = K + np.triu(K, 1)
    found = read_abaqus(abaqus(unsymmetric, "both").encode())
    np.testing.assert_array_equal(found.matrix.toarray(), unsymmetric)
    assert not found.completed


@pytest.mark.parametrize(("kind", "completed"), [("SYMMETRIC", True), ("UNSYMMETRIC", False)])
def test_a_keyword_says_whether_one_triangle_is_all(kind: str, *, completed: bool) -> None:
    """*MATRIX INPUT, TYPE=UNSYMMETRIC with one triangle is what it says, a one-way coupling."""
    found = read_abaqus(abaqus(K, "lower", head=f"*MATRIX INPUT, NAME=K, TYPE={kind}\n").encode())
    assert (found.completed, found.is_half_stored) == (completed, False)


def test_nodes_are_sorted_and_internal_ones_come_last() -> None:
    """Node labels have gaps and any order; a negative label is an internal node."""
    found = read_abaqus(abaqus(K, nodes=(-2, 700, 5)).encode())
    assert found.dofs == ("n5_u1", "n700_u1", "internal2_1")
    np.testing.assert_array_equal(found.matrix.toarray(), K[::-1, ::-1][np.ix_([0, 1, 2], [0, 1, 2])])


def test_dofs_of_a_node_are_sorted_by_number() -> None:
    """Displacement, rotation, temperature."""
    found = read_abaqus(b"4,11, 4,11, 3.\n4,6, 4,6, 2.\n4,1, 4,1, 1.\n")
    assert found.dofs == ("n4_u1", "n4_r3", "n4_d11")
    np.testing.assert_array_equal(found.matrix.diagonal(), [1.0, 2.0, 3.0])


def test_the_coordinate_format_has_rows_without_labels() -> None:
    """FORMAT=COORDINATE, between blanks or commas."""
    for text in (b"1 1 6.\n2 1 -2.\n2 2 3.\n3 2 -1.\n3 3 1.\n", b"1,1,6.\n2,1,-2.\n2,2,3.\n3,2,-1.\n3,3,1.\n"):
        found = read_abaqus(text)
        np.testing.assert_array_equal(found.matrix.toarray(), K)
        assert found.dofs is None
        assert found.notes == ("rows have no labels in this format",)


def test_comments_and_keywords_may_stand_anywhere() -> None:
    """They are no data."""
    text = abaqus(K).replace("2,1, 2,1", "** middle\n*MATRIX\n2,1, 2,1")
    np.testing.assert_array_equal(read_abaqus(text.encode()).matrix.toarray(), K)


def test_the_first_line_of_data_tells_the_format() -> None:
    """Five numbers or three; a Matrix Market file has a banner."""
    assert data_columns(abaqus(K).encode()) == 5
    assert data_columns(b"** c\n1 1 2.D0\n") == 3
    assert [data_columns(text) for text in (matrix_market(K).encode(), b"", b"** c\n", b"1,2\n", b"a,b,c\n")] == [0] * 5


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (b"** nothing\n", "no line of numbers"),
        (b"1,1, 1,1, 2.\n1,1, 2,1\n", "4 numbers where a row has 5"),
        (b"1,1, 1,1, 2.\n1,1, 2,1, x\n", "no finite number"),
        (b"1,1, 1,1, 2.\n1.5,1, 2,1, 1.\n", "must be whole numbers"),
        (b"99999999999,1, 1,1, 2.\n", "label is out of range"),
        (b"1,-1, 1,1, 2.\n", "label is out of range"),
        (b"1,70000, 1,1, 2.\n", "a DOF number is 70000"),
        (b"1 999999999999 2.\n", "a row or column number is 999999999999"),
        (b"*MATRIX INPUT, TYPE=SYMMETRIC\n1,1, 2,1, 2.\n2,1, 1,1, 3.\n", "says that it is symmetric, but"),
    ],
)
def test_what_abaqus_does_not_write_is_refused(text: bytes, message: str) -> None:
    """With the line where there is one."""
    with pytest.raises(FileFormatError, match=message):
        read_abaqus(text)
