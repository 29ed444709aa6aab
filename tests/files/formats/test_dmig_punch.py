"""Claims about punched DMIG entries: read at once as line by line, or left to the reader of lines."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from halfdof_ctrl.files.formats.dmig import _line_by_line, _punched, read_dmig
from halfdof_ctrl.files.formats.dmig_punch import punched_matrices

HEADER = "DMIG    KAAX           0       6       {kind}       0\n"


def punched(entries: list[tuple[int, int, int, int, float, float]], kind: int) -> bytes:
    """Write entries as Nastran punches them, each in a column of its own."""
    lines = [HEADER.format(kind=kind)]
    for i, p, j, q, real, imaginary in entries:
        lines.append(f"DMIG*   KAAX            {j:16d}{q:16d}\n")
        second = f"{imaginary:16.9E}" if kind > 2 else ""
        lines.append(f"*       {i:16d}{p:16d}{real:16.9E}{second}\n".replace("E", "D"))
    return "".join(lines).encode()


@given(
    entries=st.lists(
        st.tuples(
            st.integers(1, 10**7),
            st.integers(0, 6),
            st.integers(1, 10**7),
            st.integers(0, 6),
            st.one_of(st.just(0.0), st.floats(1e-30, 1e30), st.floats(-1e30, -1e-30)),
            st.floats(1e-3, 1e3),
        ),
        min_size=1,
        max_size=8,
    ),
    kind=st.sampled_from([1, 2, 3, 4]),
)
def test_both_readers_agree(entries: list[tuple[int, int, int, int, float, float]], kind: int) -> None:
    """To the last bit, places and values."""
    content = b"$ PUNCH\n" + punched(entries, kind) + punched(entries, kind).replace(b"KAAX", b"MAAX")
    at_once, by_line = _punched(content), _line_by_line(content)
    assert [matrix.name for matrix in at_once] == [matrix.name for matrix in by_line] == ["kaax", "maax"]
    for one, other in zip(at_once, by_line, strict=True):
        for part in ("rows", "columns", "values"):
            np.testing.assert_array_equal(getattr(one, part), getattr(other, part))


@pytest.mark.parametrize(
    "content",
    [
        b"DMIG,KAAX,0,6,2,0\nDMIG,KAAX,1,1,,1,1,4.0\n",
        (HEADER.format(kind=2) + "DMIG    KAAX    1       1               1       1       4.\n").encode(),
        punched([(1, 1, 1, 1, 4.0, 0.0)], 2).replace(b"D+00", b"X+00"),
        punched([(1, 9, 1, 1, 4.0, 0.0)], 2),
        punched([(1, 1, 1, 1, 4.0, 0.0)], 2).replace(b"DMIG*   KAAX", b"DMIG*   MAAX"),
        b"nothing",
    ],
)
def test_another_layout_is_left_to_the_reader_of_lines(content: bytes) -> None:
    """Which knows all of them, and what is wrong."""
    assert not punched_matrices(content)


def test_a_zero_stands_where_a_field_is_empty() -> None:
    """A scalar point has no component."""
    content = punched([(900, 0, 900, 0, 4.0, 0.0)], 2).replace(b"               0 4", b"                 4")
    (raw,) = read_dmig(content)
    assert raw.dofs == ("n900",)
