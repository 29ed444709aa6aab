"""Laws eased below the tolerance of a simulation."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from halfdof_ctrl import Damper, laws, mechss, nlmechss
from halfdof_ctrl.model.law import Law
from halfdof_ctrl.nonlinear.easing import WIDTH, eased_answers
from halfdof_ctrl.nonlinear.reduction import reduce_nonlinear
from support.mounts_with_laws import oil_mount

TOLERANCE = 1e-9  #: of every state [m, m/s]


@pytest.mark.parametrize("law", [laws.quadratic(1e4, 30), laws.coulomb(5, 0.01, 2), laws.cubic(1e4, 3)], ids=repr)
def test_smooth_laws_stay_as_they_are(law: Law) -> None:
    """A slope at rest that the chord does not change needs no chord."""
    reduction = reduce_nonlinear(oil_mount(law))
    assert eased_answers(reduction, np.full(4, TOLERANCE)) is reduction.answers


@pytest.mark.parametrize("law", [laws.quadratic(1e4), laws.power(50, 3)], ids=repr)
def test_a_flat_law_is_its_chord_below_the_tolerance_alone(law: Law) -> None:
    """Linear inside, exact outside, and nowhere further off than the force that the tolerance leaves open."""
    reduction = reduce_nonlinear(oil_mount(law))
    eased = eased_answers(reduction, np.full(4, TOLERANCE))
    open_force = WIDTH * 1500.0 * TOLERANCE  # 500 (y - y2) - 500 y2
    for share in (-3.0, -1.1, -0.5, 0.0, 0.25, 0.5, 1.1, 20.0):
        w_0 = np.array([share * open_force * reduction.S[0, 0]])
        exact, found = (float(answers.solve(0.0, w_0)[0][0]) for answers in (reduction.answers, eased))
        if abs(share) > 1.0:
            assert_allclose(found, exact, rtol=1e-12)
        else:
            assert_allclose(found, share * float(law.inverse(open_force)), rtol=1e-9)  # type: ignore[misc]
            assert abs(law.force(found) - law.force(exact)) <= open_force


def test_a_root_law_on_a_state_is_eased_too() -> None:
    """``v' = -√|v|`` comes to rest in finite time as well: the force is a chord within the tolerance."""
    reduction = reduce_nonlinear(nlmechss(mechss([[1.0]], None, [[1.0]]), Damper("q0", law=laws.power(1, 0.5))))
    eased = eased_answers(reduction, np.full(2, TOLERANCE))
    reach = WIDTH * TOLERANCE
    assert_allclose(eased.solve(0.0, np.array([reach / 4]))[1], [-np.sqrt(reach) / 4], rtol=1e-12)
    assert_allclose(eased.solve(0.0, np.array([1.0]))[1], [-1.0], rtol=1e-15)
