"""Signals of state and input derivatives: equations (6) and (7)."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from halfdof_ctrl.reduction.method.signals import Signal, trimmed

ROUNDOFF = 1e-10  # sums of a few dozen products of numbers near one, relative to values up to 1e2


def drawn(generator: np.random.Generator, derivatives: int) -> Signal:
    """Draw a signal of 2 rows, 3 states, 2 inputs."""
    return Signal(generator.standard_normal((2, 3)), tuple(generator.standard_normal((derivatives, 2, 2))))


def value(signal: Signal, A: np.ndarray, B: np.ndarray, s: complex) -> np.ndarray:
    """Give the signal's transfer function, ``X (s I - A)^-1 B + sum U_k s^k``."""
    total = signal.X @ np.linalg.solve(s * np.eye(A.shape[0]) - A, B.astype(complex))
    return np.asarray(total + sum(part * s**k for k, part in enumerate(signal.U)))


@given(seed=st.integers(0, 2**32 - 1), derivatives=st.integers(0, 3))
def test_derivative_multiplies_the_transfer_function_by_s(seed: int, derivatives: int) -> None:
    """(7) is ``s`` times (6)."""
    generator = np.random.default_rng(seed)
    A, B = generator.standard_normal((3, 3)), generator.standard_normal((3, 2))
    signal, s = drawn(generator, derivatives), 2.0 + 7.0j
    desired = s * value(signal, A, B, s)
    assert_allclose(value(signal.derivative(A, B), A, B, s), desired, rtol=0.0, atol=ROUNDOFF * np.abs(desired).max())


@given(seed=st.integers(0, 2**32 - 1), mine=st.integers(0, 3), theirs=st.integers(0, 3))
def test_sum_and_combination_are_linear(seed: int, mine: int, theirs: int) -> None:
    """``w + R w'`` has the sum of the transfer functions, whichever has more input derivatives."""
    generator = np.random.default_rng(seed)
    A, B, R = generator.standard_normal((3, 3)), generator.standard_normal((3, 2)), generator.standard_normal((2, 2))
    first, second, s = drawn(generator, mine), drawn(generator, theirs), 2.0 + 7.0j
    desired = value(first, A, B, s) + R @ value(second, A, B, s)
    assert_allclose(
        value(first.plus(second.combined(R)), A, B, s), desired, rtol=0.0, atol=ROUNDOFF * np.abs(desired).max()
    )


def test_zero_coefficients_at_the_end_are_dropped() -> None:
    """Only those: a zero between two that count stays."""
    one, zero = np.ones((1, 1)), np.zeros((1, 1))
    assert trimmed((zero, zero)) == ()
    assert trimmed((zero, one, zero)) == (zero, one)
    assert trimmed(()) == ()


def test_cancelling_signals_leave_no_input_terms() -> None:
    """``w - w`` has no coefficients at all."""
    signal = Signal(np.ones((1, 2)), (np.ones((1, 1)), np.ones((1, 1))))
    assert signal.plus(signal.combined(-np.ones((1, 1)))).U == ()


def test_direct_term_of_a_signal_without_inputs_is_zero() -> None:
    """U_0 in the right shape, also where it is not stored."""
    assert_array_equal(Signal(np.ones((2, 3)), ()).direct(4), np.zeros((2, 4)))
    assert_array_equal(Signal(np.ones((1, 1)), (np.full((1, 1), 3.0),)).direct(1), [[3.0]])
