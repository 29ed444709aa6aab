"""Claims about Harwell-Boeing files: fixed fields of any width, RSA, mapping, and headers that lie."""

import io

import numpy as np
import pytest
import scipy.io
import scipy.sparse

from halfdof_ctrl.base.errors import FileFormatError
from halfdof_ctrl.files.formats.harwell_boeing import is_harwell_boeing, read_harwell_boeing, read_mapping
from support.fe_files import NAMES, C, K, M, harwell_boeing, mapping

LAYOUTS = [(1, 14, 1, 25), (10, 8, 3, 23), (4, 20, 5, 16)]  #: ANSYS's, and others


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("right_hand_side", [False, True])
def test_a_symmetric_matrix_of_ansys_is_read(layout: tuple[int, int, int, int], *, right_hand_side: bool) -> None:
    """RSA stores the lower triangle; the title says that it is the stiffness."""
    content = harwell_boeing(K, layout=layout, right_hand_side=right_hand_side).encode()
    assert is_harwell_boeing(content)
    found = read_harwell_boeing(content)
    np.testing.assert_array_equal(found.matrix.toarray(), K)
    assert (found.letter, found.declared, found.stored, found.completed) == ("K", "symmetric", "lower", True)
    assert bool(found.notes) == right_hand_side


@pytest.mark.parametrize(("word", "letter"), [("Stiffness", "K"), ("Mass", "M"), ("Damping", "C"), ("Some", None)])
def test_the_title_says_what_the_matrix_is(word: str, letter: str | None) -> None:
    """ANSYS writes it there."""
    content = harwell_boeing(M, title=f"{word} matrix from ANSYS FULL file").encode()
    assert read_harwell_boeing(content).letter == letter


def test_an_unsymmetric_matrix_is_read_whole() -> None:
    """RUA stores all entries."""
    unsymmetric = K + np.triu(K, 1)
    found = read_harwell_boeing(harwell_boeing(unsymmetric, kind="RUA").encode())
    np.testing.assert_array_equal(found.matrix.toarray(), unsymmetric)
    assert (found.declared, found.is_half_stored) == ("general", False)


def test_what_scipy_writes_is_read() -> None:
    """RUA in fields one character narrower than scipy 1.17 says in the header."""
    rng = np.random.default_rng(3)
    matrix = scipy.sparse.csc_matrix(rng.normal(size=(30, 30)) * (rng.random((30, 30)) < 0.2))
    stream = io.StringIO()
    scipy.io.hb_write(stream, matrix)
    found = read_harwell_boeing(stream.getvalue().encode())
    np.testing.assert_allclose(found.matrix.toarray(), matrix.toarray(), rtol=1e-15)


def test_a_skew_matrix_and_line_ends_of_windows_are_read() -> None:
    """RZA stores the lower triangle without the diagonal."""
    skew = np.array([[0.0, -3.0], [3.0, 0.0]])
    text = harwell_boeing(skew, kind="RZA").replace("\n", "\r\n")
    entries = np.tril(skew)
    content = harwell_boeing(entries, kind="RSA").replace("RSA", "RZA").replace("\n", "\r\n")
    assert text.count("\r\n") == content.count("\r\n") + 2  # both entries of the pair, in two lines
    np.testing.assert_array_equal(read_harwell_boeing(content.encode()).matrix.toarray(), skew)


def damaged(old: str, new: str) -> bytes:
    """Change the first place of a text in the header or the data."""
    text = harwell_boeing(K)
    assert old in text
    return text.replace(old, new, 1).encode()


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"title\n 14 4 5 5\nRSA", "ends within its header"),
        (damaged("RSA", "PSA"), "matrix of type 'PSA'"),
        (damaged("RSA", "RSE"), "matrix of type 'RSE'"),
        (damaged("RSA", "CSA"), "matrix of type 'CSA'"),
        (damaged(f"{3:14d}{3:14d}", f"{3:14d}{'x':>14s}"), "3 or more counts belong here"),
        (damaged(f"{3:14d}{3:14d}", f"{3:14d}{99999999999:14d}"), "it says 3 x 99999999999"),
        (damaged(f"{3:14d}{3:14d}", f"{3:14d}{4:14d}"), "take 5 lines, but the header says 4"),
        (damaged("(1I14)", "(1X14)"), r"belong here, as \(10I8\)"),
        (damaged("(1I14)", "(99999999I14)"), r"belong here, as \(10I8\)"),
        (damaged("(1I14)", "(2I14)"), "take 2 lines, but the header says 4"),
        (damaged("(1d25.15)", "(1P,1F25.15)"), r"belong here, as \(10I8\)"),
        (damaged(f"\n{3:14d}\n", f"\n{9:14d}\n"), "pointers to the columns do not lead"),
        (damaged(f"\n{6:14d}\n", f"\n{7:14d}\n"), "do not lead through the 5 entries"),
        (damaged("D+00", "D+xx"), "values that are no finite numbers"),
        (damaged("D+00", "D+999"), "values that are no finite numbers"),
        (harwell_boeing(K).encode()[:-60], "lines of data, but has"),
        (damaged(f"\n{1:14d}\n", f"\n{'':14s}\n"), "pointers that are no finite numbers"),
    ],
)
def test_a_header_or_data_that_lie_are_refused(content: bytes, message: str) -> None:
    """Counts are checked against the lines that there are."""
    with pytest.raises(FileFormatError, match=message):
        read_harwell_boeing(content)


def test_the_line_of_a_wrong_value_is_told() -> None:
    """Counted in the file."""
    lines = harwell_boeing(K).split("\n")
    lines[15] = lines[15].replace("D", "?")
    with pytest.raises(FileFormatError, match="no finite numbers") as caught:
        read_harwell_boeing("\n".join(lines).encode())
    assert caught.value.line == 16


def test_a_mapping_names_the_equations() -> None:
    """In the order of their numbers."""
    assert read_mapping(mapping().encode()) == NAMES
    assert read_mapping(mapping(("UX", "ROTY", "TEMP"), (9, 9, 12)).encode()) == ("n9_u1", "n9_r2", "n12_temp")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (mapping()[:-8], "a node and a DOF label belong here"),
        (mapping().replace("UX", "U?", 1), "a node and a DOF label belong here"),
        (mapping().replace(f"{2:14d}", f"{5:14d}", 1), "not numbered from 1 on"),
        ("", "0 equations"),
    ],
)
def test_a_damaged_mapping_is_refused(text: str, message: str) -> None:
    """Rather than naming the wrong DOF."""
    with pytest.raises(FileFormatError, match=message):
        read_mapping(text.encode())


def test_damping_is_read_too() -> None:
    """With its null column."""
    np.testing.assert_array_equal(read_harwell_boeing(harwell_boeing(C).encode()).matrix.toarray(), C)
