"""Initial states by name, checked against the equations without inertia."""

from typing import TYPE_CHECKING

import numpy as np

from halfdof_ctrl.base.arrays import FloatArray
from halfdof_ctrl.base.by_name import by_name
from halfdof_ctrl.base.doors import is_mapping, real_number, real_numbers
from halfdof_ctrl.base.errors import MatrixError
from halfdof_ctrl.base.names import motion_names
from halfdof_ctrl.model.nonlinear import Values
from halfdof_ctrl.nonlinear.equilibrium import Equilibrium
from halfdof_ctrl.nonlinear.given_inputs import constant_inputs
from halfdof_ctrl.nonlinear.recovery import motion_at
from halfdof_ctrl.reduction.method.recovery import require_consistent

if TYPE_CHECKING:
    from halfdof_ctrl.nonlinear.reduction import NonlinearReduction


def initial_state(reduction: "NonlinearReduction", initial: Values, inputs: Values, t: float = 0.0) -> FloatArray:
    """Return the state for displacements and velocities by name, as `NonlinearModel.state` describes it."""
    u = constant_inputs(inputs, reduction.model.inputs)
    N = len(reduction.states)
    if initial is None:
        initial = {}
    if not is_mapping(initial):
        given = initial.state if isinstance(initial, Equilibrium) else initial
        x = real_numbers(given, "initial", "a state, or a mapping from names to numbers")
        if x.ndim == 0 and N:
            x = np.full(N, float(x))
        if x.shape != (N,) or not np.isfinite(x).all():
            msg = (
                f"A state of this model has {N} finite numbers, {', '.join(reduction.states)}, not the shape "
                f"{x.shape}. "
                "Give displacements and velocities by name."
            )
            raise MatrixError(msg, matrix="initial")
        return np.array(x)
    dofs = reduction.model.dofs
    names = (*motion_names(dofs, 0), *motion_names(dofs, 1))
    given = np.full(len(names), np.nan)
    for name, value in by_name(initial, names, "displacement or velocity").items():
        given[names.index(name)] = real_number(value, str(name))
    if np.isinf(given).any():
        msg = "Initial displacements and velocities must be finite numbers."
        raise MatrixError(msg, matrix="initial")
    q, v = given[: len(dofs)], given[len(dofs) :]
    x = reduction.partition.state_of(np.nan_to_num(q), np.nan_to_num(v))
    if reduction.linear.shift:
        x = x - reduction.linear.shift[0][:, : u.size] @ u
    required = motion_at(reduction, t, x, u, np.zeros_like(u))
    for derivative, wanted in enumerate((q, v)):
        require_consistent(motion_names(dofs, derivative), wanted, required[derivative])
    return x
