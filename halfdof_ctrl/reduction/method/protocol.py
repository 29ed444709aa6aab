"""What every method of the reduction gives: `ReductionMethod`, and the coordinates that its states are made of.

A method is a way from M, C, K to ``x' = A x + B u`` with its evidence. `choose` proposes methods and takes the first
that is proved; `ExactReduction` delegates to it; neither knows which one it has.
"""

from collections.abc import Sequence
from typing import Literal, Protocol, TypeAlias

from halfdof_ctrl.base.arrays import FloatArray
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.reduction.method.evidence import Evidence, RankDecision
from halfdof_ctrl.reduction.method.signals import Signal

MethodName: TypeAlias = Literal["selection", "orthogonal", "deflation"]
METHODS: tuple[MethodName, ...] = ("selection", "orthogonal", "deflation")  #: in the order in which they are tried


class Coordinates(Protocol):
    """Which coordinates are inertial, half and static, and how states follow from the motion of n DOFs."""

    @property
    def inertial(self) -> tuple[str, ...]:
        """Names of the coordinates with two states or more."""

    @property
    def half(self) -> tuple[str, ...]:
        """Names of the coordinates with one state."""

    @property
    def static(self) -> tuple[str, ...]:
        """Names of the coordinates without a state."""

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the N states."""

    def kinds_of(self, dofs: tuple[str, ...]) -> dict[str, str]:
        """Tell for each of the model's DOFs that is not wholly inertial whether it is half or static."""

    def state_of(self, displacements: FloatArray, velocities: FloatArray) -> FloatArray:
        """Return the states that belong to displacements and velocities of all n DOFs."""

    def state_maps(self) -> tuple[FloatArray, ...]:
        """Return L_q, L_v, ..., (N, n) each, of x = L_q q + L_v q' + ..."""


class ReductionMethod(Protocol):
    """One way from M, C, K to ``x' = A x + B u``, with its evidence, for n DOFs, N states and m inputs."""

    @property
    def name(self) -> MethodName:
        """How it is asked for."""

    @property
    def model(self) -> SecondOrderModel:
        """The model that was reduced."""

    @property
    def A(self) -> FloatArray:  # noqa: N802
        """(N, N) state matrix."""

    @property
    def B(self) -> FloatArray:  # noqa: N802
        """(N, m) input matrix."""

    @property
    def shift(self) -> tuple[FloatArray, ...]:
        """E_0, E_1, ... of equation (5), (N, m) each."""

    @property
    def coordinates(self) -> Coordinates:
        """Which coordinates are inertial, half and static."""

    @property
    def evidence(self) -> Evidence:
        """What the states rest on."""

    @property
    def is_even(self) -> bool:
        """Whether A is known to be well conditioned in its states as they stand: evaluations lose nothing then."""

    @property
    def input_derivatives(self) -> int:
        """How many derivatives of the inputs the velocities may contain."""

    def index(self) -> int:
        """Return the index of the pencil (8)."""

    def output(self, model: SecondOrderModel) -> Signal:
        """Return the outputs of a model that differs in them alone, as functions of state, inputs and derivatives."""

    def motion(self, derivative: int) -> Signal:
        """Return q, q' or q'' (derivative 0, 1, 2) of all n DOFs as functions of state and inputs."""

    def motion_at(self, x: FloatArray, inputs: Sequence[FloatArray], derivative: int) -> FloatArray:
        """Return q or q' of all DOFs, (n, k), for states (N, k) and for the inputs and their derivatives, (m, k) each.

        Derivatives that are missing at the end count as zero.
        """

    def without_rounding(self) -> FloatArray:
        """Return A with zeros for entries that may be rounding of zero."""

    def rounding_sizes(self) -> FloatArray:
        """Return what the rounding errors of the entries of A are relative to, (N, N)."""

    def decisions(self) -> tuple[RankDecision, ...]:
        """Return the singular values that decisions about ranks rest on, those of W last."""

    def inverse_rows(self) -> FloatArray:
        """Return the rows of W^-1 that belong to p''_i and p'_c, gamma and alpha, in that order."""
