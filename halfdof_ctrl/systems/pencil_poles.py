"""Poles of a model, each with the distance that rounding of M, C, K may have moved it, whatever its outputs are.

Energy coordinates give them where a model has these. Elsewhere they are the finite eigenvalues of the pencil, improved:
with v and w the vectors of the smallest singular value of P(s) = K + C s + M s^2 (rows and columns scaled)

    s - w^H P(s) v / (w^H P'(s) v),    data = 2 u |w|^T (|K| + |s| |C| + |s|^2 |M|) |v| / |w^H P'(s) v|

are a better finite eigenvalue and what rounding of the entries moves it.
"""

import numpy as np

from halfdof_ctrl.base.arrays import UNIT_ROUNDOFF, ComplexArray, DenseMatrix, FloatArray, powers_of_two
from halfdof_ctrl.descriptor.structure import pencil_structure
from halfdof_ctrl.model.dense_copy import dense_copy, with_few_signals
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.reduction.energy.form import energy_system
from halfdof_ctrl.systems.pole_bounds import COARSE_BOUND, STEP, BoundedPoles, bounded_poles

REFINING_STEPS = 3  #: of Newton's method


def pencil_poles(model: SecondOrderModel) -> BoundedPoles:
    """Find the finite eigenvalues of a model, those that are not told from zero exactly zero.

    Parameters
    ----------
    model : SecondOrderModel
        Real or complex, of any index.

    Returns
    -------
    BoundedPoles
    """
    model = dense_copy(with_few_signals(model), "The search for poles", "Give the frequencies.")
    form = energy_system(model)
    if form is not None:
        return bounded_poles(form.A)
    values = pencil_structure(model).finite_eigenvalues.copy()
    bounds = np.zeros(values.size)
    parts = (np.asarray(model.K), np.asarray(model.C), np.asarray(model.M))
    for place, value in enumerate(values.tolist()):
        if value != 0.0:
            values[place], bounds[place] = _improved(parts, value)
    return BoundedPoles(np.where(np.abs(values) <= bounds, 0.0, values), bounds)


def _improved(parts: tuple[DenseMatrix, DenseMatrix, DenseMatrix], value: complex) -> tuple[complex, float]:
    """Return a better eigenvalue and its bound."""
    step, data = _first_order(parts, value)
    for _ in range(REFINING_STEPS):
        if not abs(step) <= STEP * max(data, COARSE_BOUND * abs(value)) or value + step == 0.0:
            break
        further, bound = _first_order(parts, value + step)
        if not abs(further) < abs(step):
            break
        value, step, data = value + step, further, bound
    return value, data + abs(step)


def _first_order(parts: tuple[DenseMatrix, DenseMatrix, DenseMatrix], s: complex) -> tuple[complex, float]:
    K, C, M = parts
    size: FloatArray = np.abs(K) + abs(s) * np.abs(C) + abs(s) ** 2 * np.abs(M)
    rows = powers_of_two(size.max(axis=1, initial=0.0))
    columns = powers_of_two((size * rows[:, None]).max(axis=0, initial=0.0))
    P: ComplexArray = K + s * C + s**2 * M
    left, _, right = np.linalg.svd(P * rows[:, None] * columns)
    w, v = rows * left[:, -1].conj(), columns * right[-1].conj()
    slope = complex(w @ (C + 2.0 * s * M) @ v)
    if slope == 0.0:
        return 0j, float(np.finfo(float).max)
    data = 2.0 * UNIT_ROUNDOFF * float(np.abs(w) @ size @ np.abs(v)) / abs(slope)
    return -complex(w @ P @ v) / slope, min(data, float(np.finfo(float).max))
