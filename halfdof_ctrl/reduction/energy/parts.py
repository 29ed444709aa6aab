"""Which DOFs are inertial, half and static, and whether a model has energy coordinates at all.

M must be zero outside the inertial DOFs and positive definite there, C zero at the static ones, C_cc regular, and K
symmetric. C is arbitrary otherwise: gyroscopic, unsymmetric, with negative dampers.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt
import scipy.linalg
from scipy.linalg.lapack import dgecon

from halfdof_ctrl.base.arrays import EPS, FloatArray, IndexArray, powers_of_two
from halfdof_ctrl.base.errors import EnergyFormError
from halfdof_ctrl.base.matrix_residual import exact_residual
from halfdof_ctrl.base.names import listed
from halfdof_ctrl.model.second_order import SecondOrderModel

SAME_ENTRY = 4 * EPS  #: entries above and below the diagonal that differ by this part of the larger are the same
TURNED_ENTRY = 16 * EPS  #: ... or by this part of their diagonal entries: T^T K T with elements at an angle, rounded
SINGULAR_DAMPING = 16.0  #: times n eps: a smaller reciprocal condition number of C_cc is rounding
PLAIN_DAMPING = 1.0 / 256.0  #: from this reciprocal condition number on, solutions with C_cc are not refined


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Parts:
    """The matrices of a model with n DOFs, symmetric where they must be, and its kinds of DOFs."""

    M: FloatArray  #: (n, n)
    C: FloatArray  #: (n, n)
    K: FloatArray  #: (n, n)
    inertial: IndexArray  #: (n_i,) DOFs with mass
    half: IndexArray  #: (n_c,) DOFs without mass, damped
    static: IndexArray  #: (n_k,) DOFs with neither

    @property
    def moving(self) -> IndexArray:
        """(n_i + n_c,) inertial and half DOFs, ascending."""
        return np.sort(np.concatenate([self.inertial, self.half]))


def energy_parts(model: SecondOrderModel) -> Parts:
    """Split a real dense model, or refuse it by the name of what stands against energy coordinates.

    Raises
    ------
    EnergyFormError
        M or K is unsymmetric.
    """
    M, K = _symmetric(model.M, "M", model.dofs), _symmetric(model.K, "K", model.dofs)
    C = np.asarray(model.C, dtype=float)
    massive = M.any(axis=0)
    damped = (C.any(axis=0) | C.any(axis=1)) & ~massive
    return Parts(
        M=M,
        C=C,
        K=K,
        inertial=np.flatnonzero(massive),
        half=np.flatnonzero(damped),
        static=np.flatnonzero(~massive & ~damped),
    )


def _symmetric(matrix: npt.NDArray[np.float64], letter: Literal["M", "K"], dofs: tuple[str, ...]) -> FloatArray:
    """Return a matrix that is symmetric but for rounding of its entries, symmetric."""
    if np.array_equal(matrix, matrix.T):
        return np.asarray(matrix, dtype=float)
    larger = np.maximum(np.abs(matrix), np.abs(matrix.T))
    gap = np.abs(matrix - matrix.T)
    size = np.sqrt(np.abs(np.diagonal(matrix)))
    if (gap <= np.maximum(SAME_ENTRY * larger, TURNED_ENTRY * np.outer(size, size))).all():
        return np.asarray((matrix + matrix.T) / 2.0)
    row, column = np.unravel_index(int(np.argmax(gap / np.where(larger > 0.0, larger, 1.0))), gap.shape)
    names = (dofs[int(row)], dofs[int(column)])
    msg = (
        f"There are no energy coordinates: {letter} is unsymmetric, {letter}[{names[0]}, {names[1]}] = "
        f"{matrix[row, column]:.6g} but {letter}[{names[1]}, {names[0]}] = {matrix[column, row]:.6g}, as with "
        "constraint equations, controls, circulatory or fluid forces, so that no energy stands behind it. Keep "
        f"states='dofs', or 'scaled' for python-control; if it should be symmetric, pass ({letter} + {letter}.T) / 2."
    )
    raise EnergyFormError(msg, reason="unsymmetric", dofs=names)


class HalfDamping:
    """C_cc, factorized with its rows and columns scaled by powers of two."""

    def __init__(self, parts: Parts, dofs: tuple[str, ...]) -> None:
        C = parts.C[np.ix_(parts.half, parts.half)]
        names = [dofs[j] for j in parts.half.tolist()]
        self.rows = powers_of_two(np.abs(C).max(axis=1, initial=0.0))
        self.columns = powers_of_two(np.abs(self.rows[:, None] * C).max(axis=0, initial=0.0))
        self.matrix = self.rows[:, None] * C * self.columns
        self.factors = None
        self.diagonal: FloatArray | None = None  #: of C_cc, where each half DOF has a damper of its own
        self.is_plain = True
        if C.size == 0:
            return
        with np.errstate(divide="ignore", invalid="ignore"):
            factors, pivots, failed = scipy.linalg.lapack.dgetrf(self.matrix)
        rcond = 0.0 if failed else float(dgecon(factors, float(np.linalg.norm(self.matrix, 1)))[0])
        if rcond <= SINGULAR_DAMPING * len(C) * EPS:
            msg = (
                "There are no energy coordinates in terms of DOFs: the damping among the DOFs without mass "
                f"({listed(names)}) is singular, rcond {rcond:.1e}, as with a damper between two of them, so that a "
                "combination of them is static. Keep states='dofs', or give one of them its small mass or damper."
            )
            raise EnergyFormError(msg, reason="singular damping", dofs=tuple(names))
        self.factors, self.is_plain = (factors, pivots), rcond >= PLAIN_DAMPING
        if np.count_nonzero(C) == np.count_nonzero(np.diagonal(C)):
            self.diagonal = np.diagonal(C)

    def solve(self, right: FloatArray) -> FloatArray:
        """Return ``C_cc^-1 right``, refined once with an exact residual unless C_cc is well conditioned."""
        if self.factors is None:
            return np.array(right)
        if self.diagonal is not None:
            return np.asarray(right / self.diagonal[:, None])
        scaled = self.rows[:, None] * right
        x = scipy.linalg.lu_solve(self.factors, scaled, check_finite=False)
        if not self.is_plain:
            x += scipy.linalg.lu_solve(self.factors, exact_residual(scaled, self.matrix, x), check_finite=False)
        return np.asarray(self.columns[:, None] * x)
