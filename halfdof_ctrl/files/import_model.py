"""Models from the files of finite-element programs, and what was found in any model file.

Matrices come from `assembly` or from the variables of one file (`containers`); here they become a `SecondOrderModel`,
and what looks wrong about them becomes a warning.
"""

import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, cast

import numpy as np
from scipy.sparse import csc_array, issparse

from halfdof_ctrl.base.arrays import checked_matrix
from halfdof_ctrl.base.errors import FileFormatError, ImportedModelWarning, MatrixError, callers_level
from halfdof_ctrl.base.names import checked_dofs
from halfdof_ctrl.files.assembly import ImportedModel, read_matrices, report_on
from halfdof_ctrl.files.containers import load_variables, texts
from halfdof_ctrl.files.definiteness import LARGEST_COMPONENT
from halfdof_ctrl.files.formats.raw_matrix import RawMatrix, Triangle, storage, with_triangle
from halfdof_ctrl.files.import_report import ImportReport
from halfdof_ctrl.files.naming import naming_the_file
from halfdof_ctrl.model.mechss import mechss
from halfdof_ctrl.model.second_order import SecondOrderModel

FACTORIZE_NONE = 0  #: loading a model does not wait for ranks


def import_model(
    given: Sequence[Path] | Mapping[str, Path],
    *,
    triangle: Triangle | None,
    remove_fixed: bool,
    matrices: Mapping[str, str] | None,
) -> SecondOrderModel:
    """Read a model from the files of a finite-element program, see `models.load_model`."""
    found = read_matrices(
        given, triangle=triangle, remove_fixed=remove_fixed, matrices=matrices, largest=FACTORIZE_NONE
    )
    first = next(iter(given.values())) if isinstance(given, Mapping) else given[0]
    if found.K is None:
        msg = f"{first}: no stiffness K in {', '.join(found.report.files)}. Give its file, or matrices={{'K': name}}."
        raise FileFormatError(msg, path=str(first))
    chosen_by_hand = isinstance(given, Mapping) or len(given) > 1
    for text in (*found.report.warnings, *([] if chosen_by_hand else _missing(found))):
        warnings.warn(f"{first}: {text}", ImportedModelWarning, stacklevel=callers_level())
    with naming_the_file(first):
        sparse: dict[str, Any] = {"M": found.M, "C": found.C, "K": found.K, **found.signals}
        return mechss(**sparse, dofs=found.dofs)


def import_report(
    given: Sequence[Path] | Mapping[str, Path],
    *,
    triangle: Triangle | None,
    remove_fixed: bool,
    matrices: Mapping[str, str] | None,
    largest: int = LARGEST_COMPONENT,
) -> ImportReport:
    """Look at the files of a finite-element program, see `models.inspect_files`."""
    return read_matrices(given, triangle=triangle, remove_fixed=remove_fixed, matrices=matrices, largest=largest).report


def container_report(path: Path, *, triangle: Triangle | None, largest: int) -> ImportReport:
    """Look at the matrices of an .npz or .mat file."""
    content = load_variables(path, ("M", "C", "K", "dofs"))
    given = {letter: content[letter] for letter in ("M", "C", "K") if letter in content}
    if not given:
        msg = f"{path}: it has none of the matrices M, C, K."
        raise FileFormatError(msg, path=str(path))
    with naming_the_file(path):
        square: dict[str, csc_array] = {}
        for letter, value in given.items():
            square[letter] = _square(letter, value, next(iter(square.values())).shape if square else None)
        n = next(iter(square.values())).shape[0]
        names = texts(content, "dofs")
        dofs = tuple([f"q{index}" for index in range(n)]) if names is None else checked_dofs(names, n)
        return report_on(
            {letter: filled(letter, matrix, triangle) for letter, matrix in square.items()},
            dofs,
            path,
            labelled=names is not None,
            largest=largest,
        )


def filled(letter: str, value: Any, triangle: Triangle | None) -> Any:  # noqa: ANN401  # dense or sparse
    """Complete a matrix of which only this triangle is stored; without a triangle it stays as it is."""
    if triangle is None or value is None:
        return value
    matrix = _square(letter, value, None)
    raw = RawMatrix(matrix=matrix, format="", declared="unsaid", stored=storage(matrix), completed=False)
    return with_triangle(raw, triangle).matrix


def _square(letter: str, value: Any, shape: tuple[int, ...] | None) -> csc_array:  # noqa: ANN401  # dense or sparse
    """Check a matrix as `mechss` does, and keep it sparse."""
    expected = None if shape is None else (shape[0], shape[1])
    if not issparse(value):
        return csc_array(checked_matrix(value, letter, expected))
    matrix: csc_array = csc_array(cast("Any", value))
    matrix.eliminate_zeros()
    size = matrix.shape
    if size[0] != size[1] or size != (expected or size):
        wanted = "square" if expected is None else f"{expected[0]} x {expected[1]}"
        msg = f"{letter} must be {wanted}, but it is {size[0]} x {size[1]}."
        raise MatrixError(msg, matrix=letter)
    if not np.isfinite(matrix.data).all():
        msg = f"{letter} has entries that are not finite."
        raise MatrixError(msg, matrix=letter)
    return matrix


def _missing(found: ImportedModel) -> list[str]:
    what = {"M": "mass M", "C": "damping C"}
    return [
        f"no {what[letter]} in {', '.join(found.report.files)}, so it is taken as zero."
        for letter in found.report.missing
        if letter in what
    ]
