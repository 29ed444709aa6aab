"""The state of rest under constant inputs: Newton's method on the static equation.

K q + sum over springs of e phi(e' q) + forces at rest = B u                                    (N8)
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from halfdof_ctrl.base.arrays import FloatArray, IndexArray, read_only
from halfdof_ctrl.base.errors import LawError
from halfdof_ctrl.base.names import listed
from halfdof_ctrl.model.nonlinear import Values
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.nonlinear.classification import POINT_SEEDS, generic_slopes
from halfdof_ctrl.nonlinear.given_inputs import constant_inputs

if TYPE_CHECKING:
    from halfdof_ctrl.nonlinear.reduction import NonlinearReduction

MOST_EQUILIBRIUM_STEPS = 200  #: of Newton
MOST_HALVINGS = 50  #: of one step
LOADED = tuple((0.0, part / 16) for part in range(1, 17))  #: (share of a helping spring, of the load): the load grows
RELEASED = (*((10.0**-power, 1.0) for power in range(9)), (0.0, 1.0))  #: or springs that hold everything are let go
REST = 1e-12  #: force left over, relative to the largest one, at which it is at rest
LOOSE_STIFFNESS = 1e-13  #: reciprocal condition of the scaled stiffness below which something is loose


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Equilibrium:
    """A state of rest, for N states, m inputs and n DOFs."""

    state: FloatArray  #: (N,) for `tangent` and `control.linearize`
    inputs: FloatArray  #: (m,)
    displacement: dict[str, float]  #: of each DOF [m]
    residual: float  #: largest force left over [N]

    @property
    def states(self) -> FloatArray:
        """The state again, under the name of python-control's `OperatingPoint`."""
        return self.state


def equilibrium_of(reduction: "NonlinearReduction", inputs: Values) -> Equilibrium:
    """Return the equilibrium, as `NonlinearModel.equilibrium` describes it."""
    model = reduction.model
    u = constant_inputs(inputs, model.inputs)
    base = model.with_linear_elements
    load = np.asarray(base.B @ u)
    held = np.array([name in model.prescribed and not base.K[i].any() for i, name in enumerate(model.dofs)])
    if load[held].any():
        names = tuple([name for name, is_held in zip(model.dofs, held, strict=True) if is_held])
        msg = f"The motion of {listed(names)} is prescribed and does not rest under these inputs. Set them to zero."
        raise LawError(msg, element="prescribed motion", dofs=names)
    free = np.flatnonzero(~held)
    q = np.zeros(len(model.dofs))
    for path in (((0.0, 1.0),), LOADED, RELEASED):
        q = np.zeros(len(model.dofs))
        for helping, share in path:
            found = _newton(reduction, base.K + helping * _help(reduction, base), load * share, q, free)
            if found is None:
                break
            q = found
        else:
            left = np.abs(_left_over(reduction, base.K, load, q)[free]).max(initial=0.0)
            return _checked(reduction, q, u, float(left))
    raise _no_rest(reduction, base.K, load, q, free)


def _help(reduction: "NonlinearReduction", base: SecondOrderModel) -> FloatArray:
    """Return a stiffness in the place of every element, of the size of what else is there."""
    slopes = [np.abs(G) for G in generic_slopes(base, reduction.geometry, POINT_SEEDS[0])]
    return np.asarray(reduction.geometry.with_slopes(base, slopes).K - base.K)


def _checked(reduction: "NonlinearReduction", q: FloatArray, u: FloatArray, residual: float) -> Equilibrium:
    x = reduction.partition.state_of(q, np.zeros_like(q))
    displacement = dict(zip(reduction.model.dofs, q.tolist(), strict=True))
    return Equilibrium(state=read_only(x), inputs=read_only(u), displacement=displacement, residual=residual)


def _left_over(reduction: "NonlinearReduction", K: FloatArray, load: FloatArray, q: FloatArray) -> FloatArray:
    geometry = reduction.geometry
    return np.asarray(K @ q + geometry.E @ geometry.forces(geometry.L_q @ q, 0.0) - load)


def _stiffness(reduction: "NonlinearReduction", K: FloatArray, q: FloatArray) -> FloatArray:
    geometry = reduction.geometry
    slopes = np.clip(geometry.joined(geometry.slopes(geometry.L_q @ q, 0.0)), -1e150, 1e150)
    return np.asarray(K + geometry.E @ slopes @ geometry.L_q)


def _newton(
    reduction: "NonlinearReduction", K: FloatArray, load: FloatArray, q: FloatArray, free: IndexArray
) -> FloatArray | None:
    """Find q from a first guess; None if a stiffness is singular on the way or the steps do not settle."""
    left = _left_over(reduction, K, load, q)[free]
    for _ in range(MOST_EQUILIBRIUM_STEPS):
        tangent = _stiffness(reduction, K, q)[np.ix_(free, free)]
        size = float(np.abs(load).max(initial=0.0) + (np.abs(tangent) @ np.abs(q[free])).max(initial=0.0))
        if np.abs(left).max(initial=0.0) <= REST * size and not _loose(tangent):
            return q
        try:
            step = -np.linalg.lstsq(tangent, left, rcond=LOOSE_STIFFNESS)[0]
        except np.linalg.LinAlgError:
            return None
        at = 1.0
        for _ in range(MOST_HALVINGS):
            trial = q.copy()
            trial[free] += at * step
            following = _left_over(reduction, K, load, trial)[free]
            if np.isfinite(following).all() and np.linalg.norm(following) < (1.0 - 1e-4 * at) * np.linalg.norm(left):
                break
            at *= 0.5
        else:
            return q if np.abs(left).max(initial=0.0) <= 1e3 * REST * size and not _loose(tangent) else None
        q, left = trial, following
    return None


def _loose(tangent: FloatArray) -> bool:
    """Tell whether a stiffness is singular, each row measured by its own size."""
    size = np.abs(tangent).max(axis=1, initial=0.0)
    if not size.all():
        return bool(size.size)
    return bool(np.linalg.cond(tangent / size[:, None]) * LOOSE_STIFFNESS > 1.0)


def _no_rest(
    reduction: "NonlinearReduction", K: FloatArray, load: FloatArray, q: FloatArray, free: IndexArray
) -> LawError:
    dofs = reduction.model.dofs
    tangent = _stiffness(reduction, K, q)[np.ix_(free, free)]
    if _loose(tangent):
        _, _, right = np.linalg.svd(tangent)
        share = np.abs(right[-1])
        names = tuple([dofs[free[i]] for i in np.flatnonzero(share > 1e-6 * share.max())])
        msg = (
            f"Nothing holds {listed(names)} at rest: no spring resists there (inside a gap, or at a damper alone), "
            "so the "
            "equilibrium is not one point. Add a spring, or choose a load that closes the gap."
        )
        return LawError(msg, element="stiffness", dofs=names)
    left = np.abs(_left_over(reduction, K, load, q))
    worst = dofs[int(free[left[free].argmax()])]
    msg = (
        f"No equilibrium was found: {left[free].max():.3g} N is left over at {worst}. Its springs may not reach the "
        "load."
    )
    return LawError(msg, element="equilibrium", dofs=(worst,))
