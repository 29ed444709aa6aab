"""Gains of stored Riccati equations in ball arithmetic: by the sign of the Hamiltonian matrix, and by refinement."""

import flint
import numpy as np
import scipy.linalg
from scipy.linalg.lapack import dtrsyl

from halfdof_ctrl.base.arrays import FloatArray

PRECISION = 1000  #: bits, of which weak dampers and cheap inputs take some 300
SETTLED = 1e-60  #: change of a sign from step to step
STEPS = 400  #: of a sign at most
REFINED = 1e-25  #: last step of a refinement, of the gain


def balls(matrix: FloatArray) -> flint.arb_mat:
    """Hold doubles exactly."""
    rows, columns = matrix.shape
    return flint.arb_mat(rows, columns, [flint.arb(float(value)) for value in matrix.ravel()])


def rounded(matrix: flint.arb_mat) -> FloatArray:
    """Round midpoints to doubles."""
    values = [float(value.mid()) for value in matrix.entries()]
    return np.array(values).reshape(matrix.nrows(), matrix.ncols())


def gain_by_sign(A: FloatArray, B: FloatArray, Q: FloatArray, R: FloatArray, N: FloatArray) -> FloatArray:
    """Return the stabilizing gain of the equation as it is stored, of few states, to all digits of doubles."""
    before, flint.ctx.prec = flint.ctx.prec, PRECISION
    try:
        n, (a, b, q, r, c) = len(A), (balls(part) for part in (A, B, Q, R, N))
        inverse = r.inv().mid()
        folded = (a - b * inverse * c.transpose()).mid()
        drive, cost = (b * inverse * b.transpose()).mid(), (q - c * inverse * c.transpose()).mid()
        rows = [[*row_a, *row_g] for row_a, row_g in zip(folded.tolist(), (-drive).tolist(), strict=True)]
        rows += [
            [*row_q, *row_a] for row_q, row_a in zip((-cost).tolist(), (-folded.transpose()).tolist(), strict=True)
        ]
        Z = flint.arb_mat(rows)
        for _ in range(STEPS):
            new = ((Z + Z.inv()) / 2).mid()
            change = max(abs(float((value - old).mid())) for value, old in zip(new.entries(), Z.entries(), strict=True))
            size = max(abs(float(value.mid())) for value in new.entries())
            Z = new
            if change <= SETTLED * size:
                break
        entries = Z.tolist()
        left = [entries[k][n:] for k in range(2 * n)]
        right = [entries[k][:n] for k in range(2 * n)]
        for k in range(n):
            left[n + k][k] += 1
            right[k][k] += 1
        L, P = flint.arb_mat(left), flint.arb_mat(right)
        X = (L.transpose() * L).mid().solve((L.transpose() * (-P)).mid()).mid()
        return rounded(inverse * (b.transpose() * X + c.transpose()))
    finally:
        flint.ctx.prec = before


def gain_of_structure(
    matrices: tuple[FloatArray, FloatArray, FloatArray, FloatArray],
    Q: FloatArray,
    R: FloatArray,
    S: FloatArray,
    T: FloatArray,
) -> FloatArray:
    """Return the gain on (q, q') of ``M q'' + C q' + K q = B u`` from M, C, K, B themselves, M regular.

    Newton's steps from S are taken in states x = T (q, q'), in doubles; the residuals have all digits, so that only
    the solution ends the iteration.
    """
    before, flint.ctx.prec = flint.ctx.prec, PRECISION
    try:
        M, C, K, B = (balls(part) for part in matrices)
        n, inverse, to, cost, price = M.nrows(), M.inv().mid(), balls(T), balls(Q), balls(R)
        zero, unit = flint.arb_mat(n, n).tolist(), balls(np.eye(n)).tolist()
        lower_q, lower_v = (-(inverse * K)).mid().tolist(), (-(inverse * C)).mid().tolist()
        A = flint.arb_mat(
            [[*row, *other] for row, other in zip(zero, unit, strict=True)]
            + [[*row, *other] for row, other in zip(lower_q, lower_v, strict=True)]
        )
        drive = flint.arb_mat([*flint.arb_mat(n, B.ncols()).tolist(), *(inverse * B).mid().tolist()])
        back = to.inv().mid()
        A, drive, cost = (to * A * back).mid(), (to * drive).mid(), (back.transpose() * cost * back).mid()
        start = rounded(back.transpose() * balls(S) * back)
        X = balls((start + start.T) / 2.0)
        for _ in range(STEPS):
            gain = (price.inv() * drive.transpose() * X).mid()
            motion = (X * A).mid()
            residual = (motion + motion.transpose() + cost - gain.transpose() * price * gain).mid()
            form, turn = scipy.linalg.schur(rounded(A - drive * gain), output="real")
            size = max(abs(float(value)) for value in rounded(residual).ravel()) or 1.0
            step, scale, _ = dtrsyl(form, form, -turn.T @ rounded(residual / flint.arb(size)) @ turn, trana="T")
            step = turn @ (step / scale) @ turn.T
            change = balls((step + step.T) / 2.0) * flint.arb(size)
            X = (X + change).mid()
            moved = rounded(price.inv() * drive.transpose() * change)
            if np.linalg.norm(moved) <= REFINED * np.linalg.norm(rounded(gain)):
                return rounded(price.inv() * drive.transpose() * X * to)
        raise ArithmeticError(size)
    finally:
        flint.ctx.prec = before
