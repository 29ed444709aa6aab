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

import numpy as np

from halfdof_ctrl.base.arrays import EPS, LARGEST_DENSE_COPY, FloatArray, IndexArray, is_zero, read_only
from halfdof_ctrl.base.errors import EnergyFormError
from halfdof_ctrl.model.dense_copy import complex_model_error
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.reduction.energy.cholesky import corrected_factor, solved
from halfdof_ctrl.reduction.energy.free_motion import FreeMotions, free_motions
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
    dofs: tuple[str, ...]  #: names of the states of which `T` transforms: q_i, q_c, q'_i
    T: FloatArray  #: (N, N) x = T x_dofs; a gain on DOF states is K_dofs = K T
    T_inverse: FloatArray  #: (N, N) x_dofs = T_inverse x; weights are Q = T_inverse^T Q_dofs T_inverse
    n_rigid: int  #: number of free motions, whose displacements are the first states
    n_massive: int  #: number of them with mass, whose momenta come next
    n_strains: int  #: number of strains, which follow; the rest are momenta
    nearest: (
        float  #: energy over rounding, ratio (25) over eps, of the softest motion that is not free; inf if not near
    )

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
    factor = stiffness_factor(parts.K[np.ix_(order, order)], parts.static.size, tuple([model.dofs[j] for j in order]))
    mass = corrected_factor(parts.M[np.ix_(parts.inertial, parts.inertial)])
    if mass is None:
        raise _mass_error(model, parts)
    if parts.moving.size == 0:
        msg = "There are no energy coordinates, since the model has no states: displacements follow the inputs at once."
        raise EnergyFormError(msg, reason="no states", dofs=model.dofs)
    return _Assembly(model, parts, factor, mass).form()


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

    def __init__(self, model: SecondOrderModel, parts: Parts, factor: StiffnessFactor, mass: FloatArray) -> None:
        self.model, self.parts, self.mass = model, parts, mass
        n_k = parts.static.size
        moving = parts.moving
        self.U_kk, self.U_kr = factor.U[:n_k, :n_k], factor.U[:n_k, n_k:]
        self.L = factor.U[n_k:, n_k:].T  # (r, strains)
        self.i, self.c = np.searchsorted(moving, parts.inertial), np.searchsorted(moving, parts.half)
        self.strained = factor.carried[n_k:] - n_k  # DOFs of r whose strains are the states
        self.damping = HalfDamping(parts, model.dofs)
        self.C = parts.C[np.ix_(moving, moving)]
        self.free: FreeMotions = free_motions(factor, n_k, self.i, mass, self.C)
        self.nearest = factor.nearest
        self.half = self._half_velocity()  # q'_c of the states, less what v_r carries along
        self.driven_half = [self.damping.solve(B[self.c]) for B in self._inputs()]

    def form(self) -> EnergyForm:
        """Put the blocks together."""
        A, driven = self._equations()
        B, shift = absorbed(A, driven) if len(driven) > 1 else (driven[0], ())
        displacement, velocity = self._motion(shift)
        from_q, from_v = self._states_from_motion()
        moving, inertial, half = self.parts.moving, self.parts.inertial, self.parts.half
        position = np.concatenate([inertial, half])
        names = [self.model.dofs[j] for j in position.tolist()]
        dofs = (*names, *[f"{self.model.dofs[j]}_dot" for j in inertial.tolist()])
        from_states = np.vstack([displacement.X[position], velocity.X[inertial]])
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
            dofs=dofs,
            T=read_only(np.hstack([from_q[:, position], from_v[:, inertial]])),
            T_inverse=read_only(from_states),
            n_rigid=self.free.count,
            n_massive=self.free.massive,
            n_strains=self.L.shape[1],
            nearest=self.nearest,
        )

    def _over_mass(self, rows: FloatArray) -> FloatArray:
        """Return ``rows R^-1``."""
        return solved(self.mass, rows.T, transposed=True).T

    def _half_velocity(self) -> FloatArray:
        """Return q'_c as a function of (p, v_r, z, v_e), without the inputs and what v_r carries along."""
        free, n_c = self.free, self.c.size
        C_ci, C_cc = self.C[np.ix_(self.c, self.i)], self.damping
        of_strain = -C_cc.solve(self.L[self.c])
        of_momentum = -C_cc.solve(self._over_mass(C_ci) @ free.complement)
        of_rigid = -C_cc.solve(free.damping[self.c])
        return np.hstack([np.zeros((n_c, free.count)), of_rigid, of_strain, of_momentum])

    def _equations(self) -> tuple[FloatArray, list[FloatArray]]:
        """Return A and what the inputs and their derivatives drive."""
        free, L, C = self.free, self.L, self.C
        n_p, n_m, n_z, n_e = free.count, free.massive, L.shape[1], free.complement.shape[1]
        size = n_p + n_m + n_z + n_e
        p, r, z, e = np.split(np.arange(size), np.cumsum([n_p, n_m, n_z]))
        velocity = np.zeros((len(L), size))  # q'_r less Phi v_r
        velocity[np.ix_(self.i, e)] = solved(self.mass, free.complement)
        velocity[self.c] = self.half
        A = np.zeros((size, size))
        A[p] = free.rates @ velocity[free.supports]
        A[np.ix_(p, r)] += free.carried_rates
        A[z] = L.T @ velocity
        forces = -(C[self.i] @ velocity)
        forces[:, r] -= free.damping[self.i]
        forces[:, z] -= L[self.i]
        A[e] = free.complement.T @ solved(self.mass, forces, transposed=True)
        A[r] = -(free.resisted @ velocity)
        A[np.ix_(r, r)] -= free.resisted_rigid
        self._mirror(A, z, e)
        A += 0.0  # without negative zeros
        driven = []
        for B, of_half in zip(self._inputs(), self.driven_half, strict=True):
            direct = np.zeros((len(L), B.shape[1]))
            direct[self.c] = of_half
            part = np.zeros((size, B.shape[1]))
            part[p] = free.rates @ direct[free.supports]
            part[z] = L.T @ direct
            pushed = B[self.i] - C[self.i] @ direct
            part[e] = free.complement.T @ solved(self.mass, pushed, transposed=True)
            part[r] = free.balance.T @ B - free.resisted @ direct
            driven.append(part)
        return A, driven

    def _mirror(self, A: FloatArray, z: IndexArray, e: IndexArray) -> None:
        """Let what is skew without half DOFs be skew to the last bit."""
        if not self.c.size:
            A[np.ix_(e, z)] = -A[np.ix_(z, e)].T

    def _inputs(self) -> list[FloatArray]:
        """Return what the inputs, their first and second derivatives do to q_r, static DOFs condensed."""
        model, static, moving = self.model, self.parts.static, self.parts.moving
        given = trimmed(model.quadratics.B) or (model.B,)
        return [
            B[moving] - self.U_kr.T @ solved(self.U_kk, B[static], transposed=True) if static.size else B[moving]
            for B in given
        ]

    def _motion(self, shift: tuple[FloatArray, ...]) -> tuple[Signal, Signal]:
        """Return displacements and velocities of all DOFs as functions of states and inputs."""
        model, parts, free = self.model, self.parts, self.free
        n, m, n_r = len(model.dofs), model.B.shape[1], len(self.L)
        n_p, n_m, n_z, n_e = free.count, free.massive, self.L.shape[1], free.complement.shape[1]
        size = n_p + n_m + n_z + n_e
        q_r, v_r = np.zeros((2, n_r, size))
        q_r[:, :n_p] = free.motions
        held = np.zeros((n_r, n_z))
        held[self.strained] = solved(self.L[self.strained].T, np.eye(n_z))
        q_r[:, n_p + n_m : n_p + n_m + n_z] = held - free.massive_motions @ (free.momenta @ held[self.i])
        v_r[self.i, n_p + n_m + n_z :] = solved(self.mass, free.complement)
        v_r[self.c] = self.half
        v_r[:, n_p : n_p + n_m] += free.carried
        inputs = [np.asarray(B, dtype=float) for B in trimmed(model.quadratics.B)]
        to_half = [np.zeros((n_r, m)) for _ in inputs]
        for place, of_half in zip(to_half, self.driven_half, strict=False):
            place[self.c] = of_half
        flexible = [solved(self.U_kk, solved(self.U_kk, B[parts.static], transposed=True)) for B in inputs]
        across = -solved(self.U_kk, self.U_kr)
        q, v = np.zeros((2, n, size))
        q[parts.moving], v[parts.moving] = q_r, v_r
        q[parts.static], v[parts.static] = across @ q_r, across @ v_r
        q_u = [np.zeros((n, m)) for _ in inputs]
        v_u = [np.zeros((n, m)) for _ in range(len(inputs) + 1)]
        for k, (own, bend) in enumerate(zip(to_half, flexible, strict=True)):
            q_u[k][parts.static] = bend
            v_u[k][parts.moving] += own
            v_u[k][parts.static] += across @ own
            v_u[k + 1][parts.static] += bend
        return _shifted(q, q_u, shift), _shifted(v, v_u, shift)

    def _states_from_motion(self) -> tuple[FloatArray, FloatArray]:
        """Return the maps of ``x = from_q q + from_v q'``."""
        parts, free, n = self.parts, self.free, len(self.model.dofs)
        n_p, n_m, n_z, n_e = free.count, free.massive, self.L.shape[1], free.complement.shape[1]
        from_q, from_v = np.zeros((2, n_p + n_m + n_z + n_e, n))
        from_q[:n_m, parts.inertial] = free.momenta
        from_q[n_m:n_p, parts.moving[free.supports]] = free.rates[n_m:]
        from_q[n_p + n_m : n_p + n_m + n_z, parts.moving] = self.L.T
        from_v[n_p : n_p + n_m, parts.inertial] = free.momenta
        from_v[n_p + n_m + n_z :, parts.inertial] = free.complement.T @ self.mass
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
            momenta = [f"momentum{k + 1}" for k in range(free.complement.shape[1])]
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
    return Signal(X, trimmed(tuple(U))).plus(Signal(np.zeros_like(X), tuple([X @ part for part in shift])))
