"""The projection of a model on a few motions, in coordinates that show what has no mass."""

from dataclasses import replace
from typing import Any

import numpy as np
import scipy.linalg
from scipy.sparse import csc_array

from halfdof_ctrl.base.arrays import EPS, FloatArray
from halfdof_ctrl.base.names import DERIVATIVE_SUFFIXES
from halfdof_ctrl.base.sparse_arrays import SparseMatrix
from halfdof_ctrl.base.sparse_products import times
from halfdof_ctrl.model.mechss import mechss
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.reduction.modal.craig_bampton import Motions, Parts

IMAGINARY_STIFFNESS = "K''"  #: the key of the imaginary part of a complex K among the matrices
MOTIONS_AT_A_TIME = 32  #: motions that are multiplied at a time
FAST_COORDINATE = 1e-10  #: square of the band's upper end over a coordinate's frequency up to which it needs no mass
MASSLESS_COMBINATION = 1e-13  #: of the scaled mass: combinations of coordinates below have none but rounding
PROJECTION_ROUNDING = 1e-12  #: of its terms: an entry below is rounding of a sum that cancels
COMBINATION_SPECK = 1e-8  #: of the largest entry of a combination without mass, scaled: entries below are rounding
KEPT_PREFERRED = 1e3  #: weight by which kept DOFs are preferred as those that stay static


def projected(
    model: SecondOrderModel, parts: Parts, motions: Motions, omega: float
) -> tuple[SecondOrderModel, FloatArray]:
    """Project a model on r motions, q = shapes p: a dense model of r DOFs.

    Parameters
    ----------
    model : SecondOrderModel
        It gives the names.
    parts : mapping from letter to csc_array
        Its matrices.
    motions : Motions
    omega : float
        Highest frequency that matters [rad/s].

    Returns
    -------
    small : SecondOrderModel
        Kept DOFs have their names, modes are called ``mode1, ...``, corrections ``correction1, ...``; a kept DOF of
        which only a combination with others has mass is called ``<dof>~``.
    basis : (n, r) ndarray
        The motion that each of its DOFs is.
    """
    kept, count = motions.kept.size, motions.omega.size
    modal = slice(kept, kept + count)
    M, K = (_outside(motions.shapes, parts[letter], modal) for letter in "MK")
    M[modal, modal], K[modal, modal] = np.eye(count), np.diag(motions.omega**2)
    C, gyroscopic = _between(motions.shapes, parts["C"]), csc_array(parts["C"] - parts["C"].T)
    C = C if gyroscopic.data.any() else (C + C.T) / 2.0
    signals: dict[str, Any] = {letter: np.asarray(parts[letter].T @ motions.shapes).T for letter in ("B", "Bv", "Ba")}
    signals |= {letter: times(parts[letter], motions.shapes) for letter in ("F", "G", "H")}
    lost = _between(motions.shapes, parts[IMAGINARY_STIFFNESS]) if IMAGINARY_STIFFNESS in parts else None
    M, turn = _massless_columns(M, K, omega, kept)
    if turn is not None:
        C, K = _cleaned(turn.T, C, turn), _cleaned(turn.T, K, turn)
        lost = None if lost is None else _cleaned(turn.T, lost, turn)
        signals |= {letter: turn.T @ signals[letter] for letter in ("B", "Bv", "Ba")}
        signals |= {letter: signals[letter] @ turn for letter in ("F", "G", "H")}
    signals |= {letter: parts[letter].toarray() for letter in ("D", "Dv", "Da")}
    small = mechss(
        M,
        C,
        K if lost is None else K + 0.5j * (lost + lost.T),
        **signals,
        dofs=_names(model.dofs, motions, turn),
        name=model.name,
        inputs=model.inputs,
        outputs=model.outputs,
    )
    basis = motions.shapes if turn is None else motions.shapes @ turn
    known_to = _known_to(model.known_to, parts, basis, small)
    return small if known_to == small.known_to else replace(small, known_to=known_to), basis


def _known_to(full: float, parts: Parts, basis: FloatArray, small: SecondOrderModel) -> float:
    """Return the relative rounding of projected entries, where those of the full model come from a file of few digits.

    An entry of the small model is a sum over many of the full one, which cancel where a long structure bends: what its
    terms lose at random adds up by squares. What cancels wholly, as the stiffness of a rigid motion, has no digits.
    """
    if full <= EPS:
        return EPS
    known, squares = full, basis**2
    for letter in "MCK":
        entries = np.abs(np.diagonal(getattr(small, letter)))
        terms: Any = abs(parts[letter]).power(2)
        lost = full * np.sqrt(np.einsum("ij,ij->j", squares, times(terms, squares)))
        told = lost < entries
        known = max(known, float((lost[told] / entries[told]).max(initial=0.0)))
    return known


def _between(basis: FloatArray, matrix: SparseMatrix) -> FloatArray:
    """Return ``basis^T matrix basis``, some columns at a time."""
    product = np.zeros((basis.shape[1], basis.shape[1]))
    if matrix.nnz == 0:
        return product
    for start in range(0, basis.shape[1], MOTIONS_AT_A_TIME):
        span = slice(start, start + MOTIONS_AT_A_TIME)
        product[:, span] = basis.T @ times(matrix, basis[:, span])
    return product


def _outside(basis: FloatArray, matrix: SparseMatrix, known: slice) -> FloatArray:
    """Return ``basis^T matrix basis`` of a symmetric matrix but for the block of some motions, which stays zero."""
    others = np.delete(np.arange(basis.shape[1]), known)
    part = basis.T @ times(matrix, basis[:, others])
    product = np.zeros((basis.shape[1], basis.shape[1]))
    product[:, others] = part
    product[others] = part.T
    product[np.ix_(others, others)] = (part[others] + part[others].T) / 2.0
    return product


def _massless_columns(M: FloatArray, K: FloatArray, omega: float, kept: int) -> tuple[FloatArray, FloatArray | None]:
    """Return the mass with null columns for all that has none, and the change of coordinates p = turn p' that it takes.

    A coordinate whose own frequency lies far above the band needs no mass. Where combinations v of the others have none
    but rounding, as many coordinates are made these combinations, ``p' = p`` for them; the mass of the others stays.
    """
    stiffness = np.abs(np.diagonal(K))
    slow = omega**2 * np.diagonal(M) > FAST_COORDINATE * stiffness
    M = M * slow * slow[:, None]
    heavy = np.flatnonzero(slow)
    scale = np.sqrt(stiffness[heavy] + omega**2 * np.diagonal(M)[heavy]) / omega
    ratios, vectors = scipy.linalg.eigh(M[np.ix_(heavy, heavy)] / scale / scale[:, None])
    null = vectors[:, ratios <= MASSLESS_COMBINATION] / scale[:, None]
    if null.shape[1] == 0:
        return M, None
    weights = np.where(heavy < kept, KEPT_PREFERRED, 1.0) * scale
    _, _, pivots = scipy.linalg.qr((null * weights[:, None]).T, pivoting=True, mode="economic")
    chosen = pivots[: null.shape[1]]
    combinations = np.linalg.solve(null[chosen].T, null.T).T
    size = np.abs(combinations) * scale[:, None]
    combinations[size <= COMBINATION_SPECK * size.max(axis=0)] = 0.0
    combinations[chosen] = np.eye(chosen.size)
    turn = np.eye(M.shape[0])
    turn[np.ix_(heavy, heavy[chosen])] = combinations
    M[heavy[chosen]] = 0.0
    M[:, heavy[chosen]] = 0.0
    return M, turn


def _cleaned(left: FloatArray, matrix: FloatArray, right: FloatArray) -> FloatArray:
    """Multiply, and set entries to zero that are rounding of a sum whose terms cancel."""
    product = left @ matrix @ right
    size = np.abs(left) @ np.abs(matrix) @ np.abs(right)
    return np.where(np.abs(product) <= PROJECTION_ROUNDING * size, 0.0, product)


def _names(dofs: tuple[str, ...], motions: Motions, turn: FloatArray | None) -> tuple[str, ...]:
    """Name the coordinates."""
    count, corrections = motions.omega.size, motions.shapes.shape[1] - motions.kept.size - motions.omega.size
    kept = [dofs[place] for place in motions.kept.tolist()]
    if turn is not None:
        mixed = np.count_nonzero(turn[: len(kept)], axis=1) > 1
        taken = set(dofs)
        kept = [_free_names(taken, f"{name}~")[0] if mixed[k] else name for k, name in enumerate(kept)]
    return (*kept, *_free_names(set(dofs), "mode", count), *_free_names(set(dofs), "correction", corrections))


def _free_names(taken: set[str], stem: str, count: int | None = None) -> tuple[str, ...]:
    """Return a name that no DOF has, or several with numbers."""
    while True:
        names = [stem] if count is None else [f"{stem}{k}" for k in range(1, count + 1)]
        if not any(name + end in taken for name in names for end in DERIVATIVE_SUFFIXES):
            return tuple(names)
        stem += "_"
