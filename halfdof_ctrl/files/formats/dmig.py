"""Direct matrix input of Nastran (DMIG) in punch and bulk data files, and the rows of OUTPUT4 matrices (EXTRN).

    DMIG    NAME    0       FORM    TIN     TOUT            (blank) (blank) NCOL
    DMIG*   NAME                    column node             column component
    *       row node                row component           real part               imaginary part

Entries come in fields of 8 characters, of 16 (``*``), or between commas. Form 6 is symmetric and one entry of each pair
is written, 1 square, 2 and 9 rectangular; TIN 3, 4 is complex, with POLAR as amplitude and phase [deg]. Component 0 is
a scalar point. Columns of form 9 are numbered from 1 to NCOL, with component 0, or named as rows are. Nastran punches
NCOL for square matrices too, as the number of DOFs of the set that they belong to. INCLUDE statements are not followed,
and told. A name may stand more than once.

Source: MSC Nastran Quick Reference Guide, entries DMIG and EXTRN.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from halfdof_ctrl.base.errors import FileFormatError
from halfdof_ctrl.files.formats.digits import known_to
from halfdof_ctrl.files.formats.dmig_punch import MOST_COMPONENT, PUNCH_COMPONENT_BITS, extrn_labels, punched_matrices
from halfdof_ctrl.files.formats.labels import distinct, dof_names
from halfdof_ctrl.files.formats.raw_matrix import Declared, RawMatrix, assembled, most_rows
from halfdof_ctrl.files.formats.text_blocks import printable

Keys: TypeAlias = npt.NDArray[np.int64]

SMALL, LARGE = 8, 16  #: characters of a field
SYMMETRIC, SQUARE_FORMS, COMPLEX_TYPES = 6, (1, 6), (3, 4)
RECTANGULAR = 9  #: form whose columns have numbers
FORMS, TYPES = (1, 2, 6, 9), (0, 1, 2, 3, 4)
POLAR_FIELD, COUNT_FIELD = 5, 7
NO_KIND = "which are none that DMIG has"
LARGEST_NODE = 2**60
EXPONENT = re.compile(r"(?<=[0-9.])([+-])")  #: 1.5-3 and 1.5D-3 are 1.5e-3
DMIG = re.compile(rb"^DMIG[ *,\t]", re.MULTILINE | re.IGNORECASE)
INCLUDE = re.compile(rb"^INCLUDE\b", re.MULTILINE | re.IGNORECASE)
EXTRN = re.compile(rb"^EXTRN[ *,\t]", re.MULTILINE | re.IGNORECASE)


@dataclass(slots=True)
class _Entries:
    """A matrix while it is read; a key is a node, shifted, with its component."""

    name: str
    form: int
    is_complex: bool
    is_polar: bool
    n_columns: int  #: NCOL, 0 if the header does not say it
    stray: str = ""  #: another entry between the columns
    row_keys: list[int] = field(default_factory=list)
    column_keys: list[int] = field(default_factory=list)
    parts: list[tuple[float, float]] = field(default_factory=list)  #: real and imaginary, or amplitude and phase
    rows: Keys = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    columns: Keys = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    values: npt.NDArray[Any] = field(default_factory=lambda: np.zeros(0))

    def gathered(self) -> "_Entries":
        """Make arrays of what was read line by line."""
        rows, columns = (np.array(keys, dtype=np.int64) for keys in (self.row_keys, self.column_keys))
        return self.with_entries(rows, columns, np.array(self.parts, dtype=np.float64).reshape(-1, 2))

    def with_entries(self, rows: Keys, columns: Keys, parts: npt.NDArray[Any]) -> "_Entries":
        """Give it all entries at once, two numbers each."""
        self.rows, self.columns = rows, columns
        first, second = parts.T
        if not self.is_complex:
            self.values = first
        elif self.is_polar:
            self.values = first * np.exp(1j * np.radians(second))
        else:
            self.values = first + 1j * second
        return self


def has_dmig(content: bytes) -> bool:
    """Return whether there is a DMIG entry."""
    return _has_word(content, b"DMIG") and DMIG.search(content) is not None


def has_extrn(content: bytes) -> bool:
    """Return whether there is an EXTRN entry."""
    return _has_word(content, b"EXTRN") and EXTRN.search(content) is not None


def _includes(content: bytes) -> bool:
    return _has_word(content, b"INCLUDE") and INCLUDE.search(content) is not None


def _has_word(content: bytes, word: bytes) -> bool:
    """Look for a word in its usual capitals, which is far faster than a pattern that ignores them."""
    return any(form in content for form in (word, word.lower(), word.capitalize()))


def read_dmig(content: bytes) -> list[RawMatrix]:
    r"""Read all matrices of a file, square ones first.

    Raises
    ------
    FileFormatError
        An entry whose nodes, components or values are no numbers, or that has no header; columns beyond NCOL; no
        square matrix at all.

    Examples
    --------
    >>> raw = read_dmig(b"DMIG,KAAX,0,6,2,0\nDMIG,KAAX,1,1,,1,1,4.0\nDMIG,KAAX,2,1,,1,1,-1.5,,+\n,2,1,2.0\n")[0]
    >>> raw.dofs, raw.matrix.toarray().tolist()
    (('n1_u1', 'n2_u1'), [[4.0, -1.5], [-1.5, 2.0]])
    """
    found = _punched(content) or _line_by_line(content)
    square = [entries for entries in found if entries.form in SQUARE_FORMS and entries.rows.size]
    others = [entries for entries in found if entries.form not in SQUARE_FORMS and entries.rows.size]
    doubts = ("has INCLUDE statements, which are not followed",) if _includes(content) else ()
    rounding = known_to(content)
    names: dict[bytes, tuple[str, ...]] = {}  # of matrices before, most of which have the same DOFs
    missing = _missing_dofs(square)
    matrices = [_assembled(entries, (*doubts, *missing.get(id(entries), ())), rounding, names) for entries in square]
    room = most_rows(len(content))
    matrices += [_rectangular(entries, doubts, rounding, room) for entries in others]
    if not square:
        what = ", ".join(dict.fromkeys([entries.name for entries in found])) or "none"
        msg = f"no square DMIG matrix in it (found: {what}). Write it by EXTSEOUT(STIFFNESS,MASS,DAMPING,DMIGPCH)."
        raise FileFormatError(msg, path="")
    return matrices


def _punched(content: bytes) -> list[_Entries]:
    """Read the layout that Nastran itself punches, nothing of any other."""
    try:
        return [
            _opened(printable(matrix.header[0].encode("latin-1")).lower(), matrix.header).with_entries(
                matrix.rows, matrix.columns, matrix.values
            )
            for matrix in punched_matrices(content) or ()
        ]
    except (ValueError, IndexError):
        return []


def _line_by_line(content: bytes) -> list[_Entries]:
    """Read any layout, with the line that is wrong."""
    found: dict[str, _Entries] = {}
    earlier: list[_Entries] = []  #: of the same name
    for fields, line, stray in _bulk_entries(content, "DMIG"):
        name = printable(fields[0].encode("latin-1")).lower()
        try:
            if fields[1].strip() == "0":
                earlier += [found[name]] if name in found else []
                found[name] = _opened(name, fields)
            else:
                _add(found[name], fields)
                found[name].stray = found[name].stray or stray
        except KeyError as cause:
            msg = f"a column of {name!r} before its header. The file is damaged."
            raise FileFormatError(msg, path="", line=line) from cause
        except (ValueError, IndexError) as cause:
            what = str(cause) if str(cause).endswith(NO_KIND) else "fields that are no numbers. The file is damaged"
            msg = f"a DMIG entry of {name!r} with {what}."
            raise FileFormatError(msg, path="", line=line) from cause
    return [entries.gathered() for entries in (*earlier, *found.values())]


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
    return dof_names(*(extrn_labels(content) or _extrn_by_line(content)))


def _extrn_by_line(content: bytes) -> tuple[list[int], list[int]]:
    """Read nodes and components of any layout, with the line that is wrong."""
    nodes: list[int] = []
    components: list[int] = []
    for fields, line, _ in _bulk_entries(content, "EXTRN"):
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
    return nodes, components


def _opened(name: str, fields: list[str]) -> _Entries:
    """Read a header: form, type of the input, whether complex values are amplitude and phase, and NCOL."""
    form, kind = int(fields[2]), int(fields[3])
    texts = [*fields, *[""] * COUNT_FIELD]
    polar, count = (int(texts[place].strip() or 0) for place in (POLAR_FIELD, COUNT_FIELD))
    if form not in FORMS or kind not in TYPES:
        msg = f"form {form} and type {kind}, {NO_KIND}"
        raise ValueError(msg)
    if count < 0:
        msg = f"{count} columns, {NO_KIND}"
        raise ValueError(msg)
    return _Entries(name, form, kind in COMPLEX_TYPES, polar > 0, count)


def _add(entries: _Entries, fields: list[str]) -> None:
    """Add the rows of one column."""
    column = _key(fields[1], fields[2])
    for start in range(4, len(fields), 4):
        group = [text.strip() for text in fields[start : start + 4]]
        if not any(group):
            continue
        real, imaginary = (_real(text) for text in [*group, "", ""][2:4])
        entries.row_keys.append(_key(group[0], group[1]))
        entries.column_keys.append(column)
        entries.parts.append((real, imaginary))


def _key(node: str, component: str) -> int:
    place = int(node), int(component or 0)
    if not 0 < place[0] < LARGEST_NODE or not 0 <= place[1] <= MOST_COMPONENT:
        msg = "no node"
        raise ValueError(msg)
    return (place[0] << PUNCH_COMPONENT_BITS) + place[1]


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


def _assembled(
    entries: _Entries, doubts: tuple[str, ...], rounding: float, names: dict[bytes, tuple[str, ...]]
) -> RawMatrix:
    known = distinct(entries.rows, entries.columns)
    declared: Declared = "symmetric" if entries.form == SYMMETRIC else "general"
    labels = known.tobytes()
    if labels not in names:
        names[labels] = _names(known)
    return assembled(
        np.searchsorted(known, entries.rows),
        np.searchsorted(known, entries.columns),
        _real_if_real(entries.values),
        (known.size, known.size),
        declared=declared,
        format=f"Nastran DMIG, form {entries.form}",
        title=entries.name,
        named=True,
        dofs=names[labels],
        doubts=(*doubts, *_stray_doubt(entries)),
        known_to=rounding,
    )


def _rectangular(entries: _Entries, doubts: tuple[str, ...], rounding: float, room: int) -> RawMatrix:
    """Make a matrix whose columns are numbered, or named by other DOFs than its rows."""
    rows, columns = distinct(entries.rows), distinct(entries.columns)
    numbers, count = columns >> PUNCH_COMPONENT_BITS, entries.n_columns
    numbered = entries.form == RECTANGULAR and not (columns & (2**PUNCH_COMPONENT_BITS - 1)).any()
    if numbered and not count:
        doubts = (*doubts, "does not say how many columns it has (NCOL), so there may be more")
    needed = int(numbers.max()) if numbered else columns.size
    if needed > (count or room) or count > room:
        what = f"a column {needed}" if numbered else f"{needed} columns"
        msg = f"{entries.name} has {what}, but its header says NCOL = {count}. The file is damaged."
        raise FileFormatError(msg, path="")
    places = (entries.columns >> PUNCH_COMPONENT_BITS) - 1 if numbered else np.searchsorted(columns, entries.columns)
    return assembled(
        np.searchsorted(rows, entries.rows),
        places,
        _real_if_real(entries.values),
        (rows.size, max(needed, count)),
        declared="general",
        rectangular=True,
        format=f"Nastran DMIG, form {entries.form}",
        title=entries.name,
        named=True,
        dofs=_names(rows),
        doubts=(*doubts, *_stray_doubt(entries)),
        known_to=rounding,
    )


def _missing_dofs(square: Sequence[_Entries]) -> dict[int, tuple[str, ...]]:
    """Compare the DOFs of the matrices of one set with their number, NCOL, which Nastran punches with each."""
    found: dict[int, tuple[str, ...]] = {}
    for count in {entries.n_columns for entries in square} - {0}:
        group = [entries for entries in square if entries.n_columns == count]
        known = {id(entries): distinct(entries.rows, entries.columns) for entries in group}
        sizes = {key: dofs.size for key, dofs in known.items() if dofs.size > count}
        every = distinct(*known.values()).size
        if every < count:  # which may be null columns, but Nastran takes those out of the set
            sizes = {id(group[0]): every}
        for key, size in sizes.items():
            more = "it may be cut short" if size < count else "something was added"
            found[key] = (f"belongs to {count} DOFs by its header (NCOL), but there are entries for {size}: {more}",)
    return found


def _stray_doubt(entries: _Entries) -> tuple[str, ...]:
    return (f"has another entry between its columns: {entries.stray}",) if entries.stray else ()


def _real_if_real(values: npt.NDArray[Any]) -> npt.NDArray[Any]:
    return values if np.iscomplexobj(values) and values.imag.any() else values.real


def _names(keys: Keys) -> tuple[str, ...]:
    nodes, components = keys >> PUNCH_COMPONENT_BITS, keys & (2**PUNCH_COMPONENT_BITS - 1)
    return dof_names(nodes.tolist(), components.tolist())


def _bulk_entries(content: bytes, keyword: str) -> Iterator[tuple[list[str], int, str]]:
    """Return the data fields of each entry of a keyword, without continuation marks, and the line it starts at.

    The last is another entry that stands between it and the one of that keyword before it, if there is one.

    Raises
    ------
    FileFormatError
        A line behind an entry of that keyword that neither goes on with it nor begins another one.
    """
    fields: list[str] | None = None
    start = 0
    stray, before = "", ""
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
            if not first[0].isalpha():
                msg = f"an entry goes on or another one begins here, not {line[:60]!r}. The file is damaged."
                raise FileFormatError(msg, path="", line=number)
            yield fields, start, before
            stray = ""
        if first.rstrip("*").strip().upper() == keyword:
            fields, start, before = rest, number, stray
        else:
            fields, stray = None, stray or f"{line[:40].strip()!r} in line {number}"
    if fields is not None:
        yield fields, start, before


def _cut(line: str) -> tuple[str, list[str]]:
    """Cut a line into its first field and its data fields."""
    if "," in line:
        first, *rest = [text.strip() for text in line.split(",")]
        return first, rest[:8] + [""] * (8 - len(rest))
    first = line[:SMALL].strip()
    width = LARGE if first.endswith("*") or first.startswith("*") else SMALL
    count = 64 // width
    return first, [line[SMALL + width * i : SMALL + width * (i + 1)] for i in range(count)]
