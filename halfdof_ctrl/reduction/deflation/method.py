"""The method by deflation, for any regular pencil: scale, relax, realize, prove.

Decisions at the edge of rounding can be wrong. A deflation is taken only if it passes equation (19); where it
does not, or where a pencil is called singular whose P(s) is not, the decisions are taken again with more or less
caution about rounding errors. If none passes, the model is refused.
"""

import warnings
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from halfdof_ctrl.base.arrays import EPS, IndexArray, Matrix, read_only, unit_matrix, zero_matrix
from halfdof_ctrl.base.errors import CloseDecisionWarning, SingularPencilError, UncertainRankError, callers_level
from halfdof_ctrl.base.names import listed
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.model.singular import causes, null_spaces, singular_pencil_error
from halfdof_ctrl.reduction.deflation.exact_rows import ExactRows
from halfdof_ctrl.reduction.deflation.exact_solution import solved_without_rounding
from halfdof_ctrl.reduction.deflation.offsets import Offsets
from halfdof_ctrl.reduction.deflation.realization import Realization, in_model_units, realized, rounding_in_model_units
from halfdof_ctrl.reduction.deflation.relaxation import BlockDecision, Relaxed, relaxed
from halfdof_ctrl.reduction.deflation.row_system import Caution, RowSystem
from halfdof_ctrl.reduction.deflation.states import StateSelection
from halfdof_ctrl.reduction.exact_reduction import ExactReduction
from halfdof_ctrl.reduction.method.evidence import RankDecision, warn_of_close_decisions, warn_of_lost_digits
from halfdof_ctrl.reduction.method.masses import without_light_masses
from halfdof_ctrl.reduction.method.proof import NEAR, ScaledPencil, scaled_pencil
from halfdof_ctrl.reduction.method.signals import Rounding, StateEquations, output_signal, without_rounding
from halfdof_ctrl.reduction.method.units import Units

CAUTIONS = (Caution(24.0, 3.0), Caution(6.0, 0.4), Caution(150.0, 30.0))  #: tried in turn
AS_GIVEN = Caution(0.0, 0.0)  #: entries are what they are to the last digit
ENOUGH = 1e-9  #: lost by floating point, above which exact row operations are tried as well
LARGEST_EXACT = 60  #: equations up to which row operations are exact
ROUNDING = 256 * EPS  #: of the largest response to an input: coefficients of its derivatives below are rounding ...
NOISE = 30.0  #: ... and below this times the error that was measured
TRUSTED = 1e-8  #: of the response: measured errors above it do not say what is rounding


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Deflated:
    """A model after deflation."""

    selection: StateSelection
    equations: StateEquations
    rounding: Rounding
    rcond: float  #: smallest reciprocal condition number of the square systems (18)
    loss: float  #: what the state equations lose against a direct solve, relative to the largest entry
    certified: bool  #: whether (19) holds, as it need not where `tol` was given


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
    system, units, pencil = scaled_pencil(model)
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
    """Return the arithmetic and the caution to be tried in turn."""
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


def by_deflation(model: SecondOrderModel, tol: float | None) -> ExactReduction:
    """Reduce any regular model by deflation."""
    result = deflated(model if tol is None else without_light_masses(model, tol), tol)
    if result.certified:
        warn_of_close_decisions(result.selection.evidence)
        warn_of_lost_digits(result.loss, result.rcond)
    else:
        msg = (
            f"With tol={tol:g} singular values count as zero on which the spectrum depends: the state space is not "
            "that of this model but of one that differs by as much. Pass a smaller tol, unless that is what you mean."
        )
        warnings.warn(msg, CloseDecisionWarning, stacklevel=callers_level())
    return ExactReduction(
        model=model,
        partition=result.selection,
        leading=None,
        equations=result.equations,
        rcond=result.rcond,
        known_rounding=result.rounding,
        tol=tol,
    )


def index_of(reduction: ExactReduction) -> int:
    """Find the index of the pencil (8) from the growth of its inverse.

    With ``[1, s M]`` as forces and ``[1; s M]`` as outputs of P(s)^-1, less the identity that belongs to the mass, the
    transfer function grows as the inverse of (8) does.
    """
    model = reduction.model if reduction.tol is None else without_light_masses(reduction.model, reduction.tol)
    unit, zero = unit_matrix(len(model.M)), zero_matrix(*model.M.shape)
    probe = replace(
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
    result = deflated(probe, reduction.tol)
    grown = output_signal(probe, result.equations, lambda: result.rounding)
    return len(without_rounding(probe, grown, result.rounding).U)


def _beside(left: Matrix, right: Matrix) -> Matrix:
    return read_only(np.hstack([left, right]))
