"""A state space in balanced states, evaluated by plain solves."""

from dataclasses import dataclass

import control
import numpy as np

from halfdof_ctrl.base.arrays import ComplexArray, FloatArray
from halfdof_ctrl.base.spectrum import ROUNDING_OF_A, balanced_states


@dataclass(frozen=True, slots=True, eq=False)
class BalancedSystem:
    """A state space with its states scaled by powers of two."""

    A: FloatArray
    B: FloatArray
    C: FloatArray
    D: FloatArray

    @classmethod
    def of(cls, sys: control.StateSpace) -> "BalancedSystem":
        """Balance the states of a state space."""
        A, B, C, D = (np.asarray(matrix, dtype=float) for matrix in (sys.A, sys.B, sys.C, sys.D))
        if A.size == 0:
            return cls(A, B, C, D)
        balanced, scale = balanced_states(A)
        return cls(balanced, B / scale[:, None], C * scale, D)

    def __call__(self, points: ComplexArray) -> tuple[ComplexArray, FloatArray]:
        """Evaluate by a solve a point, (p, m, k), with the change that rounding in A makes, |y| |A| |x|."""
        size, unit = np.abs(self.A), np.eye(self.A.shape[0])
        values, changes = [], []
        for s in points:
            shifted = s * unit - self.A
            try:
                x, y = np.linalg.solve(shifted, self.B), np.linalg.solve(shifted.T, self.C.T)
            except np.linalg.LinAlgError:  # a pole where the model has none
                values.append(np.full(self.D.shape, np.inf))
                changes.append(np.zeros(self.D.shape))
                continue
            values.append(self.C @ x + self.D)
            changes.append(ROUNDING_OF_A * (np.abs(y).T @ size + np.abs(self.C)) @ np.abs(x))
        return np.stack(values, axis=2), np.stack(changes, axis=2)
