"""Lyapunov's equation in the eigenvectors of a closed loop.

    F = V diag(lambda) V^-1,    F^T Y + Y F = -S:    (V^H Y V)_ij = -(V^H S V)_ij / (conj(lambda_i) + lambda_j)

Where fast and slow poles lie many decades apart each component keeps digits of its own, which a Schur form, whose
rounding is one part of the largest, does not give.
"""

import numpy as np
import scipy.linalg

from halfdof_ctrl.base.arrays import FloatArray
from halfdof_ctrl.base.spectrum import balanced_states


class ModalBasis:
    """A stable F of N states, diagonalized in states balanced by powers of two, those of fast rows first."""

    def __init__(self, F: FloatArray) -> None:
        matrix, self.scale = balanced_states(F)
        order = np.argsort(-np.abs(matrix).sum(axis=1), kind="stable")  # QR keeps small eigenvalues of such a grading
        values, vectors = scipy.linalg.eig(matrix[np.ix_(order, order)])
        V = np.empty_like(vectors)
        V[order] = vectors
        self.values = np.asarray(values, dtype=np.complex128)
        self.sums = self.values.conj()[:, None] + self.values
        self.V = np.asarray(V, dtype=np.complex128)
        self.W = np.linalg.solve(self.V, np.eye(len(F)))  # raises LinAlgError where the eigenvectors are dependent

    @property
    def is_stable(self) -> bool:
        """Whether all poles are left of the axis, by their computed values."""
        return bool((self.values.real < 0.0).all())

    def components(self, S: FloatArray) -> FloatArray:
        """Return V^H Y V for a symmetric S."""
        scaled = S * self.scale * self.scale[:, None]
        return np.asarray(-(self.V.conj().T @ scaled @ self.V) / self.sums)

    def solution(self, components: FloatArray) -> FloatArray:
        """Return Y in the states of F."""
        Y = (self.W.conj().T @ components @ self.W).real / self.scale / self.scale[:, None]
        return np.asarray((Y + Y.T) / 2.0)

    def bound(self, rows: FloatArray, components: FloatArray) -> FloatArray:
        """Bound the entries of ``rows Y``, no two components cancelling."""
        outer = np.abs((rows / self.scale) @ self.W.conj().T)
        return np.asarray(outer @ np.abs(components) @ np.abs(self.W) / self.scale)
