"""The cases of a sweep, listed from what was asked for."""

from collections.abc import Mapping
from itertools import product
from typing import Any

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given
from numpy.testing import assert_array_equal

from halfdof_ctrl import hydromount, sweep
from halfdof_ctrl.base.errors import FailedCasesWarning, ParameterError, SignalNameError
from halfdof_ctrl.sweeps.cases import Parameters, in_words, listed_cases, require_accepted

LISTS = st.dictionaries(
    st.sampled_from("abcd"), st.lists(st.integers(-9, 9), min_size=1, max_size=4), min_size=1, max_size=3
)


def test_a_mapping_of_lists_is_the_grid_of_all_combinations() -> None:
    """Two values by three are six cases, the last parameter running fastest."""
    cases = listed_cases({"a": [1, 2], "b": [0.5, 1.5, 2.5]})
    assert (cases.shape, len(cases)) == ((2, 3), 6)
    assert [cases.arguments(number) for number in (0, 1, 3)] == [
        {"a": 1, "b": 0.5},
        {"a": 1, "b": 1.5},
        {"a": 2, "b": 0.5},
    ]
    assert_array_equal(cases.parameters["b"], [[0.5, 1.5, 2.5], [0.5, 1.5, 2.5]])


@given(lists=LISTS)
def test_cases_of_a_grid_are_those_of_itertools_product(lists: dict[str, list[int]]) -> None:
    """Case by case, with the number of a case as the position in the product."""
    cases = listed_cases(lists)
    expected = [dict(zip(lists, values, strict=True)) for values in product(*lists.values())]
    assert [cases.arguments(number) for number in range(len(cases))] == expected


@given(lists=LISTS)
def test_a_list_of_mappings_and_paired_lists_are_the_same_cases(lists: dict[str, list[int]]) -> None:
    """Columns or rows of the same table, cut to the shortest column."""
    shortest = min(map(len, lists.values()))
    columns = {name: values[:shortest] for name, values in lists.items()}
    rows = [{name: values[place] for name, values in columns.items()} for place in range(shortest)]
    paired, listed = listed_cases(columns, paired=True), listed_cases(rows)
    assert list(paired.axes) == list(listed.axes) == ["case"]
    assert [paired.arguments(k) for k in range(shortest)] == [listed.arguments(k) for k in range(shortest)] == rows


def test_a_single_value_is_the_same_for_all_cases() -> None:
    """A number, a text, a 0D array, None or a mapping makes no axis."""
    fixed: dict[str, Any] = {"m": 20, "kind": "soft", "k": np.array(3.0), "none": None, "weights": {"y": 1.0}}
    cases = listed_cases({"C_h": range(2), **fixed})
    assert list(cases.axes) == ["C_h"]
    assert cases.arguments(1) == fixed | {"C_h": 1}
    assert cases.varied(1) == {"C_h": 1}


def test_values_may_be_anything() -> None:
    """Texts and lists reach the function as they are."""
    cases = listed_cases({"kind": ["soft", "hard"], "layers": [[1, 2], [3, 4]]})
    assert cases.arguments(1) == {"kind": "soft", "layers": [3, 4]}


def test_no_parameters_are_one_case() -> None:
    """An array of shape () has one entry."""
    cases = listed_cases(None)
    assert (cases.shape, len(cases), cases.arguments(0)) == ((), 1, {})


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"C_h": []}, "C_h has no values"),
        ({"C_h": {100.0, 300.0}}, "given as a set, which has no order"),
        ({"C h": [1]}, "'C h' cannot be a parameter"),
        ([{3: 1}], "3 cannot be a parameter"),
        ([], "parameters must be a mapping .* not list"),
        ("C_h", "parameters must be a mapping .* not str"),
        (7, "parameters must be a mapping .* not int"),
        ([{"a": 1}, 7], "parameters must be a mapping"),
        ([{"a": 1}, {"a": 2, "b": 3}], "Cases 0 and 1 must have the same parameters, but only one has b"),
    ],
)
def test_parameters_without_a_meaning_are_refused(parameters: Any, message: str) -> None:  # noqa: ANN401
    """The message says what is missing."""
    with pytest.raises(ParameterError, match=message):
        listed_cases(parameters)


@pytest.mark.parametrize(
    ("parameters", "message"),
    [({"a": [1, 2], "b": [1, 2, 3]}, "a has 2, b has 3"), ({"a": 1}, "but there is none")],
)
def test_paired_lists_must_be_of_one_length(parameters: Mapping[str, object], message: str) -> None:
    """The lengths are named."""
    with pytest.raises(ParameterError, match=message):
        listed_cases(parameters, paired=True)


@pytest.mark.parametrize(("parameters", "wrong"), [({"C_x": [1]}, "C_x"), ({"C_h": [1], "q": 7}, "q")])
def test_a_parameter_that_the_function_does_not_take_is_refused(parameters: Parameters, wrong: str) -> None:
    """Before anything is run, with those that it takes."""
    with pytest.raises(ParameterError, match=r"hydromount cannot be called .* It takes m, K_r, K_rs") as refusal:
        require_accepted(hydromount, listed_cases(parameters))
    assert refusal.value.parameter == wrong


def test_a_parameter_that_the_function_needs_is_missed() -> None:
    """One without a default."""

    def needy(*, a: float, b: float) -> float:
        return a + b

    with pytest.raises(ParameterError, match="missing a required argument: 'b'") as refusal:
        require_accepted(needy, listed_cases({"a": [1]}))
    assert refusal.value.parameter == "b"


def test_a_function_that_does_not_tell_its_arguments_is_trusted() -> None:
    """Some of compiled modules have no signature."""

    class Silent:
        __signature__ = "none"

        def __call__(self) -> None:
            """Do nothing."""

    require_accepted(Silent(), listed_cases({"whatever": [1]}))


def test_parameters_in_words() -> None:
    """Numbers have four digits."""
    assert in_words({"C_h": 1 / 3, "n": 123456, "kind": "soft"}) == "C_h = 0.3333, n = 123456, kind = soft"


class UnreadableError(Exception):
    """An exception whose words cannot be read."""

    def __str__(self) -> str:
        """Fail."""
        msg = "no words"
        raise RuntimeError(msg)


def unreadable_at_two(x: float) -> float:
    """Fail at x = 2."""
    if x == 2.0:
        raise UnreadableError
    return x


@pytest.mark.parametrize("workers", [None, 2])
def test_an_exception_without_words_loses_one_case(workers: int | None) -> None:
    """Its own, of three."""
    with pytest.warns(FailedCasesWarning):
        result = sweep(unreadable_at_two, {"x": [1.0, 2.0, 3.0]}, workers=workers, progress=False)
    (failure,) = result.failures
    assert "UnreadableError: its words cannot be read" in str(failure)
    assert_array_equal(np.asarray(result.values), [1.0, np.nan, 3.0])


@pytest.mark.parametrize("names", [{"inputs": "nope"}, {"outputs": ["nope"]}])
def test_an_unknown_signal_is_refused_before_the_sweep(names: dict[str, Any]) -> None:
    """By the system of the first case."""
    with pytest.raises(SignalNameError, match="nope"):
        sweep(hydromount, {"C_h": [100.0, 300.0]}, omega=[1.0], **names)
