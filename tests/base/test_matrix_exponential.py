"""Steps of a linear system against ball arithmetic and closed forms."""

import flint
import numpy as np
import pytest
from numpy.testing import assert_allclose

from halfdof_ctrl.base.arrays import FloatArray
from halfdof_ctrl.base.matrix_exponential import exact_step

PRECISION = 800  #: bits
NEARLY = 1e-26  #: of the largest entry: some 2^-95, and what doublings add


def stiff(size: int, rate: float) -> FloatArray:
    """Give a stable matrix that is not normal, with slow motion beside motion of the given rate."""
    generator = np.random.default_rng(size)
    root, turning = generator.standard_normal((2, size, size))
    matrix = -(root @ root.T) - np.eye(size) + turning - turning.T
    return np.asarray(np.diag([1e-3, *np.full(size - 1, rate)]) @ matrix)


@pytest.mark.parametrize("rate", [1e-3, 1.0, 1e3, 1e9])
def test_step_has_twice_the_digits(rate: float) -> None:
    """High and low parts add up to what the exponential of [[A, B, 0], [0, 0, 1], [0, 0, 0]] h says in 800 bits."""
    n, m, h = 5, 2, 0.37
    A, B = stiff(n, rate), np.random.default_rng(1).standard_normal((n, m))
    before, flint.ctx.prec = flint.ctx.prec, PRECISION
    try:
        whole = np.zeros((n + 2 * m, n + 2 * m))
        whole[:n, :n], whole[:n, n : n + m] = A, B
        balls = flint.arb_mat(whole.tolist()) * flint.arb(h)
        for k in range(m):
            balls[n + k, n + m + k] = 1
        exact = balls.exp()
        for part, columns in zip(exact_step(A, B, h), (0, n, n + m), strict=True):
            width = part[0].shape[1]
            own = [[exact[i, columns + j] - int(i == columns + j) for j in range(width)] for i in range(n)]
            size = max(abs(float(value.mid())) for row in own for value in row)
            found = zip(own, part[0].tolist(), part[1].tolist(), strict=True)
            left = [abs(float((x - y - z).mid())) for row in found for x, y, z in zip(*row, strict=True)]
            assert max(left) <= NEARLY * size
    finally:
        flint.ctx.prec = before


def test_double_integrator_moves_by_powers_of_time() -> None:
    """For x'' = u that rises from u0 to u1 in h: v by h (u0 + u1) / 2, and x by h v + h^2 (2 u0 + u1) / 6."""
    h = 0.5
    change, of_value, of_change = (
        high + low for high, low in exact_step(np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([[0.0], [1.0]]), h)
    )
    assert_allclose(change, [[0.0, h], [0.0, 0.0]], rtol=1e-15)
    assert_allclose(of_value, [[h**2 / 2.0], [h]], rtol=1e-15)
    assert_allclose(of_change, [[h**2 / 6.0], [h / 2.0]], rtol=1e-15)


def test_what_grows_beyond_the_largest_number_is_not_finite() -> None:
    """e^1000 is no double, and neither is the exponential of what is none."""
    with np.errstate(all="ignore"):
        for rate in (1000.0, np.inf):
            assert not np.isfinite(exact_step(np.array([[rate]]), np.ones((1, 1)), 1.0)[0][0]).all()
