"""Claims about the table of eigenvalues before and after."""

import control
import numpy as np
import pytest

from halfdof_ctrl import hydromount, mech2ss, mechss
from halfdof_ctrl.systems.eigenvalue_table import eigenvalue_table, eigenvalues_in_words

MOUNT = hydromount()


def test_the_mount_has_the_published_eigenvalues_and_loses_two_infinite_ones() -> None:
    """The paper's section 3: -0.6897 +- 17.7059j, -8.7797, -3.1742, two infinite before and none after."""
    table = eigenvalue_table(MOUNT, mech2ss(MOUNT))
    published = ("-0.6897 ± 17.7059j", "-8.7797", "-3.1742")
    assert tuple(row[:2] for row in table.rows) == (
        *zip(published, published, strict=True),
        *[("infinite", "none")] * 2,
    )
    assert all(float(difference) < 1e-12 for _, _, difference in table.rows[:3])
    assert (table.n_finite, table.n_infinite, table.order) == (4, 2, 4)
    assert "Before: 4 finite and 2 infinite eigenvalues. After: 4 finite and none infinite." in repr(table)


def test_the_difference_is_the_larger_one_of_a_pair() -> None:
    """A pole moved by 0.25 shows as that, and its partner does not hide it."""
    model = mechss([[1.0]], [[2.0]], [[10.0]])
    moved = control.ss([[-1.0, 3.0], [-3.0, -1.25]], [[0], [1]], [[1, 0]], 0)
    (row,) = eigenvalue_table(model, moved).rows
    assert row[0] == "-1.0000 ± 3.0000j"
    assert float(row[2]) == pytest.approx(0.13, abs=0.01)


def test_poles_too_many_or_too_few_are_missing_on_the_other_side() -> None:
    """A state space of another order is shown as it is."""
    model = mechss([[0.0]], [[1.0]], [[2.0]])
    more = control.ss(np.diag([-2.0, -7.0]), [[1], [1]], [[1, 1]], 0)
    assert ("missing", "-7.0000", "") in eigenvalue_table(model, more).rows
    none = control.ss([[-5.0]], [[1]], [[1]], 0)
    two = mechss([[1.0]], [[3.0]], [[2.0]])
    assert [row[1] for row in eigenvalue_table(two, none).rows].count("missing") == 1


def test_a_model_without_states_has_infinite_eigenvalues_only() -> None:
    """A spring alone."""
    spring = mechss([[0.0]], [[0.0]], [[4.0]])
    assert eigenvalue_table(spring, mech2ss(spring)).rows == (("infinite", "none", ""),) * 2


def test_pairs_are_one_entry_in_a_list() -> None:
    """Largest first."""
    assert eigenvalues_in_words([-1.0, -2 - 3j, -2 + 3j]) == ["-2.0000 ± 3.0000j", "-1.0000"]
