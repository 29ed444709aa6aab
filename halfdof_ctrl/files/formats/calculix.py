"""Matrices that CalculiX writes with ``*FREQUENCY, SOLVER=MATRIXSTORAGE``.

    job.sti, job.mas     row, column, value: the upper triangle of stiffness and mass, 14 digits, zeros among them
    job.dof              a line for each row: node.DOF, as 5.1

Constrained DOFs are not in the files. Zeros are written too, so that both have lines for the same places, each row
among them, and a file with fewer rows than the ``.dof`` file names was cut short.

Source: CalculiX CrunchiX User's Manual, ``*FREQUENCY``, and the routine ``matrixstorage``.
"""

import re

import numpy as np

from halfdof_ctrl.base.errors import FileFormatError
from halfdof_ctrl.files.formats.columns import cut_lines, whole_fields
from halfdof_ctrl.files.formats.digits import known_to
from halfdof_ctrl.files.formats.labels import dof_names
from halfdof_ctrl.files.formats.raw_matrix import RawMatrix, assembled
from halfdof_ctrl.files.formats.text_blocks import ANY_FIELD, number_rows, whole_numbers

KIND_BY_ENDING = {".sti": "K", ".mas": "M"}  #: by the ending of the file
DOFS = ".dof"
LABEL = re.compile(rb"(\d{1,10})\.(\d{1,2})")
CALCULIX_SHORTEST, LONGEST = b"1.1", 12  #: a name, and characters of one: ten digits, a point and a digit
POINT, TEN = ord("."), 10
COLUMNS = 3


def read_calculix(content: bytes, ending: str, most_rows: int) -> RawMatrix:
    r"""Read a matrix.

    Parameters
    ----------
    content : bytes
        The whole file.
    ending : {".sti", ".mas"}
    most_rows : int
        A larger row number is taken for damage.

    Raises
    ------
    FileFormatError
        Lines that are no row, column and value; numbers from zero; no line at all, or none for a row.

    Examples
    --------
    >>> raw = read_calculix(b"1 1  4.0e+00\n1 2 -1.0e+00\n2 2  3.0e+00\n", ".sti", 2)
    >>> raw.letter, raw.matrix.toarray().tolist()
    ('K', [[4.0, -1.0], [-1.0, 3.0]])
    """
    table = number_rows(content, COLUMNS, comment="#")
    places = whole_numbers(table[:, :2], "row and column numbers") - 1
    size = int(places.max(initial=-1)) + 1
    if not 0 < size <= most_rows or places.min() < 0:
        msg = f"rows of row, column and value, counted from 1 to {size}, do not make a matrix. The file is damaged."
        raise FileFormatError(msg, path="")
    on_diagonal = np.zeros(size, dtype=bool)
    on_diagonal[places[places[:, 0] == places[:, 1], 0]] = True
    if not on_diagonal.all():
        msg = (
            f"row {int(np.argmin(on_diagonal)) + 1} has no line on its diagonal, where CalculiX writes zeros too. The "
            "file is damaged: copy or write it anew."
        )
        raise FileFormatError(msg, path="")
    one_sided = bool((places[:, 0] <= places[:, 1]).all() or (places[:, 0] >= places[:, 1]).all())
    return assembled(
        places[:, 0],
        places[:, 1],
        table[:, 2],
        (size, size),
        declared="symmetric" if one_sided else "unsymmetric",
        format="CalculiX",
        letter=KIND_BY_ENDING[ending],
        known_to=known_to(content),
        places=places[:, 0] * size + places[:, 1],
    )


def read_dofs(content: bytes) -> tuple[str, ...]:
    r"""Read the names of the rows.

    Raises
    ------
    FileFormatError
        A line that is not node.DOF.

    Examples
    --------
    >>> read_dofs(b"5.1\n5.3\n60.2\n")
    ('n5_u1', 'n5_u3', 'n60_u2')
    """
    return _plain_dofs(content) or _dofs_by_line(content)


def _dofs_by_line(content: bytes) -> tuple[str, ...]:
    """Read the names one by one, with the line that is wrong."""
    nodes: list[int] = []
    components: list[int] = []
    for line in ANY_FIELD.finditer(content):
        match = LABEL.fullmatch(line[0])
        if match is None:
            raise _no_label(line[0], len(nodes) + 1)
        nodes.append(int(match[1]))
        components.append(int(match[2]))
    if not nodes:
        raise _no_label(b"", 1)
    return dof_names(nodes, components)


def _no_label(text: bytes, line: int) -> FileFormatError:
    shown = text[:60].decode("latin-1")
    msg = f"a node and its DOF belong into each line, as 5.1, not {shown!r}. The file is damaged."
    return FileFormatError(msg, path="", line=line)


def _plain_dofs(content: bytes) -> tuple[str, ...] | None:
    """Read names that all are a node, a point and one digit, None if they are not."""
    lines = cut_lines(content)
    if not lines.starts.size or not ((lines.lengths > len(CALCULIX_SHORTEST) - 1) & (lines.lengths <= LONGEST)).all():
        return None
    fields = lines.cut_from_the_right(LONGEST)
    components = fields[:, -1] - np.uint8(ord("0"))
    if not ((fields[:, -2] == POINT) & (components < TEN)).all() or (fields == ord("-")).any():
        return None
    try:
        nodes = whole_fields(fields[:, :-2])
    except ValueError:
        return None
    return dof_names(nodes.tolist(), components.tolist())
