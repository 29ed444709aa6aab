"""An integration of nonlinear models in descriptor form that shares nothing with the reduction: SUNDIALS' IDA.

    0 = M q'' + C q' + K q + sum of e phi - B u

is handed over fully implicitly in (q, q'_i): unknowns are all displacements and the velocities of the DOFs with mass,
and the rates of half DOFs are derivatives of unknowns, not unknowns of their own, since their algebraic equation is
singular at the reversal of the flow. The Jacobian is analytic.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from sksundae.ida import IDA

RTOL = 1e-9  #: of IDA; own error measured at most 1.4e-7


@dataclass(frozen=True)
class Element:
    """A spring (of the elongation) or damper (of its rate) by its direction, force and slope."""

    kind: str
    e: np.ndarray
    force: Callable[[float], float]
    slope: Callable[[float], float]


def integrated(
    matrices: tuple[Any, Any, Any, Any],
    elements: Sequence[Element],
    times: np.ndarray,
    inputs: Callable[[float], Any],
    size: float,
    q_0: np.ndarray | None = None,
    v_0: np.ndarray | None = None,
    longest: float = 0.0,
    rate_0: np.ndarray | None = None,
) -> np.ndarray:
    """Give the displacements (n, k) of all DOFs; `size` is a displacement below which nothing matters much."""
    M, C, K, B = (np.asarray(matrix, dtype=float) for matrix in matrices)
    n = len(M)
    massive = np.flatnonzero(M.any(axis=0))
    i = massive.size

    def rates(y: np.ndarray, yp: np.ndarray) -> np.ndarray:
        v = np.array(yp[:n])
        v[massive] = y[n:]
        return v

    def residual(t: float, y: np.ndarray, yp: np.ndarray, res: np.ndarray) -> None:
        v = rates(y, yp)
        left = M[:, massive] @ yp[n:] + C @ v + K @ y[:n] - B @ np.atleast_1d(inputs(t))
        for element in elements:
            left = left + element.e * element.force(float(element.e @ (y[:n] if element.kind == "spring" else v)))
        res[:n] = left
        res[n:] = yp[massive] - y[n:]

    def jacobian(t: float, y: np.ndarray, yp: np.ndarray, res: np.ndarray, cj: float, JJ: np.ndarray) -> None:  # noqa: ARG001
        v = rates(y, yp)
        by_q, by_v = K.copy(), C.copy()
        for element in elements:
            target, at = (by_q, y[:n]) if element.kind == "spring" else (by_v, v)
            target += np.outer(element.e, element.e) * element.slope(float(element.e @ at))
        JJ[:] = 0.0
        JJ[:n, :n] = by_q
        light = np.setdiff1d(np.arange(n), massive)
        JJ[:n, light] += cj * by_v[:, light]
        JJ[:n, n:] = by_v[:, massive] + cj * M[:, massive]
        JJ[n + np.arange(i), massive] += cj
        JJ[n + np.arange(i), n + np.arange(i)] -= 1.0

    y_0 = np.concatenate([np.zeros(n) if q_0 is None else q_0, np.zeros(i) if v_0 is None else v_0])
    yp_0 = np.zeros(n + i) if rate_0 is None else np.asarray(rate_0, dtype=float)
    solver = IDA(residual, rtol=RTOL, atol=RTOL * size * 1e-2, jacfn=jacobian, max_num_steps=500000, max_step=longest)
    solution = solver.solve(times, y_0, yp_0)
    if not solution.success:
        msg = f"IDA failed: {solution.message}"
        raise RuntimeError(msg)
    return np.asarray(solution.y)[:, :n].T
