"""Claims about OUTPUT4: every layout reads the same, pyyeti agrees, and records that lie are refused."""

import struct
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from halfdof_ctrl.base.errors import FileFormatError
from halfdof_ctrl.files.formats.output4 import is_binary_output4, is_text_output4, read_output4
from support import exported_files as exported
from support.fe_files import K, M, output4_binary, output4_text

LAYOUTS = pytest.mark.parametrize("layout", ["dense", "sparse", "big"])
HOLES = np.array([[0.0, 1.0, 0.0], [5.0, 0.0, 2.0], [0.0, -3.0, 0.0], [1e-9, 0.0, 0.0]])
MATRICES: dict[str, npt.NDArray[Any]] = {"KAAX": K, "MAAX": M, "CPLX": K * (1 + 0.5j), "ZERO": np.zeros((2, 2))}


def same(content: bytes, matrices: dict[str, npt.NDArray[Any]]) -> bool:
    """Tell whether a file gives these matrices."""
    found = read_output4(content)
    assert [raw.title for raw in found] == [name.lower() for name in matrices]
    for raw, matrix in zip(found, matrices.values(), strict=True):
        np.testing.assert_array_equal(raw.matrix.toarray(), matrix)
    return True


@LAYOUTS
def test_text_in_every_layout_reads_the_same(layout: str) -> None:
    """Real, complex and empty matrices one after the other."""
    content = output4_text(MATRICES, layout).encode()
    assert is_text_output4(content)
    assert same(content, MATRICES)


@LAYOUTS
@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("word", [4, 8])
def test_binary_in_every_layout_reads_the_same(layout: str, order: str, word: int) -> None:
    """In either byte order, words of four and eight bytes."""
    content = output4_binary(MATRICES, layout, order, word)
    assert is_binary_output4(content)
    assert same(content, MATRICES)


@LAYOUTS
def test_rectangles_with_holes_are_read(layout: str) -> None:
    """Form 2 need not be square, and zeros within a string are no entries."""
    for content in (output4_text({"R": HOLES}, layout, form=2).encode(), output4_binary({"R": HOLES}, layout, form=2)):
        (raw,) = read_output4(content)
        np.testing.assert_array_equal(raw.matrix.toarray(), HOLES)
        assert (raw.matrix.nnz, raw.declared) == (5, "unsaid")


def test_form_six_with_one_triangle_is_completed() -> None:
    """The form says symmetric."""
    (raw,) = read_output4(output4_binary({"K": np.tril(K)}, "sparse"))
    np.testing.assert_array_equal(raw.matrix.toarray(), K)
    assert raw.completed


def test_form_one_with_one_triangle_is_told() -> None:
    """It says nothing of symmetry."""
    (raw,) = read_output4(output4_binary({"K": np.tril(K)}, "sparse", form=1))
    assert raw.is_half_stored


@pytest.mark.parametrize("sparse", ["dense", "bigmat", "nonbigmat"])
@pytest.mark.parametrize("kind", ["text", "binary"])
def test_what_pyyeti_writes_is_read(kind: str, sparse: str) -> None:
    """A second opinion on every layout: real, complex and rectangular matrices to the last digit."""
    content = (exported.DATA / f"pyyeti_{kind}_{sparse}.op4").read_bytes()
    found = {raw.title: raw.matrix.toarray() for raw in read_output4(content)}
    assert set(found) == set(exported.LAYOUTS)
    for name, matrix in exported.LAYOUTS.items():
        np.testing.assert_array_equal(found[name], matrix)


@pytest.mark.parametrize("name", ["superelement.op4", "single_text.op4", "single_binary.op4"])
def test_files_in_the_layouts_of_nastran_read_as_they_were_written(tmp_path: Path, name: str) -> None:
    """Every matrix in them, of a superelement in double and of three forms in single precision."""
    expected = exported.superelement() if name == "superelement.op4" else exported.TWO_WAYS
    found = {raw.title: raw.matrix.toarray() for raw in read_output4(exported.content(name, tmp_path))}
    assert set(found) == set(expected)
    for title, matrix in expected.items():
        np.testing.assert_array_equal(found[title], matrix)


def test_text_and_binary_of_one_model_agree() -> None:
    """The same three matrices both ways in single precision, which a text shows with more digits than it has."""
    thirds = {name: matrix / 3.0 for name, matrix in exported.TWO_WAYS.items()}
    rounded = {name: matrix.astype(np.float32).astype(np.float64) for name, matrix in thirds.items()}
    both = read_output4(exported.single_text(rounded)), read_output4(exported.single_binary(thirds))
    for text, binary in zip(*both, strict=True):
        assert text.title == binary.title
        np.testing.assert_array_equal(text.matrix.toarray(), binary.matrix.toarray())


def patched(content: bytes, place: int, value: int) -> bytes:
    """Write a 4-byte integer into a file."""
    return content[:place] + struct.pack("<i", value) + content[place + 4 :]


BINARY = output4_binary({"KAAX": K}, "sparse")
BIG = output4_binary({"KAAX": K}, "big")
DENSE = output4_binary({"KAAX": K}, "dense")


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (BINARY[:20], "cut short"),
        (BINARY[:32], "cut short"),
        (BINARY[:-4], "cut short"),
        (BINARY[: 32 + 40], "cut short"),
        (patched(BINARY, 4, -3), "a header with -3 columns"),
        (patched(BINARY, 4, 2**31 - 1), "a header with 2147483647 columns"),
        (patched(BINARY, 16, 9), "type 9"),
        (patched(BINARY, 28, 23), "does not end as it begins"),
        (patched(BINARY, 32, 2**31 - 1), "cut short"),
        (patched(BINARY, 36, 0), "of column 0"),
        (patched(BINARY, 44, 7), "says 7 words, but its record has"),
        (patched(BINARY, 48, 1 + 65536 * 9999), "a string of 9999 words"),
        (patched(BINARY, 48, 1), "a string of 0 words"),
        (patched(BINARY, 48, 3 + 65536 * 5), "2 values from row 3"),
        (patched(BIG, 48, 2**31 - 1), "a string of 2147483647 words"),
        (patched(BIG, 52, -5), "from row -5"),
        (patched(DENSE, 40, 3), "2 values from row 3"),
        (BINARY[:32] + struct.pack("<i4xi", 4, 4), "a record of 4 bytes where a column should be"),
        (BINARY + struct.pack("<i4xi", 4, 4), "a record of 4 bytes where a header should be"),
        (struct.pack("<i", 24), "cut short"),
        (
            patched(patched(BINARY, 20, 0x410A0A41), 48, 3 + 65536 * 5),
            r"2 values from row 3 of column 1 in a\?\?a, which",
        ),
        (b"", "no matrix in it"),
    ],
)
def test_binary_records_that_lie_are_refused(content: bytes, message: str) -> None:
    """Before they are followed anywhere."""
    with pytest.raises(FileFormatError, match=message):
        read_output4(content)


TEXT = output4_text({"KAAX": K}, "sparse")
TEXT_BIG = output4_text({"KAAX": K}, "big")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (TEXT[:30], "name of a matrix belong here|cut short"),
        (TEXT[:70], "cut short|integers of 8"),
        (TEXT[:-30], "integers of 8 characters"),
        (TEXT[:-24], "cut short"),
        (TEXT.replace("       3       3", "       3      xx", 1), "name of a matrix belong here"),
        (TEXT.replace("1P,3E23.16", "1P,9E99999.16"), "the number format"),
        (TEXT.replace("\n       1       0       5", "\n       x       0       5"), "3 integers of 8 characters"),
        (TEXT.replace("\n       1       0       5", "\n       1       0      -5"), "a column of -5 words"),
        (TEXT.replace("      327681", "           x"), "an integer belongs here"),
        (TEXT.replace("      327681", "      999999"), "a string of"),
        (TEXT.replace("6.0000000000000000E+00", "6.00000000000000x0E+00"), "entries that are no numbers"),
        (TEXT.replace("6.0000000000000000E+00", "6.000000000000000E+999"), "entries that are not finite"),
        (TEXT_BIG.replace("       5       1", "       5       9"), "2 values from row 9"),
    ],
)
def test_text_that_lies_is_refused(text: str, message: str) -> None:
    """With the line where there is one."""
    with pytest.raises(FileFormatError, match=message):
        read_output4(text.encode())
