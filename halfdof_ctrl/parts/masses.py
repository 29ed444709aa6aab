"""Masses: a point that moves along axes, and a rigid body with points on lever arms.

A small rotation r = (rx, ry, rz) of a body moves its point at p = (X, Y, Z), seen from the centre of mass c, by

    u_x = c_x + ry Z - rz Y
    u_y = c_y + rz X - rx Z          u = c + r x p
    u_z = c_z + rx Y - ry X

so that a force at the point acts on c with that force and with the moment ``p x F``: rows of outputs, and the same rows
as columns of inputs.
"""

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from halfdof_ctrl.base.arrays import FloatArray, checked_matrix
from halfdof_ctrl.base.doors import real_numbers, require_mapping, require_switch, shown
from halfdof_ctrl.base.errors import ParameterError
from halfdof_ctrl.base.names import FORCE_PREFIX
from halfdof_ctrl.model.mechss import mechss
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.parts.links import LINKS_AXES, Axes, axis_name, checked, part_axes

N_TRANSLATIONS = 3
INERTIA_ROUNDING = 1e-12  #: of the largest moment of inertia: the matrix is symmetric and semidefinite up to this


def point_mass(m: float, axes: Axes = "z") -> SecondOrderModel:
    """Make a mass that moves along one or more axes.

    Parameters
    ----------
    m : float
        Mass [kg].
    axes : str or sequence of str
        Such as ``"z"`` or ``"xyz"``.

    Returns
    -------
    SecondOrderModel
        One DOF an axis, called like it.

    Raises
    ------
    ParameterError
        A mass that is not positive, or axes that are not x, y, z.

    Examples
    --------
    >>> point_mass(400).dofs, point_mass(40, "xz").M.tolist()
    (('z',), [[40.0, 0.0], [0.0, 40.0]])
    """
    found = part_axes(axes)
    if not set(found) <= set(LINKS_AXES[:N_TRANSLATIONS]):
        msg = f"axes = {shown(axes)}, but a point mass moves along x, y, z alone. Take rigid_body for rotations."
        raise ParameterError(msg, parameter="axes", value=axes)
    mass = checked(m, "m", "kg", positive=True)
    return mechss(mass * np.eye(len(found)), None, None, dofs=found, name="point_mass")


def rigid_body(
    m: float,
    inertia: npt.ArrayLike,
    points: Mapping[str, Sequence[float]] | None = None,
    *,
    rotations: bool = False,
) -> SecondOrderModel:
    """Make a rigid body with six DOFs and points to which other parts are joined.

    Parameters
    ----------
    m : float
        Mass [kg].
    inertia : (3,) or (3, 3) array_like
        Moments of inertia about the axes through the centre of mass, or the whole tensor [kg m^2]. The products of
        inertia stand in the tensor with their sign, ``-sum of m x y``.
    points : mapping from name to (x, y, z), optional
        Places seen from the centre of mass [m].
    rotations : bool
        Whether the points have the rotations as axes too, six in all, to clamp something to them; three by default.

    Returns
    -------
    SecondOrderModel
        DOFs ``x, y, z`` of the centre of mass [m] and ``rx, ry, rz``, small rotations [rad]. Every point gives outputs
        such as ``left_x`` and inputs ``F_left_x``; `halfdof_ctrl.assemble` joins parts to them by these names.

    Raises
    ------
    ParameterError
        A mass that is not positive, an inertia that no body has, or a place that is not three numbers.

    Examples
    --------
    A turn about y moves a point half a metre ahead downwards:

    >>> body = rigid_body(100, [5, 8, 9], {"front": (0.5, 0, 0)})
    >>> body.outputs[-3:], body.F[-1].tolist()
    (('front_x', 'front_y', 'front_z'), [0.0, 0.0, 1.0, 0.0, -0.5, 0.0])
    """
    mass, tensor = checked(m, "m", "kg", positive=True), _checked_inertia(inertia)
    M = np.zeros((len(LINKS_AXES), len(LINKS_AXES)))
    M[:N_TRANSLATIONS, :N_TRANSLATIONS], M[N_TRANSLATIONS:, N_TRANSLATIONS:] = mass * np.eye(N_TRANSLATIONS), tensor
    rows, names = [np.eye(len(LINKS_AXES))], list(LINKS_AXES)
    require_mapping({} if points is None else points, "points", "from names to places (x, y, z) [m]")
    require_switch(rotations, "rotations")
    for name, place in ({} if points is None else points).items():
        axes = LINKS_AXES if rotations else LINKS_AXES[:N_TRANSLATIONS]
        rows.append(_lever(name, place)[: len(axes)])
        names += [axis_name(name, axis) for axis in axes]
    F = np.vstack(rows)
    return mechss(
        M, None, None, F.T, F,
        dofs=LINKS_AXES, outputs=names, inputs=[FORCE_PREFIX + name for name in names], name="rigid_body",
    )  # fmt: skip


def _lever(name: str, place: Sequence[float]) -> FloatArray:
    """Give the (6, 6) motion of a point for the motions of the body."""
    try:
        X, Y, Z = (float(value) for value in place)
    except Exception as cause:
        msg = (
            f"Point {shown(name)} is at {shown(place)}, but a place is three numbers (x, y, z) [m] seen from the "
            "centre of mass."
        )
        raise ParameterError(msg, parameter=name, value=place) from cause
    if not np.isfinite([X, Y, Z]).all():
        msg = f"Point {shown(name)} is at {shown(place)}: every coordinate must be a finite number [m]."
        raise ParameterError(msg, parameter=name, value=place)
    rows = np.eye(len(LINKS_AXES))
    rows[:N_TRANSLATIONS, N_TRANSLATIONS:] = [[0.0, Z, -Y], [-Z, 0.0, X], [Y, -X, 0.0]]
    return rows


def _checked_inertia(inertia: npt.ArrayLike) -> FloatArray:
    """Give the (3, 3) tensor, and refuse one that no body has: J is semidefinite, and no moment exceeds the others."""
    given = real_numbers(inertia, "inertia", "three moments or a 3 x 3 tensor [kg m^2]")
    tensor = checked_matrix(np.diag(given) if given.shape == (N_TRANSLATIONS,) else given, "J", (N_TRANSLATIONS,) * 2)
    if np.iscomplexobj(tensor) or np.abs(tensor - tensor.T).max() > INERTIA_ROUNDING * np.abs(tensor).max():
        msg = f"inertia = {tensor.tolist()} kg m^2 is not a real symmetric tensor."
        raise ParameterError(msg, parameter="inertia", value=inertia)
    moments = np.linalg.eigvalsh(tensor)
    if moments[0] <= 0.0 or moments[2] > (moments[0] + moments[1]) * (1.0 + INERTIA_ROUNDING):
        msg = (
            f"inertia has the principal moments {moments[0]:.4g}, {moments[1]:.4g}, {moments[2]:.4g} kg m^2, but in a "
            "rigid body each is positive and none exceeds the sum of the others. Check units and signs of the products."
        )
        raise ParameterError(msg, parameter="inertia", value=inertia)
    return tensor
