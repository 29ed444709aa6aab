"""What a file of named variables holds of a model: MATLAB workspaces, archives and arrays of NumPy.

Variables called M, C, K, B, F, G, H, D, Bv, Ba, Dv, Da are what their letters say, ``matrices=`` says it for any other
name, also of a field of a struct, ``sys.K``, or a cell, ``K{2}``. A single matrix is what its file is called. Nothing
else is guessed: the refusal lists what there is, with the argument that says it.
"""

import re
import zlib
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np
import numpy.typing as npt
from scipy.sparse import csc_array, issparse

from halfdof_ctrl.base.arrays import EPS, checked_matrix
from halfdof_ctrl.base.digits import SINGLE_ROUNDING
from halfdof_ctrl.base.errors import FileFormatError, HalfdofError, MatrixError
from halfdof_ctrl.base.names import checked_dofs, listed
from halfdof_ctrl.files.containers import texts, variables
from halfdof_ctrl.files.formats.raw_matrix import RawMatrix, storage
from halfdof_ctrl.files.formats.variables import (
    EXPANSION,
    PLANE,
    Variable,
    another_kind,
    most_unpacked,
    out_of_room,
)

SQUARE = ("M", "C", "K", "S")
SIGNALS = ("B", "Bv", "Ba", "F", "G", "H", "D", "Dv", "Da")
TEXT_VARIABLES = ("dofs", "inputs", "outputs", "prescribed", "elements")
BYTES_OF_ENTRY = 36  #: of a full matrix: the number as float64, and in compressed columns while these are made
ROUNDING_VARIABLE = "known_to"  #: variable with the relative rounding of the entries
STATE_SPACE = {"A", "B", "C", "D"}
SAVED_TEXTS = ("elements",)  #: which save_model writes as text; a workspace may have a table of that name
OWN_LAYOUT = {"B", "F", "D", "dofs", "inputs", "outputs"}  #: all of which save_model writes
GUESSES = {
    "K": ("k", "kk", r"k_?\d*", r"k(_|mat|glob|full|red).*", r".*(_k|stiff?\w*)", r"k\w{1,3}"),
    "M": ("m", "mm", r"m_?\d*", r"m(_|mat|glob|full|red).*", r".*(_m|mass\w*)", r"m\w{1,3}"),
    "C": ("c", "cc", r"c_?\d*", r"c(_|mat|glob|full|red).*", r".*(_c|damp\w*)", "d", "e", "dd", "b", r"[cd]\w{1,3}"),
}  #: names of variables in small letters that probably are the letter, likeliest first; only proposed, never taken


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Workspace:
    """The matrices of a model in a file, and what else there is."""

    matrices: tuple[RawMatrix, ...]
    left: tuple[Variable, ...]  #: what was not read
    texts: Mapping[str, Any]  #: names of signals as the file has them, and ``name``
    own_layout: bool  #: whether the file has all that save_model writes


def read_workspace(content: bytes, titles: Mapping[str, str | None], room: int, *, is_archive: bool) -> Workspace:
    """Read what belongs to a model.

    Parameters
    ----------
    content : bytes
        The whole file.
    titles : mapping from letter to str or None
        Names that the user gives; None: there is no such matrix.
    room : int
        A variable with more rows, columns or names is taken for damage.
    is_archive : bool
        Whether it is of NumPy.

    Raises
    ------
    FileFormatError, MatrixError, ValueError, ...
        The file is damaged, or what is called M, C or K is no matrix.
    """
    found = variables(content, is_archive=is_archive)
    if len(found) == 1 and not found[0].name and found[0].kind != "matrix":  # of a .npy file, there is nothing else
        found[0].read()
        raise another_kind("it")
    named = {variable.name: variable for variable in found}
    if set(named) >= STATE_SPACE and not titles and not {"K", "M"} & set(named):
        msg = "no stiffness K in the file, which holds a state space A, B, C, D. Read it by load_system."
        raise FileFormatError(msg, path="")
    chosen = _chosen(found, titles)
    others = [
        variable
        for variable in found
        if variable.name not in (*TEXT_VARIABLES, "name", ROUNDING_VARIABLE) or variable.is_matrix
    ]
    if not set(chosen) & set(SQUARE):
        single = [variable for variable in others if variable.is_matrix] or [
            variable for variable in others if variable.kind == "matrix" and len(variable.shape) == PLANE
        ]
        if len(single) == 1 and single[0] not in chosen.values():
            chosen = {None: single[0]}
    if not titles:
        _require_matrices(chosen, others)
    own_layout = set(named) >= OWN_LAYOUT
    size = next((variable.shape[0] for variable in chosen.values() if variable.shape), 0)
    called = [
        key
        for key in (*TEXT_VARIABLES, "name")
        if key in named and (own_layout or _names_signals(key, named[key], size))
    ]
    for variable in (*chosen.values(), *[named[key] for key in called]):
        _require_room(variable, room)
    names = {key: named[key].read() for key in called}
    dofs = texts(names, "dofs")
    rounding = _rounding(named, own_layout=own_layout)
    taken = [id(variable) for variable in chosen.values()]
    raws = [_raw(letter, variable, dofs, rounding, _format(is_archive)) for letter, variable in chosen.items()]
    lost = OWN_LAYOUT - set(named)
    if len(lost) == 1 and raws:
        doubt = f"has {listed(sorted(OWN_LAYOUT - lost))} but not {listed(list(lost))}: save_model writes them together"
        raws[0] = replace(raws[0], doubts=(*raws[0].doubts, doubt))
    return Workspace(
        matrices=tuple(raws),
        left=tuple([variable for variable in others if id(variable) not in taken and variable.name]),
        texts=names,
        own_layout=own_layout,
    )


def _require_room(variable: Variable, room: int) -> None:
    """Refuse what has more rows, columns or names than its file has bytes, before memory is taken for them."""
    if max(variable.shape, default=0) > room:
        size = " x ".join(map(str, variable.shape))
        msg = f"{variable.name or 'it'} is {size}, more than its file has bytes for. The file is damaged."
        raise FileFormatError(msg, path="")


def _require_spread(array: npt.NDArray[Any], name: str) -> None:
    """Refuse a full matrix of numbers of one or two bytes, which as float64 is out of proportion to its file."""
    if array.dtype.itemsize * EXPANSION <= BYTES_OF_ENTRY and array.dtype.kind in "biuf":
        spread = int(np.count_nonzero(array)) * BYTES_OF_ENTRY
        if spread > most_unpacked(array.nbytes):
            raise out_of_room(name, spread, array.nbytes)


def _names_signals(key: str, variable: Variable, size: int) -> bool:
    """Tell names of DOFs and signals from what else is called dofs, inputs, elements in a workspace."""
    if key in SAVED_TEXTS:
        return variable.kind == "text" or (variable.kind == "cell" and all(_is_text(part) for part in variable.parts()))
    if variable.kind == "matrix":  # as many numbers as there are DOFs are meant as their names
        return key == "dofs" and variable.shape in {(size,), (size, 1), (1, size)}
    return variable.kind in {"text", "cell", "object"}


def _is_text(variable: Variable) -> bool:
    return variable.kind == "text"


def _require_matrices(chosen: Mapping[str | None, Variable], others: Sequence[Variable]) -> None:
    """Refuse numbers called K and M beside matrices of other names: they are parameters."""
    square = [variable for letter, variable in chosen.items() if letter in SQUARE]
    larger = [variable for variable in others if variable.is_matrix and variable.shape[0] == variable.shape[-1]]
    if square and larger and not any(variable.is_matrix or variable.kind != "matrix" for variable in square):
        names = listed([variable.name for variable in square])
        msg = f"single numbers are called {names}, but {listing(larger)}."
        raise FileFormatError(msg, path="")


def listing(left: Sequence[Variable], known: Collection[str] = ()) -> str:
    """List what a file holds, with the argument that says which is which, but for the letters that are known."""
    found = list(_with_parts(left))
    groups: dict[str, list[str]] = {}
    for variable in found:
        groups.setdefault(variable.words[len(variable.name) :], []).append(variable.name)
    held = "; ".join([f"{listed(names, most=24)}{words}" for words, names in groups.items()]) or "nothing"
    return f"it holds {held}. Say which is which: matrices={{{_proposal(found, known)}}}"


def _format(is_archive: bool) -> str:  # noqa: FBT001  # as found
    return "NumPy" if is_archive else "MATLAB"


def _chosen(found: Sequence[Variable], titles: Mapping[str, str | None]) -> dict[str | None, Variable]:
    """Find the variable for each letter, by the user's word or by its own name."""
    chosen: dict[str | None, Variable] = {}
    for letter, title in titles.items():
        variable = None if title is None else _called(title, found)
        if variable is not None:
            chosen[letter] = variable
    claimed = [variable.name for variable in chosen.values()]
    for variable in found:
        letter = variable.name
        if variable.kind == "matrix" and 0 in variable.shape:  # [], by which MATLAB says that there is none
            continue
        readable = letter in SQUARE[:3] or (letter in SIGNALS and variable.kind == "matrix")
        if readable and letter not in titles and letter not in claimed:
            chosen[letter] = variable
    order = [letter for letter in (*SQUARE, *SIGNALS) if letter in chosen]
    return {letter: chosen[letter] for letter in order}


def _called(title: str, found: Sequence[Variable]) -> Variable | None:
    """Find a variable by its name, whose capitals count only where two names differ in nothing else."""
    every = list(found) if title in [variable.name for variable in found] else list(_with_parts(found))
    exact = [variable for variable in every if variable.name == title]
    alike = exact or [variable for variable in every if variable.name.lower() == title.lower()]
    return alike[0] if len(alike) == 1 else None


def _with_parts(found: Sequence[Variable]) -> Iterator[Variable]:
    """Return variables, and what is in structs and cell arrays."""
    for variable in found:
        yield variable
        if variable.kind in {"struct", "cell"}:
            yield from _with_parts([part for part in _sound_parts(variable) if part.kind != "text"])


def _sound_parts(variable: Variable) -> list[Variable]:
    """Look into a struct or cell array, which may be damaged where nobody asked for it."""
    try:
        return variable.parts()
    except (HalfdofError, ValueError, LookupError, TypeError, OverflowError, OSError, zlib.error):
        return []


def _proposal(found: Sequence[Variable], known: Collection[str]) -> str:
    square = [variable for variable in found if variable.is_matrix and variable.shape[0] == variable.shape[-1]]
    words = []
    taken: set[str] = set()
    for letter, patterns in GUESSES.items():
        if letter in known:
            continue
        for pattern in patterns:
            hits = [
                variable.name
                for variable in square
                if variable.name not in taken
                and "{" not in variable.name  # of a cell array its name says nothing of each
                and re.fullmatch(pattern, variable.name.split(".")[-1].lower())
            ]
            if hits:
                words.append(f"{letter!r}: {hits[0]!r}")
                taken.add(hits[0])
                break
    if "K" not in known and not any(word.startswith("'K'") for word in words):  # which no model is without
        words = ["'K': name", *words]
    return ", ".join(words if taken else [f"{letter!r}: name" for letter in GUESSES if letter not in known])


def _rounding(named: Mapping[str, Variable], *, own_layout: bool) -> float:
    variable = named.get(ROUNDING_VARIABLE)
    value = float(np.asarray(variable.read()).item()) if variable is not None and variable.kind == "matrix" else EPS
    if own_layout and not EPS <= value < 1.0:
        msg = f"{ROUNDING_VARIABLE} is {value:g}, which is no relative rounding of entries. The file is damaged."
        raise FileFormatError(msg, path="")
    return value if EPS <= value < 1.0 else EPS


def _raw(letter: str | None, variable: Variable, dofs: list[str] | None, rounding: float, words: str) -> RawMatrix:
    value = variable.read()
    matrix, dense = _as_matrix(letter, variable.name, value)
    rows, columns = matrix.shape
    is_square = letter in SQUARE or (letter is None and rows == columns)
    single = dense is not None and dense.dtype in {np.dtype(np.float32), np.dtype(np.complex64)}
    return RawMatrix(
        matrix=matrix,
        format=words,
        declared="unsaid",
        stored=storage(matrix) if rows == columns else "both",
        completed=False,
        title=variable.name,
        letter=letter,
        dofs=checked_dofs(dofs, rows) if dofs is not None and is_square and rows == columns else None,
        named=bool(variable.name),
        dense=dense,
        known_to=SINGLE_ROUNDING if single else rounding,
    )


def _as_matrix(letter: str | None, name: str, value: Any) -> tuple[csc_array, Any]:  # noqa: ANN401  # as read
    """Check numbers, and give them sparse, and dense where the file has them so."""
    shown = name or letter or "the matrix"
    if issparse(value):
        matrix: csc_array = csc_array(cast("Any", value))
        if not np.isfinite(matrix.data).all():
            msg = f"{shown} has entries that are not finite."
            raise MatrixError(msg, matrix=shown)
        matrix.eliminate_zeros()
        return matrix, None
    array = np.asarray(value)
    if letter in SIGNALS and array.ndim < PLANE:  # a row of F, a column of B, a single number
        column = np.atleast_2d(array).T if letter[0] == "B" else np.atleast_2d(array)
        return csc_array(np.asarray(column, dtype=np.result_type(array, np.float64))), array
    if letter in SQUARE and array.ndim == PLANE and array.shape[0] != array.shape[1] and array.dtype.kind in "biufc":
        lumped = (
            " If these are the entries of a diagonal, save them as a matrix, diag(...)." if 1 in array.shape else ""
        )
        msg = (
            f"{shown} must be square, but it is {array.shape[0]} x {array.shape[1]}.{lumped} If it is something else, "
            f"name the right one, matrices={{{letter!r}: name}}, or leave it out, matrices={{{letter!r}: None}}."
        )
        raise MatrixError(msg, matrix=shown)
    _require_spread(array, shown)
    checked = checked_matrix(array, shown, None if letter in SQUARE[:3] else array.shape if array.ndim > 1 else None)
    return csc_array(checked), array
