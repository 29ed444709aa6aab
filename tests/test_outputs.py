"""Outputs as functions of state and inputs, and what of the inputs' derivatives is rounding."""

from typing import NoReturn

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from mechanisms import rod
from numpy.testing import assert_allclose, assert_array_equal
from rational import rational_transfer
from test_deflationroad import dense
from test_relaxation import SEEDS, drawn

from halfdof_ctrl import SecondOrderModel, exact_reduction, hydromount, mechss
from halfdof_ctrl.reduction.method.signals import Rounding, Signal, output_signal, without_rounding

FloatArray = npt.NDArray[np.float64]
ROUNDOFF = 1e-12  # small well-conditioned models
COEFFICIENT = 1e-8  # random integer models, some of them hardly solvable, relative to the largest of a power


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
