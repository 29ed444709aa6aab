"""State spaces in files: A, B, C, D with the names of states, inputs and outputs."""

from typing import Any

import control
import numpy as np

from halfdof_ctrl.base.arrays import checked_matrix
from halfdof_ctrl.base.errors import FileFormatError, ImportedModelWarning, give_warning
from halfdof_ctrl.base.names import checked_names, listed
from halfdof_ctrl.files.containers import Content, PathLike, load_variables, single_text, texts
from halfdof_ctrl.files.naming import naming_the_file
from halfdof_ctrl.files.writing import save_matrices
from halfdof_ctrl.systems.doors import checked_system
from halfdof_ctrl.systems.state_space_data import StateSpaceData

SYSTEM_LETTERS = StateSpaceData._fields
SYSTEM_NAMES = ("states", "inputs", "outputs")
UNKNOWN_PERIOD = -1.0  #: MATLAB's Ts of a sampled system without a period, True in python-control


def save_system(sys: control.StateSpace, path: PathLike) -> None:
    """Write A, B, C, D and the labels of a state space, which Python cannot pickle.

    Parameters
    ----------
    sys : control.StateSpace
    path : path-like
        Ends in ``.npz`` or ``.mat``; in MATLAB: ``load mount.mat; sys = ss(A, B, C, D)``.

    Raises
    ------
    FileFormatError
        Another ending.
    OSError
        The file cannot be written.
    """
    sys = checked_system(sys, "save_system")
    content = StateSpaceData.of(sys)._asdict()
    if sys.dt is not None:
        content["dt"] = np.array(UNKNOWN_PERIOD if sys.dt is True else float(sys.dt))
    names = {"states": sys.state_labels, "inputs": sys.input_labels, "outputs": sys.output_labels}
    save_matrices(path, content, names, sys.name)


def load_system(path: PathLike) -> control.StateSpace:
    """Read a state space that `save_system` wrote, or any with A, B, C, D.

    Raises
    ------
    FileFormatError
        As `load_model`.
    OSError
        The file is not there or cannot be read.

    Warns
    -----
    ImportedModelWarning
        There are names, but nothing tells whether time is continuous.
    """
    content = load_variables(path, (*SYSTEM_LETTERS, *SYSTEM_NAMES, "name", "dt"))
    missing = [letter for letter in SYSTEM_LETTERS if letter not in content]
    if missing:
        msg = f"{path}: {listed(missing)} not in the file. A state space file holds A, B, C and D."
        raise FileFormatError(msg, path=str(path))
    with naming_the_file(path):
        found = _system(content)
    if "dt" not in content and any(key in content for key in SYSTEM_NAMES):
        msg = f"{path}: no dt in the file, so the system is taken as continuous."
        give_warning(msg, ImportedModelWarning)
    return found


def _system(content: Content) -> control.StateSpace:
    shapes = [np.shape(content[letter]) for letter in SYSTEM_LETTERS]
    n, m, p = ([*shape, 0, 0][axis] for shape, axis in ((shapes[0], 0), (shapes[3], 1), (shapes[3], 0)))
    expected = ((n, n), (n, m), (p, n), (p, m))
    matrices = [checked_matrix(content[key], key, size) for key, size in zip(SYSTEM_LETTERS, expected, strict=True)]
    labels: dict[str, Any] = {}
    for key, count in zip(SYSTEM_NAMES, (n, m, p), strict=True):
        found = texts(content, key)
        if found is not None:
            labels[key] = list(checked_names(found, count, key))
    lost = [key for key, count in zip(SYSTEM_NAMES, (n, m, p), strict=True) if labels and count and key not in labels]
    if lost:
        msg = f"{listed(lost)} not in the file, though {listed(list(labels))} are: it is damaged. Write it anew."
        raise FileFormatError(msg, path="")
    if "dt" in content:
        period = float(np.asarray(content["dt"]).item())
        labels["dt"] = True if period == UNKNOWN_PERIOD else period
    name = single_text(content)
    return control.StateSpace(*matrices, **labels, **({} if name is None else {"name": name}))
