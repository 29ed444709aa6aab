"""Frequency responses as `control.FrequencyResponseData`: the very points, the names, the values of the peers."""

import control
import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from halfdof_ctrl import descriptor_response, frequency_response, hydromount, mech2ss, mechss
from halfdof_ctrl.base.errors import ParameterError, SingularPencilError
from halfdof_ctrl.systems.frequency import checked_frequencies, default_frequencies
from support.structures import Structure, damped_structures

AGREEMENT = 1e-10  # two routes, relative to the channel's largest value
PEER = 1e-9  # python-control evaluates without balancing; its own loss on these small systems
ROUNDOFF = 1e-12  # closed forms


@pytest.mark.parametrize("omega", [[1.0, 2.0], (1.0, 2.0), np.array([1.0, 2.0])])
@pytest.mark.parametrize("compute", [frequency_response, descriptor_response])
def test_two_frequencies_are_two_points(compute: object, omega: npt.ArrayLike) -> None:
    """python-control takes a list of two as the limits of a range of 1000."""
    data = compute(hydromount(), omega)  # type: ignore[operator]
    assert_array_equal(data.omega, [1.0, 2.0])
    assert data.frdata.shape == (3, 3, 2)


@pytest.mark.parametrize("compute", [frequency_response, descriptor_response])
def test_names_and_kind_are_kept(compute: object) -> None:
    """Inputs, outputs and name of the model, full stops written as colons."""
    data = compute(mechss([[1]], [[1]], [[1]], dofs="1.1", name="a.b"), [1.0, 3.0])  # type: ignore[operator]
    assert isinstance(data, control.FrequencyResponseData)
    assert (data.input_labels, data.output_labels, data.name, data.sysname) == (["F_1:1"], ["1:1"], "a:b", "a:b")
    assert data.plot_type == "bode"


def test_frequencies_keep_their_order_and_repetitions() -> None:
    """The very points, as they were given, at scalars too."""
    data = frequency_response(hydromount(), [3.0, 1.0, 1.0])
    assert_array_equal(data.omega, [3.0, 1.0, 1.0])
    assert frequency_response(hydromount(), 2.0).omega.tolist() == [2.0]


@given(structure=damped_structures())
def test_state_space_and_descriptor_form_agree(structure: Structure) -> None:
    """Both functions on the same model, at 20 frequencies over six decades."""
    model, omega = structure.model(), np.geomspace(1e-3, 1e3, 20)
    fast, direct = frequency_response(model, omega).frdata, descriptor_response(model, omega).frdata
    size = np.abs(direct).max(axis=2, keepdims=True)
    size = np.where(size > 0.0, size, np.abs(direct).max())
    assert_allclose(fast / size, direct / size, rtol=0.0, atol=AGREEMENT)


@given(
    seed=st.integers(0, 2**32 - 1),
    states=st.integers(1, 12),
    inputs=st.integers(1, 3),
    outputs=st.integers(1, 3),
    dt=st.sampled_from([0, 0.1, True]),
)
def test_values_are_those_of_python_control(seed: int, states: int, inputs: int, outputs: int, dt: float) -> None:
    """Wide, tall, continuous and discrete systems against `control.frequency_response`."""
    generator = np.random.default_rng(seed)
    A = generator.standard_normal((states, states)) / (2.0 * np.sqrt(states)) - (np.eye(states) if dt == 0 else 0.0)
    B, C = generator.standard_normal((states, inputs)), generator.standard_normal((outputs, states))
    sys = control.ss(A, B, C, generator.standard_normal((outputs, inputs)), dt)
    omega = np.linspace(0.01, 3.0, 9)
    desired = control.frequency_response(sys, omega)
    found = frequency_response(sys, omega)
    assert found.dt == desired.dt
    size = np.abs(desired.frdata).max()
    assert_allclose(found.frdata, desired.frdata, rtol=0.0, atol=PEER * size)


@pytest.mark.parametrize("compute", [frequency_response, descriptor_response])
def test_pole_on_the_axis_is_infinite(compute: object) -> None:
    """``inf + nan j`` at the resonance of an undamped oscillator, without a warning."""
    data = compute(mechss([[1]], None, [[4]]), [1.0, 2.0])  # type: ignore[operator]
    assert np.isinf(data.frdata[0, 0, 1].real)
    assert np.isnan(data.frdata[0, 0, 1].imag)
    assert_allclose(data.frdata[0, 0, 0], 1 / 3, rtol=ROUNDOFF)


def test_rigid_body_is_infinite_at_rest() -> None:
    """1/(m s^2) at zero frequency."""
    assert np.isinf(frequency_response(mechss([[2]], None, None), [0.0, 1.0]).frdata[0, 0, 0].real)


@pytest.mark.parametrize(
    "model",
    [
        mechss([[1]], None, [[4 + 0.4j]]),
        mechss([[0]], None, [[4]], G=[[1]]),
        mechss(np.diag([1.0, 1.0, 0.0]), None, [[2, 0, 1], [0, 3, -1], [1, -1, 0]]),
    ],
    ids=["complex", "improper", "index 3"],
)
def test_models_without_a_state_space_are_evaluated_directly(model: object) -> None:
    """Where `mech2ss` must refuse, the descriptor form still answers."""
    omega = np.array([0.3, 1.0, 7.0])
    fast, direct = frequency_response(model, omega), descriptor_response(model, omega)  # type: ignore[arg-type]
    assert_array_equal(fast.frdata, direct.frdata)


def test_structural_damping_is_exact_at_every_frequency() -> None:
    """``1 / (K (1 + i eta) - w^2)``."""
    data = descriptor_response(mechss([[1]], None, [[4 + 0.4j]]), [0.0, 2.0, 5.0])
    omega = np.array([0.0, 2.0, 5.0])
    assert_allclose(data.frdata[0, 0], 1 / (4 + 0.4j - omega**2), rtol=ROUNDOFF)


def test_improper_response_grows() -> None:
    """Velocity of a spring: ``s / k``."""
    data = descriptor_response(mechss(None, None, [[4]], G=[[1]]), [1.0, 10.0])
    assert_allclose(data.frdata[0, 0], [0.25j, 2.5j], rtol=ROUNDOFF)


@pytest.mark.parametrize("compute", [frequency_response, descriptor_response])
def test_default_frequencies_show_every_mode(compute: object) -> None:
    """From a tenth of the slowest to ten times the fastest, with points at the resonance."""
    omega = compute(hydromount()).omega  # type: ignore[operator]
    assert omega[0] <= 0.32
    assert omega[-1] >= 177.0
    assert (np.diff(omega) > 0).all()
    assert np.abs(omega - 17.706).min() < 0.02


@pytest.mark.parametrize("poles", [[], [0.0], [-1.0], [1e6j, -1e6j, -1e-6], [2j, -2j], [0j, 0j, -3.0 + 1j, -3.0 - 1j]])
def test_default_frequencies_are_a_grid(poles: list[complex]) -> None:
    """Positive, rising, finite, 600 or more, whatever the poles."""
    omega = default_frequencies(np.array(poles, dtype=complex))
    assert 600 <= omega.size <= 2000
    assert np.isfinite(omega).all()
    assert omega[0] > 0.0
    assert (np.diff(omega) > 0.0).all()


def test_sharp_resonance_is_met_by_the_default_grid() -> None:
    """A damping ratio of 1e-4: the grid has points within a bandwidth of the peak."""
    data = descriptor_response(mechss([[1]], [[2e-4]], [[1]]))
    assert np.abs(data.frdata).max() > 0.99 / 2e-4


def test_default_grid_of_an_undamped_model_gives_no_warning() -> None:
    """Poles on the axis are met by the grid or not, without a warning, which would fail as any does."""
    descriptor_response(mechss(np.eye(2), None, np.diag([1.0, 4.0])))
    frequency_response(mechss(np.eye(2), None, np.diag([1.0, 4.0])))


@pytest.mark.parametrize("omega", [[], [-1.0], [np.nan], [np.inf], [[1.0, 2.0]], [1.0, -1e-9]])
@pytest.mark.parametrize("compute", [frequency_response, descriptor_response])
def test_bad_frequencies_are_refused(compute: object, omega: npt.ArrayLike) -> None:
    """None, negative, not finite, or a matrix."""
    with pytest.raises(ParameterError, match="omega must be a list of one or more finite frequencies") as refusal:
        compute(hydromount(), omega)  # type: ignore[operator]
    assert refusal.value.parameter == "omega"


@pytest.mark.parametrize("omega", ["fast", [1j], [[1.0], [2.0, 3.0]], ["1", "x"], {"a": 1}])
def test_frequencies_that_are_no_numbers_are_refused(omega: object) -> None:
    """Text and complex frequencies."""
    with pytest.raises(ParameterError, match="omega must be real numbers"):
        checked_frequencies(omega)  # type: ignore[arg-type]


@pytest.mark.parametrize("compute", [frequency_response, descriptor_response])
def test_singular_pencil_is_refused_by_name(compute: object) -> None:
    """Nothing to evaluate where a node floats."""
    with pytest.raises(SingularPencilError, match="DOF q1 can move"):
        compute(mechss(np.diag([1, 0]), None, np.diag([1, 0])), [1.0])  # type: ignore[operator]


def test_system_without_states_is_its_direct_term() -> None:
    """Springs alone."""
    data = frequency_response(mech2ss(None, None, np.diag([4.0, 2.0])), [0.0, 1e3])
    assert_allclose(data.frdata[:, :, 1], np.diag([0.25, 0.5]), rtol=ROUNDOFF)
