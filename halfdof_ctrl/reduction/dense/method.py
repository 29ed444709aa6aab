"""The methods by one dense solve of (3): a selection of DOFs, or orthonormal bases of null spaces."""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import scipy.linalg

from halfdof_ctrl.base.arrays import EPS, ComplexArray, FloatArray, has_even_entries, is_zero
from halfdof_ctrl.base.errors import SingularLeadingMatrixError
from halfdof_ctrl.base.names import listed
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.model.singular import NULL_VECTOR_SHARE
from halfdof_ctrl.reduction.algebra.integers import has_short_entries
from halfdof_ctrl.reduction.algebra.leading_matrix import FEW_DOFS, SINGULAR_RCOND, SURELY_REGULAR, LeadingMatrix
from halfdof_ctrl.reduction.algebra.scaling import max_scaling, unit_free_scaling
from halfdof_ctrl.reduction.dense.bases import orthonormal_bases
from halfdof_ctrl.reduction.dense.partition import DofPartition
from halfdof_ctrl.reduction.dense.selection import select_columns
from halfdof_ctrl.reduction.dense.single_solve import (
    leading_columns,
    plain_rounding,
    rounding_of_solve,
    solved_at_once,
)
from halfdof_ctrl.reduction.method.evidence import ALLOWED_LOSS, CLOSE_GAP, Evidence, RankDecision
from halfdof_ctrl.reduction.method.from_equations import FromEquations
from halfdof_ctrl.reduction.method.loss import (
    ASKED_STATES,
    NOTHING_LOST,
    SAVED,
    SPREAD,
    TEN_TIMES_DATA,
    Loss,
    loss_of,
    measured,
    measured_loss,
)
from halfdof_ctrl.reduction.method.loss_bound import (
    is_bounded,
    is_well_conditioned,
    loses_nothing,
    reads_rates_of_massless,
)
from halfdof_ctrl.reduction.method.masses import spread_is_wide
from halfdof_ctrl.reduction.method.proof import expected_loss, has_spectrum
from halfdof_ctrl.reduction.method.protocol import MethodName
from halfdof_ctrl.reduction.method.refined_answers import Solver, StateSolver
from halfdof_ctrl.reduction.method.signals import Rounding, Signal, output_signal

ENTRY_ROUNDING = 4 * EPS  #: what an entry of A is known to, of the terms that it came from
LOSS_LOOKED_AT = 1e-12  #: other coordinates are tried only where that much is lost indeed, whatever the bound says


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class SingleSolve(FromEquations):
    """A reduction by one dense solve of (3): a `ReductionMethod`."""

    coordinates: DofPartition
    leading: LeadingMatrix  #: W of equation (2), factorized
    loss: Loss = NOTHING_LOST  #: measured where W asks for it

    @property
    def name(self) -> MethodName:
        """`selection` or `orthogonal`."""
        return self.coordinates.method

    @property
    def evidence(self) -> Evidence:
        """What the states rest on."""
        rcond, n = self.leading.rcond, len(self.model.dofs)
        return Evidence(
            decisions=self.coordinates.evidence,
            light=self.coordinates.light,
            rcond=rcond,
            loss=self.loss,
            hardly=rcond < CLOSE_GAP * n * SINGULAR_RCOND,
        )

    def index(self) -> int:
        """Return 1 where there are static coordinates, else 0."""
        return int(self.coordinates.n_static > 0)

    def output(self, model: SecondOrderModel) -> Signal:
        """Return the outputs of a model that differs in them alone."""
        return output_signal(model, self.equations, self._rounding)

    def without_rounding(self) -> FloatArray:
        """Return A with zeros for entries that may be rounding of zero."""
        return np.where(np.abs(self.A) <= 2.0 * ENTRY_ROUNDING * self._terms(), 0.0, self.A)

    def rounding_sizes(self) -> FloatArray:
        """Return what the rounding errors of the entries of A are relative to."""
        return np.maximum(np.abs(self.A), self._terms())

    def _terms(self) -> FloatArray:
        """Return the sizes of the sums that the lower rows of A are.

        An entry of the solution ``W^-1 R`` of (3) is known to ``u |W^-1| (|W| |W^-1| |R| + |R|)`` times a small number.
        """
        model, part = self.model, self.coordinates
        n_i, moving = part.n_inertial, part.n_inertial + part.n_half
        size = np.abs(leading_columns(model, part))
        inverse = np.abs(self.leading.solve(np.eye(len(size))))
        right = np.abs(np.hstack([part.times_basis(model.K, 0, moving), part.times_basis(model.C, 0, n_i)]))
        sums = (inverse @ (size @ (inverse @ right) + right)) / 2.0
        return np.vstack([np.zeros((n_i, sums.shape[1])), sums[n_i:moving], sums[:n_i]])

    def decisions(self) -> tuple[RankDecision, ...]:
        """Return the decisions of the coordinates and the singular values of W."""
        values = self.leading.singular_values()
        bound = len(values) * SINGULAR_RCOND * float(values.max(initial=0.0))
        regular = RankDecision(matrix="W", dofs=self.model.dofs, singular_values=values, rank=values.size, bound=bound)
        return (*self.coordinates.evidence, regular)

    def answers(self, states: StateSolver) -> Solver:
        """Return what gives the response of all DOFs to forces, by the factors of W."""
        return partial(self._answer, states)

    def _answer(self, states: StateSolver, force: ComplexArray) -> ComplexArray:
        part, both = self.coordinates, np.hstack([force.real, force.imag])
        real, imag = np.hsplit(self.leading.solve(np.asfortranarray(both)), 2)
        n_i, moving = part.n_inertial, part.n_inertial + part.n_half
        solved = real + 1j * imag
        rate = np.concatenate([np.zeros_like(solved[:n_i]), solved[n_i:moving], solved[:n_i]])
        moved = self.equations.displacement.X @ states.solve(rate)
        return np.asarray(moved + part.from_static(solved[moving:]) if part.n_static else moved)

    def inverse_rows(self) -> FloatArray:
        """Return gamma and alpha."""
        moving = self.coordinates.n_inertial + self.coordinates.n_half
        return self.leading.solve(np.eye(len(self.model.dofs)))[:moving]

    def _rounding(self) -> Rounding:
        return rounding_of_solve(self.model, self.coordinates, self.leading, self.equations)


def by_selection(model: SecondOrderModel, tol: float | None, *, asked: bool) -> SingleSolve | None:
    """Propose a selection of DOFs and prove it; None if it fails and was not asked for.

    Raises
    ------
    SingularLeadingMatrixError
        It was asked for, and W is singular to working precision.
    """
    return _proved(model, select_columns(model, tol), tol, asked=asked, proof_above=SURELY_REGULAR)


def by_bases(model: SecondOrderModel, tol: float | None, *, asked: bool) -> SingleSolve | None:
    """Propose orthonormal bases and prove them; None if they fail and were not asked for.

    Bases of null spaces rest on rank decisions, so that (19) has to hold whatever the condition of W.

    Raises
    ------
    SingularLeadingMatrixError
        They were asked for, and W is singular to working precision.
    """
    return _proved(model, orthonormal_bases(model, tol), tol, asked=asked, proof_above=np.inf)


def _proved(
    model: SecondOrderModel, coordinates: DofPartition, tol: float | None, *, asked: bool, proof_above: float
) -> SingleSolve | None:
    """Solve (3) and prove it, by equation (19) unless rcond(W) is above a limit; None if either fails."""
    found = _solved(model, coordinates, asked=asked)
    if found is None:
        return None
    settled = asked or tol is not None or found.leading.rcond > proof_above
    return _chosen(found, tol, asked=asked) if settled or has_spectrum(model, found.A) else None


def _solved(model: SecondOrderModel, coordinates: DofPartition, *, asked: bool = False) -> SingleSolve | None:
    """Solve (3); None if W is singular and the coordinates were not asked for."""
    W = leading_columns(model, coordinates)
    leading = LeadingMatrix.factorized(W)
    if leading.is_singular:
        if asked:
            raise _singular_error(model, coordinates, W, leading)
        return None
    equations = solved_at_once(model, coordinates, leading)
    even = len(equations.A) <= ASKED_STATES and is_well_conditioned(equations.A)
    return SingleSolve(model=model, coordinates=coordinates, leading=leading, equations=equations, is_even=even)


def _chosen(found: SingleSolve, tol: float | None, *, asked: bool) -> SingleSolve:
    """Measure what is lost, and take other coordinates if these keep it.

    Nothing worth a look is lost where the columns of a plainly regular W are those of M, C and K themselves and the
    states are even.
    """
    if tol is not None or _loses_nothing(found):
        return found
    measurement = measured(found)
    known = replace(found, loss=loss_of(measurement))
    if known.loss.value > ALLOWED_LOSS and _is_ordinary(found):
        return replace(found, loss=loss_of(measurement, allowed=TEN_TIMES_DATA))
    if asked or known.loss.value < LOSS_LOOKED_AT:
        return known
    better = _in_better_coordinates(found)
    return known if better is None else replace(better, loss=measured_loss(better))


def _loses_nothing(found: SingleSolve) -> bool:
    part = found.coordinates
    if not found.leading.is_plainly_regular or part.basis is not None:
        return False
    if len(found.A) <= ASKED_STATES:
        few = len(found.model.dofs) <= FEW_DOFS  # of more, a measurement takes several reductions
        may_cancel = few and part.n_static > 0 and len(found.A) > 0  # what static DOFs leave of K, to rounding
        nothing = not may_cancel and loses_nothing(found.model, found.equations, even=found.is_even)
        return nothing or _is_bounded(found)
    massless, static = part.order[part.n_inertial :], part.order[part.n_inertial + part.n_half :]
    if reads_rates_of_massless(found.model, massless, static):
        return False
    inertial = np.ones(len(found.model.dofs), dtype=np.bool_)
    inertial[massless] = False
    return not spread_is_wide(found.model, inertial)


def _is_bounded(found: SingleSolve) -> bool:
    """Return whether a bound of rounding excludes a loss, for ordinary displacements and velocities as outputs."""
    model, equations = found.model, found.equations
    if not len(found.A) or equations.shift or not is_zero(model.H):
        return False
    if not all(has_even_entries(part) for part in model.quadratics.P):
        return False
    errors = plain_rounding(found.coordinates, found.leading, equations)
    return is_bounded(model, equations, found.output(model), errors)


def _is_ordinary(found: SingleSolve) -> bool:
    """Return whether M, C and K are those of an ordinary structure in odd units, which lets no more digits be lost.

    Entries that were not rounded leave nothing open.
    """
    if not found.leading.is_plainly_regular or found.coordinates.basis is not None:
        return False
    if all(has_short_entries(part) for part in found.model.quadratics.P):
        return False
    return all(has_even_entries(unit_free_scaling(part).of(part)) for part in found.model.quadratics.P if part.any())


def _in_better_coordinates(found: SingleSolve) -> SingleSolve | None:
    """Give directions of little mass coordinates of their own, where that keeps digits that DOFs lose.

    That is decided by bounds and not by what was measured, so that the choice is the same in any units.
    """
    model, lost = found.model, expected_loss(found.model, found.equations)
    if lost <= ALLOWED_LOSS:
        return None
    other = _solved(model, orthonormal_bases(model, widest=SPREAD))
    if other is None or len(other.A) != len(found.A) or expected_loss(model, other.equations) > SAVED * lost:
        return None
    return other


def _singular_error(
    model: SecondOrderModel, partition: DofPartition, W: FloatArray, leading: LeadingMatrix
) -> SingularLeadingMatrixError:
    """Make the refusal of a singular W, naming the DOFs of its null vector."""
    _, _, right = scipy.linalg.svd(max_scaling(W).of(W))
    null = np.abs(right[-1])
    concerned = partition.T[:, null > NULL_VECTOR_SHARE * null.max()].any(axis=1)
    dofs = tuple([model.dofs[index] for index in np.flatnonzero(concerned).tolist()])
    msg = (
        f"The leading matrix W = [M T_i, C T_c, K T_k] is singular to working precision (rcond {leading.rcond:.1e}, "
        f"by {partition.method}): the equations of motion do not determine the highest derivatives of DOFs "
        f"{listed(dofs)}. Either a rigid constraint or an algebraic loop of dampers or springs ties them (index "
        "above one), or nothing resists their motion; pencil_structure tells which. Leave method out, so that "
        "deflation is tried, or give them the mass, damper or spring that the model left out."
    )
    return SingularLeadingMatrixError(msg, dofs=dofs, rcond=leading.rcond)
