"""Laws whose motion comes to rest in finite time, eased below the tolerance of a simulation.

A square damper in series with a spring obeys ``x' = -√(k x / c2)``: its slope at rest is infinite, x reaches zero in
finite time and stays there, and a solver that is to follow this without end crawls. What it cannot know anyway is less
than its tolerance: where the elements' variables w_0 are uncertain by delta, so is the force by ``delta / S``, and over
the motion w_d that answers it the law may as well be its chord. The motion then dies out exponentially below the
tolerance, and the solution changes by no more than that.
"""

import math
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from halfdof_ctrl.base.arrays import FloatArray
from halfdof_ctrl.model.law import Law
from halfdof_ctrl.nonlinear.answers import Answers, answers_of
from halfdof_ctrl.nonlinear.geometry import Place
from halfdof_ctrl.nonlinear.reduction import NonlinearReduction
from halfdof_ctrl.nonlinear.scalar_equation import Root, root_of

WIDTH = 4.0  #: times the tolerance: both the absolute and the relative one count, on either side
SMOOTH = 0.5  #: a slope of more than this part of the chord's (less than its inverse) needs no easing


@dataclass(frozen=True, slots=True)
class Chord:
    """The straight line that stands for a law between two values."""

    reach: float  #: from -reach to reach [m or m/s]
    below: float  #: force at -reach [N]
    above: float  #: force at reach [N]

    @property
    def slope(self) -> float:
        """Slope of the line."""
        return (self.above - self.below) / (2.0 * self.reach)


def eased_answers(reduction: NonlinearReduction, tolerances: FloatArray) -> Answers:
    """Return the answers of a reduction with laws eased below the tolerances of its states.

    Parameters
    ----------
    reduction : NonlinearReduction
    tolerances : (N,) ndarray
        Absolute tolerance of each state.
    """
    uncertain = WIDTH * np.abs(reduction.X_w) @ tolerances
    places, roots = list(reduction.geometry.places), dict(reduction.roots)
    changed = False
    for k, place in enumerate(places):
        law = _law_of(place)
        delta = float(uncertain[place.arguments].max(initial=0.0))
        if law is None or delta == 0.0:
            continue
        chord = _chord(reduction, k, law, delta)
        if chord is None:
            continue
        changed = True
        if k in roots:
            rest = reduction.rests[k]
            roots[k] = _eased_root(roots[k], chord, rest)
        places[k] = replace(place, element=replace(place.element, law=_eased_law(law, chord)))  # type: ignore[arg-type]
    if not changed:
        return reduction.answers
    geometry = replace(reduction.geometry, places=tuple(places))
    return answers_of(geometry, reduction.S, reduction.slopes, reduction.moving, roots)


def _law_of(place: Place) -> Law | None:
    return place.element.law if place.is_scalar and isinstance(place.element.law, Law) else None  # type: ignore[union-attr]


def _chord(reduction: NonlinearReduction, k: int, law: Law, delta: float) -> Chord | None:
    """Return the chord where the law is too steep or too flat at rest, None where it is smooth."""
    if not law.domain[0] < 0.0 < law.domain[1]:
        return None
    place = reduction.geometry.places[k]
    steep = float(law.slope(0.0))
    if reduction.moving[k]:
        rest = reduction.rests.get(k, 0.0)
        own = abs(float(reduction.S[place.arguments.start, place.forces.start]))
        at_rest = float(law.force(0.0))
        reach = abs(root_of(law, rest)(at_rest + delta / own)) if own > 0.0 else math.nan
    else:
        rest, reach = 0.0, delta
    if not (math.isfinite(reach) and 0.0 < reach < min(-law.domain[0], law.domain[1])):
        return None
    chord = Chord(reach, float(law.force(-reach)), float(law.force(reach)))
    if not (math.isfinite(chord.slope) and chord.slope > 0.0):
        return None
    ratio = (steep + rest) / (chord.slope + rest)
    too_flat = reduction.moving[k] and ratio < SMOOTH
    too_steep = ratio > 1.0 / SMOOTH and math.isinf(steep)
    return chord if too_flat or too_steep else None


def _eased_root(root: Root, chord: Chord, rest: float) -> Root:
    low, high = chord.below - rest * chord.reach, chord.above + rest * chord.reach
    middle, slope = 0.5 * (chord.below + chord.above), chord.slope + rest

    def eased(r: float) -> float:
        return (r - middle) / slope if low < r < high else root(r)

    return eased


def _eased_law(law: Law, chord: Chord) -> Law:
    return Law(
        partial(_eased_force, law, chord), partial(_eased_slope, law, chord), domain=law.domain, bounds=law.bounds
    )


def _eased_force(law: Law, chord: Chord, x: float) -> float:
    if abs(x) < chord.reach:
        return 0.5 * (chord.below + chord.above) + chord.slope * x
    return float(law.force(x))


def _eased_slope(law: Law, chord: Chord, x: float) -> float:
    return chord.slope if abs(x) < chord.reach else float(law.slope(x))
