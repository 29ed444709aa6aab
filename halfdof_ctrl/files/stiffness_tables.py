"""Tables of a dynamic stiffness as test rigs write them: columns with names and units, any of some separators.

    f [Hz]; K' [N/mm]; K'' [N/mm]            storage and loss, also called real and imag
    frequency [Hz], modulus [N/m], loss angle [deg]
    omega [rad/s], storage [MPa], loss factor [-]

A column without a unit is refused: N/mm taken for N/m would be wrong by a thousand, and nothing would show it.
"""

import re
from collections.abc import Sequence

import control
import numpy as np

from halfdof_ctrl.base.arrays import ComplexArray, FloatArray
from halfdof_ctrl.base.errors import FileFormatError
from halfdof_ctrl.base.names import listed
from halfdof_ctrl.files.containers import PathLike

UNITS = {
    "N/m": 1.0, "kN/m": 1e3, "N/mm": 1e3, "MN/m": 1e6, "kN/mm": 1e6,
    "Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "N/mm^2": 1e6, "GPa": 1e9,
}  #: over N/m or Pa  # fmt: skip
FREQUENCY_UNITS = {"Hz": 2.0 * np.pi, "kHz": 2e3 * np.pi, "rad/s": 1.0}  #: over rad/s
ANGLES = {"deg": np.pi / 180.0, "°": np.pi / 180.0, "rad": 1.0}  #: over rad
RATIOS = {"-": 1.0, "1": 1.0, "%": 0.01}
ROLES = {
    "frequency": ({"f", "frequency", "freq", "omega"}, FREQUENCY_UNITS),
    "storage": ({"k'", "storage", "storage stiffness", "storage modulus", "real", "e'", "g'"}, UNITS),
    "loss": ({"k''", "loss", "loss stiffness", "loss modulus", "imag", "e''", "g''"}, UNITS),
    "modulus": ({"|k|", "|k*|", "modulus", "magnitude", "dynamic stiffness", "stiffness"}, UNITS),
    "angle": ({"loss angle", "phase", "delta", "phase angle"}, ANGLES),
    "ratio": ({"loss factor", "tan delta", "eta", "tan d"}, RATIOS),
}  #: names in small letters, and the units that a column of that kind has
WAYS = (("storage", "loss"), ("modulus", "angle"), ("modulus", "ratio"), ("storage", "ratio"))
STIFFNESS_TABLES_COLUMN = re.compile(r"^(.*?)\s*(?:\[(.*)\]|\((.*)\))?$")
LONGEST_TITLE = 200  #: characters
STIFFNESS, DISPLACEMENT = "stiffness", "displacement"


def is_stiffness_table(header: Sequence[str]) -> bool:
    """Tell whether columns are called like those of a measured stiffness."""
    found = {_role(name)[0] for name in header}
    return "frequency" in found and any(set(way) <= found for way in WAYS)


def frequency_column(header: Sequence[str]) -> int:
    """Return which column has the frequencies.

    >>> frequency_column(["K' [N/m]", "K'' [N/m]", "f [Hz]"])
    2
    """
    return [_role(name)[0] for name in header].index("frequency")


def stiffness_response(header: Sequence[str], values: FloatArray, path: PathLike) -> control.FrequencyResponseData:
    """Read a measured stiffness.

    Parameters
    ----------
    header : sequence of str
        Names of the columns with their units.
    values : (columns, rows) ndarray
    path : path-like
        For messages.

    Returns
    -------
    control.FrequencyResponseData
        Output ``stiffness`` [N/m] or [Pa], input ``displacement``.

    Raises
    ------
    FileFormatError
        A column without a unit, or with one that is unknown or of another kind.
    """
    columns: dict[str, FloatArray] = {}
    pascal: set[bool] = set()
    for name, column in zip(header, values, strict=True):
        role, unit = _role(name)
        if role is None:
            continue
        known = ROLES[role][1]
        if unit not in known:
            what = "has no unit" if unit is None else f"has the unit {unit!r}"
            msg = f"{path}: the column {name!r} {what}; it must be one of {listed(list(known), most=12)}, in brackets."
            raise FileFormatError(msg, path=str(path), line=1)
        columns[role] = column * known[unit]
        if known is UNITS:
            pascal.add(unit.endswith("Pa") or unit == "N/mm^2")
    if len(pascal) > 1:
        msg = f"{path}: one column is a stiffness [N/m] and another a modulus [Pa]. Give both in the same kind."
        raise FileFormatError(msg, path=str(path), line=1)
    order = np.argsort(columns["frequency"], kind="stable")
    return control.FrequencyResponseData(
        _complex(columns)[order][None, None, :],
        columns["frequency"][order],
        0,
        inputs=[DISPLACEMENT],
        outputs=[STIFFNESS],
        plot_type="bode",
    )


def _complex(columns: dict[str, FloatArray]) -> ComplexArray:
    if "storage" in columns and "loss" in columns:
        return np.asarray(columns["storage"] + 1j * columns["loss"])
    if "modulus" in columns and "angle" in columns:
        return np.asarray(columns["modulus"] * np.exp(1j * columns["angle"]))
    if "storage" in columns:
        return np.asarray(columns["storage"] * (1.0 + 1j * columns["ratio"]))
    return np.asarray(columns["modulus"] * np.exp(1j * np.arctan(columns["ratio"])))


def _role(name: str) -> tuple[str | None, str | None]:
    """Tell what a column is, and its unit."""
    match = STIFFNESS_TABLES_COLUMN.match(name.strip()) if len(name) <= LONGEST_TITLE else None
    words = "" if match is None else match.group(1).strip().lower()
    unit = None if match is None else match.group(2) or match.group(3)
    role = next((role for role, (names, _) in ROLES.items() if words in names), None)
    return role, None if unit is None else unit.strip()
