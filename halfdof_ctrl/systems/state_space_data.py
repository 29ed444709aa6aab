"""The four matrices of a state space, which travel together."""

from typing import NamedTuple

import control
import numpy as np

from halfdof_ctrl.base.arrays import FloatArray


class StateSpaceData(NamedTuple):
    """``x' = A x + B u``, ``y = C x + D u`` as plain arrays, for N states, m inputs and p outputs."""

    A: FloatArray  #: (N, N)
    B: FloatArray  #: (N, m)
    C: FloatArray  #: (p, N)
    D: FloatArray  #: (p, m)

    @classmethod
    def of(cls, sys: control.StateSpace) -> "StateSpaceData":
        """Return the matrices of a state space."""
        return cls(*[np.asarray(matrix, dtype=float) for matrix in (sys.A, sys.B, sys.C, sys.D)])

    def channel(self, output: int, source: int) -> "StateSpaceData":
        """Return the system from one input to one output, with all states."""
        return StateSpaceData(self.A, self.B[:, [source]], self.C[[output]], self.D[[output]][:, [source]])
