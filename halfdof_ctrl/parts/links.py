"""What every part shares: axes, checked sizes, and links between two nodes stamped into M, C, K.

A link of size v between the nodes a and b adds to its matrix, on each axis,

          a   b
    a  [  v  -v ]        spring: v = k in K,   damper: v = c in C,   inerter: v = b in M
    b  [ -v   v ]

so that a motion of both together takes no force.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from halfdof_ctrl.base.arrays import LARGEST_SIZE, SMALLEST_SIZE
from halfdof_ctrl.base.by_name import by_name
from halfdof_ctrl.base.doors import is_mapping, is_real_number, shown
from halfdof_ctrl.base.errors import ParameterError
from halfdof_ctrl.base.names import as_tuple, listed
from halfdof_ctrl.model.mechss import mechss
from halfdof_ctrl.model.second_order import SecondOrderModel

LINKS_AXES = ("x", "y", "z", "rx", "ry", "rz")  #: three displacements and the small rotations about them

Axes: TypeAlias = str | Sequence[str] | None
Size: TypeAlias = float | Mapping[str, float]  #: of a spring or damper: the same along all axes, or one for each


@dataclass(frozen=True, slots=True, eq=False)
class Link:
    """A spring (letter K), a damper (C) or an inerter (M) between two nodes."""

    letter: Literal["M", "C", "K"]
    first: str
    second: str
    size: Mapping[str, float]  #: [N/m], [N s/m] or [kg] for each axis


def part_axes(axes: Axes, **sizes: object) -> tuple[str, ...]:
    """Find the axes of a part: as said, or those of the sizes that are given axis by axis.

    Returns
    -------
    tuple of str
        ``("",)`` for a part along one axis without a name.

    Raises
    ------
    ParameterError
        An unknown axis, one that stands twice, or sizes with other axes than the part.

    Examples
    --------
    >>> part_axes(None, k={"x": 1.0, "z": 2.0}), part_axes("xyz"), part_axes(None, k=3.0)
    (('x', 'z'), ('x', 'y', 'z'), ('',))
    """
    by_axis = {symbol: tuple(value) for symbol, value in sizes.items() if is_mapping(value)}
    found = next(iter(by_axis.values()), ("",)) if axes is None else _split(axes)
    wrong = [axis for axis in found if axis not in LINKS_AXES and found != ("",)]
    if wrong or not found or len(set(found)) != len(found):
        told = shown(found if axes is None else axes)
        msg = f"axes = {told}: each must be one of {listed(LINKS_AXES)}, and stand once."
        raise ParameterError(msg, parameter="axes", value=axes)
    for symbol, keys in by_axis.items():
        if set(keys) != set(found):
            told = listed([str(key) for key in keys]) or "no axis"
            msg = (
                f"{symbol} is given for {told}, but the part has the axes {listed(found)}. "
                "Give one number for each of them, 0 where nothing acts."
            )
            raise ParameterError(msg, parameter=symbol, value=sizes[symbol])
    return found


def sized(
    value: object, axes: tuple[str, ...], symbol: str, unit: str, *, positive: bool = False
) -> Mapping[str, float]:
    """Check a size, one number or one for each axis, and give it axis by axis.

    Parameters
    ----------
    value : float or mapping from axis to float
    axes : tuple of str
        As `part_axes` gives them.
    symbol, unit : str
        What a refusal calls it.
    positive : bool
        Whether 0 is refused too, since it would leave a node loose.

    Raises
    ------
    ParameterError
        Negative, NaN, Inf or no number.
    """
    sizes = by_name(value, axes, "axis") if is_mapping(value) else dict.fromkeys(axes, value)
    return {axis: checked(sizes[axis], symbol, unit, positive=positive) for axis in axes}


def checked(value: object, symbol: str, unit: str, *, positive: bool = False) -> float:
    """Check one physical constant.

    Raises
    ------
    ParameterError
        Negative, NaN, Inf or no number; 0 if it must be positive.
    """
    sound = is_real_number(value)
    number = float(value) if sound else math.nan  # type: ignore[arg-type]
    if not (math.isfinite(number) and (number > 0.0 if positive else number >= 0.0)):
        allowed = "a positive number" if positive else "a number that is not negative"
        msg = (
            f"{symbol} = {shown(value)} {unit}, but it must be {allowed}, so that the part stays passive and its nodes "
            "held."
        )
        raise ParameterError(msg, parameter=symbol, value=value)
    if number and not SMALLEST_SIZE <= number <= LARGEST_SIZE:
        msg = (
            f"{symbol} = {shown(value)} {unit}, but products of such numbers overflow or vanish: sizes from "
            f"{SMALLEST_SIZE:.0e} to {LARGEST_SIZE:.0e} can be computed with. Choose other units."
        )
        raise ParameterError(msg, parameter=symbol, value=value)
    return number


def linked(nodes: Sequence[str], links: Sequence[Link], axes: tuple[str, ...], name: str) -> SecondOrderModel:
    """Make a part of nodes and links, each node with one DOF an axis."""
    places = {(node, axis): i for i, (node, axis) in enumerate((node, axis) for node in nodes for axis in axes)}
    matrices = {letter: np.zeros((len(places), len(places))) for letter in "MCK"}
    for link in links:
        for axis in axes:
            ends = [places[link.first, axis], places[link.second, axis]]
            matrices[link.letter][np.ix_(ends, ends)] += link.size[axis] * np.array([[1.0, -1.0], [-1.0, 1.0]])
    dofs = tuple([axis_name(node, axis) for node, axis in places])
    return mechss(matrices["M"], matrices["C"], matrices["K"], dofs=dofs, name=name)


def axis_name(node: str, axis: str) -> str:
    """Name the DOF of a node along an axis.

    >>> axis_name("top", "x"), axis_name("top", "")
    ('top_x', 'top')
    """
    return f"{node}_{axis}" if axis else node


def _split(axes: str | Sequence[str]) -> tuple[str, ...]:
    if isinstance(axes, str):
        return (axes,) if axes in LINKS_AXES else tuple(axes)
    return as_tuple(axes)
