"""Dynamic stiffness and transmissibility, evaluated from the descriptor form without the reduction.

With g the DOFs that move as prescribed and f all others, equation (1) gives for the forces r on g

    r = (P_gg - P_gf P_ff^-1 P_fg) q_g,    q_f = -P_ff^-1 P_fg q_g

The first factor is the dynamic stiffness, rows of the second the transmissibility of motion. With a force on f and
g at rest r is minus the force that arrives at g: the transmissibility of force. Several DOFs in g move together.
"""

import functools
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Literal, TypeAlias, get_args

import control
import numpy as np
import numpy.typing as npt

from halfdof_ctrl.base.arrays import ComplexArray, FloatArray
from halfdof_ctrl.base.doors import is_choice, shown
from halfdof_ctrl.base.errors import ParameterError
from halfdof_ctrl.base.names import Names, as_tuple, control_label, force_names, listed, reaction_names
from halfdof_ctrl.base.sparse_arrays import locked
from halfdof_ctrl.descriptor.data_limit import warn_of_values
from halfdof_ctrl.descriptor.regularity import require_regular
from halfdof_ctrl.descriptor.structure import pencil_structure
from halfdof_ctrl.model.doors import checked_model
from halfdof_ctrl.model.evaluation import checked_points, quadratic_transfer
from halfdof_ctrl.model.mechss import mechss
from halfdof_ctrl.model.motion import places_of_dofs, with_motion_as_input
from halfdof_ctrl.model.quadratics import Coefficients
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.systems.default_grid import MARGIN, default_frequencies
from halfdof_ctrl.systems.frequency import DEFAULT_POINTS, checked_frequencies
from halfdof_ctrl.systems.pencil_poles import pencil_poles
from halfdof_ctrl.systems.phase_sources import source_of, with_source
from halfdof_ctrl.systems.seen_modes import Response, seen_poles

TransmissibilityKind: TypeAlias = Literal["motion", "force"]

LINEAR_MARGIN = 4.0  #: evenly spread frequencies reach this factor above the modes
TRANSMISSIBILITY_KINDS: tuple[TransmissibilityKind, ...] = get_args(TransmissibilityKind)


def dynamic_stiffness(model: SecondOrderModel, dof: Names, s: npt.ArrayLike) -> ComplexArray:
    """Compute the force on a DOF per displacement of it, all other DOFs free.

    Parameters
    ----------
    model : SecondOrderModel
        Its own inputs are zero: forces absent, motions that are prescribed already held at rest.
    dof : str or sequence of str
        DOF that is moved. Several move together, and their forces add up.
    s : complex or 1D array_like of complex
        Points in the complex plane [rad/s]; ``2j * pi * f`` for the frequency f [Hz].

    Returns
    -------
    complex ndarray
        [N/m], of the shape of `s`. Its modulus is what a test rig calls dynamic stiffness, its angle the loss
        angle. ``inf + nan j`` at a resonance of the other DOFs without damping.

    Raises
    ------
    SignalNameError
        A DOF that is unknown, named twice or prescribed already.
    SingularPencilError
        With the DOF held, others can move in any way without a force.

    Notes
    -----
    This is the reciprocal of the receptance ``q/F`` of the same DOF. The mass that moves with the DOF counts: to
    have the stiffness of a mount alone, leave the mass on it out of the model.

    Examples
    --------
    A spring of 3 N/m beside a damper of 4 N s/m, at 1 rad/s:

    >>> complex(dynamic_stiffness(mechss([[0]], [[4]], [[3]]), "q0", 1j))
    (3+4j)
    """
    return _shaped(_driven_response(model, dof, s).sum(axis=(0, 1)), s)


def transmissibility(
    model: SecondOrderModel, from_: Names, to: Names, s: npt.ArrayLike, *, kind: TransmissibilityKind = "motion"
) -> ComplexArray:
    """Compute what arrives at one DOF of a motion or force at another.

    Parameters
    ----------
    model : SecondOrderModel
        Its own inputs are zero, as in `dynamic_stiffness`.
    from_ : str or sequence of str
        DOF whose motion is prescribed; several move together. For `kind` "force" the DOF that the force acts on.
    to : str or sequence of str
        DOF whose motion is asked for. For `kind` "force" the DOF that is held at rest and takes the force; the
        forces at several add up.
    s : complex or 1D array_like of complex
        Points in the complex plane [rad/s].
    kind : {"motion", "force"}
        Motion per motion (displacements, velocities and accelerations have the same ratio), or force on the support
        per force.

    Returns
    -------
    complex ndarray
        [-], of the shape of `s`. ``inf + nan j`` at a resonance without damping.

    Raises
    ------
    SignalNameError
        A DOF that is unknown, named twice or prescribed already.
    ParameterError
        `kind` is neither of the two, or several DOFs where there can be but one.
    SingularPencilError
        With the DOFs held, others can move in any way without a force.

    Notes
    -----
    By reciprocity the two are the same for symmetric M, C, K: the motion of a that a motion of b makes, and the
    force that arrives at b of a force on a.

    Examples
    --------
    A mass of 2 kg on a foot by a spring of 8 N/m, at s = 1: ``8 / (2 + 8)``, both ways.

    >>> model = mechss([[2, 0], [0, 0]], None, [[8, -8], [-8, 8]], dofs=["mass", "foot"])
    >>> complex(transmissibility(model, "foot", "mass", 1.0))
    (0.8+0j)
    >>> complex(transmissibility(model, "mass", "foot", 1.0, kind="force"))
    (0.8+0j)
    """
    _require_transmissibility(kind)
    if kind == "motion":
        _require_single(to, "to", kind)
        return _shaped(_driven_response(model, from_, s, shown=to)[0].sum(axis=0), s)
    _require_single(from_, "from_", kind)
    return _shaped(0.0 - _driven_response(model, to, s, forced=from_)[:, 0].sum(axis=0), s)


def dynamic_stiffness_response(
    model: SecondOrderModel, dof: Names, omega: npt.ArrayLike | None = None
) -> control.FrequencyResponseData:
    """Compute `dynamic_stiffness` over frequency.

    Parameters
    ----------
    model, dof
        As in `dynamic_stiffness`.
    omega : (k,) array_like, optional
        Frequencies [rad/s], the very points; by default those of `motion_frequencies`.

    Returns
    -------
    control.FrequencyResponseData
        From the displacement ``<dof>`` to the reaction ``R_<dof>``; names of several are joined by ``+``.

    Raises
    ------
    SignalNameError, SingularPencilError
        As in `dynamic_stiffness`.
    ParameterError
        Frequencies that are no finite, nonnegative numbers.

    Warns
    -----
    DataLimitWarning
        Of a single DOF: entries do not determine it to 1e-6 of its value.
    """
    frequencies = checked_frequencies(motion_frequencies([model], dof, free=True) if omega is None else omega)
    values = dynamic_stiffness(model, dof, 1j * frequencies)
    names = as_tuple(dof)
    data = _data(values, frequencies, names, reaction_names(names), model)
    return _with_source(data, _stiffness_model(model, names))


def transmissibility_response(
    model: SecondOrderModel,
    from_: Names,
    to: Names,
    omega: npt.ArrayLike | None = None,
    *,
    kind: TransmissibilityKind = "motion",
) -> control.FrequencyResponseData:
    """Compute `transmissibility` over frequency.

    Parameters
    ----------
    model, from_, to, kind
        As in `transmissibility`.
    omega : (k,) array_like, optional
        Frequencies [rad/s], the very points; by default those of `motion_frequencies`.

    Returns
    -------
    control.FrequencyResponseData
        From one displacement to the other, or from the force ``F_<from>`` to the force ``R_<to>`` on the support.

    Raises
    ------
    SignalNameError, SingularPencilError
        As in `transmissibility`.
    ParameterError
        As in `transmissibility`, or frequencies that are no finite, nonnegative numbers.

    Warns
    -----
    DataLimitWarning
        As `dynamic_stiffness_response` does.
    """
    _require_transmissibility(kind)
    held, other = (from_, to) if kind == "motion" else (to, from_)
    grid = motion_frequencies([model], held, other=other) if omega is None else omega
    frequencies = checked_frequencies(grid)
    values = transmissibility(model, from_, to, 1j * frequencies, kind=kind)
    causes, results = as_tuple(from_), as_tuple(to)
    if kind == "force":
        causes, results = force_names(causes), reaction_names(results)
    data = _data(values, frequencies, causes, results, model)
    return _with_source(data, _transmissibility_model(model, as_tuple(from_), as_tuple(to), kind))


def _with_source(data: control.FrequencyResponseData, moved: SecondOrderModel | None) -> control.FrequencyResponseData:
    """Say of a response whose transfer function it is, and warn where entries do not determine it."""
    if moved is not None:
        warn_of_values(moved, np.asarray(data.frequency), np.asarray(data.complex).reshape(1, 1, -1))
    return with_source(data, None if moved is None else source_of(moved))


def _stiffness_model(model: SecondOrderModel, names: tuple[str, ...]) -> SecondOrderModel | None:
    """Return the model whose transfer function the dynamic stiffness at a single DOF is."""
    rest = _at_rest(model)
    return None if len(names) > 1 or len(rest.dofs) == 1 else replace(rest, prescribed=()).prescribe_motion(names)


def _transmissibility_model(
    model: SecondOrderModel, from_: tuple[str, ...], to: tuple[str, ...], kind: TransmissibilityKind
) -> SecondOrderModel | None:
    """Return the model whose transfer function the transmissibility between two DOFs is."""
    rest = replace(_at_rest(model), prescribed=())
    if len(from_) > 1 or len(to) > 1 or len(rest.dofs) == 1 or from_ == to:
        return None
    if kind == "motion":
        return rest.prescribe_motion(from_, outputs=list(to))
    moved = rest.prescribe_motion(to, inputs=list(force_names(from_)), outputs=list(reaction_names(to)))
    signs: dict[str, Any] = {letter: locked(-getattr(moved, letter)) for letter in ("F", "G", "H", "D", "Dv", "Da")}
    return replace(moved, **signs)  # what arrives at the support is minus its reaction


def motion_frequencies(
    models: Sequence[SecondOrderModel],
    held: Names,
    *,
    other: Names = None,
    free: bool = False,
    linear: bool = False,
) -> FloatArray:
    """Choose frequencies [rad/s] for the response of some models to the motion of a DOF.

    Parameters
    ----------
    models : sequence of SecondOrderModel
    held : str or sequence of str
        DOFs whose motion is prescribed.
    other : str, optional
        DOF at the other end of a transmissibility; by default the motions of all others are looked at.
    free : bool
        For the dynamic stiffness: show also the modes with these DOFs free, at which it is small.
    linear : bool
        Spread the points evenly from 0, instead of evenly in the logarithm.

    Returns
    -------
    (k,) ndarray
        From a tenth of the slowest to ten times the fastest mode that is seen, `linear` from 0 to four times the
        fastest, and around each lightly damped mode the frequencies that its peak needs.
    """
    poles = [np.zeros(0, dtype=np.complex128)]
    for model in models:
        left = _driven(model, held)[1]
        if left is not None:
            shown = left.dofs if other is None else other
            poles.append(_seen(left, functools.partial(_moved_response, model, held, None if free else shown)))
        rest = _at_rest(model) if free else None
        if rest is not None and pencil_structure(rest).is_regular:
            push = _units(rest, held).sum(axis=1, keepdims=True)
            poles.append(_seen(rest, functools.partial(_receptance, rest, push)))
    frequencies = default_frequencies(np.concatenate(poles))
    return evenly_from_zero(frequencies) if linear else frequencies


def evenly_from_zero(frequencies: FloatArray) -> FloatArray:
    """Spread a default grid evenly from 0, up to four times the fastest mode, and keep what it has at peaks."""
    top = frequencies[-1] * LINEAR_MARGIN / MARGIN
    return np.unique(np.concatenate([np.linspace(0.0, top, DEFAULT_POINTS), frequencies[frequencies < top]]))


def _seen(model: SecondOrderModel, response: Response) -> ComplexArray:
    """Return the poles of a model, away from the origin, that a response shows."""
    return seen_poles(pencil_poles(model), response, np.zeros((1, 1)), real=not model.is_complex).moving


def _moved_response(model: SecondOrderModel, held: Names, shown: Names, points: ComplexArray) -> ComplexArray:
    """Return motions per motion of some DOFs, (p, 1, k), or with nothing to be shown their dynamic stiffness."""
    values = _driven_response(model, held, points, shown=shown)
    if shown is None:
        return np.asarray(values.sum(axis=(0, 1), keepdims=True))
    return np.asarray(values[: len(as_tuple(shown))].sum(axis=1, keepdims=True))


def _receptance(model: SecondOrderModel, push: FloatArray, points: ComplexArray) -> ComplexArray:
    """Return the motion of some DOFs per force on them, (1, 1, k)."""
    none = np.zeros_like(push)
    B, F, D = (push, none, none), (push.T, none.T, none.T), (np.zeros((1, 1)),) * 3
    return quadratic_transfer(model.quadratics.P, B, F, D, points)


def _driven_response(
    model: SecondOrderModel, moved: Names, s: npt.ArrayLike, *, forced: Names = None, shown: Names = None
) -> ComplexArray:
    """Return motions that are shown, and reactions, per force and per motion that is prescribed."""
    coefficients, left = _driven(model, moved, forced, shown)
    if left is not None:
        require_regular(left)
    return quadratic_transfer(*coefficients, checked_points(s).reshape(-1))


def _driven(
    model: SecondOrderModel, moved: Names, forced: Names = None, shown: Names = None
) -> tuple[tuple[Coefficients, Coefficients, Coefficients, Coefficients], SecondOrderModel | None]:
    """Return the coefficients of equation (1) with a motion prescribed, and the model of the DOFs left, if any."""
    base = _at_rest(model)
    places = places_of_dofs(base, moved)
    force, motion = _units(base, forced), _units(base, shown).T
    no_force, no_motion, no_feed = np.zeros_like(force), np.zeros_like(motion), np.zeros((len(motion), force.shape[1]))
    coefficients = with_motion_as_input(
        base.quadratics.P, (force, no_force, no_force), (motion, no_motion, no_motion), (no_feed,) * 3, places, 0
    )
    K, C, M = coefficients[0]
    dofs = tuple([name for place, name in enumerate(base.dofs) if place not in places])
    return coefficients, mechss(M, C, K, dofs=dofs) if dofs else None


def _require_transmissibility(kind: object) -> None:
    if not is_choice(kind, TRANSMISSIBILITY_KINDS):
        msg = f"kind must be {' or '.join(TRANSMISSIBILITY_KINDS)}, not {shown(kind)}."
        raise ParameterError(msg, parameter="kind", value=kind)


def _at_rest(model: SecondOrderModel) -> SecondOrderModel:
    """Take DOFs out whose motion is prescribed already, which holds them at rest."""
    checked_model(model, "dynamic_stiffness and transmissibility")
    free = [place for place, name in enumerate(model.dofs) if name not in model.prescribed]
    if not free or len(free) == len(model.dofs):
        return model
    M, C, K = (matrix[free][:, free] for matrix in (model.M, model.C, model.K))
    held = mechss(M, C, K, dofs=[model.dofs[place] for place in free])
    return replace(held, prescribed=model.prescribed, known_to=model.known_to)


def _units(model: SecondOrderModel, names: Names) -> FloatArray:
    """Return a column for each of the DOFs with 1 in its place."""
    places = [] if names is None else places_of_dofs(model, names)
    columns = np.zeros((len(model.dofs), len(places)))
    columns[places, range(len(places))] = 1.0
    return columns


def _require_single(names: Names, parameter: str, kind: TransmissibilityKind) -> None:
    if len(as_tuple(names)) > 1:
        msg = f"{parameter} must be a single DOF for the transmissibility of {kind}, not {listed(as_tuple(names))}."
        raise ParameterError(msg, parameter=parameter, value=names)


def _shaped(values: ComplexArray, s: npt.ArrayLike) -> ComplexArray:
    """Return values at points the shape of the points."""
    return values.reshape(np.shape(s))


def _data(
    values: ComplexArray,
    frequencies: FloatArray,
    causes: Sequence[str],
    results: Sequence[str],
    model: SecondOrderModel,
) -> control.FrequencyResponseData:
    """Make a response of one channel; names of several DOFs that move together are joined."""
    name = None if model.name is None else control_label(model.name)
    labels = {} if name is None else {"name": name, "sysname": name}
    return control.FrequencyResponseData(
        values.reshape(1, 1, -1),
        frequencies,
        0,
        inputs=[control_label("+".join(causes))],
        outputs=[control_label("+".join(results))],
        plot_type="bode",
        **labels,
    )
