"""Where the elements of a nonlinear model sit: what they depend on and what they act on.

    w = L_q q + L_v q'                                                                             (N2)
    M q'' + C q' + K q + E f(w, t) = B u

A spring has one row of L_q, a damper one of L_v, and both the column e of E; a `Force` has a row for each motion that
it declares and a column for each DOF that it acts on.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from halfdof_ctrl.base.arrays import FloatArray, read_only
from halfdof_ctrl.model.elements import Damper, Element, Force, Spring, element_dofs
from halfdof_ctrl.model.law import Law
from halfdof_ctrl.model.nonlinear import NonlinearModel, direction, element_words, split_actions
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.nonlinear.judgement import judged

DIFFERENCE_STEP = float(np.cbrt(np.finfo(float).eps))  #: relative step of a jacobian that is differenced ...
LEAST_STEP = 1e-9  #: ... and the absolute one at a value of zero


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Place:
    """One element that is not linear, with its rows of w and its columns of E."""

    element: Element
    words: str  #: ``damper 1 (quadratic)``
    dofs: tuple[str, ...]  #: DOFs it acts on, then those it depends on
    arguments: slice  #: in w
    forces: slice  #: in f

    @property
    def is_scalar(self) -> bool:
        """Whether it is a spring or damper: one variable, one force."""
        return not isinstance(self.element, Force)

    def force(self, w: FloatArray, t: float) -> FloatArray:
        """Return its forces at its own variables w."""
        element = self.element
        if isinstance(element, Force):
            n_q = len(element.displacements)
            return np.asarray(element.function(w[:n_q], w[n_q:], t), dtype=float).reshape(len(element.on))
        return np.array([float(element.law.force(float(w[0])))])  # type: ignore[union-attr]  # numbers are not here

    def slope(self, w: FloatArray, t: float) -> FloatArray:
        """Return the derivatives of its forces by its own variables."""
        element = self.element
        if not isinstance(element, Force):
            return np.array([[float(element.law.slope(float(w[0])))]])  # type: ignore[union-attr]
        n_q = len(element.displacements)
        if element.jacobian is not None:
            by_q, by_v = element.jacobian(w[:n_q], w[n_q:], t)
            return np.hstack([np.asarray(by_q, dtype=float), np.asarray(by_v, dtype=float)])
        columns = []
        for j, value in enumerate(w.tolist()):
            step = max(DIFFERENCE_STEP * abs(value), LEAST_STEP)
            above, below = w.copy(), w.copy()
            above[j], below[j] = value + step, value - step
            columns.append((self.force(above, t) - self.force(below, t)) / (above[j] - below[j]))
        return np.array(columns).T.reshape(len(element.on), w.size)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Geometry:
    """All elements of a model that are not linear, for n DOFs, r variables w and a forces f."""

    places: tuple[Place, ...]
    E: FloatArray  #: (n, a)
    L_q: FloatArray  #: (r, n)
    L_v: FloatArray  #: (r, n)
    R: FloatArray  #: (p, a) the forces in the outputs: in the reactions of DOFs whose motion is prescribed

    def with_slopes(self, base: SecondOrderModel, slopes: Sequence[FloatArray | None]) -> SecondOrderModel:
        """Return M, C and K with ``E_k G_k L_k`` of every element whose slope G_k is given."""
        C, K, by_q, by_v = (np.array(matrix) for matrix in (base.C, base.K, base.F, base.G))
        for place, G in zip(self.places, slopes, strict=True):
            if G is not None:
                C += self.E[:, place.forces] @ G @ self.L_v[place.arguments]
                K += self.E[:, place.forces] @ G @ self.L_q[place.arguments]
                by_q += self.R[:, place.forces] @ G @ self.L_q[place.arguments]
                by_v += self.R[:, place.forces] @ G @ self.L_v[place.arguments]
        return replace(base, C=read_only(C), K=read_only(K), F=read_only(by_q), G=read_only(by_v))

    def forces(self, w: FloatArray, t: float) -> FloatArray:
        """Return all forces f(w, t)."""
        parts = [place.force(w[place.arguments], t) for place in self.places]
        return np.concatenate(parts) if parts else np.zeros(0)

    def slopes(self, w: FloatArray, t: float) -> list[FloatArray]:
        """Return the derivative of each element's forces by its own variables."""
        return [place.slope(w[place.arguments], t) for place in self.places]

    def joined(self, blocks: Sequence[FloatArray]) -> FloatArray:
        """Return the (a, r) matrix with the blocks of the elements on its diagonal."""
        whole = np.zeros((self.E.shape[1], self.L_q.shape[0]))
        for place, block in zip(self.places, blocks, strict=True):
            whole[place.forces, place.arguments] = block
        return whole


def geometry_of(model: NonlinearModel) -> Geometry:
    """Place the elements of a model whose laws are not linear."""
    dofs, n = model.dofs, len(model.dofs)
    unit = np.eye(n)
    places: list[Place] = []
    columns, by_q, by_v = [np.zeros((n, 0))], [np.zeros((0, n))], [np.zeros((0, n))]
    r = a = 0
    for element, words in merged_elements(model):
        if isinstance(element, Force):
            q, v, on = ([dofs.index(name) for name in group] for group in _groups(element))
            E, L_q, L_v = unit[:, on], np.zeros((len(q) + len(v), n)), np.zeros((len(q) + len(v), n))
            L_q[: len(q)], L_v[len(q) :] = unit[q], unit[v]
        else:
            e = direction(element, dofs)
            still = np.zeros((1, n))
            is_spring = isinstance(element, Spring)
            E, L_q, L_v = e[:, None], e[None] if is_spring else still, still if is_spring else e[None]
        arguments, forces = slice(r, r + len(L_q)), slice(a, a + E.shape[1])
        place = Place(element=element, words=words, dofs=element_dofs(element), arguments=arguments, forces=forces)
        r, a = arguments.stop, forces.stop
        places.append(place)
        for kept, new in ((columns, E), (by_q, L_q), (by_v, L_v)):
            kept.append(new)
    E, L_q, L_v = (
        read_only(join(parts)) for join, parts in ((np.hstack, columns), (np.vstack, by_q), (np.vstack, by_v))
    )
    E, R = split_actions(E, model.linear)
    return Geometry(places=tuple(places), E=E, L_q=L_q, L_v=L_v, R=R)


def merged_elements(model: NonlinearModel) -> list[tuple[Element, str]]:
    """Return the elements that are not linear, those side by side between the same two DOFs as one."""
    found: dict[object, tuple[Element, str]] = {}
    for element, words in zip(model.elements, element_words(model.elements), strict=True):
        if isinstance(element, Force):
            found[id(element), len(found)] = element, words
            continue
        if not isinstance(element.law, Law):
            continue
        key = type(element), frozenset((element.a, element.b))
        if key not in found:
            found[key] = element, words
            continue
        first, named = found[key]
        if isinstance(first, Spring | Damper) and isinstance(first.law, Law):  # keys of these hold nothing else
            law = side_by_side(first.law, element.law, turned=first.a != element.a)
            found[key] = type(first)(first.a, first.b, law), f"{named} and {words}"
    return list(found.values())


def side_by_side(first: Law, second: Law, *, turned: bool) -> Law:
    """Return the sum of two laws, the second one of an element that points the other way if `turned`."""
    sign = -1.0 if turned else 1.0
    one, two = judged(first), judged(second)
    low, high = two.bounds if not turned else (-two.bounds[1], -two.bounds[0])
    domain = second.domain if not turned else (-second.domain[1], -second.domain[0])
    return Law(
        partial(_sum_of_forces, first, second, sign),
        partial(_sum_of_slopes, first, second, sign),
        bounds=(one.bounds[0] + low, one.bounds[1] + high),
        monotone=one.rises and two.rises,
        domain=(max(first.domain[0], domain[0]), min(first.domain[1], domain[1])),
        flat=one.flat and two.flat,
    )


def _sum_of_forces(first: Law, second: Law, sign: float, x: Any) -> Any:  # noqa: ANN401
    return first.force(x) + sign * second.force(sign * x)


def _sum_of_slopes(first: Law, second: Law, sign: float, x: Any) -> Any:  # noqa: ANN401
    return first.slope(x) + second.slope(sign * x)


def _groups(element: Force) -> tuple[Any, Any, Any]:
    return element.displacements, element.velocities, element.on
