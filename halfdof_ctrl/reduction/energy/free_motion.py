"""Motions that the stiffness leaves free, normalized in mass, and what the dampers do to them.

With Phi = null(K), the identity at the supports, QR with pivoting of R Phi_i = Q [R_1 R_2; 0 0] P^T tells the motions
with mass from those without:

    Phi_m = Phi P [R_1^-1; 0],  Phi_m,i^T M Phi_m,i = I,       Phi_0 = Phi P [-R_1^-1 R_2; I],  Phi_0,i = 0.       (27)

With a velocity of Phi_m those of Phi_0 are carried along so that the dampers between them do not resist,
``Phi_0^T C (Phi_m + Phi_0 G) = 0``. Forces of dampers that are rounding of sums that cancel, as in a body that nothing
ties to the ground, are zero.
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from halfdof_ctrl.base.arrays import EPS, FloatArray, IndexArray
from halfdof_ctrl.base.matrix_residual import exact_product
from halfdof_ctrl.reduction.energy.cholesky import solved
from halfdof_ctrl.reduction.energy.rigid import StiffnessFactor

MASSLESS_MOMENTUM = 64.0  #: times n eps of the terms: a smaller momentum of a free motion is rounding
MOVED = 1e-9  #: of the largest displacement of a free motion: DOFs that move less are not of its body
BALANCED_FORCES = 4 * EPS  #: of the terms: forces of dampers that cancel to this part are rounding of their entries


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class FreeMotions:
    """d free motions of r moving DOFs, of which n_m have mass."""

    supports: IndexArray  #: (d,) moving DOFs at which they are measured
    motions: FloatArray  #: (r, d) Phi_m, then Phi_0
    massive: int  #: n_m
    momenta: FloatArray  #: (n_m, n_i) Phi_m,i^T M
    reflectors: FloatArray  #: (n_i, n_m) V and ...
    weighed: FloatArray  #: (n_m, n_i) Y of N, the last columns of I - V Y: orthonormal, orthogonal to R Phi_m
    rates: FloatArray  #: (d, d) of p' from velocities at the supports; zero for motions with mass
    carried_rates: FloatArray  #: (d, n_m) of p' from v_r
    carried: FloatArray  #: (r, n_m) Phi_m + Phi_0 G: the velocities that belong to v_r
    balance: FloatArray  #: (r, n_m) the same for the transpose of C: the sums of equations that v_r' comes from
    damping: FloatArray  #: (r, n_m) C times `carried`
    resisted: FloatArray  #: (n_m, r) the transpose of `balance` times C
    resisted_rigid: FloatArray  #: (n_m, n_m) what of both is left of C

    @property
    def count(self) -> int:
        """Number of free motions, d."""
        return int(self.motions.shape[1])

    def across(self, rows: FloatArray) -> FloatArray:
        """Return ``rows N``."""
        n_m = self.massive
        return rows[:, n_m:] - (rows @ self.reflectors) @ self.weighed[:, n_m:] if n_m else rows

    def along(self, columns: FloatArray) -> FloatArray:
        """Return ``N^T columns``."""
        n_m = self.massive
        return columns[n_m:] - self.weighed[:, n_m:].T @ (self.reflectors.T @ columns) if n_m else columns

    @property
    def massive_motions(self) -> FloatArray:
        """(r, n_m) Phi_m."""
        return self.motions[:, : self.massive]


def free_motions(factor: StiffnessFactor, first: int, i: IndexArray, mass: FloatArray, C: FloatArray) -> FreeMotions:
    """Normalize the free motions of a stiffness.

    Parameters
    ----------
    factor : StiffnessFactor
        Static DOFs first.
    first : int
        Number of static DOFs.
    i : (n_i,) ndarray of int
        Positions of the inertial DOFs among the moving ones.
    mass : (n_i, n_i) ndarray
        R of ``M_ii = R^T R``.
    C : (r, r) ndarray
        Damping among the moving DOFs.

    Returns
    -------
    FreeMotions
    """
    motions, supports = factor.motions[first:], factor.supports - first
    d, n_i = supports.size, i.size
    if d == 0:
        return _none(len(C), n_i)
    carried = mass @ motions[i]
    decomposed, triangle, order = scipy.linalg.qr(carried, mode="raw", pivoting=True)
    raw, tau, triangle = (np.asarray(part, dtype=np.float64) for part in (*decomposed, triangle))
    terms = np.linalg.norm(np.abs(mass) @ np.abs(motions[i]), axis=0)[order]
    length = np.array([np.linalg.norm(triangle[k:, k]) if k < n_i else 0.0 for k in range(d)])
    n_m = int(np.count_nonzero(length > MASSLESS_MOMENTUM * len(C) * EPS * terms))
    reflectors, weighed = _reflectors(raw[:, :n_m], tau[:n_m])
    corner, beside = triangle[:n_m, :n_m], triangle[:n_m, n_m:]
    turned = motions[:, order]
    with_mass = solved(corner, turned[:, :n_m].T, transposed=True).T
    without = turned[:, n_m:] - with_mass @ beside
    without[i] = 0.0
    with_mass = with_mass @ _mixing(with_mass)
    rates = np.zeros((d, d))
    rates[np.arange(n_m, d), order[n_m:]] = 1.0
    along, balance = (_carrying(matrix, with_mass, without) for matrix in (C, C.T))
    C_motion, resisted = _balanced(C, along), _balanced(C.T, balance).T
    return FreeMotions(
        supports=supports,
        motions=np.hstack([with_mass, without]),
        massive=n_m,
        momenta=(mass.T @ (mass @ with_mass[i])).T,
        reflectors=reflectors,
        weighed=weighed,
        rates=rates,
        carried_rates=np.vstack([np.eye(n_m), rates[n_m:] @ along[supports]]),
        carried=along,
        balance=balance,
        damping=C_motion,
        resisted=resisted,
        resisted_rigid=balance.T @ C_motion if resisted.any() else np.zeros((n_m, n_m)),
    )


def _reflectors(raw: FloatArray, tau: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return V and Y = S V^T of ``H_1 H_2 ... = I - V S V^T``, for reflectors ``H_k = I - tau_k v_k v_k^T``.

    ``S^-1 = striu(V^T V) + diag(1 / tau)`` (C. Puglisi, 1992).
    """
    reflects = tau != 0.0
    V = np.where(reflects, np.tril(raw, -1) + np.eye(*raw.shape), 0.0)
    inverse = np.triu(V.T @ V, 1) + np.diag(1.0 / np.where(reflects, tau, 1.0))
    return V, solved(inverse, V.T)


def _mixing(motions: FloatArray) -> FloatArray:
    """Return a reflection that mixes free motions of one body, which are alike: no input then drives one of them alone.

    Where one did, python-control would find a zero at exactly 0 beside the poles there, and a static gain that is no
    number instead of infinite. Motions of DOFs apart stay apart.
    """
    size = np.abs(motions)
    moved = (size > MOVED * size.max(axis=0, initial=0.0)).astype(int)
    _, body = connected_components(csr_array(moved.T @ moved), directed=False)
    mixing = np.eye(motions.shape[1])
    for number in np.unique(body[np.bincount(body)[body] > 1]):
        own = np.flatnonzero(body == number)
        v = np.sqrt(np.arange(2.0, own.size + 2.0))
        mixing[np.ix_(own, own)] -= (2.0 / float(v @ v)) * np.outer(v, v)
    return mixing


def _carrying(C: FloatArray, with_mass: FloatArray, without: FloatArray) -> FloatArray:
    """Add motions without mass to those with mass, so that dampers do not act on the former."""
    if 0 in (with_mass.shape[1], without.shape[1]):
        return with_mass
    share = np.linalg.lstsq(without.T @ C @ without, -without.T @ exact_product(C, with_mass))[0]
    return np.asarray(with_mass + without @ share)


def _balanced(C: FloatArray, motions: FloatArray) -> FloatArray:
    """Return ``C Phi`` with exact zeros where its terms cancel to rounding of the entries of C."""
    forces = exact_product(C, motions)
    terms = np.abs(C) @ np.abs(motions)
    return np.where(np.abs(forces) <= BALANCED_FORCES * terms, 0.0, forces)


def _none(size: int, n_i: int) -> FreeMotions:
    return FreeMotions(
        supports=np.zeros(0, dtype=np.intp),
        motions=np.zeros((size, 0)),
        massive=0,
        momenta=np.zeros((0, n_i)),
        reflectors=np.zeros((n_i, 0)),
        weighed=np.zeros((0, n_i)),
        rates=np.zeros((0, 0)),
        carried_rates=np.zeros((0, 0)),
        carried=np.zeros((size, 0)),
        balance=np.zeros((size, 0)),
        damping=np.zeros((size, 0)),
        resisted=np.zeros((0, size)),
        resisted_rigid=np.zeros((0, 0)),
    )
