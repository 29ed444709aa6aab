"""Poles of a model, each with the distance that rounding of M, C, K may have moved it, whatever its outputs are.

Energy coordinates give them where a model has these and tell them well; elsewhere they are the finite eigenvalues of
the pencil with their bounds. The entries of a state matrix beside one very fast pole may not know the slow ones, which
M, C and K do.
"""

import numpy as np

from halfdof_ctrl.descriptor.structure import pencil_structure
from halfdof_ctrl.model.dense_copy import dense_copy, with_few_signals
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.reduction.energy.form import energy_system
from halfdof_ctrl.systems.pole_bounds import COARSE_BOUND, BoundedPoles, bounded_poles

MOST_SHARPENED = 300  #: DOFs of a model up to which its pencil is asked where a state matrix says too little


def pencil_poles(model: SecondOrderModel) -> BoundedPoles:
    """Find the finite eigenvalues of a model, those that are not told from zero exactly zero.

    Parameters
    ----------
    model : SecondOrderModel
        Real or complex, of any index.

    Returns
    -------
    BoundedPoles

    Examples
    --------
    Two equal oscillators of which one drives the other, without damping: a chain, of which rounding leaves half the
    digits, and no pole at zero:

    >>> pencil_poles(mechss(np.eye(2), None, [[1.0, 0.0], [0.3, 1.0]])).values.imag.round(6).tolist()
    [1.0, 1.0, -1.0, -1.0]
    """
    model = dense_copy(with_few_signals(model), "The search for poles", "Give the frequencies.")
    form = energy_system(model)
    if form is None:
        found = pencil_structure(model)
        return BoundedPoles(found.finite_eigenvalues.copy(), found.bounds.copy())
    return sharpened(bounded_poles(form.A), model)


def sharpened(poles: BoundedPoles, model: SecondOrderModel) -> BoundedPoles:
    """Replace the poles of a state matrix by those of its model's pencil, if it knows some of them coarsely only.

    Parameters
    ----------
    poles : BoundedPoles
    model : SecondOrderModel

    Returns
    -------
    BoundedPoles
        The same where the pencil has another number of them, or is not sure of its own.
    """
    size = np.abs(poles.values)
    slowest = float(size[size > 0.0].min(initial=np.inf))
    coarse = poles.bounds > COARSE_BOUND * np.where(size > 0.0, size, slowest)
    if not coarse.any() or len(model.dofs) > MOST_SHARPENED:
        return poles
    found = pencil_structure(model.as_dense())
    if found.uncertainty or found.finite_eigenvalues.size != size.size:
        return poles
    return BoundedPoles(found.finite_eigenvalues.copy(), found.bounds.copy())
