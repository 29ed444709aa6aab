"""The descriptor form of a model has its transfer function, and gives a descriptor system back as it was."""

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.testing import assert_allclose, assert_array_equal

import halfdof_ctrl as hd
from halfdof_ctrl.model.descriptor_form import DescriptorForm

SOLVED = 1e-12
S = 0.3 + 2.0j


def transfer(form: DescriptorForm) -> np.ndarray:
    """``C (s E - A)^-1 B + D``."""
    E, A, B, C, D = (X.toarray() if hasattr(X, "toarray") else X for X in form)
    return np.asarray(C @ np.linalg.solve(S * E - A, B) + D)


def some_model() -> hd.SecondOrderModel:
    """Three kinds of DOFs."""
    K = np.array([[5.0, -1, 0], [-1, 6, -2], [0, -2, 7]])
    return hd.mechss(np.diag([2.0, 0, 0]), np.diag([1.0, 3, 0]), K, dofs=["a", "b", "c"])


@pytest.mark.parametrize(
    "model",
    [
        some_model(),
        some_model().select(["F_a", "F_c"], ["a_dot", "b"]),
        some_model().select("F_a", ["a_ddot", "b_dot", "c"]),
        some_model().prescribe_motion("a"),
        some_model().prescribe_motion("a", "acceleration", outputs=["R_a", "b_ddot"]),
        hd.mechss(np.eye(2), None, np.eye(2), Bv=[[1], [0]], Da=[[1], [2]]),
    ],
)
def test_transfer_function_is_that_of_the_model(model: hd.SecondOrderModel) -> None:
    """Displacements, velocities, accelerations, and derivatives of inputs."""
    assert_allclose(
        transfer(model.as_descriptor()), model(S, squeeze=False).reshape(len(model.outputs), -1), rtol=SOLVED
    )


def test_descriptor_system_comes_back_as_it_was() -> None:
    """Without mass and velocities there are no unknowns but the variables."""
    g = np.random.default_rng(1)
    A, E, B, C, D = (g.standard_normal(shape) for shape in ((3, 3), (3, 3), (3, 2), (1, 3), (1, 2)))
    E[:, 1] = 0.0
    form = hd.dss(A, B, C, D, E).as_descriptor()
    for found, desired in zip(form, (E, A, B, C, D), strict=True):
        assert_array_equal(found, desired)


def test_sparse_model_gives_a_sparse_form() -> None:
    """Nothing of n x n entries is formed."""
    model = some_model()
    sparse = hd.mechss(sp.csc_array(model.M), sp.csc_array(model.C), sp.csc_array(model.K))
    form = sparse.as_descriptor()
    assert sp.issparse(form.E)
    assert_allclose(transfer(form), transfer(model.as_descriptor()), rtol=SOLVED)
