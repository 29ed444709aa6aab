"""Built-in laws: forces, slopes, inverses, and laws as values."""

import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from halfdof_ctrl import laws
from halfdof_ctrl.errors import ParameterError
from halfdof_ctrl.model.law import DifferencedSlope, Law

X = np.concatenate([-np.geomspace(1e-6, 1e2, 40)[::-1], [0.0], np.geomspace(1e-6, 1e2, 40)])
ROUNDING = 1e-13  #: relative, of an inverse that loses no digits
DIFFERENCED = 1e-8  #: relative, of central differences with the cube root of eps as step
SMOOTH = [
    laws.quadratic(1e4, 30),
    laws.quadratic(1e4),
    laws.power(3, 1.5),
    laws.power(2, 0.5),
    laws.cubic(1e6, 200),
    laws.cubic(5),
    laws.coulomb(5, 0.01),
    laws.coulomb(5, 0.01, 3),
]
ALL = [
    *SMOOTH,
    laws.bilinear(1, 3),
    laws.gap(1e5, 0.01),
    laws.gap(1e5, 0.01, np.inf),
    laws.table([-1, 0, 1, 3], [-2, 0, 1, 4], extend="linear"),
]


@pytest.mark.parametrize("law", ALL, ids=repr)
def test_a_built_in_law_is_a_value(law: Law) -> None:
    """It survives pickling, equals its copy, and numbers and arrays get the same force."""
    copy = pickle.loads(pickle.dumps(law))  # noqa: S301  # made two words before
    assert (copy, hash(copy)) == (law, hash(law))
    assert_allclose([float(law.force(float(x))) for x in X], law.force(X), rtol=1e-15)


@pytest.mark.parametrize("law", SMOOTH, ids=repr)
def test_slopes_are_the_derivatives_of_the_forces(law: Law) -> None:
    """Against central differences with a relative step, away from where rounding of the force hides them."""
    away = X[np.abs(X) > 1e-4] if law.name != "coulomb" else X[np.abs(X) < 1e-1]
    away = away[away != 0.0]
    assert_allclose(law.slope(away), DifferencedSlope(law.force)(away), rtol=DIFFERENCED)


@pytest.mark.parametrize("law", [law for law in ALL if law.inverse is not None and law.name != "coulomb"], ids=repr)
def test_an_inverse_gives_back_what_it_was(law: Law) -> None:
    """``inverse(force(x)) = x`` over eight decades, by number and by array."""
    assert law.inverse is not None
    force = law.force(X)
    assert_allclose(law.inverse(force), X, rtol=ROUNDING, atol=0.0)
    assert_allclose([float(law.inverse(float(f))) for f in force], X, rtol=ROUNDING, atol=0.0)


def test_the_square_law_loses_no_digits_where_its_parts_cancel() -> None:
    """At r far below c1²/c2 the answer is r/c1 (1 - c2 r/c1²), and at c1 = 0 and r = 0 it is 0."""
    inverse = laws.quadratic(1e4, 30).inverse
    assert inverse is not None
    assert_allclose(inverse(1e-9), 1e-9 / 30 * (1 - 1e4 * 1e-9 / 900), rtol=1e-15)
    at_rest = laws.quadratic(1e4).inverse
    assert at_rest is not None
    assert at_rest(0.0) == 0.0
    assert at_rest(np.zeros(2)).tolist() == [0.0, 0.0]


@given(k3=st.floats(1e-6, 1e12), k1=st.floats(1e-6, 1e9), x=st.floats(1e-9, 1e3), sign=st.sampled_from([-1.0, 1.0]))
def test_the_cubic_is_inverted_at_any_size(k3: float, k1: float, x: float, sign: float) -> None:
    """Newton from above against the number that the force was made of."""
    law = laws.cubic(k3, k1)
    assert law.inverse is not None
    assert_allclose(float(law.inverse(law.force(sign * x))), sign * x, rtol=ROUNDING)


@pytest.mark.parametrize(
    ("law", "text"),
    [
        (laws.quadratic(1e4, 30), "quadratic(1e4, 30)"),
        (laws.quadratic(10000.0), "quadratic(1e4)"),
        (laws.gap(1e5, 0.01, np.inf), "gap(1e5, 0.01, inf)"),
        (laws.gap(1e5, 0.01), "gap(1e5, 0.01)"),
        (laws.power(0.5, 2), "power(0.5, 2)"),
        (laws.table([0, 1], [0, 2.5], extend="linear"), 'table([0, 1], [0, 2.5], extend="linear")'),
        (Law(np.tanh), "Law(tanh)"),
    ],
)
def test_laws_print_as_they_are_typed(law: Law, text: str) -> None:
    """Arguments that are the defaults are left out."""
    assert repr(law) == text


def test_laws_that_are_typed_differently_differ() -> None:
    """Equality is that of name and numbers; user laws by their functions."""
    assert laws.quadratic(1e4, 30) != laws.quadratic(1e4, 31)
    assert laws.quadratic(1, 2) != laws.cubic(1, 2)
    assert Law(np.sinh) == Law(np.sinh)
    assert Law(np.sinh) != Law(np.tanh)
    assert Law(np.sinh) != "Law(sinh)"


def test_a_gap_is_zero_between_its_stops() -> None:
    """``k (e - upper)`` above, ``k (e + lower)`` below, a missing lower stop as the upper one, inf for none."""
    e = np.array([-3.0, -1.5, 0.0, 0.5, 2.0])
    assert laws.gap(10, 1).force(e).tolist() == [-20.0, -5.0, 0.0, 0.0, 10.0]
    assert laws.gap(10, 1, 2).force(e).tolist() == [-10.0, 0.0, 0.0, 0.0, 10.0]
    assert laws.gap(10, 1, np.inf).force(e).tolist() == [0.0, 0.0, 0.0, 0.0, 10.0]
    assert laws.gap(10, 1).slope(e).tolist() == [10.0, 10.0, 0.0, 0.0, 10.0]


def test_a_table_goes_through_its_points_and_is_not_known_outside() -> None:
    """PCHIP of a straight line is the line; outside NaN, or the line with ``extend``."""
    inside = laws.table([-1, 0, 2], [-2, 0, 4])
    assert_allclose(inside.force(np.array([-1.0, -0.3, 1.2, 2.0])), [-2.0, -0.6, 2.4, 4.0], rtol=1e-15)
    assert np.isnan(inside.force(np.array([-1.1, 2.1]))).all()
    assert (inside.domain, inside.bounds) == ((-1.0, 2.0), (-2.0, 4.0))
    extended = laws.table([-1, 0, 2], [-2, 0, 4], extend="linear")
    assert_allclose(extended.force(np.array([-3.0, 5.0])), [-6.0, 10.0], rtol=1e-15)
    assert_allclose(extended.slope(np.array([-3.0, 1.0, 5.0])), 2.0, rtol=1e-15)
    assert extended.bounds == (-np.inf, np.inf)


@pytest.mark.parametrize(
    ("force", "slope"),
    [
        (np.sinh, 1.0),
        (lambda x: 3.0 * x, 3.0),
        (lambda x: x * abs(x), 0.0),
        (lambda x: np.sign(x) * np.sqrt(abs(x)), np.inf),
        (lambda x: 5.0 * np.tanh(x / 1e-4), 5e4),
        (lambda x: 2.0 + x, 1.0),
    ],
)
def test_a_missing_slope_is_found_at_rest_too(force: object, slope: float) -> None:
    """Where a relative step has nothing to be relative to: finite, zero and infinite slopes."""
    law = Law(force)  # type: ignore[arg-type]
    assert_allclose(law.slope(0.0), slope, rtol=1e-2 if slope == 5e4 else 1e-3, atol=0.0)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: laws.quadratic(np.nan), r"quadratic: c2 = nan, but it must be a finite real number"),
        (lambda: laws.quadratic(1, "a"), r"quadratic: c1 = 'a'"),  # type: ignore[arg-type]
        (lambda: laws.power(1, 0), r"exponent = 0, but it must be positive"),
        (lambda: laws.gap(-1, 0.1), r"a stop needs a stiffness that is not negative"),
        (lambda: laws.gap(1, 0.1, -0.2), r"that does not overlap"),
        (lambda: laws.gap(1, np.inf), r"turn the element round"),
        (lambda: laws.coulomb(1, 0), r"v0 = 0, but the rate over which friction turns round must be positive"),
        (lambda: laws.table([0, 1], [0, 1, 2]), r"two rows of the same 2 or more numbers"),
        (lambda: laws.table([0, 0], [0, 1]), r"x must rise from point to point"),
        (lambda: laws.table(["a", 1], [0, 1]), r"table: x must be real numbers"),  # type: ignore[arg-type]
        (lambda: laws.table([0, 1], [0, 1], extend="flat"), r"extend must be \"linear\""),  # type: ignore[arg-type]
        (lambda: Law(3), r"The force of a law must be a function"),  # type: ignore[arg-type]
        (lambda: Law(np.tanh, bounds=(1, -1)), r"The bounds of a law must be two numbers"),
        (lambda: Law(np.tanh, np.cosh, 3), r"The inverse of a law must be a function"),  # type: ignore[arg-type]
    ],
)
def test_numbers_that_make_no_law_are_refused(make: object, message: str) -> None:
    """By the name of the law and of the number."""
    with pytest.raises(ParameterError, match=message):
        make()  # type: ignore[operator]
