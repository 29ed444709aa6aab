"""Claims about fields of many lines at once: the same numbers and names as one line after the other gives."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from halfdof_ctrl.files.formats.calculix import _dofs_by_line, _plain_dofs
from halfdof_ctrl.files.formats.columns import cut_lines, real_fields, whole_fields
from halfdof_ctrl.files.formats.dmig import _extrn_by_line
from halfdof_ctrl.files.formats.dmig_punch import extrn_labels
from halfdof_ctrl.files.formats.harwell_boeing import _mapping_by_line, _plain_mapping

NODES = st.lists(st.integers(1, 10**9), min_size=1, max_size=30)
TEXT = st.text(st.sampled_from("ab 1\r"), max_size=9)


def table(fields: list[str]) -> np.ndarray:
    """Lay texts of one length below each other."""
    return np.frombuffer("".join(fields).encode(), dtype=np.uint8).reshape(len(fields), -1)


@given(
    lines=st.lists(TEXT, max_size=6),
    start=st.integers(0, 4),
    width=st.integers(1, 6),
    end=st.sampled_from(["\n", ""]),
)
def test_fields_are_cut_as_by_slices(lines: list[str], start: int, width: int, end: str) -> None:
    """Whatever the lengths and ends of lines; what is missing is blank."""
    content = "\n".join(lines) + end
    kept = [line.removesuffix("\r") for line in (content.removesuffix("\n").split("\n") if content else [])]
    found = cut_lines(content.encode())
    assert found.lengths.tolist() == [len(line) for line in kept]
    cut = [line[start : start + width].ljust(width) for line in kept]
    assert [row.tobytes().decode() for row in found.cut(start, width)] == cut
    chosen = np.arange(0, len(kept), 2)
    assert [row.tobytes().decode() for row in found.cut(start, width, chosen)] == cut[::2]


@given(numbers=st.lists(st.integers(0, 10**16), min_size=1, max_size=20), align=st.sampled_from("<>"))
def test_whole_numbers_are_those_of_int(numbers: list[int], align: str) -> None:
    """At the right of their fields, or at the left."""
    fields = [f"{number:{align}20d}" for number in numbers]
    assert whole_fields(table(fields)).tolist() == numbers


def test_an_empty_field_is_zero_and_a_sign_is_read() -> None:
    """Among others that are not."""
    assert whole_fields(table(["    ", "  12"])).tolist() == [0, 12]
    assert whole_fields(table(["    ", " -12"])).tolist() == [0, -12]
    assert real_fields(table(["    ", "-1.5"])).tolist() == [0.0, -1.5]


@pytest.mark.parametrize("field", ["1 2 ", " 1.5", "1_00", "  x1", "12x "])
def test_what_is_no_whole_number_is_refused(field: str) -> None:
    """A digit is never skipped."""
    with pytest.raises(ValueError, match=r"number|literal"):
        whole_fields(table(["   7", field]))


@pytest.mark.parametrize("field", ["nan ", "1_00", " inf", " 1 2"])
def test_what_is_no_finite_number_is_refused(field: str) -> None:
    """As by the readers of lines."""
    with pytest.raises(ValueError, match=r"number|convert"):
        real_fields(table([" 7.0", field]))


@given(nodes=NODES, data=st.data())
def test_names_of_calculix_are_the_same_either_way(nodes: list[int], data: st.DataObject) -> None:
    """Node, point, DOF."""
    end = data.draw(st.sampled_from(["\n", "\r\n"]))
    content = "".join([f"{node}.{data.draw(st.integers(1, 6))}{end}" for node in nodes]).encode()
    assert _plain_dofs(content) == _dofs_by_line(content)


@pytest.mark.parametrize(
    "content", [b"", b"5.1\n\n", b"5.1 \n", b"5.11\n", b"5-1\n", b"x.1\n", b".1\n", b"-5.1\n", b"12345678901.1\n"]
)
def test_unusual_names_of_calculix_are_left_to_the_reader_of_lines(content: bytes) -> None:
    """Which names the line that is wrong."""
    assert _plain_dofs(content) is None


@given(nodes=NODES, data=st.data())
def test_names_of_a_mapping_are_the_same_either_way(nodes: list[int], data: st.DataObject) -> None:
    """Equation, node, label."""
    labels = [data.draw(st.sampled_from(["UX", "ROTZ", "TEMP"])) for _ in nodes]
    rows = [f"{i:14d}{node:14d}    {label}" for i, (node, label) in enumerate(zip(nodes, labels, strict=True), start=1)]
    content = "\n".join(["  Matrix Eqn   Node   DOF", *rows, ""]).encode()
    assert _plain_mapping(content) == _mapping_by_line(content)


@pytest.mark.parametrize(
    "content",
    [
        b"Matrix Eqn Node DOF\n2 7 UX\n1 7 UY\n",
        b"Matrix Eqn Node DOF\n1 7 UX 2\n9 UY\n",
        b"Matrix Eqn Node DOF\n1 7 U-\n",
        b"Matrix Eqn Node DOF\n1 -7 UX\n",
        b"Matrix Eqn Node DOF\n",
        b"1 7 UX\n2 7 UY\n",
    ],
)
def test_an_unusual_mapping_is_left_to_the_reader_of_lines(content: bytes) -> None:
    """Which names the line that is wrong."""
    assert _plain_mapping(content) is None


@given(
    nodes=st.lists(st.integers(1, 10**7), min_size=1, max_size=30), data=st.data(), remark=st.sampled_from(["", "$"])
)
def test_names_of_an_extrn_entry_are_the_same_either_way(nodes: list[int], data: st.DataObject, remark: str) -> None:
    """Pairs in fields of eight, over many lines, with the remark mark that Nastran puts at their ends."""
    components = [data.draw(st.sampled_from(["123456", "0", "3", "12"])) for _ in nodes]
    fields = [f"{node:8d}{part:>8s}" for node, part in zip(nodes, components, strict=True)]
    lines = ["".join(fields[start : start + 4]) + remark for start in range(0, len(fields), 4)]
    content = ("$ ROWS\nEXTRN   " + "\n        ".join(lines) + "\nGRID           1\n").encode()
    found = extrn_labels(content)
    assert found is not None
    assert tuple(found) == _extrn_by_line(content)


@pytest.mark.parametrize(
    "content",
    [b"EXTRN,3,123\n", b"EXTRN          3     12x\n", b"EXTRN          3\n", b"EXTRN   \n", b"GRID\n"],
)
def test_an_unusual_extrn_entry_is_left_to_the_reader_of_lines(content: bytes) -> None:
    """Which knows all layouts."""
    assert extrn_labels(content) is None
