r"""What the digits of a file leave unknown of a model: motions that its stiffness or mass hardly resists.

Entries of a symmetric matrix X that are known to e of their size change an eigenvalue l with the unit vector v by
:math:`e |v|^T |X| |v|` at most, in first order. An eigenvalue that is smaller may be the rounding of a zero: of K, a
rigid-body motion, whose poles then lie on either side of zero; of M, a direction without inertia, which as stored has
two very fast states. Both are looked for at unit diagonal, and said.
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg

from halfdof_ctrl.base.arrays import EPS, LARGEST_DENSE_COPY, FloatArray, as_dense
from halfdof_ctrl.base.digits import digits_in_words
from halfdof_ctrl.base.errors import CloseDecisionWarning, DataLimitWarning, give_warning
from halfdof_ctrl.base.names import listed
from halfdof_ctrl.model.second_order import SecondOrderModel

FILE_DIGITS_ZERO = (
    16 * EPS
)  #: times the size: to what an eigenvalue is computed; one below that is zero whatever the digits
MOVES = 0.1  #: part of the largest entry of a vector from which on a DOF is named


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Undetermined:
    """Directions of a symmetric matrix whose eigenvalues are no larger than the digits of the file leave unknown."""

    lowest: float  #: the lowest of these eigenvalues, over the largest one, at unit diagonal
    vectors: FloatArray  #: (n, k) directions, in the units of the model
    bounds: FloatArray  #: (k,) what rounding may make of ``v^T X v``


def undetermined(X: FloatArray, known_to: float) -> Undetermined | None:
    """Find the directions of a symmetric matrix that its digits do not tell from null ones.

    Parameters
    ----------
    X : (n, n) ndarray
    known_to : float
        Relative rounding of its entries.

    Returns
    -------
    Undetermined or None
        None where there are none, X is not symmetric, or what there is is zero to working precision.

    Examples
    --------
    A free spring whose ends were rounded to six digits:

    >>> found = undetermined(np.array([[1.23457, -1.23456], [-1.23456, 1.23456]]), 5e-6)
    >>> found.vectors.shape
    (2, 1)
    """
    rows = np.flatnonzero(X.any(axis=0))
    part = X[np.ix_(rows, rows)]
    if not rows.size or np.abs(part - part.T).max() > known_to * np.abs(part).max():
        return None
    size = np.abs(part.diagonal())
    size = np.where(size > 0.0, size, np.abs(part).max(axis=0))
    scaled = (part + part.T) / 2.0 / np.sqrt(size) / np.sqrt(size)[:, None]
    reach = float(np.abs(scaled).sum(axis=0).max())
    if _is_definite(scaled - known_to * reach * np.eye(rows.size)):
        return None
    values, vectors = scipy.linalg.eigh(scaled)
    bounds = known_to * np.einsum("ik,ij,jk->k", np.abs(vectors), np.abs(scaled), np.abs(vectors), optimize=True)
    unclear = (np.abs(values) <= bounds) & (np.abs(values) > FILE_DIGITS_ZERO * rows.size * reach)
    if not unclear.any():
        return None
    directions = np.zeros((len(X), np.count_nonzero(unclear)))
    directions[rows] = vectors[:, unclear] / np.sqrt(size)[:, None]
    return Undetermined(lowest=float(values[unclear].min() / values.max()), vectors=directions, bounds=bounds[unclear])


def _is_definite(matrix: FloatArray) -> bool:
    return bool(scipy.linalg.lapack.dpotrf(matrix, lower=1, overwrite_a=1)[1] == 0)


def warn_of_file_digits(model: SecondOrderModel, rcond: float, tol: float | None) -> None:
    """Warn of what the digits of a model's file leave open: rigid-body motions, and the number of states.

    Parameters
    ----------
    model : SecondOrderModel
    rcond : float
        Reciprocal condition number of W.
    tol : float, optional
        As given to `exact_reduction`: what counts as no mass is then said.

    Warns
    -----
    DataLimitWarning
        Eigenvalues of K are rounding of the file.
    CloseDecisionWarning
        Eigenvalues of M are, or W is singular to the digits of the file.
    """
    if model.known_to <= EPS or len(model.dofs) > LARGEST_DENSE_COPY:
        return
    K, M = as_dense(model.K), as_dense(model.M)
    free = undetermined(K, model.known_to)
    if free is not None:
        _warn_of_free_motions(model, free, M)
    if tol is not None:
        return
    massless = undetermined(M, model.known_to)
    if massless is not None:
        _warn_of_masses(model, massless)
    elif rcond < model.known_to:
        msg = (
            f"The leading matrix W is singular to the digits of the file ({digits_in_words(model.known_to)}): its "
            f"reciprocal condition number, {rcond:.1e}, is below the rounding of its entries, {model.known_to:.0e}. "
            "The number of states rests on digits that the file does not have. Look for entries that should cancel, "
            "and write the matrices with more digits."
        )
        give_warning(msg, CloseDecisionWarning)


def _warn_of_free_motions(model: SecondOrderModel, free: Undetermined, M: FloatArray) -> None:
    count = free.vectors.shape[1]
    inertia = np.einsum("ik,ij,jk->k", free.vectors, M, free.vectors, optimize=True)
    with_mass = inertia > 0.0
    speed = float(np.sqrt(free.bounds[with_mass] / inertia[with_mass]).max(initial=0.0))
    sign = "negative by" if free.lowest < 0.0 else "as small as"
    poles = f" Poles up to {speed:.2g} rad/s from zero, on either side, say nothing of stability." if speed else ""
    msg = (
        f"{count} eigenvalues of K are {sign} {abs(free.lowest):.0e} of the largest, which is the rounding of a file "
        f"with {digits_in_words(model.known_to)} (entries known to {model.known_to:.0e}): rigid-body motions, or "
        f"softer than its digits tell. They move {_moved(model, free)}.{poles} Write the matrices with more digits, "
        "or hold the model by what holds it."
    )
    give_warning(msg, DataLimitWarning)


def _warn_of_masses(model: SecondOrderModel, massless: Undetermined) -> None:
    count = massless.vectors.shape[1]
    msg = (
        f"{count} eigenvalues of M are within {abs(massless.lowest):.0e} of zero (of the largest), which is the "
        f"rounding of a file with {digits_in_words(model.known_to)} (entries known to {model.known_to:.0e}): as "
        f"stored, each of these directions ({_moved(model, massless)}) has two states, very fast ones, which the file "
        f"does not determine. Write the matrices with more digits, or pass method='orthogonal' and "
        f"tol={10.0 * model.known_to:.0e} to take them as massless."
    )
    give_warning(msg, CloseDecisionWarning)


def _moved(model: SecondOrderModel, found: Undetermined) -> str:
    size = np.abs(found.vectors) / np.abs(found.vectors).max(axis=0)
    return (
        f"DOFs {listed([model.dofs[index] for index in np.flatnonzero((size > MOVES).any(axis=1)).tolist()], most=4)}"
    )
