"""Tables of measured stiffness, in the columns and units that test rigs write."""

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

import halfdof_ctrl as hd
from halfdof_ctrl.base.errors import FileFormatError

EXACT = 1e-13  # a sine and a conversion of units


SOFT, STIFF = 3e5 + 4e4j, 3.1e5 + 6e4j
MODULI = abs(SOFT), abs(STIFF)
ANGLES = np.degrees(np.angle(SOFT)), np.degrees(np.angle(STIFF))
SPEEDS = 2 * np.pi, 20 * np.pi
ETA = 40 / 3, 60 / 3.1
TABLES = {
    "storage and loss": "f [Hz],K' [N/mm],K'' [N/mm]\n1,300,40\n10,310,60\n",
    "semicolons": "Frequency (Hz); Storage [kN/m]; Loss [N/m]\n10; 310; 60000\n1; 300; 40000\n",
    "loss factor": f"omega [rad/s]\tstorage [N/m]\teta [%]\n{SPEEDS[0]}\t3e5\t{ETA[0]}\n{SPEEDS[1]}\t3.1e5\t{ETA[1]}\n",
    "angle": f"f [Hz],modulus [N/m],loss angle [deg],T\n1,{MODULI[0]},{ANGLES[0]},20\n10,{MODULI[1]},{ANGLES[1]},20\n",
    "tangent": f"f [kHz],|K*| [N/m],tan delta [-]\n0.001,{MODULI[0]},{4 / 30}\n0.01,{MODULI[1]},{6 / 31}\n",
}


@pytest.mark.parametrize("text", TABLES.values(), ids=TABLES.keys())
def test_columns_and_units_are_read(tmp_path: Path, text: str) -> None:
    """Two points, 300 + 40j and 310 + 60j N/mm, in five notations."""
    path = tmp_path / "rig.csv"
    path.write_text(text, encoding="utf-8")
    data = hd.load_response(path)
    assert_allclose(data.omega / (2 * np.pi), [1, 10], rtol=EXACT)
    assert_allclose(data.frdata[0, 0], [3e5 + 4e4j, 3.1e5 + 6e4j], rtol=EXACT)
    assert data.output_labels == ["stiffness"]


@pytest.mark.parametrize(
    ("header", "words"),
    [
        ("f [Hz],K',K'' [N/m]", 'the column "K\'" has no unit'),
        ("f,K' [N/m],K'' [N/m]", "the column 'f' has no unit; it must be one of Hz, kHz, rad/s"),
        ("f [Hz],K' [lbf/in],K'' [N/m]", "has the unit 'lbf/in'"),
        ("f [Hz],K' [N/m],K'' [Pa]", "one column is a stiffness .* and another a modulus"),
        ("f [Hz],K' [N/m],temperature [C]", "name the columns of a measured stiffness with their units"),
    ],
)
def test_columns_without_units_are_refused(tmp_path: Path, header: str, words: str) -> None:
    """N/mm for N/m would be wrong by a thousand."""
    path = tmp_path / "rig.csv"
    path.write_text(f"{header}\n1,300,40\n", encoding="utf-8")
    with pytest.raises(FileFormatError, match=words) as refusal:
        hd.load_response(path)
    assert refusal.value.line == 1


def test_table_goes_to_the_fit(tmp_path: Path) -> None:
    """From the file to springs and dampers."""
    f = np.geomspace(1, 100, 9)
    s = 2j * np.pi * f
    K = 1e5 + 5e4 * s / (s + 60)
    rows = [f"{a!r},{b.real!r},{b.imag!r}" for a, b in zip(f.tolist(), K.tolist(), strict=True)]
    (tmp_path / "k.csv").write_text("\n".join(["f [Hz],K' [N/m],K'' [N/m]", *rows]), encoding="utf-8")
    data = hd.load_response(tmp_path / "k.csv")
    fit = hd.fit_prony(data.omega / (2 * np.pi), data.frdata[0, 0])
    assert_allclose(fit.k, [5e4], rtol=1e-9)
