"""Random mechanical structures with small integer entries, so that exact arithmetic can judge them."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from hypothesis import strategies as st

from halfdof_ctrl import SecondOrderModel, mechss

IntArray = npt.NDArray[np.int64]
FloatArray = npt.NDArray[np.float64]


def on_axis(omega: npt.ArrayLike) -> npt.NDArray[np.complex128]:
    """Give the points ``j omega``."""
    return np.asarray(1j * np.asarray(omega, dtype=float), dtype=np.complex128)


@dataclass(frozen=True, eq=False)
class Structure:
    """M, C, K with integer entries, and how they were drawn."""

    kind: str
    M: IntArray
    C: IntArray
    K: IntArray

    @property
    def matrices(self) -> tuple[IntArray, IntArray, IntArray]:
        """M, C and K."""
        return self.M, self.C, self.K

    @property
    def size(self) -> int:
        """Number of DOFs."""
        return int(self.M.shape[0])

    def transformed(self, left: FloatArray, right: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Give M, C, K multiplied from both sides."""
        return left @ self.M @ right, left @ self.C @ right, left @ self.K @ right

    def model(self, **options: Any) -> SecondOrderModel:  # noqa: ANN401  # those of mechss
        """Make the model, with forces on and displacements of all DOFs unless told otherwise."""
        return mechss(*self.matrices, **options)


def semidefinite(generator: np.random.Generator, size: int, rank: int, largest: int = 2) -> IntArray:
    """Draw a symmetric positive semidefinite matrix of at most the given rank."""
    factor = generator.integers(-largest, largest + 1, (rank, size))
    return factor.T @ factor


def assembled(generator: np.random.Generator, size: int, elements: int, grounded: float = 0.3) -> IntArray:
    """Assemble springs (or dampers) between random pairs of DOFs, some of them to the ground."""
    matrix = np.zeros((size, size), dtype=np.int64)
    for _ in range(elements):
        stiffness = int(generator.integers(1, 10))
        i, j = generator.integers(0, size, 2)
        direction = np.zeros(size, dtype=np.int64)
        direction[i] += 1
        if i != j and generator.random() > grounded:
            direction[j] -= 1
        matrix += stiffness * np.outer(direction, direction)
    return matrix


def passive(generator: np.random.Generator, size: int) -> Structure:
    """Draw symmetric positive semidefinite matrices of any ranks."""
    ranks = generator.integers(0, size + 1, 3)
    M, C, K = (semidefinite(generator, size, int(rank)) for rank in ranks)
    return Structure("passive", M, C, K)


def assembly(generator: np.random.Generator, size: int) -> Structure:
    """Draw lumped masses on some DOFs, dampers and springs between DOFs."""
    M = np.diag(generator.integers(0, 2, size) * generator.integers(1, 10, size))
    C = assembled(generator, size, int(generator.integers(0, size + 1)))
    K = assembled(generator, size, int(generator.integers(size // 2, 2 * size + 1)))
    return Structure("assembly", M, C, K)


def null_columns(generator: np.random.Generator, size: int) -> Structure:
    """Draw unsymmetric matrices, null columns in M, some of them null in C too."""
    kind = generator.integers(0, 3, size)
    M, C, K = (generator.integers(-4, 5, (size, size)) for _ in range(3))
    return Structure("null columns", M * (kind == 0), C * (kind < 2), K)


def rank_deficient(generator: np.random.Generator, size: int) -> Structure:
    """Draw unsymmetric M and C of any rank, as products without null columns, and K."""
    M, C = (
        generator.integers(-2, 3, (size, rank)) @ generator.integers(-2, 3, (rank, size))
        for rank in generator.integers(0, size + 1, 2).tolist()
    )
    return Structure("rank deficient", M, C, generator.integers(-4, 5, (size, size)))


def gyroscopic(generator: np.random.Generator, size: int) -> Structure:
    """Draw semidefinite matrices, C with a skew part and K with a circulatory one."""
    structure = passive(generator, size)
    skew, circulatory = (generator.integers(-3, 4, (size, size)) for _ in range(2))
    K = structure.K + (circulatory - circulatory.T) * int(generator.integers(0, 2))
    return Structure("gyroscopic", structure.M, structure.C + skew - skew.T, K)


KINDS: tuple[Callable[[np.random.Generator, int], Structure], ...] = (
    passive,
    assembly,
    null_columns,
    rank_deficient,
    gyroscopic,
)


def structures(
    *kinds: Callable[[np.random.Generator, int], Structure], smallest: int = 1, largest: int = 12
) -> st.SearchStrategy[Structure]:
    """Draw structures of the given kinds (all by default)."""
    return st.builds(
        lambda kind, size, seed: kind(np.random.default_rng(seed), size),
        st.sampled_from(kinds or KINDS),
        st.integers(smallest, largest),
        st.integers(0, 2**32 - 1),
    )


@st.composite
def damped_structures(draw: st.DrawFn, smallest: int = 1, largest: int = 8) -> Structure:
    """Draw well-posed passive structures: grounded springs, and a damper beside every spring."""
    size = draw(st.integers(smallest, largest))
    generator = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    kind = generator.integers(0, 3, size)
    M = np.diag(np.where(kind == 0, generator.integers(1, 6, size), 0))
    C = assembled(generator, size, size, grounded=0.5) + np.diag(generator.integers(1, 4, size))
    C = C * (kind < 2) * (kind < 2)[:, None]
    K = assembled(generator, size, size) + np.diag(generator.integers(1, 9, size))
    return Structure("damped", M, C, K)


@st.composite
def unsymmetric_structures(
    draw: st.DrawFn,
    n_inertial: st.SearchStrategy[int],
    n_half: st.SearchStrategy[int],
    n_static: st.SearchStrategy[int],
) -> Structure:
    """Draw unsymmetric diagonally dominant models with given counts of DOFs, in random order."""
    counts = draw(n_inertial), draw(n_half), draw(n_static)
    size = sum(counts)
    generator = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    kind = generator.permutation(np.repeat([0, 1, 2], counts))
    M, C, K = (
        generator.integers(-2, 3, (size, size)) + np.diag(generator.integers(4 * size, 6 * size, size))
        for _ in range(3)
    )
    return Structure("unsymmetric", M * (kind == 0), C * (kind < 2), K)


def arrow(small: float) -> FloatArray:
    """Give ``[[0, 1, 1], [1, 1, 0], [1, 0, 2]]`` (plus `small` at the corner) in units in which all maxima are even."""
    units = np.array([1.0 / small, small, small])
    return np.asarray(np.array([[small, 1.0, 1.0], [1.0, 1.0, 0.0], [1.0, 0.0, 2.0]]) * np.sqrt(np.outer(units, units)))
