"""Reference models, each with its source."""

import math

import numpy as np

from halfdof_ctrl.base.doors import is_real_number, shown
from halfdof_ctrl.base.errors import ParameterError
from halfdof_ctrl.model.mechss import mechss
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.parts.links import Link, linked

SCHEME = """\
         y  [ m ]
      +-----+-----+
      |     |     |
      |   C_rs   K_v
     K_r    |     |
      |    (y1)  (y2)       y1, y2: nodes without mass, half DOFs
      |     |     |
      |   K_rs  +-+---+
      |     |  K_s   C_h
     -+-----+---+-----+-    ground
"""  #: of `hydromount`, as the docstring has it


def scheme_of(model: SecondOrderModel) -> str | None:
    """Return the scheme of a model that is the paper's mount; None for any other.

    >>> scheme_of(hydromount()) == SCHEME
    True
    """
    return SCHEME if (model.name, model.dofs) == ("hydromount", ("y", "y1", "y2")) else None


def hydromount(
    *,
    m: float = 20.0,
    K_r: float = 5000.0,
    K_rs: float = 1000.0,
    K_v: float = 500.0,
    K_s: float = 500.0,
    C_rs: float = 100.0,
    C_h: float = 300.0,
) -> SecondOrderModel:
    """Model a hydroelastic engine mount and the mass that it carries.

    ::

             y  [ m ]
          +-----+-----+
          |     |     |
          |   C_rs   K_v
         K_r    |     |
          |    (y1)  (y2)       y1, y2: nodes without mass, half DOFs
          |     |     |
          |   K_rs  +-+---+
          |     |  K_s   C_h
         -+-----+---+-----+-    ground

    DOF ``y`` is the mass on top, ``y1`` the node between the damper C_rs and the spring K_rs of the
    rubber, ``y2`` the node between the oil's spring K_v and the lower chamber. ``y1`` and ``y2`` have no
    inertia: they are half DOFs, and the model has four states.

    Parameters
    ----------
    m : float
        Mass on the mount [kg]. With 0 the mount stands alone, as on a test rig: three half DOFs that make two
        states, since y and y1 are damped against each other only.
    K_r : float
        Stiffness of the primary rubber [N/m].
    K_rs, C_rs : float
        Spring [N/m] and damper [N s/m] in series, the viscoelastic part of the rubber.
    K_v : float
        Volumetric stiffness of the oil [N/m].
    K_s : float
        Stiffness of the secondary rubber [N/m].
    C_h : float
        Damping of the oil's flow through the holes [N s/m].

    Returns
    -------
    SecondOrderModel
        Inputs ``F_y``, ``F_y1``, ``F_y2`` [N], outputs ``y``, ``y1``, ``y2`` [m].

    Raises
    ------
    ParameterError
        A negative mass, stiffness or damping, NaN or Inf.

    Notes
    -----
    Source: Simionatto, Miyasato, Melo and Dias Junior, "Singular mass matrices and half degrees of
    freedom: a general method for system reduction", section 3, equation (33), after Morello and others,
    The Automotive Body II, Springer 2011.

    Examples
    --------
    >>> hydromount().K.tolist()
    [[5500.0, 0.0, -500.0], [0.0, 1000.0, 0.0], [-500.0, 0.0, 1000.0]]
    """
    if not (is_real_number(m) and 0.0 <= m < math.inf):
        msg = (
            f"m = {shown(m)} kg, but the mass on the mount must be a number that is not negative; 0 for the mount "
            "alone."
        )
        raise ParameterError(msg, parameter="m", value=m)
    for symbol, value in (("K_r", K_r), ("K_rs", K_rs), ("K_v", K_v), ("K_s", K_s), ("C_rs", C_rs), ("C_h", C_h)):
        if not (is_real_number(value) and 0.0 <= value < math.inf):
            msg = (
                f"{symbol} = {shown(value)}, but a stiffness [N/m] or damping [N s/m] must be a number that is not "
                "negative."
            )
            raise ParameterError(msg, parameter=symbol, value=value)
    return mechss(
        [[m, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]],
        [[C_rs, -C_rs, 0.0], [-C_rs, C_rs, 0.0], [0.0, 0.0, C_h]],
        [[K_r + K_v, 0.0, -K_v], [0.0, K_rs, 0.0], [-K_v, 0.0, K_v + K_s]],
        dofs=("y", "y1", "y2"),
        name="hydromount",
    )


def hydromount_part(
    *,
    m: float = 0.0,
    K_r: float = 5000.0,
    K_rs: float = 1000.0,
    K_v: float = 500.0,
    K_s: float = 500.0,
    C_rs: float = 100.0,
    C_h: float = 300.0,
) -> SecondOrderModel:
    """Make the mount of `hydromount` a part between two ports, for `halfdof_ctrl.assemble`.

    Parameters
    ----------
    m : float
        Mass at the top [kg]; none by default, since it is another part.
    K_r, K_rs, K_v, K_s, C_rs, C_h : float
        As in `hydromount`, with the paper's values.

    Returns
    -------
    SecondOrderModel
        DOFs ``top`` (y there), ``bottom`` (the ground there), and the half DOFs ``1`` (y1) and ``2`` (y2).

    Raises
    ------
    ParameterError
        As in `hydromount`.

    Examples
    --------
    >>> hydromount_part().prescribe_motion("bottom").dofs
    ('top', '1', '2')
    """
    fixed = hydromount(m=m, K_r=K_r, K_rs=K_rs, K_v=K_v, K_s=K_s, C_rs=C_rs, C_h=C_h)
    sizes = {"K_r": K_r, "K_rs": K_rs, "K_v": K_v, "K_s": K_s, "C_rs": C_rs, "C_h": C_h}
    ends = {
        "K_r": ("top", "bottom"),
        "K_rs": ("1", "bottom"),
        "K_v": ("top", "2"),
        "K_s": ("2", "bottom"),
        "C_rs": ("top", "1"),
        "C_h": ("2", "bottom"),
    }
    links = [Link("K" if key[0] == "K" else "C", *pair, {"": sizes[key]}) for key, pair in ends.items()]
    part = linked(("top", "bottom", "1", "2"), links, ("",), "hydromount")
    return mechss(np.diag([m, 0.0, 0.0, 0.0]), part.C, part.K, dofs=part.dofs, name=fixed.name)
