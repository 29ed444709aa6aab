"""First-order pencil of a quadratic matrix polynomial, for the oracle.

The eigenvalues of ``R_0 + R_1 s + R_2 s^2`` are those of the pencil in (q, w), w = V^T q', that follows from a
factorization R_2 = U V^T with as many columns as its rank r:

    [ R_1  U ] [q']   [ -R_0  0 ] [q]
    [ V^T  0 ] [w'] = [   0   I ] [w]                                                      (8)

It has dimension n + r. A companion form has 2n - (n + r) eigenvalues at infinity besides, which belong to the
velocities of directions without mass.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg

from halfdof_ctrl.base.arrays import EPS, DenseMatrix, FloatArray
from halfdof_ctrl.descriptor.balancing import balancing_powers, scaling_powers
from halfdof_ctrl.descriptor.patterns import connected_parts
from halfdof_ctrl.descriptor.staircase import ZERO_PIVOT
from halfdof_ctrl.model.second_order import SecondOrderModel


@dataclass(frozen=True, slots=True, eq=False)
class FirstOrderPencil:
    """``A - s E`` of equation (8), balanced."""

    A: DenseMatrix  #: (k + r, l + r) for coefficients of shape (k, l) and rank R_2 = r
    E: DenseMatrix  #: likewise
    scale: float  #: unit of time: eigenvalues times this are in rad/s


def first_order_pencil(coefficients: Sequence[DenseMatrix]) -> FirstOrderPencil:
    """Write ``R_0 + R_1 s + R_2 s^2`` as the pencil (8), square or not."""
    scale = time_scale(coefficients)
    R0, R1, R2 = coefficients[0], coefficients[1] * scale, coefficients[2] * scale * scale  # scale^2 may overflow
    rows, columns = balancing_powers(np.maximum(np.maximum(np.abs(R0), np.abs(R1)), np.abs(R2)))
    R0, R1, R2 = (matrix * rows[:, None] * columns for matrix in (R0, R1, R2))
    left, right = _low_rank_factors(R2)
    rank = right.shape[0]
    corner = np.zeros((rank, rank))
    E = np.block([[R1, left], [right, corner]])
    A = np.block([[-R0, np.zeros_like(left)], [np.zeros_like(right), np.eye(rank)]])
    return FirstOrderPencil(A, E, scale)


def _low_rank_factors(matrix: DenseMatrix) -> tuple[DenseMatrix, DenseMatrix]:
    """Factor a matrix as L R with as many columns in L as its rank, one connected part of its pattern at a time."""
    lefts, rights = [np.zeros((matrix.shape[0], 0))], [np.zeros((0, matrix.shape[1]))]
    for rows, columns in connected_parts(matrix != 0.0):
        left, right = _factors_of_part(matrix[np.ix_(rows, columns)])
        L, R = np.zeros((matrix.shape[0], len(right)), left.dtype), np.zeros((len(right), matrix.shape[1]), right.dtype)
        L[rows], R[:, columns] = left, right
        lefts.append(L)
        rights.append(R)
    return np.hstack(lefts), np.vstack(rights)


def _factors_of_part(part: DenseMatrix) -> tuple[DenseMatrix, DenseMatrix]:
    down, across = scaling_powers(np.abs(part))
    left, values, right = scipy.linalg.svd(part * down[:, None] * across, full_matrices=False)
    rank = int(np.count_nonzero(values > ZERO_PIVOT * max(part.shape) * values[0]))
    left, right = left[:, :rank], right[:rank]
    speck = max(part.shape) * EPS * values[0] / values[rank - 1]
    left, right = (np.where(np.abs(vectors) <= speck, 0.0, vectors) for vectors in (left, right))
    return left * values[:rank] / down[:, None], right / across


def time_scale(coefficients: Sequence[DenseMatrix]) -> float:
    """Return a typical frequency as a power of two: the mean, in the logarithm, of what each entry has to say.

    A place (i, j) with entries in R_h and R_l, h > l the highest and the lowest there are, balances at the frequency
    ``|R_l,ij / R_h,ij|^(1 / (h - l))``, in any unit of its row and column. Where no place has two, rows are asked.
    """
    sizes = np.array([np.abs(matrix) for matrix in coefficients])
    logs = _balances(sizes.reshape(len(sizes), -1))
    if not logs.size:
        logs = _balances(sizes.max(axis=2, initial=0.0))
    return float(2.0 ** np.round(logs.mean())) if logs.size else 1.0


def _balances(sizes: FloatArray) -> FloatArray:
    """Return the logarithms of the frequencies at which the lowest and the highest of each column are equal."""
    present = sizes > 0.0
    several = present.sum(axis=0) > 1
    sizes, present = sizes[:, several], present[:, several]
    low, high = present.argmax(axis=0), len(sizes) - 1 - present[::-1].argmax(axis=0)
    every = np.arange(sizes.shape[1])
    return np.asarray((np.log2(sizes[low, every]) - np.log2(sizes[high, every])) / (high - low))


def typical_frequency(model: SecondOrderModel) -> float:
    """Return a frequency [rad/s], a power of two, at which the model's rows balance in the mean."""
    return time_scale(model.quadratics.P)
