"""Equations and state equations for the modules behind deflation: drawn, relaxed, solved, evaluated."""

import numpy as np
import numpy.typing as npt
from hypothesis import strategies as st

from halfdof_ctrl import ExactReduction, SecondOrderModel
from halfdof_ctrl.reduction.deflation.method import Deflation
from halfdof_ctrl.reduction.deflation.realization import Realization, realized
from halfdof_ctrl.reduction.deflation.relaxation import relaxed
from halfdof_ctrl.reduction.deflation.row_system import Caution, RowSystem
from halfdof_ctrl.reduction.dense.method import SingleSolve
from halfdof_ctrl.reduction.method.signals import StateEquations
from halfdof_ctrl.reduction.method.units import Units, scaled_rows
from support import exact

FloatArray = npt.NDArray[np.float64]
ComplexArray = npt.NDArray[np.complex128]

USUAL = Caution(24.0, 3.0)
SEEDS = st.integers(0, 2**32 - 1)
POINTS: ComplexArray = np.array([0.3j, 1.1j, 0.6 + 0.2j])  # [rad/s]


def system_of(P: npt.ArrayLike) -> RowSystem:
    """Scale coefficients (k, n, n) with a force on every equation."""
    coefficients = np.asarray(P, dtype=float)
    force = np.zeros_like(coefficients)
    force[0] = np.eye(coefficients.shape[1])
    return RowSystem.scaled(scaled_rows(coefficients, force)[0])


def drawn(seed: int, size: int) -> FloatArray:
    """Draw sparse integer coefficients of 1, s, s^2, the highest ones of a rank too low."""
    generator = np.random.default_rng(seed)
    P = generator.integers(-3, 4, (3, size, size)) * (generator.random((3, size, size)) < 0.6)
    P[2] = generator.integers(-2, 3, (size, size - 1)) @ generator.integers(-2, 3, (size - 1, size))
    return P.astype(float)


def rational_coefficients(matrix: FloatArray) -> list[object]:
    """Give the exact coefficients of ``det`` of a matrix polynomial."""
    return [exact.fraction(value) for value in exact.polynomial_determinant(matrix).coeffs()]


def realization(model: SecondOrderModel) -> tuple[Realization, Units]:
    """Relax and solve a model's equations."""
    rows, units = scaled_rows(np.stack(model.quadratics.P).astype(float), np.stack(model.quadratics.B).astype(float))
    result = relaxed(RowSystem.scaled(rows), USUAL)
    assert result.offsets is not None
    return realized(result.system, result.offsets, USUAL), units


def response(equations: StateEquations, points: ComplexArray = POINTS) -> ComplexArray:
    """Evaluate all displacements by a plain solve: (n, m, k)."""
    q, unit = equations.displacement, np.eye(len(equations.A))
    values = []
    for s in points:
        value = q.X @ np.linalg.solve(s * unit - equations.A, equations.B + 0j)
        values.append(value + sum(s**k * part for k, part in enumerate(q.U)))
    return np.stack(values, axis=2)


def dense(reduction: ExactReduction) -> StateEquations:
    """Give the state equations of a model that is not sparse."""
    assert isinstance(reduction.solution, SingleSolve | Deflation)
    return reduction.solution.equations
