"""What works on dense matrices takes small sparse models, and refuses large ones in one sentence."""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.sparse import eye_array

from halfdof_ctrl import (
    SecondOrderModel,
    crosscheck,
    lqr,
    mech2ss,
    mechss,
    pencil_structure,
    pole_map_plot,
    write_report,
    zeros,
)
from halfdof_ctrl.base.errors import ModelSizeError
from halfdof_ctrl.report import default_effort
from support.fe_models import spring_grid

WORKS: list[tuple[str, Callable[[SecondOrderModel], Any]]] = [
    ("pencil_structure", pencil_structure),
    ("zeros", zeros),
    ("write_report", lambda model: write_report(model, Path(os.devnull) / "report")),  # where nothing can be written
    ("default_effort", default_effort),
    ("pencil_structure", pole_map_plot),
]


@pytest.mark.parametrize(("name", "work"), WORKS)
def test_large_sparse_models_are_refused_by_name_and_size(name: str, work: Callable[[SecondOrderModel], Any]) -> None:
    """2025 DOFs with mass are above the limit."""
    net = spring_grid(45, 45, 2).model()
    model = mechss(eye_array(2025), net.C, net.K).select("F_q3", "q7")
    with pytest.raises(ModelSizeError, match=f"{name} works on dense matrices, .* this one has 2025 DOFs") as caught:
        work(model)
    assert (caught.value.size, caught.value.limit) == (2025, 2000)


def test_small_sparse_models_give_what_their_dense_copies_give() -> None:
    """A net with three masses and a damper."""
    model = spring_grid(5, 4, 3, dampers=1).model().select("F_q3", "q7")
    dense = model.as_dense()
    assert_allclose(pencil_structure(model).finite_eigenvalues, pencil_structure(dense).finite_eigenvalues)
    assert_allclose(zeros(model), zeros(dense))
    assert crosscheck(model, mech2ss(model)).passed
    assert crosscheck(dense, mech2ss(model)).passed
    gain, expected = (lqr(m, displacement={"q7": 1e6}, effort={"F_q3": 1.0}).K for m in (model, dense))
    assert_allclose(gain, expected, rtol=1e-6, atol=1e-9 * np.abs(expected).max())
    assert default_effort(model) == pytest.approx(default_effort(dense))
