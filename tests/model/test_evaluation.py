"""Direct solves of equation (1) at many points."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from halfdof_ctrl.model import evaluation
from halfdof_ctrl.model.evaluation import quadratic_transfer
from support.structures import on_axis

ROUNDOFF = 1e-12  # well-conditioned solves of up to 6 equations
CORRECTED = 1e-9  # graded by 1e+-100 and solved in one go: the entries of every P(s) are still known to rounding


def coefficients(generator: np.random.Generator, rows: int, columns: int) -> tuple[np.ndarray, ...]:
    """Draw the coefficients of 1, s, s^2."""
    return tuple(generator.standard_normal((3, rows, columns)))


@given(seed=st.integers(0, 2**32 - 1), n=st.integers(1, 6))
def test_values_equal_the_formula_point_by_point(seed: int, n: int) -> None:
    """``F(s) P(s)^-1 B(s) + D(s)`` written out with numpy's solve."""
    generator = np.random.default_rng(seed)
    P, B, F, D = (coefficients(generator, *shape) for shape in ((n, n), (n, 2), (3, n), (3, 2)))
    P = (P[0] + 6 * np.eye(n), *P[1:])
    points = np.asarray(generator.standard_normal(5) * 0.3 + 0.2j, dtype=np.complex128)
    values = quadratic_transfer(P, B, F, D, points)
    for k, s in enumerate(points):
        Ps, Bs, Fs, Ds = (part[0] + s * part[1] + s**2 * part[2] for part in (P, B, F, D))
        desired = Fs @ np.linalg.solve(Ps, Bs) + Ds
        assert_allclose(values[:, :, k], desired, rtol=0.0, atol=ROUNDOFF * max(1.0, np.abs(desired).max()) * 100)


def test_batches_join_without_a_seam(monkeypatch: pytest.MonkeyPatch) -> None:
    """Points that are worked in several batches give the values of one batch."""
    generator = np.random.default_rng(1)
    P, B, F, D = (coefficients(generator, *shape) for shape in ((3, 3), (3, 1), (1, 3), (1, 1)))
    points = on_axis(np.linspace(0.1, 9.0, 23))
    whole = quadratic_transfer(P, B, F, D, points)
    monkeypatch.setattr(evaluation, "BATCH_ENTRIES", 45)
    assert_allclose(quadratic_transfer(P, B, F, D, points), whole, rtol=ROUNDOFF)


def test_only_the_singular_points_of_a_batch_are_infinite() -> None:
    """Poles at 1j, 2j, 3j among regular points."""
    squares = np.diag([1.0, 4.0, 9.0])
    zero, unit = np.zeros((3, 3)), np.eye(3)
    points = on_axis([0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5])
    values = quadratic_transfer((squares, zero, unit), (unit, zero, zero), (unit, zero, zero), (zero,) * 3, points)
    infinite = np.isinf(values.real).any(axis=(0, 1))
    assert infinite.tolist() == [False, True, False, True, False, True, False]
    assert_allclose(values[0, 0, 0], 1.0 / 0.75, rtol=ROUNDOFF)


@given(seed=st.integers(0, 2**32 - 1))
def test_badly_scaled_equations_are_solved_to_rounding(seed: int) -> None:
    """Rows and columns spread over 200 decades: the solution of the unscaled system, scaled."""
    generator = np.random.default_rng(seed)
    P = generator.standard_normal((5, 5)) + 8 * np.eye(5)
    rows, columns = 10.0 ** generator.integers(-100, 101, (2, 5))
    zero, unit = np.zeros((5, 5)), np.eye(5)
    scaled = P * rows[:, None] * columns
    values = quadratic_transfer(
        (scaled, zero, zero), (np.diag(rows), zero, zero), (np.diag(columns), zero, zero), (zero,) * 3, on_axis([0.0])
    )
    assert_allclose(values[:, :, 0], np.linalg.solve(P, unit), rtol=CORRECTED)
