"""The method by deflation, for any regular pencil: scale, relax, realize, prove.

Decisions at the edge of rounding can be wrong. A deflation is taken only if it passes equation (19); where it
does not, or where a pencil is called singular whose P(s) is not, the decisions are taken again with more or less
caution about rounding errors, and with none at all in exact arithmetic. If none passes, the model is refused. A small
model whose numbers were not rounded is not called singular if these are regular, however nearly they cancel.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from halfdof_ctrl.base.arrays import (
    EPS,
    DenseMatrix,
    FloatArray,
    IndexArray,
    read_only,
    unit_matrix,
    zero_matrix,
)
from halfdof_ctrl.base.errors import SingularLeadingMatrixError, SingularPencilError, UncertainRankError
from halfdof_ctrl.base.names import listed
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.model.singular import causes, null_spaces, singular_pencil_error
from halfdof_ctrl.reduction.algebra.integers import LARGEST_EXACT, has_short_entries
from halfdof_ctrl.reduction.deflation.exact_rows import ExactRows
from halfdof_ctrl.reduction.deflation.exact_solution import solved_without_rounding
from halfdof_ctrl.reduction.deflation.offsets import Offsets
from halfdof_ctrl.reduction.deflation.realization import Realization, in_model_units, realized, rounding_in_model_units
from halfdof_ctrl.reduction.deflation.relaxation import BlockDecision, Relaxed, relaxed
from halfdof_ctrl.reduction.deflation.row_system import Caution, RowSystem
from halfdof_ctrl.reduction.deflation.states import StateSelection
from halfdof_ctrl.reduction.method.doubted_singular import is_apart_from_singular, not_singular_error
from halfdof_ctrl.reduction.method.evidence import ALLOWED_LOSS, Evidence, RankDecision
from halfdof_ctrl.reduction.method.exact_order import exact_order
from halfdof_ctrl.reduction.method.from_equations import FromEquations
from halfdof_ctrl.reduction.method.loss import Loss, measured_loss
from halfdof_ctrl.reduction.method.masses import without_light_masses
from halfdof_ctrl.reduction.method.proof import NEAR_POINTS, ScaledPencil, scaled_pencil
from halfdof_ctrl.reduction.method.protocol import MethodName
from halfdof_ctrl.reduction.method.refined_answers import Solver, StateSolver, scaled_pencil_solver
from halfdof_ctrl.reduction.method.signals import Rounding, Signal, output_signal, without_rounding
from halfdof_ctrl.reduction.method.units import Units

CAUTIONS = (Caution(24.0, 3.0), Caution(6.0, 0.4), Caution(150.0, 30.0))  #: tried in turn
AS_GIVEN = Caution(0.0, 0.0)  #: entries are what they are to the last digit
DERIVATIVE_ROUNDING = 256 * EPS  #: of the largest response to an input: less of its derivatives is rounding ...
DERIVATIVE_NOISE = 30.0  #: ... and below this times the error that was measured
TRUSTED_ERROR = 1e-8  #: of the response: measured errors above it do not say what is rounding


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Deflation(FromEquations):
    """A reduction by deflation: a `ReductionMethod`."""

    coordinates: StateSelection
    rounding: Rounding
    evidence: Evidence  #: `rcond` is the smallest of the square systems (18)
    tol: float | None

    @property
    def name(self) -> MethodName:
        """`deflation`."""
        return "deflation"

    def index(self) -> int:
        """Return the index of the pencil (8) from the growth of its inverse.

        With ``[1, s M]`` as forces and ``[1; s M]`` as outputs of P(s)^-1, less the identity that belongs to the mass,
        the transfer function grows as the inverse of (8) does.
        """
        probe = _probe(self.model if self.tol is None else without_light_masses(self.model, self.tol))
        result = deflated(probe, self.tol)
        grown = output_signal(probe, result.equations, lambda: result.rounding)
        return len(without_rounding(probe, grown, result.rounding).U)

    def output(self, model: SecondOrderModel) -> Signal:
        """Return the outputs of a model that differs in them alone."""
        return output_signal(model, self.equations, lambda: self.rounding)

    def without_rounding(self) -> FloatArray:
        """Return A as it is: what of it is rounding is not followed entry by entry."""
        return self.A

    def rounding_sizes(self) -> FloatArray:
        """Return the sizes of the entries of A."""
        return np.abs(self.A)

    def decisions(self) -> tuple[RankDecision, ...]:
        """Return the decisions about blocks of J, equation (16)."""
        return self.evidence.decisions

    def answers(self, states: StateSolver) -> Solver:
        """Return what gives the response of all DOFs to forces."""
        return scaled_pencil_solver(self.model, states.points)

    def inverse_rows(self) -> FloatArray:
        """Refuse: W is singular.

        Raises
        ------
        SingularLeadingMatrixError
        """
        msg = "W of equation (2) is singular, so that alpha and gamma, the rows of its inverse, do not exist."
        raise SingularLeadingMatrixError(msg, dofs=(), rcond=0.0)


def by_deflation(model: SecondOrderModel, tol: float | None) -> Deflation:
    """Propose deflations and prove them.

    Raises
    ------
    SingularPencilError
        ``det P(s)`` vanishes identically.
    UncertainRankError
        No decision about ranks leads to state equations with the spectrum of P(s).
    """
    if tol is not None:
        return replace(deflated(without_light_masses(model, tol), tol), model=model)
    try:
        found = deflated(model)
    except SingularPencilError as refusal:
        uncertain = not_singular_error(model, refusal)
        if uncertain is None:
            raise
        raise uncertain from refusal
    return replace(found, evidence=replace(found.evidence, loss=measured_loss(found)))


def deflated(model: SecondOrderModel, tol: float | None = None) -> Deflation:
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
    best: Deflation | None = None
    decisions: list[BlockDecision] = []
    for found in _proposals(model, tol, decisions):
        if found.evidence.loss.value <= ALLOWED_LOSS or tol is not None:
            return found
        if best is None or found.evidence.loss.value < best.evidence.loss.value:
            best = found
    if best is None:
        raise _uncertain_error(model, decisions, tol)
    return best


def _proposals(model: SecondOrderModel, tol: float | None, decisions: list[BlockDecision]) -> Iterator[Deflation]:
    """Yield deflations that pass (19), or any where `tol` was given, with the decisions of the last one."""
    rows, units, pencil = scaled_pencil(model)
    system = RowSystem.scaled(rows)
    found_before = barely = False
    for tried, caution in _ways(system, exactly=tol is None and system.size <= LARGEST_EXACT):
        if found_before and not isinstance(tried, ExactRows):
            return  # other cautions do not bring back digits
        relaxation = relaxed(tried, caution, tol)
        decisions[:] = relaxation.decisions
        if relaxation.offsets is None:
            if not found_before and not barely and pencil.is_singular():
                exact = exact_order(model)
                if exact == -1 or (exact is None and not is_apart_from_singular(pencil.P)):
                    raise _singular_error(model, pencil)
                barely = True
            continue
        result, certified = _realized(relaxation, relaxation.offsets, caution, pencil)
        if certified or tol is not None:
            given = _in_model_units(model, tol, relaxation, result, units, pencil)
            yield replace(given, evidence=replace(given.evidence, altered=not certified, barely=barely))
            found_before = True


def _realized(
    relaxation: Relaxed, offsets: Offsets, caution: Caution, pencil: ScaledPencil
) -> tuple[Realization, bool]:
    """Solve (18) and tell whether the spectrum is that of P(s), by exact arithmetic or by (19)."""
    result, certain = realized(relaxation.system, offsets, caution), False
    if isinstance(relaxation.system, ExactRows):
        result = solved_without_rounding(result, relaxation.system)
        certain = relaxation.system.exact
    q = result.equations.displacement
    is_solved = all(np.isfinite(part).all() for part in (q.X, *q.U))
    return result, is_solved and (certain or pencil.has_spectrum(result.equations.A))


def _ways(system: RowSystem, *, exactly: bool) -> Iterator[tuple[RowSystem, Caution]]:
    """Return the arithmetic and the caution to be tried in turn."""
    rows = ExactRows.of(system) if exactly else None
    if rows is not None and not rows.exact:  # numbers like 0.1: what cancels leaves rounding in any arithmetic
        yield system, CAUTIONS[0]
    if rows is not None:
        yield rows, CAUTIONS[0]
        yield replace(rows, exact=has_short_entries(rows.coefficients)), AS_GIVEN
    for caution in CAUTIONS:
        yield system, caution


def _in_model_units(
    model: SecondOrderModel,
    tol: float | None,
    relaxation: Relaxed,
    result: Realization,
    units: Units,
    pencil: ScaledPencil,
) -> Deflation:
    losses = pencil.losses(result.equations)
    known_to = np.maximum(
        losses.size, DERIVATIVE_NOISE / DERIVATIVE_ROUNDING * np.minimum(losses.error, TRUSTED_ERROR * losses.size)
    )
    counts = [] if relaxation.offsets is None else relaxation.offsets.equations.tolist()
    return Deflation(
        model=model,
        coordinates=StateSelection(
            dofs=model.dofs,
            places=result.states,
            differentiations={model.dofs[i]: int(count) for i, count in enumerate(counts) if count > 0},
        ),
        equations=in_model_units(result, units),
        rounding=rounding_in_model_units(result, units, known_to, DERIVATIVE_ROUNDING),
        evidence=Evidence(
            decisions=tuple([_decision(model, decision) for decision in relaxation.decisions]),
            rcond=result.rcond,
            loss=Loss(losses.worst, losses.worst),
        ),
        tol=tol,
    )


def _decision(model: SecondOrderModel, decision: BlockDecision) -> RankDecision:
    return RankDecision(
        matrix="J",
        dofs=_names(model, decision.unknowns),
        singular_values=decision.singular_values,
        rank=decision.rank,
        bound=decision.bound,
        noise=decision.noise,
    )


def _names(model: SecondOrderModel, places: IndexArray) -> tuple[str, ...]:
    return tuple([model.dofs[index] for index in places.tolist()])


def _singular_error(model: SecondOrderModel, pencil: ScaledPencil) -> SingularPencilError:
    null = null_spaces(pencil.at(NEAR_POINTS[0])[0])
    return singular_pencil_error(
        dofs=_names(model, np.array(sorted(frozenset().union(*null.unknowns)), dtype=np.intp)),
        equations=_names(model, np.array(sorted(frozenset().union(*null.equations)), dtype=np.intp)),
        fact="to working precision",
        causes=causes(null, model.quadratics.P, model.dofs),
    )


def _uncertain_error(
    model: SecondOrderModel, decisions: Sequence[BlockDecision], tol: float | None
) -> UncertainRankError:
    closest = min((_decision(model, decision) for decision in decisions), key=lambda item: item.gap, default=None)
    dofs = model.dofs if closest is None else closest.dofs
    gap = float("inf") if closest is None else closest.gap
    values = "" if closest is None else f" ({_values_in_words(closest)})"
    rest = f"with tol={tol:g} nothing is left of an equation" if tol is not None else "the order cannot be told"
    msg = (
        f"No decision about ranks gives state equations with the spectrum of P(s): to working precision {rest}. The "
        f"closest decision is about DOFs {listed(dofs)}{values}. Check their masses, "
        "dampers, springs and constraints for entries that nearly cancel, or pass "
        f"{'tol' if tol is None else 'another tol'} to say which count as zero."
    )
    return UncertainRankError(msg, dofs=dofs, gap=gap)


def _values_in_words(decision: RankDecision) -> str:
    """Say how the values on both sides of a decision stand to each other and to rounding."""
    values, rank = decision.singular_values, decision.rank
    counts = f"{values[rank - 1]:.1e} counts" if rank else "none counts"
    zero = f"{values[rank]:.1e} does not" if rank < values.size else "all do"
    return (
        f"of singular values up to {values.max(initial=0.0):.1e}, {counts} and {zero}; rounding of the entries "
        f"explains {min(decision.noise, decision.bound):.1e}"
    )


def _probe(model: SecondOrderModel) -> SecondOrderModel:
    """Return the model whose transfer function grows as the inverse of the first-order pencil does."""
    unit, zero = unit_matrix(len(model.M)), zero_matrix(*model.M.shape)
    return replace(
        model,
        B=_beside(unit, zero),
        Bv=_beside(zero, model.M),
        Ba=_beside(zero, zero),
        F=_beside(unit, zero).T,
        G=_beside(zero, model.M.T).T,
        H=_beside(zero, zero).T,
        D=np.block([[zero, zero], [zero, -model.M]]),
        Dv=np.zeros((2 * len(model.M), 2 * len(model.M))),
        Da=np.zeros((2 * len(model.M), 2 * len(model.M))),
    )


def _beside(left: DenseMatrix, right: DenseMatrix) -> DenseMatrix:
    return read_only(np.hstack([left, right]))
