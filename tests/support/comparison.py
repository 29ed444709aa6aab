"""Answers beside answers: responses relative to their channel, eigenvalues beside the ones they are nearest to."""

import control
import numpy as np
import numpy.typing as npt
from numpy.testing import assert_allclose

POINTS: npt.NDArray[np.complex128] = np.array([0.3j, 1.1j, 4.7j, 0.6 + 0.2j])  # [rad/s]


def response(sys: control.StateSpace, points: npt.NDArray[np.complex128] = POINTS) -> npt.NDArray[np.complex128]:
    """Evaluate a state space by a plain solve at each point: (p, m, k)."""
    A, B, C, D = (np.asarray(matrix) for matrix in (sys.A, sys.B, sys.C, sys.D))
    unit = np.eye(A.shape[0])
    return np.stack([C @ np.linalg.solve(s * unit - A, B) + D for s in points], axis=2)


def assert_same_transfer(
    actual: npt.NDArray[np.complex128], desired: npt.NDArray[np.complex128], tolerance: float
) -> None:
    """Compare (p, m, k) responses relative to the channel's largest value."""
    size = np.abs(desired).max(axis=2, keepdims=True)
    size = np.where(size > 0.0, size, np.abs(desired).max(initial=1e-300))
    assert_allclose(actual / size, desired / size, rtol=0.0, atol=tolerance)


def paired(found: npt.ArrayLike, wanted: npt.NDArray[np.complex128]) -> npt.NDArray[np.complex128]:
    """Put the found values beside the wanted ones that they are nearest to."""
    values = np.asarray(found, dtype=np.complex128)
    assert values.size == wanted.size
    nearest = [int(np.argmin(np.abs(values - value))) for value in wanted]
    assert len(set(nearest)) == wanted.size
    return np.asarray(values[nearest])
