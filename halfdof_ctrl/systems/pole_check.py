"""Poles of a state space beside the finite eigenvalues of a model, matched one to one, both refined."""

import numpy as np
import scipy.linalg
import scipy.optimize

from halfdof_ctrl.base.arrays import EPS, ComplexArray, FloatArray
from halfdof_ctrl.base.spectrum import ROUNDING_OF_A
from halfdof_ctrl.base.words import complex_in_words
from halfdof_ctrl.descriptor.balancing import scaling_powers
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.systems.judged import Grade, Judged, graded, safety
from halfdof_ctrl.systems.refined_poles import RefinedPoles

POLE_TOLERANCE = 1e-10  #: relative to the eigenvalue
PARTS_OF_THE_WAY = (0.0, 0.3, 0.7, 1.0)  #: parts of the way from an eigenvalue to its pole


def compare_poles(
    model: SecondOrderModel,
    poles: RefinedPoles,
    finite: ComplexArray,
    bounds: FloatArray,
    gamma: float,
    *,
    most: int | None = None,
) -> Judged:
    """Match the poles one to one and judge the distance of each from its eigenvalue, relative to that.

    Of eigenvalues that are not told from zero it is relative to the smallest one that is.

    The numbers allow what rounding of A moves a pole by, and rounding of M, C, K its eigenvalue. Beyond that
    a pole is no error if P(s) is singular to within rounding of M, C, K there, at the eigenvalue and on the way
    between: rounding splits a k-fold eigenvalue by its k-th root, in A as in M, C, K.

    Parameters
    ----------
    model : SecondOrderModel
    poles : RefinedPoles
        Of the state space.
    finite, bounds : (k,) ndarrays
        Finite eigenvalues of the descriptor form, and how far rounding may have moved each.
    gamma : float
        A typical frequency [rad/s].
    most : int, optional
        Finite eigenvalues that the stored numbers have, where those that are told from rounding are fewer: so many
        poles may be matched by none.
    """
    if not finite.size <= poles.values.size <= max(finite.size, most or 0):
        words = f"{poles.values.size} poles for {finite.size} finite eigenvalues"
        return Judged(Grade.FAILED, float("inf"), 0.0, words)
    if 0 in (finite.size, poles.values.size):
        return Judged.nothing("no poles")
    known, many = max(model.known_to / EPS, 1.0), safety(len(model.dofs))
    with np.errstate(all="ignore"):
        distance = np.abs(poles.values[:, None] - finite) / (np.abs(poles.values)[:, None] + np.abs(finite))
        rows, columns = scipy.optimize.linear_sum_assignment(np.nan_to_num(distance))  # 0 from 0 is no distance
        found, finite = poles.values[rows], finite[columns]
        doubt = np.nan_to_num(bounds[columns], posinf=0.0) * known
        away = np.abs(finite) > many * doubt
        moving = np.abs(finite)[away].min(initial=np.inf)
        size = np.where(away, np.abs(finite), moving if np.isfinite(moving) else gamma)
        both_zero = poles.at_origin[rows] & ~away
        errors = np.where(both_zero, 0.0, np.abs(found - finite) / size)
        room = many * (poles.bounds[rows] + doubt) / size
    for place in np.flatnonzero(errors > POLE_TOLERANCE + room).tolist():
        if _is_within_rounding(model, complex(finite[place]), complex(found[place]), gamma, known):
            room[place] = errors[place]
    grade, worst = graded(errors, room, POLE_TOLERANCE)
    return Judged(grade, float(errors[worst]), float(room[worst]), f"pole {complex_in_words(complex(found[worst]))}")


def _is_within_rounding(
    model: SecondOrderModel, eigenvalue: complex, pole: complex, gamma: float, known: float
) -> bool:
    """Return whether P(s) is singular to within rounding on the way from an eigenvalue to its pole.

    The unit is that of the terms of P, scaled, at s or at the typical frequency, whichever is larger: mixing the
    coordinates leaves rounding of the large terms where small ones stand alone.
    """
    for part in PARTS_OF_THE_WAY:
        s = eigenvalue + part * (pole - eigenvalue)
        at = max(abs(s), gamma)
        size = np.abs(model.K) + at * np.abs(model.C) + at**2 * np.abs(model.M)
        rows, columns = scaling_powers(size)
        scale = rows[:, None] * columns
        smallest = scipy.linalg.svdvals((model.K + s * model.C + s**2 * model.M) * scale)[-1]
        if smallest > ROUNDING_OF_A * known * scipy.linalg.svdvals(size * scale)[0]:
            return False
    return True
