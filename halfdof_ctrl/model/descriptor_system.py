"""Descriptor systems of first order, ``E x' = A x + B u`` with singular E, as models without mass.

    E x' = A x + B u         M = 0,  damping E,  stiffness -A
    y    = C x + D u         F = C

The reduction, the checks and the plots are those of mechanical models; words are those of descriptor systems
(differential-algebraic equations, DAE, semistate equations): variables and equations, not DOFs and forces.
"""

from dataclasses import dataclass, fields
from typing import Any

from halfdof_ctrl.base.arrays import (
    Matrix,
    checked_matrix,
    checked_square_matrices,
    is_zero_number,
    shape_of,
    unit_matrix,
)
from halfdof_ctrl.base.errors import MatrixError
from halfdof_ctrl.base.labelled import has_labels, without_labels
from halfdof_ctrl.base.names import Names, as_tuple, listed
from halfdof_ctrl.base.sparse_arrays import (
    MatrixLike,
    checked_sparse_matrix,
    checked_sparse_squares,
    filled_rows,
    has_sparse,
    is_sparse,
    sparse_unit,
)
from halfdof_ctrl.model.mechss import mechss
from halfdof_ctrl.model.second_order import SecondOrderModel

#: what rows and columns of the matrices are, by letter
DESCRIPTOR_SYSTEM_AXES = {
    "A": ("variables", "variables"),
    "B": ("variables", "inputs"),
    "C": ("outputs", "variables"),
    "D": ("outputs", "inputs"),
    "E": ("variables", "variables"),
}


@dataclass(frozen=True, slots=True, eq=False, kw_only=True, repr=False)
class DescriptorSystem(SecondOrderModel):
    """``E x' = A x + B u``, ``y = C x + D u`` with named variables. Made by `dss`.

    Everything that takes a `SecondOrderModel` takes it: ``dofs`` are the variables x, ``C`` is E, ``K`` is -A, ``F`` is
    C. `as_descriptor` gives the matrices back under their own letters.
    """

    def __repr__(self) -> str:
        """Say how many variables there are, how many equations have derivatives, and the signals."""
        title = f"DescriptorSystem {self.name!r}" if self.name else "DescriptorSystem"
        differential = sum(filled_rows([self.C])) if is_sparse(self.C) else int(self.C.any(axis=1).sum())
        n = len(self.dofs)
        return (
            f"{title}: {n} variables, {differential} equations with derivatives, {n - differential} without\n"
            f"  variables: {listed(self.dofs)}\n"
            f"  inputs:    {listed(self.inputs)}\n"
            f"  outputs:   {listed(self.outputs)}"
        )


def dss(
    A: MatrixLike | None,
    B: MatrixLike,
    C: MatrixLike,
    D: MatrixLike | None,
    E: MatrixLike | None,
    *,
    states: Names = None,
    inputs: Names = None,
    outputs: Names = None,
    name: str | None = None,
) -> DescriptorSystem:
    """Create a descriptor system ``E x' = A x + B u``, ``y = C x + D u`` (DAE, singular E, semistate).

    Parameters
    ----------
    A, E : (n, n) array_like, scipy sparse array or matrix
        E may be singular; None for the unit matrix. Numbers, vectors and labelled matrices (DataFrames) are read as
        `mechss` reads them.
    B : (n, m) array_like or sparse
        A 1D array of length n is one input.
    C : (p, n) array_like or sparse
        A 1D array of length n is one output.
    D : (p, m) array_like, 0 or None
        Direct term.
    states : sequence of str, optional
        Names of the variables x; ``x0, x1, ...`` by default.
    inputs, outputs : str or sequence of str, optional
        Names; by default ``u[0], ...``, and for an output the name of the variable that it is, or ``y[0], ...``.
    name : str, optional

    Returns
    -------
    DescriptorSystem
        For `dss2ss`, `frequency_response`, `pencil_structure`, `zeros`, `crosscheck`, ...

    Raises
    ------
    MatrixError
        A matrix of wrong shape, empty, of things that are no numbers, with NaN or Inf.
    SignalNameError
        Names that are too many or too few, or twice the same.

    Examples
    --------
    A voltage source, a resistor of 2 ohm and a capacitor of 3 F; the current is a variable without a derivative:

    >>> dss([[0, 1], [-1, -2]], [[0], [1]], [[1, 0]], 0, [[3, 0], [0, 0]], states=["voltage", "current"])
    DescriptorSystem: 2 variables, 1 equations with derivatives, 1 without
      variables: voltage, current
      inputs:    u[0]
      outputs:   voltage
    """
    if has_labels((A, B, C, D, E)):
        names_of_kinds = {"variables": states, "inputs": inputs, "outputs": outputs}
        matrices, named = without_labels(
            {"A": A, "B": B, "C": C, "D": D, "E": E}, DESCRIPTOR_SYSTEM_AXES, names_of_kinds
        )
        plain: dict[str, Any] = matrices
        return dss(**plain, states=named["variables"], inputs=named["inputs"], outputs=named["outputs"], name=name)
    if A is None:
        msg = "A is None, and no number stands for it: give the matrix A."
        raise MatrixError(msg, matrix="A")
    sparse = has_sparse((A, E))
    square, leading = (checked_sparse_squares if sparse else checked_square_matrices)((A, E), "AE", "variables")
    n = square.shape[0]
    leading = _unit(square) if E is None else leading
    columns = _checked(B, "B", (n, _count(B, n, 1)), sparse=sparse)
    rows = _checked(C, "C", (_count(C, n, 0), n), sparse=sparse)
    m, p = columns.shape[1], rows.shape[0]
    direct = None if D is None or is_zero_number(D) else _checked(D, "D", (p, m), sparse=sparse)
    stiffness = -square if is_sparse(square) else 0.0 - square
    model = mechss(
        None, leading, stiffness, columns, rows,
        D=direct,
        dofs=tuple([f"x{i}" for i in range(n)]) if states is None else as_tuple(states),
        inputs=[f"u[{j}]" for j in range(m)] if inputs is None else inputs,
        outputs=outputs,
        name=name,
    )  # fmt: skip
    parts: dict[str, Any] = {field.name: getattr(model, field.name) for field in fields(model)}
    return DescriptorSystem(**parts)


def _checked(value: object, letter: str, shape: tuple[int, int], *, sparse: bool) -> Matrix:
    return checked_sparse_matrix(value, letter, shape) if sparse else checked_matrix(value, letter, shape)


def _count(value: Any, n: int, axis: int) -> int:  # noqa: ANN401  # whatever the user gave
    """Count the inputs or outputs, one for a list of n numbers."""
    shape = shape_of(value)
    return 1 if len(shape) == 1 and shape[0] == n else int(shape[axis]) if len(shape) > axis else 1


def _unit(pattern: Matrix) -> Matrix:
    n = pattern.shape[0]
    return sparse_unit(n) if is_sparse(pattern) else unit_matrix(n)
