"""Energy coordinates turned to modes."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from halfdof_ctrl import SecondOrderModel, hydromount, mech2ss, mechss
from halfdof_ctrl.reduction.energy.form import energy_form
from halfdof_ctrl.reduction.energy.modal import modal_form
from support.beams import FIRST_MODES, ball_transfer, beam_matrices, cantilever

EVALUATED = 1e-10  #: relative, by `sys(s)` of python-control, as in energy coordinates
ROUNDING = 1e-12  #: relative, of small models


def test_modal_damping_gives_blocks_of_two() -> None:
    """C = 0.2 M: [[0, w], [-w, -0.2]] for each mode and nothing else, frequencies rising."""
    A = mech2ss(cantilever(5), states="modal").A
    for k in range(10):
        block = A[2 * k : 2 * k + 2, 2 * k : 2 * k + 2]
        assert_allclose(block, [[0, block[0, 1]], [-block[0, 1], -0.2]], rtol=1e-9, atol=1e-9)
        A[2 * k : 2 * k + 2, 2 * k : 2 * k + 2] = 0.0
    assert_allclose(A, 0.0, rtol=0, atol=1e-9)


def test_response_of_a_beam_keeps_its_digits() -> None:
    """Against ball arithmetic at the first four resonances of 20 elements."""
    s = 1j * np.array(FIRST_MODES)
    assert_allclose(mech2ss(cantilever(20), states="modal")(s), ball_transfer(cantilever(20), s), rtol=EVALUATED)


@pytest.mark.parametrize(
    "model",
    [
        hydromount(),
        mechss(*beam_matrices(4, clamped=False)[:1], None, beam_matrices(4, clamped=False)[1]),
        mechss(np.diag([2.0, 0]), [[3, -3], [-3, 3]], np.diag([5.0, 0])),
        mechss(None, [[2]], [[3]]),
    ],
    ids=["half DOFs", "free beam", "node on a damper", "no mass"],
)
def test_turning_keeps_the_transfer_function_and_the_free_motions(model: SecondOrderModel) -> None:
    """The same response at a point off the poles; as many states of free motions with columns of zeros."""
    form = energy_form(model)
    turned = modal_form(form)
    s = 0.7 + 2.3j
    values = [
        f.output.X @ np.linalg.solve(s * np.eye(len(f.A)) - f.A, f.B) + f.output.direct(f.B.shape[1])
        for f in (form, turned)
    ]
    assert_allclose(values[1], values[0], rtol=ROUNDING, atol=ROUNDING * np.abs(values[0]).max())
    assert_array_equal(turned.A[:, : form.n_rigid], 0.0)
    assert_allclose(turned.T @ turned.T_inverse, np.eye(len(form.A)), rtol=0, atol=1e-10)
    assert len(set(turned.states)) == len(turned.states)
