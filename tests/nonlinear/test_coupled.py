"""Several elements at once: the unique solution, whatever the slopes vanish."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from halfdof_ctrl import Damper, laws, mech2nlsys, mechss, nlmechss
from halfdof_ctrl.model.law import Law

BALANCE = 1e-11  #: of the largest force, left over at the massless DOFs

KINDS = [
    laws.quadratic(3.0),
    laws.quadratic(3.0, 0.5),
    laws.power(2.0, 3.0),
    laws.coulomb(2.0, 0.01, 1.0),
    laws.power(1.0, 0.6),
]


@given(
    which=st.lists(st.integers(0, len(KINDS) - 1), min_size=4, max_size=4),
    x=st.lists(st.floats(-1.0, 1.0), min_size=3, max_size=3),
    u=st.lists(st.floats(-10.0, 10.0), min_size=3, max_size=3),
)
def test_the_forces_balance_at_every_massless_dof(which: list[int], x: list[float], u: list[float]) -> None:
    """``K q + sum of e phi(e' v) = u`` for the rates v that come out, four dampers tying three half DOFs."""
    K = np.array([[4.0, -1.0, 0.0], [-1.0, 5.0, -2.0], [0.0, -2.0, 3.0]])
    e = np.array([[1.0, -1.0, 0.0], [0.0, 1.0, -1.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
    ends = [("q0", "q1"), ("q1", "q2"), ("q2", None), ("q0", None)]
    found: list[Law] = [KINDS[k] for k in which]
    model = nlmechss(mechss(None, None, K), [Damper(a, b, law) for (a, b), law in zip(ends, found, strict=True)])
    v = mech2nlsys(model).dynamics(0.0, x, u)
    pulls = np.array([float(law.force(float(rate))) for law, rate in zip(found, e @ v, strict=True)])
    left = K @ np.array(x) + e.T @ pulls - np.array(u)
    size = np.abs(K) @ np.abs(x) + np.abs(e.T) @ np.abs(pulls) + np.abs(u)
    assert_allclose(left, np.zeros(3), rtol=0.0, atol=BALANCE * max(1e-3, size.max()))


@pytest.mark.parametrize("turned", [False, True])
def test_elements_side_by_side_add_up(turned: bool) -> None:  # noqa: FBT001
    """Two square laws between the same DOFs are one, whichever way they point."""
    model = mechss(None, None, np.diag([1.0, 2.0]))
    ends = ("q1", "q0") if turned else ("q0", "q1")
    two = nlmechss(
        model, [Damper("q0", "q1", laws.quadratic(1)), Damper(*ends, laws.quadratic(2)), Damper("q1", law=1)]
    )
    one = nlmechss(model, [Damper("q0", "q1", laws.quadratic(3)), Damper("q1", law=1)])
    x, u = [0.3, -0.2], [5.0, 1.0]
    assert_allclose(mech2nlsys(two).dynamics(0.0, x, u), mech2nlsys(one).dynamics(0.0, x, u), rtol=1e-12)
