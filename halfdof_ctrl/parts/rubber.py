"""Rubber: springs and dampers between a `top` and a `bottom`, with nodes between them that carry no mass.

    kelvin_voigt        maxwell             zener                     generalized_maxwell

        top               top                 top                          top
       +-+-+               |               +---+---+                 +------+-----+-- ...
       k   c               k               |       k1                k      k_1   k_2
       +-+-+               1 (half)        k       1 (half)          |      1     2
      bottom               c               |       c1                |      c_1   c_2
                           |               +---+---+                 +------+-----+-- ...
                         bottom              bottom                        bottom

In SI units; `top` and `bottom` are displacements [m], positive in the same direction. With axes every node has a DOF
on each, ``top_x, top_y, ...``, and the axes do not act on each other. The dynamic stiffness between top and bottom is

    k + c s,    k c s / (k + c s),    k + k1 c1 s / (k1 + c1 s),    k + sum of k_i s / (s + w_i),  w_i = k_i / c_i

Hydraulic mounts: `halfdof_ctrl.parts.hydraulic`. Sources: W. N. Findley, J. S. Lai and K. Onaran, Creep and Relaxation
of Nonlinear Viscoelastic Materials, 1976, chapter 5, has these four chains by the same names.
"""

from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np

from halfdof_ctrl.base.doors import items_of, shown
from halfdof_ctrl.base.errors import ParameterError
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.parts.links import Axes, Link, Size, linked, part_axes, sized

Branches: TypeAlias = Sequence[tuple[Size, Size]]

TOP, BOTTOM = "top", "bottom"
PAIR = 2


def kelvin_voigt(k: Size, c: Size, *, axes: Axes = None) -> SecondOrderModel:
    """Put a spring and a damper side by side.

    ::

        top --+-- k --+-- bottom
              +-- c --+

    Parameters
    ----------
    k, c : float or mapping from axis to float
        Stiffness [N/m] and damping [N s/m].
    axes : str or sequence of str, optional
        Such as ``"z"`` or ``"xyz"``; by default those of `k` and `c`, or one axis without a name.

    Returns
    -------
    SecondOrderModel
        DOFs ``top``, ``bottom``; with axes ``top_x``, ...

    Raises
    ------
    ParameterError
        A constant that is negative, NaN or Inf, or axes that do not fit.

    Examples
    --------
    >>> kelvin_voigt(k=2e5, c=50).K.tolist()
    [[200000.0, -200000.0], [-200000.0, 200000.0]]
    """
    found = part_axes(axes, k=k, c=c)
    links = [
        Link("K", TOP, BOTTOM, sized(k, found, "k", "N/m")),
        Link("C", TOP, BOTTOM, sized(c, found, "c", "N s/m")),
    ]
    return linked((TOP, BOTTOM), links, found, "kelvin_voigt")


def maxwell(k: Size, c: Size, *, axes: Axes = None) -> SecondOrderModel:
    """Put a spring and a damper in series: stiff when fast, without force at rest.

    ::

        top -- k -- 1 -- c -- bottom

    Parameters
    ----------
    k, c : float or mapping from axis to float
        Stiffness [N/m] and damping [N s/m], positive.
    axes : str or sequence of str, optional
        As in `kelvin_voigt`.

    Returns
    -------
    SecondOrderModel
        DOFs ``top``, ``bottom`` and the half DOF ``1`` between spring and damper.

    Raises
    ------
    ParameterError
        A constant that is not positive, or axes that do not fit.

    Examples
    --------
    At s = 1 a spring of 3 N/m and a damper of 6 N s/m give 3 * 6 / (3 + 6) = 2 N/m:

    >>> float(1 / maxwell(3, 6).prescribe_motion("bottom").select("F_top", "top")(1).real)
    2.0
    """
    found = part_axes(axes, k=k, c=c)
    return linked((TOP, BOTTOM, "1"), _branch("1", k, c, found, ("k", "c")), found, "maxwell")


def zener(k: Size, k1: Size, c1: Size, *, axes: Axes = None) -> SecondOrderModel:
    """Put a spring beside a spring and a damper in series: the standard linear solid.

    ::

        top --+------ k ------+-- bottom
              +- k1 - 1 - c1 -+

    Parameters
    ----------
    k : float or mapping from axis to float
        Stiffness at rest [N/m].
    k1, c1 : float or mapping from axis to float
        What the branch adds when fast [N/m], and its damper [N s/m], positive.
    axes : str or sequence of str, optional
        As in `kelvin_voigt`.

    Returns
    -------
    SecondOrderModel
        DOFs ``top``, ``bottom`` and the half DOF ``1`` between k1 and c1.

    Raises
    ------
    ParameterError
        A constant out of range, or axes that do not fit.

    Examples
    --------
    >>> zener(k=2, k1=3, c1=5).K.tolist()
    [[5.0, -2.0, -3.0], [-2.0, 2.0, 0.0], [-3.0, 0.0, 3.0]]
    """
    found = part_axes(axes, k=k, k1=k1, c1=c1)
    links = [Link("K", TOP, BOTTOM, sized(k, found, "k", "N/m")), *_branch("1", k1, c1, found, ("k1", "c1"))]
    return linked((TOP, BOTTOM, "1"), links, found, "zener")


def generalized_maxwell(k: Size, branches: Branches, *, c: Size = 0.0, axes: Axes = None) -> SecondOrderModel:
    """Put a spring, and a damper if there is one, beside any number of springs and dampers in series (Prony series).

    ::

        top --+------ k -------+-- bottom
              +------ c -------+
              +- k_1 - 1 - c_1 +
              +- k_2 - 2 - c_2 +

    Parameters
    ----------
    k : float or mapping from axis to float
        Stiffness at rest [N/m].
    branches : sequence of (k_i, c_i)
        Stiffness [N/m] and damping [N s/m] of each branch, positive, each a number or one for each axis.
    c : float or mapping from axis to float
        Damper beside the springs [N s/m]; none by default.
    axes : str or sequence of str, optional
        As in `kelvin_voigt`.

    Returns
    -------
    SecondOrderModel
        DOFs ``top``, ``bottom`` and the half DOFs ``1``, ``2``, ... of the branches.

    Raises
    ------
    ParameterError
        A constant out of range, a branch that is no pair, or axes that do not fit.

    Examples
    --------
    >>> generalized_maxwell(1.0, [(3, 5), (4, 6)]).dofs
    ('top', 'bottom', '1', '2')
    """
    pairs = [
        _pair(branch, number)
        for number, branch in enumerate(
            items_of(branches, "branches", "a list of pairs (k_i, c_i)", parameter="branches"), 1
        )
    ]
    sizes = {f"k_{i}": pair[0] for i, pair in enumerate(pairs, 1)} | {f"c_{i}": p[1] for i, p in enumerate(pairs, 1)}
    found = part_axes(axes, k=k, c=c, **sizes)
    links = [
        Link("K", TOP, BOTTOM, sized(k, found, "k", "N/m")),
        Link("C", TOP, BOTTOM, sized(c, found, "c", "N s/m")),
    ]
    for i, (spring, damper) in enumerate(pairs, start=1):
        links += _branch(str(i), spring, damper, found, (f"k_{i}", f"c_{i}"))
    inner = [str(i) for i in range(1, len(pairs) + 1)]
    return linked((TOP, BOTTOM, *inner), links, found, "generalized_maxwell")


def inerter(b: Size, *, axes: Axes = None) -> SecondOrderModel:
    """Make a force between two terminals that is proportional to their relative acceleration.

    ::

        top -- b -- bottom        F = b (top'' - bottom'')

    Parameters
    ----------
    b : float or mapping from axis to float
        Inertance [kg].
    axes : str or sequence of str, optional
        As in `kelvin_voigt`.

    Returns
    -------
    SecondOrderModel
        DOFs ``top``, ``bottom``. The mass matrix is singular without a null column.

    Raises
    ------
    ParameterError
        A negative inertance, or axes that do not fit.

    Notes
    -----
    Source: M. C. Smith, Synthesis of Mechanical Networks: The Inerter, IEEE Transactions on Automatic Control 47, 2002.

    Examples
    --------
    >>> inerter(7).M.tolist()
    [[7.0, -7.0], [-7.0, 7.0]]
    """
    found = part_axes(axes, b=b)
    return linked((TOP, BOTTOM), [Link("M", TOP, BOTTOM, sized(b, found, "b", "kg"))], found, "inerter")


def _branch(node: str, k: Size, c: Size, axes: tuple[str, ...], symbols: tuple[str, str]) -> list[Link]:
    """Put a spring from the top to a node and a damper from there to the bottom."""
    return [
        Link("K", TOP, node, sized(k, axes, symbols[0], "N/m", positive=True)),
        Link("C", node, BOTTOM, sized(c, axes, symbols[1], "N s/m", positive=True)),
    ]


def _pair(branch: object, number: int) -> tuple[Size, Size]:
    listed = isinstance(branch, Sequence | np.ndarray) and not isinstance(branch, str)
    pair: Any = branch if listed else ()
    if getattr(pair, "shape", (PAIR,))[:1] != (PAIR,) or len(pair) != PAIR:
        msg = f"Branch {number} is {shown(branch)}, but each must be a pair (k_i [N/m], c_i [N s/m])."
        raise ParameterError(msg, parameter="branches", value=branch)
    return pair[0], pair[1]
