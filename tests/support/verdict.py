"""Judgement of one reduction by exact rational arithmetic: what was asked of it and how far off it is.

Everything is measured with plain numpy on the matrices that were returned; nothing here rounds but the comparison.
"""

from dataclasses import dataclass

import control
import flint
import numpy as np
import numpy.typing as npt
from scipy.linalg.lapack import dgebal
from scipy.optimize import linear_sum_assignment

from support.rational import RationalTransfer

ComplexArray = npt.NDArray[np.complex128]
FloatArray = npt.NDArray[np.float64]

EPS = float(np.finfo(float).eps)
DEEP = 1e-2  #: of the largest entry at any frequency: where the roll-off is deep


@dataclass(frozen=True, eq=False)
class Improved:
    """A state space and the polynomial that it lacks: ``C (sI - A)^-1 B + D + D_1 s + D_2 s^2 + ...``."""

    A: FloatArray  #: (N, N)
    B: FloatArray  #: (N, m)
    C: FloatArray  #: (p, N)
    D: FloatArray  #: (p, m)
    polynomial: tuple[FloatArray, ...] = ()  #: (p, m) each

    @classmethod
    def of(cls, system: control.StateSpace, polynomial: tuple[FloatArray, ...] = ()) -> "Improved":
        """Take the matrices of a system."""
        A, B, C, D = (np.asarray(matrix, dtype=float) for matrix in (system.A, system.B, system.C, system.D))
        return cls(A, B, C, D, polynomial)

    def balanced(self) -> "Improved":
        """Give the system with its states in units of a balanced A: powers of two, so that nothing is rounded."""
        A, scale = balanced(self.A)
        return Improved(A, self.B / scale[:, None], self.C * scale, self.D, self.polynomial)

    def at(self, points: npt.ArrayLike) -> ComplexArray:
        """Evaluate by a plain solve at each point: (p, m, k)."""
        unit = np.eye(len(self.A))
        values = [
            self.C @ np.linalg.solve(s * unit - self.A, self.B) + self.D for s in np.atleast_1d(np.asarray(points))
        ]
        return np.stack(values, axis=2) + polynomial_at(self.polynomial, points, self.D.shape)

    def exactly_at(self, points: npt.ArrayLike) -> ComplexArray:
        """Evaluate in 600 bits, so that what these numbers lose is told from what an evaluation of them loses."""
        with flint.ctx.workprec(600):
            values = [self._exactly(complex(s)) for s in np.atleast_1d(np.asarray(points))]
        return np.stack(values, axis=2)

    def terms_at(self, points: npt.ArrayLike) -> FloatArray:
        """Evaluate the sizes of what is summed, where ``x = (A x + B) / s``: (p, m, k)."""
        A, B, C, D = (np.abs(part) for part in (self.A, self.B, self.C, self.D))
        values = []
        for s in np.atleast_1d(np.asarray(points)):
            x = np.abs(np.linalg.solve(s * np.eye(len(A)) - self.A, self.B))
            values.append(C @ (x + (A @ x + B) / abs(s)) + D)
        return np.stack(values, axis=2)

    def _exactly(self, s: complex) -> ComplexArray:
        point = flint.acb(s.real, s.imag)
        value = _ball_matrix(self.D)
        if len(self.A):
            pencil = _ball_matrix(-self.A)
            for k in range(len(self.A)):
                pencil[k, k] = pencil[k, k] + point
            value = value + _ball_matrix(self.C) * pencil.solve(_ball_matrix(self.B))
        power = flint.acb(1)
        for part in self.polynomial:
            power = power * point
            value = value + _ball_matrix(part) * power
        return np.array([[complex(value[i, j]) for j in range(value.ncols())] for i in range(value.nrows())])


def _ball_matrix(values: FloatArray) -> flint.acb_mat:
    rows, columns = values.shape
    entries = [flint.acb(value) for value in np.asarray(values, dtype=float).ravel().tolist()]
    return flint.acb_mat(int(rows), int(columns), entries)


def balanced(A: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Balance rows and columns by powers of two: LAPACK itself, as scipy's wrapper fails where units lie far apart."""
    if not len(A):
        return A, np.ones(0)
    even, _, _, scale, _ = dgebal(A, permute=0, scale=1)
    return np.asarray(even, dtype=float), np.asarray(scale, dtype=float)


def polynomial_at(parts: tuple[FloatArray, ...], points: npt.ArrayLike, shape: tuple[int, ...]) -> ComplexArray:
    """Evaluate ``D_1 s + D_2 s^2 + ...``: (p, m, k)."""
    s = np.atleast_1d(np.asarray(points, dtype=np.complex128))
    value = np.zeros((*shape, s.size), dtype=np.complex128)
    for power, part in enumerate(parts, 1):
        value += part[:, :, None] * s**power
    return value


def transfer_errors(
    actual: ComplexArray, desired: ComplexArray, also: ComplexArray | FloatArray | None = None
) -> FloatArray:
    """Give at each of k points the largest error of (p, m, k) responses over the largest entry there.

    Where H is a sum of which a part, `also`, is larger than itself, the error is taken over the largest of that part.
    """
    size = np.abs(desired).max(axis=(0, 1), initial=0.0)
    if also is not None:
        size = np.maximum(size, np.abs(also).max(axis=(0, 1), initial=0.0))
    error = np.abs(actual - desired).max(axis=(0, 1), initial=0.0)
    return np.asarray(error / np.where(size > 0.0, size, 1.0))


def roll_off_error(actual: ComplexArray, desired: ComplexArray) -> float:
    """Give the largest error of (c, k) channels where all are below a hundredth of the largest entry at any point.

    It is relative to that largest entry: deep in the roll-off digits are counted from where the response came from.
    """
    at_points = np.abs(desired).max(axis=0, initial=0.0)
    size = float(at_points.max(initial=0.0))
    deep = at_points < DEEP * size
    return float(np.abs(actual - desired)[:, deep].max(initial=0.0)) / size if deep.any() else 0.0


def polynomial_error(actual: tuple[FloatArray, ...], desired: tuple[FloatArray, ...]) -> float:
    """Give the largest error of the coefficients over the largest of the same power; inf if powers differ."""
    if len(actual) != len(desired):
        return float("inf")
    errors = [np.abs(a - d).max() / np.abs(d).max() for a, d in zip(actual, desired, strict=True) if d.any()]
    strays = [np.abs(a).max() for a, d in zip(actual, desired, strict=True) if not d.any()]
    return float(max([*errors, *strays], default=0.0))


def characteristic_error(A: FloatArray, exact: RationalTransfer, points: npt.ArrayLike) -> float:
    """Compare ``det(sI - A)`` with the exact monic polynomial, relative to it; free of how eigenvalues cluster."""
    signs, logs = exact.characteristic(points)
    worst = 0.0
    for s, sign, log in zip(np.atleast_1d(np.asarray(points)), signs, logs, strict=True):
        found_sign, found_log = np.linalg.slogdet(s * np.eye(len(A)) - A)
        with np.errstate(over="ignore"):
            worst = max(worst, abs(found_sign * np.exp(found_log - log) / sign - 1.0))
    return worst


def eigenvalue_error(A: FloatArray, exact: RationalTransfer, floor: float = 1.0) -> float:
    """Match eigenvalues with the certified ones; the worst error to the power of the multiplicity, over the scale.

    An eigenvalue that occurs k times moves by the k-th root of a perturbation; its error is raised to the k-th power.
    The scale is the spectral norm of the balanced A, the largest eigenvalue, or `floor` [rad/s] if that is larger.
    """
    values, times = exact.eigenvalues()
    if len(A) != times.sum():
        return float("inf")
    if not len(A):
        return 0.0
    even, _ = balanced(A)
    scale = max(float(np.linalg.norm(even, 2)), float(np.abs(values).max()), floor)
    found = np.linalg.eigvals(even) / scale
    wanted, powers = np.repeat(values, times) / scale, np.repeat(times, times)
    distance = np.abs(found[:, None] - wanted)
    rows, columns = linear_sum_assignment(distance)
    return float((distance[rows, columns] ** powers[columns]).max())
