"""Poles of the state space of a model, with those at the origin taken from the model.

A free body has poles at exactly zero. In A they are rounding: the condensed stiffness of springs in series is not zero
but 1e-17 of them, and a double pole is then known to half the digits. The pencil of M, C, K says how many there are.
"""

import numpy as np

from halfdof_ctrl.base.arrays import FloatArray
from halfdof_ctrl.descriptor.structure import pencil_structure
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.reduction.energy.form import energy_system
from halfdof_ctrl.systems.pole_bounds import BoundedPoles, bounded_poles

LARGEST_PENCIL = 500  #: DOFs up to which the pencil is asked
SMALL_POLE = 1e-4  #: of the largest pole: where none is smaller, none can be a rounded zero
IN_DOUBT = 1e4  #: times its bound: a pole above is no rounded zero, whatever the pencil says
SPECK = 1e-13  #: of the next pole: one below may be the rounding of a stiffness that cancels; of k poles its k-th root
FOURTH_ROOT = 1e-3  #: of the next pole: a pole above is no rounded zero, however many there are


def poles_of_model(model: SecondOrderModel, A: FloatArray) -> BoundedPoles:
    """Find the eigenvalues of A, as many of them exactly zero as the model has at the origin.

    Parameters
    ----------
    model : SecondOrderModel
    A : (N, N) ndarray
        Of a state space of the model.

    Returns
    -------
    BoundedPoles

    Examples
    --------
    Springs of 100 and 200 N/m in series between free masses, with a node without mass:

    >>> K = [[100, -100, 0], [-100, 300, -200], [0, -200, 200]]
    >>> model = mechss(np.diag([2.0, 0, 1]), None, K)
    >>> int(poles_of_model(model, mech2ss(model).A).at_origin.sum())
    2
    """
    poles = bounded_poles(np.asarray(A, dtype=float))
    size = np.abs(poles.values)
    if size.min(initial=np.inf) > SMALL_POLE * size.max(initial=0.0) or len(model.dofs) > LARGEST_PENCIL:
        return poles
    if energy_system(model) is not None:
        return poles  # A has exact zeros for free motions, and what else is small is no rounding
    finite = pencil_structure(model.as_dense()).finite_eigenvalues
    count = int(np.count_nonzero(finite == 0.0))
    if finite.size != size.size or count <= int(np.count_nonzero(size == 0.0)):
        return poles
    order = np.argsort(size)
    if count < size.size and size[order[count - 1]] > FOURTH_ROOT * size[order[count]]:
        return poles
    values, bounds = poles.values.copy(), poles.bounds.copy()
    beside = SPECK ** (1.0 / count) * (size[order[count]] if count < size.size else 0.0)
    if (size[order[:count]] > np.maximum(IN_DOUBT * bounds[order[:count]], beside)).any():
        return poles  # plainly not zero: the pencil has lost them beside something very fast
    bounds[order[:count]] = np.maximum(bounds[order[:count]], size[order[:count]])
    values[order[:count]] = 0.0
    return BoundedPoles(values, bounds)
