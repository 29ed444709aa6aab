"""The reduction of a nonlinear model: a linear one whose extra inputs are what the elements do beyond their tangents.

    x' = A x + B u + B_d d,    w = X_w x + U_w u + S d,    d = -(f(w, t) - G w)                     (N3)

A, B, B_d, X_w, U_w and S come from one exact reduction of the model with generic tangents G where elements must be
solved for, and with none where they hang on states. So every structure that the linear reduction takes at index 1 is
taken here, by the same code. Derivation: docs/explanation/nonlinear.md.
"""

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from halfdof_ctrl.base.arrays import FloatArray, read_only
from halfdof_ctrl.base.errors import ImproperError, LawError, NoAnswerError
from halfdof_ctrl.base.names import listed
from halfdof_ctrl.model.nonlinear import NonlinearModel, Values, reduced
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.nonlinear.answers import Answers, UnansweredError, answers_of, components
from halfdof_ctrl.nonlinear.classification import (
    made_by_elements,
    moving_places,
    partition_of,
    require_index_one,
)
from halfdof_ctrl.nonlinear.geometry import Geometry, Place, geometry_of
from halfdof_ctrl.nonlinear.judgement import judged
from halfdof_ctrl.nonlinear.requirements import require_answers
from halfdof_ctrl.nonlinear.scalar_equation import Root, root_of
from halfdof_ctrl.reduction.choose import exact_reduction
from halfdof_ctrl.reduction.dense.partition import DofPartition
from halfdof_ctrl.reduction.exact_reduction import ExactReduction
from halfdof_ctrl.reduction.method.signals import Signal

UNMOVED = 1e-13  #: of S G, and of S against X_w: below that an element does not move a variable
LEAST_REST = 1e-10  #: of G; what holds a DOF beside its element by less is rounding of 1/S - G


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class NonlinearReduction:
    """Equation (N3) for N states, m inputs, r variables w, a forces d and p outputs."""

    model: NonlinearModel
    geometry: Geometry
    linear: ExactReduction  #: of the model with the tangents G and the inputs (u, d)
    moving: tuple[bool, ...]  #: for each element, whether its variables are solved for
    slopes: tuple[FloatArray, ...]  #: G of each element
    rests: dict[int, float]  #: what holds beside an element that stands alone, in the units of its slope; (N4)
    roots: dict[int, Root]  #: solution of (N4) for these
    answers: Answers
    A: FloatArray  #: (N, N)
    B: FloatArray  #: (N, m)
    B_d: FloatArray  #: (N, a)
    X_w: FloatArray  #: (r, N)
    U_w: FloatArray  #: (r, m)
    G: FloatArray  #: (a, r) all slopes
    output: Signal  #: the p outputs as functions of x, (u, d) and, where they are improper, their derivatives
    made_by_elements: tuple[str, ...]  #: lines for `print`

    @property
    def S(self) -> FloatArray:  # noqa: N802
        """(r, a) how the variables follow the elements' forces."""
        return self.answers.S

    @property
    def partition(self) -> DofPartition:
        """Which coordinates are inertial, half and static."""
        return self.linear.partition  # type: ignore[return-value]  # index 1 and dense

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the states."""
        return self.linear.states

    def solved(self, t: float, x: FloatArray, u: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return w and d at a time, state and inputs.

        Raises
        ------
        NoAnswerError
            No motion answers a force, or a law gives NaN or Inf.
        """
        try:
            return self.answers.solve(t, self.X_w @ x + self.U_w @ u)
        except UnansweredError as cause:
            raise no_answer(self, cause, t, x) from cause

    def rate(self, t: float, x: FloatArray, u: FloatArray) -> FloatArray:
        """Return x' of equation (N3)."""
        _, d = self.solved(t, x, u)
        return np.asarray(self.A @ x + self.B @ u + self.B_d @ d)

    def state(self, initial: Values, inputs: Values) -> FloatArray:
        """Return the state for given displacements and velocities."""
        from halfdof_ctrl.nonlinear.initial import initial_state  # noqa: PLC0415  # it takes this class

        return initial_state(self, initial, inputs)

    def recover(self, response: Any) -> Any:  # noqa: ANN401  # as in `NonlinearModel`
        """Return the motion of all DOFs."""
        from halfdof_ctrl.nonlinear.recovery import recovered  # noqa: PLC0415

        return recovered(self, response)

    def tangent(self, state: Any, inputs: Values) -> SecondOrderModel:  # noqa: ANN401
        """Return the linear model for small motions."""
        from halfdof_ctrl.nonlinear.tangent import tangent_model  # noqa: PLC0415

        return tangent_model(self, state, inputs)

    def equilibrium(self, inputs: Values) -> Any:  # noqa: ANN401
        """Return the state of rest under constant inputs."""
        from halfdof_ctrl.nonlinear.equilibrium import equilibrium_of  # noqa: PLC0415

        return equilibrium_of(self, inputs)


@lru_cache(maxsize=32)
def reduce_nonlinear(model: NonlinearModel) -> NonlinearReduction:
    """Reduce a nonlinear model; the last ones are remembered, since models are frozen.

    Raises
    ------
    LawError
        The model is above index 1, or a law cannot be solved for where it stands.
    SingularPencilError, UncertainRankError
        Nothing resists a motion, or the order cannot be told.
    ImproperError
        An element follows the derivative of an input, as at a DOF without mass beside a prescribed displacement.
    """
    base, geometry = model.with_linear_elements, geometry_of(model)
    slopes = require_index_one(base, geometry)
    partition = partition_of(geometry.with_slopes(base, slopes))
    m, a, rows = len(model.inputs), geometry.E.shape[1], len(model.outputs)
    moving = moving_places(geometry, partition)  # type: ignore[arg-type]  # index 1 was required
    for _ in range(2):  # the second time without tangents where an element does not move its own variables
        kept = [G if moves else 0.0 * G for G, moves in zip(slopes, moving, strict=True)]
        linear, output, w = _linear_part(base, geometry, kept)
        S = w.direct(m + a)[:, m:].copy()
        following = [
            moves and not _moves_itself(S, G, place)
            for moves, G, place in zip(moving, kept, geometry.places, strict=True)
        ]
        if not any(following):
            break
        moving = [moves and not follows for moves, follows in zip(moving, following, strict=True)]
    needed = require_answers(base, geometry, slopes, moving, partition)  # type: ignore[arg-type]
    for place, moves in zip(geometry.places, moving, strict=True):
        if not moves:  # states and inputs, but for rounding; others' forces may reach them through a half DOF
            S[place.arguments, place.forces] = 0.0
            if np.abs(S[place.arguments]).max(initial=0.0) <= UNMOVED * np.abs(w.X[place.arguments]).max(initial=0.0):
                S[place.arguments] = 0.0
    rests, roots = _alone(geometry, S, kept, moving, needed)
    return NonlinearReduction(
        model=model,
        geometry=geometry,
        linear=linear,
        moving=tuple(moving),
        slopes=tuple(kept),
        rests=rests,
        roots=roots,
        answers=answers_of(geometry, S, kept, moving, roots),
        A=linear.A,
        B=linear.B[:, :m],
        B_d=linear.B[:, m:],
        X_w=w.X,
        U_w=w.direct(m + a)[:, :m],
        G=geometry.joined(kept),
        output=Signal(output.X[:rows], tuple([part[:rows] for part in output.U])),
        made_by_elements=made_by_elements(base, geometry, linear.partition),  # type: ignore[arg-type]
    )


reduced.register(NonlinearModel, reduce_nonlinear)


def _linear_part(
    base: SecondOrderModel, geometry: Geometry, slopes: list[FloatArray]
) -> tuple[ExactReduction, Signal, Signal]:
    """Reduce the model with tangents, the inputs (u, d) and the outputs (y, w)."""
    tangent = geometry.with_slopes(base, slopes)
    n, a, r = len(base.dofs), geometry.E.shape[1], geometry.L_q.shape[0]
    m, p = len(base.inputs), len(base.outputs)
    no_force, still = np.zeros((n, a)), np.zeros((r, n))
    inner = [
        f"force of {place.words}" for place in geometry.places for _ in range(place.forces.start, place.forces.stop)
    ]
    fed: dict[str, Any] = {
        letter: read_only(np.block([[getattr(base, letter), block], [np.zeros((r, m + a))]]))
        for letter, block in (("D", -geometry.R), ("Dv", np.zeros((p, a))), ("Da", np.zeros((p, a))))
    }
    wide = replace(
        tangent,
        B=read_only(np.hstack([base.B, geometry.E])),
        Bv=read_only(np.hstack([base.Bv, no_force])),
        Ba=read_only(np.hstack([base.Ba, no_force])),
        F=read_only(np.vstack([tangent.F, geometry.L_q])),
        G=read_only(np.vstack([tangent.G, geometry.L_v])),
        H=read_only(np.vstack([base.H, still])),
        **fed,
        inputs=(*base.inputs, *[f"{name} [{i}]" for i, name in enumerate(inner)]),
        outputs=(*base.outputs, *[f"w[{i}]" for i in range(r)]),
    )
    linear = exact_reduction(wide)
    if linear.method == "deflation":
        words = listed([place.words for place in geometry.places])
        msg = (
            f"With {words} the model is of index {linear.index}, and a nonlinear model must be of index 1. "
            "Eliminate the "
            "constraint."
        )
        raise LawError(msg, element=words, dofs=base.dofs)
    output = linear.output
    improper = [i for part in output.U[1:] for i in np.flatnonzero(part[p:].any(axis=1)).tolist()]
    if improper:
        place = next(one for one in geometry.places if one.arguments.start <= improper[0] < one.arguments.stop)
        msg = (
            f"{place.words} follows the derivative of an input: it sits on {listed(place.dofs)}, whose motion "
            "jumps with the "
            "input. Prescribe the acceleration instead of the displacement, or filter the input."
        )
        raise ImproperError(msg, pairs=tuple([(name, place.words, 1) for name in base.inputs]))
    return linear, output, Signal(output.X[p:], output.U[:1] and (output.U[0][p:],))


def _moves_itself(S: FloatArray, G: FloatArray, place: Place) -> bool:
    """Tell whether an element's own force changes its own variables at once."""
    return float(np.abs(S[place.arguments, place.forces] @ G).max(initial=0.0)) > UNMOVED


def _alone(
    geometry: Geometry,
    S: FloatArray,
    slopes: list[FloatArray],
    moving: list[bool],
    needed: list[bool],
) -> tuple[dict[int, float], dict[int, Root]]:
    """Find 1/S - G and the root of (N4) for every spring or damper that stands alone."""
    rests: dict[int, float] = {}
    roots: dict[int, Root] = {}
    for group in components(geometry, S, moving):
        k = group[0]
        place = geometry.places[k]
        if len(group) > 1 or not place.is_scalar:
            continue
        own, g = float(S[place.arguments.start, place.forces.start]), float(slopes[k][0, 0])
        rest = 1.0 / own - g
        if needed[k] or abs(rest) <= LEAST_REST * g:
            rest = 0.0
        law = place.element.law  # type: ignore[union-attr]
        whole = law.beside(rest) if law.beside is not None else law  # type: ignore[union-attr]
        if own <= 0.0 or (rest < 0.0 and not (law.beside is not None and judged(whole).answers_all)):  # type: ignore[union-attr,arg-type]
            msg = (
                f"{place.words} is solved for beside a stiffness or damping of {rest:.3g}, which is negative: "
                "several motions "
                "may answer the same force. Give the DOF a mass, or take the negative part into the law."
            )
            raise LawError(msg, element=place.words, dofs=place.dofs)
        rests[k], roots[k] = rest, root_of(law, rest)  # type: ignore[arg-type]
    return rests, roots


def no_answer(reduction: NonlinearReduction, cause: UnansweredError, t: float, x: FloatArray) -> NoAnswerError:
    """Make the refusal of a force that found no answer: when, where, how large, and the state reached."""
    place, force = cause.place, cause.force
    dofs = place.dofs
    what = "its law gives NaN or Inf" if not np.isfinite(force) else f"a force of {force:.6g} N has no answering motion"
    shown = listed([f"{name} = {value:.6g}" for name, value in zip(reduction.states, x.tolist(), strict=True)])
    msg = (
        f"At t = {t:.6g} s {place.words} on {listed(dofs)} stops the run: {what}. State reached: {shown}. See "
        "whether the law "
        "is bounded, falls, or is known only within its table there."
    )
    return NoAnswerError(
        msg, element=place.words, dofs=dofs, time=float(t), force=float(force), state=tuple(x.tolist())
    )
