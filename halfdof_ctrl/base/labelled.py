"""Labelled matrices, such as DataFrames of pandas: numbers and names taken apart, and aligned by label.

Whatever has an `index`, perhaps `columns`, and `to_numpy` or `values` is one, so that pandas need not be there. Two
matrices whose labels stand in another order are brought into one; labels that do not match are refused, since numbers
combined by position would be wrong without a sign of it.
"""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from halfdof_ctrl.base.arrays import MATRIX_DIMENSIONS, PLAIN_TYPES
from halfdof_ctrl.base.doors import described
from halfdof_ctrl.base.errors import MatrixError, SignalNameError
from halfdof_ctrl.base.names import Names, as_tuple, checked_names, listed

#: types that have no labels, known at once
UNLABELLED_TYPES = PLAIN_TYPES | {type(None), int, float}


class Axis(NamedTuple):
    """The rows or columns of a labelled matrix."""

    letter: str  #: of the matrix
    number: int  #: 0 for rows, 1 for columns
    labels: tuple[str, ...]
    counted: bool  #: whether the labels are 0, 1, 2, ... as for rows that nobody has named

    @property
    def words(self) -> str:
        """What it is called in a message."""
        return f"{'columns' if self.number else 'rows'} of {self.letter}"


def has_labels(values: Sequence[object]) -> bool:
    """Return whether one of the values is a labelled matrix or vector."""
    if UNLABELLED_TYPES.issuperset(map(type, values)):
        return False
    return any(type(value) not in UNLABELLED_TYPES and _is_labelled(value) for value in values)


def without_labels(
    given: Mapping[str, object], kinds: Mapping[str, tuple[str, str]], names: Mapping[str, Names]
) -> tuple[dict[str, object], dict[str, Names]]:
    """Take labelled matrices apart into arrays in one order of rows and columns, and the names of these.

    Parameters
    ----------
    given : mapping from letter to object
        Labelled matrices, and others, which are taken by position.
    kinds : mapping from letter to (str, str)
        What the rows and columns of each are: DOFs, inputs, ...
    names : mapping from kind to names
        Those that the user gave beside the matrices, else None.

    Returns
    -------
    matrices : dict from letter to object
        Arrays in place of the labelled ones.
    names : dict from kind to names
        With those of the labels where none were given. Rows that are counted (0, 1, 2, ...) give no names, and take
        part by position where nothing else of the kind is labelled.

    Raises
    ------
    SignalNameError
        Labels that do not match those of another matrix or the given names, twice the same, neither text nor numbers.
    MatrixError
        Labels of a kind that cannot be read: columns alone, more dimensions than two.
    """
    numbers: dict[str, npt.NDArray[Any]] = {}
    axes: dict[str, list[Axis]] = {}
    for letter, value in given.items():
        if type(value) in UNLABELLED_TYPES or not _is_labelled(value):
            continue
        numbers[letter] = _numbers(value, letter)
        of_axes = kinds[letter] if numbers[letter].ndim == MATRIX_DIMENSIONS else (_of_vector(kinds[letter]),)
        for number, (kind, labels) in enumerate(zip(of_axes, _labels(value, letter), strict=False)):
            axes.setdefault(kind, []).append(_axis(letter, number, labels))
    found = dict(names)
    for kind, together in axes.items():
        order = _common_order(together, kind, names[kind])
        if order is None:
            continue
        found[kind] = order
        for axis in together:
            if axis.labels != order and set(axis.labels) == set(order):
                places = {label: place for place, label in enumerate(axis.labels)}
                picked = [places[label] for label in order]
                numbers[axis.letter] = np.take(numbers[axis.letter], picked, axis=axis.number)
    return {**given, **numbers}, found


def _common_order(together: Sequence[Axis], kind: str, given: Names) -> tuple[str, ...] | None:
    """Find the order for all rows and columns of a kind, None where they are but counted, or refuse their labels."""
    named = [axis for axis in together if not axis.counted]
    if given is None and not named:
        return None
    order = named[0].labels if given is None else as_tuple(given, kind)
    source = f"the names given for {kind}" if given is not None else f"the {named[0].words}"
    for axis in together:
        if set(axis.labels) == set(order) or (axis.counted and not named and given is not None):
            continue
        other = [label for label in axis.labels if label not in set(order)] or [
            label for label in order if label not in set(axis.labels)
        ]
        msg = (
            f"The {axis.words} are labelled {listed(axis.labels)}, and {source} are {listed(order)}: {listed(other)} "
            f"stands in one of them alone. Give both the same labels, or take the numbers by position, "
            f"{axis.letter}.to_numpy()."
        )
        raise SignalNameError(msg, names=tuple(other))
    return order


def _is_labelled(value: object) -> bool:
    try:
        if isinstance(value, type) or not (hasattr(value, "to_numpy") or hasattr(value, "values")):
            return False
        index = getattr(value, "index", None)
    except Exception:  # noqa: BLE001  # the object is the user's; that it is no matrix is told later
        return False
    return hasattr(value, "columns") or hasattr(value, "coords") or (index is not None and not callable(index))


def _numbers(value: Any, letter: str) -> npt.NDArray[Any]:  # noqa: ANN401  # an object of a package that may be missing
    if not hasattr(value, "index") or callable(value.index):
        msg = (
            f"{letter} is {described(value)}, whose rows have no labels that could be matched. Pass its numbers, "
            f"{letter}.to_numpy(), and the names beside them."
        )
        raise MatrixError(msg, matrix=letter)
    numbers = np.asarray(value.to_numpy() if hasattr(value, "to_numpy") else value.values)
    if numbers.ndim not in (1, MATRIX_DIMENSIONS):
        msg = f"{letter} has labels and {numbers.ndim} dimensions, and a matrix has two."
        raise MatrixError(msg, matrix=letter)
    return numbers


def _labels(value: Any, letter: str) -> list[list[object]]:  # noqa: ANN401
    axes = [value.index, value.columns] if hasattr(value, "columns") else [value.index]
    try:
        return [list(axis) for axis in axes]
    except TypeError as cause:
        msg = f"{letter} is {described(value)}, whose labels cannot be listed."
        raise MatrixError(msg, matrix=letter) from cause


def _of_vector(kinds: tuple[str, str]) -> str:
    """Return what the entries of a vector in place of a matrix are: the rows of a column, the columns of a row."""
    return kinds[1] if kinds[0] == "outputs" else kinds[0]


def _axis(letter: str, number: int, labels: list[object]) -> Axis:
    counted = all(isinstance(label, int | np.integer) and label == place for place, label in enumerate(labels))
    words = f"the {'columns' if number else 'rows'} of {letter}"
    odd = [label for label in labels if isinstance(label, tuple)]
    if odd:
        msg = (
            f"The labels of {words} have several levels, as {odd[0]!r} has. Join them to one text each, such as "
            f"{'.'.join(map(str, odd[0]))!r}."
        )
        raise SignalNameError(msg, names=())
    names: Any = labels  # what is no text is refused here
    return Axis(letter, number, checked_names(names, len(labels), words), counted)
