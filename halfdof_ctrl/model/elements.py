"""Springs and dampers between two DOFs, or one and the ground, and forces of any kind.

    M q'' + C q' + K q + sum of e_k phi_k = B u,    e_k = unit(a) - unit(b)

A `Spring` has phi(e' q), a `Damper` phi(e' q'): what the element pulls with, to be overcome by the inputs. The same two
classes join parts. Elements know no model; that a DOF exists is seen where they meet one.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

from halfdof_ctrl.base.doors import is_real_number, shown
from halfdof_ctrl.base.errors import ParameterError, SignalNameError
from halfdof_ctrl.base.names import Names, as_tuple, checked_names, listed
from halfdof_ctrl.model.law import Law
from halfdof_ctrl.model.laws import as_typed

ForceFunction: TypeAlias = Callable[..., Any]


@dataclass(frozen=True, slots=True, repr=False)
class Spring:
    """A force that follows the elongation ``q_a - q_b``.

    Parameters
    ----------
    a : str
        DOF at which the spring pulls.
    b : str, optional
        The DOF at its other end; None is the ground.
    law : Law or float
        The force [N] by the elongation [m]; a number is a stiffness [N/m].

    Raises
    ------
    SignalNameError
        A DOF that is no text, or the same at both ends.
    ParameterError
        No law, or a number that is not finite.

    Examples
    --------
    >>> from halfdof_ctrl import laws
    >>> Spring("y", law=laws.gap(1e5, 0.01))
    Spring("y", law=gap(1e5, 0.01))
    """

    a: str
    b: str | None = None
    law: Law | float = None  # type: ignore[assignment]  # refused below; b comes before it and has a default

    def __post_init__(self) -> None:
        """Check the ends and the law."""
        _check_ends("spring", self.a, self.b)
        object.__setattr__(self, "law", _checked_law("spring", self.a, self.b, self.law))

    @property
    def is_linear(self) -> bool:
        """Whether the law is a plain number."""
        return not isinstance(self.law, Law)

    def __repr__(self) -> str:
        """Give the spring as it is typed."""
        return _typed("Spring", self.a, self.b, self.law)


@dataclass(frozen=True, slots=True, repr=False)
class Damper:
    """A force that follows the rate of the elongation, ``q_a' - q_b'``.

    Parameters
    ----------
    a : str
        DOF at which the damper pulls.
    b : str, optional
        The DOF at its other end; None is the ground.
    law : Law or float
        The force [N] by the rate [m/s]; a number is a damping [N s/m].

    Raises
    ------
    SignalNameError
        A DOF that is no text, or the same at both ends.
    ParameterError
        No law, or a number that is not finite.

    Examples
    --------
    >>> from halfdof_ctrl import laws
    >>> Damper("y2", law=laws.quadratic(1e4, 30))
    Damper("y2", law=quadratic(1e4, 30))
    """

    a: str
    b: str | None = None
    law: Law | float = None  # type: ignore[assignment]  # as in Spring

    def __post_init__(self) -> None:
        """Check the ends and the law."""
        _check_ends("damper", self.a, self.b)
        object.__setattr__(self, "law", _checked_law("damper", self.a, self.b, self.law))

    @property
    def is_linear(self) -> bool:
        """Whether the law is a plain number."""
        return not isinstance(self.law, Law)

    def __repr__(self) -> str:
        """Give the damper as it is typed."""
        return _typed("Damper", self.a, self.b, self.law)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Force:
    """Any force ``f(q, v, t)`` on DOFs, on the left of the equation of motion as the other elements are.

    Parameters
    ----------
    function : callable
        ``f(q, v, t)`` [N], with the displacements q [m] and velocities v [m/s] that are declared, in that order, as
        1D arrays, and the time t [s]. It returns one force for each DOF of `on`. A spring would be ``k * q``: what
        is to push instead gets a minus.
    displacements, velocities : str or sequence of str
        DOFs whose displacements, and whose velocities, the function depends on.
    on : str or sequence of str, optional
        DOFs that it acts on; by default all that are declared, those of the displacements first.
    jacobian : callable, optional
        ``(df/dq, df/dv)`` at (q, v, t), as arrays with a row for each DOF of `on`. By default it is differenced with
        steps relative to the values.

    Raises
    ------
    SignalNameError
        No DOF is declared, or one twice.
    ParameterError
        `function` or `jacobian` is not callable.

    Examples
    --------
    >>> import numpy as np
    >>> Force(lambda q, v, t: np.sin(q), displacements="pendulum").on
    ('pendulum',)
    """

    function: ForceFunction
    displacements: tuple[str, ...]
    velocities: tuple[str, ...]
    on: tuple[str, ...]
    jacobian: ForceFunction | None

    def __init__(
        self,
        function: ForceFunction,
        displacements: Names = (),
        velocities: Names = (),
        jacobian: ForceFunction | None = None,
        *,
        on: Names = None,
    ) -> None:
        for what, part in (("function", function), ("jacobian", jacobian)):
            if not callable(part) and (part is not None or what == "function"):
                msg = f"The {what} of a Force must be callable with (q, v, t), not {shown(part)}."
                raise ParameterError(msg, parameter=what, value=part)
        q, v = (checked_names(as_tuple(names), len(as_tuple(names)), "DOFs") for names in (displacements, velocities))
        acted = tuple(dict.fromkeys((*q, *v))) if on is None else checked_names(as_tuple(on), len(as_tuple(on)), "DOFs")
        if not acted:
            msg = "A Force must say on which DOFs it acts, or which displacements or velocities it depends on."
            raise SignalNameError(msg, names=())
        parts: dict[str, object] = {"displacements": q, "velocities": v, "on": acted}
        for name, value in ({"function": function, "jacobian": jacobian} | parts).items():
            object.__setattr__(self, name, value)

    @property
    def name(self) -> str:
        """Name of the function."""
        return str(getattr(self.function, "__name__", type(self.function).__name__)).strip("<>")


Element: TypeAlias = Spring | Damper | Force


def ends_in_words(a: str, b: str | None) -> str:
    """Say where an element sits.

    >>> ends_in_words("y", None), ends_in_words("y", "y2")
    ('y and the ground', 'y and y2')
    """
    return f"{a} and {'the ground' if b is None else b}"


def _check_ends(kind: str, a: object, b: object) -> None:
    for end in (a, b):
        if not (isinstance(end, str) and end) and not (end is None and end is b):
            number = f" Write it as text, {str(end)!r}." if type(end) is int and is_real_number(end) else ""
            msg = (
                f"The ends of a {kind} are DOFs by name, the second may be None for the ground; {shown(end)} is "
                f"neither.{number}"
            )
            raise SignalNameError(msg, names=(shown(end),))
    if a == b:
        msg = f"A {kind} from {a} to itself never stretches and pulls at nothing. Name the DOF at its other end."
        raise SignalNameError(msg, names=(str(a),))


def _checked_law(kind: str, a: str, b: str | None, law: Any) -> Law | float:  # noqa: ANN401  # whatever the user gave
    if isinstance(law, Law):
        return law
    if is_real_number(law) and math.isfinite(law):
        return float(law)
    hint = (
        " Wrap a function as Law(function)." if callable(law) else " Give law=, a number or one of halfdof_ctrl.laws."
    )
    msg = f"The {kind} between {ends_in_words(a, b)} needs a law or a finite number, not {shown(law)}. {hint}"
    raise ParameterError(msg, parameter="law", value=law)


def _typed(kind: str, a: str, b: str | None, law: Law | float) -> str:
    ends = f'"{a}"' if b is None else f'"{a}", "{b}"'
    return f"{kind}({ends}, law={law if isinstance(law, Law) else as_typed(law)})"


def element_dofs(element: Element) -> tuple[str, ...]:
    """Return the DOFs that an element knows, those that it acts on first."""
    if isinstance(element, Force):
        return tuple(dict.fromkeys((*element.on, *element.displacements, *element.velocities)))
    return (element.a,) if element.b is None else (element.a, element.b)


def grounded(element: Element, words: str, dofs: tuple[str, ...]) -> Element | None:
    """Return an element whose ends are DOFs that are left, or the ground instead; None where it pulls at nothing.

    Raises
    ------
    SignalNameError
        A `Force` that knows a DOF that is not left, or a law that begins at one and would have to be turned round.
    """
    if isinstance(element, Force):
        gone = [name for name in element_dofs(element) if name not in dofs]
        if gone:
            msg = f"{words} knows {listed(gone)}, which cannot be taken out from under it. Make the model without it."
            raise SignalNameError(msg, names=tuple(gone))
        return element
    ends = [end for end in (element.a, element.b) if end in dofs]
    if not ends:
        return None
    if element.a not in dofs and not element.is_linear:
        msg = (
            f"{words} begins at {element.a}, which is taken out, and its law need not be the same the other way round. "
            f"Make it from {element.b} to {element.a}, or leave it out."
        )
        raise SignalNameError(msg, names=(element.a,))
    return replace(element, a=ends[0], b=ends[1] if len(ends) > 1 else None)
