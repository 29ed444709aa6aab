"""Maxwell damping against the closed form, the complex model and what it states of itself."""

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.testing import assert_allclose

import halfdof_ctrl as hd
from halfdof_ctrl.base.errors import ComplexModelError, MatrixError, ModelSizeError, ParameterError
from halfdof_ctrl.parts.loss_branches import constant_loss

STATED = 0.01  #: stated errors against measured ones
AT_REFERENCE = 1e-12
ZOLOTAREV = {(2, 1): 1.9e-2, (3, 1): 1.3e-3, (2, 2): 0.15, (3, 2): 2.9e-2, (4, 2): 5.5e-3, (5, 3): 1.0e-2}
TABLE = 0.05  #: the table has two digits
SAMPLED = 1e-3  #: extrema from samples of a band


def chain(n: int = 5) -> hd.SecondOrderModel:
    """Masses on springs, stiff enough to resonate in the band."""
    K = 1e4 * (2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    return hd.mechss(np.diag(np.arange(1.0, n + 1)), None, K)


def stiffness(model: hd.SecondOrderModel, M: np.ndarray, f: float) -> np.ndarray:
    """``H^-1 + w^2 M`` of the DOFs with a force: the complex stiffness that the model has at a frequency."""
    w = 2 * np.pi * f
    return np.asarray(np.linalg.inv(model(1j * w)) + w**2 * M)


@pytest.mark.parametrize(("count", "decades"), ZOLOTAREV)
def test_branches_have_the_error_of_the_closed_form(count: int, decades: int) -> None:
    """The error of Zolotarev's approximation, over one to three decades, alternating at its 2 N + 1 extrema."""
    f = np.geomspace(2.0, 2.0 * 10.0**decades, 20001)
    error = constant_loss(count, (f[0], f[-1]))(2 * np.pi * f).imag - 1.0
    assert_allclose(np.abs(error).max(), ZOLOTAREV[count, decades], rtol=TABLE)
    assert_allclose(error.max(), -error.min(), rtol=SAMPLED)


@pytest.mark.parametrize("keep", ["loss", "factor"])
@pytest.mark.parametrize("eta", [0.01, 0.1, 0.3])
def test_stated_errors_are_the_measured_ones(keep: str, eta: float) -> None:
    """Loss and drift over the band, the change at rest, and K at the reference."""
    model = chain()
    band = (1.0, 100.0)
    damped = hd.with_maxwell_damping(model, eta, band=band, branches=3, keep=keep)  # type: ignore[arg-type]
    found = np.array([stiffness(damped, model.M, f)[2, 2] for f in np.geomspace(*band, 801)]) / model.K[2, 2]
    loss = found.imag / found.real if keep == "factor" else found.imag
    assert_allclose(np.abs(loss / eta - 1).max(), damped.loss_error, rtol=STATED)
    assert_allclose(damped.loss_error, constant_error(3), rtol=0.02)
    assert_allclose([found.real.min() - 1, found.real.max() - 1], damped.stiffness_drift, rtol=STATED, atol=1e-9)
    assert_allclose(stiffness(damped, model.M, 1e-6)[2, 2].real / model.K[2, 2] - 1, damped.change_at_rest, rtol=STATED)
    at = stiffness(damped, model.M, damped.reference)
    assert_allclose(at.real, model.K, atol=AT_REFERENCE * 2e4)


def constant_error(count: int) -> float:
    """Return the closed form's error over two decades."""
    omega = 2 * np.pi * np.geomspace(1, 100, 5001)
    return float(np.abs(constant_loss(count, (1.0, 100.0))(omega).imag - 1).max())


@pytest.mark.parametrize("keep", ["loss", "factor"])
def test_damped_model_is_passive_with_a_half_dof_a_branch_and_direction(keep: str) -> None:
    """2 n + N r states, M, C, K symmetric and semidefinite, all poles stable, the check passed."""
    model = chain().select("F_q0", "q4")
    damped = hd.with_maxwell_damping(model, 0.2, band=(2, 50), keep=keep)  # type: ignore[arg-type]
    for matrix in (damped.M, damped.C, damped.K):
        assert_allclose(matrix, matrix.T, rtol=1e-15)
        assert np.linalg.eigvalsh(matrix).min() >= -1e-10 * np.abs(matrix).max()
    sys = hd.mech2ss(damped)
    assert damped.rank == 5
    assert sys.nstates == 2 * 5 + damped.g.size * 5
    assert sys.poles().real.max() < 0
    assert hd.crosscheck(damped, sys).passed


def test_only_directions_that_lose_get_half_dofs() -> None:
    """One lossy spring between two DOFs of five: rank one, and nothing else is touched."""
    model = chain()
    lossy = np.zeros((5, 5))
    lossy[1:3, 1:3] = 500.0 * np.array([[1, -1], [-1, 1]])
    damped = hd.with_maxwell_damping(hd.mechss(model.M, None, model.K + 1j * lossy), band=(1, 100), branches=4)
    assert damped.rank == 1
    assert damped.dofs[5:] == ("loss1_1", "loss2_1", "loss3_1", "loss4_1")
    assert not damped.K[[0, 3, 4], 5:].any()
    at = stiffness(damped, model.M, 30.0)
    assert_allclose(at.imag, lossy, atol=500 * damped.loss_error * 1.001)


def test_complex_stiffness_of_parts_of_rank_two_in_any_units() -> None:
    """Directions are found whatever the units of the DOFs."""
    L = np.array([[1.0, 0.0], [-1.0, 2.0], [0.0, 1.0]])
    lossy = L @ L.T
    units = np.array([1.0, 1e-3, 1e4])
    for T in (np.ones(3), units):
        K = (np.diag([100.0, 200, 300]) + 1j * lossy) * T * T[:, None]
        damped = hd.with_maxwell_damping(hd.mechss(np.diag(T**2), None, K), band=(0.1, 10))
        assert damped.rank == 2
        found = stiffness(damped, np.diag(T**2), 1.0).real / T / T[:, None]
        assert_allclose(found, np.diag([100.0, 200, 300]), atol=1e-8)


def test_loss_that_depends_on_frequency_is_followed() -> None:
    """A function and a table of it."""
    f = np.geomspace(1, 100, 30)
    for eta in (lambda w: 0.1 * (w / 60.0) ** 0.3, (f, 0.1 * (2 * np.pi * f / 60.0) ** 0.3)):
        damped = hd.with_maxwell_damping(chain(), eta, band=(1, 100), tol=0.02)  # type: ignore[arg-type]
        assert damped.loss_error <= 0.02
        at = stiffness(damped, chain().M, 40.0)
        assert_allclose(at.imag, 0.1 * (2 * np.pi * 40 / 60.0) ** 0.3 * chain().K, rtol=0.021, atol=1e-6)


def test_part_is_damped_before_it_is_assembled() -> None:
    """A mount with a loss factor between its ports, without a force when both ends move together."""
    mount = hd.with_maxwell_damping(hd.kelvin_voigt(1e5, 0), 0.15, band=(1, 100))
    assert mount.rank == 1
    car = hd.assemble(
        {"m": hd.point_mass(10), "mount": mount}, joints=[hd.Rigid("m_z", "mount_top")], ground="mount_bottom"
    )
    w = 2 * np.pi * 10.0
    K = 1 / car.select("F_m_z", "m_z")(1j * w) + 10 * w**2
    assert_allclose(K, 1e5 * (1 + 0.15j), rtol=0.002)


def test_sparse_model_is_damped_in_few_directions_only() -> None:
    """Low rank stays sparse; all over is refused with the advice to truncate first, which then works."""
    n = 200
    K = sp.csc_array(sp.diags_array([[-1.0] * (n - 1), [2.0] * n, [-1.0] * (n - 1)], offsets=[-1, 0, 1])) * 1e5
    one = sp.csc_array(([900.0], ([4], [4])), shape=(n, n))
    few = hd.with_maxwell_damping(
        hd.mechss(sp.csc_array(sp.eye_array(n)), None, sp.csc_array(K + 1j * one)), band=(1, 100)
    )
    assert few.is_sparse
    assert few.rank == 1
    whole = hd.mechss(sp.csc_array(sp.eye_array(n)), None, sp.csc_array(K + 0.05j * K.toarray())).select("F_q9", "q9")
    with pytest.raises(ModelSizeError, match="Make the small model first, truncate_modes"):
        hd.with_maxwell_damping(whole, band=(1, 50))
    small = hd.truncate_modes(whole, n_modes=12)
    assert small.is_complex
    s = 2j * np.pi * np.linspace(0.2, small.band[1], 9)
    assert_allclose(small(s), whole(s), atol=2 * small.max_error * np.abs(whole(s)).max())
    assert not hd.with_maxwell_damping(small, band=(1, 50)).is_complex


def test_static_stiffness_that_turns_negative_is_refused() -> None:
    """As 0.43 over two decades, with the way out; and in a direction of a complex K by name."""
    with pytest.raises(ParameterError, match="Pass keep='factor'"):
        hd.with_maxwell_damping(chain(), 0.5, band=(1, 100))
    assert hd.with_maxwell_damping(chain(), 1.0, band=(1, 100), branches=4, keep="factor").change_at_rest > -1
    K = np.diag([100.0, 100.0]) + 1j * np.diag([1.0, 90.0])
    with pytest.raises(ParameterError, match="negative in a motion of q1"):
        hd.with_maxwell_damping(hd.mechss(np.eye(2), None, K), band=(1, 100))


def test_what_cannot_be_damped_is_refused() -> None:
    """By its cause."""
    real, lossy = chain(), hd.mechss(np.eye(2), None, np.array([[2 + 0.1j, 0], [0, 3]]))
    with pytest.raises(ComplexModelError, match="K is real and no loss factor is given"):
        hd.with_maxwell_damping(real, band=(1, 2))
    with pytest.raises(ComplexModelError, match="Leave out one of them"):
        hd.with_maxwell_damping(lossy, 0.1, band=(1, 2))
    with pytest.raises(ComplexModelError, match="C has imaginary parts"):
        hd.with_maxwell_damping(hd.mechss(np.eye(2), 1j * np.eye(2), np.eye(2)), 0.1, band=(1, 2))
    with pytest.raises(ParameterError, match="keep='factor' is for one loss factor"):
        hd.with_maxwell_damping(lossy, band=(1, 2), keep="factor")
    with pytest.raises(ParameterError, match="negative in a motion of q0"):
        hd.with_maxwell_damping(hd.mechss(np.eye(2), None, np.diag([2 - 0.1j, 3 + 1j])), band=(1, 2))
    with pytest.raises(MatrixError, match="K is not symmetric"):
        hd.with_maxwell_damping(hd.mechss(np.eye(2), None, [[2, 1], [0, 2]]), 0.1, band=(1, 2))
    with pytest.raises(ParameterError, match=r"changes as f\^1\.50 at"):
        hd.with_maxwell_damping(real, lambda w: 1e-3 * w**1.5, band=(1, 2))


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"band": (2, 1)}, "the lower one first"),
        ({"band": 3}, "two frequencies"),
        ({"band": (1, 2), "tol": 2}, "tol = 2"),
        ({"band": (1, 2), "branches": 0}, "branches = 0"),
        ({"band": (1, 2), "reference": -1}, "reference = -1 Hz"),
        ({"band": (1, 2), "keep": "both"}, "keep must be one of loss, factor"),
        ({"band": (1, 1e12), "tol": 1e-9}, "12 branches leave a loss error"),
    ],
)
def test_options_out_of_range_are_refused(options: dict[str, object], words: str) -> None:
    """Before anything is computed."""
    with pytest.raises(ParameterError, match=words):
        hd.with_maxwell_damping(chain(), 0.01, **options)  # type: ignore[arg-type]


@pytest.mark.parametrize("eta", [-0.1, ([1.0], [0.1]), ([5.0, 9.0], [0.1, 0.1]), lambda w: -w])
def test_loss_factors_that_are_none_are_refused(eta: object) -> None:
    """Negative, or a table that does not reach over the band."""
    with pytest.raises(ParameterError, match="loss_factor"):
        hd.with_maxwell_damping(chain(), eta, band=(1, 100))  # type: ignore[arg-type]
