"""Which modes no feedback stabilizes: not told from one that the inputs do not reach, or the cost does not see."""

import numpy as np

from halfdof_ctrl.base.arrays import ComplexArray, FloatArray
from halfdof_ctrl.base.spectrum import balanced_states
from halfdof_ctrl.systems.pole_bounds import bounded_poles

TOLD_FROM_ZERO = 8.0 * float(np.finfo(float).eps)  #: times N and the largest singular value: smaller ones are rounding
NEAR = 16.0  #: times its bound: an eigenvalue so near to the axis is tried there; `hidden_mode` decides


def axis_eigenvalues(A: FloatArray, *, right_too: bool) -> list[complex]:
    """List the eigenvalues that rounding does not tell from the imaginary axis, or also those right of it.

    Those within sixteen bounds of the axis or of zero are moved there, since a double eigenvalue is known to half
    the digits only.
    """
    poles = bounded_poles(A)
    found = []
    for value, error in zip(poles.values.tolist(), poles.bounds.tolist(), strict=True):
        if abs(value) <= NEAR * error:
            found.append(0j)
        elif abs(value.real) <= NEAR * error:
            found.append(complex(0.0, value.imag))
        elif right_too and value.real > 0.0:
            found.append(value)
    return found


def hidden_mode(A: FloatArray, C: FloatArray, eigenvalue: complex) -> tuple[ComplexArray, float] | None:
    """Return v with A v = eigenvalue v and C v not told from 0, if there is one (Hautus' test), and how small C v is.

    Parameters
    ----------
    A, C : (N, N), (k, N) ndarrays
        With ``A^T, B^T`` in their place v is a left vector that the inputs do not reach.
    eigenvalue : complex

    Returns
    -------
    v : (N,) complex ndarray
    part : float
        Smallest singular value of [A - eigenvalue I; C], rows of C scaled to the size of A, over the largest.
    """
    matrix, scale = balanced_states(A)
    shown = C * scale
    size = np.linalg.norm(shown, axis=1, keepdims=True)
    shown = shown / np.where(size > 0.0, size, 1.0) * np.linalg.norm(matrix, 2)
    stack = np.vstack([matrix - eigenvalue * np.eye(A.shape[0]), shown])
    _, values, right = np.linalg.svd(stack)
    if values[-1] > TOLD_FROM_ZERO * len(A) * values[0]:
        return None
    return np.asarray(scale * right[-1].conj()), float(values[-1] / values[0]) if values[0] else 0.0
