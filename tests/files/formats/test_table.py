"""Claims about tables in text: dense rows, entries by place, and what could be either."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from halfdof_ctrl import load_model
from halfdof_ctrl.base.errors import FileFormatError
from halfdof_ctrl.files.formats.raw_matrix import RawMatrix
from halfdof_ctrl.files.formats.table import is_table, read_table

K = np.array([[50.0, -20.0, 0.0], [-20.0, 50.0, -30.0], [0.0, -30.0, 30.5]])
ROOM = 1000


def read(text: str, *, dense: bool = False) -> RawMatrix:
    """Read a text as the importer does."""
    assert is_table(text.encode())
    return read_table(text.encode(), dense=dense, most_rows=ROOM)


@pytest.mark.parametrize(
    "text",
    [
        "\n50 -20 0 \n-20 50 -30 \n0 -30 30.5 \n\n",
        "# stiffness\n5.0e+01 -2.0e+01 0\n-20 50 -30\n0 -30 30.5",
        "50,-20,0\n-20,50,-30\n0,-30,30.5\n",
        "50;-20;0\r\n-20;50;-30\r\n0;-30;30,5\r\n",
        "50\t-20\t0\n-20\t50\t-30\n0\t-30\t30,5\n",
        "a,b,c\n50,-20,0\n-20,50,-30\n0,-30,30.5\n",
        ",a,b,c\na,50,-20,0\nb,-20,50,-30\nc,0,-30,30.5\n",
        "\ufeff50,-20,0\n-20,50,-30\n0,-30,30.5\n",
        "% of MATLAB\n50 -20 0\n-20 50 -30 % second\n0 -30 3.05D+01\n",
    ],
)
def test_dense_rows_are_read_however_they_are_separated(text: str) -> None:
    """Of OpenSees, savetxt, spreadsheets with decimal points or commas, pandas."""
    np.testing.assert_array_equal(read(text).matrix.toarray(), K)


def test_names_of_rows_and_columns_are_names_of_dofs() -> None:
    """Where both say the same; columns in another order are refused."""
    assert read(",a,b\na,2,1\nb,1,3\n").dofs == ("a", "b")
    with pytest.raises(FileFormatError, match="its rows are named a, b"):
        read(",b,a\na,2,1\nb,1,3\n")


def test_a_line_that_counts_the_columns_is_left_out() -> None:
    """As pandas writes it."""
    raw = read("0,1,2,3\n4,1,0,0\n1,4,1,0\n0,1,4,1\n0,0,1,4\n")
    np.testing.assert_array_equal(raw.matrix.toarray(), 4 * np.eye(4) + np.eye(4, k=1) + np.eye(4, k=-1))
    assert raw.notes == ("its first line counts the columns and is left out",)


def test_entries_that_count_from_zero_are_called_that() -> None:
    """And are at their places."""
    raw = read("0 0 50\n1 0 -20\n1 1 50\n2 1 -30\n2 2 30.5\n")
    np.testing.assert_array_equal(raw.matrix.toarray(), K)
    assert "rows and columns are counted from 0" in raw.notes


@pytest.mark.parametrize("n", [3, 5])
@given(data=st.data())
def test_a_dense_matrix_of_whole_numbers_is_read_or_refused(n: int, data: st.DataObject) -> None:
    """Three or five columns could be places and a value; another matrix never comes out."""
    entries = data.draw(st.lists(st.integers(0, 9), min_size=n * n, max_size=n * n))
    half = np.array(entries).reshape(n, n)
    matrix = half + half.T
    text = "\n".join([" ".join(map(str, row)) for row in matrix.tolist()]) + "\n"
    try:
        found = read(text)
    except FileFormatError as refusal:
        assert f"dense matrix of {n} x {n}" in str(refusal) or "could be the sizes" in str(refusal)  # noqa: PT017
    else:
        np.testing.assert_array_equal(found.matrix.toarray(), matrix)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("3 3 4\n1 1 2.\n2 2 2.\n3 3 2.\n3 1 1.\n", "could be the sizes of a matrix with 4 entries"),
        ("1 1 2\n1 2 2\n2 2 5\n", r"dense matrix of 3 x 3, or lines of\s'row column value'"),
        ("1 2 4\n3 1 5\n2 4 7\n", "dense matrix of 3 x 3"),
        ("1 2\n3 4 5\n", "3 numbers where a row has 2"),
        ("1,,2\n,3,4\n2,4,5\n", "an empty cell"),
        ("nan 2\n3 4\n", "no finite number"),
        ("1+2i 2\n3 4\n", "no finite number"),
        ("1 2\n3 x\n", "no finite number"),
        ("1.5 1 1 1 2.\n1 1 2 1 2.\n", "places must be whole numbers"),
        ("4 4 999 1\n", "K.txt is 1 x 4, but the matrices of a model must be square"),
    ],
)
def test_what_could_be_two_things_or_is_none_is_refused(tmp_path: Path, text: str, message: str) -> None:
    """With both readings."""
    (tmp_path / "K.txt").write_text(text)
    with pytest.raises(FileFormatError, match=message):
        load_model({"K": tmp_path / "K.txt"})


def test_a_long_file_with_a_line_of_sizes_is_refused() -> None:
    """Where the table is not looked at as a whole."""
    lines = [f"{i} {i} 2.5" for i in range(1, 200)]
    np.testing.assert_array_equal(read("\n".join(lines) + "\n").matrix.toarray(), 2.5 * np.eye(199))
    with pytest.raises(FileFormatError, match=r"could be the sizes of a matrix with 199 entries"):
        read("\n".join(["199 199 199", *lines]) + "\n")


def test_matrices_of_signals_are_dense() -> None:
    """B of three inputs has whole numbers too."""
    np.testing.assert_array_equal(read("1 0 0\n1 1 0\n", dense=True).matrix.toarray(), [[1, 0, 0], [1, 1, 0]])


def test_files_that_count_from_zero_and_from_one_do_not_make_a_model(tmp_path: Path) -> None:
    """A mass whose first DOF has none cannot show how it counts."""
    (tmp_path / "K.txt").write_text("0 0 50\n1 0 -20\n1 1 50\n2 1 -30\n2 2 30.5\n")
    (tmp_path / "M.txt").write_text("1 1 2.5\n2 2 2.5\n")
    with pytest.raises(FileFormatError, match=r"counted from 0, but M\.txt has no entry in a row 0"):
        load_model({"K": tmp_path / "K.txt", "M": tmp_path / "M.txt"})


@pytest.mark.parametrize("titles", [False, True])
def test_rows_longer_than_what_is_looked_at_first_are_read_whole(*, titles: bool) -> None:
    """A row of 3600 numbers takes more than 64 kB."""
    n = 3600
    row = b" ".join([b"0.0000000000000000"] * (n - 1))
    head = b" ".join([b"column%d" % number for number in range(n)]) + b"\n"
    with pytest.raises(FileFormatError, match=f"{n - 1} numbers where a row has {n}"):
        read_table((head if titles else b"") + b"1.5 " + row + b"\n1.5 " + row + b"\n" + row, dense=False, most_rows=n)
