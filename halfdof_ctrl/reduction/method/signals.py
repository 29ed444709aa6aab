"""Signals of a linear system as functions of its state and of its inputs' derivatives.

w = X x + U_0 u + U_1 u' + U_2 u'' + ...,    x' = A x + B u                            (6)
w' = X A x + X B u + U_0 u' + U_1 u'' + ...                                            (7)

Derivatives of the inputs in the equation of the state are absorbed by another choice of it, equation (5).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import zip_longest

import numpy as np

from halfdof_ctrl.base.arrays import FloatArray, is_unit, is_zero
from halfdof_ctrl.base.doors import is_whole_number, shown
from halfdof_ctrl.base.errors import ParameterError
from halfdof_ctrl.model.second_order import SecondOrderModel

HIGHEST_DERIVATIVE = 20  #: of a displacement, far more than any use


@dataclass(frozen=True, slots=True, eq=False)
class Signal:
    """k signals of the form (6), for N states and m inputs."""

    X: FloatArray  #: (k, N) from the state
    U: tuple[FloatArray, ...]  #: (k, m) each, from the inputs and their derivatives; no trailing zeros

    def derivative(self, A: FloatArray, B: FloatArray) -> "Signal":
        """Differentiate once along the system's motion, equation (7)."""
        return Signal(self.X @ A, trimmed((self.X @ B, *self.U)))

    def combined(self, weights: FloatArray) -> "Signal":
        """Return ``weights @ w``."""
        return Signal(weights @ self.X, trimmed(tuple([weights @ part for part in self.U])))

    def plus(self, other: "Signal") -> "Signal":
        """Add another signal of the same size."""
        parts = [_sum(mine, theirs) for mine, theirs in zip_longest(self.U, other.U)]
        return Signal(self.X + other.X, trimmed(tuple(parts)))

    def direct(self, inputs: int) -> FloatArray:
        """Give U_0, zeros if there is none."""
        return self.U[0] if self.U else np.zeros((self.X.shape[0], inputs))


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class StateEquations:
    """x' = A x + B u with the way back to q, for n DOFs, N states and m inputs."""

    A: FloatArray  #: (N, N)
    B: FloatArray  #: (N, m)
    displacement: Signal  #: all n displacements, equation (4)
    shift: tuple[FloatArray, ...]  #: E_0, E_1, ... of equation (5), (N, m) each

    def motion(self, derivative: int) -> Signal:
        """Return q, q' or q'' (derivative 0, 1, 2) of all n DOFs as functions of state and inputs.

        Raises
        ------
        ParameterError
            `derivative` is no whole number from 0 to 20.
        """
        if not is_whole_number(derivative) or not 0 <= derivative <= HIGHEST_DERIVATIVE:
            msg = f"derivative = {shown(derivative)}, but it must be a whole number from 0 to {HIGHEST_DERIVATIVE}."
            raise ParameterError(msg, parameter="derivative", value=derivative)
        signal = self.displacement
        for _ in range(derivative):
            signal = signal.derivative(self.A, self.B)
        return signal

    def motion_at(self, x: FloatArray, inputs: Sequence[FloatArray], derivative: int) -> FloatArray:
        """Return q or q' of all DOFs, (n, k), for states (N, k) and for the inputs and their derivatives, (m, k) each.

        Derivatives that are missing at the end count as zero.
        """
        motion = self.motion(derivative)
        history = np.tensordot(motion.X, x, axes=1)
        for part, values in zip(motion.U, inputs, strict=False):
            history += np.tensordot(part, values, axes=1)
        return np.asarray(history)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Rounding:
    """What the rounding errors of `StateEquations` are relative to."""

    relative: float  #: the errors are this part of the sizes below
    A: FloatArray  #: (N, N)
    B: FloatArray  #: (N, m)
    displacement: Signal


def trimmed(parts: tuple[FloatArray, ...]) -> tuple[FloatArray, ...]:
    """Drop coefficients of zeros at the end."""
    while parts and is_zero(parts[-1]):
        parts = parts[:-1]
    return parts


def _sum(mine: FloatArray | None, theirs: FloatArray | None) -> FloatArray:
    if mine is None or theirs is None:
        return mine if theirs is None else theirs  # type: ignore[return-value]
    return mine + theirs


def absorbed(A: FloatArray, driven: list[FloatArray]) -> tuple[FloatArray, tuple[FloatArray, ...]]:
    """Turn x' = A x + B_0 u + B_1 u' + ... into x~' = A x~ + B u with x = x~ + E_0 u + E_1 u' + ..., (5).

    Returns
    -------
    B : (N, m) ndarray
    (E_0, E_1, ...) : tuple of (N, m) ndarrays
    """
    shift: tuple[FloatArray, ...] = ()
    carried = driven[-1]
    for lower in reversed(driven[:-1]):
        shift = (carried, *shift)
        carried = lower + A @ carried
    return carried, shift


def output_signal(model: SecondOrderModel, equations: StateEquations, rounding: Callable[[], Rounding]) -> Signal:
    """Return the outputs; of u', u'', ... only what is more than a rounding error.

    Parameters
    ----------
    model : SecondOrderModel
    equations : StateEquations
        Of the model.
    rounding : callable
        Gives the rounding errors of the equations; called where derivatives of the inputs show at all.
    """
    q = equations.displacement
    output = q if is_unit(model.F) else q.combined(model.F)  # all displacements, mostly
    if not is_zero(model.G):
        output = output.plus(q.combined(model.G).derivative(equations.A, equations.B))
    if not is_zero(model.H):
        velocity = q.combined(model.H).derivative(equations.A, equations.B)
        output = output.plus(velocity.derivative(equations.A, equations.B))
    if not is_zero(model.D, model.Dv, model.Da):
        direct = trimmed(model.quadratics.D)
        output = output.plus(Signal(np.zeros_like(output.X), direct))
    if len(output.U) <= 1:
        return output
    kept = without_rounding(model, output, rounding()).U
    return Signal(output.X, trimmed((output.U[0], *kept[1:])))


def without_rounding(model: SecondOrderModel, output: Signal, rounding: Rounding) -> Signal:
    """Drop coefficients of u, u', ... that are rounding errors of sums that cancel.

    The bound evaluates (6) and (7) with the sizes that the rounding errors are relative to.
    """
    if not output.U:
        return output
    q = rounding.displacement
    bound = q.combined(np.abs(model.F))
    for order, matrix in ((1, model.G), (2, model.H)):
        term = q.combined(np.abs(matrix))
        for _ in range(order):
            term = term.derivative(rounding.A, rounding.B)
        bound = bound.plus(term)
    kept = [
        np.where(np.abs(part) <= rounding.relative * size, 0.0, part)
        for part, size in zip_longest(output.U, bound.U[: len(output.U)], fillvalue=np.zeros_like(output.U[0]))
    ]
    return Signal(output.X, trimmed(tuple(kept)))
