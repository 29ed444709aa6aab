"""The door: `mechss` checks matrices and names once and returns a `SecondOrderModel`."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from halfdof_ctrl.base.arrays import (
    MATRIX_DIMENSIONS,
    SIGNAL_SIZES,
    DenseMatrix,
    ModelMatrix,
    checked_matrix,
    checked_square_matrices,
    is_zero_number,
    require_range,
    shape_of,
)
from halfdof_ctrl.base.doors import require_text
from halfdof_ctrl.base.errors import MatrixError
from halfdof_ctrl.base.labelled import has_labels, without_labels
from halfdof_ctrl.base.names import (
    DERIVATIVE_SUFFIXES,
    FORCE_PREFIX,
    Names,
    checked_dofs,
    force_names,
    reconciled_names,
)
from halfdof_ctrl.base.sparse_arrays import (
    MatrixLike,
    checked_sparse_matrix,
    checked_sparse_squares,
    filled_rows,
    has_sparse,
    is_sparse,
    largest_by_row_and_column,
    transposed,
    unit_columns,
    unit_like,
    zeros_like,
)
from halfdof_ctrl.model.second_order import SecondOrderModel

#: what rows and columns of the matrices are, by letter
MECHSS_AXES = (
    dict.fromkeys(("M", "C", "K"), ("DOFs", "DOFs"))
    | dict.fromkeys(("B", "Bv", "Ba"), ("DOFs", "inputs"))
    | dict.fromkeys(("F", "G", "H"), ("outputs", "DOFs"))
    | dict.fromkeys(("D", "Dv", "Da"), ("outputs", "inputs"))
)


def mechss(
    M: MatrixLike | None,
    C: MatrixLike | None,
    K: MatrixLike | None,
    B: MatrixLike | None = None,
    F: MatrixLike | None = None,
    G: MatrixLike | None = None,
    *,
    H: MatrixLike | None = None,
    D: MatrixLike | None = None,
    Bv: MatrixLike | None = None,
    Ba: MatrixLike | None = None,
    Dv: MatrixLike | None = None,
    Da: MatrixLike | None = None,
    dofs: Names = None,
    inputs: Names = None,
    outputs: Names = None,
    name: str | None = None,
) -> SecondOrderModel:
    """Create a mechanical model from mass, damping and stiffness.

    Parameters
    ----------
    M, C, K : (n, n) array_like, scipy sparse array or matrix, or None
        Mass [kg], damping [N s/m] and stiffness [N/m]; None for a matrix of zeros, but not all three.
        They may be singular, unsymmetric or complex (structural damping). If one of them is sparse, the model is: all
        its matrices are kept in compressed columns, and nothing of n x n entries is ever formed. A vector is a diagonal
        matrix, 0 a matrix of zeros, and with one DOF numbers will do. Labelled matrices (DataFrames of pandas) are
        aligned by their labels, which name the DOFs, and inputs and outputs too.
    B : (n, m) array_like or sparse, optional
        Forces per input [N]; by default a unit force on every DOF, named ``F_<dof>``. A 1D array of
        length n is one input.
    F, G, H : (p, n) array_like, optional
        Displacements, velocities and accelerations in the outputs; without any of them every
        displacement is an output. A 1D array of length n is one output.
    D : (p, m) array_like or 0, optional
        Direct term from the inputs to the outputs.
    Bv, Ba : (n, m) array_like, optional
        Forces per first and second derivative of the inputs.
    Dv, Da : (p, m) array_like, optional
        Direct terms of the first and second derivative of the inputs.
    dofs, inputs, outputs : str or sequence of str, optional
        Names; whole numbers in a list, such as those of nodes, are read as text.
        By default the DOFs are ``q0, q1, ...``, a unit force on a DOF is ``F_<dof>``, a DOF's
        motion ``<dof>``, ``<dof>_dot`` or ``<dof>_ddot``, and any other signal ``u[0]``, ``y[0]``, ...
    name : str, optional
        Name of the model.

    Returns
    -------
    SecondOrderModel

    Raises
    ------
    MatrixError
        A matrix of wrong shape, empty, of things that are no numbers, with NaN or Inf.
    SignalNameError
        Names that are too many or too few, twice the same, or that name a DOF's force or motion
        while the matrices say something else; labels of matrices that do not match.

    Examples
    --------
    A mass of 2 kg on a spring, the spring's far end held by a damper alone:

    >>> model = mechss([[2, 0], [0, 0]], [[0, 0], [0, 5]], [[8, -8], [-8, 8]], dofs=["mass", "joint"])
    >>> model
    SecondOrderModel: 2 DOFs: 1 inertial, 1 half, 0 static; 3 states
      dofs:    mass, joint
      inputs:  F_mass, F_joint
      outputs: mass, joint
      1 free motion: 1 pole at exactly 0, so that the response at rest is infinite
    """
    require_text(name, "name")
    given = (M, C, K, B, Bv, Ba, F, G, H, D, Dv, Da)
    if has_labels(given):
        names_of_kinds = {"DOFs": dofs, "inputs": inputs, "outputs": outputs}
        matrices, named = without_labels(dict(zip(MECHSS_AXES, given, strict=True)), MECHSS_AXES, names_of_kinds)
        plain: dict[str, Any] = matrices
        return mechss(**plain, dofs=named["DOFs"], inputs=named["inputs"], outputs=named["outputs"], name=name)
    M, C, K = (checked_sparse_squares if has_sparse((M, C, K)) else checked_square_matrices)((M, C, K), "MCK")
    n = M.shape[0]
    names = tuple([f"q{index}" for index in range(n)]) if dofs is None else checked_dofs(dofs, n)
    m = _signals((B, Bv, Ba), axis=1, default=n)
    p = _signals((F, G, H), axis=0, default=n)
    every_force = B is None and Bv is None and Ba is None
    every_displacement = F is None and G is None and H is None
    zeros = zeros_like(K, n, m)
    input_columns = (
        unit_like(K, n) if every_force else _checked_or(zeros, B, "B"),
        _checked_or(zeros, Bv, "Bv"),
        _checked_or(zeros, Ba, "Ba"),
    )
    zeros = zeros_like(K, p, n)
    output_rows = (
        unit_like(K, n) if every_displacement else _checked_or(zeros, F, "F"),
        _checked_or(zeros, G, "G"),
        _checked_or(zeros, H, "H"),
    )
    zeros = zeros_like(K, p, m)
    direct = (_checked_or(zeros, D, "D"), _checked_or(zeros, Dv, "Dv"), _checked_or(zeros, Da, "Da"))
    plain_inputs = every_force and inputs is None
    plain_outputs = every_displacement and outputs is None and D is None and Dv is None and Da is None
    return SecondOrderModel(
        M=M,
        C=C,
        K=K,
        B=input_columns[0],
        Bv=input_columns[1],
        Ba=input_columns[2],
        F=output_rows[0],
        G=output_rows[1],
        H=output_rows[2],
        D=direct[0],
        Dv=direct[1],
        Da=direct[2],
        dofs=names,
        inputs=force_names(names) if plain_inputs else _input_names(inputs, input_columns, names),
        outputs=names if plain_outputs else _output_names(outputs, output_rows, direct, names),
        name=name,
    )


def _signals(given: Sequence[MatrixLike | None], axis: int, default: int) -> int:
    """Count the inputs (axis 1) or outputs (axis 0) by the first matrix that is given."""
    for value in given:
        if value is not None:
            shape = shape_of(value)
            return shape[axis] or 1 if len(shape) == MATRIX_DIMENSIONS else 1
    return default


def _require_orientation(found: tuple[int, ...], letter: str, rows: int, columns: int) -> None:
    """Refuse a matrix whose transpose would do, and say that."""
    if len(found) != MATRIX_DIMENSIONS or found == (rows, columns):
        return
    if letter[0] == "D":
        wrong, needed = found == (columns, rows), "a row for each output and a column for each input"
    elif letter[0] == "B":
        wrong, needed = found[0] != rows and found[1] == rows, "a row for each DOF"
    else:
        wrong, needed = found[1] != columns and found[0] == columns, "a column for each DOF"
    if wrong:
        msg = f"{letter} needs {needed}; transpose it. It is {found[0]} x {found[1]}."
        raise MatrixError(msg, matrix=letter)


def _checked_or(zeros: ModelMatrix, value: object, letter: str) -> ModelMatrix:
    """Check one matrix, in the shape of the zeros that it is by default, dense or sparse as they are."""
    if value is None or is_zero_number(value):
        return zeros
    rows, columns = zeros.shape
    _require_orientation(shape_of(value), letter, rows, columns)
    matrix: ModelMatrix
    if is_sparse(zeros):
        matrix = sparse = checked_sparse_matrix(value, letter, (rows, columns))
        by_row, by_column = largest_by_row_and_column(sparse)
        sizes = np.abs(sparse.data)
    else:
        matrix = dense = checked_matrix(value, letter, (rows, columns))
        sizes = np.abs(dense)
        by_row, by_column = (sizes.max(axis=axis) for axis in (1, 0))
    if letter[0] == "B":
        require_range(letter, by_column, sizes, "column", SIGNAL_SIZES)
    else:
        require_range(letter, by_row, sizes, "row", SIGNAL_SIZES)
    return matrix


def _input_names(given: Names, columns: Sequence[ModelMatrix], dofs: tuple[str, ...]) -> tuple[str, ...]:
    """Name the inputs; a column that is a unit force on a DOF and the name ``F_<dof>`` belong together."""
    if is_sparse(columns[0]):
        meaning = unit_columns(columns)
    else:
        meaning = [_unit_vectors([matrix[:, j] for matrix in columns]) for j in range(columns[0].shape[1])]
    found = [FORCE_PREFIX + dofs[hit[1]] if hit is not None and hit[0] == 0 else None for hit in meaning]
    return reconciled_names(given, found, dofs, "input")


def _output_names(
    given: Names, rows: Sequence[ModelMatrix], direct: Sequence[ModelMatrix], dofs: tuple[str, ...]
) -> tuple[str, ...]:
    """Name the outputs; a row that is a DOF's motion and the motion's name belong together."""
    if is_sparse(rows[0]):
        meaning, fed = unit_columns([transposed(matrix) for matrix in rows]), filled_rows(direct)
    else:
        every = range(rows[0].shape[0])
        meaning = [_unit_vectors([matrix[i] for matrix in rows]) for i in every]
        fed = [any(matrix[i].any() for matrix in direct) for i in every]
    found = [
        None if hit is None or is_fed else dofs[hit[1]] + DERIVATIVE_SUFFIXES[hit[0]]
        for hit, is_fed in zip(meaning, fed, strict=True)
    ]
    return reconciled_names(given, found, dofs, "output")


def _unit_vectors(vectors: Sequence[DenseMatrix]) -> tuple[int, int] | None:
    """Find (which vector, which entry) if all entries are zero but a single one that is 1."""
    places = [(which, int(entry)) for which, vector in enumerate(vectors) for entry in np.flatnonzero(vector)]
    if len(places) == 1 and vectors[places[0][0]][places[0][1]] == 1:
        return places[0]
    return None
