"""The whole road for any regular pencil: scale, relax, realize, certify.

Decisions at the edge of rounding can be wrong. A deflation is taken only if it passes equation (19); where it
does not, or where a pencil is called singular whose P(s) is not, the decisions are taken again with more or less
caution about rounding errors. If none passes, the model is refused.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from halfdof_ctrl.base.arrays import FloatArray
from halfdof_ctrl.reduction.method.proof import NEAR, ScaledPencil
from halfdof_ctrl.reduction.deflation.realization import Realization, in_model_units, realized, rounding_in_model_units
from halfdof_ctrl.base.errors import SingularPencilError, UncertainRankError
from halfdof_ctrl.reduction.deflation.exact_rows import ExactRows
from halfdof_ctrl.reduction.deflation.exact_solution import solved_without_rounding
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.base.names import derivative_name, listed
from halfdof_ctrl.model.singular import causes, null_spaces
from halfdof_ctrl.reduction.deflation.offsets import IndexArray, Offsets
from halfdof_ctrl.reduction.dense.partition import RankDecision
from halfdof_ctrl.model.refusals import singular_pencil_error
from halfdof_ctrl.reduction.deflation.relaxation import BlockDecision, Relaxed, relaxed
from halfdof_ctrl.reduction.deflation.row_system import EPS, Caution, RowSystem, Units, scaled_rows
from halfdof_ctrl.reduction.method.signals import Rounding, Signal, StateEquations
from halfdof_ctrl.base.spectrum import balanced

CAUTIONS = (Caution(24.0, 3.0), Caution(6.0, 0.4), Caution(150.0, 30.0))  #: tried in turn
AS_GIVEN = Caution(0.0, 0.0)  #: entries are what they are to the last digit
ENOUGH = 1e-9  #: lost by floating point, above which exact row operations are tried as well
LARGEST_EXACT = 60  #: equations up to which row operations are exact
ROUNDING = 256 * EPS  #: of the largest response to an input: coefficients of its derivatives below are rounding ...
NOISE = 30.0  #: ... and below this times the error that was measured
TRUSTED = 1e-8  #: of the response: measured errors above it do not say what is rounding


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class StateSelection:
    """The states of a deflated model: displacements, velocities and, rarely, higher derivatives of DOFs."""

    dofs: tuple[str, ...]  #: names of the n DOFs
    places: tuple[tuple[int, int], ...]  #: (DOF, order of the derivative) of each state
    differentiations: dict[str, int]  #: how often the equation of a DOF was differentiated, if at all
    evidence: tuple[RankDecision, ...]  #: blocks of J, equation (16)

    @property
    def method(self) -> Literal["deflation"]:
        """The road."""
        return "deflation"

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the states."""
        return tuple([derivative_name(self.dofs[j], order, self.dofs) for j, order in self.places])

    @property
    def inertial(self) -> tuple[str, ...]:
        """DOFs with two states or more."""
        return tuple([dof for dof, count in zip(self.dofs, self._counts(), strict=True) if count > 1])

    @property
    def half(self) -> tuple[str, ...]:
        """DOFs with one state."""
        return tuple([dof for dof, count in zip(self.dofs, self._counts(), strict=True) if count == 1])

    @property
    def static(self) -> tuple[str, ...]:
        """DOFs without a state: they follow from the others and the inputs."""
        return tuple([dof for dof, count in zip(self.dofs, self._counts(), strict=True) if count == 0])

    def kinds_of(self, dofs: tuple[str, ...]) -> dict[str, str]:
        """Tell for each of the model's DOFs with less than two states whether it is half or static."""
        return {dof: "half" if dof in self.half else "static" for dof in dofs if dof not in self.inertial}

    def state_of(self, displacements: FloatArray, velocities: FloatArray) -> FloatArray:
        """Give the states that belong to displacements and velocities of all n DOFs; higher derivatives are zero."""
        from_q, from_v = self.state_maps()[:2]
        return np.asarray(from_q @ displacements + from_v @ velocities)

    def state_maps(self) -> tuple[FloatArray, ...]:
        """Give L_q, L_v, ..., (N, n) each, of x = L_q q + L_v q' + ..."""
        maps = np.zeros((max([order for _, order in self.places], default=0) + 2, len(self.places), len(self.dofs)))
        for index, (j, order) in enumerate(self.places):
            maps[order, index, j] = 1.0
        return tuple(maps[: max(2, len(maps) - 1)])

    def _counts(self) -> list[int]:
        return [int(count) for count in np.bincount([j for j, _ in self.places], minlength=len(self.dofs))]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Deflated:
    """A model after deflation."""

    selection: StateSelection
    equations: StateEquations
    rounding: Rounding
    rcond: float  #: smallest reciprocal condition number of the square systems (18)
    loss: float  #: what the state equations lose against a direct solve, relative to the largest entry
    certified: bool  #: whether (19) holds, as it need not where `tol` was given


def has_spectrum(model: SecondOrderModel, A: FloatArray) -> bool:
    """Tell by equation (19) whether A, from whatever road, has the finite eigenvalues of a model, each as often."""
    _, units, pencil = _scaled(model)
    return pencil.has_spectrum(balanced(np.asarray(A / units.time)))


def loss(model: SecondOrderModel, equations: StateEquations) -> float:
    """Measure what state equations, from whatever road, lose against direct solves."""
    pencil, scaled = _in_scaled_units(model, equations)
    return pencil.losses(scaled).worst


def expected_loss(model: SecondOrderModel, equations: StateEquations) -> float:
    """Bound what state equations, from whatever road, lose by being rounded."""
    pencil, scaled = _in_scaled_units(model, equations)
    return pencil.expected_loss(scaled)


def _in_scaled_units(model: SecondOrderModel, equations: StateEquations) -> tuple[ScaledPencil, StateEquations]:
    _, units, pencil = _scaled(model)
    q, across = equations.displacement, units.inputs / units.columns[:, None]
    scaled = StateEquations(
        A=np.asarray(equations.A / units.time),
        B=equations.B * units.inputs / units.time,
        displacement=Signal(
            q.X / units.columns[:, None], tuple([units.by_time(part * across, k) for k, part in enumerate(q.U)])
        ),
        shift=(),
    )
    return pencil, scaled


def _scaled(model: SecondOrderModel) -> tuple[RowSystem, Units, ScaledPencil]:
    system, units = scaled_rows(np.stack([model.K, model.C, model.M]), np.stack([model.B, model.Bv, model.Ba]))
    powers = np.arange(3)[:, None, None]
    pencil = ScaledPencil(
        P=system.matrix,
        B=system.coefficients[:, :, system.size :],
        F=units.by_time(np.stack([model.F, model.G, model.H]) * units.columns, powers),
        D=units.by_time(np.stack([model.D, model.Dv, model.Da]) * units.inputs, powers),
    )
    return system, units, pencil


def deflated(model: SecondOrderModel, tol: float | None = None) -> Deflated:
    """Reduce any regular model.

    Parameters
    ----------
    model : SecondOrderModel
        A real model.
    tol : float, optional
        Singular values of a scaled block at most `tol` times its largest count as zero; by default what rounding
        makes. With it the result need not pass (19), since it belongs to another model.

    Raises
    ------
    SingularPencilError
        ``det P(s)`` vanishes identically.
    UncertainRankError
        No decision about ranks leads to state equations with the spectrum of P(s).
    """
    system, units, pencil = _scaled(model)
    decisions: tuple[BlockDecision, ...] = ()
    lossy: Deflated | None = None
    exactly = tol is None and system.size <= LARGEST_EXACT
    for rows, caution in _ways(system, exactly=exactly):
        if lossy is not None and not isinstance(rows, ExactRows):
            break
        relaxation = relaxed(rows, caution, tol)
        decisions = relaxation.decisions
        if relaxation.offsets is None:
            if lossy is None and pencil.is_singular():
                raise _singular_error(model, pencil)
            continue
        result, certified = _realized(relaxation, relaxation.offsets, caution, pencil)
        if certified or tol is not None:
            found = _in_model_units(model, relaxation, relaxation.offsets, result, units, pencil)
            if lossy is not None:
                return min(lossy, found, key=lambda item: item.loss)
            if not exactly or isinstance(rows, ExactRows) or found.loss <= ENOUGH:
                return replace(found, certified=certified)
            lossy = found
    if lossy is not None:
        return lossy
    raise _uncertain_error(model, decisions, tol)


def _realized(
    relaxation: Relaxed, offsets: Offsets, caution: Caution, pencil: ScaledPencil
) -> tuple[Realization, bool]:
    """Solve (18) and tell whether the spectrum is that of P(s), by exact arithmetic or by (19)."""
    result, certain = realized(relaxation.system, offsets, caution), False
    if isinstance(relaxation.system, ExactRows):
        result = solved_without_rounding(result, relaxation.system)
        certain = relaxation.system.exact and caution is not AS_GIVEN
    return result, certain or pencil.has_spectrum(result.equations.A)


def _ways(system: RowSystem, *, exactly: bool) -> Iterator[tuple[RowSystem, Caution]]:
    """Give the arithmetic and the caution to be tried in turn."""
    rows = ExactRows.of(system) if exactly else None
    if rows is not None and not rows.exact:  # numbers like 0.1: what cancels leaves rounding in any arithmetic
        yield system, CAUTIONS[0]
    if rows is not None:
        yield rows, CAUTIONS[0]
        yield rows, AS_GIVEN
    for caution in CAUTIONS:
        yield system, caution


def _in_model_units(
    model: SecondOrderModel,
    relaxation: Relaxed,
    offsets: Offsets,
    result: Realization,
    units: Units,
    pencil: ScaledPencil,
) -> Deflated:
    losses = pencil.losses(result.equations)
    known_to = np.maximum(losses.size, NOISE / ROUNDING * np.minimum(losses.error, TRUSTED * losses.size))
    return Deflated(
        selection=StateSelection(
            dofs=model.dofs,
            places=result.states,
            differentiations={
                model.dofs[i]: int(count) for i, count in enumerate(offsets.equations.tolist()) if count > 0
            },
            evidence=tuple([_evidence(model, decision) for decision in relaxation.decisions]),
        ),
        equations=in_model_units(result, units),
        rounding=rounding_in_model_units(result, units, known_to, ROUNDING),
        rcond=result.rcond,
        loss=losses.worst,
        certified=True,
    )


def _evidence(model: SecondOrderModel, decision: BlockDecision) -> RankDecision:
    return RankDecision(
        matrix="J",
        dofs=_names(model, decision.unknowns),
        singular_values=decision.singular_values,
        rank=decision.rank,
        bound=decision.bound,
    )


def _names(model: SecondOrderModel, places: IndexArray) -> tuple[str, ...]:
    return tuple([model.dofs[index] for index in places.tolist()])


def _singular_error(model: SecondOrderModel, pencil: ScaledPencil) -> SingularPencilError:
    null = null_spaces(pencil.at(NEAR[0])[0])
    return singular_pencil_error(
        dofs=_names(model, np.array(sorted(frozenset().union(*null.unknowns)), dtype=np.intp)),
        equations=_names(model, np.array(sorted(frozenset().union(*null.equations)), dtype=np.intp)),
        fact="to working precision",
        causes=causes(null, (model.K, model.C, model.M), model.dofs),
    )


def _uncertain_error(
    model: SecondOrderModel, decisions: tuple[BlockDecision, ...], tol: float | None
) -> UncertainRankError:
    closest = min((_evidence(model, decision) for decision in decisions), key=lambda item: item.gap, default=None)
    dofs = model.dofs if closest is None else closest.dofs
    gap = float("inf") if closest is None else closest.gap
    rest = f"with tol={tol:g} nothing is left of an equation" if tol is not None else "the order cannot be told"
    msg = (
        f"No decision about ranks gives state equations with the spectrum of P(s): to working precision {rest}. The "
        f"closest decision is about DOFs {listed(dofs)} (singular values {gap:.1e} apart). Check their masses, "
        "dampers, springs and constraints for entries that nearly cancel, or pass "
        f"{'tol' if tol is None else 'another tol'} to say which count as zero."
    )
    return UncertainRankError(msg, dofs=dofs, gap=gap)
