"""Energy coordinates turned to the modes of the undamped structure.

With ``L_i^T R^-1 N = P Sigma Q^T`` (half DOFs held), zeta = P^T z and eta = Q^T v_e are strain and momentum of a
mode; without dampers ``zeta' = omega eta, eta' = -omega zeta``. The singular values are the natural frequencies
themselves, so that the square of their spread does not enter, as it does in ``eigh(K, M)``. What half DOFs add to the
strains comes last.
"""

from dataclasses import replace

import numpy as np
import scipy.linalg

from halfdof_ctrl.base.arrays import FloatArray, read_only
from halfdof_ctrl.reduction.energy.form import EnergyForm
from halfdof_ctrl.reduction.method.signals import Signal


def modal_form(form: EnergyForm) -> EnergyForm:
    """Turn energy coordinates to the modes of the undamped structure, half DOFs held.

    Parameters
    ----------
    form : EnergyForm
        N states, d of them displacements of free motions.

    Returns
    -------
    EnergyForm
        States: free motions and their rates as they were; strain and momentum of each mode, from the lowest frequency
        up; the relaxing strains of half DOFs. Its damping is coupled unless it is modal.

    Examples
    --------
    >>> from halfdof_ctrl.reduction.energy.form import energy_form
    >>> form = energy_form(mechss([[1, 0], [0, 1]], None, [[9, 0], [0, 4]]))
    >>> [round(float(omega), 12) for omega in np.diagonal(modal_form(form).A, 1)[::2]]
    [2.0, 3.0]
    """
    first = form.n_rigid + form.n_massive
    if len(form.A) == first + form.n_strains:  # no mass that a stiffness holds: nothing swings
        return replace(form, states=(*form.states[:first], *[f"half{k + 1}" for k in range(form.n_strains)]))
    z, e = np.arange(first, first + form.n_strains), np.arange(first + form.n_strains, len(form.A))
    G = form.from_q[z] @ _velocity_of_momenta(form, e)
    P, omega, Qt = scipy.linalg.svd(G, full_matrices=True)
    P, omega, Q = np.asarray(P), np.asarray(omega)[::-1], np.asarray(Qt).T[:, ::-1]
    P[:, : e.size] = P[:, : e.size][:, ::-1]
    signs = np.sign(Q[np.argmax(np.abs(Q), axis=0), np.arange(e.size)])
    Q, P[:, : e.size] = Q * signs, P[:, : e.size] * signs
    W = np.eye(len(form.A))
    pairs = first + 2 * np.arange(e.size)
    rest = np.arange(first + 2 * e.size, len(form.A))
    W[first:] = 0.0
    W[:, first:] = 0.0
    W[np.ix_(z, pairs)], W[np.ix_(z, rest)], W[np.ix_(e, pairs + 1)] = P[:, : e.size], P[:, e.size :], Q
    A = np.array(form.A)
    A[np.ix_(z, e)] -= G
    A[np.ix_(e, z)] += G.T
    A = W.T @ A @ W
    A[pairs, pairs + 1] += omega
    A[pairs + 1, pairs] -= omega
    modes = [name for k in range(1, e.size + 1) for name in (f"mode{k}_strain", f"mode{k}_momentum")]
    relaxing = [f"half{k + 1}" for k in range(rest.size)]
    return replace(
        form,
        A=read_only(A),
        B=read_only(W.T @ form.B),
        shift=tuple([W.T @ part for part in form.shift]),
        displacement=Signal(form.displacement.X @ W, form.displacement.U),
        velocity=Signal(form.velocity.X @ W, form.velocity.U),
        from_q=read_only(W.T @ form.from_q),
        from_v=read_only(W.T @ form.from_v),
        states=(*form.states[:first], *modes, *relaxing),
    )


def _velocity_of_momenta(form: EnergyForm, e: np.ndarray[tuple[int], np.dtype[np.intp]]) -> FloatArray:
    """Return (n, n_e) velocities of the inertial DOFs that belong to momenta, zero elsewhere."""
    massive = np.asarray(np.any(form.model.M, axis=0), dtype=bool).reshape(-1)
    return np.where(massive[:, None], form.velocity.X[:, e], 0.0)
