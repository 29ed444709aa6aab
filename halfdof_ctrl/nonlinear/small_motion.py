"""Small motions about a state: the elements' forces as a linear function of the variables that the linear part gives.

    d = -D (1 + S D)^-1 w_0,    D = f'(w) - G                                                       (N7)

Where an element alone holds a DOF and its slope is zero, 1 + S D is singular: the slope of the inverse is infinite.
"""

from typing import TYPE_CHECKING, Literal

import numpy as np

from halfdof_ctrl.base.arrays import FloatArray
from halfdof_ctrl.base.errors import LawError
from halfdof_ctrl.base.names import listed

if TYPE_CHECKING:
    from halfdof_ctrl.nonlinear.reduction import NonlinearReduction

STEEPEST_TANGENT = 1e150  #: stands for an infinite slope, whose inverse is flat
SINGULAR_GROUP = 1e-13  #: reciprocal condition of 1 + S D in a group, below which it is singular


def feedback_of_elements(
    reduction: "NonlinearReduction", t: float, w: FloatArray, *, singular: Literal["refuse", "drop"] = "refuse"
) -> FloatArray:
    """Return the (a, r) matrix ``D (1 + S D)^-1`` of equation (N7).

    Parameters
    ----------
    reduction : NonlinearReduction
    t : float
        Time [s].
    w : (r,) ndarray
        The elements' variables.
    singular : {"refuse", "drop"}
        What to do where a slope of the inverse is infinite: refuse, naming the DOF, or take the largest number.

    Raises
    ------
    LawError
        An infinite slope.
    """
    geometry = reduction.geometry
    if not geometry.places:
        return np.zeros((0, 0))
    slopes = geometry.slopes(w, t)
    for place, slope, moves in zip(geometry.places, slopes, reduction.moving, strict=True):
        if np.isnan(slope).any() or (np.isinf(slope).any() and not moves):
            raise infinite_slope(place.words, place.dofs, "its slope there is infinite")
    D = np.clip(geometry.joined(slopes), -STEEPEST_TANGENT, STEEPEST_TANGENT) - reduction.G
    P = np.eye(w.size) + reduction.S @ D
    for k, rest in reduction.rests.items():  # 1 - S G loses all digits where the element alone holds the DOF
        place = geometry.places[k]
        row, column = place.arguments.start, place.forces.start
        P[row, row] = reduction.S[row, column] * (rest + D[column, row] + reduction.G[column, row])
        if P[row, row] == 0.0:
            if singular == "refuse":
                raise infinite_slope(
                    place.words, place.dofs, "its slope there is zero, so that of its inverse is infinite"
                )
            P[row, row] = 1.0 / STEEPEST_TANGENT
    size = np.abs(P).max(axis=1, keepdims=True)  # rows of steep elements are large
    if np.linalg.cond(P / size) * SINGULAR_GROUP > 1.0 and not reduction.rests:
        places = [place for place, moves in zip(geometry.places, reduction.moving, strict=True) if moves]
        words, dofs = listed([place.words for place in places]), tuple(name for place in places for name in place.dofs)
        if singular == "refuse":
            raise infinite_slope(
                words, tuple(dict.fromkeys(dofs)), "together they have a slope of zero in some direction"
            )
        return np.asarray(D @ np.linalg.pinv(P))
    return np.asarray(np.linalg.solve((P / size).T, D.T).T / size.T)


def infinite_slope(words: str, dofs: tuple[str, ...], fact: str) -> LawError:
    """Make the refusal of a linearization where a slope is infinite."""
    msg = (
        f"No linear state space describes small motions here: {words} acts on {listed(dofs)}, and {fact}. "
        "Linearize where "
        "it moves, give the law a linear part, or take tangent(), which drops the state."
    )
    return LawError(msg, element=words, dofs=dofs)
