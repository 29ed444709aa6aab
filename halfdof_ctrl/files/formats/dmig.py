"""Direct matrix input of Nastran (DMIG) in punch and bulk data files, and the rows of OUTPUT4 matrices (EXTRN).

    DMIG    NAME    0       FORM    TIN     TOUT            (blank) (blank) NCOL
    DMIG*   NAME                    column node             column component
    *       row node                row component           real part               imaginary part

Entries come in fields of 8 characters, of 16 (``*``), or between commas. Form 6 is symmetric and one entry of each pair
is written, 1 square, 2 and 9 rectangular; TIN 3, 4 is complex. Component 0 is a scalar point. INCLUDE statements are
not followed. Source: MSC Nastran Quick Reference Guide, entries DMIG and EXTRN.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from halfdof_ctrl.base.errors import FileFormatError
from halfdof_ctrl.files.formats.labels import dof_names
from halfdof_ctrl.files.formats.raw_matrix import Declared, RawMatrix, assembled
from halfdof_ctrl.files.formats.text_blocks import printable

SMALL, LARGE = 8, 16  #: characters of a field
SYMMETRIC, SQUARE_FORMS, COMPLEX_TYPES = 6, (1, 6), (3, 4)
MOST_COMPONENT = 6
EXPONENT = re.compile(r"(?<=[0-9.])([+-])")  #: 1.5-3 and 1.5D-3 are 1.5e-3
DMIG = re.compile(rb"^DMIG[ *,]", re.MULTILINE | re.IGNORECASE)
EXTRN = re.compile(rb"^EXTRN[ *,]", re.MULTILINE | re.IGNORECASE)


@dataclass(slots=True)
class _Entries:
    """A matrix while it is read."""

    form: int
    is_complex: bool
    rows: list[tuple[int, int]] = field(default_factory=list)  #: node and component
    columns: list[tuple[int, int]] = field(default_factory=list)
    values: list[complex] = field(default_factory=list)


def has_dmig(content: bytes) -> bool:
    """Return whether there is a DMIG entry."""
    return DMIG.search(content) is not None


def has_extrn(content: bytes) -> bool:
    """Return whether there is an EXTRN entry."""
    return EXTRN.search(content) is not None


def read_dmig(content: bytes) -> list[RawMatrix]:
    r"""Read all square matrices of a file.

    Raises
    ------
    FileFormatError
        An entry whose nodes, components or values are no numbers, or that has no header; no square matrix at all.

    Examples
    --------
    >>> raw = read_dmig(b"DMIG,KAAX,0,6,2,0\nDMIG,KAAX,1,1,,1,1,4.0\nDMIG,KAAX,2,1,,1,1,-1.5,,+\n,2,1,2.0\n")[0]
    >>> raw.dofs, raw.matrix.toarray().tolist()
    (('n1_u1', 'n2_u1'), [[4.0, -1.5], [-1.5, 2.0]])
    """
    found: dict[str, _Entries] = {}
    for fields, line in _bulk_entries(content, "DMIG"):
        name = printable(fields[0].encode("latin-1")).lower()
        try:
            if fields[1].strip() == "0":
                found[name] = _Entries(int(fields[2]), int(fields[3]) in COMPLEX_TYPES)
            else:
                _add(found[name], fields)
        except KeyError as cause:
            msg = f"a column of {name!r} before its header. The file is damaged."
            raise FileFormatError(msg, path="", line=line) from cause
        except (ValueError, IndexError) as cause:
            msg = f"a DMIG entry of {name!r} with fields that are no numbers. The file is damaged."
            raise FileFormatError(msg, path="", line=line) from cause
    square = {name: entries for name, entries in found.items() if entries.form in SQUARE_FORMS and entries.rows}
    matrices = [_assembled(name, entries) for name, entries in square.items()]
    if not matrices:
        what = ", ".join(found) or "none"
        msg = f"no square DMIG matrix in it (found: {what}). Write it by EXTSEOUT(STIFFNESS,MASS,DAMPING,DMIGPCH)."
        raise FileFormatError(msg, path="")
    return matrices


def read_extrn(content: bytes) -> tuple[str, ...]:
    r"""Read the names of the rows of the OUTPUT4 matrices from the EXTRN entry of the assembly punch file.

    Raises
    ------
    FileFormatError
        No such entry, or fields that are no nodes and components.

    Examples
    --------
    >>> read_extrn(b"EXTRN          3   12346    1001       0\n")
    ('n3_u1', 'n3_u2', 'n3_u3', 'n3_r1', 'n3_r3', 'n1001')
    """
    nodes: list[int] = []
    components: list[int] = []
    for fields, line in _bulk_entries(content, "EXTRN"):
        texts = [text.strip() for text in fields]
        pairs = [pair for pair in zip(texts[::2], texts[1::2], strict=False) if pair != ("", "")]
        if not all(node.isdigit() and numbers.isdigit() for node, numbers in pairs):
            msg = "nodes and components belong into an EXTRN entry. The file is damaged."
            raise FileFormatError(msg, path="", line=line)
        for node, numbers in pairs:
            nodes += [int(node)] * len(numbers)
            components += [int(number) for number in numbers]
    if not nodes:
        msg = "no EXTRN entry in it, which names the rows of OUTPUT4 matrices."
        raise FileFormatError(msg, path="")
    return dof_names(nodes, components)


def _add(entries: _Entries, fields: list[str]) -> None:
    """Add the rows of one column."""
    column = _place(fields[1], fields[2])
    for start in range(4, len(fields), 4):
        group = [text.strip() for text in fields[start : start + 4]]
        if not any(group):
            continue
        real, imaginary = (_real(text) for text in [*group, "", ""][2:4])
        entries.rows.append(_place(group[0], group[1]))
        entries.columns.append(column)
        entries.values.append(complex(real, imaginary if entries.is_complex else 0.0))


def _place(node: str, component: str) -> tuple[int, int]:
    place = int(node), int(component or 0)
    if place[0] <= 0 or not 0 <= place[1] <= MOST_COMPONENT:
        msg = "no node"
        raise ValueError(msg)
    return place


def _real(text: str) -> float:
    """Read a number as Nastran writes it.

    >>> _real("1.5-3"), _real("2.D+1"), _real("")
    (0.0015, 20.0, 0.0)
    """
    if not text:
        return 0.0
    plain = text.upper().replace("D", "E")
    value = float(plain if "E" in plain else EXPONENT.sub(r"E\1", plain))
    if not np.isfinite(value) or "_" in text:
        msg = "no finite number"
        raise ValueError(msg)
    return value


def _assembled(name: str, entries: _Entries) -> RawMatrix:
    places = sorted({*entries.rows, *entries.columns})
    number = {place: index for index, place in enumerate(places)}
    values = np.array(entries.values, dtype=np.complex128)
    declared: Declared = "symmetric" if entries.form == SYMMETRIC else "general"
    return assembled(
        np.array([number[place] for place in entries.rows], dtype=np.int64),
        np.array([number[place] for place in entries.columns], dtype=np.int64),
        values if values.imag.any() else values.real,
        (len(places), len(places)),
        declared=declared,
        format=f"Nastran DMIG, form {entries.form}",
        title=name,
        dofs=dof_names(*zip(*places, strict=True)),
    )


def _bulk_entries(content: bytes, keyword: str) -> Iterator[tuple[list[str], int]]:
    """Return the data fields of each entry of a keyword, without continuation marks, and the line it starts at."""
    fields: list[str] | None = None
    start = 0
    for number, whole in enumerate(content.split(b"\n"), start=1):
        line = whole.split(b"$", 1)[0].decode("latin-1").expandtabs(SMALL).rstrip()
        if not line:
            continue
        first, rest = _cut(line)
        if first in {"", "*"} or first.startswith(("+", "*")):
            if fields is not None:
                fields += rest
            continue
        if fields is not None:
            yield fields, start
        fields, start = (rest, number) if first.rstrip("*").strip().upper() == keyword else (None, number)
    if fields is not None:
        yield fields, start


def _cut(line: str) -> tuple[str, list[str]]:
    """Cut a line into its first field and its data fields."""
    if "," in line:
        first, *rest = [text.strip() for text in line.split(",")]
        return first, rest[:8] + [""] * (8 - len(rest))
    first = line[:SMALL].strip()
    width = LARGE if first.endswith("*") or first.startswith("*") else SMALL
    count = 64 // width
    return first, [line[SMALL + width * i : SMALL + width * (i + 1)] for i in range(count)]
