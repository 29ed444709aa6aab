"""What is said of a state space that is handed over: of its own numbers, and of no others."""

import re
import warnings

import numpy as np
import pytest

from halfdof_ctrl import exact_reduction, frequency_response, hydromount, lqr, mech2ss, mechss, state_map, step_response
from halfdof_ctrl.base.arrays import FloatArray
from halfdof_ctrl.errors import LostDigitsWarning
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.reduction.method.evidence import Evidence
from halfdof_ctrl.systems.transfer_check import system_response
from halfdof_ctrl.systems.working_states import model_poles, refined_response
from support.rational import rational_transfer
from support.verdict import Improved

SIZE = 30.0  # a measured loss is right to this factor
TOLD = re.compile(r"lose (\S+) of (\S+) from (\S+) at (\S+) rad/s")


def light_end() -> SecondOrderModel:
    """Make a mass on a soft spring, and a light one on a stiff spring at it, whose acceleration is looked at."""
    K = [[10001.0, -10000.0], [-10000.0, 10000.0]]
    model = mechss(np.diag([1.0, 1e-9]), np.diag([0.1, 0.1]), K, [[1.0], [0.0]])
    return model.select(outputs=["q1_ddot", "q0"])


def assert_right(message: str, model: SecondOrderModel, stored: Improved) -> None:
    """Compare what is told of a loss with exact arithmetic."""
    size, output, _, omega = TOLD.findall(message)[0]
    right = rational_transfer(model).at(1j * float(omega))
    lost = np.abs(stored.exactly_at(1j * float(omega)) - right)[model.outputs.index(output)].max()
    value = np.abs(right[model.outputs.index(output)]).max()
    assert float(size) / SIZE < lost / value < float(size) * SIZE


def test_energy_states_are_told_of_where_they_lose_as_exact_arithmetic_says() -> None:
    """Accelerations are rows of A in DOF states; of strains and momenta they are sums that cancel towards rest."""
    model = light_end()
    with warnings.catch_warnings():
        warnings.simplefilter("error", LostDigitsWarning)
        exact_reduction(model)
    with pytest.warns(LostDigitsWarning, match="strains and momenta hold what cancels") as caught:
        sys = mech2ss(model, states="energy")
    assert_right(str(caught[0].message), model, Improved(sys.A, sys.B, sys.C, sys.D))


def test_digits_that_are_not_used_are_not_told_of(monkeypatch: pytest.MonkeyPatch) -> None:
    """Responses and poles are worked in energy states; who gets A and B in states of DOFs is told what they lose."""
    told = []
    monkeypatch.setattr(Evidence, "warn_of_loss", lambda *_: told.append(1))
    model = hydromount().select(inputs="F_y", outputs="y")
    step_response(model)
    model_poles(model)
    frequency_response(model, np.array([1.0, 10.0]))
    mech2ss(model, states="energy")
    mech2ss(model, states="modal")
    state_map(model, "energy")
    assert not told
    mech2ss(model)
    mech2ss(model, states="scaled")
    state_map(model, "dofs")
    lqr(model, displacement={"y": 1.0}, effort={"F_y": 1.0})
    assert len(told) == 4


def test_responses_worked_in_states_of_dofs_tell_what_these_lose(monkeypatch: pytest.MonkeyPatch) -> None:
    """A follower force leaves no energy states."""
    told = []
    monkeypatch.setattr(Evidence, "warn_of_loss", lambda *_: told.append(1))
    model = mechss(np.eye(2), 0.1 * np.eye(2), [[2.0, 1.0], [-1.0, 2.0]])
    step_response(model)
    model_poles(model)
    assert len(told) == 2


def test_accelerations_in_other_units_are_measured_towards_rest() -> None:
    """A factor rounds each entry of the row of A that an acceleration is: they no longer cancel towards rest."""
    K = [[1001.0, -1000.0, 0.0], [-1000.0, 1700.0, -700.0], [0.0, -700.0, 703.0]]
    model = mechss(np.diag([1.0, 1e-8, 1.0]), 0.1 * np.eye(3), K, [[1.0], [0.0], [0.0]], H=[[0.0, 1.0 / 3.0, 0.0]])
    with pytest.warns(LostDigitsWarning, match="as double precision stores them lose") as caught:
        reduction = exact_reduction(model)
    output = reduction.output
    stored = Improved(reduction.A, reduction.B, output.X, output.direct(1))
    assert_right(str(caught[0].message), model, stored)


def branched_chain(seed: int, masses: int = 22, nodes: int = 44) -> SecondOrderModel:
    """Give a held chain of masses with Maxwell branches across it; the acceleration of one of them is looked at."""
    generator = np.random.default_rng(seed)
    n = masses + nodes
    M, C, K = np.zeros((3, n, n))
    M[:masses, :masses] = np.diag(generator.uniform(0.5, 50.0, masses))

    def join(matrix: FloatArray, i: int, j: int, value: float) -> None:
        matrix[np.ix_([i, j], [i, j])] += value * np.array([[1.0, -1.0], [-1.0, 1.0]])

    K[0, 0] = 1e4
    for i in range(1, masses):
        join(K, i, i - 1, 10.0 ** generator.uniform(2, 5))
    for node in range(masses, n):
        i, j = generator.choice(masses, 2, replace=False).tolist()
        join(K, i, node, 10.0 ** generator.uniform(2, 6))
        join(C, node, j, 10.0 ** generator.uniform(0, 3))
    place, force = int(generator.integers(masses)), int(generator.integers(n))
    return mechss(M, C, K).select(f"F_q{force}", f"q{place}_ddot")


def test_roll_off_of_many_modes_is_looked_at() -> None:
    """Among 66 DOFs modal states lose 6e-5 of an acceleration far above the slowest modes, deep in its roll-off."""
    model = branched_chain(35)
    with pytest.warns(LostDigitsWarning, match="strains and momenta hold what cancels") as caught:
        sys = mech2ss(model, states="modal")
    size, _, _, omega = TOLD.findall(str(caught[0].message))[0]
    point = np.array([1j * float(omega)])
    lost = np.abs(system_response(sys, point).values / refined_response(model, point) - 1.0).item()
    assert float(omega) > 1e4
    assert float(size) / SIZE < lost < float(size) * SIZE
    with warnings.catch_warnings():
        warnings.simplefilter("error", LostDigitsWarning)
        mech2ss(branched_chain(0), states="modal")


@pytest.mark.parametrize("masses", [1, 70])
def test_models_of_free_masses_alone_have_no_modes_to_look_at(masses: int) -> None:
    """All poles are at the origin."""
    for states in ("energy", "modal"):
        sys = mech2ss(mechss(np.eye(masses), None, np.zeros((masses, masses))), states=states)
        assert not np.linalg.eigvals(sys.A).any()
