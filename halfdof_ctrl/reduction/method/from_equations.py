"""What methods share that keep the state equations of a whole model in hand."""

from collections.abc import Sequence
from dataclasses import dataclass

from halfdof_ctrl.base.arrays import FloatArray
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.reduction.method.signals import Signal, StateEquations


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class FromEquations:
    """The part of a `ReductionMethod` that its `StateEquations` answer."""

    model: SecondOrderModel
    equations: StateEquations
    is_even: bool = False  #: whether A is known to be well conditioned in its states as they stand

    @property
    def A(self) -> FloatArray:  # noqa: N802
        """(N, N) state matrix."""
        return self.equations.A

    @property
    def B(self) -> FloatArray:  # noqa: N802
        """(N, m) input matrix."""
        return self.equations.B

    @property
    def shift(self) -> tuple[FloatArray, ...]:
        """E_0, E_1, ... of equation (5)."""
        return self.equations.shift

    @property
    def input_derivatives(self) -> int:
        """How many derivatives of the inputs the velocities may contain."""
        return len(self.equations.displacement.U)

    def motion(self, derivative: int) -> Signal:
        """Return a derivative of all DOFs."""
        return self.equations.motion(derivative)

    def motion_at(self, x: FloatArray, inputs: Sequence[FloatArray], derivative: int) -> FloatArray:
        """Return a derivative of all DOFs for given states and inputs."""
        return self.equations.motion_at(x, inputs, derivative)
