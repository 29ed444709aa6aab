"""What slycot says of the count of finite eigenvalues and zeros."""

import numpy as np
import pytest

from halfdof_ctrl import hydromount, mechss
from halfdof_ctrl.systems.second_opinion import SECOND_OPINION_LARGEST, second_opinion


def test_slycot_counts_the_eigenvalues_and_zeros_of_the_mount() -> None:
    """Four finite eigenvalues, and the two zeros of y/F_y, the roots of 3 s^2 + 40 s + 100."""
    pytest.importorskip("slycot", exc_type=ImportError)
    told = second_opinion(hydromount().select("F_y", "y"))
    assert told == "4 finite eigenvalues, 2 zeros by ag08bd"


def test_large_pencils_are_not_asked_for() -> None:
    """They would take too long."""
    n = SECOND_OPINION_LARGEST + 1
    model = mechss(None, None, np.eye(n), np.eye(n)[:, :1], np.eye(n)[:1])
    assert second_opinion(model) == f"not asked above dimension {SECOND_OPINION_LARGEST}"
