"""Sweeps: what they keep, what fails, and what is refused before anything is computed."""

import math
import pickle
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any

import control
import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given
from numpy.testing import assert_allclose, assert_array_equal

from halfdof_ctrl import (
    SecondOrderModel,
    SweepResult,
    frequency_response,
    hydromount,
    lqr,
    mech2ss,
    mechss,
    pencil_structure,
    sweep,
)
from halfdof_ctrl.base.errors import FailedCasesWarning, ParameterError, SignalNameError, SweepInterruptedError
from halfdof_ctrl.base.threads import limited_threads
from halfdof_ctrl.sweeps.one_case import by_size
from support import sweepcases

OMEGA = np.geomspace(1.0, 50.0, 7)
ROUNDING = 1e-14  #: of the eigenvalues of a 2 x 2 matrix
STIFFNESS = st.floats(1e-3, 1e3)


@pytest.fixture(autouse=True, scope="module")
def _one_thread() -> Iterator[None]:
    """Keep the threads of LAPACK, which on a busy machine cost small problems a thousand times their own time."""
    with limited_threads(1):
        yield


def mount_on(C_h: float, K_v: float = 500.0) -> SecondOrderModel:
    """Give the hydromount."""
    return hydromount(C_h=C_h, K_v=K_v)


# --- what a sweep keeps


@given(k=st.lists(STIFFNESS, min_size=1, max_size=3), m=st.lists(STIFFNESS, min_size=1, max_size=2))
def test_poles_of_oscillators_are_the_square_roots(k: list[float], m: list[float]) -> None:
    """``+-j sqrt(k / m)`` on the grid of stiffness and mass, the positive one first."""
    result = sweep(sweepcases.oscillator, {"k": k, "m": m})
    exact = 1j * np.sqrt(np.divide.outer(k, m))
    assert result.shape == (len(k), len(m))
    assert_allclose(np.asarray(result.poles), np.stack([exact, -exact], axis=-1), rtol=ROUNDING)


def test_response_of_a_grid_is_that_of_each_model() -> None:
    """Axes: damping, spring, output, input, frequency; the names and values are kept in order."""
    result = sweep(
        hydromount,
        {"C_h": [100, 300], "K_v": [250.0, 500.0, 1000.0]},
        omega=OMEGA,
        inputs="F_y",
        outputs=["y", "y_dot"],
    )
    assert np.asarray(result.response).shape == (2, 3, 2, 1, 7)
    assert (list(result.axes), result.axes["C_h"].tolist()) == (["C_h", "K_v"], [100, 300])
    assert (result.outputs, result.inputs, result.failures) == (("y", "y_dot"), ("F_y",), ())
    assert_array_equal(np.asarray(result.omega), OMEGA)
    model = hydromount(C_h=300, K_v=250.0).select("F_y", ["y", "y_dot"])
    assert_array_equal(np.asarray(result.response)[1, 0], frequency_response(model, OMEGA).frdata)
    assert_allclose(np.asarray(result.poles)[1, 0], by_size(mech2ss(model).poles()), rtol=1e-12)


def test_a_sample_has_one_axis_and_the_values_of_each_parameter() -> None:
    """Case by case the same as a list of mappings."""
    sample = {"C_h": [100.0, 200.0, 300.0], "K_v": [300.0, 400.0, 500.0]}
    paired = sweep(hydromount, sample, paired=True)
    listed = sweep(hydromount, [{"C_h": c, "K_v": k} for c, k in zip(*sample.values(), strict=True)])
    assert list(paired.axes) == ["case"]
    assert paired.parameters["K_v"].tolist() == sample["K_v"]
    assert_array_equal(np.asarray(paired.poles), np.asarray(listed.poles))
    assert repr(paired) == "SweepResult: 3 cases, case (3)\n  parameters: C_h, K_v\n  poles: 4"


def test_fewer_poles_are_filled_up_with_nan() -> None:
    """Without oil flow the mount has a static DOF and three poles instead of four."""
    poles = np.asarray(sweep(hydromount, {"C_h": [0.0, 300.0]}).poles)
    assert np.isnan(poles[0]).tolist() == [False, False, False, True]
    assert not np.isnan(poles[1]).any()


def test_a_function_of_the_model_gives_the_values() -> None:
    """Static stiffness ``K_r + K_v K_s / (K_v + K_s)`` of the selected receptance, and the poles besides."""
    result = sweep(
        hydromount,
        {"K_v": [500.0, 1000.0]},
        inputs="F_y",
        outputs="y",
        compute=["poles", lambda model: 1.0 / abs(model(0.0))],
    )
    assert_allclose(np.asarray(result.values), [5250.0, 5000.0 + 1000.0 / 3.0], rtol=ROUNDING)
    assert np.asarray(result.poles).shape == (2, 4)
    assert result.response is None


@pytest.mark.parametrize(
    ("function", "expected"),
    [
        (lambda x: x + 1, [2.0, 3.0]),
        (lambda x: [x, 2 * x], [[1.0, 2.0], [2.0, 4.0]]),
        (lambda x: list(range(x)), [[0.0, math.nan], [0.0, 1.0]]),
        (lambda x: 1j * x, [1j, 2j]),
        (lambda x: x > 1, [0.0, 1.0]),
    ],
    ids=["number", "list", "different lengths", "complex", "bool"],
)
def test_a_function_may_give_numbers(function: Any, expected: list[Any]) -> None:  # noqa: ANN401
    """They stand after the axes of the parameters; NaN fills up."""
    result = sweep(function, {"x": [1, 2]})
    assert_array_equal(np.asarray(result.values), expected)
    assert (result.poles, result.response, result.omega, result.outputs) == (None, None, None, ())


def test_compute_takes_what_the_function_gives() -> None:
    """Also where that is no system."""
    assert_array_equal(np.asarray(sweep(lambda x: "a" * x, {"x": [1, 2]}, compute=len).values), [1, 2])


def test_a_state_space_is_as_good_as_a_model() -> None:
    """The closed loops of a regulator over its weight: poles, response of a picked channel, names with full stops."""

    def closed_loop(weight: float) -> control.StateSpace:
        return lqr(hydromount().select("F_y", "y"), displacement={"y": weight}, effort={"F_y": 1e-4}).closed_loop

    result = sweep(closed_loop, {"weight": [1e4, 1e6]}, omega=OMEGA, outputs="y")
    loop = closed_loop(1e6)
    row = loop.output_labels.index("y")
    assert_array_equal(np.asarray(result.response)[1, 0], np.asarray(frequency_response(loop, OMEGA).frdata)[row])
    assert_allclose(np.asarray(result.poles)[1], by_size(loop.poles()), rtol=1e-10)
    assert (result.outputs, result.inputs) == (("y",), tuple(loop.input_labels))
    dotted = sweep(lambda k: mech2ss([[1]], None, [[k]], dofs=["101.1"]), {"k": [1.0, 4.0]})
    assert (dotted.outputs, dotted.inputs) == (("101.1",), ("F_101.1",))


def test_a_sampled_system_is_known_as_one() -> None:
    """Its poles lie in z."""
    result = sweep(lambda k: control.c2d(mech2ss([[1]], [[1]], [[k]]), 0.1), {"k": [1.0, 2.0]})
    assert result.discrete
    assert not sweep(sweepcases.oscillator, {"k": [1.0]}).discrete


def test_models_without_a_state_space_have_poles_and_a_response() -> None:
    """Complex stiffness: those of the descriptor form."""

    def lossy(eta: float) -> SecondOrderModel:
        return mechss([[1]], None, [[100 * (1 + 1j * eta)]])

    result = sweep(lossy, {"eta": [0.1, 0.2]}, omega=OMEGA)
    assert_array_equal(np.asarray(result.poles)[1], by_size(pencil_structure(lossy(0.2)).finite_eigenvalues))
    assert_array_equal(np.asarray(result.response)[1], lossy(0.2)(1j * OMEGA, squeeze=False))


def test_frequencies_of_one_model_are_shared_among_workers() -> None:
    """The same response as in one go, without an axis of parameters."""
    expected = frequency_response(hydromount(), OMEGA).frdata
    with ThreadPoolExecutor(2) as executor:
        results = [sweep(hydromount(), omega=OMEGA), sweep(hydromount(), omega=OMEGA, executor=executor)]
    for result in results:
        assert result.shape == ()
        assert_allclose(np.asarray(result.response), expected, rtol=1e-12)
        assert (result.poles, result.axes, result.parameters, result.outputs) == (None, {}, {}, ("y", "y1", "y2"))
    lone = sweep(hydromount, omega=OMEGA, compute="response")
    assert_array_equal(np.asarray(lone.response), np.asarray(sweep(hydromount(), omega=OMEGA).response))


def test_one_model_without_frequencies_has_poles() -> None:
    """A single case without an axis."""
    result = sweep(hydromount())
    assert repr(result) == "SweepResult: 1 case\n  poles: 4"
    assert np.asarray(result.poles).shape == (4,)


def test_arrays_are_read_only_and_the_result_can_be_stored() -> None:
    """It is pickled as any other data."""
    result = sweep(hydromount, {"C_h": [100, 300]}, omega=OMEGA, inputs="F_y", outputs="y")
    for array in (result.response, result.poles, result.axes["C_h"], result.parameters["C_h"]):
        with pytest.raises(ValueError, match="read-only"):
            np.asarray(array)[...] = 0
    copy: SweepResult = pickle.loads(pickle.dumps(result))  # noqa: S301  # made two words before
    assert_array_equal(np.asarray(copy.response), np.asarray(result.response))
    assert (
        repr(copy)
        == repr(result)
        == ("SweepResult: 2 cases, C_h (2)\n  response: y from F_y, 7 frequencies\n  poles: 4")
    )


# --- what fails


def test_a_case_that_fails_is_named_and_the_others_are_there() -> None:
    """NaN in its place in all arrays, and what the function raised, with its traceback."""
    with pytest.warns(
        FailedCasesWarning, match=r"2 of 6 cases failed, first C_h = -1, K_v = 500: ParameterError: C_h = -1"
    ):
        result = sweep(hydromount, {"C_h": [100, -1, 300], "K_v": [500.0, 600.0]}, omega=OMEGA)
    assert [failure.case for failure in result.failures] == [(1, 0), (1, 1)]
    assert result.failures[1].parameters == {"C_h": -1, "K_v": 600.0}
    assert "in hydromount" in result.failures[0].traceback
    assert str(result.failures[0]).startswith("C_h = -1, K_v = 500: ParameterError: C_h = -1, but a stiffness")
    for array in (np.asarray(result.response), np.asarray(result.poles)):
        assert np.isnan(array[1]).all()
        assert not np.isnan(array[[0, 2]]).any()
    assert repr(result).splitlines()[-1].startswith("  failed: 2, first C_h = -1")


def test_a_case_may_even_leave_the_program() -> None:
    """``sys.exit`` ends the case, not the sweep."""
    with pytest.warns(FailedCasesWarning, match="x = 0: SystemExit: no more"):
        result = sweep(sweepcases.leave, {"x": range(3)})
    assert_array_equal(np.asarray(result.values), [math.nan, 1, 4])


def test_nothing_is_there_where_every_case_failed() -> None:
    """None stands for arrays whose size nobody knows."""
    with pytest.warns(FailedCasesWarning, match="2 of 2 cases failed"):
        result = sweep(hydromount, {"C_h": [-1, -2]}, omega=OMEGA)
    assert (result.response, result.poles, result.values, result.omega) == (None, None, None, None)
    assert len(result.failures) == 2


@pytest.mark.parametrize(
    ("function", "keywords", "message"),
    [
        (lambda x: "text", {}, "The function gave str, but a sweep keeps numbers"),  # noqa: ARG005
        (lambda x: [[1], [1, 2]], {}, "The function gave list, but a sweep keeps numbers"),  # noqa: ARG005
        (lambda x: x, {"omega": OMEGA}, "gave int, which has no poles"),
        (lambda x: x, {"inputs": "F_y"}, "gave int, which has no poles"),
        (lambda x: x, {"compute": "response", "omega": OMEGA}, "gave int, which has no response"),
        (lambda x: mechss([[0, 0], [0, x]], None, np.diag([0, 1])), {}, "SingularPencilError: .* DOF q0"),
    ],
    ids=["text", "ragged", "number", "number with input", "no response", "floating"],
)
def test_results_that_cannot_be_kept_fail_by_name(function: Any, keywords: dict[str, Any], message: str) -> None:  # noqa: ANN401
    """The reason stands in the warning."""
    with pytest.warns(FailedCasesWarning, match=message):
        sweep(function, {"x": [1, 2]}, **keywords)


def test_results_of_another_kind_than_the_first_fail() -> None:
    """Other signals, or a number beside arrays."""
    with pytest.warns(FailedCasesWarning, match="outputs q0, q1 are others than those of the first case, F_q0 and q0"):
        signals = sweep(lambda n: mechss(np.eye(n), None, np.eye(n)), {"n": [1, 2, 1]})
    assert [failure.case for failure in signals.failures] == [(1,)]
    with pytest.warns(FailedCasesWarning, match="gave an array of 1 dimension here, but a number in the first case"):
        values = sweep(lambda n: n if n < 2 else [n], {"n": [1, 2]})
    assert values.failures[0].kind == "ShapeError"
    with pytest.warns(FailedCasesWarning, match="gave a number here, but a system in the first"):
        sweep(lambda k: sweepcases.oscillator(k=k) if k < 2 else k, {"k": [1.0, 2.0]})


def test_a_failure_over_frequencies_names_them() -> None:
    """A model that cannot be computed fails at each."""
    with pytest.warns(FailedCasesWarning, match="7 of 7 frequencies failed, first omega = 1: SingularPencilError"):
        result = sweep(mechss([[0, 0], [0, 1]], None, np.diag([0, 1])), omega=OMEGA)
    assert {failure.case for failure in result.failures} == {()}
    assert result.response is None


def test_ctrl_c_keeps_what_is_done_here() -> None:
    """The exception is a KeyboardInterrupt with the result; what was not done has failed as NotRun."""

    def interrupted(x: int) -> int:
        if x == 3:
            raise KeyboardInterrupt
        return x * x

    with pytest.raises(KeyboardInterrupt, match="interrupted after 3 of 5 cases") as stop:
        sweep(interrupted, {"x": range(5)})
    assert isinstance(stop.value, SweepInterruptedError)
    result: Any = stop.value.result
    assert_array_equal(result.values, [0, 1, 4, math.nan, math.nan])
    assert [str(failure) for failure in result.failures] == [
        f"x = {x}: NotRun: the sweep was interrupted before this case was done" for x in (3, 4)
    ]


def test_a_sweep_shows_how_far_it_is(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """On request also here, where nobody watches."""
    monkeypatch.setattr("halfdof_ctrl.base.progress.DELAY", 0.0)
    sweep(sweepcases.square, {"x": range(5)}, progress=True)
    assert "cases: 100%" in capsys.readouterr().err
    sweep(sweepcases.square, {"x": range(5)})
    assert capsys.readouterr().err == ""


# --- what is refused


@pytest.mark.parametrize(
    ("keywords", "message"),
    [
        ({"compute": "response"}, "frequency response was asked for without frequencies"),
        ({"compute": "zeros"}, "compute = 'zeros', but it must be 'poles', 'response', a function"),
        ({"compute": []}, r"compute = \[\], but"),
        ({"compute": [len, abs]}, "with one function at most"),
        ({"omega": [1.0, -1.0]}, "omega must be a list of one or more finite frequencies"),
        ({"workers": 0}, "workers = 0, but it must be a positive number"),
        ({"workers": 2.0}, "workers = 2.0, but it must be"),
        ({"workers": True}, "workers = True, but it must be"),
        ({"executor": "dask"}, "executor must be a concurrent.futures.Executor, not str; of a Dask client it is"),
    ],
)
def test_requests_without_a_meaning_are_refused(keywords: dict[str, Any], message: str) -> None:
    """Before the function is called once."""

    def never(C_h: float) -> float:
        raise AssertionError(C_h)

    with pytest.raises(ParameterError, match=message):
        sweep(never, {"C_h": [100]}, **keywords)


def test_workers_and_an_executor_are_one_too_many() -> None:
    """An executor brings its own."""
    with ThreadPoolExecutor(1) as executor, pytest.raises(ParameterError, match="Give one of the two"):
        sweep(mount_on, {"C_h": [100]}, executor=executor, workers=2)


def test_a_model_has_no_parameters() -> None:
    """The function that makes it is meant."""
    with pytest.raises(ParameterError, match=r"such as hydromount without \(\)"):
        sweep(hydromount(), {"C_h": [100]})


def test_a_number_is_no_function() -> None:
    """Nor is a matrix."""
    call: Any = sweep
    with pytest.raises(ParameterError, match="function must be a function or a SecondOrderModel, not ndarray"):
        call(np.eye(2), {"C_h": [100]})


def test_a_parameter_that_is_unknown_is_refused_at_once() -> None:
    """Not case by case."""
    with pytest.raises(ParameterError, match="hydromount cannot be called with these parameters"):
        sweep(hydromount, {"C_oil": [100]})


def test_a_partial_function_is_a_function() -> None:
    """Its bound parameters are not varied."""
    result = sweep(partial(mount_on, K_v=250.0), {"C_h": [100.0]})
    assert_array_equal(
        np.asarray(result.poles)[0], np.asarray(sweep(mount_on, {"C_h": 100.0, "K_v": [250.0]}).poles)[0]
    )


def test_a_wrong_signal_is_refused_before_any_case() -> None:
    """Of a model, of the models that a function makes, and of state spaces, which have no other outputs."""
    with pytest.raises(SignalNameError, match="The model has no output 'z'"):
        sweep(hydromount(), omega=OMEGA, outputs="z")
    with pytest.raises(SignalNameError, match="The model has no output 'z'"):
        sweep(lambda x: hydromount(m=x), {"x": [1, 2]}, outputs="z")
    with pytest.raises(SignalNameError, match="The model has no output 'y_ddot'"):
        sweep(lambda x: mech2ss(hydromount(m=x)), {"x": [1, 2]}, outputs="y_ddot")
    with pytest.raises(SignalNameError):
        hydromount().select(outputs="z")
