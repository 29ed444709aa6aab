"""Models, state spaces, gains and responses in files, whole or not at all.

| what | endings | content |
|---|---|---|
| model | .npz, .mat | M, C, K, B, F, G, H, D (Bv, ..., prescribed, known_to, elements), dofs, inputs, outputs, name |
| model, read only | .mtx, .matrix, .op4, .pch, .sti, .npy, .csv, ... | what programs write, see `import_model` |
| state space | .npz, .mat | A, B, C, D, states, inputs, outputs, name, dt (-1: sampled with unknown period) |
| gain | .npz, .mat, .csv | K, inputs, states |
| response | .csv | one row a frequency or time, see `save_response` |

Files are read with ``allow_pickle=False`` and nothing in them is executed. They are written to a temporary
name beside the target, which takes the target's place when it is complete.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from halfdof_ctrl.base.arrays import EPS, is_zero
from halfdof_ctrl.base.definiteness import LARGEST_COMPONENT
from halfdof_ctrl.base.doors import is_real_number, shown
from halfdof_ctrl.base.errors import ParameterError
from halfdof_ctrl.base.progress import shows_activity
from halfdof_ctrl.files.containers import PathLike
from halfdof_ctrl.files.formats.raw_matrix import Triangle
from halfdof_ctrl.files.import_model import Paths, import_model, import_report
from halfdof_ctrl.files.import_report import ImportReport
from halfdof_ctrl.files.writing import save_matrices
from halfdof_ctrl.model.doors import checked_model
from halfdof_ctrl.model.law_text import stored_elements
from halfdof_ctrl.model.nonlinear import NonlinearModel
from halfdof_ctrl.model.second_order import LETTERS, SecondOrderModel

OPTIONAL_LETTERS = ("Bv", "Ba", "Dv", "Da")  #: written only where they are not zero
MODEL_NAMES = ("dofs", "inputs", "outputs")


def save_model(model: SecondOrderModel | NonlinearModel, path: PathLike) -> None:
    """Write a model to a file that `load_model` reads back exactly.

    Parameters
    ----------
    model : SecondOrderModel or NonlinearModel
        Laws are kept by name and numbers, in the variable ``elements``.
    path : path-like
        Ends in ``.npz``, or in ``.mat`` for MATLAB (version 5), where ``mechss`` takes the same letters.

    Raises
    ------
    FileFormatError
        Another ending, or a name that files cannot keep (control characters).
    ParameterError
        An element with a function of the user's own.
    OSError
        The file cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     save_model(hydromount(), f"{folder}/mount.npz")
    ...     load_model(f"{folder}/mount.npz").outputs
    ('y', 'y1', 'y2')
    """
    elements = stored_elements(model.elements) if isinstance(model, NonlinearModel) else ()
    model = model.linear if isinstance(model, NonlinearModel) else checked_model(model, "save_model")
    kept = [letter for letter in LETTERS if letter not in OPTIONAL_LETTERS or not is_zero(getattr(model, letter))]
    kept.sort(key="K".__eq__)  # last, so that no beginning of a file passes for a model
    content = {letter: getattr(model, letter) for letter in kept}
    if model.known_to > EPS:
        content = {"known_to": np.array(model.known_to), **content}
    names = {key: getattr(model, key) for key in MODEL_NAMES}
    more = {"prescribed": model.prescribed, "elements": elements}
    save_matrices(path, content, names | {key: texts for key, texts in more.items() if texts}, model.name)


@shows_activity("reading the model")
def load_model(
    path: Paths,
    *,
    triangle: Triangle | None = None,
    remove_fixed: bool = False,
    matrices: Mapping[str, str | None] | None = None,
) -> Any:  # noqa: ANN401  # a union would make every reader of linear models check
    """Read a model from a file, or from the files that a finite-element program wrote.

    Parameters
    ----------
    path : path-like, sequence of path-like, or mapping from letter to path-like
        An ``.npz`` or MATLAB ``.mat`` file (version 4, 5, or 7.3 with the extra ``hdf5``) with K, and any of M, C, B,
        F, G, H, D, Bv, Ba, Dv, Da (full or sparse), ``dofs``, ``inputs``, ``outputs``, ``prescribed`` (text arrays; in
        ``.mat`` cell or char arrays) and ``name``. What is missing is as in `mechss`.

        Or files of Matrix Market, Abaqus, ANSYS, CalculiX or Nastran, ``.npy`` arrays, or dense text (OpenSees,
        ``numpy.savetxt``, csv): a folder that holds one model; one file, to which those whose names differ in the word
        for the matrix are found; a list of files; or ``{"K": path, "M": path, ...}`` where names do not say what is
        what. S stands for structural damping, the imaginary part of K.
    triangle : {"lower", "upper"}, optional
        Says that matrices of which only this triangle is stored are symmetric. Not needed where the format says so.
    remove_fixed : bool
        Takes out DOFs whose stiffness is 1e35 or more, by which Abaqus writes boundary conditions.
    matrices : mapping from letter to str or None, optional
        Names of the matrices to take from files that hold several, ``{"K": "kaa", "C": "D", "M": "sys.M"}``; the
        second of two of one name is ``"kaa#2"``. None: that there is no such matrix.

    Returns
    -------
    SecondOrderModel, or NonlinearModel where the file has ``elements`` that `save_model` wrote
        Its DOFs are named by node and component (``n101_u1``) where the files have labels; ``known_to`` is the
        rounding of its entries by the digits of the files.

    Raises
    ------
    FileFormatError
        An unknown format, damaged, of another kind, with objects or text for numbers, no stiffness, matrices that do
        not fit together, or a model that `mechss` refuses; the message starts with the file, the cause is the refusal.
    MissingExtraError
        A MATLAB 7.3 file where h5py is not installed.
    OSError
        A file is not there or cannot be read.
    ParameterError
        Options or paths of another kind.

    Warns
    -----
    ImportedModelWarning
        What the files hold is probably not what was meant: a triangle is missing, boundary conditions
        are huge springs, DOFs have mass and no stiffness, there is no mass or damping, or a matrix as large as the
        stiffness is not used.

    See Also
    --------
    inspect_files : what is in the files, as a table
    """
    return import_model(path, triangle=triangle, remove_fixed=remove_fixed, matrices=matrices)


def inspect_files(
    path: Paths,
    *,
    triangle: Triangle | None = None,
    remove_fixed: bool = False,
    matrices: Mapping[str, str | None] | None = None,
    largest: int = LARGEST_COMPONENT,
) -> ImportReport:
    """Look at what `load_model` would read: sizes, symmetry, rank, mass per direction, kinds of DOFs.

    Parameters
    ----------
    path, triangle, remove_fixed, matrices
        As in `load_model`.
    largest : int
        Connected parts of a matrix with more DOFs than this are not factorized, and their rank stays unknown.

    Returns
    -------
    ImportReport
        Prints as a small table.

    Raises
    ------
    FileFormatError, OSError
        As in `load_model`; a missing stiffness is told in the report.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     save_model(hydromount(), f"{folder}/mount.npz")
    ...     inspect_files(f"{folder}/mount.npz").matrices[0].rank
    'positive semidefinite, rank 1'
    """
    if not is_real_number(largest) or largest < 0:
        msg = f"largest = {shown(largest)}, but it must be a number of DOFs, 0 or more."
        raise ParameterError(msg, parameter="largest", value=largest)
    return import_report(path, triangle=triangle, remove_fixed=remove_fixed, matrices=matrices, largest=largest)
