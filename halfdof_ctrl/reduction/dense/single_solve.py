"""Equation (3): where the leading matrix W is nonsingular, one solve gives the whole state space.

    W (p''_i; p'_c; p_k) = B u - C T_i p'_i - K T_i p_i - K T_c p_c                        (3)

The state is x = (p_i, p_c, p'_i). The rows of W^-1 are gamma, alpha and the static recovery of Simionatto and
others, sections 2.1 to 2.3.
"""

import numpy as np

from halfdof_ctrl.base.arrays import EPS, FloatArray, is_zero, read_only, unit_matrix
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.reduction.algebra.blocks import connected_columns
from halfdof_ctrl.reduction.algebra.leading_matrix import FEW_DOFS, LeadingMatrix
from halfdof_ctrl.reduction.algebra.scaling import log_scaling_with_time
from halfdof_ctrl.reduction.dense.partition import DofPartition
from halfdof_ctrl.reduction.method.signals import Rounding, Signal, StateEquations, absorbed, trimmed

NO_SHIFT: tuple[FloatArray, ...] = ()  #: of (5), where no derivative of the inputs drives the states
PLAIN_ROUNDING = 4 * EPS  #: what a solution of few unknowns is known to, of the sums that it comes from
SOLVE_ROUNDING = 32 * EPS  #: times n: what a solution of (3) is known to, of its largest scaled unknown


def leading_columns(model: SecondOrderModel, partition: DofPartition) -> FloatArray:
    """Assemble W = [M T_i, C T_c, K T_k]."""
    n_i, moving = partition.n_inertial, partition.n_inertial + partition.n_half
    W = np.empty(model.M.shape, order="F")
    W[:, :n_i] = partition.times_basis(model.M, 0, n_i)
    W[:, n_i:moving] = partition.times_basis(model.C, n_i, moving)
    if partition.n_static:
        W[:, moving:] = partition.times_basis(model.K, moving, None)
    return W


def solved_at_once(model: SecondOrderModel, partition: DofPartition, leading: LeadingMatrix) -> StateEquations:
    """Solve (3) for everything on its right-hand side."""
    n_i, moving = partition.n_inertial, partition.n_inertial + partition.n_half
    m, N = model.B.shape[1], moving + n_i
    forces = (model.B,) if is_zero(model.Bv, model.Ba) else trimmed(model.quadratics.B)
    right = np.empty((model.M.shape[0], N + m * len(forces)), order="F")
    np.negative(partition.times_basis(model.K, 0, moving), out=right[:, :moving])
    np.negative(partition.times_basis(model.C, 0, n_i), out=right[:, moving:N])
    for k, matrix in enumerate(forces):
        right[:, N + k * m : N + (k + 1) * m] = matrix
    solved = leading.solve(right, overwrite=True)
    solved += 0.0  # leaves no negative zeros to be printed
    rate = np.zeros((N, right.shape[1]), order="F")  # x' as function of x, u, u', ...
    rate[n_i:moving] = solved[n_i:moving]
    rate[moving:] = solved[:n_i]
    A = rate[:, :N]
    A[:n_i, moving:] = unit_matrix(n_i)
    if len(forces) == 1:
        B, shift = rate[:, N:], NO_SHIFT
    else:
        B, shift = absorbed(A, [rate[:, start : start + m] for start in range(N, right.shape[1], m)])
    displacement = _displacement(partition, solved, m, shift)
    return StateEquations(A=read_only(A), B=read_only(B), displacement=displacement, shift=shift)


def plain_rounding(partition: DofPartition, leading: LeadingMatrix, equations: StateEquations) -> StateEquations:
    """Bound what the entries of a selection's equations are known to: a few roundings of |W^-1| |L| |U| times them.

    For inputs without derivatives.
    """
    n_i, moving = partition.n_inertial, partition.n_inertial + partition.n_half
    A, B, q = equations.A, equations.B, equations.displacement
    (N, m), static = B.shape, partition.order[moving:]
    solved = np.zeros((len(partition.order), N + m))
    solved[:n_i], solved[n_i:moving] = np.hstack([A, B])[moving:], np.hstack([A, B])[n_i:moving]
    solved[moving:] = np.hstack([q.X, q.direct(m)])[static]
    growth = np.abs(leading.solve(np.eye(len(solved)))) @ leading.elimination_size()
    known = PLAIN_ROUNDING * growth @ np.abs(solved)
    rate, X, U = np.zeros((N, N + m)), np.zeros(q.X.shape), np.zeros((len(solved), m))
    rate[moving:], rate[n_i:moving] = known[:n_i], known[n_i:moving]
    X[static], U[static] = known[moving:, :N], known[moving:, N:]
    return StateEquations(A=rate[:, :N], B=rate[:, N:], displacement=Signal(X, (U,)), shift=())


def rounding_of_solve(
    model: SecondOrderModel, partition: DofPartition, leading: LeadingMatrix, equations: StateEquations
) -> Rounding:
    """Bound the rounding errors of (3) and (5).

    A column in the solution of (3) is known to 32 n eps of its largest entry, measured in unknowns that are
    scaled to be the same in any units; of the largest one among unknowns that W connects, since others have neither
    errors nor units in common.
    """
    row_logs, _, _ = log_scaling_with_time(np.stack(model.quadratics.P))
    W = leading_columns(model, partition)
    scale = 1.0 / np.abs(np.exp2(row_logs)[:, None] * W).max(axis=0)[:, None]
    parts = connected_columns(W)

    def sizes_of_solution(right: FloatArray) -> FloatArray:
        solution = np.abs(leading.solve(np.asfortranarray(right))) / scale
        for part in parts:
            solution[part] = solution[part].max(axis=0, initial=0.0)
        return np.asarray(scale * solution)

    n_i, moving = partition.n_inertial, partition.n_inertial + partition.n_half
    known_to = np.abs(partition.T) if partition.sizes is None else partition.sizes
    A, X = np.abs(equations.A), np.abs(equations.displacement.X)
    free = sizes_of_solution(
        np.hstack([partition.times_basis(model.K, 0, moving), partition.times_basis(model.C, 0, n_i)])
    )
    A[n_i:] = np.maximum(A[n_i:], np.vstack([free[n_i:moving], free[:n_i]]))
    X[:, :moving] = np.maximum(X[:, :moving], known_to[:, :moving])
    X = np.maximum(X, known_to[:, moving:] @ free[moving:])
    rates, statics = [], []
    for force in model.quadratics.B:
        size = sizes_of_solution(force)
        rates.append(np.vstack([np.zeros_like(size[:n_i]), size[n_i:moving], size[:n_i]]))
        statics.append(known_to[:, moving:] @ size[moving:])
    shift = rates[1] + A @ rates[2]
    return Rounding(
        relative=SOLVE_ROUNDING * len(model.dofs),
        A=A,
        B=rates[0] + A @ shift,
        displacement=Signal(X, (statics[0] + X @ shift, statics[1] + X @ rates[2], statics[2])),
    )


def _displacement(partition: DofPartition, solved: FloatArray, m: int, shift: tuple[FloatArray, ...]) -> Signal:
    """Assemble equation (4) from the states and the static rows of the solution of (3)."""
    n, n_i, moving = solved.shape[0], partition.n_inertial, partition.n_inertial + partition.n_half
    N = moving + n_i
    X = np.zeros((n, N))
    if partition.basis is None and n > FEW_DOFS:
        X[partition.order[:moving], np.arange(moving)] = 1.0
    else:
        X[:, :moving] = partition.T[:, :moving]
    inputs: tuple[FloatArray, ...] = ()
    if moving < n:
        partition.add_static(X, solved[moving:, :N])
        inputs = tuple(
            [partition.from_static(solved[moving:, start : start + m]) for start in range(N, solved.shape[1], m)]
        )
    q = Signal(X, trimmed(inputs))
    return q.plus(Signal(np.zeros_like(X), tuple([X @ part for part in shift]))) if shift else q
