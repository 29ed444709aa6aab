"""The cross-check of large sparse models: it passes what is right, fails what is wrong, and says what it leaves out."""

from typing import Any

import control
import numpy as np
import pytest
from scipy.sparse import csc_array, diags_array

from halfdof_ctrl import SecondOrderModel, crosscheck, mech2ss, mechss
from halfdof_ctrl.errors import ModelSizeError

LARGE = 2100  # DOFs: more than are copied into dense matrices


def chain(n: int, masses: int) -> SecondOrderModel:
    """Join n points by springs; some have a mass, some others a damper to the ground."""
    generator = np.random.default_rng(0)
    k = generator.uniform(1.0, 10.0, n + 1) * 1e3
    diagonals: Any = [k[:-1] + k[1:], -k[1:-1], -k[1:-1]]
    K = csc_array(diags_array(diagonals, offsets=[0, 1, -1]))
    m, c, b = np.zeros(n), np.zeros(n), np.zeros(n)
    m[np.linspace(5, n - 5, masses).astype(int)] = generator.uniform(1.0, 2.0, masses)
    c[:: n // 7] = generator.uniform(1.0, 2.0, c[:: n // 7].size)
    b[n // 3] = 1.0
    return mechss(csc_array(diags_array(m)), csc_array(diags_array(c)), K, b, b)


def test_a_large_model_passes_and_says_what_was_not_checked() -> None:
    """Transfer function and poles are compared; count and time are named as left out."""
    model = chain(LARGE, 8)
    check = crosscheck(model, mech2ss(model))
    assert check.passed
    assert check.n_finite == -1
    text = repr(check)
    assert "Not checked: the number of finite eigenvalues, 2100 DOFs" in text
    assert "not counted" in text
    assert max(len(line) for line in text.splitlines()[:-2]) < 80


@pytest.mark.parametrize("letter", ["A", "B", "C"])
def test_a_wrong_system_of_a_large_model_fails(letter: str) -> None:
    """The largest entry off by 1e-5."""
    model = chain(LARGE, 8)
    sys = mech2ss(model)
    matrices = {name: np.array(getattr(sys, name)) for name in "ABCD"}
    place = np.unravel_index(np.argmax(np.abs(matrices[letter])), matrices[letter].shape)
    matrices[letter][place] *= 1.0 + 1e-5
    assert not crosscheck(model, control.ss(*matrices.values())).passed


def test_too_many_states_are_refused_without_advice_to_believe_another_curve() -> None:
    """The state space itself would take dense factorizations at every frequency."""
    model = chain(LARGE, 8)
    N = 2600
    sys = control.StateSpace(-np.eye(N), np.ones((N, 1)), np.ones((1, N)), [[0.0]], remove_useless_states=False)
    with pytest.raises(ModelSizeError, match="Nothing is said about it") as refusal:
        crosscheck(model, sys)
    assert (refusal.value.size, refusal.value.limit) == (N, 2500)
