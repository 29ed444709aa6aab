"""What counts as hidden: the same modes in any units, those that are hidden exactly and no others."""

import numpy as np
import pytest

from halfdof_ctrl.base.arrays import FloatArray
from halfdof_ctrl.design.reach import hidden_mode
from support.beams import beam_matrices

UNITS = 30  # powers of two


def free_vibration(M: FloatArray, K: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Give A of M q'' + K q = 0 and its natural frequencies, slowest first."""
    stiffness = np.linalg.solve(M, K)
    zero, one = np.zeros_like(M), np.eye(len(M))
    return np.block([[zero, one], [-stiffness, zero]]), np.sort(np.sqrt(np.linalg.eigvals(stiffness).real))


def in_units(A: FloatArray, generator: np.random.Generator) -> tuple[FloatArray, FloatArray, float]:
    """Measure each DOF and time in a unit of its own; return A, units of the states, and the factor of time."""
    n, time = len(A) // 2, 2.0 ** int(generator.integers(-10, 11))
    units = np.exp2(np.tile(generator.integers(-UNITS, UNITS + 1, n), 2).astype(np.float64))
    units[n:] *= time
    return np.asarray(A * units / units[:, None] / time), np.asarray(units, dtype=np.float64), time


@pytest.mark.parametrize("seed", range(25))
def test_modes_of_a_beam_are_seen_in_any_units(seed: int) -> None:
    """Every mode of six elements shows in each displacement, whatever the units of DOFs, time and cost are."""
    A, frequencies = free_vibration(*beam_matrices(6))
    generator = np.random.default_rng(seed)
    A, _, time = in_units(A, generator)
    for frequency in frequencies[:6].tolist():
        Q = np.zeros_like(A)
        place = int(generator.integers(len(A) // 4)) * 2
        Q[place, place] = 2.0 ** int(generator.integers(-2 * UNITS, 2 * UNITS))
        assert hidden_mode(A, Q, 1j * frequency / time, np.abs(A)) is None


@pytest.mark.parametrize("seed", range(25))
def test_mode_that_is_hidden_exactly_is_told_in_any_units(seed: int) -> None:
    """Equal masses on either side of a third that is weighted swing against each other unseen."""
    K = np.array([[3.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 3.0]])
    A, _ = free_vibration(np.diag([0.7, 1.1, 0.7]), K)
    generator = np.random.default_rng(seed)
    A, units, time = in_units(A, generator)
    Q = np.zeros_like(A)
    Q[1, 1] = 2.0 ** int(generator.integers(-2 * UNITS, 2 * UNITS))
    found = hidden_mode(A, Q, 1j * np.sqrt(3.0 / 0.7) / time, np.abs(A))
    assert found is not None
    mode = units * found[0]
    assert abs(mode[1]) < 1e-12 * abs(mode[0])
    assert abs(mode[0] + mode[2]) < 1e-12 * abs(mode[0])
