"""Eigenvalues that rounding does not tell apart one by one, from the invariant subspace that they share.

With bases V and W of the right and the left invariant subspace of a cluster of m eigenvalues of A, ``W^H V = I``,

    B = W^H A V,    data = 2 u |W|^H |A| |V|

is a small matrix that has them, and what rounding of the entries of A makes of it. The residual ``A V - V B`` is formed
in about twice the working precision and corrects B. With N = B - mean, an eigenvalue of B + E lies no farther from the
mean than the y for which

    2 |E| (1 / y + |N| / y^2 + ... + |N^(m-1)| / y^m) = 1,    2 |N^m| <= y^m,

since the resolvent of B is smaller than 1 / |E| outside. That is |E| where N is zero, and an m-th root where the m are
one chain; several equal chains have the root of one of them (P. Henrici, 1962, with powers in the place of the norm's).
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy.linalg
from scipy.linalg.lapack import ztrsen, ztrsyl
from scipy.optimize import linear_sum_assignment
from scipy.sparse.csgraph import connected_components

from halfdof_ctrl.base.arrays import UNIT_ROUNDOFF, ComplexArray, FloatArray
from halfdof_ctrl.base.double_double import matrix_product

NEIGHBOURHOOD = 16.0  #: times what rounding moves it: as far an eigenvalue reaches for others ...
ONE_POLE = 1e-10  #: ... and this part of its size in any case
DEFECTIVE = 16.0  #: times n u: cosines of left and right vectors below say no more than that there is a chain ...
CHAIN = 1e-2  #: ... whose eigenvalues lie within this part of their size, or as close as rounding of the largest
SINGLE_SHARE = 0.1  #: of the distance to the next eigenvalue: a smaller bound of first order holds
RADIUS_HALVINGS = 200  #: of the bracket of a radius, in logarithms


@dataclass(frozen=True, slots=True, eq=False)
class Cluster:
    """Eigenvalues that share an invariant subspace, with their bounds."""

    places: npt.NDArray[np.intp]  #: (m,) among the eigenvalues
    values: ComplexArray  #: (m,)
    bounds: FloatArray  #: (m,)


def clusters(A: FloatArray, values: ComplexArray, data: FloatArray, cosine: FloatArray) -> list[Cluster]:
    """Find the eigenvalues that are not told apart, and bound them together.

    Parameters
    ----------
    A : (n, n) ndarray
    values : (n,) complex ndarray
        Its eigenvalues.
    data, cosine : (n,) ndarray
        What rounding moves each by, to first order, and the cosine between its left and right vector.

    Returns
    -------
    list of Cluster
        Those of conjugates are conjugates.
    """
    groups = _groups(A, values, data, cosine)
    if not groups:
        return []
    T, Z = scipy.linalg.schur(A.astype(np.complex128), output="complex")
    _, places = linear_sum_assignment(np.abs(values[:, None] - np.diag(T)))
    found = []
    for group in groups:
        imaginary = values[group].imag
        is_real = _is_own_conjugate(values[group])
        if not is_real and imaginary.sum() < 0.0:
            continue  # comes with its conjugate
        eigenvalues, bounds = _bounded(A, *_bases(T, Z, places[group], is_real=is_real), values, group)
        pairing = linear_sum_assignment(np.abs(values[group][:, None] - eigenvalues))[1]
        eigenvalues, bounds = eigenvalues[pairing], bounds[pairing]
        found.append(Cluster(group, eigenvalues, bounds))
        if not is_real:
            found.append(Cluster(group + 1, eigenvalues.conj(), bounds))  # LAPACK puts conjugates side by side
    return found


def _groups(A: FloatArray, values: ComplexArray, data: FloatArray, cosine: FloatArray) -> list[npt.NDArray[np.intp]]:
    """Return which eigenvalues reach for each other, in groups of at least two."""
    n, size = values.size, float(np.linalg.norm(A, 1))
    chain = CHAIN * np.abs(values) + NEIGHBOURHOOD * UNIT_ROUNDOFF * size
    reach = np.where(cosine > DEFECTIVE * n * UNIT_ROUNDOFF, NEIGHBOURHOOD * np.minimum(data, size), chain)
    linked = np.abs(values[:, None] - values) <= np.maximum(reach[:, None] + reach, ONE_POLE * np.abs(values))
    if np.count_nonzero(linked) == np.count_nonzero(np.diagonal(linked)):  # each but with itself, as mostly
        return []
    count, label = connected_components(linked, directed=False)
    groups = [np.flatnonzero(label == k) for k in range(count)]
    return [group for group in groups if group.size > 1]


def _is_own_conjugate(values: ComplexArray) -> bool:
    return bool(np.isin(values.conj(), values).all())


def _bases(
    T: ComplexArray, Z: ComplexArray, places: npt.NDArray[np.intp], *, is_real: bool
) -> tuple[ComplexArray, ComplexArray]:
    """Return V and W^H of the eigenvalues in some places of the diagonal of a Schur form ``A = Z T Z^H``."""
    m = places.size
    select = np.zeros(len(T), dtype=np.int32)
    select[places] = 1
    ordered, turned = (np.asarray(part) for part in ztrsen(select, T, Z, job="N")[:2])
    V, left = turned[:, :m], np.eye(m, len(T), dtype=np.complex128)
    if m < len(T):
        right, scale, _ = ztrsyl(ordered[:m, :m], ordered[m:, m:], ordered[:m, m:], isgn=-1)
        left[:, m:] = np.asarray(right) / scale
    W = left @ turned.conj().T
    if is_real:
        V = np.linalg.svd(np.hstack([V.real, V.imag]))[0][:, :m].astype(np.complex128)
        W = np.linalg.solve(W @ V, W).real.astype(np.complex128)
    return V, np.linalg.solve(W @ V, W)


def _bounded(
    A: FloatArray, V: ComplexArray, W: ComplexArray, values: ComplexArray, group: npt.NDArray[np.intp]
) -> tuple[ComplexArray, FloatArray]:
    """Return the eigenvalues of a cluster, and how far rounding of A may have moved each."""
    B: ComplexArray = W @ (A @ V)
    rest = _residual(A, V, B)
    correction = W @ rest
    B = B + correction
    others = np.delete(values, group)
    gap = float(np.abs(others[:, None] - values[group]).min(initial=np.inf))
    outside = np.linalg.norm(rest - V @ correction) * np.linalg.norm(W @ A - B @ W) / gap if others.size else 0.0
    data = np.linalg.norm(np.abs(W) @ (np.abs(A) @ np.abs(V)))
    error = UNIT_ROUNDOFF * float(2.0 * data + 4.0 * np.linalg.norm(B)) + float(outside)
    triple = scipy.linalg.eig(B if B.imag.any() else B.real, left=True, right=True)
    eigenvalues, left, right = (np.asarray(part, dtype=np.complex128) for part in triple)
    mean = complex(np.trace(B)) / group.size
    bounds = _radius(B - mean * np.eye(group.size), error) + np.abs(eigenvalues - mean)
    with np.errstate(divide="ignore"):
        single = error / np.abs(np.einsum("ij,ij->j", left.conj(), right))
    distance = np.abs(eigenvalues[:, None] - eigenvalues)
    np.fill_diagonal(distance, np.inf)
    is_single = single <= SINGLE_SHARE * distance.min(axis=1)
    return eigenvalues, np.where(is_single, np.minimum(single, bounds), bounds)


def _residual(A: FloatArray, V: ComplexArray, B: ComplexArray) -> ComplexArray:
    """Return ``A V - V B`` in about twice the working precision."""
    real = matrix_product(np.hstack([A, -V.real, V.imag]), np.vstack([V.real, B.real, B.imag]))
    imag = matrix_product(np.hstack([A, -V.real, -V.imag]), np.vstack([V.imag, B.imag, B.real]))
    return np.asarray((real[0] + real[1]) + 1j * (imag[0] + imag[1]))


def _radius(N: ComplexArray, error: float) -> float:
    """Return the y beyond which an error of that norm leaves no eigenvalue of N."""
    powers, sizes = np.eye(len(N), dtype=np.complex128), np.empty(len(N) + 1)
    for k in range(len(N) + 1):
        sizes[k] = np.linalg.norm(powers, 2)
        powers = powers @ N
    low, order = max(float((2.0 * sizes[-1]) ** (1.0 / len(N))), 2.0 * error), np.arange(1, len(N) + 1)
    if low == 0.0:
        return 0.0

    def holds(y: float) -> bool:
        with np.errstate(divide="ignore", over="ignore"):  # powers of y go below all numbers
            return 2.0 * error * float(np.exp(np.log(sizes[:-1]) - order * np.log(y)).sum()) <= 1.0

    high = low
    while not holds(high):
        low, high = high, 2.0 * high
    for _ in range(RADIUS_HALVINGS):
        if high <= 1.01 * low:
            break
        middle = float(np.sqrt(low * high))
        low, high = (low, middle) if holds(middle) else (middle, high)
    return high
