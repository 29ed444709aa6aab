"""Static condensation of sparse models, exact at every frequency: what is without inertia and not looked at.

Let s be the DOFs without mass and damping on which no input acts and of which no output tells anything, k the others:

    K_ss q_s = -K_sk q_k,    K_c = K_kk - K_ks K_ss^-1 K_sk,

M, C, B, F, D stay as they are. Unlike Guyan's, this condensation leaves out no inertia: eigenvalues, transfer function
and energy are those of the whole model, which has two infinite eigenvalues more for each DOF of s. It shares no code
with the reduction, so that what works on dense matrices can check a large model.
"""

from collections.abc import Collection
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.sparse import csc_array

from halfdof_ctrl.base.arrays import EPS, FloatArray, read_only
from halfdof_ctrl.base.sparse_arrays import IndexArray, SparseMatrix, as_sparse
from halfdof_ctrl.base.sparse_factors import COLUMNS_AT_A_TIME, PIVOTINGS, sparse_lu
from halfdof_ctrl.base.sparse_products import times
from halfdof_ctrl.model.second_order import SecondOrderModel

SOUND = 1e-12  #: componentwise backward error of the solutions with K_ss up to which they are believed
NEARLY_SINGULAR = 1e13  #: growth of a random solution with K_ss, scaled, from which a part floats to within rounding
CONDENSED_SQUARE, CONDENSED_COLUMNS, ROWS = ("M", "C"), ("B", "Bv", "Ba"), ("F", "G", "H")


def condensed(model: SecondOrderModel, *, most: int, keep: Collection[str] = ()) -> SecondOrderModel | None:
    """Return a sparse model as a dense one of fewer DOFs, with the same inputs and outputs.

    Parameters
    ----------
    model : SecondOrderModel
    most : int
        DOFs that may be left.
    keep : collection of str
        DOFs that stay although nothing asks for them.

    Returns
    -------
    SecondOrderModel or None
        None where more DOFs are left, where nothing can be condensed, or where K_ss is singular: where static DOFs
        float, or are tied by constraints.

    Examples
    --------
    Springs of 3 and 6 N/m in series carry a mass like one of 2 N/m:

    >>> from scipy.sparse import csc_array
    >>> chain = mechss(csc_array([[5, 0], [0, 0]]), None, [[3, -3], [-3, 9]]).select("F_q0", "q0")
    >>> condensed(chain, most=1).K.round(12).tolist()
    [[2.0]]
    """
    if not model.is_sparse:
        return None
    stays = _asked_for(model) | np.isin(np.array(model.dofs), list(keep))
    kept, static = np.flatnonzero(stays), np.flatnonzero(~stays)
    if kept.size > most or kept.size == 0 or static.size == 0:
        return None
    K = _condensed_stiffness(as_sparse(model.K), kept, static)
    if K is None:
        return None
    parts: dict[str, Any] = {"K": read_only(K)}
    parts |= {letter: _dense(as_sparse(getattr(model, letter))[kept][:, kept]) for letter in CONDENSED_SQUARE}
    parts |= {letter: _dense(as_sparse(getattr(model, letter))[kept]) for letter in CONDENSED_COLUMNS}
    parts |= {letter: _dense(as_sparse(getattr(model, letter))[:, kept]) for letter in ROWS}
    parts |= {letter: _dense(as_sparse(getattr(model, letter))) for letter in ("D", "Dv", "Da")}
    return replace(model, **parts, dofs=tuple([model.dofs[k] for k in kept.tolist()]))


def _asked_for(model: SecondOrderModel) -> np.ndarray:
    """Return which DOFs have an entry in M or C, are acted on by an input or seen by an output."""
    n = len(model.dofs)
    asked = np.zeros(n, dtype=bool)
    for letter in (*CONDENSED_SQUARE, *CONDENSED_COLUMNS, *ROWS):
        matrix = as_sparse(getattr(model, letter))
        if letter not in ROWS:
            asked[matrix.indices] = True
        if letter not in CONDENSED_COLUMNS:
            asked |= np.diff(matrix.indptr) > 0
    return asked


def _condensed_stiffness(K: SparseMatrix, kept: IndexArray, static: IndexArray) -> np.ndarray | None:
    """Return K_c, None where K_ss is singular to within rounding."""
    rows = csc_array(K[static])
    inner, right = csc_array(rows[:, static]), csc_array(rows[:, kept])
    left = csc_array(csc_array(K[kept])[:, static])
    size = csc_array(abs(inner))
    for way in PIVOTINGS:
        try:
            factors = sparse_lu(inner, *way)
        except RuntimeError:
            return None
        if _growth(factors, inner, size) > NEARLY_SINGULAR:
            return None
        K_c = np.asarray(csc_array(K[kept])[:, kept].toarray())
        sound = True
        for start in range(0, kept.size, COLUMNS_AT_A_TIME):
            b = right[:, start : start + COLUMNS_AT_A_TIME].toarray()
            x = factors.solve(b)
            x += factors.solve(b - times(inner, x))
            bound = times(size, np.abs(x)) + np.abs(b)
            error = np.abs(b - times(inner, x)) / np.where(bound > 0.0, bound, 1.0)
            sound = sound and bool(error.max(initial=0.0) <= SOUND)
            K_c[:, start : start + COLUMNS_AT_A_TIME] -= times(left, x)
        if sound:
            is_symmetric = (abs(K - K.T)).nnz == 0
            return (K_c + K_c.T) / 2.0 if is_symmetric else K_c
    return None


def _growth(factors: Any, inner: SparseMatrix, size: SparseMatrix) -> float:  # noqa: ANN401  # SuperLU has no public type
    """Return how much larger a random solution is than its right-hand side, in the unit of the rows."""
    unit = size.sum(axis=1)
    b = unit * np.random.default_rng(0).uniform(1.0, 2.0, inner.shape[0])
    solution: FloatArray = np.abs(factors.solve(b.astype(inner.dtype)))
    return float(solution.max()) if np.isfinite(solution).all() else 1.0 / EPS


def _dense(matrix: Any) -> np.ndarray:  # noqa: ANN401  # scipy-stubs do not know what an index gives
    return read_only(as_sparse(csc_array(matrix)).toarray())
