"""Peers: slycot's SB10JD on the descriptor forms that it is given in practice, and the count of QZ."""

from typing import Any

import numpy as np
import numpy.typing as npt
import scipy.linalg

from halfdof_ctrl import SecondOrderModel
from support.verdict import Improved

FloatArray = npt.NDArray[np.float64]
Descriptor = tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]  # A, B, C, D, E

INFINITE = 1e10  #: times the size of the pencil: QZ calls larger eigenvalues infinite


def companion(model: SecondOrderModel) -> Descriptor:
    """Give the companion form in q and q' with ``E = diag(I, M)``."""
    n, m = model.B.shape
    zero, unit = np.zeros((n, n)), np.eye(n)
    A = np.block([[zero, unit], [-model.K, -model.C]])
    E = scipy.linalg.block_diag(unit, model.M)
    return A, np.vstack([np.zeros((n, m)), model.B]), np.hstack([model.F, model.G]), model.D, E


def massive(model: SecondOrderModel) -> Descriptor:
    """Give the form in q and the velocities of the DOFs with mass."""
    heavy = model.M.any(axis=0)
    n, m = model.B.shape
    V = np.eye(n)[heavy]
    r = len(V)
    A = np.block([[-model.K, np.zeros((n, r))], [np.zeros((r, n)), np.eye(r)]])
    E = np.block([[model.C, model.M[:, heavy]], [V, np.zeros((r, r))]])
    B = np.vstack([model.B, np.zeros((r, m))])
    return A, B, np.hstack([model.F, model.G[:, heavy]]), model.D, E


def is_plain(model: SecondOrderModel) -> bool:
    """Tell whether the descriptor forms here hold all of a model: no accelerations, no derivatives of inputs."""
    return not any(matrix.any() for matrix in (model.H, model.Bv, model.Ba, model.Dv, model.Da))


def converted(descriptor: Descriptor) -> Improved | None:
    """Convert by SB10JD; None where slycot is missing or gives up."""
    try:
        import slycot  # noqa: PLC0415  # optional
    except ImportError:
        return None
    A, B, C, D, E = (np.asfortranarray(matrix, dtype=float) for matrix in descriptor)
    sb10jd: Any = slycot.sb10jd
    try:
        found = sb10jd(len(A), B.shape[1], len(C), A.copy(), B.copy(), C.copy(), D.copy(), E.copy())
    except (ValueError, ArithmeticError):
        return None
    A, B, C, D = (np.asarray(matrix, dtype=float) for matrix in found[:4])
    return Improved(A, B, C, D)


def conversions(model: SecondOrderModel) -> dict[str, Improved]:
    """Convert a model in each form that holds it."""
    if not is_plain(model):
        return {}
    forms = {"companion": companion}
    if not model.G[:, ~model.M.any(axis=0)].any():
        forms["[q; dq_massive]"] = massive
    found = {name: converted(form(model)) for name, form in forms.items()}
    return {name: system for name, system in found.items() if system is not None}


def qz_count(model: SecondOrderModel) -> int:
    """Count finite eigenvalues as QZ of the companion form shows them."""
    A, _, _, _, E = companion(model)
    alpha, beta = scipy.linalg.eigvals(A, E, homogeneous_eigvals=True)
    size = np.linalg.norm(A) / max(float(np.linalg.norm(E)), np.finfo(float).tiny)
    return int(np.count_nonzero(np.abs(alpha) < INFINITE * size * np.abs(beta)))
