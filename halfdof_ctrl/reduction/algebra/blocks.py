"""Connected blocks of a matrix, and what is rounding in the products with their bases."""

from dataclasses import dataclass

import numpy as np
import scipy.linalg
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from halfdof_ctrl.base.arrays import EPS, FloatArray, IndexArray
from halfdof_ctrl.base.double_double import BITS, matrix_product
from halfdof_ctrl.reduction.algebra.integers import LARGEST_EXACT, has_short_entries, least_rank
from halfdof_ctrl.reduction.algebra.scaling import Scaling, gap_threshold, unit_free_scaling

RANK_TOLERANCE = 16 * EPS  #: times the block's size; singular values below are null
ENTRY_NOISE = 2 * EPS  #: times the block's size and its largest singular value: rounding of the entries makes no more
UNNOTICED = 4 * EPS  #: times the block's size: an entry of a vector of length one below that is rounding of a zero
NULL_CORRECTIONS = 2  #: of null vectors, each by a residual in twice the working precision
UNCLEAR_RANK = 1e3  #: singular values above that and below this times it are split at the widest gap
FEWEST_SPARE_BITS = 20  #: zero bits at the end of numbers that, all together, are no chance of rounded ones
CANCELLATION = 16 * EPS  #: times n: entries of C T and the like below this part of their terms are zero


@dataclass(frozen=True, slots=True, eq=False)
class BlockSplit:
    """Which combinations of d columns a block does not see: ``block @ mixing[:, rank:] = 0``."""

    singular_values: FloatArray  #: of the scaled block, falling
    rank: int  #: how many of them count
    bound: float  #: those up to this one count as zero
    noise: (
        float  #: those up to this one may be what rounding of the entries makes of a zero; 0 if they were not rounded
    )
    mixing: FloatArray  #: (d, d) combinations, those that the block sees first; orthonormal but for `factors`
    factors: FloatArray  #: (d,) scale of the columns in which they are orthonormal
    spread: float  #: of the singular values that count, the largest over the smallest; 1 if none counts

    def mixed(self, columns: FloatArray, sizes: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Combine (n, d) columns, and what the rounding errors of their entries are relative to.

        A combination of the null space is known to rounding of the largest entry that its row has in the block, times
        the spread of the singular values that count; one of the other part may be any, so rounding alone counts.
        """
        size = (sizes @ np.repeat(self.factors[:, None], self.factors.size, axis=1)).max(axis=1, keepdims=True)
        seen = np.arange(self.factors.size) < self.rank
        return columns @ self.mixing, np.asarray(size * np.where(seen, 1.0, self.spread))


def split_block(block: FloatArray, tol: float | None) -> BlockSplit:
    """Split a connected block, without empty rows, into what it sees and its null space.

    Parameters
    ----------
    block : (k, d) ndarray
        Scaled here by `scaling.unit_free_scaling`, so that the decision is the same in any units.
    tol : float, optional
        Singular values up to `tol` times the largest count as zero. By default those up to 16 max(k, d) eps, and
        where others lie within 1e3 times that, those below the widest gap among them.
    """
    scaling = unit_free_scaling(block)
    left, values, right = scipy.linalg.svd(scaling.of(block))
    bound = tol
    if bound is None:
        rounding = max(block.shape) * RANK_TOLERANCE
        bound = gap_threshold(values / values[0], rounding, rounding * UNCLEAR_RANK)
    rank = int(np.count_nonzero(values > bound * values[0]))
    spread = float(values[0] / values[rank - 1]) if rank else 1.0
    speck = UNNOTICED * max(block.shape)
    noise = 0.0 if _hides_rank(block, rank) else ENTRY_NOISE * max(block.shape) * float(values[0])
    seen = scaling.columns[:, None] * np.where(np.abs(right[:rank].T) <= speck * spread, 0.0, right[:rank].T)
    null = _null_columns(block, scaling, (left[:, :rank], values[:rank], right), speck, spread)
    mixing = np.hstack([seen, null])
    return BlockSplit(values, rank, float(bound * values[0]), noise, mixing, scaling.columns, spread)


def _hides_rank(block: FloatArray, rank: int) -> bool:
    """Return whether the entries of a small block were not rounded and have a higher rank than counts."""
    if rank == min(block.shape) or max(block.shape) > LARGEST_EXACT or not has_short_entries(block):
        return False
    return _spare_bits(block) >= FEWEST_SPARE_BITS and least_rank(block) > rank


def _spare_bits(block: FloatArray) -> float:
    """Return how many bits at the end of the numbers of a block are zero, equal ones counted once."""
    sizes = np.unique(np.abs(block[block != 0.0]))
    whole = np.ldexp(np.frexp(sizes)[0], BITS).astype(np.int64)
    return float(np.log2((whole & -whole).astype(float)).sum())


def _null_columns(
    block: FloatArray, scaling: Scaling, factors: tuple[FloatArray, FloatArray, FloatArray], speck: float, spread: float
) -> FloatArray:
    """Return a basis of the null space, as good as the entries of a block and not as the gap between its values.

    Vectors of the decomposition are known to rounding times the spread of the values that count: beside a value of
    1e-8, null vectors lean by 1e-8 to the one that belongs to it. What the block makes of them in twice the working
    precision, divided by the values, takes that out. Entries that rounding so enlarged may have made of a zero are
    zero, unless the block sees that.
    """
    left, values, right = factors
    rank = values.size
    null = scaling.columns[:, None] * right[rank:].T
    for _ in range(NULL_CORRECTIONS if rank else 0):
        rest = left.T @ (scaling.rows[:, None] * matrix_product(block, null)[0])
        null = null - scaling.columns[:, None] * (right[:rank].T @ (rest / values[:, None]))
    size = np.abs(null) / scaling.columns[:, None]
    bare = np.where(size <= speck * spread, 0.0, null)
    left_over = scaling.rows[:, None] * matrix_product(block, bare)[0]
    harmless = np.linalg.norm(left_over, axis=0) <= speck * values.max(initial=0.0)
    return np.asarray(np.where(harmless, bare, np.where(size <= speck, 0.0, null)))


def lengths_of_columns(basis: FloatArray) -> FloatArray:
    """Return what columns of T are divided by, so that one that selects a DOF is that, and others are about one.

    The single entry of a column, or a power of two near the largest of several.
    """
    size = np.abs(basis)
    places = size.argmax(axis=0)
    single = np.count_nonzero(basis, axis=0) == 1
    every = np.arange(basis.shape[1])
    return np.asarray(np.where(single, basis[places, every], np.exp2(np.ceil(np.log2(size[places, every])))))


def connected_columns(product: FloatArray) -> list[IndexArray]:
    """Group the columns that share nonzero rows, directly or through others."""
    rows, columns = product.shape
    i, j = np.nonzero(product)
    links = csr_array((np.ones(i.size), (i, rows + j)), shape=(rows + columns, rows + columns))
    _, label = connected_components(links, directed=False)
    groups: dict[int, list[int]] = {}
    for column, group in enumerate(label[rows:].tolist()):
        groups.setdefault(group, []).append(column)
    return [np.array(group) for group in groups.values()]


def cancelled(matrix: FloatArray, columns: FloatArray, sizes: FloatArray) -> FloatArray:
    """Multiply, and set entries to zero that are rounding of a sum whose terms cancel."""
    product = matrix @ columns
    noise = CANCELLATION * len(matrix) * (np.abs(matrix) @ sizes)
    return np.where(np.abs(product) <= noise, 0.0, product)


def mixture_names(selected: list[int | None], dofs: tuple[str, ...]) -> tuple[str, ...]:
    """Name a column of T by the DOF that it selects, else mix0, mix1, ... (clear of the DOFs' names)."""
    prefix = "mix"
    while any(dof.startswith(prefix) for dof in dofs):
        prefix += "_"
    names: list[str] = []
    mixtures = 0
    for place in selected:
        if place is None:
            names.append(f"{prefix}{mixtures}")
            mixtures += 1
        else:
            names.append(dofs[place])
    return tuple(names)
