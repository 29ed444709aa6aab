"""Finite and infinite structure of a pencil ``A - s E``, for the oracle: deflate what is not finite, then QZ.

Deflation (`staircase`) of the rows removes what a pencil has at infinity; the same on the transpose removes what a
non-square or singular pencil has besides.

Eigenvalues are those of the diagonal blocks of the block triangular form of the pattern (`patterns`), found anew after
each deflation: a triangle of many small pivots, singular to any norm, is then as regular as it looks. The
reduction knows nothing of this module.
"""

from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg

from halfdof_ctrl.base.arrays import ComplexArray, DenseMatrix
from halfdof_ctrl.descriptor.staircase import ZERO_PIVOT, Evidence, Pencil, deflated, deflated_once

GENERIC_POINTS = (0.6 + 0.8j, 1.3 + 0.4j, 0.2 + 2.1j)  #: of a mean frequency: ranks there hold almost everywhere
CLEAR_MARGIN = 1000.0  #: a rank decision with less than this margin is looked at twice


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class FinitePart:
    """What a pencil has at finite places."""

    eigenvalues: ComplexArray  #: by QZ on irreducible blocks; those at the origin are exactly zero
    is_regular: bool  #: False if the pencil is not square or its determinant vanishes identically
    is_certain: bool  #: False if rank decisions are so close to rounding that the number may be wrong


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class InfinitePart:
    """What a regular pencil has at infinity."""

    steps: tuple[int, ...]  #: algebraic rows that each deflation took out
    evidence: Evidence  #: how clear the rank decisions were

    @property
    def blocks(self) -> tuple[int, ...]:
        """Sizes of the Jordan blocks, the largest first: the conjugate partition of `steps`."""
        return tuple([sum(step > block for step in self.steps) for block in range(max(self.steps, default=0))])


def finite_part(A: DenseMatrix, E: DenseMatrix) -> FinitePart:
    """Find the finite eigenvalues of the pencil ``A - s E``.

    Parameters
    ----------
    A, E : (k, l) ndarrays
        Real or complex, square or not, of any normal rank.

    Returns
    -------
    FinitePart
        For a pencil that is not regular, the eigenvalues of its regular part: where its rank drops.

    Examples
    --------
    ``(s + 2, 0)`` has rank one but at -2:

    >>> finite_part(np.array([[-2.0, 0.0]]), np.array([[1.0, 0.0]])).eigenvalues
    array([-2.+0.j])
    """
    pencil = Pencil.exact(A, E)
    by_blocks = _by_blocks(pencil)
    if by_blocks is not None and by_blocks.is_certain:
        return by_blocks
    both_ways = _both_ways(pencil)
    if by_blocks is None:
        return both_ways
    agree = both_ways.eigenvalues.size == by_blocks.eigenvalues.size
    return by_blocks if agree or not both_ways.is_certain else both_ways


def infinite_part(A: DenseMatrix, E: DenseMatrix) -> InfinitePart:
    """Find the structure at infinity of the pencil ``A - s E``, which must be regular.

    Each deflation takes out the algebraic rows and as many unknowns, which makes every Jordan block at infinity
    smaller by one. So step k counts the blocks of size k or more.

    Examples
    --------
    Two equations without derivative, one of which says nothing new until it is differentiated:

    >>> A, E = np.array([[1.0, 0, 0], [0, 1, 0], [0, 0, 1]]), np.array([[0.0, 0, 0], [0, 0, 1], [0, 0, 0]])
    >>> part = infinite_part(A, E)
    >>> part.steps, part.blocks
    ((2, 1), (2, 1))
    """
    staircase = deflated(Pencil.exact(A, E).scaled())
    return InfinitePart(steps=staircase.steps, evidence=staircase.evidence)


def _by_blocks(pencil: Pencil) -> FinitePart | None:
    """Collect the eigenvalues of the diagonal blocks; None if one lacks the rank that its pattern has.

    The determinant of a block triangular pencil, and the greatest common divisor of the largest minors where it is
    not square, are the products of those of its blocks, if these have full rank.
    """
    found, evidence = [np.zeros(0, dtype=np.complex128)], Evidence()
    waiting = pencil.diagonal_blocks()
    is_square = all(block.E.shape[0] == block.E.shape[1] for block in waiting)
    waiting = [block.transposed() if block.E.shape[0] < block.E.shape[1] else block for block in waiting]
    while waiting:
        block = waiting.pop()
        step = deflated_once(block.scaled())
        evidence = evidence.and_also(step.evidence)
        if step.redundant > block.E.shape[0] - block.E.shape[1]:
            return None
        if step.algebraic == 0:  # E is nonsingular; what A lacks in rank are eigenvalues at the origin
            step = deflated_once(step.pencil.reversed())
            evidence = evidence.and_also(step.evidence)
            if step.redundant:
                return None
            found.append(np.zeros(step.algebraic, dtype=np.complex128))
            step = replace(step, pencil=step.pencil.reversed())
        if step.algebraic == 0:
            found.append(step.pencil.eigenvalues())
            continue
        blocks = step.pencil.diagonal_blocks()
        if any(block.E.shape[0] < block.E.shape[1] for block in blocks):
            return None
        waiting += blocks
    return FinitePart(
        eigenvalues=np.concatenate(found), is_regular=is_square, is_certain=evidence.margin > CLEAR_MARGIN
    )


def _both_ways(pencil: Pencil) -> FinitePart:
    """Deflate rows and then columns, and the other way round, and take the way that can be trusted.

    In a singular pencil a small perturbation can change everything (J. W. Demmel and B. Kagstrom, 1987). A way must
    find as many rows and columns too many as the rank at generic points says, by clear decisions.
    """
    rank, (rows, columns) = _normal_rank(pencil), pencil.E.shape
    ways = []
    for turned, surplus in (
        (pencil, (rows - rank, columns - rank)),
        (pencil.transposed(), (columns - rank, rows - rank)),
    ):
        first = deflated(turned.scaled())
        second = deflated(first.pencil.transposed())
        is_sound = (first.redundant, second.redundant) == surplus
        is_clear = first.evidence.and_also(second.evidence).margin > CLEAR_MARGIN
        ways.append((is_sound, is_clear, second.pencil.E.shape[0], second.pencil))
    sound = [way for way in ways if way[0]]
    best = max(sound or ways, key=lambda way: way[1:3])
    agreed = len({way[2] for way in sound if way[1] == best[1]}) == 1
    inner = _by_blocks(best[3])
    return FinitePart(
        eigenvalues=best[3].eigenvalues() if inner is None else inner.eigenvalues,
        is_regular=rank == rows == columns,
        is_certain=best[0] and best[1] and agreed,
    )


def _normal_rank(pencil: Pencil) -> int:
    """Find the rank at generic points, the largest of a few."""
    scaled = pencil.scaled()
    ranks = []
    for s in GENERIC_POINTS:
        values = scipy.linalg.svdvals(scaled.A - s * scaled.E)
        ranks.append(int(np.count_nonzero(values > ZERO_PIVOT * max(pencil.E.shape) * values.max(initial=0.0))))
    return max(ranks)
