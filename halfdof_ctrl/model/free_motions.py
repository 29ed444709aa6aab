"""Motions that the stiffness leaves free: bodies that float, mechanisms.

A null vector Phi of K is one exactly (translations, entries that cancel) or to the rounding of the entries (rotations,
whose coordinates are rounded). It counts if its energy is rounding of the terms that it is summed from,

    |Phi^T K Phi| <= rounding |Phi|^T |K| |Phi|,

without a factor for the size, and if the ratio of the next motion is a thousand times larger: a body on soft springs is
not free. Each free motion is a pole at exactly 0, two where no damper resists it, and there the response at rest is
infinite.
"""

from dataclasses import dataclass

import numpy as np

from halfdof_ctrl.base.arrays import EPS, FloatArray, IndexArray, ModelMatrix, as_dense, is_complex, powers_of_two
from halfdof_ctrl.base.matrix_residual import exact_product

NEXT_MOTION = 1e3  #: the ratio of the softest motion that is not free is larger by this factor
FREE_MOTIONS_SMALL = 1e-7  #: of the largest eigenvalue at unit diagonal: of motions above ...
FREE_MOTIONS_BESIDE = 3  #: ... only so many are looked at
BALANCED = 16.0  #: times the rounding of the entries: a power of dampers that cancels to this part is none
IMPROVEMENTS = 2
FREE_MOTIONS_LARGEST = 500  #: DOFs up to which free motions are counted for `repr`


@dataclass(frozen=True, slots=True)
class FreeMotionCount:
    """What K leaves free, and the poles at exactly zero that come of it."""

    motions: int
    poles: int
    rounding: float = EPS  #: of the entries, to which this is said

    def in_words(self) -> str:
        """Say it on one line.

        >>> FreeMotionCount(2, 4).in_words()
        '2 free motions: 4 poles at exactly 0, so that the response at rest is infinite'
        """
        several = "" if self.motions == 1 else "s"
        poles = "1 pole" if self.poles == 1 else f"{self.poles} poles"
        rounded = f" (to the rounding of the entries, {self.rounding:.0e})" if self.rounding > EPS else ""
        return (
            f"{self.motions} free motion{several}{rounded}: {poles} at exactly 0, "
            "so that the response at rest is infinite"
        )


def free_motion_count(M: ModelMatrix, C: ModelMatrix, K: ModelMatrix, rounding: float = EPS) -> FreeMotionCount | None:
    """Count the motions that a symmetric stiffness leaves free.

    Parameters
    ----------
    M, C, K : (n, n) matrices
    rounding : float
        Relative rounding of the entries.

    Returns
    -------
    FreeMotionCount or None
        None where there are none, or where K is complex, unsymmetric or negative in some motion, C is unsymmetric, or a
        free motion has neither mass nor damping.

    Examples
    --------
    Two masses on a spring, a damper from the first one to the ground; without it there are two poles:

    >>> K = np.array([[9.0, -9.0], [-9.0, 9.0]])
    >>> free_motion_count(np.eye(2), np.diag([1.0, 0.0]), K).poles, free_motion_count(np.eye(2), 0.0 * K, K).poles
    (1, 2)
    """
    parts = _symmetric_parts(M, C, K)
    if parts is None:
        return None
    mass, damping, stiffness = parts
    size = np.diagonal(stiffness)
    scale = np.where(size > 0.0, powers_of_two(np.sqrt(np.abs(size))), 1.0)
    scaled = scale[:, None] * stiffness * scale
    if not _has_soft_motions(scaled, max(FREE_MOTIONS_SMALL, rounding)):
        return None
    values, vectors = np.linalg.eigh(scaled)
    free = _free(scaled, values, vectors, rounding)
    if free.size == 0:
        return None
    motions = _improved(scaled, values, vectors, free)
    motions = scale[:, None] * motions
    resisted = _resisted(damping, motions, rounding)
    if _resisted(mass + damping, motions, rounding) < free.size:
        return None
    return FreeMotionCount(free.size, 2 * free.size - resisted, rounding)


def free_motions_in_words(M: ModelMatrix, C: ModelMatrix, K: ModelMatrix, rounding: float = EPS) -> str | None:
    """Say on one line what a stiffness leaves free; None where that is nothing, or the model too large to be asked."""
    if K.shape[0] > FREE_MOTIONS_LARGEST:
        return None
    free = free_motion_count(M, C, K, rounding)
    return None if free is None else free.in_words()


def _symmetric_parts(
    M: ModelMatrix, C: ModelMatrix, K: ModelMatrix
) -> tuple[FloatArray, FloatArray, FloatArray] | None:
    """Return dense matrices; None where one is complex or unsymmetric, or K negative at a glance."""
    if any([is_complex(part) for part in (M, C, K)]):  # noqa: C419  # a list is faster here
        return None
    mass, damping, stiffness = as_dense(M), as_dense(C), as_dense(K)
    size = np.diagonal(stiffness)
    symmetric = np.array_equal(stiffness, stiffness.T) and np.array_equal(damping, damping.T)
    if not symmetric or (size < 0.0).any() or stiffness[size == 0.0].any():
        return None
    return mass, damping, stiffness


def _free(K: FloatArray, values: FloatArray, vectors: FloatArray, rounding: float) -> IndexArray:
    """Return which of the eigenvectors are free motions; none where that is not told from soft ones."""
    largest = max(float(values[-1]), 0.0)
    few = int(np.count_nonzero(values <= max(FREE_MOTIONS_SMALL, rounding) * largest))
    ratios = _ratios(K, vectors[:, : few + FREE_MOTIONS_BESIDE])
    free = np.flatnonzero(np.abs(ratios) <= rounding)
    others = np.delete(ratios, free)
    next_one = NEXT_MOTION * max(float(np.abs(ratios[free]).max(initial=0.0)), EPS)
    sound = values[0] >= -len(K) * rounding * largest and not (others <= next_one).any()
    return free if sound else free[:0]


def _has_soft_motions(K: FloatArray, part: float) -> bool:
    """Tell, by a factorization, whether an eigenvalue may lie below a part of the largest."""
    try:
        np.linalg.cholesky(K - part * np.linalg.norm(K, 1) * np.eye(len(K)))
    except np.linalg.LinAlgError:
        return True
    return False


def _improved(K: FloatArray, values: FloatArray, vectors: FloatArray, free: IndexArray) -> FloatArray:
    """Take out of free motions what rounding of the decomposition left in them."""
    motions = vectors[:, free]
    rest = np.delete(np.arange(values.size), free)
    rest = rest[values[rest] != 0.0]  # another one that rounding has moved to zero takes nothing out
    for _ in range(IMPROVEMENTS):
        share = vectors[:, rest].T @ exact_product(K, motions) / values[rest, None]
        motions = motions - vectors[:, rest] @ share
    return np.asarray(motions)


def _ratios(K: FloatArray, motions: FloatArray) -> FloatArray:
    """Return the energy of motions, signed, over the terms that it is summed from."""
    energy = np.einsum("ij,ij->j", motions, exact_product(K, motions))
    terms = np.einsum("ij,ij->j", np.abs(motions), np.abs(K) @ np.abs(motions))
    return np.asarray(energy / np.where(terms > 0.0, terms, 1.0))


def _resisted(C: FloatArray, motions: FloatArray, rounding: float) -> int:
    """Return how many of some motions dampers resist: the rank of the power that they take."""
    terms = np.sqrt(np.einsum("ij,ij->j", np.abs(motions), np.abs(C) @ np.abs(motions)))
    unit = motions / np.where(terms > 0.0, terms, 1.0)
    power = unit.T @ exact_product(C, unit)
    return int(np.count_nonzero(np.abs(np.linalg.eigvalsh((power + power.T) / 2.0)) > BALANCED * rounding))
