"""One law that rises, beside a linear rest: one root."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from halfdof_ctrl import Law, laws
from halfdof_ctrl.nonlinear.judgement import judged
from halfdof_ctrl.nonlinear.scalar_equation import root_of

DIGITS = 1e-13  #: relative, of a root where the law is not flat
LAWS = [
    laws.quadratic(1e4, 30),
    laws.power(3, 1.5),
    laws.power(3, 3),
    laws.cubic(1e6, 1),
    laws.bilinear(1, 300),
    laws.coulomb(5, 1e-3, 2),
    laws.table([-1, 0, 2], [-3, 0, 1], extend="linear"),
    Law(np.sinh, np.cosh),
    Law(lambda x: x + np.tanh(1e3 * x)),
]


@pytest.mark.parametrize("law", LAWS, ids=repr)
@given(w=st.floats(1e-6, 20.0), sign=st.sampled_from([-1.0, 1.0]), rest=st.sampled_from([0.0, 1e-3, 50.0]))
def test_the_root_is_what_the_force_was_made_of(law: Law, w: float, sign: float, rest: float) -> None:
    """``root(law(w) + rest w) = w``."""
    w *= sign
    assert_allclose(root_of(law, rest)(float(law.force(w)) + rest * w), w, rtol=DIGITS * 100, atol=1e-15)


def test_what_no_motion_answers_is_nan() -> None:
    """Beyond the bound of a law, outside its table, and where it gives NaN."""
    assert math.isnan(root_of(laws.coulomb(5, 0.1), 0.0)(6.0))
    assert math.isnan(root_of(laws.table([-1, 1], [-2, 2]), 0.0)(3.0))
    assert math.isnan(root_of(Law(lambda v: 5 * v / (abs(v) + 1)), 0.0)(6.0))
    assert root_of(laws.coulomb(5, 0.1), 0.0)(3.0) == pytest.approx(0.1 * 3.0 / 4.0)


@pytest.mark.parametrize(
    ("law", "rises", "answers_all"),
    [
        (Law(np.sinh), True, True),
        (Law(np.cbrt), True, True),
        (Law(np.tanh), True, False),
        (Law(lambda v: v**3 - v), False, False),
        (Law(lambda v: v * (abs(v) > 0.1)), True, False),
        (Law(lambda v: np.minimum(v, 0.5)), True, False),
        (Law(np.sinh, monotone=False), False, False),
        (laws.gap(3, 0.1), True, False),
        (laws.quadratic(3), True, True),
        (laws.quadratic(-3), False, False),
        (laws.table([0, 1, 2], [0, 1, 1]), True, False),
    ],
    ids=str,
)
def test_laws_are_judged_by_what_they_say_and_what_they_do(law: Law, rises: bool, answers_all: bool) -> None:  # noqa: FBT001
    """Claims are refuted by values."""
    found = judged(law)
    assert (found.rises, found.answers_all) == (rises, answers_all)
