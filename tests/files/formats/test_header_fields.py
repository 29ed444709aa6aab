"""Claims about header fields that change the meaning of a file: used, or refused, in every format."""

import io
import struct
from pathlib import Path

import numpy as np
import pytest
from scipy.sparse import csc_array

from halfdof_ctrl import load_model
from halfdof_ctrl.base.errors import FileFormatError, ImportedModelWarning
from halfdof_ctrl.files.formats.abaqus import read_abaqus
from halfdof_ctrl.files.formats.dmig import read_dmig
from halfdof_ctrl.files.formats.harwell_boeing import read_harwell_boeing
from halfdof_ctrl.files.formats.mat4 import mat4_variables
from halfdof_ctrl.files.formats.matrix_market import read_matrix_market
from halfdof_ctrl.files.formats.npy import read_npy
from halfdof_ctrl.files.formats.output4 import read_output4
from halfdof_ctrl.files.formats.text_blocks import fixed_width

MARKET = b"%%MatrixMarket matrix coordinate real symmetric\n2 2 3\n1 1 2.0\n2 1 -1.0\n2 2 3.0\n"
SYMMETRIC = [[2.0, -1.0], [-1.0, 3.0]]


def op4_text(name: str, shape: tuple[int, int], form: int, columns: dict[int, list[float]]) -> str:
    """Write the columns of a matrix in the dense layout."""
    rows, count = shape
    lines = [f"{count:8d}{rows:8d}{form:8d}{2:8d}{name:8s}1P,3E23.16"]
    for column, values in columns.items():
        lines += [f"{column:8d}{1:8d}{len(values):8d}", "".join([f"{value:23.16E}" for value in values])]
    return "\n".join([*lines, f"{count + 1:8d}{1:8d}{1:8d}", f"{1.0:23.16E}"]) + "\n"


def op4_binary(name: bytes, word: int, value: float) -> bytes:
    """Write a matrix of one entry with words of 4 or 8 bytes, whose name fills four characters of each."""
    integer = {4: "i", 8: "q"}[word]

    def record(data: bytes) -> bytes:
        return struct.pack("<i", len(data)) + data + struct.pack("<i", len(data))

    halves = b"".join([name[k : k + 4].ljust(4).ljust(word) for k in (0, 4)])
    head = record(struct.pack(f"<4{integer}", 1, 1, 6, 2) + halves)
    column = record(struct.pack(f"<3{integer}d", 1, 1, 8 // word, value))
    return head + column + record(struct.pack(f"<3{integer}d", 2, 1, 8 // word, 1.0))


@pytest.mark.parametrize("start", [b" ", b"\t", b"\xef\xbb\xbf", b"\r\n"])
def test_a_byte_order_mark_or_blanks_before_the_banner_do_not_matter(start: bytes) -> None:
    """Windows and MUMPS write them."""
    assert read_matrix_market(start + MARKET).matrix.toarray().tolist() == SYMMETRIC


def test_an_identity_of_output4_has_ones() -> None:
    """Form 8 stores no columns; one that stores others contradicts itself."""
    (raw,) = read_output4(op4_text("MAA", (2, 2), 8, {}).encode())
    assert raw.matrix.toarray().tolist() == [[1.0, 0.0], [0.0, 1.0]]
    with pytest.raises(FileFormatError, match="says that it is an identity"):
        read_output4(op4_text("MAA", (2, 2), 8, {1: [2.0, 0.0]}).encode())


def test_a_diagonal_of_output4_is_one() -> None:
    """Form 3 as a single column, or whole."""
    (raw,) = read_output4(op4_text("MAA", (3, 1), 3, {1: [2.0, 0.0, 5.0]}).encode())
    np.testing.assert_array_equal(raw.matrix.toarray(), np.diag([2.0, 0.0, 5.0]))
    (raw,) = read_output4(op4_text("MAA", (2, 2), 3, {1: [2.0], 2: [0.0, 5.0]}).encode())
    np.testing.assert_array_equal(raw.matrix.toarray(), np.diag([2.0, 5.0]))


@pytest.mark.parametrize("form", [4, 5, 9, 10, 11, 13, 15, 99])
def test_factors_of_output4_are_no_stiffness_without_a_word(tmp_path: Path, form: int) -> None:
    """They would be a triangle that misses its other half."""
    (tmp_path / "a.op4").write_text(op4_text("KAA", (2, 2), form, {1: [2.0, 1.0], 2: [0.0, 3.0]}))
    with pytest.warns(ImportedModelWarning, match=f"has the form {form} .*which is no matrix of a model"):
        load_model(tmp_path / "a.op4", matrices={"M": None, "C": None})


@pytest.mark.parametrize("word", [4, 8])
def test_names_are_read_whole_in_words_of_either_size(word: int) -> None:
    """Four characters a word, whose rest is blank where words have eight bytes."""
    for name in (b"KAA", b"STIFFMAT"):
        (raw,) = read_output4(op4_binary(name, word, 7.0))
        assert (raw.title, raw.matrix.toarray().tolist()) == (name.decode().lower(), [[7.0]])


def test_one_name_twice_is_asked_for_by_number(tmp_path: Path) -> None:
    """In OUTPUT4 and DMIG; the refusal says how."""
    text = op4_text("KAA", (1, 1), 6, {1: [4.0]}) + op4_text("KAA", (1, 1), 6, {1: [9.0]})
    (tmp_path / "a.op4").write_text(text)
    header = "DMIG    KAAX    0       6       2       0\n"
    (tmp_path / "b.pch").write_text(
        "".join([header + f"DMIG    KAAX    1       1               1       1       {v}.\n" for v in (4, 9)])
    )
    for path, name in ((tmp_path / "a.op4", "kaa"), (tmp_path / "b.pch", "kaax")):
        with pytest.raises(FileFormatError, match=rf"{name}#1, .*{name}#2.*matrices=\{{'K': '{name}#2'\}}"):
            load_model(path)
        for number, value in ((1, 4.0), (2, 9.0)):
            model = load_model(path, matrices={"K": f"{name}#{number}", "M": None, "C": None})
            assert model.K.toarray().tolist() == [[value]]


def test_text_after_an_empty_line_is_not_left_out() -> None:
    """Half a file is no file."""
    text = op4_text("KAA", (1, 1), 6, {1: [4.0]})
    assert len(read_output4((text + "\n\n").encode())) == 1
    with pytest.raises(FileFormatError, match="an empty line stands between its matrices"):
        read_output4((text + "\n" + text).encode())


def test_dmig_fields_may_be_set_off_by_tabs(tmp_path: Path) -> None:
    """In hand-made decks."""
    (tmp_path / "x.bdf").write_text("DMIG\tKAAX\t0\t6\t2\t0\t\t\t1\nDMIG\tKAAX\t1\t1\t\t1\t1\t2.0\n")
    model = load_model(tmp_path / "x.bdf", matrices={"M": None, "C": None})
    assert model.K.toarray().tolist() == [[2.0]]


def test_polar_values_of_dmig_are_amplitude_and_phase() -> None:
    """2 at 90 degrees is 2j."""
    (raw,) = read_dmig(b"DMIG,KAAX,0,6,3,0,1\nDMIG,KAAX,1,1,,1,1,2.0,90.0\n")
    np.testing.assert_allclose(raw.matrix.toarray(), [[2.0j]], atol=1e-15)


def test_an_unknown_form_of_dmig_is_refused() -> None:
    """It could mean anything."""
    with pytest.raises(FileFormatError, match="DMIG entry of 'kaax'"):
        read_dmig(b"DMIG,KAAX,0,5,2,0\nDMIG,KAAX,1,1,,1,1,2.0\n")


def test_includes_are_told(tmp_path: Path) -> None:
    """They are not followed, whatever they name."""
    (tmp_path / "x.bdf").write_text("INCLUDE '/etc/passwd'\nDMIG,KAAX,0,6,2,0\nDMIG,KAAX,1,1,,1,1,2.0\n")
    with pytest.warns(ImportedModelWarning, match="has INCLUDE statements, which are not followed"):
        load_model(tmp_path / "x.bdf", matrices={"M": None, "C": None})


def test_a_scale_factor_of_abaqus_is_applied() -> None:
    """And told."""
    raw = read_abaqus(b"*MATRIX INPUT, NAME=K, SCALE FACTOR=2.5\n1,1, 1,1, 4.0\n")
    assert raw.matrix.toarray().tolist() == [[10.0]]
    assert raw.notes == ("entries are multiplied by SCALE FACTOR=2.5",)


@pytest.mark.parametrize(
    "text",
    [
        b"*MATRIX INPUT, NAME=K, INPUT=/etc/passwd\n1,1, 1,1, 4.0\n",
        b"*MATRIX INPUT, NAME=K\n1,1, 1,1, 4.0\n*MATRIX INPUT, NAME=M\n1,1, 1,1, 4.0\n",
        b"*MATRIX INPUT, NAME=K, SCALE FACTOR=x\n1,1, 1,1, 4.0\n",
    ],
)
def test_other_files_and_several_matrices_in_one_of_abaqus_are_refused(text: bytes) -> None:
    """No other file is opened, and two matrices are not added up."""
    with pytest.raises(FileFormatError, match=r"MATRIX INPUT names another file|SCALE FACTOR"):
        read_abaqus(text)


def test_an_unsymmetric_matrix_of_abaqus_is_not_told_that_half_is_missing(tmp_path: Path) -> None:
    """One-way coupling: the file says TYPE=UNSYMMETRIC."""
    text = "*MATRIX INPUT, NAME=K, TYPE=UNSYMMETRIC\n1,1, 1,1, 4.0\n2,1, 1,1, -1.0\n2,1, 2,1, 3.0\n"
    (tmp_path / "K.mtx").write_text(text)
    model = load_model({"K": tmp_path / "K.mtx"})
    assert model.K.toarray().tolist() == [[4.0, 0.0], [-1.0, 3.0]]


def test_a_load_of_abaqus_is_b(tmp_path: Path) -> None:
    """Node, DOF, value, on the DOFs of the stiffness."""
    (tmp_path / "j_STIF1.mtx").write_text("1,1, 1,1, 4.0\n2,1, 1,1, -1.0\n2,1, 2,1, 3.0\n")
    (tmp_path / "j_LOAD1.mtx").write_text("*CLOAD\n2,1, 5.0\n")
    model = load_model({"K": tmp_path / "j_STIF1.mtx", "B": tmp_path / "j_LOAD1.mtx"})
    assert model.B.toarray().tolist() == [[0.0], [5.0]]


def test_lines_far_shorter_than_their_fields_are_not_filled_up() -> None:
    """A header with a thousand fields a line must not take a thousand times the file."""
    with pytest.raises(ValueError, match="far shorter than their fields"):
        fixed_width([b"1"] * 100_000, 1, 1000, [1000] * 100_000)


@pytest.mark.parametrize(
    ("head", "message"),
    [
        (b"*MATRIX INPUT, NAME=K, MATRIX=IMAGINARY\n", "MATRIX=IMAGINARY' is not read"),
        (b"*MATRIX INPUT, NAME=K, TYPE=DIAGONAL\n", "TYPE=DIAGONAL is neither"),
        (b"*TRANSFORM\n", r"'\*TRANSFORM' is not read"),
    ],
)
def test_keywords_of_abaqus_that_change_the_numbers_are_refused(head: bytes, message: str) -> None:
    """Each was passed over."""
    with pytest.raises(FileFormatError, match=message):
        read_abaqus(head + b"1,1, 1,1, 4.0\n")


@pytest.mark.parametrize("text", [b"SCALEFACTOR=2", b"Scale Factor = 2.D0", b"SCALE FACTOR=2., TYPE=SYMMETRIC"])
def test_a_scale_factor_of_abaqus_may_be_written_in_any_way(text: bytes) -> None:
    """Abaqus passes over blanks in keywords."""
    assert read_abaqus(b"*MATRIX INPUT, NAME=K, " + text + b"\n1,1, 1,1, 4.0\n").matrix.toarray().tolist() == [[8.0]]


@pytest.mark.parametrize(
    ("banner", "sizes", "message"),
    [
        ("coordinate real skew-symmetric", "2 2 2\n1 1 4.0\n2 2 3.0\n", "it is skew-symmetric, but"),
        ("coordinate integer general", "1 1 1\n1 1 4.5\n", "integer entries must be whole"),
        ("array unsigned-integer general", "1 1\n-4\n", "though the banner says unsigned"),
        ("array real symmetric", "3 2\n1\n2\n3\n4\n5\n6\n", "3 x 2 cannot be symmetric"),
    ],
)
def test_entries_that_contradict_the_banner_are_refused(banner: str, sizes: str, message: str) -> None:
    """The diagonal of a skew matrix, fractions among integers, signs of unsigned numbers, a symmetric rectangle."""
    with pytest.raises(FileFormatError, match=message):
        read_matrix_market(f"%%MatrixMarket matrix {banner}\n{sizes}".encode())


@pytest.mark.parametrize(("form", "word"), [(3, "diagonal"), (7, "row vector")])
def test_an_output4_matrix_that_is_not_of_its_form_is_refused(form: int, word: str) -> None:
    """Entries beside the diagonal of a diagonal matrix, rows of a row vector."""
    with pytest.raises(FileFormatError, match=f"says that it is a {word}"):
        read_output4(op4_text("KAA", (2, 2), form, {1: [4.0, 1.0], 2: [1.0, 3.0]}).encode())


def mat4(kind: int, table: list[list[float]], imaginary: int = 0) -> bytes:
    """Write the variable K of MATLAB 4, with an imaginary part that repeats the real one."""
    order = ">" if kind >= 1000 else "<"
    numbers = np.array(table).astype(f"{order}f8").tobytes(order="F")
    return struct.pack(f"{order}5i", kind, *np.shape(table), imaginary, 2) + b"K\0" + numbers * (1 + imaginary)


def test_sparse_matrices_of_matlab_4_are_read_in_either_byte_order() -> None:
    """What says that imaginary parts follow contradicts itself: they stand in a fourth column."""
    table = [[1.0, 1.0, 4.0], [2.0, 1.0, 1.0], [2.0, 2.0, 0.0]]
    for kind in (2, 1002):
        (variable,) = mat4_variables(mat4(kind, table))
        assert csc_array(variable.read()).toarray().tolist() == [[4.0, 0.0], [1.0, 0.0]]
        (variable,) = mat4_variables(mat4(kind, table, 1))
        with pytest.raises(FileFormatError, match="says that it is followed by imaginary parts"):
            variable.read()


def test_only_the_versions_of_numpy_that_there_are_are_read() -> None:
    """1.1 could mean anything."""
    stream = io.BytesIO()
    np.save(stream, np.eye(2))
    content = stream.getvalue()
    assert read_npy(content).tolist() == [[1.0, 0.0], [0.0, 1.0]]
    with pytest.raises(FileFormatError, match=r"does not begin as an array of numpy\.save"):
        read_npy(content[:7] + b"\1" + content[8:])


@pytest.mark.parametrize(
    ("layout", "values", "message"),
    [
        ("(2F8.3)", "    4000    3000", "without decimal point.* decimals of the last 3 digits"),
        ("(1P,2E8.1)", "     4.0     3.0", "without exponent.* divides such values by 1e1"),
        ("(2I8)", "       4       3", ""),
        ("(1P,2E8.1)", " 4.0E+00 3.0E+00", ""),
    ],
)
def test_values_of_harwell_boeing_are_what_stands_there(layout: str, values: str, message: str) -> None:
    """Fortran reads 4000 in F8.3 as 4 and 4.0 in 1PE8.1 as 0.4: whoever wrote that may have meant something else."""
    counts = "".join([f"{count:14d}" for count in (3, 1, 1, 1, 0)])
    sizes = f"{'RSA':14s}" + "".join([f"{count:14d}" for count in (2, 2, 2, 0)])
    formats = f"{'(3I4)':16s}{'(2I4)':16s}{layout:20s}"
    text = "\n".join([f"{'Stiffness':72s}key", counts, sizes, formats, "   1   2   3", "   1   2", values, ""])
    if not message:
        assert read_harwell_boeing(text.encode()).matrix.toarray().tolist() == [[4.0, 0.0], [0.0, 3.0]]
        return
    with pytest.raises(FileFormatError, match=message):
        read_harwell_boeing(text.encode())


@pytest.mark.parametrize("layout", ["2P,3E23.16", "1P,-E23.16", "1P,3F23.16", "1P,3E2"])
def test_a_number_format_of_output4_that_is_none_is_refused(layout: str) -> None:
    """Fields of another width would cut numbers."""
    text = op4_text("KAA", (1, 1), 6, {1: [4.0]})
    with pytest.raises(FileFormatError, match="is none of OUTPUT4"):
        read_output4(text.replace("1P,3E23.16", layout).encode())
    assert read_output4(text.replace("1P,3E23.16", "(1P,3E23.16)").encode())[0].matrix.toarray().tolist() == [[4.0]]
