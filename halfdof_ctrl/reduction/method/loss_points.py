"""The points on the imaginary axis at which a loss of digits shows: beside the slowest modes of a state space."""

import numpy as np
import scipy.linalg
from scipy.linalg.lapack import dgetrf
from scipy.sparse.linalg import ArpackError, ArpackNoConvergence, LinearOperator, eigs

from halfdof_ctrl.base.arrays import EPS, ComplexArray, FloatArray
from halfdof_ctrl.base.spectrum import balanced_states, eigenvalues_and_rounding

ALL_EIGENVALUES = 60  #: up to which all eigenvalues are computed to choose the frequencies
SLOW_MODES = 6  #: of more states, that are looked for
SLOW_MODES_ACCURACY = 1e-3  #: accuracy of these
MOST_FREQUENCIES = 4  #: frequencies that are chosen
BESIDE_MODE = 1.003  #: times the frequency of a mode: an undamped resonance itself determines nothing
AT_ORIGIN = 1e-12  #: of the largest eigenvalue found: one below is no frequency
BESIDE_ZERO = 1e-3  #: of the mean size of the eigenvalues: where slow ones are looked for if A is singular


def loss_points(A: FloatArray) -> ComplexArray:
    """Choose points on the imaginary axis: beside the slowest oscillations and at the slowest real pole."""
    poles, bounds = _slow_eigenvalues(A)
    moving = poles[np.abs(poles) > bounds]
    moving = moving[np.argsort(np.abs(moving))]
    swinging, real = np.abs(moving[moving.imag > 0.0]), np.abs(moving[moving.imag == 0.0])
    chosen = np.concatenate([swinging[: MOST_FREQUENCIES - 1], real[:1]])
    return np.asarray(1j * BESIDE_MODE * (chosen if chosen.size else np.ones(1)))


def _slow_eigenvalues(A: FloatArray) -> tuple[ComplexArray, FloatArray]:
    """Return all eigenvalues of a small matrix or the smallest ones, and up to which size they may be zero."""
    N = len(A)
    if N <= ALL_EIGENVALUES:
        poles, rounding = eigenvalues_and_rounding(A)
        return poles, rounding + AT_ORIGIN * np.abs(poles).max(initial=0.0)
    matrix, _ = balanced_states(A)
    factors, shift = dgetrf(matrix)[:2], 0.0  # says nothing of free motions, which are looked after below
    pivots = np.abs(np.diag(factors[0]))
    if pivots.min() <= N * EPS * pivots.max():  # free motions: look beside zero
        shift = -BESIDE_ZERO * float(np.exp(np.log(np.maximum(pivots, EPS * pivots.max())).mean()))
        factors = dgetrf(matrix - shift * np.eye(N))[:2]
    inverse = LinearOperator(
        (N, N), matvec=lambda v: scipy.linalg.lu_solve(factors, v, check_finite=False), dtype=np.float64
    )
    start = np.random.default_rng(0).standard_normal(N)
    try:
        found = eigs(inverse, k=SLOW_MODES, v0=start, tol=SLOW_MODES_ACCURACY, return_eigenvectors=False)
    except ArpackNoConvergence as some:
        found = np.asarray(some.eigenvalues)
    except ArpackError:
        found = np.zeros(0, dtype=complex)
    poles = np.asarray(shift + 1.0 / found[found != 0.0], dtype=np.complex128)
    return poles, np.full(
        poles.size, (AT_ORIGIN if shift == 0.0 else SLOW_MODES_ACCURACY) * np.abs(poles).max(initial=0.0)
    )
