"""The warning before python-control's evaluation loses digits: where it does, and not where it does not."""

import warnings

import control
import numpy as np
import pytest

from halfdof_ctrl import SecondOrderModel, hydromount, mech2ss, mechss
from halfdof_ctrl.base.arrays import has_even_entries
from halfdof_ctrl.errors import LostDigitsWarning
from halfdof_ctrl.systems.evaluation_loss import WARNED, evaluation_loss
from halfdof_ctrl.systems.state_space import system_of_model
from halfdof_ctrl.systems.transfer_check import system_response
from support.beams import cantilever
from support.slycot_marks import needs_slycot

SIZE = 30.0  # a measured loss is right to this factor: another frequency nearby loses another part of it


@needs_slycot  # the solve of NumPy, which takes its place, loses less
@pytest.mark.parametrize("elements", [30, 40])
def test_beams_are_warned_of_and_the_cure_is_named(elements: int) -> None:
    """A cantilever in DOF states: the frequency, the size and `states="scaled"`, which warns of nothing."""
    with pytest.warns(LostDigitsWarning, match=r'python-control\'s evaluation of them .* states="scaled"'):
        mech2ss(cantilever(elements))
    for states in ("scaled", "energy"):
        mech2ss(cantilever(elements), states=states)


def test_the_loss_is_that_of_python_control() -> None:
    """Measured at one frequency, against refined solves there."""
    sys = system_of_model(cantilever(120))
    loss = evaluation_loss(sys)
    assert loss is not None
    point = np.array([1j * loss.omega])
    right = system_response(sys, point).values[loss.output, loss.source, 0]
    found = np.asarray(sys(point, squeeze=False))[loss.output, loss.source, 0]
    assert loss.value > WARNED
    assert loss.value / SIZE < abs(found / right - 1.0) < loss.value * SIZE


@needs_slycot
@pytest.mark.parametrize("elements", [60, 100])
def test_the_estimate_for_many_states_is_that_of_what_is_measured(
    elements: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """At a frequency where both are known."""
    sys = system_of_model(cantilever(elements))
    monkeypatch.setattr("halfdof_ctrl.systems.evaluation_loss.EVALUATION_LOSS_MOST_STATES", 10)
    loss = evaluation_loss(sys)
    assert loss is not None
    assert loss.estimated
    point = np.array([1j * loss.omega])
    right = system_response(sys, point).values[loss.output, loss.source, 0]
    found = np.asarray(sys(point, squeeze=False))[loss.output, loss.source, 0]
    assert loss.value / SIZE < abs(found / right - 1.0) < loss.value * SIZE


@needs_slycot
def test_more_than_a_thousand_states_are_told_of() -> None:
    """A cantilever of 1040 states, of which python-control loses about half at its first mode."""
    with pytest.warns(LostDigitsWarning, match=r"python-control's evaluation .* will lose about .* at 3\.5\d rad/s"):
        mech2ss(cantilever(260))


def test_well_posed_models_are_quiet() -> None:
    """The paper's mount, and 100 random mounts in SI units with all kinds of DOFs: at most one warning."""
    said = []
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        mech2ss(hydromount())
        generator = np.random.default_rng(0)
        for _ in range(100):
            mech2ss(_mount(generator, int(generator.integers(2, 9))))
        said = [warning for warning in caught if issubclass(warning.category, LostDigitsWarning)]
    assert len(said) <= 1


def _mount(generator: np.random.Generator, n: int) -> SecondOrderModel:
    kind = generator.integers(0, 3, n)
    M = np.diag(np.where(kind == 0, generator.uniform(1.0, 300.0, n), 0.0))
    links = np.eye(n) - np.eye(n, k=1)
    damping, stiffness = 10.0 ** generator.uniform(1, 4, n), 10.0 ** generator.uniform(4, 6, n)
    damped = (kind < 2)[:, None] * (kind < 2)
    return mechss(M, (links.T * damping @ links + np.diag(damping)) * damped, links.T * stiffness @ links)


def test_even_entries_need_no_look() -> None:
    """Ratios up to 1e5 among the entries that are not zero, small and large matrices alike."""
    for n in (2, 40):
        A = -np.eye(n) - np.eye(n, k=1)
        assert has_even_entries(A)
        A[0, -1] = 1e6
        assert not has_even_entries(A)
    assert has_even_entries(np.zeros((0, 0)))


def test_inside_the_package_nothing_is_warned_of() -> None:
    """Whoever balances loses nothing, so that there is nothing to say."""
    assert isinstance(system_of_model(cantilever(40)), control.StateSpace)
