"""Modal damping against the modes of small models."""

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse as sp
from numpy.testing import assert_allclose, assert_array_equal

import halfdof_ctrl as hd
from halfdof_ctrl.base.errors import (
    ComplexModelError,
    MatrixError,
    ModelSizeError,
    ParameterError,
    SingularPencilError,
)

EIGEN = 1e-10


def chain(n: int = 6) -> tuple[np.ndarray, np.ndarray]:
    """Masses and springs."""
    K = 1e3 * (2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    return np.diag(np.arange(1.0, n + 1)), K


def test_every_mode_has_half_the_loss_factor_as_damping_ratio() -> None:
    """Poles ``-zeta w ± j w sqrt(1 - zeta^2)`` with zeta = eta / 2, and no state more."""
    M, K = chain()
    sys = hd.mech2ss(hd.with_modal_damping(hd.mechss(M, None, K), 0.08))
    poles = sys.poles()
    assert poles.size == 12
    assert_allclose(-poles.real / np.abs(poles), 0.04, rtol=EIGEN)
    omega = np.sqrt(scipy.linalg.eigh(K, M, eigvals_only=True))
    assert_allclose(np.sort(np.abs(poles))[::2], omega, rtol=EIGEN)


def test_massless_dofs_stay_static() -> None:
    """A node without mass gets no damper, and the count of states stays."""
    M, K = chain()
    M[2, 2] = 0.0
    damped = hd.with_modal_damping(hd.mechss(M, None, K), 0.1)
    assert_array_equal(damped.C[2], np.zeros(6))
    poles = hd.mech2ss(damped).poles()
    assert poles.size == 10
    assert_allclose(-poles.real / np.abs(poles), 0.05, rtol=EIGEN)


def test_rigid_motion_is_not_damped() -> None:
    """A free chain: two poles at zero, since no spring is strained."""
    M, K = chain(3)
    K[0, 0] = K[-1, -1] = 1e3
    damped = hd.with_modal_damping(hd.mechss(M, None, K), 0.1)
    assert_allclose(damped.C @ np.ones(3), 0.0, atol=1e-9)


def test_imaginary_part_of_stiffness_says_what_each_mode_loses() -> None:
    """``zeta_r = phi^T K'' phi / (2 w^2)``; for K'' = eta K the same as one loss factor."""
    M, K = chain()
    uniform = hd.with_modal_damping(hd.mechss(M, None, K), 0.1)
    same = hd.with_modal_damping(hd.mechss(M, None, K * (1 + 0.1j)))
    assert_allclose(same.C, uniform.C, atol=EIGEN * np.abs(uniform.C).max())
    assert not same.is_complex


def test_what_has_no_modal_damping_is_refused() -> None:
    """By its cause."""
    M, K = chain(2)
    with pytest.raises(ComplexModelError, match="Either K has imaginary parts or a loss factor is given"):
        hd.with_modal_damping(hd.mechss(M, None, K))
    with pytest.raises(ComplexModelError, match="C has imaginary parts"):
        hd.with_modal_damping(hd.mechss(M, 1j * M, K), 0.1)
    with pytest.raises(ModelSizeError, match="truncate_modes"):
        hd.with_modal_damping(hd.mechss(sp.csc_array(M), None, K), 0.1)
    with pytest.raises(ParameterError, match=r"loss_factor = -0\.1"):
        hd.with_modal_damping(hd.mechss(M, None, K), -0.1)
    with pytest.raises(ParameterError, match="drives the mode at"):
        hd.with_modal_damping(hd.mechss(M, None, K * (1 - 0.1j)))
    with pytest.raises(MatrixError, match="K is not symmetric"):
        hd.with_modal_damping(hd.mechss(M, None, np.triu(K)), 0.1)
    with pytest.raises(SingularPencilError, match="DOFs q1 move together without mass and without stiffness"):
        hd.with_modal_damping(hd.mechss(np.diag([1.0, 0]), None, np.diag([1.0, 0])), 0.1)
