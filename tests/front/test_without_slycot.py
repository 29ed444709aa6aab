"""The core numbers are the same where slycot cannot be imported."""

import json
import os
import subprocess
import sys
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

SAME = 1e-13  # both processes run the same numpy and scipy; only python-control's dispatch may differ
RICCATI = 1e-9  # LQR gains come from slycot's or scipy's Riccati solver
SCRIPT = r"""
import json, sys, warnings
if "without" in sys.argv:
    sys.modules["slycot"] = None
warnings.simplefilter("error")
for kind in (DeprecationWarning, PendingDeprecationWarning, FutureWarning):  # in other packages' code, as in the suite
    warnings.simplefilter("ignore", kind)
warnings.filterwarnings("error", module="halfdof_ctrl|__main__")
import numpy as np
import control
import halfdof_ctrl as hd

def numbers(array):
    array = np.atleast_1d(np.asarray(array, dtype=complex))
    return [array.real.tolist(), array.imag.tolist()]

def sorted_numbers(values):
    return numbers(np.array(sorted(np.asarray(values), key=lambda z: (round(abs(z), 6), round(z.imag, 6)))))

model = hd.hydromount()
sys_ = hd.mech2ss(model)
static = hd.mech2ss(np.diag([1.0, 0.0]), [[0, 0], [0, 0]], [[3.0, -1.0], [-1.0, 2.0]])
omega = np.geomspace(0.1, 300.0, 25)
chain = 2 * np.eye(6) - np.eye(6, k=1) - np.eye(6, k=-1)
tied = np.ones((2, 2))
results = {
    "A": numbers(sys_.A), "B": numbers(sys_.B), "C": numbers(sys_.C), "D": numbers(sys_.D),
    "poles": sorted_numbers(sys_.poles()),
    "finite": sorted_numbers(hd.pencil_structure(model).finite_eigenvalues),
    "zeros": sorted_numbers(hd.zeros(model.select(inputs="F_y", outputs="y"))),
    "zeros wide": sorted_numbers(hd.zeros(model.select(inputs=["F_y"], outputs=["y_dot", "y_ddot"]))),
    "model": numbers(model(1j * omega)),
    "direct": numbers(sys_(1j * omega)),
    "fast": numbers(hd.frequency_response(model, omega).frdata),
    "descriptor": numbers(hd.descriptor_response(model, omega).frdata),
    "chain": numbers(hd.frequency_response(hd.mechss(np.eye(6), 0.1 * chain, chain), omega).frdata),
    "mixed": numbers(hd.mech2ss(tied, np.eye(2), 3 * np.eye(2))(1j * omega)),
    "static": numbers(static(1j * omega)),
    "step": numbers(control.step_response(sys_, np.linspace(0, 2, 50)).y),
    "crosscheck": [hd.crosscheck(model, sys_).passed, hd.crosscheck(model, sys_).order],
}
if hasattr(hd, "lqr"):
    regulator = hd.lqr(model, displacement={"y": 1e6}, effort={"F_y": 1e-4, "F_y1": 1.0, "F_y2": 1.0})
    results["K"] = numbers(regulator.K)
    results["closed loop"] = sorted_numbers(regulator.poles)
results["slycot"] = control.exception.slycot_check()
print(json.dumps(results))
"""


def computed(*, slycot: bool) -> dict[str, Any]:
    """Run the script in a process of its own."""
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    command = [sys.executable, "-c", SCRIPT, "with" if slycot else "without"]
    done = subprocess.run(command, capture_output=True, text=True, env=environment, check=False, timeout=120)
    assert done.returncode == 0, done.stderr
    return dict(json.loads(done.stdout))


@pytest.fixture(scope="module")
def without() -> dict[str, Any]:
    """Numbers of the process in which slycot is blocked."""
    return computed(slycot=False)


def test_slycot_is_really_blocked(without: dict[str, Any]) -> None:
    """python-control finds none."""
    assert without["slycot"] is False


def test_cross_check_passes_without_slycot(without: dict[str, Any]) -> None:
    """The verdict on the mount."""
    assert without["crosscheck"] == [True, 4]


def test_core_numbers_are_the_same_with_and_without(without: dict[str, Any]) -> None:
    """A, B, C, D, poles, zeros, transfer values, step response, LQR gain."""
    if os.environ.get("HALFDOF_WITHOUT_SLYCOT", "0") not in {"", "0"}:
        pytest.skip("the suite itself runs without slycot")
    pytest.importorskip("slycot")
    there = computed(slycot=True)
    assert there["slycot"] is True
    assert there.keys() == without.keys()
    for key in there.keys() - {"slycot", "crosscheck"}:
        here, other = (np.array(run[key][0]) + 1j * np.array(run[key][1]) for run in (without, there))
        tolerance = RICCATI if key in {"K", "closed loop"} else SAME
        assert_allclose(here, other, rtol=0.0, atol=tolerance * np.abs(other).max(initial=1e-300), err_msg=key)
