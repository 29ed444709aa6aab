"""The motion of all DOFs from the state: displacements, and velocities by the chain rule.

q = X x + U u + U_d d,    q' = X x' + U u' + U_d d',    d' = -D (1 + S D)^-1 w_0',    D = f' - G         (N6)
"""

from typing import TYPE_CHECKING, Any

import numpy as np

from halfdof_ctrl.base.arrays import FloatArray
from halfdof_ctrl.base.errors import InconsistentStateError
from halfdof_ctrl.nonlinear.small_motion import feedback_of_elements
from halfdof_ctrl.reduction.method.recovery import RecoveredMotion, forward_slope, require_response

if TYPE_CHECKING:
    from halfdof_ctrl.nonlinear.reduction import NonlinearReduction


def motion_at(
    reduction: "NonlinearReduction", t: float, x: FloatArray, u: FloatArray, u_dot: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return displacements and velocities of all n DOFs, equation (N6)."""
    signal: Any = reduction.linear.displacement  # a Signal: nonlinear models are dense
    w, d = reduction.solved(t, x, u)
    x_dot = reduction.A @ x + reduction.B @ u + reduction.B_d @ d
    if not signal.U:
        return signal.X @ x, signal.X @ x_dot
    inputs = np.concatenate([u, d])
    direct, m = signal.U[0], u.size
    q = signal.X @ x + direct @ inputs
    v = signal.X @ x_dot + direct[:, :m] @ u_dot
    if direct[:, m:].any():
        w_dot = reduction.X_w @ x_dot + reduction.U_w @ u_dot
        v = v - direct[:, m:] @ (feedback_of_elements(reduction, t, w, singular="drop") @ w_dot)
    for power, part in enumerate(signal.U[1:], start=1):
        if power == 1:
            q = q + part[:, :m] @ u_dot
    return q, v


def recovered(reduction: "NonlinearReduction", response: Any) -> RecoveredMotion:  # noqa: ANN401  # TimeResponseData
    """Return displacements and velocities of all DOFs for a time response of this model."""
    require_response(response)
    x = np.asarray(response.x, dtype=float)
    time = np.asarray(response.t, dtype=float)
    m, N = len(reduction.model.inputs), len(reduction.states)
    u = np.zeros((m, time.size)) if response.u is None else np.asarray(response.u, dtype=float).reshape(-1, time.size)
    x = x.reshape(-1, time.size)
    if x.shape[0] != N or u.shape[0] != m:
        msg = (
            f"The response has {x.shape[0]} states and {u.shape[0]} inputs, the nonlinear model {N} and {m}. Recover a "
            "response of this very model."
        )
        raise InconsistentStateError(msg, names=reduction.states, given=(), required=())
    slope = forward_slope(u, time)
    motions = [motion_at(reduction, float(t), x[:, k], u[:, k], slope[:, k]) for k, t in enumerate(time)]
    displacement, velocity = (np.array([motion[i] for motion in motions]).T for i in range(2))
    return RecoveredMotion(time=time, displacement=displacement, velocity=velocity, dofs=reduction.model.dofs)
