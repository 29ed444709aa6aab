"""Claims about numbers in text: what is read, and the line of what is not."""

import tracemalloc

import numpy as np
import pytest

from halfdof_ctrl.base.errors import FileFormatError
from halfdof_ctrl.files.formats.text_blocks import Lines, fixed_width, number_rows, whole_numbers


def test_long_rows_take_little_memory_and_are_checked_alike() -> None:
    """200 000 numbers in a line of two bytes each, in less than ten times its size; one too few, many, or none."""
    count = 200_000
    text = b"7 " * count + b"* a comment\n\n"
    tracemalloc.start()
    table = number_rows(text, count, comment="*")
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert table.shape == (1, count)
    assert (table == 7.0).all()
    assert most < 10 * len(text)
    for wrong in (b"7 " * (count - 1), b"7 " * (count + 1), b"7 " * (count - 1) + b"x", b"7 " * (count - 1) + b"nan"):
        with pytest.raises(FileFormatError):
            number_rows(text + wrong, count, comment="*")


def test_commas_blanks_tabs_and_exponents_of_fortran_are_one() -> None:
    """Five ways to write a row of three numbers give the same."""
    text = b"1,2,3.5\n 1 2 3.5 \n1;2;3.5D0\n1\t2\t.35e1\r\n1, 2, 35d-1\n"
    np.testing.assert_array_equal(number_rows(text, 3, comment="*"), np.tile([1.0, 2.0, 3.5], (5, 1)))


def test_numbers_come_back_to_the_last_bit() -> None:
    """What repr writes is read as it was."""
    values = np.random.default_rng(1).normal(size=(200, 4)) * 10.0 ** np.arange(-150, 150, 75)
    text = "\n".join(" ".join(map(repr, row)) for row in values.tolist()).encode()
    np.testing.assert_array_equal(number_rows(text, 4, comment="%"), values)


def test_rows_in_several_blocks_are_joined_in_order(monkeypatch: pytest.MonkeyPatch) -> None:
    """A table does not depend on where it is cut."""
    monkeypatch.setattr("halfdof_ctrl.files.formats.text_blocks.TEXT_BLOCK", 7)
    text = b"".join(b"%d %d\n" % (k, k * k) for k in range(50))
    np.testing.assert_array_equal(number_rows(text, 2, comment="%"), [[k, k * k] for k in range(50)])


@pytest.mark.parametrize("text", [b"", b"\n\n", b"* comment\n"])
def test_a_text_without_rows_is_an_empty_table(text: bytes) -> None:
    """Comments and empty lines are no rows."""
    assert number_rows(text, 3, comment="*").shape == (0, 3)


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        (b"1 2\n3 4 5\n", 3, "3 numbers where a row has 2: '3 4 5'"),
        (b"1 2\n3\n", 3, "1 numbers where a row has 2: '3'"),
        (b"* c\n1 2\n3 x\n", 4, "no finite number: '3 x'"),
        (b"1 2\n\n3 nan\n", 4, "no finite number: '3 nan'"),
        (b"1 2\n3 1e999\n", 3, "no finite number"),
        (b"1 2\n3 0x10\n", 3, "no finite number"),
        (b"1 2\n3 1_0\n", 3, "no finite number"),
        (b"1 2\n3 \xff\n", 3, "no finite number"),
        (b"1 2 3\n1 2 3\n", 2, "3 numbers where a row has 2"),
    ],
)
def test_a_row_that_is_wrong_is_told_by_its_line(text: bytes, line: int, message: str) -> None:
    """Counted in the whole file, whose first line here is the second."""
    with pytest.raises(FileFormatError, match=message) as caught:
        number_rows(text, 2, comment="*", first_line=2)
    assert caught.value.line == line


def test_the_line_is_right_in_a_later_block(monkeypatch: pytest.MonkeyPatch) -> None:
    """Blocks count their lines."""
    monkeypatch.setattr("halfdof_ctrl.files.formats.text_blocks.TEXT_BLOCK", 4)
    with pytest.raises(FileFormatError, match="no finite number") as caught:
        number_rows(b"1 2\n" * 20 + b"1 x\n", 2, comment="*")
    assert caught.value.line == 21


@pytest.mark.parametrize("value", [1.5, 2.0**60, -0.1])
def test_labels_are_whole_numbers(value: float) -> None:
    """A node of 1.5 is a sign of damage, and so is one that float64 cannot tell from its neighbour."""
    with pytest.raises(FileFormatError, match="node labels must be whole numbers"):
        whole_numbers(np.array([1.0, value]), "node labels")


def test_fields_without_blanks_between_them_come_apart() -> None:
    """Fortran leaves none where a number fills its field."""
    lines = [b"-1.00D+00-2.50D-01", b" 1.5E+300  2.0-101", b" 3.0"]
    np.testing.assert_array_equal(fixed_width(lines, 9, 2, [2, 2, 1]), [-1.0, -0.25, 1.5e300, 2e-101, 3.0])


@pytest.mark.parametrize("tail", [b" ", b"", b"\r"])
def test_what_stands_behind_the_fields_is_refused_unless_it_is_blank(tail: bytes) -> None:
    """A digit that damage put into a field would push another one out of it."""
    rows = [b" 1.50", b" 2.50", b" 3.50"]
    lines = Lines(b"\n".join(row + tail for row in rows))
    np.testing.assert_array_equal(lines.fields(0, 3, 5, 1, 3), [1.5, 2.5, 3.5])
    for text in (b"\n".join(row + b"9" + tail for row in rows), b"\n".join([rows[0], rows[1] + b"9", rows[2]])):
        with pytest.raises(ValueError, match="more than its fields"):
            Lines(text).fields(0, 3, 5, 1, 3)


@pytest.mark.parametrize("field", [b"   x", b"    ", b"1. 2"])
def test_a_field_that_is_no_number_is_refused(field: bytes) -> None:
    """Blanks within a number and empty fields are none."""
    with pytest.raises(ValueError, match="could not convert string to float"):
        fixed_width([field], 4, 1, [1])


@pytest.mark.parametrize("end", ["\n", "\r\n"])
@pytest.mark.parametrize("per_line", [1, 3, 4])
def test_lines_that_are_alike_and_lines_that_are_not_give_the_same(per_line: int, end: str) -> None:
    """The fast way for equal lines and the slow one for others read the same fields."""
    values = np.random.default_rng(2).normal(size=23)
    texts = [f"{value:25.15E}" for value in values]
    rows = ["".join(texts[k : k + per_line]) for k in range(0, 23, per_line)]
    alike = Lines((end.join(["head", *rows]) + end).encode())
    padded = Lines((end.join(["head", *(row + " " * (k % 3) for k, row in enumerate(rows))]) + end).encode())
    for lines in (alike, padded):
        found = lines.fields(1, 1 + len(rows), 25, per_line, 23)
        np.testing.assert_allclose(found, values, rtol=1e-15)


def test_lines_are_counted_with_and_without_a_last_line_end() -> None:
    """An end that is missing does not lose the line."""
    assert [Lines(text)[1] for text in (b"a\nb", b"a\nb\n", b"a\r\nb\r\n")] == [b"b"] * 3
    assert [len(Lines(text)) for text in (b"a\nb", b"a\nb\n")] == [2, 2]
