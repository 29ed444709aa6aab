"""Claims about Matrix Market files: what scipy writes is read, and what scipy misreads is refused."""

import io
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import scipy.io
import scipy.sparse
from hypothesis import given
from hypothesis import strategies as st

from halfdof_ctrl.base.errors import FileFormatError
from halfdof_ctrl.files.formats.matrix_market import is_matrix_market, read_matrix_market
from support.fe_files import K, matrix_market

REAL = "%%MatrixMarket matrix coordinate real general\n"


def written(matrix: Any, **options: Any) -> bytes:  # noqa: ANN401
    """Let scipy write a file."""
    stream = io.BytesIO()
    scipy.io.mmwrite(stream, matrix, precision=17, **options)
    return stream.getvalue()


@given(seed=st.integers(0, 10**6), symmetry=st.sampled_from(["general", "symmetric", "skew-symmetric"]))
def test_what_scipy_writes_comes_back_to_the_last_bit(seed: int, symmetry: str) -> None:
    """Coordinate and array files, of any symmetry."""
    rng = np.random.default_rng(seed)
    matrix = np.where(rng.random((5, 5)) < 0.6, rng.normal(size=(5, 5)), 0.0)
    matrix = {"general": matrix, "symmetric": matrix + matrix.T, "skew-symmetric": matrix - matrix.T}[symmetry]
    matrix[0, 1] = matrix[1, 0] = 0.0
    for form in (matrix, scipy.sparse.coo_array(matrix)):
        found = read_matrix_market(written(form, symmetry=symmetry))
        np.testing.assert_array_equal(found.matrix.toarray(), matrix)
        assert (found.declared, found.completed) == (symmetry, symmetry != "general" and np.count_nonzero(matrix) > 0)


@pytest.mark.parametrize("matrix", [K.astype(np.int64), K * (1 + 0.1j), np.ones((2, 3))])
def test_integers_complex_numbers_and_rectangles_are_read(matrix: npt.NDArray[Any]) -> None:
    """As coordinates and as arrays."""
    for form in (matrix, scipy.sparse.coo_array(matrix)):
        np.testing.assert_array_equal(read_matrix_market(written(form, symmetry="general")).matrix.toarray(), matrix)


def test_comments_empty_lines_and_line_ends_of_windows_do_not_matter() -> None:
    """In any capitals."""
    text = matrix_market(K).replace("% by hand", "% by hand\n%\n\n").replace("\n", "\r\n").upper()
    assert is_matrix_market(text.encode())
    np.testing.assert_array_equal(read_matrix_market(text.encode()).matrix.toarray(), K)


def test_an_exponent_of_fortran_is_read_where_scipy_drops_it() -> None:
    """1.0D+05 is not 1, which scipy 1.17 makes of it."""
    assert read_matrix_market((REAL + "1 1 1\n1 1 1.0D+05\n").encode()).matrix.toarray().tolist() == [[1e5]]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "%%MatrixMarket matrix coordinate pattern general\n1 1 1\n1 1\n",
            "real, integer and complex matrices are read",
        ),
        ("%%MatrixMarket matrix coordinate complex hermitian\n1 1 1\n1 1 1 0\n", "real, integer and complex"),
        ("%%MatrixMarket vector coordinate real general\n1 1\n", "the banner is"),
        ("%%MatrixMarket", "the banner is"),
        (REAL, "ends before the line of sizes"),
        (REAL + "% only\n", "ends before the line of sizes"),
        (REAL + "2 2\n", "3 sizes belong here, not '2 2'"),
        (REAL + "2 -2 1\n", "3 sizes belong here"),
        (REAL + "0 0 0\n", "a matrix of 0 x 0"),
        (REAL + "999999999999 999999999999 1\n1 1 1\n", "a matrix of 999999999999"),
        (REAL + "2 2 99999999999\n1 1 1\n", "says 99999999999 entries, but there are 1"),
        (REAL + "2 2 1\n1 1 1\n2 2 1\n", "says 1 entries, but there are 2"),
        (REAL + "2 2 1\n3 1 1\n", "outside the 2 x 2 matrix"),
        (REAL + "2 2 1\n0 1 1\n", "outside the 2 x 2 matrix"),
        (REAL + "2 2 1\n1.5 1 1\n", "must be whole numbers"),
        (REAL + "2 2 1\n1 1 1.0 7\n", "4 numbers where a row has 3"),
        (REAL + "2 2 1\n1 1 inf\n", "no finite number"),
        (REAL.replace("coordinate", "array") + "2 2\n1\n2\n3\n", "says 4 entries, but there are 3"),
        (REAL.replace("general", "symmetric") + "2 3 1\n2 1 1\n", "2 x 3 cannot be symmetric"),
    ],
)
def test_what_is_no_real_or_complex_matrix_is_refused(text: str, message: str) -> None:
    """With what is wrong, before memory is taken for what a header claims."""
    with pytest.raises(FileFormatError, match=message):
        read_matrix_market(text.encode())
