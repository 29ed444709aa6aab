"""Find the motions that answer the forces: ``w + S (f(w) - G w) = w_0(x, u)``, group by group.

    w = w_0 + S d,    d = -(f(w, t) - G w)                                                         (N3)

d is what the elements do beyond the generic tangents G that the linear part holds. Variables that are states need no
solving; the others fall into groups, the strong components of S, which follow one another. A group of one spring or
damper is a scalar equation of a law that rises, with 1/S = G + rest:

    f(w) + rest w = w_0 / S                                                                        (N4)

A group of several is solved by `coupled`. Nothing is remembered between calls: equal arguments give equal results.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse.csgraph import connected_components

from halfdof_ctrl.base.arrays import FloatArray
from halfdof_ctrl.nonlinear.coupled import Group, coupled_solver
from halfdof_ctrl.nonlinear.geometry import Geometry, Place
from halfdof_ctrl.nonlinear.scalar_equation import Root

UNCOUPLED = 1e-14  #: entries of S below this part of the diagonal's are rounding

Step = Callable[[float, FloatArray, FloatArray], None]  #: of (t, w, d): fill in w and d of one group


class UnansweredError(Exception):
    """No motion answers a force; `place` and `force` say which. Turned into a `NoAnswerError` where time is known."""

    def __init__(self, place: Place, force: float) -> None:
        super().__init__(place.words)
        self.place = place
        self.force = force


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Answers:
    """The steps that find w and d, for r variables and a forces."""

    S: FloatArray  #: (r, a) how the variables follow the elements' forces
    steps: tuple[Step, ...]
    groups: tuple[tuple[int, ...], ...]  #: places of each step that solves, in their order

    def solve(self, t: float, w_0: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return w and d of equation (N3).

        Raises
        ------
        UnansweredError
            A law gives NaN or Inf, or no w answers a force.
        """
        w, d = w_0.copy(), np.zeros(self.S.shape[1])
        for step in self.steps:
            step(t, w, d)
        return w, d


def answers_of(
    geometry: Geometry,
    S: FloatArray,
    slopes: Sequence[FloatArray],
    moving: Sequence[bool],
    roots: dict[int, Root],
) -> Answers:
    """Order the elements into steps.

    Parameters
    ----------
    geometry : Geometry
    S : (r, a) ndarray
        Of equation (N3); rows of elements on states are zero.
    slopes : sequence of ndarray
        G of each element, zero where it is on states.
    moving : sequence of bool
        Whether the element's variables must be solved for.
    roots : dict
        The solution of (N4), as a function of w_0 / S, for every spring and damper that stands alone.
    """
    places = geometry.places
    on_states = [k for k in range(len(places)) if not moving[k] and not S[places[k].arguments].any()]
    steps: list[Step] = [_explicit(places[k], slopes[k]) for k in on_states]
    groups = components(geometry, S, [k not in on_states for k in range(len(places))])
    for group in groups:
        place = places[group[0]]
        if len(group) == 1 and not moving[group[0]]:
            steps.append(_following(place, slopes[group[0]], S))
        elif len(group) == 1 and group[0] in roots:
            steps.append(_alone(place, S, roots[group[0]]))
        else:
            steps.append(_together(Group.of(geometry, S, slopes, group), S, [places[k] for k in group]))
    return Answers(S=S, steps=tuple(steps), groups=groups)


def components(geometry: Geometry, S: FloatArray, moving: Sequence[bool]) -> tuple[tuple[int, ...], ...]:
    """Return the groups of elements that must be solved for together, each after those that it depends on."""
    implicit = [k for k in range(len(geometry.places)) if moving[k]]
    size = len(implicit)
    if size == 0:
        return ()
    link = np.zeros((size, size))
    for i, k in enumerate(implicit):
        for j, other in enumerate(implicit):
            block = np.abs(S[geometry.places[k].arguments, geometry.places[other].forces])
            link[i, j] = block.max(initial=0.0)
    own = np.sqrt(np.abs(np.diag(link)))
    depends = link > UNCOUPLED * np.outer(own, own)
    count, label = connected_components(depends.astype(float), directed=True, connection="strong")
    groups = [[i for i in range(size) if label[i] == one] for one in range(count)]
    done: list[list[int]] = []
    while len(done) < count:  # a group comes when all that it depends on are there
        for group in groups:
            known = {i for one in done for i in one} | set(group)
            if group not in done and all(set(np.flatnonzero(depends[i]).tolist()) <= known for i in group):
                done.append(group)
    return tuple([tuple([implicit[i] for i in group]) for group in done])


def _explicit(place: Place, G: FloatArray) -> Step:
    """Evaluate an element whose variables are states."""
    own, forces = place.arguments, place.forces
    if place.is_scalar:
        row, column, slope = own.start, forces.start, float(G[0, 0])
        force = place.element.law.force  # type: ignore[union-attr]

        def step(t: float, w: FloatArray, d: FloatArray) -> None:  # noqa: ARG001  # one signature for all steps
            at = float(w[row])
            value = slope * at - float(force(at))
            if not math.isfinite(value):
                raise UnansweredError(place, value)
            d[column] = value

        return step

    def vector_step(t: float, w: FloatArray, d: FloatArray) -> None:
        d[forces] = G @ w[own] - place.force(w[own], t)
        if not np.isfinite(d[forces]).all():
            raise UnansweredError(place, math.nan)

    return vector_step


def _following(place: Place, G: FloatArray, S: FloatArray) -> Step:
    """Evaluate an element whose variables follow the forces of others, not its own."""
    evaluate, rows = _explicit(place, G), S[place.arguments]

    def step(t: float, w: FloatArray, d: FloatArray) -> None:
        w[place.arguments] += rows @ d
        evaluate(t, w, d)

    return step


def _alone(place: Place, S: FloatArray, root: Root) -> Step:
    """Solve (N4) for one spring or damper."""
    row, column = place.arguments.start, place.forces.start
    own = float(S[row, column])
    others = np.array(S[row])
    others[column] = 0.0
    coupled = bool(others.any())

    def step(t: float, w: FloatArray, d: FloatArray) -> None:  # noqa: ARG001
        start = float(w[row])
        if coupled:
            start += float(others @ d)
        answer = root(start / own)
        if not math.isfinite(answer):
            raise UnansweredError(place, start / own)
        w[row] = answer
        d[column] = (answer - start) / own

    return step


def _together(group: Group, S: FloatArray, places: list[Place]) -> Step:
    """Solve (N3) for several elements at once."""
    solve = coupled_solver(group)
    outside = np.array(S[group.rows])
    outside[:, group.columns] = 0.0

    def step(t: float, w: FloatArray, d: FloatArray) -> None:
        start = w[group.rows] + outside @ d
        found = solve(t, start)
        if found is None:
            worst = np.abs(start / np.maximum(np.abs(group.S).max(axis=1), np.finfo(float).tiny))
            raise UnansweredError(places[0], float(worst.max()))
        w[group.rows], d[group.columns] = found

    return step
