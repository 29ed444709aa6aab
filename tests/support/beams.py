"""Unit beams of Hermitian elements with consistent mass, and their transfer functions in ball arithmetic."""

import flint
import numpy as np
import numpy.typing as npt

from halfdof_ctrl import SecondOrderModel, mechss
from halfdof_ctrl.base.arrays import FloatArray

PRECISION = 400  #: bits, of which cantilevers of 160 elements lose some 60
FIRST_MODES = (3.516, 22.03, 61.70, 120.9)  #: natural frequencies of a unit cantilever [rad/s]


def beam_matrices(elements: int, *, clamped: bool = True) -> tuple[FloatArray, FloatArray]:
    """Give M and K of a beam of length, bending stiffness and mass 1, displacements and rotations in turn."""
    h = 1.0 / elements
    k = np.array(
        [
            [12, 6 * h, -12, 6 * h],
            [6 * h, 4 * h * h, -6 * h, 2 * h * h],
            [-12, -6 * h, 12, -6 * h],
            [6 * h, 2 * h * h, -6 * h, 4 * h * h],
        ]
    )
    m = np.array(
        [
            [156, 22 * h, 54, -13 * h],
            [22 * h, 4 * h * h, 13 * h, -3 * h * h],
            [54, 13 * h, 156, -22 * h],
            [-13 * h, -3 * h * h, -22 * h, 4 * h * h],
        ]
    )
    M, K = np.zeros((2, 2 * elements + 2, 2 * elements + 2))
    for e in range(elements):
        part = slice(2 * e, 2 * e + 4)
        M[part, part] += m * h / 420.0
        K[part, part] += k / h**3
    first = 2 if clamped else 0
    return M[first:, first:], K[first:, first:]


def cantilever(elements: int) -> SecondOrderModel:
    """Make a clamped beam with C = 0.2 M, force and displacement at its tip."""
    M, K = beam_matrices(elements)
    tip = f"q{2 * elements - 2}"
    return mechss(M, 0.2 * M, K).select(f"F_{tip}", tip)


def zener_cantilever(elements: int) -> SecondOrderModel:
    """Make a clamped beam with a Maxwell branch on the bending of each element: as many half DOFs."""
    bare, stiffness = beam_matrices(elements)
    n, size = len(bare), len(bare) + elements
    M, C, K = np.zeros((3, size, size))
    M[:n, :n], K[:n, :n] = bare, stiffness
    g = 0.3 * elements
    for e in range(elements):
        across = np.zeros(size)
        across[2 * e + 1], across[n + e] = 1.0, -1.0
        if e > 0:
            across[2 * e - 1] = -1.0
        K += g * np.outer(across, across)
        C[n + e, n + e] = 0.05 * g
    tip = f"q{2 * elements - 2}"
    return mechss(M, C, K).select(f"F_{tip}", tip)


def stiff_chain(masses: int) -> SecondOrderModel:
    """Make a chain whose springs fall from 1e8 to 1, force and displacement at its soft end."""
    k = np.append(np.geomspace(1e8, 1.0, masses), 0.0)
    K = np.diag(k[:-1] + k[1:]) - np.diag(k[1:-1], 1) - np.diag(k[1:-1], -1)
    end = f"q{masses - 1}"
    return mechss(np.eye(masses), 0.01 * np.eye(masses), K).select(f"F_{end}", end)


def ball_transfer(model: SecondOrderModel, points: npt.ArrayLike) -> npt.NDArray[np.complex128]:
    """Give H(s) of a model with one force and one displacement, of its stored doubles, right to the last digit."""
    before = flint.ctx.prec
    flint.ctx.prec = PRECISION
    try:
        return np.array([_ball_value(model, complex(s)) for s in np.atleast_1d(np.asarray(points))])
    finally:
        flint.ctx.prec = before


def _ball_value(model: SecondOrderModel, s: complex) -> complex:
    point = flint.acb(s.real, s.imag)
    K, C, M = (_ball_matrix(matrix) for matrix in model.quadratics.P)
    motion = (K + C * point + M * (point * point)).solve(_ball_matrix(model.B))
    return complex((_ball_matrix(model.F) * motion)[0, 0])


def _ball_matrix(matrix: npt.ArrayLike) -> flint.acb_mat:
    return flint.acb_mat(np.asarray(matrix, dtype=float).tolist())


def plane_frame(nodes: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Give M and K of a free polygon of steel bars in the plane: two displacements and a rotation at each node."""
    places = np.asarray(nodes, dtype=float)
    M, K = np.zeros((2, 3 * len(places), 3 * len(places)))
    bending = [1, 2, 4, 5]
    for e, along in enumerate(np.diff(places, axis=0)):
        length = float(np.hypot(*along))
        cosine, sine = along / length
        turn = np.kron(np.eye(2), [[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]])
        m, k = beam_matrices(1, clamped=False)
        own_m, own_k = np.zeros((2, 6, 6))
        size = np.array([1.0, length, 1.0, length])
        own_m[np.ix_(bending, bending)] = 7.8 * length * size[:, None] * m * size
        own_k[np.ix_(bending, bending)] = 2e4 / length**3 * size[:, None] * k * size
        own_m[np.ix_([0, 3], [0, 3])] = 7.8 * length / 6.0 * np.array([[2.0, 1.0], [1.0, 2.0]])
        own_k[np.ix_([0, 3], [0, 3])] = 2e8 / length * np.array([[1.0, -1.0], [-1.0, 1.0]])
        part = slice(3 * e, 3 * e + 6)
        M[part, part] += turn.T @ own_m @ turn
        K[part, part] += turn.T @ own_k @ turn
    return M, K
