"""Time responses as data, against closed forms, and every DOF recovered from them."""

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from halfdof_ctrl import (
    exact_reduction,
    forced_response,
    frequency_response,
    hydromount,
    initial_response,
    load_response,
    mechss,
    save_response,
    step_plot,
    step_response,
)
from halfdof_ctrl.base.errors import FileFormatError, InconsistentStateError, ParameterError, SignalNameError

CLOSED_FORM = 1e-9


def oscillator() -> object:
    """Give 1 kg on 4 N/m."""
    return mechss([[1.0]], None, [[4.0]], dofs="y")


def test_a_step_on_an_oscillator_is_a_cosine() -> None:
    """(1 - cos 2 t) / 4."""
    response = step_response(oscillator(), np.linspace(0.0, 3.0, 61))  # type: ignore[arg-type]
    assert_allclose(response.outputs, (1.0 - np.cos(2.0 * response.time)) / 4.0, atol=CLOSED_FORM)
    assert response.state_labels == ["y", "y_dot"]


def test_initial_velocity_makes_a_sine() -> None:
    """v0 sin(2 t) / 2 from mass, spring, and a given velocity; horizon of twenty periods."""
    response = initial_response(oscillator(), velocity={"y": 3.0})  # type: ignore[arg-type]
    assert_allclose(response.outputs, 1.5 * np.sin(2.0 * response.time), atol=1e-8)
    assert response.time[-1] == pytest.approx(20.0 * np.pi)


def test_forced_response_takes_inputs_by_name() -> None:
    """A ramp of 2 N/s on a free mass of 1 kg moves it by t^3 / 3."""
    model = mechss([[1.0]], None, None, dofs="y")
    time = np.linspace(0.0, 2.0, 21)
    for inputs in ({"F_y": 2.0 * time}, 2.0 * time, (2.0 * time)[None]):
        assert_allclose(forced_response(model, time, inputs).outputs, time**3 / 3.0, atol=CLOSED_FORM)


def test_every_dof_is_recovered_from_a_response() -> None:
    """Displacements of half DOFs obey the equations without inertia: C_rs (y1' - y') + K_rs (...) = 0 and so on."""
    model = hydromount().select("F_y", "y")
    for response in (step_response(model), initial_response(model, displacement={"y": 0.01, "y2": 0.002})):
        motion = exact_reduction(model).recover(response)
        q, v = (part.reshape(3, -1) for part in (motion.displacement, motion.velocity))
        rest = (model.C @ v + model.K @ q)[1:]
        assert_allclose(rest, 0.0, atol=1e-9 * np.abs(model.K @ q).max())


def test_the_plot_draws_the_response() -> None:
    """Times and values of the curve are those of the data."""
    model = hydromount().select("F_y", "y")
    response, line = step_response(model), step_plot(model).lines[0, 0][0]
    assert_allclose(line.get_xdata(), response.time, rtol=0.0)
    assert_allclose(line.get_ydata(), response.outputs.ravel(), rtol=0.0)


def test_what_cannot_be_is_refused() -> None:
    """Unknown inputs, shapes that do not fit, times that are not even, motions that contradict equations."""
    model, time = hydromount().select("F_y", "y"), np.linspace(0.0, 1.0, 11)
    with pytest.raises(SignalNameError, match="no input 'F_z'"):
        forced_response(model, time, {"F_z": time})
    with pytest.raises(ParameterError, match="histories of 1 inputs at 11 times"):
        forced_response(model, time, np.ones((3, 11)))
    with pytest.raises(ParameterError, match="finite numbers at all times"):
        forced_response(model, time, time * np.nan)
    with pytest.raises(ParameterError, match="rising, equidistant times"):
        step_response(model, [0.0, 1.0, 3.0])
    with pytest.raises(ParameterError, match="not a single one"):
        forced_response(model, 1.0, 1.0)
    with pytest.raises(InconsistentStateError):
        initial_response(mechss([[1, 0], [0, 0]], None, [[2, -1], [-1, 1]]), displacement=[1.0, 5.0])


def test_tables_come_back_to_the_last_bit(tmp_path: Path) -> None:
    """Frequency responses and time responses of several channels, with names that hold slashes and full stops."""
    model = mechss(np.eye(2), 0.1 * np.eye(2), [[2, -1], [-1, 2]], dofs=["101.1", "a/b"])
    path = tmp_path / "table.csv"
    data = frequency_response(model, [0.5, 1.0, 2.0])
    save_response(data, path)
    back = load_response(path)
    assert (back.output_labels, back.input_labels) == (data.output_labels, data.input_labels)
    assert (np.asarray(back.frdata) == np.asarray(data.frdata)).all()
    response = step_response(model)
    save_response(response, path)
    back = load_response(path)
    assert back.output_labels == response.output_labels
    assert (back.y == response.y).all()
    assert (back.time == response.time).all()
    save_response(initial_response(model, displacement=[1.0, 0.0]), path)
    assert load_response(path).output_labels == response.output_labels


@pytest.mark.parametrize(
    ("text", "words", "line"),
    [
        ("a,b\n1,2\n", "no header of a response", 1),
        ("t [s],y\n0,1\n1\n", "1 entries where the header has 2", 3),
        ("t [s],y\n0,x\n", "could not convert", 2),
        ("omega [rad/s],f [Hz],y/F_y real\n1,2,3\n", "the columns are not real, imag", 1),
        ("", "no header", 1),
    ],
)
def test_other_tables_are_refused(tmp_path: Path, text: str, words: str, line: int) -> None:
    """With the line that is wrong."""
    path = tmp_path / "table.csv"
    path.write_text(text)
    with pytest.raises(FileFormatError, match=words) as caught:
        load_response(path)
    assert caught.value.line == line
