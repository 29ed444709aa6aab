"""Several elements that must be solved for together.

    w + S (f(w) - G w) = w_0,    y = (V' (w - w_0)),    S = V diag(s) V'                           (N5)

Where S is symmetric positive semidefinite and every law rises, w = w_0 + V y is where the convex function

    h(y) = y' diag(1/s) y / 2 + sum of (F_k(w_k) - G_k w_k^2 / 2),    F_k' = f_k

has its least value: its gradient is (N5), its Hessian ``diag(1/s) + V' (D - G) V`` that of springs and dampers in
parallel, so there is one solution at most, and exactly one where the laws are onto. Newton's method with a search
along each step, whose derivative rises, finds it; where a slope is zero or infinite and Newton stands still, one
variable after the other is solved for inside its bracket, which lowers h at every turn. Elsewhere damped Newton.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg

from halfdof_ctrl.base.arrays import EPS, FloatArray, IndexArray
from halfdof_ctrl.model.law import Law
from halfdof_ctrl.nonlinear.geometry import Geometry, Place
from halfdof_ctrl.nonlinear.scalar_equation import root_of

SYMMETRIC_TANGENT = 1e-11  #: relative difference of S and its transpose that is rounding
RANK = 1e-12  #: singular values of S below this part of the largest are none
MOST_COUPLED_STEPS = 100  #: of Newton
MOST_COUPLED_HALVINGS = 60  #: along one step
MOST_TURNS = 400  #: through all variables, one by one
LOOSE = 1e3 * EPS  #: of its terms: a gradient that Newton does not make smaller than this is rounding
SETTLED_FORCE = 8 * EPS  #: relative change of w that is none
JACOBIAN_SHIFTS = (0.0, 1e-14, 1e-11, 1e-8, 1e-5, 1e-2, 1.0)  #: of the Hessian, in units of its linear part
STEEPEST = 1e200  #: stands for an infinite slope

Solver = Callable[[float, FloatArray], tuple[FloatArray, FloatArray] | None]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Group:
    """The elements of a group, for r variables and a forces of their own."""

    places: tuple[Place, ...]
    rows: IndexArray  #: (r,) places of the variables in w
    columns: IndexArray  #: (a,) places of the forces in f
    S: FloatArray  #: (r, a)
    G: FloatArray  #: (a, r)

    @classmethod
    def of(cls, geometry: Geometry, S: FloatArray, slopes: Sequence[FloatArray], which: Sequence[int]) -> "Group":
        """Take the elements with these numbers."""
        places = tuple([geometry.places[k] for k in which])
        rows = np.concatenate([np.arange(place.arguments.start, place.arguments.stop) for place in places])
        columns = np.concatenate([np.arange(place.forces.start, place.forces.stop) for place in places])
        G = scipy.linalg.block_diag(*[slopes[k] for k in which])
        return cls(places=places, rows=rows, columns=columns, S=S[np.ix_(rows, columns)], G=G)

    @property
    def is_convex(self) -> bool:
        """Whether all are springs or dampers and S is symmetric positive semidefinite, so that h is convex."""
        size = float(np.abs(self.S).max())
        if (
            not all(place.is_scalar for place in self.places)
            or np.abs(self.S - self.S.T).max() > SYMMETRIC_TANGENT * size
        ):
            return False
        return bool(np.linalg.eigvalsh(0.5 * (self.S + self.S.T)).min() > -RANK * size)

    def force(self, w: FloatArray, t: float) -> FloatArray:
        """Return the forces of the group."""
        at, parts = 0, []
        for place in self.places:
            size = place.arguments.stop - place.arguments.start
            parts.append(place.force(w[at : at + size], t))
            at += size
        return np.concatenate(parts)

    def slope(self, w: FloatArray, t: float) -> FloatArray:
        """Return the (a, r) derivatives of the forces, none of them infinite."""
        at, parts = 0, []
        for place in self.places:
            size = place.arguments.stop - place.arguments.start
            parts.append(place.slope(w[at : at + size], t))
            at += size
        return np.asarray(np.clip(scipy.linalg.block_diag(*parts), -STEEPEST, STEEPEST))


def coupled_solver(group: Group) -> Solver:
    """Return the function that solves (N5) for w and d, given t and w_0; None where it finds no answer."""
    return _convex_solver(group) if group.is_convex else _plain_solver(group)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class _Potential:
    """The function h of (N5) for springs and dampers, by its gradient and its Hessian."""

    s: FloatArray  #: (k,) singular values of S
    V: FloatArray  #: (r, k)
    g: FloatArray  #: (r,) tangents in the linear part
    laws: tuple[Law, ...]

    @classmethod
    def of(cls, group: Group) -> "_Potential":
        s, V = np.linalg.eigh(0.5 * (group.S + group.S.T))
        kept = s > RANK * s.max()
        laws = tuple([place.element.law for place in group.places])  # type: ignore[union-attr]
        return cls(s=s[kept], V=V[:, kept], g=np.diag(group.G).copy(), laws=laws)  # type: ignore[arg-type]

    def beyond(self, w: FloatArray) -> FloatArray:
        """Return f(w) - G w."""
        return np.array([float(law.force(x)) for law, x in zip(self.laws, w.tolist(), strict=True)]) - self.g * w

    def gradient(self, w_0: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the two terms of the gradient at y."""
        return y / self.s, self.V.T @ self.beyond(w_0 + self.V @ y)

    def hessian(self, w: FloatArray) -> FloatArray:
        """Return the second derivative, with a large number for an infinite slope."""
        slopes = np.array([float(law.slope(x)) for law, x in zip(self.laws, w.tolist(), strict=True)])
        return np.asarray(np.diag(1.0 / self.s) + (self.V.T * (np.minimum(slopes, STEEPEST) - self.g)) @ self.V)


def _convex_solver(group: Group) -> Solver:
    h = _Potential.of(group)
    by_turns = _turns(group) if h.s.size == group.rows.size else None

    def solve(t: float, w_0: FloatArray) -> tuple[FloatArray, FloatArray] | None:  # noqa: ARG001  # laws know no time
        y, settled = _newton(h, w_0)
        w = w_0 + h.V @ y
        if not settled and by_turns is not None:
            found = by_turns(w_0, w)
            if found is None:
                return None
            w, settled = found, True
        return (w, -h.beyond(w)) if settled and np.isfinite(w).all() else None

    return solve


def _newton(h: _Potential, w_0: FloatArray) -> tuple[FloatArray, bool]:
    """Minimize h from y = 0; tell whether it settled."""
    y = np.zeros(h.s.size)
    one, two = h.gradient(w_0, y)
    for _ in range(MOST_COUPLED_STEPS):
        if _is_flat(one, two, EPS):
            return y, True
        down, w = one + two, w_0 + h.V @ y
        step = _newton_step(h.hessian(w), down, h.s)
        if step is None:
            break
        y = _along(h, w_0, y, step, float(down @ step))
        one, two = h.gradient(w_0, y)
        if not np.isfinite(two).all():
            return y, False
        if _is_settled(h.V @ step, np.concatenate([w, w_0])):
            return y, True
    return y, _is_flat(one, two, LOOSE)


def _is_flat(one: FloatArray, two: FloatArray, share: float) -> bool:
    """Tell whether a gradient is no more than this share of its two terms."""
    return bool((np.abs(one + two) <= share * (np.abs(one) + np.abs(two))).all())


def _newton_step(hessian: FloatArray, down: FloatArray, s: FloatArray) -> FloatArray | None:
    """Return a step down; where a slope is zero and the Hessian singular, a shorter one along what is left of it."""
    for shift in JACOBIAN_SHIFTS:
        try:
            step = -np.linalg.solve(hessian + np.diag(shift / s) if shift else hessian, down)
        except np.linalg.LinAlgError:
            continue
        if np.isfinite(step).all() and down @ step < 0.0:
            return np.asarray(step)
    return None


def _along(h: _Potential, w_0: FloatArray, y: FloatArray, step: FloatArray, first: float) -> FloatArray:
    """Go along a step to where the derivative of h has fallen to less than half; it rises along the step."""
    low, high, at = 0.0, 1.0, 1.0
    for _ in range(MOST_COUPLED_HALVINGS):
        one, two = h.gradient(w_0, y + at * step)
        derivative = float((one + two) @ step)
        if math.isfinite(derivative) and (abs(derivative) <= 0.5 * abs(first) or (derivative < 0.0 and at == 1.0)):
            break
        low, high = (at, high) if math.isfinite(derivative) and derivative < 0.0 else (low, at)
        at = 0.5 * (low + high)
    return y + at * step


def _turns(group: Group) -> Callable[[FloatArray, FloatArray], FloatArray | None]:
    """Return the method by one variable after the other: ``f_k(w_k) + R_kk w_k = r_k - sum of R_kj w_j``."""
    inverse = np.linalg.solve(group.S, np.eye(group.rows.size))  # a few rows, and R is wanted itself
    R = 0.5 * (inverse + inverse.T) - group.G
    noise = RANK * np.abs(inverse)
    R = np.where(np.abs(R) <= noise, 0.0, R)
    laws: list[Law] = [place.element.law for place in group.places]  # type: ignore[union-attr,misc]
    roots = [root_of(law, max(float(R[k, k]), 0.0)) for k, law in enumerate(laws)]

    def solve(w_0: FloatArray, w: FloatArray) -> FloatArray | None:
        r = inverse @ w_0
        w = np.where(np.isfinite(w), w, w_0)
        for _ in range(MOST_TURNS):
            before = w.copy()
            for k, root in enumerate(roots):
                w[k] = root(float(r[k] - R[k] @ w + R[k, k] * w[k]))
            if not np.isfinite(w).all():
                return None
            if _is_settled(w - before, w):
                return w
        return w if _is_settled((w - before) * 1e-3, w) else None

    return solve


def _plain_solver(group: Group) -> Solver:
    unit = np.eye(group.rows.size)

    def residual(t: float, w_0: FloatArray, w: FloatArray) -> FloatArray:
        return w - w_0 + group.S @ (group.force(w, t) - group.G @ w)

    def solve(t: float, w_0: FloatArray) -> tuple[FloatArray, FloatArray] | None:
        w, left = w_0, residual(t, w_0, w_0)
        for _ in range(MOST_COUPLED_STEPS):
            try:
                step = -np.linalg.solve(unit + group.S @ (group.slope(w, t) - group.G), left)
            except np.linalg.LinAlgError:
                return None
            at, size = 1.0, float(np.linalg.norm(left))
            for _ in range(MOST_COUPLED_HALVINGS):
                following = residual(t, w_0, w + at * step)
                if np.isfinite(following).all() and np.linalg.norm(following) <= (1.0 - 1e-4 * at) * size:
                    break
                at *= 0.5
            else:
                settled = _is_settled(step, w)
                return (w, group.G @ w - group.force(w, t)) if settled else None
            w, left = w + at * step, following
            if _is_settled(step, w):
                return w, group.G @ w - group.force(w, t)
        return None

    return solve


def _is_settled(step: np.ndarray, w: np.ndarray) -> bool:
    return bool((np.abs(step) <= SETTLED_FORCE * np.abs(w).max(initial=0.0)).all())
