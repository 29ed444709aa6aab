"""A variable of a file that holds several by name: what it is, known before it is read."""

import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

import numpy as np
import numpy.typing as npt
from scipy.sparse import csc_array

from halfdof_ctrl.base.errors import FileFormatError
from halfdof_ctrl.files.formats.text_blocks import visible

IndexArray: TypeAlias = npt.NDArray[np.signedinteger[Any]]
Value: TypeAlias = npt.NDArray[Any] | csc_array | list[str]
Kind: TypeAlias = Literal["matrix", "text", "struct", "cell", "object"]

MOST_PARTS = 1000  #: of a struct or cell array that are listed
MOST_VARIABLES = 4000  #: of a workspace
EXPANSION = 10  #: bytes that are unpacked of a packed byte
FREE_BYTES = 2**22  #: that may be unpacked whatever the file's length: 700 x 700 numbers
PLANE = 2  #: dimensions of a matrix


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Variable:
    """What a file says of a variable before its numbers are read."""

    name: str  #: ``K``; in a struct ``sys.K``, in a cell array ``K{2}``
    kind: Kind  #: "object" is what cannot be read: functions, classes, pickled objects
    shape: tuple[int, ...]
    read: Callable[[], Value]  #: raises what damaged bytes make of it, and FileFormatError for another kind
    parts: Callable[[], list["Variable"]] = list  #: of a struct or cell array

    def __post_init__(self) -> None:
        """Take away what a terminal would obey in the name."""
        object.__setattr__(self, "name", visible(self.name))

    @property
    def is_matrix(self) -> bool:
        """Whether it has rows and columns of numbers, and more than one of them."""
        return self.kind == "matrix" and len(self.shape) == PLANE and max(self.shape) > 1

    @property
    def words(self) -> str:
        """Name, kind and size for people."""
        size = " x ".join(map(str, self.shape)) or "a number"
        return f"{self.name} ({size if self.kind == 'matrix' else self._kind_in_words()})"

    def _kind_in_words(self) -> str:
        if self.kind == "cell":
            return "cell array of matrices" if _has_matrix(self.parts) else "cell array"
        return {"struct": "struct", "text": "text", "object": "object, not numbers"}.get(self.kind, self.kind)


def _has_matrix(parts: Callable[[], list[Variable]]) -> bool:
    try:
        return any(part.is_matrix for part in parts())
    except (ValueError, LookupError, TypeError, OSError, zlib.error):  # damaged, and only to be named
        return False


def most_unpacked(length: int) -> int:
    """Return how many bytes may be unpacked from so many.

    >>> most_unpacked(1) == FREE_BYTES, most_unpacked(10**9)
    (True, 10000000000)
    """
    return max(EXPANSION * length, FREE_BYTES)


def require_room(name: str, size: int, length: int) -> None:
    """Refuse to unpack a variable that is out of proportion to its file.

    Raises
    ------
    FileFormatError
        It has more bytes than `most_unpacked` allows.
    """
    if size > most_unpacked(length):
        raise out_of_room(name, size, length)


def out_of_room(name: str, size: int, length: int) -> FileFormatError:
    """Make the refusal of what is out of proportion to its file."""
    msg = (
        f"{name} would take {size} bytes, more than are unpacked from {length}. If it is no damage but a matrix of "
        "zeros mostly, save it sparse; if it is sparse, without packing (numpy.savez, or MATLAB's save(..., '-v6'))."
    )
    return FileFormatError(msg, path="")


def require_few(count: int) -> None:
    """Refuse a workspace of more variables than anybody has, whose descriptions take far more bytes than it has itself.

    Raises
    ------
    FileFormatError
        There are more than `MOST_VARIABLES`.
    """
    if count > MOST_VARIABLES:
        msg = f"it holds more than {MOST_VARIABLES} variables. Save those of the model: save(file, 'M', 'C', 'K')."
        raise FileFormatError(msg, path="")


def require_names_once(found: Sequence[Variable]) -> None:
    """Refuse a file with two variables of one name, of which one would be read and nobody knew which.

    Raises
    ------
    FileFormatError
        There are two.
    """
    names: set[str] = set()
    for variable in found:
        if variable.name and variable.name in names:
            raise name_twice(variable.name)
        names.add(variable.name)


def name_twice(name: str) -> FileFormatError:
    """Make the refusal of a name that stands twice."""
    return FileFormatError(f"there are two variables {name!r} in it. Write it anew, with one of them.", path="")


def require_ascending(name: str, rows: IndexArray, starts: IndexArray) -> None:
    """Refuse compressed columns of MATLAB whose row numbers do not ascend, each once, as its own always do.

    Raises
    ------
    FileFormatError
        A row number is damaged, or a column begins elsewhere.
    """
    ascends = np.ones(rows.size + 1, dtype=bool)
    ascends[1:-1] = np.diff(rows) > 0
    ascends[starts[:-1]] = True
    if not ascends.all():
        place = int(np.argmin(ascends))
        column = int(np.searchsorted(starts, place, side="right"))
        msg = f"the rows in column {column} of the sparse matrix {name} do not ascend. The file is damaged."
        raise FileFormatError(msg, path="")


def another_kind(name: str) -> FileFormatError:
    """Make the refusal of what is neither numbers nor names."""
    msg = (
        f"{name} is a struct, string or other object, where numbers or names should be. Save plain matrices, and "
        f"names as cellstr; of a struct by  save(file, '-struct', '{name}')."
    )
    return FileFormatError(msg, path="")
