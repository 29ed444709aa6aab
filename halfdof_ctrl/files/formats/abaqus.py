"""Matrices that Abaqus writes as text: ``*MATRIX GENERATE`` with ``*MATRIX OUTPUT``.

In the file ``job_STIF1.mtx`` (MASS: mass, DMPV: viscous damping, DMPS: structural damping; 1 is the step) stand lines

    node, DOF, node, DOF, value          (FORMAT=MATRIX INPUT, the default)
    row, column, value                   (FORMAT=COORDINATE, without labels)

with comments ``**`` and keywords ``*MATRIX``. It is no Matrix Market file in spite of its ending. Of a symmetric
matrix one entry of each off-diagonal pair is written; an unsymmetric one has both. Nodes with a negative label are
internal, as the multipliers of constraints. A DOF under a boundary condition has 1e36 on the diagonal of its
stiffness. ``SCALE FACTOR=`` multiplies the entries; a second ``*MATRIX INPUT`` in the file is refused, and so are
other keywords. Lines without labels that begin to count at 0 are read so, and told. A load is ``node, DOF, value``
behind ``*CLOAD``.

Source: Abaqus Analysis User's Guide, "Generating structural matrices"; Keywords Reference, ``*MATRIX INPUT``.
"""

import re
from collections.abc import Mapping
from dataclasses import replace
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from halfdof_ctrl.base.arrays import FloatArray
from halfdof_ctrl.base.errors import FileFormatError
from halfdof_ctrl.files.formats.digits import known_to
from halfdof_ctrl.files.formats.labels import distinct, dof_names
from halfdof_ctrl.files.formats.raw_matrix import MOST_ROWS, Declared, RawMatrix, assembled, completed
from halfdof_ctrl.files.formats.text_blocks import number_rows, whole_numbers

Keys: TypeAlias = npt.NDArray[np.int64]

LABELLED, UNLABELLED = 5, 3  #: numbers in a line
KEYWORD_LINE = re.compile(rb"^\*(?!\*)[^\n]*", re.MULTILINE)
MATRIX_INPUT, LOAD, INCLUDED = "MATRIXINPUT", "CLOAD", "INCLUDE"  #: without blanks, which Abaqus passes over
KEYWORDS = (MATRIX_INPUT, LOAD, INCLUDED, "MATRIX", "MATRIXASSEMBLE")
PARAMETERS = ("NAME", "TYPE", "SCALEFACTOR")  #: of *MATRIX INPUT in a file with numbers
DECLARED_TYPES: dict[str, Declared] = {"SYMMETRIC": "symmetric", "UNSYMMETRIC": "unsymmetric"}
LARGEST_LABEL = 2**31 - 1
INTERNAL = 2**40  #: lifts the keys of internal nodes above those of all others
COMPONENT_BITS = 16


def data_columns(content: bytes) -> int:
    """Count the numbers in the first line of data: 5 or 3, or 0 if it is no line of Abaqus."""
    for line in content[:65536].split(b"\n"):
        if line.strip() and not line.startswith(b"*"):
            fields = line.replace(b",", b" ").split()
            numbers = all(re.fullmatch(rb"[-+]?[0-9.]+([DEde][-+]?[0-9]+|[-+][0-9]+)?", field) for field in fields)
            return len(fields) if numbers and len(fields) in {LABELLED, UNLABELLED} else 0
    return 0


def read_abaqus(content: bytes, most_rows: int = MOST_ROWS) -> RawMatrix:
    r"""Read a matrix.

    Parameters
    ----------
    content : bytes
        The whole file.
    most_rows : int
        A larger row number is taken for damage.

    Raises
    ------
    FileFormatError
        No data, lines with more or fewer numbers, labels that are no whole numbers.

    Examples
    --------
    >>> raw = read_abaqus(b"** made by hand\n1,1, 1,1, 4.\n2,1, 1,1, -1.\n2,1, 2,1, 3.\n")
    >>> raw.dofs, raw.matrix.toarray().tolist()
    (('n1_u1', 'n2_u1'), [[4.0, -1.0], [-1.0, 3.0]])
    """
    columns = data_columns(content)
    said = _keywords(content)
    if not columns:
        msg = (
            "no line of numbers in it that Abaqus writes (node, DOF, node, DOF, value). Write it by *MATRIX OUTPUT "
            "with FORMAT=MATRIX INPUT."
        )
        raise FileFormatError(msg, path="")
    table = number_rows(content, columns, comment="*")
    if columns == UNLABELLED and LOAD in said:
        return _load(table, known_to(content))
    declared, scale = _declared(said), _scale(said)
    table[:, -1] *= scale
    raw = _labelled(table, declared) if columns == LABELLED else _unlabelled(table, declared, most_rows)
    notes = raw.notes if scale == 1.0 else (*raw.notes, f"entries are multiplied by SCALE FACTOR={scale:g}")
    raw = replace(raw, known_to=known_to(content), notes=notes)
    return completed(raw) if declared == "unsaid" and raw.is_half_stored else raw


def _keywords(content: bytes) -> dict[str, str]:
    """Return the keywords and the parameters of *MATRIX INPUT, in capitals and without blanks.

    Raises
    ------
    FileFormatError
        Another file, a second matrix, keywords or parameters that are none of a matrix.
    """
    said: dict[str, str] = {}
    for line in KEYWORD_LINE.findall(content) if b"*" in content else ():
        shown = line[:60].decode("latin-1").strip()
        word, *parameters = "".join(line[1:].decode("latin-1").upper().split()).split(",")
        named = dict([parameter.partition("=")[::2] for parameter in parameters if parameter])
        if word == INCLUDED or "INPUT" in named or (word == MATRIX_INPUT and word in said):
            msg = (
                "*MATRIX INPUT names another file, or stands there more than once, and one matrix a file is read (and "
                "none of *INCLUDE). Give the file with the numbers, or write each matrix into its own."
            )
            raise FileFormatError(msg, path="")
        unknown = [name for name in named if word == MATRIX_INPUT and name not in PARAMETERS]
        if word not in KEYWORDS or unknown or (word == LOAD and "IMAGINARY" in named):
            msg = f"{shown!r} is not read, and may change what the numbers mean. Write each matrix into its own file."
            raise FileFormatError(msg, path="")
        said |= {word: "", **(named if word == MATRIX_INPUT else {})}
    return said


def _declared(said: Mapping[str, str]) -> Declared:
    kind = said.get("TYPE")
    if kind is not None and kind not in DECLARED_TYPES:
        msg = f"TYPE={kind[:30]} is neither SYMMETRIC nor UNSYMMETRIC. Write it anew."
        raise FileFormatError(msg, path="")
    return "unsaid" if kind is None else DECLARED_TYPES[kind]


def _scale(said: Mapping[str, str]) -> float:
    text = said.get("SCALEFACTOR", "1")
    try:
        scale = float(text.replace("D", "E"))
    except ValueError:
        scale = 0.0
    if not 0.0 < abs(scale) < np.inf:
        msg = f"SCALE FACTOR={text[:30]} is no number other than zero. Write it anew."
        raise FileFormatError(msg, path="")
    return scale


def _load(table: FloatArray, rounding: float) -> RawMatrix:
    """Read a load vector: node, DOF, value."""
    labels = whole_numbers(table[:, :2], "node and DOF labels")
    keys = _keys(labels[:, 0], labels[:, 1])
    known, rows = np.unique(keys, return_inverse=True)
    return assembled(
        rows,
        np.zeros_like(rows),
        table[:, 2],
        (known.size, 1),
        declared="general",
        format="Abaqus load",
        letter="B",
        dofs=_names(known),
        known_to=rounding,
    )


def _labelled(table: FloatArray, declared: Declared) -> RawMatrix:
    labels = whole_numbers(table[:, :4], "node and DOF labels")
    if labels.size and (np.abs(labels).max() > LARGEST_LABEL or (labels[:, 1::2] < 0).any()):
        msg = "a node or DOF label is out of range. The file is damaged."
        raise FileFormatError(msg, path="")
    rows, columns = _keys(labels[:, 0], labels[:, 1]), _keys(labels[:, 2], labels[:, 3])
    known = distinct(rows, columns)
    return assembled(
        np.searchsorted(known, rows),
        np.searchsorted(known, columns),
        table[:, 4],
        (known.size, known.size),
        declared=declared,
        format="Abaqus matrix input",
        dofs=_names(known),
    )


def _unlabelled(table: FloatArray, declared: Declared, most_rows: int) -> RawMatrix:
    places = whole_numbers(table[:, :2], "row and column numbers")
    first = 0 if places.min() == 0 else 1
    places = places - first
    size = int(places.max()) + 1
    if size > max(most_rows, table.size):
        msg = f"a row or column number is {size}. The file is damaged."
        raise FileFormatError(msg, path="")
    return assembled(
        places[:, 0],
        places[:, 1],
        table[:, 2],
        (size, size),
        declared=declared,
        format="Abaqus coordinate",
        notes=("rows have no labels in this format", *(() if first else ("rows and columns are counted from 0",))),
        open_size=True,
        first_index=first,
    )


def _keys(nodes: Keys, components: Keys) -> Keys:
    """Make keys that sort by node and DOF, internal nodes last."""
    order = np.where(nodes >= 0, nodes, INTERNAL - nodes)
    if (components >= 2**COMPONENT_BITS).any():
        msg = f"a DOF number is {components.max()}. The file is damaged."
        raise FileFormatError(msg, path="")
    return np.asarray((order << COMPONENT_BITS) + components)


def _names(keys: Keys) -> tuple[str, ...]:
    order, components = keys >> COMPONENT_BITS, keys & (2**COMPONENT_BITS - 1)
    nodes = np.where(order > LARGEST_LABEL, INTERNAL - order, order)
    return dof_names(nodes.tolist(), components.tolist())
