"""The states in which responses are computed, whatever states the user has.

Energy coordinates lose a square root of what displacements and velocities lose, but their output matrix is dense: where
an output is many decades below the state, as in deep roll-off, terms cancel that DOF states do not have. So a frequency
response comes of energy coordinates, but of DOF states where less than `LEAST_SHARE` of the state is left of an output.
Models without energy coordinates (unsymmetric or indefinite M or K, constraints, masses or dampers that need rotated
coordinates) are worked in DOF states, scaled by powers of two.
"""

import control
import numpy as np
import scipy.linalg

from halfdof_ctrl.base.arrays import LARGEST_DENSE_COPY, ComplexArray, FloatArray
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.reduction.choose import exact_reduction
from halfdof_ctrl.reduction.energy.form import EnergyForm, energy_system
from halfdof_ctrl.reduction.exact_reduction import ExactReduction
from halfdof_ctrl.systems.hessenberg import state_space_response
from halfdof_ctrl.systems.state_map import StateMap, map_of_form, state_map
from halfdof_ctrl.systems.state_space import energy_state_space, mech2ss

LEAST_SHARE = 1e-6  #: of |C_i| |x|: what less of an output is left, keeps fewer than ten digits in energy coordinates


def working_map(reduction: ExactReduction) -> StateMap | None:
    """Return the states in which a time response is computed; None for a large sparse model, which stays as it is.

    Examples
    --------
    >>> working_map(exact_reduction(hydromount())).kind
    'energy'
    >>> working_map(exact_reduction(mechss([[1, 0], [0, 1]], None, [[2, 1], [-1, 2]]))).kind
    'scaled'
    """
    model = reduction.model
    if reduction.order == 0 or (model.is_sparse and _is_large(model)):
        return None
    form = energy_system(model)
    if form is None or len(form.A) != reduction.order:
        return state_map(reduction, "scaled")
    return map_of_form(form, "energy", reduction)


def working_form(model: SecondOrderModel, order: int) -> EnergyForm | None:
    """Return the energy coordinates of a model that has `order` states, None where there are none."""
    form = None if model.is_sparse and _is_large(model) else energy_system(model)
    return form if form is not None and len(form.A) == order else None


def working_matrix(model: SecondOrderModel) -> FloatArray:
    """Return A in energy coordinates where the model has them, else in DOF states."""
    reduction = exact_reduction(model)
    form = working_form(model, reduction.order)
    return reduction.A if form is None else form.A


def model_poles(model: SecondOrderModel) -> ComplexArray:
    """Return the poles of the state space of a model [rad/s], computed in the states that keep most digits.

    Poles of motions that K and C leave free are exactly 0.

    Raises
    ------
    ComplexModelError, SingularPencilError, UncertainRankError
        What `exact_reduction` refuses.

    Examples
    --------
    Two free masses joined by a spring:

    >>> poles = model_poles(mechss([[2, 0], [0, 2]], None, [[9, -9], [-9, 9]]))
    >>> int(np.count_nonzero(poles == 0.0)), float(np.abs(poles).max().round(12))
    (2, 3.0)
    """
    A = working_matrix(model)
    return np.asarray(scipy.linalg.eigvals(A), dtype=np.complex128) if A.size else np.zeros(0, dtype=np.complex128)


def working_system(model: SecondOrderModel) -> control.StateSpace:
    """Return the state space in energy coordinates where the model has them, else in DOF states.

    Raises
    ------
    ComplexModelError, SingularPencilError, UncertainRankError, ImproperError
        The model has no state space (see `mech2ss`).
    """
    sys = mech2ss(model)
    form = working_form(model, sys.nstates)
    return sys if form is None else energy_state_space(form)


def response_of_form(
    form: EnergyForm, dofs: tuple[FloatArray, FloatArray, FloatArray, FloatArray], points: ComplexArray
) -> ComplexArray:
    """Evaluate a model in energy coordinates, and in DOF states where little is left of an output.

    Parameters
    ----------
    form : EnergyForm
        Of a proper model with N states, m inputs and p outputs.
    dofs : (N, N), (N, m), (p, N), (p, m) ndarrays
        A, B, C, D of the same model in DOF states.
    points : (k,) complex ndarray

    Returns
    -------
    (p, m, k) complex ndarray
    """
    output = form.output
    share = np.ones((len(output.X), form.B.shape[1], points.size))
    values = state_space_response(form.A, form.B, output.X, output.direct(form.B.shape[1]), points, share=share)
    small = (share < LEAST_SHARE).any(axis=(0, 1))
    if small.any():
        keeping = state_space_response(*dofs, points[small])
        values[:, :, small] = np.where(share[:, :, small] < LEAST_SHARE, keeping, values[:, :, small])
    return values


def _is_large(model: SecondOrderModel) -> bool:
    return max(map(len, (model.dofs, model.inputs, model.outputs))) > LARGEST_DENSE_COPY
