"""Energy coordinates against ball and rational arithmetic."""

import warnings
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from halfdof_ctrl import SecondOrderModel, exact_reduction, hydromount, mech2ss, mechss
from halfdof_ctrl.base.arrays import FloatArray
from halfdof_ctrl.errors import EnergyFormError
from halfdof_ctrl.reduction.energy.form import EnergyForm, energy_form, energy_system
from support.beams import (
    FIRST_MODES,
    ball_transfer,
    beam_matrices,
    cantilever,
    plane_frame,
    stiff_chain,
    zener_cantilever,
)
from support.exact import transfer

CORRECTED = 2e-12  #: relative, by a plain solve at resonances (a square root of what DOF states lose, at 40 elements)
EVALUATED = 1e-10  #: the same by `sys(s)` of python-control
SMALL = 1e-11  #: relative to the channels at both ends of a transfer function, for models of a few DOFs
ROUNDING = 1e-13  #: relative, of models of a few DOFs with stiffness of one size


def plain(form: EnergyForm, s: complex) -> np.ndarray:
    """Evaluate the outputs of an energy form by a plain solve, with what is improper."""
    output = form.output
    value = output.X @ np.linalg.solve(s * np.eye(len(form.A)) - form.A, form.B).astype(complex)
    for power, part in enumerate(output.U):
        value = value + part * s**power
    return np.asarray(value)


@pytest.mark.parametrize(
    ("model", "points"),
    [
        (cantilever(10), FIRST_MODES),
        (cantilever(40), FIRST_MODES[:3]),
        (zener_cantilever(10), (3.6, 22.5)),
        (zener_cantilever(30), (3.6,)),
        (stiff_chain(16), (0.445, 1.5, 31.0)),
    ],
    ids=["10", "40", "zener 10", "zener 30", "chain"],
)
def test_response_at_resonances_is_that_of_the_stored_numbers(
    model: SecondOrderModel, points: tuple[float, ...]
) -> None:
    """Against ball arithmetic on the same doubles, where DOF states lose up to half of all digits."""
    s = 1j * np.array(points)
    exact = ball_transfer(model, s)
    form, sys = energy_form(model), mech2ss(model, states="energy")
    assert_allclose([plain(form, point)[0, 0] for point in s], exact, rtol=CORRECTED)
    assert_allclose(sys(s), exact, rtol=EVALUATED)


def test_every_half_dof_of_the_mount_dissipates_in_one_direction() -> None:
    """The symmetric part of A has the eigenvalues -10, -10/3, 0, 0 for C_rs = C_h / 3."""
    A = energy_form(hydromount()).A
    assert_allclose(np.linalg.eigvalsh((A + A.T) / 2), [-10.0, -10.0 / 3.0, 0.0, 0.0], rtol=ROUNDING, atol=1e-14)


def test_undamped_structure_is_skew_to_the_last_bit() -> None:
    """A + A^T is zero, so that its poles are imaginary."""
    A = energy_form(mechss(np.diag([1.0, 3.0, 0.1]), None, [[4.0, -1.0, 0.0], [-1.0, 7.0, -2.3], [0.0, -2.3, 3.0]])).A
    assert_array_equal(A, -A.T)


def _laplacian(generator: np.random.Generator, n: int, chance: float, ground: float) -> FloatArray:
    """Join DOFs at random by springs or dampers, whose sums are exact: small integers times a power of two."""
    X = np.zeros((n, n))
    for a in range(n):
        for b in range(a):
            if generator.random() < chance:
                size = float(generator.integers(1, 9)) * 2.0 ** int(generator.integers(-3, 4))
                X[[a, b], [a, b]] += size
                X[[a, b], [b, a]] -= size
        if generator.random() < ground:
            X[a, a] += float(generator.integers(1, 9))
    return X


def random_model(seed: int) -> SecondOrderModel:
    """Make a small structure with half and static DOFs, free or grounded, gyroscopic or not, in random units."""
    generator = np.random.default_rng(seed)
    n = int(generator.integers(2, 7))
    K, C = _laplacian(generator, n, 0.7, generator.choice([0.0, 0.3])), _laplacian(generator, n, 0.4, 0.1)
    kinds = generator.integers(0, 3, n)
    C[kinds == 2] = 0.0
    C[:, kinds == 2] = 0.0
    if generator.random() < 0.3:
        whirl = np.triu(generator.standard_normal((n, n)), 1)
        C += np.where(np.outer(kinds == 0, kinds == 0), whirl - whirl.T, 0.0)
    unit = 2.0 ** generator.integers(-12, 13, n)
    M, C, K = (unit[:, None] * X * unit for X in (np.diag(np.where(kinds == 0, generator.uniform(1, 5, n), 0.0)), C, K))
    return mechss(M, C, K)


@given(st.integers(0, 10**6))
def test_random_structures_keep_order_and_response(seed: int) -> None:
    """Order of `exact_reduction` and response in rational arithmetic, wherever there are energy coordinates."""
    model = random_model(seed)
    form = energy_system(model)
    if form is None:
        return
    with warnings.catch_warnings(record=True):
        warnings.simplefilter("always")
        assert len(form.A) == exact_reduction(model).order
    s = 0.3 + 1.7j  # off all poles of passive models
    exact = transfer(model, [s])[:, :, 0]
    size = np.sqrt(np.abs(np.diagonal(exact)))
    assert_allclose(plain(form, s) / np.outer(size, size), exact / np.outer(size, size), rtol=0, atol=SMALL)
    assert_allclose(form.T @ form.T_inverse, np.eye(len(form.A)), rtol=0, atol=1e-9)


def test_prescribed_motion_of_a_mass_keeps_its_derivatives() -> None:
    """Base excitation brings the second derivative of the input into the equations: reaction and response."""
    for dof in ("y", "y1", "y2"):
        model = hydromount().prescribe_motion(dof)
        for s in (0.3 + 2.0j, 40.0j):
            assert_allclose(plain(energy_form(model), s), model(s), rtol=ROUNDING)


# --- free motions


def free_train() -> SecondOrderModel:
    """Make two free masses with a massless node between them, springs of 100 and 200 N/m."""
    return mechss(
        np.diag([2.0, 0, 1]), None, [[100, -100, 0], [-100, 300, -200], [0, -200, 200]], dofs=["a", "b", "c"]
    ).select("F_a", "c")


def test_free_train_has_poles_at_exactly_zero_and_an_infinite_static_gain() -> None:
    """Rigid states first; python-control's own poles and dcgain say what is true."""
    sys = mech2ss(free_train(), states="energy")
    assert sys.state_labels[:2] == ["rigid1", "rigid1_dot"]
    assert_array_equal(sys.A[:, 0], 0.0)
    assert_array_equal(sys.A[:, 1], [1.0, 0.0, 0.0, 0.0])
    poles = np.sort_complex(sys.poles())
    assert np.count_nonzero(poles == 0.0) == 2
    assert_allclose(np.abs(poles[poles != 0.0]), 10.0, rtol=ROUNDING)
    assert sys.dcgain(warn_infinite=False) == np.inf


@pytest.mark.parametrize("elements", [10, 40])
def test_free_beam_moves_as_a_rigid_body_far_below_its_first_mode(elements: int) -> None:
    """At 3e-4 of the first resonance the far end answers -(1/m + x1 x2 / J) / w^2 = 2 / w^2, and four poles are 0."""
    M, K = beam_matrices(elements, clamped=False)
    form = energy_form(mechss(M, None, K).select("F_q0", f"q{2 * elements}"))
    omega = 22.37 * 3e-4
    assert_allclose(plain(form, 1j * omega)[0, 0] * omega**2, 2.0, rtol=1e-6)
    assert np.count_nonzero(np.linalg.eigvals(form.A) == 0.0) == 4


@pytest.mark.parametrize("seed", range(4))
def test_free_frame_has_three_rigid_motions_and_a_clamped_one_none(seed: int) -> None:
    """Bars at any angle, K unsymmetric by rounding of T^T K T: six poles at exactly 0, and none with a node held."""
    steps = np.random.default_rng(seed).standard_normal((12, 2))
    M, K = plane_frame(np.cumsum(steps, axis=0))
    free, held = energy_form(mechss(M, None, K)), energy_form(mechss(M[3:, 3:], None, K[3:, 3:]))
    assert free.n_rigid == free.n_massive == 3
    assert np.count_nonzero(np.linalg.eigvals(free.A) == 0.0) == 6
    assert held.n_rigid == 0


def test_dampers_inside_a_free_body_do_not_resist_it() -> None:
    """Half DOFs whose dampers act between DOFs leave the columns of the rigid motion exact."""
    C = np.array([[3, -3, 0], [-3, 3.3, -0.3], [0, -0.3, 0.3]])
    form = energy_form(mechss(np.diag([2.0, 0, 1]), C, free_train().K))
    assert_array_equal(form.A[:, 0], 0.0)
    assert_array_equal(form.A[1:, 1], 0.0)


def test_damper_to_the_ground_resists_a_free_body() -> None:
    """A free mass of 2 kg with a damper of 3 N s/m: poles 0 and -3/2."""
    form = energy_form(mechss([[2]], [[3]], None))
    assert_allclose(np.sort(np.linalg.eigvals(form.A).real), [-1.5, 0.0], rtol=ROUNDING)


def test_node_on_a_damper_alone_is_a_free_motion_without_mass() -> None:
    """One state, its displacement; it follows the mass, and a force of 4 N moves it away at 4/3 m/s."""
    form = energy_form(mechss(np.diag([2.0, 0]), [[3, -3], [-3, 3]], np.diag([5.0, 0]), dofs=["mass", "node"]))
    assert form.states == ("rigid1", "strain_mass", "momentum_mass")
    assert_array_equal(form.A[:, 0], 0.0)
    assert_allclose(
        plain(form, 2j), mechss(np.diag([2.0, 0]), [[3, -3], [-3, 3]], np.diag([5.0, 0]))(2j), rtol=ROUNDING
    )


# --- what has none


@pytest.mark.parametrize(
    ("matrices", "reason", "text"),
    [
        ((np.eye(2), None, [[2, 1], [-1, 2]]), "unsymmetric", r"K is unsymmetric, K\[q0, q1\] = 1"),
        (([[1, 0.1], [0, 1]], None, np.eye(2)), "unsymmetric", "M is unsymmetric"),
        (([[1]], None, [[-1]]), "indefinite", "negative elastic energy"),
        (([[1, 2], [2, 1]], None, np.eye(2)), "indefinite", "negative kinetic energy"),
        (([[1, 1], [1, 1]], None, np.eye(2)), "singular mass", "combination of them has no inertia"),
        ((None, [[1, -1], [-1, 1]], np.eye(2)), "singular damping", "damper between two of them"),
        ((None, None, [[2]]), "no states", "no states"),
        ((np.diag([1, 0, 0]), None, [[1, 0, 1], [0, 1, 0], [1, 0, 0]]), "indefinite", "negative elastic energy"),
    ],
)
def test_models_without_energy_coordinates_are_refused_by_name(
    matrices: tuple[object, ...], reason: str, text: str
) -> None:
    """Unsymmetric, indefinite, shared mass, shared damper, no state at all, a constraint."""
    model = mechss(*matrices)  # type: ignore[arg-type]
    with pytest.raises(EnergyFormError, match=text) as caught:
        energy_form(model)
    assert caught.value.reason == reason
    assert energy_system(model) is None


def test_asymmetry_of_one_rounding_is_none() -> None:
    """A stiffness whose halves were rounded differently has an energy."""
    K = np.array([[2.0, -1.0], [-1.0, 2.0]])
    K[0, 1] = np.nextafter(-1.0, 0.0)
    assert energy_system(mechss(np.eye(2), None, K)) is not None


def test_fractions_of_a_zener_element_are_kept() -> None:
    """A spring of 3 N/m beside 6 N/m in series with 2 N s/m: K(s) = 3 + 12 s / (6 + 2 s), at s = 1 exactly 9/2."""
    form = energy_form(mechss(None, np.diag([1e-9, 2.0]), [[9, -6], [-6, 6]]).select("F_q0", "q0"))
    expected = 1 / (Fraction(9, 2) + Fraction(1, 10**9))
    assert_allclose(plain(form, 1.0)[0, 0].real, float(expected), rtol=1e-12)
