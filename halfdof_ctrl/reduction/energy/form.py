"""Energy coordinates: states whose half sum of squares is the mechanical energy.

With K = U^T U, static DOFs first, U = [U_kk U_kr; 0 U_rr], L = U_rr^T, and M_ii = R^T R the states are

    z = L^T q_r  (strain),   v = R q'_i  (momentum),   q'_c = C_cc^-1 (B_c u - L_c z - C_ci R^-1 v),       (26)

and ``z^T z / 2 + v^T v / 2`` is the energy. The trailing block U_rr *is* the static condensation. With
B_r := B_r - U_kr^T U_kk^-T B_k,

        [ -L_c^T C_cc^-1 L_c              (L_i^T - L_c^T C_cc^-1 C_ci) R^-1     ]      [ L_c^T C_cc^-1 B_c            ]
    A = [ -R^-T (L_i - C_ic C_cc^-1 L_c)  -R^-T (C_ii - C_ic C_cc^-1 C_ci) R^-1 ], B = [ R^-T (B_i - C_ic C_cc^-1 B_c) ]

is skew but for the dampers. Motions Phi that K leaves free stand first, p = Phi_i^T M q_i and v_r = p', so that their
columns hold exact zeros; the other momenta are v_e = N^T R q'_i with N the orthogonal complement of R Phi_i. A free
motion without mass has its displacement at a support as its one state. Derivation: docs/explanation/energy.md.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from halfdof_ctrl.base.arrays import EPS, LARGEST_DENSE_COPY, FloatArray, IndexArray, is_zero, read_only
from halfdof_ctrl.base.errors import EnergyFormError
from halfdof_ctrl.model.dense_copy import complex_model_error
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.reduction.energy.cholesky import corrected_factor, inverse, solved
from halfdof_ctrl.reduction.energy.free_motion import FreeMotions, free_motions
from halfdof_ctrl.reduction.energy.mass import MassFactor, product
from halfdof_ctrl.reduction.energy.parts import HalfDamping, Parts, energy_parts
from halfdof_ctrl.reduction.energy.rigid import StiffnessFactor, indefinite_error, stiffness_factor
from halfdof_ctrl.reduction.method.signals import Signal, absorbed, trimmed


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class EnergyForm:
    """``x' = A x + B u`` in energy coordinates, for N states, n DOFs and m inputs."""

    model: SecondOrderModel  #: dense
    A: FloatArray  #: (N, N)
    B: FloatArray  #: (N, m)
    shift: tuple[FloatArray, ...]  #: E_0, E_1, ... of equation (5), (N, m) each: x = x~ + E_0 u + E_1 u' + ...
    displacement: Signal  #: all n displacements, in terms of x~ and the inputs
    velocity: Signal  #: all n velocities
    from_q: FloatArray  #: (N, n) and ...
    from_v: FloatArray  #: (N, n) x = from_q q + from_v q'
    states: tuple[str, ...]  #: names of the N states
    dofs: tuple[str, ...]  #: names of the states that `T` transforms: q_i, q_c, q'_i
    position: IndexArray  #: (n_i + n_c,) DOFs whose displacements are `dofs`: the n_i inertial ones, then the half ones
    n_inertial: int  #: n_i
    n_rigid: int  #: number of free motions, whose displacements are the first states
    n_massive: int  #: number of them with mass, whose momenta come next
    n_strains: int  #: number of strains, which follow; the rest are momenta
    nearest: (
        float  #: energy over rounding, ratio (25) over eps, of the softest motion that is not free; inf if not near
    )

    @property
    def T(self) -> FloatArray:  # noqa: N802
        """(N, N) x = T x_dofs; a gain on DOF states is K_dofs = K T."""
        return np.hstack([self.from_q[:, self.position], self.from_v[:, self.position[: self.n_inertial]]])

    @property
    def T_inverse(self) -> FloatArray:  # noqa: N802
        """(N, N) x_dofs = T_inverse x; weights are Q = T_inverse^T Q_dofs T_inverse."""
        return np.vstack([self.displacement.X[self.position], self.velocity.X[self.position[: self.n_inertial]]])

    @property
    def output(self) -> Signal:
        """The model's outputs as functions of state, inputs and derivatives of inputs."""
        return motion_output(self.model, self.A, self.B, self.displacement, self.velocity)


def energy_form(model: SecondOrderModel) -> EnergyForm:
    """Write a model in energy coordinates.

    Parameters
    ----------
    model : SecondOrderModel
        Real, with symmetric K, positive semidefinite, M zero outside the inertial DOFs and positive definite there, and
        C_cc regular; C is arbitrary otherwise.

    Returns
    -------
    EnergyForm

    Raises
    ------
    EnergyFormError
        The model has no such coordinates; `reason` and `dofs` say why.
    ComplexModelError
        Complex matrices.
    ModelSizeError
        A sparse model whose dense copy would be too large.

    Examples
    --------
    A mass of 1 kg on a spring of 4 N/m: strain 2 q and momentum q' turn into each other.

    >>> energy_form(mechss([[1]], None, [[4]])).A.tolist()
    [[0.0, 2.0], [-2.0, 0.0]]
    """
    if model.is_complex:
        raise complex_model_error(model)
    model = model.as_dense()
    parts = energy_parts(model)
    order = np.concatenate([parts.static, parts.moving])
    K = parts.K[np.ix_(order, order)] if parts.static.size else parts.K
    factor = stiffness_factor(K, parts.static.size, tuple([model.dofs[j] for j in order]))
    mass = corrected_factor(parts.M[np.ix_(parts.inertial, parts.inertial)])
    if mass is None:
        raise _mass_error(model, parts)
    if parts.moving.size == 0:
        msg = "There are no energy coordinates, since the model has no states: displacements follow the inputs at once."
        raise EnergyFormError(msg, reason="no states", dofs=model.dofs)
    return _Assembly(model, parts, factor, MassFactor(mass)).form()


def energy_system(model: SecondOrderModel) -> EnergyForm | None:
    """Return the model in energy coordinates where it has them, else None.

    Sparse models with more than 2000 DOFs or signals have none.

    Examples
    --------
    A follower force makes K unsymmetric:

    >>> energy_system(mechss([[1, 0], [0, 1]], None, [[2, 1], [-1, 2]])) is None
    True
    """
    if model.is_complex or (
        model.is_sparse and max(map(len, (model.dofs, model.inputs, model.outputs))) > LARGEST_DENSE_COPY
    ):
        return None
    try:
        return energy_form(model)
    except EnergyFormError:
        return None


def _mass_error(model: SecondOrderModel, parts: Parts) -> EnergyFormError:
    """Make the refusal of an M that is singular or indefinite among the DOFs with mass."""
    M = parts.M[np.ix_(parts.inertial, parts.inertial)]
    size = np.sqrt(np.abs(np.diagonal(M)))
    scale = 1.0 / np.where(size > 0.0, size, 1.0)
    values, vectors = np.linalg.eigh(scale[:, None] * M * scale)
    dofs = [model.dofs[parts.inertial[j]] for j in np.argsort(-np.abs(vectors[:, 0]), kind="stable")[:8].tolist()]
    if values[0] < -len(M) * EPS:
        return indefinite_error("M", dofs)
    msg = (
        f"There are no energy coordinates in terms of DOFs: the mass among DOFs {', '.join(dofs)} is singular "
        f"(smallest eigenvalue {values[0]:.1e} at unit diagonal), so that a combination of them has no inertia. Keep "
        "states='dofs', or choose DOFs of which each has its own mass or none."
    )
    return EnergyFormError(msg, reason="singular mass", dofs=tuple(dofs))


class _Assembly:
    """The blocks of (26), for one model."""

    def __init__(self, model: SecondOrderModel, parts: Parts, factor: StiffnessFactor, mass: MassFactor) -> None:
        self.model, self.parts, self.mass = model, parts, mass
        n_k = parts.static.size
        moving = parts.moving
        self.U_kk, self.U_kr = factor.U[:n_k, :n_k], factor.U[:n_k, n_k:]
        self.L = factor.U[n_k:, n_k:].T  # (r, strains)
        self.i, self.c = np.searchsorted(moving, parts.inertial), np.searchsorted(moving, parts.half)
        self.strained = factor.carried[n_k:] - n_k  # DOFs of r whose strains are the states
        self.damping = HalfDamping(parts, model.dofs)
        self.C = parts.C if parts.moving.size == len(parts.C) else parts.C[np.ix_(moving, moving)]
        self.free: FreeMotions = free_motions(factor, n_k, self.i, mass.R, self.C)
        self.nearest = factor.nearest
        n_p, n_m, n_z = self.free.count, self.free.massive, self.L.shape[1]
        self.size = n_p + n_z + self.i.size
        #: (p, v_r, z, v_e) of equation (26)
        self.p, self.r, self.z, self.e = (
            slice(*ends) for ends in pairwise((0, n_p, n_p + n_m, n_p + n_m + n_z, self.size))
        )
        self.momenta = self.free.across(mass.inverse())  # q'_i of v_e
        self.half = self._half_velocity()
        given = trimmed(model.quadratics.B) or (model.B,)
        self.pressed = [solved(self.U_kk, B[parts.static], transposed=True) for B in given]
        #: what the inputs, their first and second derivatives do to q_r, static DOFs condensed
        self.inputs = [
            B[moving] - self.U_kr.T @ bent if n_k else B for B, bent in zip(given, self.pressed, strict=True)
        ]
        self.driven_half = [self.damping.solve(B[self.c]) for B in self.inputs]

    def form(self) -> EnergyForm:
        """Put the blocks together."""
        A, driven = self._equations()
        B, shift = absorbed(A, driven) if len(driven) > 1 else (driven[0], ())
        displacement, velocity = self._motion(shift)
        from_q, from_v = self._states_from_motion()
        moving, inertial, half = self.parts.moving, self.parts.inertial, self.parts.half
        position = np.concatenate([inertial, half])
        names = [self.model.dofs[j] for j in position.tolist()]
        return EnergyForm(
            model=self.model,
            A=read_only(A),
            B=read_only(B),
            shift=shift,
            displacement=displacement,
            velocity=velocity,
            from_q=read_only(from_q),
            from_v=read_only(from_v),
            states=self._names(moving),
            dofs=(*names, *[f"{self.model.dofs[j]}_dot" for j in inertial.tolist()]),
            position=read_only(position),
            n_inertial=inertial.size,
            n_rigid=self.free.count,
            n_massive=self.free.massive,
            n_strains=self.L.shape[1],
            nearest=self.nearest,
        )

    def _half_velocity(self) -> FloatArray:
        """Return q'_c as a function of (p, v_r, z, v_e), without the inputs and what v_r carries along."""
        half = np.zeros((self.c.size, self.size))
        if self.c.size:
            half[:, self.r] = self.free.damping[self.c]
            half[:, self.z] = self.L[self.c]
            half[:, self.e] = product(self.C[np.ix_(self.c, self.i)], self.momenta)
            half = -self.damping.solve(half)
        return half

    def _equations(self) -> tuple[FloatArray, list[FloatArray]]:
        """Return A and what the inputs and their derivatives drive."""
        free, mass, L, C, half = self.free, self.mass, self.L, self.C, self.half
        p, r, z, e = self.p, self.r, self.z, self.e
        L_c, C_ic = L[self.c], C[np.ix_(self.i, self.c)]
        A = np.zeros((self.size, self.size))
        A[z, e] = free.across(mass.over(L[self.i].T))  # skew to the last bit, but for what half DOFs do
        A[e, z] = -A[z, e].T
        resisted = product(C if self.i.size == len(C) else C[np.ix_(self.i, self.i)], self.momenta)
        if self.c.size:
            resisted += product(C_ic, half[:, e])
            A[z] += product(L_c.T, half)
            A[e, z] -= free.along(mass.under(product(C_ic, half[:, z])))
        A[e, e] = -free.along(mass.under(resisted)) if resisted.any() else 0.0
        if free.count:
            velocity = np.zeros((len(L), self.size))  # q'_r less Phi v_r
            velocity[self.i, e] = self.momenta
            velocity[self.c] = half
            A[p] = free.rates @ velocity[free.supports]
            A[p, r] += free.carried_rates
            A[e, r] = -free.along(mass.under(product(C_ic, half[:, r]) + free.damping[self.i]))
            A[r] = -(free.resisted @ velocity)
            A[r, r] -= free.resisted_rigid
        A += 0.0  # without negative zeros
        return A, [self._driven(B, of_half) for B, of_half in zip(self.inputs, self.driven_half, strict=True)]

    def _driven(self, B: FloatArray, of_half: FloatArray) -> FloatArray:
        """Return what one coefficient of the inputs drives."""
        free = self.free
        part = np.zeros((self.size, B.shape[1]))
        pushed = B[self.i]
        if self.c.size:
            pushed = pushed - product(self.C[np.ix_(self.i, self.c)], of_half)
            part[self.z] = product(self.L[self.c].T, of_half)
        part[self.e] = free.along(self.mass.under(pushed))
        if free.count:
            direct = np.zeros((len(self.L), B.shape[1]))
            direct[self.c] = of_half
            part[self.p] = free.rates @ direct[free.supports]
            part[self.r] = free.balance.T @ B - free.resisted @ direct
        return part

    def _motion(self, shift: tuple[FloatArray, ...]) -> tuple[Signal, Signal]:
        """Return displacements and velocities of all DOFs as functions of states and inputs."""
        model, parts, free = self.model, self.parts, self.free
        n, m, n_r = len(model.dofs), model.B.shape[1], len(self.L)
        q_r, v_r = np.zeros((2, n_r, self.size))
        q_r[:, self.p] = free.motions
        q_r[self.strained, self.z] = inverse(self.L[self.strained].T)
        if free.massive:
            q_r[:, self.z] -= free.massive_motions @ (free.momenta @ q_r[self.i, self.z])
        v_r[self.i, self.e] = self.momenta
        v_r[self.c] = self.half
        v_r[:, self.r] += free.carried
        to_half = [np.zeros((n_r, m)) for _ in self.inputs]
        for place, of_half in zip(to_half, self.driven_half, strict=True):
            place[self.c] = of_half
        if not parts.static.size:
            return _shifted(q_r, [], shift), _shifted(v_r, to_half, shift)
        flexible = [solved(self.U_kk, bent) for bent in self.pressed]
        across = -solved(self.U_kk, self.U_kr)
        q, v = np.zeros((2, n, self.size))
        q[parts.moving], v[parts.moving] = q_r, v_r
        q[parts.static], v[parts.static] = across @ q_r, across @ v_r
        q_u = [np.zeros((n, m)) for _ in self.inputs]
        v_u = [np.zeros((n, m)) for _ in range(len(self.inputs) + 1)]
        for k, (own, bend) in enumerate(zip(to_half, flexible, strict=True)):
            q_u[k][parts.static] = bend
            v_u[k][parts.moving] += own
            v_u[k][parts.static] += across @ own
            v_u[k + 1][parts.static] += bend
        return _shifted(q, q_u, shift), _shifted(v, v_u, shift)

    def _states_from_motion(self) -> tuple[FloatArray, FloatArray]:
        """Return the maps of ``x = from_q q + from_v q'``."""
        parts, free, n = self.parts, self.free, len(self.model.dofs)
        n_p, n_m = free.count, free.massive
        from_q, from_v = np.zeros((2, self.size, n))
        from_q[:n_m, parts.inertial] = free.momenta
        from_q[n_m:n_p, parts.moving[free.supports]] = free.rates[n_m:]
        from_q[self.z, parts.moving] = self.L.T
        from_v[self.r, parts.inertial] = free.momenta
        from_v[self.e, parts.inertial] = free.along(self.mass.R)
        return from_q, from_v

    def _names(self, moving: IndexArray) -> tuple[str, ...]:
        """Name the states: strains after their DOF, momenta too where nothing is free."""
        dofs, free = self.model.dofs, self.free
        rigid = [f"rigid{k + 1}" for k in range(free.count)]
        rates = [f"rigid{k + 1}_dot" for k in range(free.massive)]
        strains = [f"strain_{dofs[moving[j]]}" for j in self.strained.tolist()]
        if free.massive == 0:
            momenta = [f"momentum_{dofs[j]}" for j in self.parts.inertial.tolist()]
        else:
            momenta = [f"momentum{k + 1}" for k in range(self.i.size - free.massive)]
        return (*rigid, *rates, *strains, *momenta)


def motion_output(model: SecondOrderModel, A: FloatArray, B: FloatArray, q: Signal, v: Signal) -> Signal:
    """Return the model's outputs from displacements and velocities that are known as functions of the state."""
    output = Signal(np.zeros((len(model.outputs), len(A))), trimmed(model.quadratics.D))
    for matrix, motion in ((model.F, q), (model.G, v)):
        if not is_zero(matrix):
            output = output.plus(motion.combined(matrix))
    if not is_zero(model.H):
        output = output.plus(v.combined(model.H).derivative(A, B))
    return output


def _shifted(X: FloatArray, U: list[FloatArray], shift: tuple[FloatArray, ...]) -> Signal:
    """Write ``w = X x + ...`` in terms of x~ of equation (5)."""
    if not shift:
        return Signal(X, trimmed(tuple(U)))
    return Signal(X, trimmed(tuple(U))).plus(Signal(np.zeros_like(X), tuple([X @ part for part in shift])))
