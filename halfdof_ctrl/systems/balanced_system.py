"""A state space in balanced states, evaluated by plain solves."""

from dataclasses import dataclass

import control
import numpy as np

from halfdof_ctrl.base.arrays import ComplexArray, FloatArray
from halfdof_ctrl.base.spectrum import ROUNDING_OF_A, balanced_states
from halfdof_ctrl.systems.state_space_data import StateSpaceData


@dataclass(frozen=True, slots=True, eq=False)
class BalancedSystem:
    """A state space with its states scaled by powers of two."""

    data: StateSpaceData

    @classmethod
    def of(cls, sys: control.StateSpace) -> "BalancedSystem":
        """Balance the states of a state space."""
        A, B, C, D = data = StateSpaceData.of(sys)
        if A.size == 0:
            return cls(data)
        balanced, scale = balanced_states(A)
        return cls(StateSpaceData(balanced, B / scale[:, None], C * scale, D))

    def __call__(self, points: ComplexArray) -> tuple[ComplexArray, FloatArray]:
        """Evaluate by a solve a point, (p, m, k), with the change that rounding in A makes, |y| |A| |x|."""
        A, B, C, D = self.data
        size, unit = np.abs(A), np.eye(A.shape[0])
        values, changes = [], []
        for s in points:
            shifted = s * unit - A
            try:
                x, y = np.linalg.solve(shifted, B), np.linalg.solve(shifted.T, C.T)
            except np.linalg.LinAlgError:  # a pole where the model has none
                values.append(np.full(D.shape, np.inf))
                changes.append(np.zeros(D.shape))
                continue
            values.append(C @ x + D)
            changes.append(ROUNDING_OF_A * (np.abs(y).T @ size + np.abs(C)) @ np.abs(x))
        return np.stack(values, axis=2), np.stack(changes, axis=2)
