"""The port-Hamiltonian form and its certificate."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from halfdof_ctrl import SecondOrderModel, hydromount, mech2ss, mechss, port_hamiltonian
from halfdof_ctrl.errors import EnergyFormError

ROUNDING = 1e-13  #: relative, of models of a few DOFs

GYROSCOPE = np.array([[0.0, 7.0], [-7.0, 0.0]])
FREE = mechss(np.diag([2.0, 1]), [[3, -3], [-3, 3]], [[8, -8], [-8, 8]])
MODELS = {"mount": hydromount(), "gyroscope": mechss(np.eye(2), GYROSCOPE, np.eye(2)), "free": FREE}


@pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)
def test_parts_make_up_the_state_matrix(model: SecondOrderModel) -> None:
    """(J - R) Q is A in energy states, J skew, R symmetric and positive semidefinite."""
    ph = port_hamiltonian(model)
    A = mech2ss(model, states="energy").A
    assert_allclose((ph.J - ph.R) @ ph.Q, A, rtol=0, atol=ROUNDING * np.abs(A).max())
    assert_array_equal(ph.J, -ph.J.T)
    assert_array_equal(ph.R, ph.R.T)
    assert ph.is_passive
    assert not ph.dofs
    assert np.linalg.eigvalsh(ph.R)[0] >= -ROUNDING * max(np.abs(ph.R).max(), 1.0)


def test_gyroscopic_forces_exchange_energy_and_lose_none() -> None:
    """R of a gyroscope is zero, since its C is skew."""
    assert_array_equal(port_hamiltonian(MODELS["gyroscope"]).R, 0.0)


def test_energy_of_a_motion_is_that_of_the_springs_and_masses() -> None:
    """x^T Q x / 2 is q^T K q / 2 + q'^T M q' / 2, where the free motion has kinetic energy alone."""
    sys = mech2ss(FREE, states="energy")
    ph = port_hamiltonian(FREE)
    assert_array_equal(np.diagonal(ph.Q), [0.0, 1.0, 1.0, 1.0])
    assert list(ph.states) == sys.state_labels
    assert_array_equal(ph.B, sys.B)


@given(st.floats(0.0, 0.99, allow_subnormal=False), st.floats(1.01, 10.0))
def test_coupled_dampers_are_passive_up_to_their_bound(inside: float, outside: float) -> None:
    """C = [[1, g], [g, 1]] loses energy for every motion if and only if |g| <= 1."""
    for g, passive in ((inside, True), (outside, False)):
        ph = port_hamiltonian(mechss(np.eye(2), [[1, g], [g, 1]], np.eye(2)))
        assert ph.is_passive is passive
        assert_allclose(ph.smallest, 1.0 - g, atol=ROUNDING)


@pytest.mark.parametrize("other", [1e3, 1e15, 1e40])
def test_a_strong_damper_elsewhere_hides_no_negative_one(other: float) -> None:
    """A mass that gains a hundredth of its own speed is unstable, whatever else loses energy."""
    ph = port_hamiltonian(mechss(np.eye(2), np.diag([-0.01, other]), np.diag([4.0, 1.0]), dofs=["a", "b"]))
    assert not ph.is_passive
    assert ph.dofs == ("a",)


def test_rounding_of_a_sum_of_dampers_is_no_fault() -> None:
    """0.1 + 0.2 - 0.3 is not zero; of a DOF whose spring and mass make 2 N s/m that is rounding."""
    left = 0.3 - (0.1 + 0.2)
    assert left < 0.0
    assert port_hamiltonian(mechss(np.eye(2), np.diag([left, 1.0]), np.diag([4.0, 1.0]))).is_passive


def test_dofs_through_which_energy_enters_are_named_strongest_first() -> None:
    """Negative dampers of 5 at b and 0.1 at c: the worst motion is that of b alone."""
    ph = port_hamiltonian(mechss(np.eye(3), np.diag([1.0, -5.0, -0.1]), np.eye(3), dofs=["a", "b", "c"]))
    assert not ph.is_passive
    assert ph.dofs == ("b",)
    assert "energy enters through b" in repr(ph)


def test_negative_damper_of_a_half_dof_is_seen() -> None:
    """A massless DOF whose damper is negative feeds energy in, whatever damps the mass."""
    ph = port_hamiltonian(mechss(np.diag([1.0, 0]), np.diag([9.0, -1.0]), [[3, -1], [-1, 2]], dofs=["mass", "node"]))
    assert ph.dofs == ("node",)


def test_certificate_is_printed() -> None:
    """The mount is passive, and says by how much."""
    assert repr(port_hamiltonian(hydromount())).startswith("PortHamiltonian, 4 states: passive (smallest eigenvalue")


def test_follower_forces_have_no_such_form() -> None:
    """An unsymmetric K is refused by name."""
    with pytest.raises(EnergyFormError, match="K is unsymmetric"):
        port_hamiltonian(mechss(np.eye(2), None, [[2, 1], [-1, 2]]))
