"""The motions of Craig and Bampton's method: kept DOFs that others follow, modes, static corrections.

Derivation: docs/explanation/truncation.md. What is projected on them: `projection`.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import scipy.linalg
from scipy.sparse import csc_array, hstack

from halfdof_ctrl.base.arrays import FloatArray
from halfdof_ctrl.base.errors import ModelSizeError, SingularPencilError
from halfdof_ctrl.base.names import listed, removal_of
from halfdof_ctrl.base.sparse_arrays import IndexArray, SparseMatrix
from halfdof_ctrl.base.sparse_products import times
from halfdof_ctrl.reduction.algebra.sparse_lu import SparseLU
from halfdof_ctrl.reduction.modal.damping import lumped_damping
from halfdof_ctrl.reduction.modal.modes import Modes, ShiftedStiffness, count_below, lowest_modes

Parts = Mapping[str, SparseMatrix]  #: matrices of a model by their letters

KEPT_MODES_MARGIN = 2.0  #: modes with b held are kept up to this factor above the highest frequency of the band
MOST_MODES = 2000  #: that are kept
MOST_KEPT = 1000  #: DOFs that are kept
MOST_MOTION_ENTRIES = 2**28  #: of the dense matrix of motions that the model is projected on (2 GB)
LOCAL_SIGNAL = 6  #: DOFs of an input or output up to which these are kept; one of more gets a static correction
DEPENDENT_CORRECTIONS = 1e-10  #: of the largest eigenvalue of their energies: combinations of them below are none
MOTION_SPECK = 1e-14  #: of the largest motion of a DOF that follows a kept one: motions below are rounding


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Motions:
    """Motions of n DOFs: of b that are kept, with what follows, of k modes, and of corrections."""

    kept: IndexArray  #: (b,) the DOFs
    omega: FloatArray  #: (k,) of the modes, with these DOFs held [rad/s]
    shapes: FloatArray  #: (n, r) all motions in this order


def craig_bampton(parts: Parts, dofs: tuple[str, ...], f_max: float | None, n_modes: int | None) -> Motions:
    """Find the motions that a model with the given matrices and DOFs is projected on.

    Raises
    ------
    ModelSizeError
        Too many DOFs to keep, or too many modes below twice `f_max`.
    SingularPencilError
        With the kept DOFs held, others move without a force and without mass.
    ParameterError
        The Lanczos iteration does not converge.
    """
    kept, spread = _kept_dofs(parts)
    inner = np.setdiff1d(np.arange(len(dofs)), kept)
    stiffness = _inner_stiffness(parts, inner, dofs)
    modes = _modes(stiffness, f_max, n_modes)
    follow = _following(parts, stiffness, kept, inner)
    corrections = _corrections(stiffness, modes, _loads(parts, follow, (kept, inner), spread))
    shapes = np.zeros((len(dofs), kept.size + modes.omega.size + corrections.shape[1]), order="F")
    shapes[kept, np.arange(kept.size)] = 1.0
    shapes[inner] = np.hstack([follow, modes.shapes, corrections])
    return Motions(kept=kept, omega=modes.omega, shapes=shapes)


def _kept_dofs(parts: Parts) -> tuple[IndexArray, SparseMatrix]:
    """Choose the DOFs that are kept, and give the columns of forces and rows of outputs that are spread over more."""
    columns = [parts[letter] for letter in ("B", "Bv", "Ba")]
    columns += [csc_array(parts[letter].T) for letter in ("F", "G", "H")]
    kept = np.zeros(parts["K"].shape[0], dtype=bool)
    spread = []
    for part in columns:
        touched = np.diff(part.indptr)
        local = touched <= LOCAL_SIGNAL
        kept[part[:, np.flatnonzero(local)].indices] = True
        spread.append(part[:, np.flatnonzero(~local)])
    lumps = lumped_damping(parts["M"], parts["C"], parts["K"])
    damped = np.union1d(lumps.indices, np.flatnonzero(np.diff(lumps.indptr)))
    if damped.size <= MOST_KEPT:
        kept[damped] = True
    loads = csc_array(hstack(spread, format="csc"))
    count, most = int(np.count_nonzero(kept)), min(MOST_KEPT, MOST_MOTION_ENTRIES // (4 * kept.size))
    if max(count, loads.shape[1]) > most:
        msg = (
            f"{count} DOFs of inputs, outputs and dampers would be kept, and {loads.shape[1]} inputs and outputs are "
            f"spread over more DOFs; the limit is {most} of each for a model of this size. Select the inputs and "
            "outputs that matter: model.select(inputs=[...], outputs=[...])."
        )
        raise ModelSizeError(msg, size=max(count, loads.shape[1]), limit=most)
    return np.flatnonzero(kept), loads


def _inner_stiffness(parts: Parts, inner: IndexArray, dofs: tuple[str, ...]) -> ShiftedStiffness | None:
    """Factorize the stiffness of the DOFs that are not kept; None if there are none."""
    if inner.size == 0:
        return None
    K, M = (csc_array(parts[letter][:, inner][inner]) for letter in "KM")
    stiffness = ShiftedStiffness.factorized(K, M)
    if stiffness is None:
        null = np.abs(SparseLU.factorized(csc_array(K + M)).null_vector())
        loose = tuple([dofs[place] for place in inner[null > DEPENDENT_CORRECTIONS * null.max()].tolist()])
        msg = (
            f"With the kept DOFs held, DOFs {listed(loose)} still move without a force and without mass: nodes without "
            f"springs, or a part that nothing holds. Give them a stiffness, or take them out: {removal_of(loose)}."
        )
        raise SingularPencilError(msg, dofs=loose)
    return stiffness


def _modes(stiffness: ShiftedStiffness | None, f_max: float | None, n_modes: int | None) -> Modes:
    """Find the modes with the kept DOFs held: as many as wanted, or all up to beyond the band."""
    if stiffness is None:
        return Modes(np.zeros(0), np.zeros((0, 0)))
    most = min(MOST_MODES, MOST_MOTION_ENTRIES // (2 * stiffness.K.shape[0]))
    count = (n_modes or 0) if f_max is None else count_below(stiffness, 2.0 * np.pi * KEPT_MODES_MARGIN * f_max)
    if count > most:
        which = "" if f_max is None else f", all below {KEPT_MODES_MARGIN * f_max:.4g} Hz, twice f_max"
        msg = (
            f"{count} modes are to be kept{which}; the limit is {most} for a model of this size. Lower f_max, or take "
            "n_modes with what you can afford."
        )
        raise ModelSizeError(msg, size=count, limit=most)
    return lowest_modes(stiffness, count)


def _following(parts: Parts, stiffness: ShiftedStiffness | None, kept: IndexArray, inner: IndexArray) -> FloatArray:
    """Return the static motion of the others, (n - b, b), when one of the b kept DOFs moves."""
    if stiffness is None:
        return np.zeros((0, kept.size))
    coupling = csc_array(parts["K"] - stiffness.sigma * parts["M"])[:, kept]
    follow = -stiffness.solve_sparse(csc_array(coupling.tocsr()[inner]), "kept DOFs")
    follow[np.abs(follow) <= MOTION_SPECK * np.abs(follow).max(axis=0, initial=0.0)] = 0.0
    return follow


def _loads(parts: Parts, follow: FloatArray, places: tuple[IndexArray, IndexArray], spread: SparseMatrix) -> FloatArray:
    """Return the loads that static corrections are for: inertia of what follows, spread inputs and outputs."""
    kept, inner = places
    mass = csc_array(parts["M"].tocsr()[inner])
    inertia = mass[:, kept].toarray() + times(csc_array(mass[:, inner]), follow)
    return np.hstack([inertia, spread.tocsr()[inner].toarray()])


def _corrections(stiffness: ShiftedStiffness | None, modes: Modes, loads: FloatArray) -> FloatArray:
    """Return the static motions under loads beyond the modes, orthonormal in energy, dependent ones left out."""
    loads = loads[:, loads.any(axis=0)]
    if stiffness is None or loads.shape[1] == 0:
        return np.zeros((loads.shape[0], 0))
    motion = stiffness.solve(loads)
    whole = np.einsum("ij,ij->j", motion, times(stiffness.K, motion))
    motion -= modes.shapes @ (modes.shapes.T @ times(stiffness.M, motion))
    rest = np.einsum("ij,ij->j", motion, times(stiffness.K, motion))
    beyond = rest > DEPENDENT_CORRECTIONS * whole
    motion = motion[:, beyond] / np.sqrt(rest[beyond])
    energy = motion.T @ times(stiffness.K, motion)
    sizes, vectors = scipy.linalg.eigh((energy + energy.T) / 2.0)
    kept = sizes > DEPENDENT_CORRECTIONS * sizes.max(initial=0.0)
    motion = motion @ (vectors[:, kept] / np.sqrt(sizes[kept]))
    mass = motion.T @ times(stiffness.M, motion)  # and orthogonal in mass, so that what has none shows by itself
    return np.asarray(motion @ scipy.linalg.eigh((mass + mass.T) / 2.0)[1])
