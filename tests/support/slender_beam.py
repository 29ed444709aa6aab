"""A slender clamped beam with lumped masses, cut into so many elements that its mass is lost beside its stiffness."""

import numpy as np
from scipy.sparse import coo_array, csc_array, diags_array

from halfdof_ctrl import SecondOrderModel, mechss

LENGTH, SIDE, YOUNG, DENSITY = 10.0, 0.05, 2.1e11, 7850.0  # m, m, Pa, kg/m^3
BENDING = YOUNG * SIDE**4 / 12.0  # N m^2


def slender_beam(elements: int, *, is_sparse: bool) -> SecondOrderModel:
    """Give the beam with a force on its tip and the displacement there."""
    h, n = LENGTH / elements, 2 * elements
    element = (BENDING / h**3) * np.array(
        [
            [12, 6 * h, -12, 6 * h],
            [6 * h, 4 * h**2, -6 * h, 2 * h**2],
            [-12, -6 * h, 12, -6 * h],
            [6 * h, 2 * h**2, -6 * h, 4 * h**2],
        ]
    )
    rows, columns = np.mgrid[0:4, 0:4]
    first = 2 * np.arange(elements)[:, None, None]
    entries = np.broadcast_to(element, (elements, 4, 4)).ravel()
    K = csc_array(coo_array((entries, ((first + rows).ravel(), (first + columns).ravel())), shape=(n + 2, n + 2)))
    mass = np.zeros(n)
    mass[::2] = DENSITY * SIDE**2 * h
    mass[-2] /= 2.0
    K, M = csc_array(K[2:, 2:]), csc_array(diags_array(mass))
    tip = np.zeros(n)
    tip[-2] = 1.0
    if is_sparse:
        return mechss(M, None, K, tip, tip)
    return mechss(M.toarray(), None, K.toarray(), tip, tip)


def tip_receptance(omega: float) -> float:
    """Give the displacement of the tip per force of the continuous beam (Euler and Bernoulli) [m/N]."""
    k = (DENSITY * SIDE**2 * omega**2 / BENDING) ** 0.25 * LENGTH
    top = np.sin(k) * np.cosh(k) - np.cos(k) * np.sinh(k)
    return float(LENGTH**3 / BENDING * top / (k**3 * (1.0 + np.cos(k) * np.cosh(k))))
