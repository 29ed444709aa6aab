"""How far the resonances of a small model are from those of the full one, one solve with the full model each.

A pole s_i of the small model with the vector v_i, in the coordinates of the full model x = shapes v_i, is improved by
one step of inverse iteration with the full matrices, and the Rayleigh quotient of the quadratic problem,

    w = P(s_i)^-1 (C + 2 s_i M) x,    (w^T M w) s^2 + (w^T C w) s + w^T K w = 0,

whose root nearest to s_i is the full model's pole to twice the digits of w. The shift of frequency and of damping, and
the change of the residue (F w)(w^T B) / (w^T (C + 2 s M) w), are the error where a value at a needle-sharp resonance
says nothing: any shift at all is an error of many times the value there. Poles closer than one per cent are improved
together, by a block and its Rayleigh-Ritz problem; their neighbours outside the group are in the block too, for a shift
that is larger than the distance of two poles mixes their vectors. For the same reason poles that are not told apart
have one height, that of the sum of their residues. Below 2 u |w|^T |K| |w| / (w^T K w) a shift is not told from
rounding.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg
from scipy.optimize import linear_sum_assignment
from scipy.sparse import csc_array

from halfdof_ctrl.base.arrays import UNIT_ROUNDOFF, ComplexArray, FloatArray
from halfdof_ctrl.base.progress import progress
from halfdof_ctrl.base.sparse_arrays import SparseMatrix
from halfdof_ctrl.base.sparse_factors import sparse_lu
from halfdof_ctrl.model.second_order import SecondOrderModel

LOWEST, RESONANCE_ERROR_HIGHEST = (
    8,
    32,
)  #: resonances of the band that are checked in any case: errors grow towards its end ...
CHECKED_SIZE = 2**26  #: ... and all others while DOFs times resonances are fewer
RESONANCE_ERROR_FLOOR = 2.0  #: times u: half of what rounds the entries of K, the sums that they are, and the energy
POLES_TOGETHER = 0.01  #: relative distance of poles that are improved together
LARGEST_GROUP = 48  #: poles that are improved together at most ...
NEIGHBOURS = 24  #: ... with so many on either side, as close, that may be mixed with them
TOLD_APART = 20.0  #: times their shift: poles as close as that are one resonance, whose residues are added
POLE_ASIDE = 1e-4  #: relative: an undamped pole is approached so far beside the axis
UNDAMPED_POLE = 1e-6  #: of its size: the real part of a pole that counts as undamped here
MASS_SHIFT = 1e-3  #: of the squared end of the band: makes a stiffness regular that leaves motions free
SILENT_RESONANCE = 1e-3  #: of a channel's largest residue over its pole's size: resonances below are no part of it
OVERDAMPED = 0.7  #: damping ratio of what is no resonance


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ResonanceErrors:
    """Errors of k resonances in the band, by rising frequency."""

    frequencies: FloatArray  #: (k,) of the small model [Hz]
    frequency_shift: FloatArray  #: (k,) relative to the frequency
    damping_shift: FloatArray  #: (k,) of the damping ratio
    height: FloatArray  #: (k,) relative change of the residue, in the channel where it is largest; of the sum of the
    #: residues where poles are closer than 20 times their shift, one value for all of them
    floor: FloatArray  #: (k,) relative shift of frequency that rounding of the full model's K may make
    poles: ComplexArray  #: (k,) of the small model [rad/s]
    in_band: int  #: resonances that there are, the lowest and the highest of which were checked if k is smaller


@np.errstate(all="ignore")  # a form without definiteness has motions without energy
def resonance_errors(
    parts: dict[str, SparseMatrix], small: SecondOrderModel, basis: FloatArray, band: tuple[float, float]
) -> ResonanceErrors:
    """Measure the shift of the resonances in a band.

    Parameters
    ----------
    parts : mapping from letter to csc_array
        Of the full model of n DOFs.
    small : SecondOrderModel
        Dense, of r DOFs.
    basis : (n, r) ndarray
        Motions of the full model that are the small one's DOFs.
    band : (float, float)
        [Hz].

    Returns
    -------
    ResonanceErrors
    """
    poles, vectors = _resonances(small, band)
    in_band = poles.size
    chosen = np.arange(poles.size)
    most = max(LOWEST + RESONANCE_ERROR_HIGHEST, CHECKED_SIZE // basis.shape[0])
    if poles.size > most:
        chosen = np.concatenate([chosen[:LOWEST], chosen[LOWEST - most :]])
    poles, vectors = poles[chosen], vectors[:, chosen]
    found, shapes = np.empty_like(poles), np.empty((basis.shape[0], poles.size), dtype=np.complex128)
    floor = np.empty(poles.size)
    for own, block in progress(_groups(poles), "groups of resonances"):
        values, w = _improved(parts, poles[block], _lifted(basis, vectors[:, block]))
        mine = slice(own.start - block.start, own.stop - block.start)
        found[own], shapes[:, own] = values[mine], w[:, mine]
        floor[own] = _floor(parts["K"], shapes[:, own])
    return ResonanceErrors(
        frequencies=np.abs(poles) / (2.0 * np.pi),
        frequency_shift=np.abs(np.abs(found) - np.abs(poles)) / np.abs(found),
        damping_shift=np.abs(found.real / np.abs(found) - poles.real / np.abs(poles)),
        height=_height_errors(parts, small, (poles, vectors), (found, shapes), floor),
        floor=floor,
        poles=poles,
        in_band=in_band,
    )


def _lifted(basis: FloatArray, vectors: ComplexArray) -> ComplexArray:
    """Give vectors of the small model in the coordinates of the full one."""
    lifted = np.asarray(basis @ vectors.real, dtype=np.complex128)
    if vectors.imag.any():
        lifted.imag = basis @ vectors.imag
    return lifted


def _floor(K: SparseMatrix, shapes: ComplexArray) -> FloatArray:
    """Return the relative shift of frequencies that rounding of K may make."""
    stiff: Any = K @ shapes
    size: Any = abs(K) @ np.abs(shapes)
    energy = np.abs(np.einsum("ij,ij->j", shapes, stiff))
    most = RESONANCE_ERROR_FLOOR * UNIT_ROUNDOFF * np.einsum("ij,ij->j", np.abs(shapes), size)
    return np.asarray(np.divide(most, energy, out=np.zeros(energy.size), where=energy > 0.0))


def _resonances(small: SecondOrderModel, band: tuple[float, float]) -> tuple[ComplexArray, ComplexArray]:
    """Return the poles of the small model with frequencies in the band, and their vectors (r, k)."""
    scale = 2.0 * np.pi * band[1]
    size = np.abs(np.diagonal(small.K)) + scale**2 * np.abs(np.diagonal(small.M))
    units = 1.0 / np.sqrt(np.where(size > 0.0, size, 1.0))
    K, C, M = (np.asarray(part) * units * units[:, None] for part in (small.K, scale * small.C, scale**2 * small.M))
    undamped = None if C.any() or np.iscomplexobj(K) else _undamped_roots(K, M)
    relative, vectors = _damped_roots(K, C, M) if undamped is None else undamped
    with np.errstate(divide="ignore", invalid="ignore"):
        values = scale * relative
        frequency = np.abs(values) / (2.0 * np.pi)
        swings = np.abs(values.real) < OVERDAMPED * np.abs(values)
    inside = np.flatnonzero((frequency >= band[0]) & (frequency <= band[1]) & (values.imag > 0.0) & swings)
    inside = inside[np.argsort(frequency[inside])]
    return values[inside], units[:, None] * vectors[:, inside]


def _undamped_roots(K: FloatArray, M: FloatArray) -> tuple[ComplexArray, ComplexArray] | None:
    """Return j omega and the modes of a pair, in units in which the band ends at 1; None if it is not semidefinite."""
    try:
        parts, vectors = scipy.linalg.eigh((M + M.T) / 2.0, (K + K.T) / 2.0 + MASS_SHIFT * (M + M.T) / 2.0)
    except np.linalg.LinAlgError:
        return None
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        squares = np.where(parts > 0.0, 1.0 / parts - MASS_SHIFT, np.inf)
        values = 1j * np.sqrt(np.maximum(squares, 0.0))
    return values, np.asarray(vectors, dtype=np.complex128)


def _damped_roots(K: FloatArray, C: FloatArray, M: FloatArray) -> tuple[ComplexArray, ComplexArray]:
    """Return the roots of a quadratic problem and their vectors (n, 2 n), infinite ones among them."""
    n = len(K)
    try:
        lower = np.linalg.cholesky((M + M.T) / 2.0)
    except np.linalg.LinAlgError:  # DOFs without mass
        left = np.block([[np.zeros((n, n)), np.eye(n)], [-K, -C]])
        homogeneous, vectors = scipy.linalg.eig(left, scipy.linalg.block_diag(np.eye(n), M), homogeneous_eigvals=True)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(homogeneous[0] / homogeneous[1], dtype=np.complex128), vectors[:n]
    stiffness, damping = (
        scipy.linalg.solve_triangular(lower, scipy.linalg.solve_triangular(lower, part, lower=True).T, lower=True).T
        for part in (K, C)
    )
    values, vectors = scipy.linalg.eig(np.block([[np.zeros((n, n)), np.eye(n)], [-stiffness, -damping]]))
    return np.asarray(values, dtype=np.complex128), scipy.linalg.solve_triangular(lower.T, vectors[:n])


def _groups(poles: ComplexArray) -> list[tuple[slice, slice]]:
    """Put poles that are close side by side into groups; give each, and the same with its neighbours."""
    groups, start = [], 0
    while start < poles.size:
        stop = _reach(poles, start, min(start + LARGEST_GROUP, poles.size), 1)
        low = _reach(poles, start, max(start - NEIGHBOURS, 0) - 1, -1) + 1
        high = _reach(poles, stop - 1, min(stop + NEIGHBOURS, poles.size), 1)
        groups.append((slice(start, stop), slice(low, high)))
        start = stop
    return groups


def _reach(poles: ComplexArray, start: int, end: int, step: int) -> int:
    """Return the first place, from one on towards an end, whose pole is not close to the first any more."""
    for place in range(start, end, step):
        if abs(poles[place] - poles[start]) > POLES_TOGETHER * abs(poles[start]):
            return place
    return end


def _improved(
    parts: dict[str, SparseMatrix], poles: ComplexArray, shapes: ComplexArray
) -> tuple[ComplexArray, ComplexArray]:
    """Return the full model's poles nearest to some of the small one's, and their vectors."""
    K, C, M = (parts[letter] for letter in "KCM")
    s = complex(poles.mean())
    if abs(s.real) < UNDAMPED_POLE * abs(s):
        s *= 1.0 + POLE_ASIDE * 1j
    try:
        factors = sparse_lu(csc_array(K + s * C + s**2 * M))
    except RuntimeError:  # a pole to the last bit
        s *= 1.0 + POLE_ASIDE * 1j
        factors = sparse_lu(csc_array(K + s * C + s**2 * M))
    right = C @ shapes + 2.0 * (M @ shapes) * poles
    w = factors.solve(np.asfortranarray(right, dtype=np.complex128))
    w = w / np.abs(w).max(axis=0)
    values, vectors = _quadratic_roots(w.T @ (K @ w), w.T @ (C @ w), w.T @ (M @ w), s)
    _, places = linear_sum_assignment(np.abs(poles[:, None] - values))
    return values[places], w @ vectors[:, places]


def _quadratic_roots(K: Any, C: Any, M: Any, scale: complex) -> tuple[ComplexArray, ComplexArray]:  # noqa: ANN401
    """Return the roots and vectors of a small quadratic problem with complex symmetric matrices.

    In units in which the roots and K are of size one, as the identity is that makes the problem a linear one.
    """
    n, size, most = K.shape[0], abs(scale), float(np.abs(K).max()) or 1.0
    K, C, M = K / most, C * (size / most), M * (size**2 / most)
    if not C.any():
        squares, vectors = scipy.linalg.eig(-K, M)
        roots = size * np.sqrt(np.asarray(squares, dtype=np.complex128))
        return np.where(roots.imag < 0.0, -roots, roots), np.asarray(vectors, dtype=np.complex128)
    left = np.block([[np.zeros((n, n)), np.eye(n)], [-K, -C]])
    right = np.block([[np.eye(n), np.zeros((n, n))], [np.zeros((n, n)), M]])
    values, vectors = scipy.linalg.eig(left, right)
    return np.asarray(size * values, dtype=np.complex128), np.asarray(vectors[:n], dtype=np.complex128)


def _height_errors(
    parts: dict[str, SparseMatrix],
    small: SecondOrderModel,
    reduced: tuple[ComplexArray, ComplexArray],
    full: tuple[ComplexArray, ComplexArray],
    floor: FloatArray,
) -> FloatArray:
    """Return the relative change of the residues, in the channel where it is largest."""
    poles, found = reduced[0], full[0]
    if poles.size == 0:
        return np.zeros(0)
    dense: dict[str, Any] = {letter: np.asarray(getattr(small, letter)) for letter in (*parts,)}
    first, second = (_residues(matrices, *each) for matrices, each in ((dense, reduced), (parts, full)))
    shift = np.maximum(np.abs(found - poles), floor * np.abs(poles))
    gaps = np.abs(np.diff(poles))
    starts = np.append(0, 1 + np.flatnonzero(gaps > TOLD_APART * np.maximum(shift[1:], shift[:-1])))
    change = np.abs(np.add.reduceat(first - second, starts))
    size = np.maximum(np.abs(np.add.reduceat(second, starts)), np.maximum.reduceat(np.abs(second), starts))
    weight = size / np.abs(found[starts])[:, None, None]
    shown = weight > SILENT_RESONANCE * weight.max(axis=0, keepdims=True)
    size = _with_mixed_in(size, gaps[starts[1:] - 1], np.maximum.reduceat(shift, starts), np.abs(poles[starts]))
    with np.errstate(divide="ignore", invalid="ignore"):
        relative = np.nan_to_num(np.where(shown, change / size, 0.0)).max(axis=(1, 2))
    return np.asarray(np.repeat(relative, np.diff(np.append(starts, poles.size))))


def _with_mixed_in(size: FloatArray, gaps: FloatArray, shift: FloatArray, where: FloatArray) -> FloatArray:
    """Return sizes of residues (k, p, m), at least the part of a close neighbour's that the shift may mix in.

    A needle that is silent between two loud ones is measured by those.
    """
    close = gaps <= POLES_TOGETHER * where[1:]
    part = np.where(close, np.minimum(TOLD_APART * np.maximum(shift[1:], shift[:-1]) / gaps, 1.0), 0.0)[:, None, None]
    mixed = size.copy()
    mixed[1:] = np.maximum(mixed[1:], part * size[:-1])
    mixed[:-1] = np.maximum(mixed[:-1], part * size[1:])
    return mixed


def _residues(matrices: Any, poles: ComplexArray, vectors: ComplexArray) -> ComplexArray:  # noqa: ANN401
    """Return ``(F(s) w)(w^T B(s)) / (w^T (C + 2 s M) w)``, (k, p, m)."""
    F, G, H = (matrices[letter] @ vectors for letter in "FGH")
    B, Bv, Ba = (matrices[letter].T @ vectors for letter in ("B", "Bv", "Ba"))
    C, M = (np.einsum("ij,ij->j", vectors, matrices[letter] @ vectors) for letter in "CM")
    out, drive = F + poles * (G + poles * H), B + poles * (Bv + poles * Ba)
    return np.asarray(np.einsum("pk,mk->kpm", out, drive / (C + 2.0 * poles * M)))
