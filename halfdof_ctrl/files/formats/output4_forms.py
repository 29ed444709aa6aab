"""The forms of OUTPUT4 matrices: what the entries of each mean.

Source: MSC Nastran DMAP Programmer's Guide, matrix trailer, word FORM.
"""

from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from halfdof_ctrl.base.errors import FileFormatError
from halfdof_ctrl.files.formats.raw_matrix import Declared

Array: TypeAlias = npt.NDArray[Any]

SYMMETRIC_FORM, DIAGONAL_FORM, ROW_FORM, IDENTITY_FORM = 6, 3, 7, 8
PLAIN_FORMS = {1: "square", 2: "rectangular", 3: "diagonal", 6: "symmetric", 7: "row vector", 8: "identity"}
OTHER_FORMS = {
    4: "lower triangular factor",
    5: "upper triangular factor",
    9: "pseudo identity",
    10: "Cholesky factor",
    11: "trapezoidal",
    13: "sparse lower triangular factor",
    15: "sparse upper triangular factor",
}  #: which are no matrices of a model


def declared_by_form(form: int) -> Declared:
    """Tell what a form says of symmetry."""
    if form == SYMMETRIC_FORM:
        return "symmetric"
    return "unsaid" if form in PLAIN_FORMS else "unsymmetric"


def doubts_of_form(form: int) -> tuple[str, ...]:
    """Tell what is wrong about a form for a matrix of a model."""
    if form in PLAIN_FORMS:
        return ()
    return (f"has the form {form} ({OTHER_FORMS.get(form, 'unknown')}), which is no matrix of a model",)


def meant_by_form(
    form: int, shape: tuple[int, int], name: str, entries: tuple[Array, Array, Array]
) -> tuple[Array, Array, Array, tuple[int, int]]:
    """Return rows, columns, values and shape as the form means them.

    Raises
    ------
    FileFormatError
        An identity or a diagonal with entries that are not its own, a row vector of several rows and columns.

    Examples
    --------
    >>> none = np.zeros(0, dtype=np.int64)
    >>> meant_by_form(8, (2, 2), "maa", (none, none, np.zeros(0)))[2].tolist()
    [1.0, 1.0]
    """
    rows, columns, values = entries
    n = max(shape)
    if form == DIAGONAL_FORM and min(shape) == 1 and n > 1:
        place = rows + columns  # one of them is zero
        return place, place, values, (n, n)
    wrong = form == DIAGONAL_FORM and bool(((rows != columns) & (values != 0)).any())
    if wrong or (form == ROW_FORM and min(shape) > 1):
        msg = f"{name} says that it is a {PLAIN_FORMS[form]} (form {form}), but it is none. The file is damaged."
        raise FileFormatError(msg, path="")
    if form == IDENTITY_FORM and not rows.size:
        every = np.arange(n)
        return every, every, np.ones(n), (n, n)
    if form == IDENTITY_FORM and ((rows != columns) | (values != 1.0)).any():
        msg = f"{name} says that it is an identity (form 8), but its entries are others. The file is damaged."
        raise FileFormatError(msg, path="")
    return rows, columns, values, shape
