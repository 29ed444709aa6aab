"""What joins parts: rigid ties, and any model with two ports; springs and dampers come from `model.elements`."""

from dataclasses import dataclass
from typing import TypeAlias

from halfdof_ctrl.model.elements import Damper, Spring
from halfdof_ctrl.model.second_order import SecondOrderModel


@dataclass(frozen=True, slots=True)
class Rigid:
    """A tie that lets two points move as one.

    Parameters
    ----------
    a, b : str
        DOFs or points of parts, as ``part_dof``; without an axis, all axes that both have. The name `a` stays.

    Examples
    --------
    >>> Rigid("body_z", "strut_top")
    Rigid(a='body_z', b='strut_top')
    """

    a: str
    b: str


@dataclass(frozen=True, slots=True, eq=False)
class Joint:
    """A model with two ports between two points: any dynamic stiffness Q(s).

    Parameters
    ----------
    a : str
        DOF or point of a part, as ``part_dof``.
    b : str, optional
        The point at the other end; None is the ground.
    model : SecondOrderModel
        Such as `maxwell` or `PronyFit.part`.
    ports : (str, str)
        DOFs of the model that go to `a` and `b`.
    name : str, optional
        By which the other DOFs of the model are called; ``joint1``, ``joint2``, ... by default.
    """

    a: str
    b: str | None
    model: SecondOrderModel
    ports: tuple[str, str] = ("top", "bottom")
    name: str | None = None


AnyJoint: TypeAlias = Rigid | Spring | Damper | Joint
