"""From a nonlinear model to a `control.NonlinearIOSystem` with physical names, and its exact linearization."""

from typing import Any

import control
import numpy as np

from halfdof_ctrl.base.arrays import FloatArray
from halfdof_ctrl.base.errors import ImproperError
from halfdof_ctrl.base.names import control_label, control_labels, listed
from halfdof_ctrl.model.doors import checked_nonlinear
from halfdof_ctrl.model.nonlinear import NonlinearModel
from halfdof_ctrl.nonlinear.reduction import NonlinearReduction, reduce_nonlinear
from halfdof_ctrl.nonlinear.small_motion import feedback_of_elements
from halfdof_ctrl.systems.state_space_data import StateSpaceData


class MechanicalIOSystem(control.NonlinearIOSystem):  # type: ignore[misc]  # control is untyped
    """A `control.NonlinearIOSystem` that knows its analytic slopes, so that `control.linearize` uses them."""

    reduction: NonlinearReduction

    def linearize(  # numpydoc: as in control
        self,
        x0: Any,  # noqa: ANN401
        u0: Any = None,  # noqa: ANN401
        t: float = 0.0,
        params: Any = None,  # noqa: ANN401, ARG002
        eps: float = 1e-6,  # noqa: ARG002  # the step that is not needed
        copy_names: bool = False,  # noqa: FBT001, FBT002
        **kwargs: Any,  # noqa: ANN401
    ) -> control.StateSpace:
        """Return the linear system for small motions about a state, by the slopes of the laws.

        Parameters
        ----------
        x0, u0, t, copy_names, **kwargs
            As in `control.linearize`. `params` and `eps` have no meaning here.

        Raises
        ------
        LawError
            A slope there is infinite; the DOF is named.
        """
        if u0 is None:
            u0 = getattr(x0, "inputs", 0.0)
        x = np.array(np.broadcast_to(np.asarray(getattr(x0, "states", x0), dtype=float), (self.nstates,)))
        u = np.array(np.broadcast_to(np.asarray(u0, dtype=float), (self.ninputs,)))
        system = control.StateSpace(*linearized(self.reduction, float(t), x, u), self.dt, remove_useless_states=False)
        if copy_names:
            system._copy_names(self, prefix_suffix_name="linearized")  # noqa: SLF001  # as control does itself
        return control.StateSpace(system, **kwargs)


def mech2nlsys(nonlinear: NonlinearModel) -> control.NonlinearIOSystem:
    """Convert a nonlinear mechanical model to a nonlinear input/output system, exactly.

    Parameters
    ----------
    nonlinear : NonlinearModel
        Made by `nlmechss`.

    Returns
    -------
    control.NonlinearIOSystem
        States, inputs and outputs named as `mech2ss` names them. Its update function depends on (t, x, u) alone.
        `control.linearize` of it gives the analytic tangent; `control.find_operating_point` works too, but
        `NonlinearModel.equilibrium` knows the statics.

    Raises
    ------
    ImproperError
        An output follows the derivative of an input or of an element's force, such as the acceleration of a half DOF.
    NoAnswerError
        Raised by the system itself, when no motion answers a force.

    Examples
    --------
    A square damper of 2 N s²/m² under 8 N moves at 2 m/s:

    >>> from halfdof_ctrl import laws
    >>> oil = nlmechss(mechss(None, None, [[0]]), Damper("q0", law=laws.quadratic(2)))
    >>> mech2nlsys(oil).dynamics(0.0, [0.0], [8.0])
    array([2.])
    """
    reduction = reduce_nonlinear(checked_nonlinear(nonlinear, "mech2nlsys"))
    require_proper(reduction)
    A, B, B_d = reduction.A, reduction.B, reduction.B_d
    output, m = reduction.output, len(nonlinear.inputs)
    direct = output.direct(m + B_d.shape[1])
    C, D, D_d = output.X, direct[:, :m], direct[:, m:]
    feeds = bool(D_d.any())

    def update(t: float, x: FloatArray, u: FloatArray, params: object) -> FloatArray:  # noqa: ARG001
        _, d = reduction.solved(t, x, u)
        return np.asarray(A @ x + B @ u + B_d @ d)

    def observe(t: float, x: FloatArray, u: FloatArray, params: object) -> FloatArray:  # noqa: ARG001
        y = C @ x + D @ u
        return np.asarray(y + D_d @ reduction.solved(t, x, u)[1] if feeds else y)

    name = {} if nonlinear.name is None else {"name": control_label(nonlinear.name)}
    system = MechanicalIOSystem(
        update,
        observe,
        states=list(control_labels(reduction.states)),
        inputs=list(control_labels(nonlinear.inputs)),
        outputs=list(control_labels(nonlinear.outputs)),
        dt=0,
        **name,
    )
    system.reduction = reduction
    return system


def linearized(reduction: NonlinearReduction, t: float, x: FloatArray, u: FloatArray) -> StateSpaceData:
    """Return the state space of small motions about (t, x, u)."""
    w, _ = reduction.solved(t, x, u)
    feedback = feedback_of_elements(reduction, t, w)
    output, m = reduction.output, u.size
    direct = output.direct(m + reduction.B_d.shape[1])
    by_x, by_u = feedback @ reduction.X_w, feedback @ reduction.U_w
    return StateSpaceData(
        reduction.A - reduction.B_d @ by_x,
        reduction.B - reduction.B_d @ by_u,
        output.X - direct[:, m:] @ by_x,
        direct[:, :m] - direct[:, m:] @ by_u,
    )


def require_proper(reduction: NonlinearReduction) -> None:
    """Refuse outputs that follow a derivative of an input or of an element's force.

    Raises
    ------
    ImproperError
        With the pairs.
    """
    model, U = reduction.model, reduction.output.U[1:]
    if not U:
        return
    causes = (
        *model.inputs,
        *[place.words for place in reduction.geometry.places for _ in range(place.forces.start, place.forces.stop)],
    )
    pairs = tuple(
        [
            (causes[j], model.outputs[i], power)
            for power, part in enumerate(U, start=1)
            for i, j in np.argwhere(part != 0.0).tolist()
        ]
    )
    shown = listed([f"{result} from {cause}" for cause, result, _ in pairs], most=4)
    msg = (
        f"No state space gives {shown}: the output follows a derivative of the input or of the element's force, as the "
        "acceleration of a half DOF or the velocity of a static one does. Take another output by select(), or the "
        "motion by recover(), or filter the input."
    )
    raise ImproperError(msg, pairs=pairs)
