"""Inertia of a symmetric matrix: how many eigenvalues are positive, negative and zero.

By Sylvester's law the signs of the eigenvalues stay when rows and columns are scaled alike, so the matrix gets a unit
diagonal first, and zero means at most z after that: `ZERO_VALUE`, or what the digits of a file leave unknown. The
matrix falls into connected components. Small ones are solved densely. Of a large one, A, the triangular factors of
``A + z I`` and ``A - z I``, taken without exchanging rows, have as many negative pivots as there are eigenvalues below
-z and below z. Where rows had to be exchanged, where the factors do not solve a system well, or where the component is
too large for the time that a look at a file may take, the answer is that it is not known.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array, csc_array, diags_array, eye_array
from scipy.sparse.csgraph import connected_components

from halfdof_ctrl.base.arrays import EPS, FloatArray
from halfdof_ctrl.base.sparse_factors import PIVOTINGS, sparse_lu

ZERO_VALUE = 1e-12  #: of the matrix with unit diagonal
DENSE_SIZE = 100  #: up to which a component is solved densely
LARGEST_COMPONENT = 20_000  #: that is factorized
BATCH = 2**22  #: entries of dense blocks that are held at once
UNBELIEVED_PIVOTS = 1e-14  #: of a solution with the factors, above which their pivots are not believed


@dataclass(frozen=True, slots=True, kw_only=True)
class Inertia:
    """Signs of the eigenvalues of a symmetric matrix."""

    positive: int
    negative: int
    zero: int
    unknown: int  #: rows of the components that were not decided
    zero_to: float = ZERO_VALUE  #: size up to which an eigenvalue of the matrix with unit diagonal counts as zero
    lowest: float | None = None  #: lowest eigenvalue of the small components, with unit diagonal

    @property
    def rank(self) -> int | None:
        """Number of eigenvalues that are not zero, None if not all are known."""
        return None if self.unknown else self.positive + self.negative

    @property
    def in_words(self) -> str:
        """What the signs mean."""
        if self.negative and (self.positive or self.unknown):
            return "indefinite"
        if self.unknown:
            return "not determined"
        if not (self.positive or self.negative):
            return "zero"
        return f"{'negative' if self.negative else 'positive'} {'semidefinite' if self.zero else 'definite'}"


def inertia(matrix: csc_array, largest: int = LARGEST_COMPONENT, known_to: float = EPS) -> Inertia:
    """Count the signs of the eigenvalues of a real symmetric matrix.

    Parameters
    ----------
    matrix : (n, n) csc_array
        Only its symmetric part counts.
    largest : int
        Components with more rows are not factorized, but left unknown.
    known_to : float
        Relative rounding of the entries. It moves an eigenvalue by its product with the largest sum of a row at most
        (Gershgorin), and what is smaller than that counts as zero.

    Examples
    --------
    A spring between two free masses has one rigid-body motion:

    >>> found = inertia(csc_array([[3.0, -3.0], [-3.0, 3.0]]))
    >>> found.positive, found.negative, found.zero, found.unknown
    (1, 0, 1, 0)
    """
    count, label = connected_components(matrix, directed=False)
    sizes = np.bincount(label, minlength=count)
    if sizes.min() > max(DENSE_SIZE, largest):
        return Inertia(positive=0, negative=0, zero=0, unknown=matrix.shape[0])
    symmetric = csc_array(matrix / 2 + matrix.T / 2)
    order = np.argsort(label, kind="stable")
    first = np.cumsum(sizes) - sizes
    scaled = csc_array(csc_array(_at_unit_diagonal(symmetric)[order])[:, order])
    if not np.isfinite(scaled.data).all():  # numbers that float64 cannot scale, as 1e300 beside 1e-300
        return Inertia(positive=0, negative=0, zero=0, unknown=matrix.shape[0])
    zero = max(ZERO_VALUE, known_to * float(abs(scaled).sum(axis=0).max())) if known_to > EPS else ZERO_VALUE
    lowest = np.inf
    signs = np.zeros(3, dtype=np.int64)
    for values in _small_spectra(scaled.tocoo(), label[order], first, sizes):
        signs += [(values > zero).sum(), (values < -zero).sum(), (np.abs(values) <= zero).sum()]
        lowest = min(lowest, float(values.min()))
    unknown = 0
    for start, size in zip(first[sizes > DENSE_SIZE].tolist(), sizes[sizes > DENSE_SIZE].tolist(), strict=True):
        part = csc_array(csc_array(scaled[:, start : start + size])[start : start + size])
        found = _by_pivots(part, zero) if size <= largest else None
        if found is None:
            unknown += size
        else:
            signs += found
    return Inertia(
        positive=int(signs[0]),
        negative=int(signs[1]),
        zero=int(signs[2]),
        unknown=unknown,
        zero_to=zero,
        lowest=lowest if np.isfinite(lowest) else None,
    )


def _at_unit_diagonal(symmetric: csc_array) -> csc_array:
    """Scale rows and columns alike, by the diagonal, or where it is zero by the largest entry."""
    size = np.abs(symmetric.diagonal())
    largest = np.asarray(abs(symmetric).max(axis=0).toarray()).reshape(-1)
    size = np.where(size > 0.0, size, largest)
    factors = diags_array(1.0 / np.sqrt(np.where(size > 0.0, size, 1.0)))
    return csc_array(factors @ symmetric @ factors)


def _small_spectra(
    entries: coo_array, label: npt.NDArray[Any], first: npt.NDArray[Any], sizes: npt.NDArray[Any]
) -> Iterator[FloatArray]:
    """Return the eigenvalues of the small components, as many of one size as fit into memory at once."""
    owner = label[entries.row]
    by_owner = np.argsort(owner, kind="stable")
    row, column, value = (part[by_owner] for part in (entries.row, entries.col, entries.data))
    owner = owner[by_owner]
    for size in np.unique(sizes[sizes <= DENSE_SIZE]).tolist():
        which = np.flatnonzero(sizes == size)
        place = np.full(sizes.size, -1)
        place[which] = np.arange(which.size)
        mine = np.flatnonzero(place[owner] >= 0)
        block = place[owner[mine]]
        step = max(1, BATCH // size**2)
        for start in range(0, which.size, step):
            now = mine[np.searchsorted(block, start) : np.searchsorted(block, start + step)]
            stack = np.zeros((min(step, which.size - start), size, size))
            origin = first[owner[now]]
            stack[place[owner[now]] - start, row[now] - origin, column[now] - origin] = value[now]
            yield np.linalg.eigvalsh(stack).reshape(-1)


def _by_pivots(part: csc_array, zero: float) -> npt.NDArray[np.int64] | None:
    """Count signs by the pivots of two shifted matrices, None if these cannot be trusted."""
    below, upto = (_negative_pivots(csc_array(part + shift * eye_array(part.shape[0]))) for shift in (zero, -zero))
    if below is None or upto is None or upto < below:
        return None
    return np.array([part.shape[0] - upto, below, upto - below])


def _negative_pivots(shifted: csc_array) -> int | None:
    try:
        factors = sparse_lu(shifted, *PIVOTINGS[0])
    except RuntimeError:  # exactly singular
        return None
    if not np.array_equal(factors.perm_r, factors.perm_c):
        return None
    probe = np.cos(np.arange(shifted.shape[0]))
    solution = factors.solve(probe)
    size = float(abs(shifted).sum(axis=0).max() * np.abs(solution).max() + np.abs(probe).max())
    if not np.abs(probe - shifted @ solution).max() <= UNBELIEVED_PIVOTS * size:
        return None
    return int((factors.U.diagonal() < 0.0).sum())
