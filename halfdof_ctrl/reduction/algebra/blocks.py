"""Connected blocks of a matrix, and what is rounding in the products with their bases."""

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from halfdof_ctrl.base.arrays import FloatArray, IndexArray

RANK_TOLERANCE = 16 * np.finfo(float).eps  #: times the block's size; singular values below are null
UNCLEAR = 1e3  #: singular values above that and below this times it are split at the widest gap
CANCELLATION = 16 * np.finfo(float).eps  #: times n: entries of C T and the like below this part of their terms are zero


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
