"""Tests that a deflation must pass before it is given out, on P(s) and A alone.

    det P(s) = const det(s I - A)                                                          (19)

holds for every s if and only if A has the finite eigenvalues of the model, each as often. Three points near
the typical frequency and two beyond the fastest pole tell a count that is wrong: each eigenvalue too many or too few
changes the ratio between them by a power of the distance. Two more among the eigenvalues of A tell values that are
wrong. Far out P(s) can be so ill conditioned that floating point
does not know its determinant; that of small models is formed in integers then. What the state equations lose
against a direct solve at such points is measured as well.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from halfdof_ctrl.base.arrays import EPS, ComplexArray, FloatArray
from halfdof_ctrl.base.spectrum import balanced, balanced_states
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.reduction.algebra.integers import LARGEST_EXACT, as_integers, log_determinant
from halfdof_ctrl.reduction.algebra.scaling import max_scaling
from halfdof_ctrl.reduction.method.signals import Signal, StateEquations
from halfdof_ctrl.reduction.method.units import ScaledRows, Units, scaled_rows

NEAR_POINTS = (0.55 + 0.83j, 1.9 + 0.7j, 0.21 + 3.1j)  #: points in units of the time scale
RATIO_DRIFT = 0.01  #: change of the logarithm of the ratio in (19) that rounding may make
DRIFT_AMONG_POLES = 0.1  #: the same at points among the eigenvalues of A, which a loss that is told moves
AMONG_EIGENVALUES = (0.25, 0.75)  #: quantiles of their sizes at which such points are
NO_EIGENVALUE = 181  #: times a power of two: numbers of which no simple model has one as its eigenvalue
NEAR_EXACTLY = ((NO_EIGENVALUE, -9), (NO_EIGENVALUE, -7), (NO_EIGENVALUE, -5))  #: points at which integers give P(s)
STANDING = 1e-3  #: of the typical frequency and of the largest eigenvalue: smaller ones may stand for multiple zeros
SINGULAR_AT_POINTS = 64 * EPS  #: times n: P(s) is singular below this ratio of singular values
AXIS_POINTS = (0.29j, 1.03j, 3.71j)  #: points for the loss of digits, in units of the time scale
SOLVE_DOUBT = 4 * EPS  #: times n and the condition of P(s): differences that a direct solve may make


@dataclass(frozen=True, slots=True, eq=False)
class Losses:
    """What state equations lose against direct solves, for m inputs."""

    size: FloatArray  #: (m,) largest displacement under each input
    error: FloatArray  #: (m,) largest error in it
    worst: float  #: of the outputs, relative to the largest at its frequency, where the direct solve can tell


@dataclass(frozen=True, slots=True, eq=False)
class ScaledPencil:
    """The four quadratics of a model in scaled units, before any row operation: s in units of the time scale."""

    P: FloatArray  #: (3, n, n)
    B: FloatArray  #: (3, n, m)
    F: FloatArray  #: (3, p, n)
    D: FloatArray  #: (3, p, m)

    def at(self, s: complex) -> tuple[ComplexArray, ComplexArray]:
        """Evaluate P and B."""
        return _at(self.P, s), _at(self.B, s)

    def is_singular(self) -> bool:
        """Whether P(s) is singular to working precision at all points."""
        return bool(self.regularity() <= SINGULAR_AT_POINTS * self.P.shape[1])

    def regularity(self) -> float:
        """Return the smallest singular value of P(s) over the largest, where it is best of a few points."""
        return max(self._smallest(s) for s in NEAR_POINTS)

    def has_spectrum(self, A: FloatArray) -> bool:
        """Whether (19) holds for A in the same units."""
        if not np.isfinite(A).all():
            return False
        sizes = np.abs(np.linalg.eigvals(A))
        beyond = 1 + math.frexp(max(float(sizes.max(initial=0.0)), 1.0))[1]
        far = [(1, beyond), (1, beyond + 1), *self._among(sizes)]
        points = [*NEAR_POINTS, *(factor * 2.0**power for factor, power in far)]
        of_P = np.array([self._log_determinant(s) for s in points])
        if _is_constant(of_P - _log_characteristics(A, points)):
            return True
        if self.P.shape[1] > LARGEST_EXACT:
            return False
        short = [*NEAR_EXACTLY, *far]
        of_A = _log_characteristics(A, [factor * 2.0**power for factor, power in short])
        return _is_constant(self._exact_log_determinants(short) - of_A)

    def _among(self, sizes: FloatArray) -> list[tuple[int, int]]:
        """Return points among the eigenvalues of A, a factor and a power of two, of models that integers can judge.

        The typical frequency of a stiff model may lie far above all of them, where any slow ones look the same.
        """
        moving = sizes[sizes > STANDING * sizes.max(initial=1.0)]
        if not moving.size or self.P.shape[1] > LARGEST_EXACT:
            return []
        around = np.log2(np.quantile(moving, AMONG_EIGENVALUES) / NO_EIGENVALUE)
        return [(NO_EIGENVALUE, power) for power in sorted({round(float(power)) for power in around})]

    def _exact_log_determinants(self, points: list[tuple[int, int]]) -> FloatArray:
        """Return logarithms of the size of det P at whole numbers times powers of two."""
        integers, scale = as_integers(self.P)
        found = []
        for factor, power in points:
            down, up = max(-power, 0), max(power, 0)
            value = (
                (integers[0] << 2 * down) + (integers[1] * factor << up + down) + (integers[2] * factor**2 << 2 * up)
            )
            found.append(log_determinant(value) - self.P.shape[1] * (scale + 2 * down) * math.log(2.0))
        return np.array(found)

    def _log_determinant(self, s: complex) -> float:
        P, _ = self.at(s)
        scaling = max_scaling(np.abs(P), even=2.0)
        scale = float(np.log(scaling.rows).sum() + np.log(scaling.columns).sum())
        return float(np.linalg.slogdet(scaling.of(P))[1]) - scale

    def losses(self, equations: StateEquations) -> "Losses":
        """Compare the state equations, balanced, with direct solves at the points on the axis."""
        N, m = equations.B.shape
        A, factors = balanced_states(equations.A)
        into, X = equations.B / factors[:, None], equations.displacement.X * factors
        size, error, worst = np.zeros(m), np.zeros(m), 0.0
        for s in AXIS_POINTS:
            P, B = self.at(s)
            rows, columns = (factors[:, None] for factors in max_scaling(np.abs(P), even=2.0))
            matrix = P * rows * columns.T
            try:
                direct = columns * np.linalg.solve(matrix, rows * B)
                found = X @ np.linalg.solve(s * np.eye(N) - A, into + 0j)
            except np.linalg.LinAlgError:  # an eigenvalue
                continue
            for power, part in enumerate(equations.displacement.U):
                found = found + s**power * part
            size = np.maximum(size, np.abs(direct).max(axis=0, initial=0.0))
            error = np.maximum(error, np.abs(found - direct).max(axis=0, initial=0.0))
            F, output = _at(self.F, s), _at(self.F, s) @ direct + _at(self.D, s)
            lost = float(np.abs(F @ (found - direct)).max())
            doubt = float((np.abs(F) @ columns).max() * (np.abs(direct) / columns).max()) * np.linalg.cond(matrix)
            if output.any() and lost > SOLVE_DOUBT * len(matrix) * doubt:
                worst = max(worst, lost / float(np.abs(output).max()))
        return Losses(size, error, worst)

    def expected_loss(self, equations: StateEquations) -> float:
        """Bound what rounding A and B to double precision makes of the outputs, relative to the largest.

        At the points on the axis, entry by entry, ``eps |F X (s I - A)^-1| (|A| |x| + |B|)``: the same in any units of
        the states, and, unlike a measured error, the same for models that differ by rounding.
        """
        N = len(equations.A)
        A, factors = balanced_states(equations.A)
        into, X = equations.B / factors[:, None], equations.displacement.X * factors
        worst = 0.0
        for s in AXIS_POINTS:
            F, unit = _at(self.F, s), np.eye(N)
            try:
                inverse = np.linalg.solve(s * unit - A, unit + 0j)
            except np.linalg.LinAlgError:  # an eigenvalue
                continue
            x, through = inverse @ into, F @ X @ inverse
            output = through @ into + _at(self.D, s)
            for power, part in enumerate(equations.displacement.U):
                output = output + s**power * F @ part
            error = EPS * np.abs(through) @ (np.abs(A) @ np.abs(x) + np.abs(into))
            if output.any():
                worst = max(worst, float(error.max(initial=0.0)) / float(np.abs(output).max()))
        return worst

    def _scaled(self, s: complex) -> ComplexArray:
        P, _ = self.at(s)
        return np.asarray(max_scaling(np.abs(P), even=2.0).of(P))

    def _smallest(self, s: complex) -> float:
        values = np.linalg.svd(self._scaled(s), compute_uv=False)
        return float(values[-1] / values[0]) if values[0] > 0.0 else 0.0


def _log_characteristics(A: FloatArray, points: Sequence[complex]) -> FloatArray:
    """Return logarithms of the size of ``det(s I - A)``."""
    return np.array([np.linalg.slogdet(s * np.eye(len(A)) - A)[1] for s in points])


def _is_constant(ratios: FloatArray) -> bool:
    """Return whether logarithms of the ratio in (19) are the same at all points; the last ones are among the poles."""
    first = len(NEAR_POINTS) + 2
    with np.errstate(invalid="ignore"):
        return bool(
            np.ptp(ratios[:first]) <= RATIO_DRIFT
            and not (np.abs(ratios[first:] - ratios[first - 2]) > DRIFT_AMONG_POLES).any()
        )


def _at(coefficients: FloatArray, s: complex) -> ComplexArray:
    """Evaluate a matrix polynomial."""
    return np.asarray(np.tensordot(s ** np.arange(len(coefficients)), coefficients, axes=1))


def has_spectrum(model: SecondOrderModel, A: FloatArray) -> bool:
    """Tell by equation (19) whether A, by whatever method, has the finite eigenvalues of a model, each as often."""
    _, units, pencil = scaled_pencil(model)
    return pencil.has_spectrum(balanced(np.asarray(A / units.time)))


def expected_loss(model: SecondOrderModel, equations: StateEquations) -> float:
    """Bound what state equations, by whatever method, lose by being rounded."""
    pencil, scaled = in_scaled_units(model, equations)
    return pencil.expected_loss(scaled)


def in_scaled_units(model: SecondOrderModel, equations: StateEquations) -> tuple[ScaledPencil, StateEquations]:
    """Return the pencil to be proved against, and the state equations in its units."""
    _, units, pencil = scaled_pencil(model)
    q, across = equations.displacement, units.inputs / units.columns[:, None]
    scaled = StateEquations(
        A=np.asarray(equations.A / units.time),
        B=equations.B * units.inputs / units.time,
        displacement=Signal(
            q.X / units.columns[:, None], tuple([units.by_time(part * across, k) for k, part in enumerate(q.U)])
        ),
        shift=(),
    )
    return pencil, scaled


def scaled_pencil(model: SecondOrderModel) -> tuple[ScaledRows, Units, ScaledPencil]:
    """Return the rows of a model in scaled units, the units, and the pencil to be proved against."""
    rows, units = scaled_rows(np.stack(model.quadratics.P), np.stack(model.quadratics.B))
    n = len(model.dofs)
    powers = np.arange(3)[:, None, None]
    pencil = ScaledPencil(
        P=rows.coefficients[:, :, :n],
        B=rows.coefficients[:, :, n:],
        F=units.by_time(np.stack(model.quadratics.F) * units.columns, powers),
        D=units.by_time(np.stack(model.quadratics.D) * units.inputs, powers),
    )
    return rows, units, pencil
