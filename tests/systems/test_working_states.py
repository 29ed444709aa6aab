"""The states in which responses and poles are computed."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from halfdof_ctrl import exact_reduction, frequency_response, hydromount, mech2ss, mechss
from halfdof_ctrl.model.evaluation import data_limit
from halfdof_ctrl.systems.working_states import model_poles, working_map, working_system
from support.beams import FIRST_MODES, ball_transfer, cantilever
from support.exact import transfer

EVALUATED = 1e-10  #: relative, on a Hessenberg form in energy coordinates
AS_GOOD = 1e-12  #: relative: what is below is rounding
OMEGA = np.append(np.geomspace(0.1, 1e3, 40), 16.57)


def test_frequency_response_of_a_beam_keeps_its_digits() -> None:
    """At the first four resonances of 40 elements, against ball arithmetic: DOF states lose 1e-3 there."""
    response = frequency_response(cantilever(40), FIRST_MODES).complex
    assert_allclose(response, ball_transfer(cantilever(40), 1j * np.array(FIRST_MODES)), rtol=EVALUATED)


@pytest.mark.parametrize("damping", [1.0, 1e-2, 1e-3, 1e-5, 1e-6])
def test_frequency_response_is_never_worse_than_python_control(damping: float) -> None:
    """Weak dampers of a massless node: a pole 1e8 times faster than the mode, of the model and of its state space."""
    model = hydromount(C_rs=damping).select("F_y", "y")
    exact = transfer(model, 1j * OMEGA)[0, 0]
    for what in (model, mech2ss(model)):
        assert_allclose(frequency_response(what, OMEGA).complex, exact, rtol=AS_GOOD)


def test_deep_roll_off_comes_of_dof_states() -> None:
    """The far end of a chain of 12 masses at 100 times its frequencies: 1e-48 of the near end, to ten digits."""
    n = 12
    K = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    model = mechss(np.eye(n), 0.1 * np.eye(n), K).select("F_q0", f"q{n - 1}")
    exact = transfer(model, [100.0j])[0, 0]
    assert_allclose(frequency_response(model, [100.0]).complex, exact, rtol=EVALUATED)


def test_poles_of_free_motions_are_exactly_zero() -> None:
    """Two masses and a node between them: a double pole at 0 and one pair at 10 rad/s."""
    poles = model_poles(mechss(np.diag([2.0, 0, 1]), None, [[100, -100, 0], [-100, 300, -200], [0, -200, 200]]))
    assert np.count_nonzero(poles == 0.0) == 2
    assert_allclose(np.abs(poles[poles != 0.0]), 10.0, rtol=AS_GOOD)


def test_working_states_are_energy_where_the_model_allows_it() -> None:
    """The mount in energy, a follower force in scaled DOF states, a model without states in none."""
    follower = mechss(np.eye(2), None, [[2, 1], [-1, 2]])
    chosen = [working_map(exact_reduction(model)) for model in (hydromount(), follower)]
    assert [states.kind for states in chosen if states is not None] == ["energy", "scaled"]
    assert working_map(exact_reduction(mechss(None, None, [[1]]))) is None
    assert working_system(hydromount()).state_labels[0] == "strain_y"
    assert working_system(follower).state_labels == list(exact_reduction(follower).states)


@pytest.mark.filterwarnings("ignore:The state space is exact, but:halfdof_ctrl.errors.LostDigitsWarning")
def test_a_response_right_at_a_few_points_is_right_at_all_points() -> None:
    """A damper of 3e-11 N s/m carries the force to the mass: neither coordinates keep 1e-20 of the stiffness.

    A hundred points of the grid, as few and as many are tested, against exact arithmetic.
    """
    c = 2.75e-11
    model = mechss(
        np.diag([38.5, 0.0, 0.0]),
        [[c, -c, 0.0], [-c, c, 0.0], [0.0, 0.0, 4610.0]],
        [[2842.0, 0.0, -33.75], [0.0, 23281.25, 0.0], [-33.75, 0.0, 928.75]],
    ).select("F_q1", "q0")
    omega = np.geomspace(0.01, 1e4, 100)
    exact = transfer(model, 1j * omega)[0, 0]
    assert_allclose(frequency_response(model, omega).complex, exact, rtol=EVALUATED)


def test_accelerations_keep_their_digits_towards_rest() -> None:
    """Of a model they come from the descriptor form, where sums of the states cancel."""
    model = hydromount().select("F_y", "y_ddot")
    omega = np.geomspace(1e-5, 1e-1, 9)
    assert_allclose(frequency_response(model, omega).complex, transfer(model, 1j * omega)[0, 0], rtol=EVALUATED)


def test_a_tip_of_a_resonance_does_not_decide_against_dof_states(monkeypatch: pytest.MonkeyPatch) -> None:
    """A chain of 41 masses whose only damper is weak, a pole of 1e9 rad/s: entries determine little at the tips alone.

    DOF states are right elsewhere, and no energy states are asked, which a factorization at each point would mend.
    """
    monkeypatch.setattr("halfdof_ctrl.systems.working_states.response_of_form", lambda *_: pytest.fail("energy states"))
    n = 42
    K = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    K[-1, -1], K[3, 3], K[-1, 3], K[3, -1], K[-1, -2], K[-2, -1] = 1.0, 3.0, -1.0, -1.0, 0.0, 0.0
    C = np.zeros((n, n))
    C[-1, -1] = 1e-9
    model = mechss(np.diag([1.0] * (n - 1) + [0.0]), C, K).select("F_q0", "q0")
    response = frequency_response(model, None)
    omega, found = np.asarray(response.omega), np.asarray(response.complex)
    limit = data_limit(*model.quadratics, 1j * omega).data[0, 0] / np.abs(found)
    apart = np.flatnonzero(limit < 1e-11)[::20]
    assert apart.size > 40
    assert_allclose(found[apart], ball_transfer(model, 1j * omega[apart]), rtol=EVALUATED)
