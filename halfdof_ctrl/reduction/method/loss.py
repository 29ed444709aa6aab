"""What the stored A, B, C, D lose against M, C, K, measured at the frequencies where it shows.

Let x be the response of the stored system at s, known to the last digit, and q what it says of all DOFs. Had A and B no
rounding errors, q would satisfy the equation of motion. What is left of that,

    r = B(s) - P(s) q,                                                                     (29)

is a force, and the response to it is what is lost, to first order in the loss: H = F(s) (q + P(s)^-1 r) + D(s), beside
what C and D say. Both x and the residual (29) are summed in twice the working precision, since what is looked for is
smaller than the rounding of either; of P(s)^-1 r the first digit counts. Derivation: docs/explanation/evaluation.md.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import scipy.linalg
from scipy.linalg.lapack import dgetrf, zgetrf
from scipy.sparse import csc_array
from scipy.sparse.linalg import ArpackError, ArpackNoConvergence, LinearOperator, eigs

from halfdof_ctrl.base.arrays import EPS, ComplexArray, FloatArray, IndexArray, Matrix
from halfdof_ctrl.base.exact_products import ExactPolynomial
from halfdof_ctrl.base.spectrum import balanced_states, eigenvalues_and_rounding
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.reduction.method.signals import Signal

ALL_EIGENVALUES = 60  #: up to which all eigenvalues are computed to choose the frequencies
SLOW_MODES = 6  #: of more states, that are looked for
SLOW_MODES_ACCURACY = 1e-3  #: accuracy of these
MOST_FREQUENCIES = 4  #: frequencies at which the loss is measured
MOST_INPUTS = 8  #: columns of B for which it is measured, spread over all
BESIDE_MODE = 1.003  #: times the frequency of a mode: an undamped resonance itself determines nothing
AT_ORIGIN = 1e-12  #: of the largest eigenvalue found: one below is no frequency
BESIDE_ZERO = 1e-3  #: of the mean size of the eigenvalues: where slow ones are looked for if A is singular
TRIED_ROUNDINGS = 2  #: of M, C, K at random
ZERO_CHANNEL = 100.0  #: times what these change in it: a smaller channel is zero
LOSS_SPARSE_SHARE = 0.1  #: a matrix with a smaller share of entries is multiplied as a sparse one


@dataclass(frozen=True, slots=True)
class Loss:
    """How much of a channel's largest value is lost, where that is most."""

    value: float = 0.0
    omega: float = float("nan")  #: [rad/s]


NOTHING_LOST = Loss()


class Stored(Protocol):
    """What is looked at: a reduction with n DOFs, N states, m inputs and p outputs."""

    @property
    def model(self) -> SecondOrderModel:
        """The model that was reduced."""

    @property
    def A(self) -> FloatArray:  # noqa: N802
        """(N, N) state matrix."""

    @property
    def B(self) -> FloatArray:  # noqa: N802
        """(N, m) input matrix."""

    def output(self, model: SecondOrderModel) -> Signal:
        """Return the outputs of a model that differs in them alone."""

    def motion_at(self, x: FloatArray, inputs: Sequence[FloatArray], derivative: int) -> FloatArray:
        """Return all DOFs, (n, k), for states (N, k) and inputs and their derivatives (m, k)."""

    def answer(self, states: "StateSolver", force: ComplexArray) -> ComplexArray:
        """Return the response of all DOFs, (n, k), to forces (n, k), to a digit or two."""


def measured_loss(stored: Stored) -> Loss:
    """Measure what A, B, C, D lose, relative to each channel's largest value at the frequencies that are looked at."""
    m = stored.B.shape[1]
    chosen = np.unique(np.linspace(0, m - 1, min(m, MOST_INPUTS)).astype(np.intp))
    equation, output = equation_of_motion(stored.model), stored.output(stored.model)
    points, lost, values, undetermined = [], [], [], []
    for s in loss_points(stored.A):
        try:
            error, value, data = _lost_at(stored, equation, output, s, chosen)
        except np.linalg.LinAlgError:  # an eigenvalue, at which nothing is determined
            continue
        points.append(float(abs(s)))
        lost.append(error)
        values.append(value)
        undetermined.append(data)
    if not lost:
        return NOTHING_LOST
    largest = np.broadcast_to(np.max(values, axis=0), np.shape(lost))
    seen = largest > np.maximum(np.max(undetermined, axis=0), _rounding_of_zeros(largest[0]))
    relative = np.divide(lost, largest, out=np.zeros(largest.shape), where=seen)
    worst = np.unravel_index(int(relative.argmax()), relative.shape)
    return Loss(float(relative[worst]), points[int(worst[0])])


def _rounding_of_zeros(largest: FloatArray) -> FloatArray:
    """Return below which size a channel is zero but for rounding, in units that rows and columns have."""
    rows = largest.max(axis=1, keepdims=True)
    across = np.divide(largest, rows, out=np.zeros_like(largest), where=rows > 0.0).max(axis=0)
    return np.asarray(ZERO_CHANNEL * EPS * rows * across)


def equation_of_motion(model: SecondOrderModel) -> ExactPolynomial:
    """Return P(s) = K + C s + M s^2 for residuals in twice the working precision."""
    return ExactPolynomial([_as_it_is(matrix) for matrix in model.quadratics.P])


def loss_points(A: FloatArray) -> ComplexArray:
    """Choose points on the imaginary axis: beside the slowest oscillations and at the slowest real pole."""
    poles, bounds = _slow_eigenvalues(A)
    moving = poles[np.abs(poles) > bounds]
    moving = moving[np.argsort(np.abs(moving))]
    swinging, real = np.abs(moving[moving.imag > 0.0]), np.abs(moving[moving.imag == 0.0])
    chosen = np.concatenate([swinging[: MOST_FREQUENCIES - 1], real[:1]])
    return np.asarray(1j * BESIDE_MODE * (chosen if chosen.size else np.ones(1)))


def _slow_eigenvalues(A: FloatArray) -> tuple[ComplexArray, FloatArray]:
    """Return all eigenvalues of a small matrix or the smallest ones, and up to which size they may be zero."""
    N = len(A)
    if N <= ALL_EIGENVALUES:
        poles, rounding = eigenvalues_and_rounding(A)
        return poles, rounding + AT_ORIGIN * np.abs(poles).max(initial=0.0)
    matrix, _ = balanced_states(A)
    factors, shift = dgetrf(matrix)[:2], 0.0  # says nothing of free motions, which are looked after below
    pivots = np.abs(np.diag(factors[0]))
    if pivots.min() <= N * EPS * pivots.max():  # free motions: look beside zero
        shift = -BESIDE_ZERO * float(np.exp(np.log(np.maximum(pivots, EPS * pivots.max())).mean()))
        factors = dgetrf(matrix - shift * np.eye(N))[:2]
    inverse = LinearOperator(
        (N, N), matvec=lambda v: scipy.linalg.lu_solve(factors, v, check_finite=False), dtype=np.float64
    )
    start = np.random.default_rng(0).standard_normal(N)
    try:
        found = eigs(inverse, k=SLOW_MODES, v0=start, tol=SLOW_MODES_ACCURACY, return_eigenvectors=False)
    except ArpackNoConvergence as some:
        found = np.asarray(some.eigenvalues)
    except ArpackError:
        found = np.zeros(0, dtype=complex)
    poles = np.asarray(shift + 1.0 / found[found != 0.0], dtype=np.complex128)
    return poles, np.full(
        poles.size, (AT_ORIGIN if shift == 0.0 else SLOW_MODES_ACCURACY) * np.abs(poles).max(initial=0.0)
    )


def _lost_at(
    stored: Stored, equation: ExactPolynomial, output: Signal, s: complex, chosen: IndexArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the size of what is lost, of the value, and below which it is zero, (p, k) each, for k chosen inputs."""
    model = stored.model
    states = StateSolver(stored.A, s)
    x = states.solve_exactly(stored.B[:, chosen].astype(np.complex128))
    unit = np.eye(stored.B.shape[1])[:, chosen]
    powers = [s**power for power in range(max(3, len(output.U)))]
    q = np.empty((len(model.dofs), chosen.size), dtype=np.complex128)
    q.real = stored.motion_at(x.real.copy(), [power.real * unit for power in powers], 0)
    q.imag = stored.motion_at(x.imag.copy(), [power.imag * unit for power in powers], 0)
    rest = equation.residual(s, q, _at(model.quadratics.B, s, chosen))
    value = _at(model.quadratics.D, s, chosen) + _seen(model, s, q)
    said = np.asarray(output.X @ x)
    for power, part in zip(powers, output.U, strict=False):
        said = said + power * part[:, chosen]
    missed = np.asarray(value - said + _seen(model, s, stored.answer(states, rest)))
    terms = sum(abs(s) ** power * (abs(matrix) @ np.abs(q)) for power, matrix in enumerate(model.quadratics.P))
    generator = np.random.default_rng(0)
    rounded = [EPS * terms * generator.uniform(-1.0, 1.0, q.shape) for _ in range(TRIED_ROUNDINGS)]
    data = [np.abs(_seen(model, s, stored.answer(states, force.astype(np.complex128)))) for force in rounded]
    return np.abs(missed), np.abs(value), ZERO_CHANNEL * np.max(data, axis=0)


class StateSolver:
    """``(s I - A)^-1``, factorized; where k states are derivatives of others, with k rows and columns less.

    With ``A = [0 E; P R]``, E diagonal, of the k first rows ``E v = s p - b`` follows, and

        (s - R) v - P p = c   is   ((s - R) E^-1 s - P) p = c + (s - R) E^-1 b.

    Raises
    ------
    numpy.linalg.LinAlgError
        s is an eigenvalue.
    """

    def __init__(self, A: FloatArray, s: complex) -> None:
        self.s = s
        self.matrix, self.scale = balanced_states(A)
        N = len(A)
        self.k = k = _derivatives(self.matrix)
        self.rates = np.diagonal(self.matrix[:k, N - k :])[:, None].copy()
        lower = s * np.eye(N)[k:] - self.matrix[k:]
        self.onto = lower[:, N - k :] / self.rates.T
        reduced = lower[:, : N - k].copy()
        reduced[:, :k] += s * self.onto
        self.factors = zgetrf(reduced)[:2] if N else None
        if self.factors is not None and not np.abs(np.diag(self.factors[0])).min() > 0.0:
            msg = "s is an eigenvalue"
            raise np.linalg.LinAlgError(msg)

    def solve(self, right: ComplexArray) -> ComplexArray:
        """Return ``(s I - A)^-1 right`` for an (N, k) array."""
        return np.asarray(self.scale[:, None] * self._solved(right / self.scale[:, None]))

    def solve_exactly(self, right: ComplexArray) -> ComplexArray:
        """Correct it once by a residual in twice the working precision."""
        scaled = right / self.scale[:, None]
        exact = ExactPolynomial([_as_it_is(-self.matrix), _as_it_is(np.eye(len(self.matrix)))])
        x = self._solved(scaled)
        return np.asarray(self.scale[:, None] * (x + self._solved(exact.residual(self.s, x, scaled))))

    def _solved(self, right: ComplexArray) -> ComplexArray:
        if self.factors is None:
            return right
        upper, k = right[: self.k], self.k
        first = scipy.linalg.lu_solve(self.factors, right[k:] + self.onto @ upper, check_finite=False)
        return np.concatenate([first, (self.s * first[:k] - upper) / self.rates])


def _derivatives(A: FloatArray) -> int:
    """Count the first states whose derivatives are last states, but for a factor."""
    N = len(A)
    for k in range(N // 2, 0, -1):
        block = A[:k, N - k :]
        if np.count_nonzero(A[:k]) == k and np.diagonal(block).all():
            return k
    return 0


def _seen(model: SecondOrderModel, s: complex, q: ComplexArray) -> ComplexArray:
    """Return ``F(s) q``."""
    parts = [s**power * np.asarray(part @ q) for power, part in enumerate(model.quadratics.F)]
    return np.asarray(parts[0] + parts[1] + parts[2])


def _at(coefficients: Sequence[Matrix], s: complex, columns: IndexArray) -> ComplexArray:
    """Return columns of a polynomial at s, dense."""
    parts = [part[:, columns] for part in coefficients]
    return np.asarray(
        sum(s**k * (part if isinstance(part, np.ndarray) else part.toarray()) for k, part in enumerate(parts))
    )


def _as_it_is(matrix: Matrix) -> Matrix:
    """Return a dense matrix with few entries as a sparse one."""
    few = isinstance(matrix, np.ndarray) and np.count_nonzero(matrix) < LOSS_SPARSE_SHARE * matrix.size
    return csc_array(matrix) if few else matrix
