"""Which modes no feedback stabilizes: not told from one that the inputs do not reach, or the cost does not see."""

import numpy as np

from halfdof_ctrl.base.arrays import ComplexArray, FloatArray
from halfdof_ctrl.base.spectrum import balanced_states
from halfdof_ctrl.systems.pole_bounds import bounded_poles

TOLD_FROM_ZERO = 8.0 * float(np.finfo(float).eps)  #: times N and the largest singular value: smaller ones are rounding
SCALINGS = 40  #: each takes the square root of what is left
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


def hidden_mode(
    A: FloatArray, C: FloatArray, eigenvalue: complex, sizes: FloatArray
) -> tuple[ComplexArray, float] | None:
    """Return v with A v = eigenvalue v and C v not told from 0, if there is one (Hautus' test), and how small C v is.

    States are balanced, so that their units do not matter, and rows and columns of [A - eigenvalue I; C] scaled until
    the sizes of their terms are one, so that a pole of a weak damper, many decades faster than the mode, does not
    decide what is small.

    Parameters
    ----------
    A, C : (N, N), (k, N) ndarrays
        With ``A^T, B^T`` in their place v is a left vector that the inputs do not reach.
    eigenvalue : complex
    sizes : (N, N) ndarray
        What the rounding errors of the entries of A are relative to.

    Returns
    -------
    v : (N,) complex ndarray
    part : float
        Smallest singular value of the scaled matrix over the largest.
    """
    n = len(A)
    A, units = balanced_states(A)  # scaling by the largest terms alone ends elsewhere from units far apart
    sizes, C = sizes * units / units[:, None], C * units
    terms = np.vstack([np.maximum(np.abs(A), sizes) + abs(eigenvalue) * np.eye(n), np.abs(C)])
    rows, columns = _scales(terms)
    stack = np.vstack([A - eigenvalue * np.eye(n), C]) * rows[:, None] * columns
    _, values, right = np.linalg.svd(stack)
    if values[-1] > TOLD_FROM_ZERO * n * values[0]:
        return None
    return np.asarray(units * columns * right[-1].conj()), float(values[-1] / values[0]) if values[0] else 0.0


def _scales(sizes: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return factors of rows and columns that bring the largest entry of each near one (D. Ruiz, 2001)."""
    rows, columns = np.ones(sizes.shape[0]), np.ones(sizes.shape[1])
    for _ in range(SCALINGS):
        work = sizes * rows[:, None] * columns
        rows, columns = (
            factors / np.sqrt(np.where(largest > 0.0, largest, 1.0))
            for factors, largest in ((rows, work.max(axis=1)), (columns, work.max(axis=0)))
        )
    return rows, columns
