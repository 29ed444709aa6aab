"""A state space on its way to the user: a word where python-control will get something else out of it."""

import control
from scipy.linalg.lapack import dgetrf

from halfdof_ctrl.base.arrays import EPS, FloatArray, has_even_entries
from halfdof_ctrl.model.free_motions import FREE_MOTIONS_LARGEST, free_motion_count
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.systems.evaluation_loss import warn_of_evaluation
from halfdof_ctrl.systems.free_motion_warning import warn_of_free_motions
from halfdof_ctrl.systems.state_map import States

NEARLY_NO_PIVOT = 1e6 * EPS  #: of the largest: a smaller one may be what is left of a zero


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


def _has_small_pivot(A: FloatArray) -> bool:
    """Tell whether elimination meets a pivot that is zero or nearly so: a pole may be one at the origin."""
    if not A.size:
        return False
    factors, _, _ = dgetrf(A)
    pivots = list(map(abs, factors.diagonal().tolist()))
    return bool(min(pivots) <= NEARLY_NO_PIVOT * max(pivots))
