"""Signals of state and input derivatives, equations (6) and (7), and what of the inputs' derivatives is rounding."""

from typing import NoReturn

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from halfdof_ctrl import SecondOrderModel, exact_reduction, hydromount, mechss
from halfdof_ctrl.reduction.method.signals import Rounding, Signal, output_signal, trimmed, without_rounding
from support.mechanisms import rod
from support.rational import rational_transfer
from support.row_systems import SEEDS, dense, drawn

FloatArray = npt.NDArray[np.float64]
SUMS = 1e-10  # sums of a few dozen products of numbers near one, relative to values up to 1e2
ROUNDOFF = 1e-12  # small well-conditioned models
COEFFICIENT = 1e-8  # random integer models, some of them hardly solvable, relative to the largest of a power


def drawn_signal(generator: np.random.Generator, derivatives: int) -> Signal:
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
    signal, s = drawn_signal(generator, derivatives), 2.0 + 7.0j
    desired = s * value(signal, A, B, s)
    assert_allclose(value(signal.derivative(A, B), A, B, s), desired, rtol=0.0, atol=SUMS * np.abs(desired).max())


@given(seed=st.integers(0, 2**32 - 1), mine=st.integers(0, 3), theirs=st.integers(0, 3))
def test_sum_and_combination_are_linear(seed: int, mine: int, theirs: int) -> None:
    """``w + R w'`` has the sum of the transfer functions, whichever has more input derivatives."""
    generator = np.random.default_rng(seed)
    A, B, R = generator.standard_normal((3, 3)), generator.standard_normal((3, 2)), generator.standard_normal((2, 2))
    first, second, s = drawn_signal(generator, mine), drawn_signal(generator, theirs), 2.0 + 7.0j
    desired = value(first, A, B, s) + R @ value(second, A, B, s)
    assert_allclose(
        value(first.plus(second.combined(R)), A, B, s), desired, rtol=0.0, atol=SUMS * np.abs(desired).max()
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


# --- outputs


def no_rounding() -> NoReturn:
    """Fail if anybody asks for the rounding errors."""
    pytest.fail("the rounding errors were computed although no derivative of an input shows")


def test_proper_outputs_need_no_rounding_errors() -> None:
    """Displacement, velocity and acceleration of a mass: computed at once."""
    model = hydromount().select(inputs="F_y", outputs=["y", "y_dot", "y_ddot"])
    signal = output_signal(model, dense(exact_reduction(model)), no_rounding)
    assert_allclose(signal.X, [[1, 0, 0, 0], [0, 0, 0, 1], [-275, -50, 25, 0]], rtol=ROUNDOFF)
    assert_allclose(signal.U[0][2], [0.05], rtol=ROUNDOFF)
    assert len(signal.U) == 1


def test_all_displacements_are_taken_as_they_are() -> None:
    """Without F, G, H the outputs are the very signal of the displacements."""
    model = hydromount()
    equations = dense(exact_reduction(model))
    assert output_signal(model, equations, no_rounding) is equations.displacement


def test_improper_output_has_its_polynomial_part() -> None:
    """The force in the rod under a prescribed length follows ``-2/3 u''``, the displacement of a does not."""
    model = rod().select(inputs="F_f", outputs=["a", "f"])
    signal = exact_reduction(model).output
    assert_allclose(np.stack(signal.U)[:, 1, 0], [-30, 0, -2 / 3], rtol=ROUNDOFF, atol=ROUNDOFF)
    assert_array_equal(np.stack(signal.U)[1:, 0], 0.0)


@given(seed=SEEDS, size=st.integers(2, 4), derivatives=st.integers(0, 2))
def test_polynomial_part_is_exact(seed: int, size: int, derivatives: int) -> None:
    """D_1, D_2, ... of rational arithmetic, for outputs and inputs of all kinds: none missing, none invented."""
    generator = np.random.default_rng(seed)
    K, C, M = drawn(seed, size)
    F, B = generator.integers(-2, 3, (3, 2, size)), generator.integers(-2, 3, (3, size, 2))
    D = generator.integers(-1, 2, (3, 2, 2))
    for part in (F, B, D):
        part[derivatives + 1 :] = 0
    model = mechss(M, C, K, B[0], F[0], F[1], H=F[2], D=D[0], Bv=B[1], Ba=B[2], Dv=D[1], Da=D[2])
    exact = rational_transfer(model)
    assume(exact.order >= 0)
    found, desired = exact_reduction(model, method="deflation").polynomial_part, exact.polynomial_part()
    assert len(found) == len(desired)
    for one, other in zip(found, desired, strict=True):
        assert_array_equal(one != 0.0, other != 0.0)
        assert_allclose(one, other, rtol=0.0, atol=COEFFICIENT * np.abs(other).max())


def displacement_of(*parts: float) -> Signal:
    """Give one displacement with coefficients of u, u', ..."""
    return Signal(np.zeros((1, 0)), tuple([np.array([[part]]) for part in parts]))


def rounding_of(*parts: float) -> Rounding:
    """Say what the coefficients of a displacement are known to a tenth of."""
    nothing = np.zeros((0, 0))
    return Rounding(relative=0.1, A=nothing, B=np.zeros((0, 1)), displacement=displacement_of(*parts))


def one_dof(**outputs: FloatArray | list[list[float]]) -> SecondOrderModel:
    """Give a spring with the given outputs."""
    return mechss(None, None, [[1.0]], **outputs)  # type: ignore[arg-type]


def test_coefficients_within_rounding_are_dropped() -> None:
    """0.05 of 1 at a tenth is nothing, 0.2 is not; zeros at the end go."""
    output = displacement_of(1.0, 0.2, 0.05)
    kept = without_rounding(one_dof(), output, rounding_of(1.0, 1.0, 1.0))
    assert [float(part[0, 0]) for part in kept.U] == [1.0, 0.2]
    assert without_rounding(one_dof(), displacement_of(0.01), rounding_of(1.0)).U == ()


def test_rounding_of_velocities_comes_one_derivative_later() -> None:
    """``3 q'``: what is known of u in q bounds the coefficient of u' in the output."""
    model = one_dof(G=[[-3.0]])
    output = displacement_of(0.0, 0.25)
    assert without_rounding(model, output, rounding_of(1.0)).U == ()
    assert len(without_rounding(model, output, rounding_of(0.5)).U) == 2


def test_signal_without_inputs_stays_as_it_is() -> None:
    """No coefficient, nothing to judge."""
    output = displacement_of()
    assert without_rounding(one_dof(), output, rounding_of(1.0)) is output


def test_coefficient_without_a_bound_stays() -> None:
    """What no rounding error can reach is exact, such as Da of the model itself."""
    kept = without_rounding(one_dof(), displacement_of(1.0, 0.0, 1e-30), rounding_of(1.0))
    assert len(kept.U) == 3
