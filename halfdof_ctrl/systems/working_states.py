"""The states in which responses are computed, whatever states the user has.

Energy coordinates lose a square root of what displacements and velocities lose, but their output matrix is dense: where
an output is many decades below the state, as in deep roll-off, terms cancel that DOF states do not have. So a frequency
response comes of energy coordinates, but of DOF states where less than `SHARE` of the state is left of the output.
Models without energy coordinates (unsymmetric or indefinite M or K, constraints, masses or dampers that need rotated
coordinates) are worked in DOF states, scaled by powers of two.
"""

import numpy as np

from halfdof_ctrl.base.arrays import LARGEST_DENSE_COPY, ComplexArray, FloatArray
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.reduction.energy.form import EnergyForm, energy_system
from halfdof_ctrl.reduction.exact_reduction import ExactReduction
from halfdof_ctrl.systems.hessenberg import state_space_response
from halfdof_ctrl.systems.state_map import StateMap, map_of_form, state_map

SHARE = 1e-6  #: of |C_i| |x|: what less of an output is left, keeps fewer than ten digits in energy coordinates


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
    small = (share < SHARE).any(axis=(0, 1))
    if small.any():
        keeping = state_space_response(*dofs, points[small])
        values[:, :, small] = np.where(share[:, :, small] < SHARE, keeping, values[:, :, small])
    return values


def _is_large(model: SecondOrderModel) -> bool:
    return max(map(len, (model.dofs, model.inputs, model.outputs))) > LARGEST_DENSE_COPY
