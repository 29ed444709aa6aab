"""Units and labels of signals on axes."""

from collections.abc import Mapping
from typing import Any, TypeAlias

import control

from halfdof_ctrl.base.doors import require_mapping, wrong_object
from halfdof_ctrl.base.names import (
    MOST_CACHED,
    force_names,
    motion_names,
    name_from_label,
    physical_places,
    reaction_names,
    unknown_name_error,
)
from halfdof_ctrl.model.second_order import SecondOrderModel

Units: TypeAlias = Mapping[str, str] | None
FORCE_UNITS = {"m": "N", "mm": "N", "rad": "N m", "m^3": "Pa"}  #: of the force on a DOF, by the DOF's unit


def known_units(system: control.StateSpace | SecondOrderModel, units: Units) -> dict[str, str]:
    """Return the units of the signals that have one, by name.

    Parameters
    ----------
    system : control.StateSpace or SecondOrderModel
    units : mapping from name to unit, optional
        For a DOF the unit of its displacement, from which those of its derivatives and its force follow;
        for any other signal its own.

    Raises
    ------
    SignalNameError
        A unit for a signal that the system does not have.
    """
    given = _given_units(units)
    known: dict[str, str | None] = {}
    if isinstance(system, SecondOrderModel):
        names: set[str] = {*system.inputs, *system.outputs}
        dofs = tuple(dict.fromkeys((*system.dofs, *system.prescribed)))
        if len(dofs) > MOST_CACHED:
            dofs = _concerned({*names, *given}, dofs)
        for dof, *motions, force in zip(
            dofs, *(motion_names(dofs, k) for k in range(3)), force_names(dofs), strict=True
        ):
            unit = given.get(dof, "m")
            known |= dict(zip(motions, (unit, f"{unit}/s", f"{unit}/s^2"), strict=True))
            known[force] = FORCE_UNITS.get(unit)
            if dof in system.prescribed:
                known[reaction_names((dof,))[0]] = FORCE_UNITS.get(unit)
    else:
        names = {name for side in signal_names(system) for name in side}
    for name in given:
        if name not in names and name not in known:
            raise unknown_name_error(name, "signal", sorted(names | set(known)))
    return {name: unit for name, unit in (known | given).items() if unit}


def _concerned(names: set[str], dofs: tuple[str, ...]) -> tuple[str, ...]:
    """Return the DOFs that some of the names are forces on or motions of."""
    places = {place % len(dofs) for place in physical_places(names, dofs, "output").values()}
    return tuple([dofs[place] for place in sorted(places.union(physical_places(names, dofs, "input").values()))])


def signal_names(system: control.StateSpace | SecondOrderModel) -> tuple[list[str], list[str]]:
    """Return the names of the outputs and of the inputs, as the model has them."""
    if isinstance(system, SecondOrderModel):
        return list(system.outputs), list(system.inputs)
    outputs, inputs = (
        [name_from_label(label) for label in labels] for labels in (system.output_labels, system.input_labels)
    )
    return outputs, inputs


def signal_label(name: str, units: Mapping[str, str]) -> str:
    """Write a signal with its unit, as far as it is known.

    >>> signal_label("y_ddot", {"y_ddot": "m/s^2"})
    'y_ddot [m/s²]'
    """
    return plain(name) + (f" [{typeset(units[name])}]" if name in units else "")


def ratio_label(output: str, source: str, units: Mapping[str, str], *, dB: bool, newline: bool) -> str:
    """Write the magnitude of a transfer function with its unit.

    >>> ratio_label("y_dot", "F_y", {"y_dot": "m/s", "F_y": "N"}, dB=False, newline=False)
    '|y_dot/F_y| [(m/s)/N]'
    """
    unit = ratio_unit(output, source, units)
    if dB:
        unit = f"dB re 1 {unit}" if unit not in {"", "-"} else "dB"
    return f"|{plain(output)}/{plain(source)}|" + (("\n" if newline else " ") + f"[{unit}]" if unit else "")


def ratio_unit(output: str, source: str, units: Mapping[str, str]) -> str:
    """Write the unit of a ratio of two signals, as far as it is known.

    >>> ratio_unit("F_phi", "phi", {"F_phi": "N m", "phi": "rad"})
    '(N m)/rad'
    """
    if output not in units or source not in units:
        return ""
    over, under = units[output], units[source]
    over = f"({over})" if set(over) & set("/ ") else over
    under = f"({under})" if set(under) & set("/ ") else under
    return "-" if over == under else typeset(f"{over}/{under}")


def _given_units(units: Mapping[str, Any] | None) -> dict[str, str]:
    """Read the units that the user gives: texts by names."""
    if units is None:
        return {}
    require_mapping(units, "units", "from names of signals to their units")
    for name, unit in units.items():
        if not isinstance(unit, str):
            taker = f"The unit of {name}"
            raise wrong_object(taker, "text, such as 'm'", unit, parameter="units")
    return dict(units)


def plain(name: str) -> str:
    """Write a name so that matplotlib does not read it as mathematics."""
    return name.replace("$", r"\$")


def typeset(unit: str) -> str:
    """Write powers in a unit as superscripts.

    >>> typeset("m/s^2")
    'm/s²'
    """
    return unit.replace("^2", "²").replace("^3", "³")
