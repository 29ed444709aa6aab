"""Hydraulic engine mount: rubber around two chambers of oil, joined by a long channel, the inertia track.

                top                                   x = bottom - top           compression [m]
          +------+------------------+                 p1 = A (x - z - d) / C1    upper chamber [Pa]
          |      | piston, area A   |                 p2 = A (z + d) / C2        lower chamber [Pa]
       k_r| c_r  | p1, C1           |
       rubber    +--- decoupler d --+                 I A^2 z'' + R A^2 z' = A (p1 - p2)
          |      +--- track  z -----+                 I_d A^2 d'' + R_d A^2 d' = A (p1 - p2)
          |        p2, C2           |
          +------+------------------+                 force on the top: A p1 upwards
               bottom

z and d are the volumes through track and decoupler over the piston's area, so that the oil in the track acts as a mass
``I A^2`` [kg] that moves with z [m]. The pressures are DOFs without mass and damping. Between top and bottom,

    K(s) = k_r + c_r s + A^2 (1/C1) (1/C2 + Z) / (1/C1 + 1/C2 + Z),    1/Z = 1/(I s^2 + R s) + 1/(I_d s^2 + R_d s)

Source: R. Singh, G. Kim and P. V. Ravindra, Linear analysis of automotive hydro-mechanical mount with emphasis on
decoupler characteristics, Journal of Sound and Vibration 158, 1992, pages 219-243. The gap in which the decoupler
floats is not part of a linear model: with a decoupler this is the mount for small amplitudes, without one the mount for
amplitudes that close the gap.
"""

from dataclasses import dataclass

import numpy as np

from halfdof_ctrl.base.doors import is_choice, shown, wrong_object
from halfdof_ctrl.base.errors import ParameterError
from halfdof_ctrl.base.names import listed
from halfdof_ctrl.model.mechss import mechss
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.parts.links import Axes, Size, axis_name, checked, part_axes, sized


@dataclass(frozen=True, slots=True, kw_only=True)
class Decoupler:
    """A free plate beside the inertia track, which opens a second way for the oil.

    Examples
    --------
    >>> Decoupler(I=2e5, R=1e7).R
    10000000.0
    """

    I: float  #: inertance of the oil and the plate [kg/m^4]  # noqa: E741
    R: float  #: resistance of the gap [N s/m^5]


def hydraulic_mount(
    *,
    k_r: Size,
    c_r: Size,
    A: float,
    I: float,  # noqa: E741  # the letter of the source
    R: float,
    C1: float,
    C2: float,
    decoupler: Decoupler | None = None,
    axes: Axes = None,
    fluid_axis: str | None = None,
) -> SecondOrderModel:
    """Model an engine mount with an inertia track between two chambers of oil.

    ::

                 top
          +-------+--------+
          |       | A      |        k_r, c_r   rubber
         k_r     (p1) C1   |        (2) = p1   upper chamber
         c_r   +--+--+     |        (1)        oil in the track: mass I A^2, damper R A^2
          |   (1)   (4)    |        (4)        oil in the decoupler, if there is one
          |    +--+--+     |        (3) = p2   lower chamber
          |      (p2) C2   |
          +-------+--------+
               bottom

    Parameters
    ----------
    k_r, c_r : float or mapping from axis to float
        Stiffness [N/m] and damping [N s/m] of the rubber.
    A : float
        Area by which the top displaces oil [m^2].
    I, R : float
        Inertance [kg/m^4] and resistance [N s/m^5] of the inertia track. With ``I = 0`` the track is an orifice, and
        its DOF a half DOF.
    C1, C2 : float
        Compliances of the upper and the lower chamber [m^5/N].
    decoupler : Decoupler, optional
        A second way for the oil; none by default.
    axes : str or sequence of str, optional
        Axes of the rubber; by default those of `k_r` and `c_r`, or one axis without a name.
    fluid_axis : str, optional
        The axis along which the top displaces oil: with several axes ``"z"`` by default, with one that one.

    Returns
    -------
    SecondOrderModel
        DOFs ``top``, ``bottom``, ``1`` (oil through the track over A) [m], ``2`` and ``3`` (pressures of the upper
        and the lower chamber) [Pa], and ``4`` (oil past the decoupler over A) [m]. A pressure is a static DOF whose
        force ``F_2`` is a volume [m^3]. K is symmetric but indefinite, since pressures are no displacements.

    Raises
    ------
    ParameterError
        A constant out of range, or axes that do not fit.

    Notes
    -----
    Source: Singh, Kim and Ravindra 1992, see the head of this module. It has no default values: none are printed in a
    source at hand. The oil's mass moves with its volume alone, it adds no weight to top or bottom.

    Examples
    --------
    At rest the two chambers are springs in series beside the rubber, 1000 + 4 / (0.001 + 0.003):

    >>> mount = hydraulic_mount(k_r=1e3, c_r=0, A=2, I=1, R=1, C1=0.001, C2=0.003)
    >>> round(float(1 / mount.prescribe_motion("bottom").select("F_top", "top")(0).real), 9)
    2000.0
    """
    found = part_axes(axes, k_r=k_r, c_r=c_r)
    along = _fluid_axis(found, fluid_axis)
    rubber = {"K": sized(k_r, found, "k_r", "N/m"), "C": sized(c_r, found, "c_r", "N s/m")}
    area = checked(A, "A", "m^2", positive=True)
    ways = [_way(I, R, "I", "R")]
    if decoupler is not None:
        if not isinstance(decoupler, Decoupler):
            raise wrong_object("decoupler", "a Decoupler, or None", decoupler, parameter="decoupler")
        ways.append(_way(decoupler.I, decoupler.R, "decoupler.I", "decoupler.R"))
    chambers = [checked(C1, "C1", "m^5/N", positive=True), checked(C2, "C2", "m^5/N", positive=True)]
    nodes = [axis_name(node, axis) for node in ("top", "bottom") for axis in found]
    places = {name: i for i, name in enumerate((*nodes, "1", "2", "3", *(["4"] if decoupler else [])))}
    M, C, K = (np.zeros((len(places), len(places))) for _ in range(3))
    for letter, matrix in (("K", K), ("C", C)):
        for axis in found:
            ends = [places[axis_name("top", axis)], places[axis_name("bottom", axis)]]
            matrix[np.ix_(ends, ends)] += rubber[letter][axis] * np.array([[1.0, -1.0], [-1.0, 1.0]])
    top, bottom = places[axis_name("top", along)], places[axis_name("bottom", along)]
    upper, lower = places["2"], places["3"]
    K[upper, upper], K[lower, lower] = -chambers[0], -chambers[1]
    _couple(K, upper, {top: -area, bottom: area})
    for place, (inertance, resistance) in zip((places["1"], places.get("4", -1)), ways, strict=False):
        M[place, place], C[place, place] = inertance * area**2, resistance * area**2
        _couple(K, upper, {place: -area})
        _couple(K, lower, {place: area})
    return mechss(M, C, K, dofs=tuple(places), name="hydraulic_mount")


def _couple(K: np.ndarray[tuple[int, ...], np.dtype[np.float64]], pressure: int, areas: dict[int, float]) -> None:
    """Let a pressure act on areas, and their motions on the chamber's volume."""
    for place, area in areas.items():
        K[pressure, place] += area
        K[place, pressure] += area


def _way(inertance: float, resistance: float, first: str, second: str) -> tuple[float, float]:
    found = checked(inertance, first, "kg/m^4"), checked(resistance, second, "N s/m^5")
    if not any(found):
        msg = f"{first} and {second} are both 0: nothing holds the oil between the chambers. Give one of them a size."
        raise ParameterError(msg, parameter=first, value=inertance)
    return found


def _fluid_axis(axes: tuple[str, ...], wanted: str | None) -> str:
    if wanted is None and len(axes) == 1:
        return axes[0]
    axis = "z" if wanted is None else wanted
    if not is_choice(axis, axes):
        msg = f"fluid_axis = {shown(wanted)}, but the rubber has the axes {listed(axes)}. Name one of them."
        raise ParameterError(msg, parameter="fluid_axis", value=wanted)
    return axis
