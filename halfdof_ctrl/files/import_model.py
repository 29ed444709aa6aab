"""Models from files, and what was found in them.

Matrices come from `assembly`; here they become a `SecondOrderModel`, and what looks wrong about them becomes a warning.
"""

import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeAlias

from halfdof_ctrl.base.arrays import EPS
from halfdof_ctrl.base.definiteness import LARGEST_COMPONENT
from halfdof_ctrl.base.doors import answer_of, is_choice, require_path, shown
from halfdof_ctrl.base.errors import (
    FileFormatError,
    ImportedModelWarning,
    ParameterError,
    give_warning,
)
from halfdof_ctrl.base.names import checked_names, listed
from halfdof_ctrl.files.assembly import ImportedModel, read_matrices
from halfdof_ctrl.files.containers import PathLike, single_text, texts
from halfdof_ctrl.files.formats.raw_matrix import Triangle
from halfdof_ctrl.files.import_report import ImportReport
from halfdof_ctrl.files.naming import naming_the_file
from halfdof_ctrl.model.law_text import elements_from_stored
from halfdof_ctrl.model.mechss import mechss
from halfdof_ctrl.model.nonlinear import NonlinearModel, nlmechss
from halfdof_ctrl.model.second_order import SecondOrderModel

Paths: TypeAlias = PathLike | Sequence[PathLike] | Mapping[str, PathLike]
FACTORIZE_NONE = 0  #: loading a model does not wait for ranks
NAMES = ("dofs", "inputs", "outputs")
TRIANGLES = ("lower", "upper")


def import_model(
    path: Paths,
    *,
    triangle: Triangle | None,
    remove_fixed: bool,
    matrices: Mapping[str, str | None] | None,
) -> SecondOrderModel | NonlinearModel:
    """Read a model from files, see `models.load_model`."""
    matrices = _plain(matrices, "matrices")
    given = _checked(_plain(path, "path"), triangle, remove_fixed, matrices)
    found = read_matrices(
        given, triangle=triangle, remove_fixed=remove_fixed, matrices=matrices, largest=FACTORIZE_NONE
    )
    first = next(iter(given.values())) if isinstance(given, Mapping) else given[0]
    if found.K is None:
        other = f" It holds {listed(found.report.unused, most=24)} besides." if found.report.unused else ""
        also = f": {found.holds}" if found.holds else f".{other} Give its file, or matrices={{'K': name}}"
        msg = f"{first}: no stiffness K in {', '.join(found.report.files)}{also}."
        raise FileFormatError(msg, path=str(first))
    chosen_by_hand = isinstance(given, Mapping) or len(given) > 1
    said = tuple(matrices or ())
    doubts = () if found.own_layout else found.report.warnings  # what save_model wrote is as it was meant
    for text in (*doubts, *([] if chosen_by_hand else _missing(found, said))):
        give_warning(f"{first}: {text}", ImportedModelWarning)
    with naming_the_file(first):
        return _model(found)


def import_report(
    path: Paths,
    *,
    triangle: Triangle | None,
    remove_fixed: bool,
    matrices: Mapping[str, str | None] | None,
    largest: int = LARGEST_COMPONENT,
) -> ImportReport:
    """Look at the files of a model, see `models.inspect_files`."""
    matrices = _plain(matrices, "matrices")
    given = _checked(_plain(path, "path"), triangle, remove_fixed, matrices)
    return read_matrices(given, triangle=triangle, remove_fixed=remove_fixed, matrices=matrices, largest=largest).report


def _plain(value: Any, parameter: str) -> Any:  # noqa: ANN401  # what users give
    """Return a mapping as a dictionary, and anything else as it is."""
    if not isinstance(value, Mapping):
        return value
    return answer_of(lambda: dict(value.items()), parameter=parameter, meaning="a mapping, to list what it holds")


def _checked(
    path: Any,  # noqa: ANN401  # what users give
    triangle: object,
    remove_fixed: object,
    matrices: object,
) -> list[Path] | dict[str, Path]:
    """Return paths, and refuse options that are none."""
    if triangle is not None and not is_choice(triangle, TRIANGLES):
        msg = f"triangle={shown(triangle)}, but it is 'lower', 'upper' or None: what files store of a symmetric matrix."
        raise ParameterError(msg, parameter="triangle", value=triangle)
    if not isinstance(remove_fixed, bool):
        msg = f"remove_fixed={shown(remove_fixed)}, but it is True or False."
        raise ParameterError(msg, parameter="remove_fixed", value=remove_fixed)
    sound = matrices is None or (
        isinstance(matrices, Mapping)
        and all(isinstance(key, str) and (name is None or isinstance(name, str)) for key, name in matrices.items())
    )
    if not sound:
        msg = (
            f"matrices={shown(matrices)}, but it is a mapping from letters to names in files, as {{'K': 'kaa', 'C': "
            "'D'}."
        )
        raise ParameterError(msg, parameter="matrices", value=matrices)
    if isinstance(path, str | os.PathLike):
        require_path(path, "The path")
        return [Path(path)]
    paths = path.values() if isinstance(path, Mapping) else path if isinstance(path, Sequence) else None
    if paths is None or not all(isinstance(one, str | os.PathLike) for one in paths):
        msg = (
            "load_model and inspect_files take a path, a list of paths, or a mapping as {'K': path, 'M': path}; this "
            f"is {type(path).__name__}."
        )
        raise ParameterError(msg, parameter="path", value=path)
    if not path:
        msg = "No file is given. Give at least the stiffness."
        raise FileFormatError(msg, path="")
    for one in paths:
        require_path(one, "A path")
    return {letter: Path(one) for letter, one in path.items()} if isinstance(path, Mapping) else [*map(Path, path)]


def _model(found: ImportedModel) -> SecondOrderModel | NonlinearModel:
    """Make the model under the names of the files."""
    names: dict[str, Any] = {key: texts(found.texts, key) for key in NAMES}
    names["dofs"] = found.dofs or names["dofs"]
    prescribed = texts(found.texts, "prescribed")
    matrices: dict[str, Any] = {"M": found.M, "C": found.C, "K": found.K, **found.signals}
    title = single_text(found.texts)
    if not prescribed:
        model = mechss(**matrices, **names, name=title)
    else:
        model = _with_prescribed(mechss(**matrices, dofs=names["dofs"], name=title), names, prescribed)
    model = model if found.known_to == EPS else replace(model, known_to=found.known_to)
    elements = texts(found.texts, "elements")
    return nlmechss(model, elements_from_stored(elements)) if elements else model


def _with_prescribed(model: SecondOrderModel, names: Mapping[str, Any], prescribed: Sequence[str]) -> SecondOrderModel:
    """Name the signals of a model in which the force on a DOF or its motion may be a direct term."""
    signals: dict[str, Any] = {
        key: getattr(model, key) if names[key] is None else checked_names(names[key], len(getattr(model, key)), key)
        for key in ("inputs", "outputs")
    }
    return replace(model, **signals, prescribed=checked_names(prescribed, len(prescribed), "prescribed DOFs"))


def _missing(found: ImportedModel, said: Sequence[str]) -> list[str]:
    what = {"M": "mass M", "C": "damping C"}
    return [
        f"no {what[letter]} in {', '.join(found.report.files)}, so it is taken as zero."
        for letter in found.report.missing
        if letter in what and letter not in said
    ]
