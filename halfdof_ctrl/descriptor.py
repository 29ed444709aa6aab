"""The oracle: what the descriptor form itself says, by routes that the reduction does not take.

The eigenvalues come from the first-order pencil in (q, w), w = V^T q', that follows from the singular
value decomposition M = U S V^T of rank r:

    [ C   U S ] [q']   [ -K  0 ] [q]
    [ V^T  0  ] [w'] = [  0  I ] [w]                                                       (8)

It has dimension n + r, and the 2n - (n + r) eigenvalues at infinity that a companion form has besides
belong to the velocities of directions without mass. Zeros are the finite eigenvalues of the system pencil

    [ P(s)  -B(s) ]
    [ F(s)   D(s) ]                                                                        (9)
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg

from halfdof_ctrl.arrays import ComplexArray, FloatArray, Matrix
from halfdof_ctrl.densecopy import dense_copy
from halfdof_ctrl.errors import SingularPencilError
from halfdof_ctrl.model import SecondOrderModel
from halfdof_ctrl.names import listed
from halfdof_ctrl.pencils import RANK_TOLERANCE, FinitePart, balancing_powers, equilibrating_powers, finite_part
from halfdof_ctrl.sparseregular import require_regular_sparse

GENERIC_POINTS = (0.6 + 0.8j, 1.3 + 0.4j, 0.2 + 2.1j)  #: where det P(s) is looked at, in units of the time scale
NULL_VECTOR_SHARE = 1e-6  #: DOFs with more than this share of a null vector are named


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class PencilStructure:
    """Eigenvalues of ``P(s)`` for n DOFs, found without the reduction."""

    finite_eigenvalues: ComplexArray  #: by QZ [rad/s], sorted by size
    n_infinite: int  #: infinite eigenvalues of the companion form of dimension 2n
    index: int  #: of the first-order form (8): 0 or 1 for passive structures
    is_regular: bool  #: whether det P(s) is not identically zero
    gap: float  #: smallest ratio of a singular value that counts to one that does not, in all rank decisions


def pencil_structure(model: SecondOrderModel) -> PencilStructure:
    """Find the finite eigenvalues of the descriptor form and count the infinite ones.

    Parameters
    ----------
    model : SecondOrderModel
        Real or complex, with any M, C, K.

    Returns
    -------
    PencilStructure
        With a singular pencil (`is_regular` False) the finite eigenvalues mean nothing.

    Examples
    --------
    A damper of 5 N s/m against a spring of 10 N/m, no mass:

    >>> structure = pencil_structure(mechss([[0]], [[5]], [[10]]))
    >>> structure.finite_eigenvalues.real.round(12).tolist(), structure.n_infinite
    ([-2.0], 1)
    """
    model = dense_copy(model, "pencil_structure", "The poles of mech2ss(model) are the finite eigenvalues.")
    part, scale = _quadratic_pencil((model.K, model.C, model.M))
    finite = _sorted(part.eigenvalues * scale)
    return PencilStructure(
        finite_eigenvalues=finite,
        n_infinite=2 * len(model.dofs) - finite.size,
        index=len(part.steps),
        is_regular=part.is_regular,
        gap=part.gap,
    )


def zeros(model: SecondOrderModel) -> ComplexArray:
    """Find the transmission zeros from the second-order system pencil.

    The pencil keeps the mechanical form, so that no zeros are lost or invented where a state space
    would have long chains at infinity.

    Parameters
    ----------
    model : SecondOrderModel
        With any number of inputs and outputs; zeros of a model with more inputs than outputs (or the
        reverse) are the points where its rank drops.

    Returns
    -------
    (k,) complex ndarray
        Finite zeros [rad/s], sorted by size. Among them are poles of motions that the inputs do not
        reach or the outputs do not show. None are given where inputs and outputs are both dependent, as those of
        a transfer function that is zero everywhere.

    Raises
    ------
    SingularPencilError
        ``det P(s)`` vanishes identically.

    Examples
    --------
    A mass on a damper and a spring, velocity as output: one zero, at the origin.

    >>> zeros(mechss([[1]], [[2]], [[3]], [[1]], G=[[1]]))
    array([0.+0.j])
    """
    model = dense_copy(model, "zeros", "Take those of a reduced model: zeros(truncate_modes(...)).")
    require_regular(model)
    blocks = [
        np.block([[P, -B], [F, D]])
        for P, B, F, D in (
            (model.K, model.B, model.F, model.D),
            (model.C, model.Bv, model.G, model.Dv),
            (model.M, model.Ba, model.H, model.Da),
        )
    ]
    part, scale = _quadratic_pencil(blocks)
    if part.is_deficient:
        return np.zeros(0, dtype=np.complex128)
    return _sorted(part.eigenvalues * scale)


def require_regular(model: SecondOrderModel) -> None:
    """Refuse a singular pencil, naming the DOFs that nothing holds.

    Raises
    ------
    SingularPencilError
        ``P(s)`` is singular to working precision at three generic points.
    """
    if model.is_sparse:
        require_regular_sparse(model)
        return
    gamma = typical_frequency(model)
    for point in GENERIC_POINTS:
        s = gamma * point
        P = model.K + s * model.C + s**2 * model.M
        rows, columns = equilibrating_powers(np.abs(P))
        _, values, right = scipy.linalg.svd(P * rows[:, None] * columns)
        if values[-1] > RANK_TOLERANCE * values.size * values[0]:
            return
    null = np.abs(right[-1])
    dofs = tuple([model.dofs[index] for index in np.flatnonzero(null > NULL_VECTOR_SHARE * null.max()).tolist()])
    msg = (
        f"The pencil is singular: det P(s) vanishes at every s (smallest singular value {values[-1]:.1e} of "
        f"{values[0]:.1e} after scaling). DOFs {listed(dofs)} can move together in any way without a force: a node "
        "without spring, damper or mass, a constraint that stands twice, or two identical equations. Remove what is "
        "redundant or give it a stiffness."
    )
    raise SingularPencilError(msg, dofs=dofs)


def _quadratic_pencil(coefficients: Sequence[Matrix]) -> tuple[FinitePart, float]:
    """Deflate the pencil (8) of ``R_0 + R_1 s + R_2 s^2``; its eigenvalues are in units of the scale given back."""
    scale = _time_scale(coefficients)
    R0, R1, R2 = (matrix * scale**power for power, matrix in enumerate(coefficients))
    rows, columns = balancing_powers(np.maximum(np.maximum(np.abs(R0), np.abs(R1)), np.abs(R2)))
    R0, R1, R2 = (matrix * rows[:, None] * columns for matrix in (R0, R1, R2))
    left, right = _low_rank_factors(R2)
    rank = right.shape[0]
    corner = np.zeros((rank, rank))
    E = np.block([[R1, left], [right, corner]])
    A = np.block([[-R0, np.zeros_like(left)], [np.zeros_like(right), np.eye(rank)]])
    return finite_part(A, E), scale


def _low_rank_factors(matrix: Matrix) -> tuple[Matrix, Matrix]:
    """Factor a matrix as L R with as many columns in L as its rank; null rows and columns stay exactly null."""
    rows, columns = matrix.any(axis=1), matrix.any(axis=0)
    part = matrix[np.ix_(rows, columns)]
    down, across = equilibrating_powers(np.abs(part))
    left, values, right = scipy.linalg.svd(part * down[:, None] * across, full_matrices=False)
    rank = int(np.count_nonzero(values > RANK_TOLERANCE * max(matrix.shape) * values[0])) if values.size else 0
    speck = max(matrix.shape) * np.finfo(float).eps * (values[0] / values[rank - 1] if rank else 1.0)
    L, R = np.zeros((matrix.shape[0], rank), left.dtype), np.zeros((rank, matrix.shape[1]), right.dtype)
    L[rows] = np.where(np.abs(left[:, :rank]) <= speck, 0.0, left[:, :rank]) * values[:rank] / down[:, None]
    R[:, columns] = np.where(np.abs(right[:rank]) <= speck, 0.0, right[:rank]) / across
    return L, R


def typical_frequency(model: SecondOrderModel) -> float:
    """Give a frequency [rad/s], a power of two, at which the model's rows balance in the mean."""
    return _time_scale((model.K, model.C, model.M))


def _time_scale(coefficients: Sequence[Matrix]) -> float:
    """Give a typical frequency as a power of two: the mean, in the logarithm, of what each entry has to say.

    A place (i, j) with entries in R_h and R_l, h > l the highest and the lowest there are, balances at the frequency
    ``|R_l,ij / R_h,ij|^(1 / (h - l))``, in any unit of its row and column. Where no place has two, rows are asked.
    """
    sizes = np.array([np.abs(matrix) for matrix in coefficients])
    logs = _balances(sizes.reshape(len(sizes), -1))
    if not logs.size:
        logs = _balances(sizes.max(axis=2, initial=0.0))
    return float(2.0 ** np.round(logs.mean())) if logs.size else 1.0


def _balances(sizes: FloatArray) -> FloatArray:
    """Give the logarithms of the frequencies at which the lowest and the highest of each column are equal."""
    present = sizes > 0.0
    several = present.sum(axis=0) > 1
    sizes, present = sizes[:, several], present[:, several]
    low, high = present.argmax(axis=0), len(sizes) - 1 - present[::-1].argmax(axis=0)
    every = np.arange(sizes.shape[1])
    return np.asarray(np.log2(sizes[low, every] / sizes[high, every]) / (high - low))


def _sorted(values: ComplexArray) -> ComplexArray:
    """Sort by size, conjugate pairs with the positive imaginary part first."""
    with np.errstate(divide="ignore"):
        size = np.log(np.abs(values)).round(9)  # conjugates may differ by rounding
    return values[np.lexsort((-values.imag, size))]
