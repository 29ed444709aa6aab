"""Try a law before anything is computed with it: shape, kind and value of what it returns."""

from typing import Any

import numpy as np

from halfdof_ctrl.base.errors import LawError
from halfdof_ctrl.model.elements import Force
from halfdof_ctrl.model.law import Law

TRIED = np.array([-1e-3, 0.0, 1e-3])  #: values at which a law is tried, where they lie in its domain


def check_law(law: Law, element: str, dofs: tuple[str, ...]) -> None:
    """Refuse a law that does not return as many finite real numbers as it is given.

    Raises
    ------
    LawError
        Wrong shape, complex numbers or things that are no numbers, NaN or Inf at zero.
    """
    inside = TRIED[(law.domain[0] <= TRIED) & (law.domain[1] >= TRIED)]
    values = inside if inside.size else np.array([law.domain[0]])
    parts = {"law": law.force, "slope": law.slope} | ({} if law.inverse is None else {"inverse": law.inverse})
    for what, function in parts.items():
        given = values if what != "inverse" else 0.0 * values
        _check_values(_tried(function, given, what, element, dofs), given.shape, what, element, dofs)
        _check_values(_tried(function, float(given[0]), what, element, dofs), (), what, element, dofs)
    with np.errstate(all="ignore"):
        at_rest = float(np.asarray(law.force(np.zeros(1)))[0])
    if not np.isfinite(at_rest):
        msg = f"The law of {element} gives {at_rest} at zero, where every motion begins. Define it there."
        raise LawError(msg, element=element, dofs=dofs)


def check_force(force: Force, element: str) -> None:
    """Refuse a force that does not return one finite real number for each DOF that it acts on.

    Raises
    ------
    LawError
        Wrong shape, complex numbers or things that are no numbers, NaN or Inf at zero; likewise its jacobian.
    """
    q, v = np.zeros(len(force.displacements)), np.zeros(len(force.velocities))
    shape = (len(force.on),)
    values = _tried(
        lambda at: force.function(at[: q.size], at[q.size :], 0.0), np.concatenate([q, v]), "law", element, force.on
    )
    values = np.reshape(values, shape) if np.ndim(values) == 0 and shape == (1,) else values
    _check_values(values, shape, "law", element, force.on)
    if not np.isfinite(np.asarray(values, dtype=float)).all():
        msg = f"The law of {element} gives {values} at zero, where every motion begins. Define it there."
        raise LawError(msg, element=element, dofs=force.on)
    if force.jacobian is not None:
        parts = tuple(force.jacobian(q, v, 0.0))
        shapes = tuple([np.shape(part) for part in parts])
        wanted = ((*shape, q.size), (*shape, v.size))
        if shapes != wanted:
            msg = (
                f"The jacobian of {element} returns arrays of shapes {shapes}, but (df/dq, df/dv) have {wanted}: a row "
                "for each DOF that it acts on."
            )
            raise LawError(msg, element=element, dofs=force.on)


def _tried(function: Any, values: Any, what: str, element: str, dofs: tuple[str, ...]) -> Any:  # noqa: ANN401
    """Call a user's function; what it raises becomes one refusal."""
    try:
        with np.errstate(all="ignore"):
            return function(values)
    except (TypeError, ValueError, ArithmeticError, LookupError, AttributeError) as cause:
        msg = (
            f"The {what} of {element} cannot be called with {'an array' if np.ndim(values) else 'a number'}: {cause}. "
            "It must take both and return as much."
        )
        raise LawError(msg, element=element, dofs=dofs) from cause


def _check_values(values: Any, shape: tuple[int, ...], what: str, element: str, dofs: tuple[str, ...]) -> None:  # noqa: ANN401
    array = np.asarray(values)
    if np.iscomplexobj(array):
        msg = f"The {what} of {element} returns complex numbers. A force in time is real; take its real part."
        raise LawError(msg, element=element, dofs=dofs)
    if array.dtype.kind not in "biuf":
        msg = f"The {what} of {element} returns {array.dtype} where numbers are needed."
        raise LawError(msg, element=element, dofs=dofs)
    if array.shape != shape:
        msg = (
            f"The {what} of {element} returns the shape {array.shape} for values of shape {shape}. It must give one "
            "number for each."
        )
        raise LawError(msg, element=element, dofs=dofs)
