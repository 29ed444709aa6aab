"""Every public function refuses what it cannot use by an error of this package that says what to pass."""

import inspect
import pickle
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import control
import matplotlib.pyplot as plt
import numpy as np
import pytest
from scipy.sparse import csr_array

import halfdof_ctrl as hd
from support.wrong_objects import DOORS, doors, wrong_objects

#: results and models, which functions make; none is called by a user
MADE_BY_FUNCTIONS = {
    "CrossCheck",
    "DescriptorForm",
    "DescriptorSystem",
    "ExactReduction",
    "HalfdofError",
    "MaxwellDampedModel",
    "NonlinearModel",
    "PencilStructure",
    "PortHamiltonian",
    "PronyFit",
    "SecondOrderModel",
    "StateFeedback",
    "StateMap",
    "SweepFailure",
    "SweepResult",
    "TruncatedModel",
}

Table = dict[str, tuple[Callable[..., object], dict[str, object]]]


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory) -> Table:
    """Make the functions and their arguments once."""
    return doors(tmp_path_factory.mktemp("doors"))


@pytest.mark.parametrize("door", DOORS)
def test_no_wrong_object_ends_in_an_error_without_a_name(
    door: str, table: Table, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each argument in turn is each wrong object; no answer is a `HalfdofError`, or a missing file's OSError."""
    monkeypatch.chdir(tmp_path)
    function, right = table[door]
    raw = []
    wrongs = wrong_objects()
    for argument in right:
        for what, wrong in wrongs.items():
            try:
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore")
                    function(**{**right, argument: wrong})
            except hd.HalfdofError:
                pass
            except FileNotFoundError:
                if argument != "path":
                    raise
            except Exception as error:  # noqa: BLE001  # the very thing that is looked for
                raw.append(f"{argument} = {what}: {type(error).__name__}: {error}")
        plt.close("all")
    assert not raw


def test_doors_are_called_by_arguments_that_they_have(table: Table) -> None:
    """A wrong name of an argument would be refused by Python, and nothing would be tested."""
    assert set(table) == set(DOORS)
    for function, right in table.values():
        assert set(right) <= set(inspect.signature(function).parameters)


def test_every_public_function_is_in_the_table(table: Table) -> None:
    """What is not is a class whose objects this package makes, or the base of the errors."""
    missing = {name for name in hd.__all__ if name not in table}
    assert missing == MADE_BY_FUNCTIONS


@pytest.mark.parametrize("name", ["zeros", "pencil_structure", "exact_reduction", "port_hamiltonian", "lqr"])
def test_a_state_space_in_place_of_a_model_is_named(name: str) -> None:
    """The message says what the function takes, and what this is."""
    sys = hd.mech2ss(hd.hydromount())
    with pytest.raises(TypeError, match=f"{name} takes a model of mechss; this is a control.StateSpace"):
        getattr(hd, name)(sys)


def test_crosscheck_with_its_arguments_swapped_is_refused() -> None:
    """The model comes first."""
    model = hd.hydromount()
    with pytest.raises(hd.HalfdofError, match="crosscheck takes a model of mechss"):
        hd.crosscheck(hd.mech2ss(model), model)


def test_a_model_called_as_an_update_function_points_to_mech2ss() -> None:
    """`control.ss(model)` takes the model for a function of time, state, input and parameters."""
    update: Any = hd.hydromount()
    with pytest.raises(hd.HalfdofError, match=r"use hd\.mech2ss"):
        update(0.0, np.zeros(4), np.zeros(3), {})


def test_node_numbers_are_names_and_a_set_is_none() -> None:
    """Whole numbers in a list are read as text; the order of a set changes from run to run."""
    numbers: Any = [101, 102]
    unordered: Any = {"a", "b"}
    single: Any = 5
    assert hd.mechss(np.eye(2), None, np.eye(2), dofs=numbers).dofs == ("101", "102")
    with pytest.raises(hd.HalfdofError, match="order changes from run to run"):
        hd.mechss(np.eye(2), None, np.eye(2), dofs=unordered)
    with pytest.raises(hd.HalfdofError, match="list of texts, not the number 5"):
        hd.mechss(np.eye(1), None, np.eye(1), dofs=single)


def test_an_unknown_name_is_answered_by_the_nearest_in_a_model_of_any_size() -> None:
    """The first names of a long list would not show it."""
    model = hd.mechss(np.eye(60), None, np.eye(60), dofs=[f"node_{i}" for i in range(60)])
    with pytest.raises(hd.HalfdofError, match=r"Nearest: .*node_57"):
        model.select(outputs="nod_57")


def test_a_feedback_comes_back_from_its_pickle() -> None:
    """Gain and closed loop, with their labels."""
    feedback = hd.lqr(hd.hydromount().select("F_y", "y"), displacement={"y": 1.0}, effort={"F_y": 1.0})
    again = pickle.loads(pickle.dumps(feedback))  # noqa: S301  # of our own making
    np.testing.assert_array_equal(again.K, feedback.K)
    assert isinstance(again.closed_loop, control.StateSpace)
    assert again.closed_loop.state_labels == feedback.closed_loop.state_labels


@pytest.mark.parametrize("folder", [3, None, "\ud800", "a\0b", "/"])
def test_a_folder_that_is_none_is_refused_before_anything_is_computed(folder: Any) -> None:  # noqa: ANN401
    """By its name, and not by what `pathlib` says."""
    with pytest.raises(
        hd.HalfdofError, match=r"^write_report (takes the path of a folder|is .*no file system)|^/: .*Choose another"
    ):
        hd.write_report(hd.hydromount(), folder)


@pytest.mark.parametrize("projection", ["polar", "removed"])
def test_axes_that_cannot_take_a_plot_are_refused(projection: str) -> None:
    """Round ones, and some that have left their figure."""
    axes = plt.figure().add_subplot(projection="polar" if projection == "polar" else None)
    if projection == "removed":
        axes.remove()
    with pytest.raises(hd.HalfdofError, match="straight x and y axes that are still in a figure"):
        hd.pole_map_plot(hd.hydromount(), ax=axes)
    plt.close("all")


def test_messages_hold_no_addresses() -> None:
    """An object without a text of its own is shown by its kind; where it lies changes from run to run."""
    wrong: Any = lambda *_: None  # noqa: E731  # any object of this kind
    with pytest.raises(hd.HalfdofError, match="function") as refusal:
        hd.hydromount(m=wrong)
    assert " at 0x" not in str(refusal.value)


@pytest.mark.parametrize("given", [{"y": np.inf}, [np.inf, 0.0, 0.0]])
def test_an_infinite_initial_value_is_refused(given: Any) -> None:  # noqa: ANN401
    """NaN leaves a value open, and Inf says nothing."""
    with pytest.raises(hd.HalfdofError, match="displacement is infinite at y"):
        hd.exact_reduction(hd.hydromount()).state(given)


def test_nothing_but_refusals_warns(table: Table) -> None:
    """Complex numbers are not cut down to real ones, with a warning of NumPy's, where real ones are asked for."""
    complex_numbers = np.array([1.0 + 1.0j, 2.0, 3.0])
    for door, argument in (("equilibrium", "inputs"), ("slope of a table", "x"), ("fit_prony", "frequency")):
        function, right = table[door]
        with pytest.raises(hd.HalfdofError):
            function(**{**right, argument: complex_numbers})
    with pytest.raises(hd.HalfdofError):
        hd.Law(np.sin, bounds=complex_numbers[:2])  # type: ignore[arg-type]


def test_a_motion_beyond_the_largest_number_is_refused_where_it_begins() -> None:
    """``exp(1000 t)`` is beyond 1.8e308 from t = 0.71 on."""
    unstable = hd.mechss([[1.0]], None, [[-1e6]])
    said = r"beyond the largest number from t = 0\.7\d* s on: the model is unstable"
    with pytest.raises(hd.HalfdofError, match=said):
        hd.forced_response(unstable, np.linspace(0.0, 2.0, 201), 1.0)
    with pytest.raises(hd.HalfdofError, match=said):
        hd.initial_response(unstable, np.linspace(0.0, 2.0, 201), displacement={"q0": 1.0})


def test_modes_of_what_is_not_semidefinite_are_no_numpy_error() -> None:
    """A spring of -4 N/m under 1 kg falls over at exp(2 t) and swings at no frequency."""
    small = hd.truncate_modes(hd.mechss([[1.0]], None, [[-4.0]]), n_modes=1)
    np.testing.assert_allclose(small(1j), -1.0 / 5.0, rtol=1e-14)


def test_the_stiffness_of_a_sparse_model_of_one_dof_needs_no_solve() -> None:
    """2 N/m and 1 kg: ``2 - w^2`` at the DOF that is moved."""
    one = csr_array(np.ones((1, 1)))
    found = hd.dynamic_stiffness_response(hd.mechss(one, None, 2.0 * one), "q0", [1.0, 2.0])
    np.testing.assert_allclose(found.complex.reshape(-1), [1.0, -2.0], rtol=1e-14)
