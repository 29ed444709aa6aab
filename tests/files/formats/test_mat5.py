"""Claims about reading MATLAB version 5 files."""

import io
import struct
import zlib
from typing import Any

import numpy as np
import pytest
import scipy.io
import scipy.sparse

from halfdof_ctrl import HalfdofError
from halfdof_ctrl.files.formats.mat5 import read_mat

FULL = np.array([[1.0, -2.5, 0.0], [4.0, 1e-300, 6.0]])


def written(variables: dict[str, Any], *, compressed: bool = False) -> bytes:
    """Let scipy write a file."""
    stream: Any = io.BytesIO()
    scipy.io.savemat(stream, variables, do_compression=compressed)
    return bytes(stream.getvalue())


def element(kind: int, data: bytes) -> bytes:
    """Write an element with its tag and its padding, little endian."""
    return struct.pack("<II", kind, len(data)) + data + bytes(-len(data) % 8)


def variable(kind: int, shape: tuple[int, ...], parts: list[bytes], name: bytes = b"K") -> bytes:
    """Write a file with one variable."""
    head = element(6, struct.pack("<II", kind, 0)) + element(5, struct.pack(f"<{len(shape)}i", *shape))
    header = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM"
    return header + element(14, head + element(1, name) + b"".join(parts))


@pytest.mark.parametrize("compressed", [False, True])
@pytest.mark.parametrize(
    "matrix", [FULL, FULL * (1 - 2j), FULL.astype(np.int16), np.zeros((0, 3)), np.array([[7]]), np.ones((2, 2, 2))]
)
def test_a_full_matrix_is_what_scipy_wrote(matrix: np.ndarray, *, compressed: bool) -> None:
    """Numbers, real or complex, of any type and size, come back as they were."""
    found = read_mat(written({"K": matrix}, compressed=compressed), ["K"])["K"]
    np.testing.assert_array_equal(found, matrix)


@pytest.mark.parametrize("compressed", [False, True])
@pytest.mark.parametrize("factor", [1.0, 1.0 - 2.0j])
def test_a_sparse_matrix_stays_sparse(factor: complex, *, compressed: bool) -> None:
    """Compressed columns, real or complex, come back as they were."""
    content = written({"K": scipy.sparse.csc_array(FULL * factor)}, compressed=compressed)
    found = read_mat(content, ["K"])["K"]
    assert isinstance(found, scipy.sparse.csc_array)
    np.testing.assert_array_equal(found.toarray(), FULL * factor)


def test_a_sparse_matrix_may_be_larger_than_a_full_one() -> None:
    """Ten thousand rows of one entry each take no more memory than their entries."""
    found = read_mat(written({"K": scipy.sparse.eye_array(10_000, format="csc")}), ["K"])["K"]
    assert isinstance(found, scipy.sparse.csc_array)
    assert (found.shape, found.nnz) == ((10_000, 10_000), 10_000)


def test_complex_zeros_keep_their_signs() -> None:
    """Real and imaginary parts are joined without arithmetic."""
    matrix = np.array([[complex(-0.0, 3.0), complex(2.0, -0.0)]])
    found = np.asarray(read_mat(written({"K": matrix}), ["K"])["K"])
    assert found.tobytes() == matrix.tobytes()


def test_char_arrays_give_a_text_a_row_and_cells_a_text_a_cell() -> None:
    """Blanks that pad the rows of a char array are no part of the names."""
    content = written({"rows": np.array(["y ", "y1"]), "cells": np.array(["101.1", "ü 漢", "🔩", ""], dtype=object)})
    assert read_mat(content, ["rows", "cells"]) == {"rows": ["y", "y1"], "cells": ["101.1", "ü 漢", "🔩", ""]}


def test_names_in_sixteen_bit_units_are_read_as_matlab_writes_them() -> None:
    """MATLAB counts a letter beyond the basic plane as two."""
    text = "a🔩"
    content = variable(4, (1, 3), [element(4, text.encode("utf-16-le"))], name=b"dofs")
    assert read_mat(content, ["dofs"]) == {"dofs": [text]}


def test_variables_that_are_not_wanted_are_not_looked_at() -> None:
    """A struct beside the matrices is no reason to refuse a file."""
    assert list(read_mat(written({"s": {"a": 1}, "K": FULL}), ["K", "M"])) == ["K"]


def test_big_endian_files_are_read() -> None:
    """The header tells the byte order."""
    flags, shape = struct.pack(">IIII", 6, 8, 6, 0), struct.pack(">IIii", 5, 8, 1, 1)
    body = flags + shape + struct.pack(">HHc3x", 1, 1, b"K") + struct.pack(">IId", 9, 8, 2.5)
    content = b"MATLAB 5.0".ljust(124) + b"\x01\x00MI" + struct.pack(">II", 14, len(body)) + body
    assert np.asarray(read_mat(content, ["K"])["K"]).tolist() == [[2.5]]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"MATLAB 7.3 MAT-file".ljust(128), "MATLAB 7.3"),
        (b"MATLAB 5.0".ljust(124) + b"\x00\x02IM", "MATLAB 7.3"),
        (b"text", "no MATLAB version 5 file"),
        (written({"K": {"a": 1}}), "K is a struct, string or other object"),
        (written({"K": np.array([["y", 1]], dtype=object)}), "K must be a cell array of names"),
        (variable(6, (5001, 5001), [element(9, b"")]), "K is larger than 5000 x 5000"),
    ],
)
def test_content_of_another_kind_is_refused_with_a_remedy(content: bytes, message: str) -> None:
    """What is sound but no matrix or name gets a message that says what to save instead."""
    with pytest.raises(HalfdofError, match=message):
        read_mat(content, ["K"])


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (variable(6, (2, 2), [element(9, bytes(8))]), "cannot reshape"),
        (variable(6, (2, -2), [element(9, bytes(8))]), "negative size"),
        (variable(6, (1, 1), [element(99, bytes(8))]), "type 99 where numbers should be"),
        (written({"K": FULL})[:-8], "ends too early"),
        (written({"K": FULL}, compressed=True)[:-1], "ends too early"),
        (variable(6, (1, 1), [element(9, bytes(8))])[:128] + element(9, bytes(8)), "where a variable should be"),
        (
            variable(
                5,
                (2, 2),
                [element(5, struct.pack("<i", 9)), element(5, struct.pack("<3i", 0, 1, 1)), element(9, bytes(8))],
            ),
            "indices out of bounds",
        ),
    ],
)
def test_damaged_content_is_refused_before_it_does_harm(content: bytes, message: str) -> None:
    """Lengths, shapes and indices that the bytes do not bear out raise, where scipy 1.17 reads out of bounds."""
    with pytest.raises(ValueError, match=message):
        read_mat(content, ["K"])


def test_a_packed_variable_must_be_as_long_as_it_says() -> None:
    """Its checksum would go unread otherwise."""
    whole = written({"K": FULL})
    longer = struct.pack("<II", 14, len(whole) - 136 - 8) + whole[136:]
    packed = zlib.compress(longer)
    with pytest.raises(ValueError, match="not as long as it says"):
        read_mat(whole[:128] + struct.pack("<II", 15, len(packed)) + packed, ["K"])


@pytest.mark.parametrize(("rows", "starts", "column"), [([1, 0, 2], [0, 2, 3], 1), ([0, 1, 1], [0, 1, 3], 2)])
def test_rows_that_do_not_ascend_are_refused(rows: list[int], starts: list[int], column: int) -> None:
    """MATLAB's always do: a row number that was changed would move an entry, or add it to another one."""
    parts = [element(5, np.array(part, dtype="<i4").tobytes()) for part in (rows, starts)]
    numbers = element(9, np.array([1.0, 2.0, 3.0]).tobytes())
    with pytest.raises(HalfdofError, match=f"rows in column {column} of the sparse matrix K do not ascend"):
        read_mat(variable(5, (3, 2), [*parts, numbers]), ["K"])
