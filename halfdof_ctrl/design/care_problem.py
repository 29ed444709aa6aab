"""The Riccati equation (30) as data, its solution, and what rounding of its entries does to the gain."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from halfdof_ctrl.base.arrays import UNIT_ROUNDOFF, FloatArray
from halfdof_ctrl.base.spectrum import balanced_states

SAMPLES = 3  #: random roundings
CAUTION = 3.0  #: times the largest sample: what is stated of roundings; true ones reach 1.3 of it


@dataclass(frozen=True, slots=True, eq=False)
class CareProblem:
    """Equation (30) for N states and m inputs."""

    A: FloatArray
    B: FloatArray
    Q: FloatArray
    R: FloatArray
    N: FloatArray
    sizes: FloatArray | None = None  #: (N, N) what rounding errors of A are relative to; None for its entries
    left_out: FloatArray | None = None  #: (N, N) what was taken from A as being rounding of nothing
    shown: FloatArray | None = None  #: (N, N) K shown is the gain that errors are judged by; None for balanced states


@dataclass(frozen=True, slots=True, eq=False)
class CareSolution:
    """The stabilizing solution of (30)."""

    K: FloatArray  #: (m, N)
    X: FloatArray  #: (N, N)
    error: float  #: of K as the solution for the entries as they are, relative to each input's gain
    rounding: float  #: what rounding of A, B, Q and N, and what was left out, do to K, relative to each input's gain
    of_effort: float  #: the same, relative to the effort of all inputs together
    closed: FloatArray  #: (N, N) A - B K


@dataclass(frozen=True, slots=True, eq=False)
class Roundings:
    """Random roundings of a problem near its solution."""

    problem: CareProblem
    X: FloatArray
    gain: FloatArray

    def samples(self) -> Iterator[tuple[FloatArray, FloatArray]]:
        """Give S and D of ``F^T dX + dX F = -S``, ``R dK = B^T dX + D``, for one random rounding after the other.

        The last is for what was left out.
        """
        problem = self.problem
        of_A = np.abs(problem.A) if problem.sizes is None else np.where(problem.A != 0.0, problem.sizes, 0.0)
        for seed in range(SAMPLES):
            generator = np.random.default_rng(seed)
            dA, dB, dN, dQ = (
                UNIT_ROUNDOFF * part * generator.uniform(-1.0, 1.0, part.shape)
                for part in (of_A, problem.B, problem.N, problem.Q)
            )
            change = self.X @ dA - (self.X @ dB + dN) @ self.gain
            yield (dQ + dQ.T) / 2.0 + change + change.T, dB.T @ self.X + dN.T
        if problem.left_out is not None and problem.left_out.any():
            change = self.X @ problem.left_out
            yield change + change.T, np.zeros_like(problem.B.T)

    def errors(self, changes: list[FloatArray]) -> tuple[float, float]:
        """Return what is stated of the changes of the gain.

        Relative to the gain of each input, and, by effort, to that of all.
        """
        shown = self.problem.shown
        if shown is None:
            shown = np.diag(balanced_states(self.problem.A)[1])
        gain, unit = self.gain @ shown, np.ones(len(shown))

        def largest(nothing: float) -> float:
            return max(relative_change(change @ shown, gain, self.problem.R, unit, nothing) for change in changes)

        return CAUTION * largest(UNIT_ROUNDOFF), CAUTION * largest(1.0)


def relative_change(change: FloatArray, gain: FloatArray, R: FloatArray, motion: FloatArray, nothing: float) -> float:
    """Compare the change of a gain with the gain, input by input.

    Parameters
    ----------
    change, gain : (m, N) ndarrays
    R : (m, m) ndarray
        What the inputs cost: a gain whose effort is below the part `nothing` of the largest one counts as that.
    motion : (N,) ndarray
        Sizes of the states, by which the entries of a row are weighed.
    nothing : float
    """
    cost = np.sqrt(np.diagonal(R))
    changed, sizes = (cost * np.linalg.norm(part * motion, axis=1) for part in (change, gain))
    if not np.isfinite(changed).all():
        return float("inf")
    sizes = np.maximum(sizes, nothing * sizes.max(initial=0.0))
    moved = changed > 0.0
    return float((changed[moved] / np.maximum(sizes[moved], np.finfo(float).tiny)).max(initial=0.0))
