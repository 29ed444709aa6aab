"""A state space on its way to the user: a word where it is less than the model, or python-control will make it so."""

from dataclasses import dataclass

import control
import numpy as np
from scipy.linalg.lapack import dgetrf

from halfdof_ctrl.base.arrays import EPS, ComplexArray, FloatArray, has_even_entries, is_zero
from halfdof_ctrl.base.spectrum import balanced
from halfdof_ctrl.model.free_motions import FREE_MOTIONS_LARGEST, free_motion_count
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.reduction.algebra.leading_matrix import FEW_DOFS
from halfdof_ctrl.reduction.exact_reduction import ExactReduction
from halfdof_ctrl.reduction.method.evidence import warn_of_lost_digits
from halfdof_ctrl.reduction.method.loss import TEN_TIMES_DATA, loss_of, measured
from halfdof_ctrl.reduction.method.loss_bound import is_well_conditioned
from halfdof_ctrl.reduction.method.loss_points import AT_ORIGIN, over_modes
from halfdof_ctrl.reduction.method.refined_answers import Solver, StateSolver, scaled_pencil_solver
from halfdof_ctrl.reduction.method.signals import Signal, trimmed
from halfdof_ctrl.systems.evaluation_loss import warn_of_evaluation
from halfdof_ctrl.systems.free_motion_warning import warn_of_free_motions
from halfdof_ctrl.systems.state_map import States
from halfdof_ctrl.systems.transfer_check import DEEP

SURE_STATES = 120  #: up to which such a measurement is spared where A is well conditioned
MEASURED_STATES = 1000  #: in energy or modal states, of which it is measured what they lose
NEARLY_NO_PIVOT = 1e6 * EPS  #: of the largest: a smaller one may be what is left of a zero


@dataclass(frozen=True, slots=True, eq=False)
class _HandedOver:
    """A state space as it is handed over, to be measured as a reduction is."""

    model: SecondOrderModel
    A: FloatArray
    B: FloatArray
    signal: Signal  #: outputs, with what no state space has

    def output(self, model: SecondOrderModel) -> Signal:  # noqa: ARG002  # there is no other
        """Return the outputs of the model."""
        return self.signal

    def answers(self, states: StateSolver) -> Solver:
        """Return what gives the response of all DOFs to forces."""
        return scaled_pencil_solver(self.model, states.points)


def warn_of_stored(reduction: ExactReduction, sys: control.StateSpace) -> None:
    """Warn of what the numbers of a state space lose that is not in the states of its reduction.

    Parameters
    ----------
    reduction : ExactReduction
        Of the model that it was made of.
    sys : control.StateSpace
        As it is handed to the user.

    Warns
    -----
    LostDigitsWarning
    """
    model = reduction.model
    even = not _cancels(model, sys) and sys.nstates <= SURE_STATES and is_well_conditioned(balanced(sys.A))
    if even or not 0 < sys.nstates <= MEASURED_STATES:
        return
    A, B, C, D = (np.asarray(part, dtype=float) for part in (sys.A, sys.B, sys.C, sys.D))
    signal = Signal(C, trimmed((D, *reduction.polynomial_part)))
    handed, few = _HandedOver(model, A, B, signal), len(model.dofs) <= FEW_DOFS
    measurement = measured(handed, None if few else _over_modes(A))
    loss = loss_of(measurement, allowed=TEN_TIMES_DATA, deep=0.0 if few else DEEP)
    cause = "strains and momenta hold what cancels in an output to rounding of its terms alone"
    warn_of_lost_digits(loss, cause)


def warn_of_python_control(model: SecondOrderModel, sys: control.StateSpace, states: States) -> None:
    """Warn of what python-control will lose of a state space.

    Parameters
    ----------
    model : SecondOrderModel
        What it was made of.
    sys : control.StateSpace
        As it is handed to the user.
    states : str
        What its states are.

    Warns
    -----
    LostDigitsWarning
        Poles at the origin that A holds as rounding, or an evaluation that loses digits.
    """
    even = has_even_entries(sys.A)
    if even and not _has_small_pivot(sys.A):
        return
    free = free_motion_count(model.M, model.C, model.K) if len(model.dofs) <= FREE_MOTIONS_LARGEST else None
    if free is not None and states in ("dofs", "scaled") and warn_of_free_motions(sys, free):
        return
    if not even:
        warn_of_evaluation(sys, states, at_origin=0 if free is None else free.poles)


def _over_modes(A: FloatArray) -> ComplexArray:
    """Return frequencies over all modes: what strains and momenta hold of an output cancels in its roll-off."""
    size = np.abs(np.linalg.eigvals(balanced(A)))
    return over_modes(np.sort(size[size > AT_ORIGIN * size.max(initial=0.0)]))


def _cancels(model: SecondOrderModel, sys: control.StateSpace) -> bool:
    """Tell whether terms of outputs may cancel, as those of accelerations do towards rest."""
    return bool(not is_zero(model.H) or np.any(sys.D))


def _has_small_pivot(A: FloatArray) -> bool:
    """Tell whether elimination meets a pivot that is zero or nearly so: a pole may be one at the origin."""
    if not A.size:
        return False
    factors, _, _ = dgetrf(A)
    pivots = list(map(abs, factors.diagonal().tolist()))
    return bool(min(pivots) <= NEARLY_NO_PIVOT * max(pivots))
