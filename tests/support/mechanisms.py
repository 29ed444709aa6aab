"""Mechanisms with hidden constraints whose answers are known in closed form, for the modules behind deflation."""

import numpy as np
import numpy.typing as npt

from halfdof_ctrl import SecondOrderModel, mechss

FloatArray = npt.NDArray[np.float64]

#: a third derivative is needed: the states are q0, q1, q0', q0''
JERK = (
    np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]]),
    np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 0.0], [0.0, -1.0, 0.0]]),
    np.array([[0.0, 0.0, 0.0], [0.0, 1.0, 1.0], [0.0, 0.0, 0.0]]),
)

#: two more derivatives: q0''' is a state too
SNAP = (
    np.array([[-1.0, 0, 0, 0], [-1, -1, 0, 1], [-1, 0, 0, 0], [0, 0, 1, 1]]),
    np.array([[0.0, 0, 0, 0], [0, 0, 0, -1], [0, 0, 0, 0], [0, 0, 0, 0]]),
    np.array([[1.0, 1, 0, 0], [1, 0, -1, 0], [0, 0, 1, -1], [1, 1, -1, 0]]),
)


def rod() -> SecondOrderModel:
    """Tie two masses of 2 and 1 kg on springs of 30 and 60 N/m by a rigid rod with the force f.

    Index 3; ``3 a'' + 90 a`` is the sum of the forces on a and b, plus ``s^2 + 60`` times the length that f drives.
    """
    M, K = np.diag([2.0, 1, 0]), [[30, 0, 1], [0, 60, -1], [1, -1, 0]]
    return mechss(M, None, K, dofs=["a", "b", "f"])


def hanging_chain(links: int) -> SecondOrderModel:
    """Linearize a chain of equal links about hanging, in Cartesian coordinates with the tensions as multipliers.

    Index 3. With unit masses, lengths and gravity the squares of the eigenfrequencies are the zeros of the Laguerre
    polynomial (D. Bernoulli, 1732).
    """
    n = 3 * links
    M, K = np.zeros((n, n)), np.zeros((n, n))
    for i in range(links):
        M[i, i] = M[links + i, links + i] = 1.0
        ends = [(i, 1.0)] if i == 0 else [(i, 1.0), (i - 1, -1.0)]
        for row, sign in ends:
            for column, other in ends:
                K[row, column] += (links - i) * sign * other
            K[2 * links + i, links + row] = K[links + row, 2 * links + i] = sign
    names = [f"{letter}{i}" for letter in ("x", "y", "tension") for i in range(links)]
    return mechss(M, None, K, dofs=names)


def blade() -> SecondOrderModel:
    """Hold two masses of 1 and 2 kg on springs of 3 and 9 N/m at one velocity, by a force f (nonholonomic).

    Index 2; eigenvalues 0 and +-2j: any difference of positions stays.
    """
    C, K = np.zeros((3, 3)), [[3, 0, 1], [0, 9, -1], [0, 0, 0]]
    C[2] = 1, -1, 0
    return mechss(np.diag([1, 2, 0]), C, K, dofs=["x", "y", "f"])


def derivatives(length: int) -> SecondOrderModel:
    """Give unknowns of which each is the second derivative of the one before it: ``q_i = s^(2 i) u``.

    Index ``2 length - 1``: the first equation is to be differentiated ``2 length - 2`` times.
    """
    return mechss(-np.eye(length, k=-1), None, np.eye(length), np.eye(length)[:, [0]], inputs="u")


def in_units(
    model: SecondOrderModel, columns: FloatArray, rows: FloatArray, tau: float
) -> tuple[SecondOrderModel, FloatArray]:
    """Measure DOFs, equations and time in other units; unit forces on all equations, all unknowns as outputs.

    Returns
    -------
    model, factors
        The model, and what ``P(s)^-1`` of the old one at s is multiplied by to be that of the new one at ``s tau``.
    """
    M, C, K = (
        rows[:, None] * matrix * columns * tau**-power for power, matrix in ((2, model.M), (1, model.C), (0, model.K))
    )
    return mechss(M, C, K, dofs=model.dofs), 1.0 / (columns[:, None] * rows)
