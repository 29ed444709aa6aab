"""Invariant zeros of any regular model against the greatest common divisor of minors in exact arithmetic.

The zeros of ``[P(s), -B(s); F(s), D(s)]`` of normal rank r are the roots of the greatest common divisor of its minors
of order r, its determinantal divisor (F. R. Gantmacher, The theory of matrices, 1959, chapter VI).
"""

from fractions import Fraction
from itertools import combinations
from typing import Any

import flint
import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from halfdof_ctrl import SecondOrderModel, mechss, zeros
from halfdof_ctrl.base.errors import CloseDecisionWarning, DataLimitWarning, recording_warnings
from support import exact
from support.anykinds import drawn_models
from support.structures import Structure

SMALL = 4  # DOFs: the number of minors grows fast
SCATTER = 1e-6  # of simple zeros, relative to the largest or one
SHARP = 1e-12  # of a zero whose bound is a few roundings
MOST = settings(max_examples=max(15, settings().max_examples // 4))


def system_matrix(model: SecondOrderModel) -> npt.NDArray[np.float64]:
    """Give the coefficients (3, n + p, n + m) of the system matrix."""
    return np.stack(
        [
            np.block([[model.K, -model.B], [model.F, model.D]]),
            np.block([[model.C, -model.Bv], [model.G, model.Dv]]),
            np.block([[model.M, -model.Ba], [model.H, model.Da]]),
        ]
    )


def determinantal_divisor(S: npt.NDArray[np.float64]) -> flint.fmpq_poly:
    """Give the greatest common divisor of the largest minors that do not all vanish."""
    rows, columns = S.shape[1:]
    for rank in range(min(rows, columns), 0, -1):
        divisor = flint.fmpq_poly([])
        for i in combinations(range(rows), rank):
            for j in combinations(range(columns), rank):
                minor = exact.polynomial_determinant(S[:, list(i)][:, :, list(j)])
                divisor = divisor.gcd(minor)
                if divisor.degree() == 0:
                    return divisor
        if divisor.degree() >= 0:
            return divisor
    return flint.fmpq_poly([1])


@MOST
@given(case=drawn_models(largest=SMALL))
def test_zeros_are_those_of_the_determinantal_divisor(case: tuple[Structure, SecondOrderModel]) -> None:
    """As many as its degree, of any index and any number of signals; each simple one where exact arithmetic has it."""
    _, model = case
    model = model.select(inputs=list(model.inputs[:2]), outputs=list(model.outputs[:2]))
    assume(exact.order(model.M, model.C, model.K) >= 0)
    divisor = determinantal_divisor(system_matrix(model))
    found = zeros(model)
    assert found.size == divisor.degree()
    numerator = flint.fmpz_poly([int(c) for c in divisor.numer().coeffs()])
    roots: Any = numerator.complex_roots() if divisor.degree() > 0 else []
    for root in [complex(root) for root, times in roots if times == 1]:
        assert np.abs(found - root).min() <= SCATTER * max(1.0, float(np.abs(found).max()))


@given(angle=st.floats(0.1, 1.4), stiffness=st.floats(2.0, 90.0))
def test_zeros_that_only_rounding_parted_are_given_and_told(angle: float, stiffness: float) -> None:
    """An oscillator that two outputs are blind to, in rotated coordinates: its eigenvalues are zeros of both."""
    across, along = float(np.sin(angle)), float(np.cos(angle))
    first, last = along**2 + stiffness * across**2, across**2 + stiffness * along**2
    between = along * across * (1.0 - stiffness)
    K = [[first, 0.0, between], [0.0, 3.0, 0.0], [between, 0.0, last]]
    with recording_warnings() as caught:
        found = zeros(mechss(np.eye(3), None, K, [1.0, 1.0, 0.0], [[along, 0.0, across], [0.0, 1.0, 0.0]]))
    assert_allclose(np.sort_complex(found), np.sqrt(stiffness) * np.array([-1j, 1j]), rtol=SHARP, atol=SHARP)
    x, y, a, b, c = (Fraction(number) for number in (across, along, first, between, last))
    parted = (a * x - b * y) / x != (c * y - b * x) / y  # what the stored numbers make of the square of both
    assert [warning.category for warning in caught] == [CloseDecisionWarning] * parted


@pytest.mark.parametrize(("power", "told"), [(8, False), (36, True)])
def test_a_zero_that_entries_do_not_determine_is_told(power: int, *, told: bool) -> None:
    """Two masses on a spring of 1 N/m, tied by one of 2^36: a zero at 1 rad/s is known to 2^-16 of itself."""
    stiff = 2.0**power
    K = [[2.0, -1.0, 0.0], [-1.0, 2.0 + stiff, -stiff], [0.0, -stiff, stiff]]
    with recording_warnings() as caught:
        found = zeros(mechss(np.eye(3), None, K, [1.0, 0.0, 0.0], [1.0, 0.0, 0.0]))
    assert_allclose(np.abs(found[:2]), 1.0, rtol=1.0 / stiff)
    assert [warning.category for warning in caught] == [DataLimitWarning] * told
