"""Poles of a state space beside the finite eigenvalues of a model, matched one to one."""

import numpy as np
import scipy.optimize

from halfdof_ctrl.base.arrays import ComplexArray, FloatArray
from halfdof_ctrl.base.spectrum import ROUNDING_OF_A, eigenvalues_and_rounding
from halfdof_ctrl.base.words import complex_in_words
from halfdof_ctrl.descriptor.balancing import scaling_powers
from halfdof_ctrl.model.second_order import SecondOrderModel

POLE_TOLERANCE = 1e-10  #: relative to the pole, beside what rounding may move it
PARTS_OF_THE_WAY = (0.0, 0.3, 0.7, 1.0)  #: parts of the way from an eigenvalue to its pole


def compare_poles(model: SecondOrderModel, A: FloatArray, finite: ComplexArray, gamma: float) -> tuple[float, str]:
    """Match the poles one to one and give the largest relative error and which pole it is.

    A pole beside its eigenvalue is no error if P(s) is singular to within rounding of M, C, K there, at the eigenvalue
    and on the way between: rounding splits a k-fold eigenvalue by its k-th root, in A as in M, C, K.
    """
    if A.shape[0] != finite.size:
        return float("inf"), f"{A.shape[0]} poles for {finite.size} finite eigenvalues"
    if finite.size == 0:
        return 0.0, "no poles"
    poles, rounding = eigenvalues_and_rounding(A)
    with np.errstate(invalid="ignore"):
        distance = np.abs(poles[:, None] - finite) / (np.abs(poles)[:, None] + np.abs(finite))
    rows, columns = scipy.optimize.linear_sum_assignment(np.nan_to_num(distance))  # 0 from 0 is no distance
    poles, finite = poles[rows], finite[columns]
    difference = np.abs(poles - finite)
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        allowed = np.abs(finite) + (rounding[rows] + ROUNDING_OF_A * gamma) / POLE_TOLERANCE
        errors = np.where(difference > 0.0, difference / allowed, 0.0)
    for place in np.flatnonzero(errors > POLE_TOLERANCE).tolist():
        excess = _excess(model, finite[place], poles[place], gamma)
        errors[place] = min(errors[place], excess * POLE_TOLERANCE)
    worst = int(np.argmax(errors))
    return float(errors[worst]), f"pole {complex_in_words(poles[worst])}"


def _excess(model: SecondOrderModel, eigenvalue: complex, pole: complex, gamma: float) -> float:
    """Measure how far P(s) is from singular on the way from an eigenvalue to its pole, in units of rounding.

    The unit is that of the terms of P, scaled, at s or at the typical frequency, whichever is larger: mixing the
    coordinates leaves rounding of the large terms where small ones stand alone.
    """
    distances = []
    for part in PARTS_OF_THE_WAY:
        s = eigenvalue + part * (pole - eigenvalue)
        at = max(abs(s), gamma)
        size = np.abs(model.K) + at * np.abs(model.C) + at**2 * np.abs(model.M)
        rows, columns = scaling_powers(size)
        scale = rows[:, None] * columns
        smallest = scipy.linalg.svdvals((model.K + s * model.C + s**2 * model.M) * scale)[-1]
        distances.append(smallest / scipy.linalg.svdvals(size * scale)[0])
    return float(max(distances) / ROUNDING_OF_A)
