"""Small models of large ones: exact at rest, their error measured, their modes those of the full model."""

from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import scipy.linalg
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.sparse import coo_array, csc_array, diags_array

from halfdof_ctrl import (
    SecondOrderModel,
    TruncatedModel,
    descriptor_response,
    load_model,
    mech2ss,
    mechss,
    save_model,
    truncate_modes,
)
from halfdof_ctrl.base.arrays import EPS, as_dense
from halfdof_ctrl.base.errors import (
    ComplexModelError,
    MatrixError,
    ModelSizeError,
    ParameterError,
    SingularPencilError,
    TruncationWarning,
)
from halfdof_ctrl.reduction.modal import craig_bampton, truncation
from support.beams import beam_matrices
from support.fe_models import space_frame, spring_grid

AT_REST = 1e-9  # the small model is exact at s = 0, up to the condition of K
EVERYTHING = 1e-6  # with all modes kept it is exact everywhere, up to the same


def frame_model(share: float = 1.0, proportional: float = 1e-5) -> SecondOrderModel:
    """Make a frame of 3 x 2 x 2 bays with distributed mass, three dampers, and two forces and three outputs."""
    structure = space_frame(4, 3, 3, 0, parts=2, dampers=3)
    generator = np.random.default_rng(0)
    M = csc_array(diags_array(generator.uniform(5.0, 6.0, structure.size) * (generator.random(structure.size) < share)))
    C = csc_array(structure.C + proportional * structure.K)
    return mechss(M, C, structure.K, name="frame").select(["F_q0", "F_q61"], ["q0", "q61", "q100_dot"])


@pytest.mark.filterwarnings("ignore:A, B, C and D are right:halfdof_ctrl.errors.LostDigitsWarning")
def test_a_frame_gets_small_and_its_error_is_what_it_says() -> None:
    """The transfer function at frequencies of one's own choice, and the slowest poles, against the full model."""
    model = frame_model()
    small = truncate_modes(model, f_max=20.0)
    assert isinstance(small, TruncatedModel)
    assert not small.is_sparse
    assert small.full_size == len(model.dofs) > 5 * len(small.dofs)
    assert set(small.kept) >= {"q0", "q61", "q100"}
    assert small.dofs[: len(small.kept)] == small.kept
    assert (small.inputs, small.outputs, small.name) == (model.inputs, model.outputs, "frame")
    assert small.max_error < 3e-3  # 2.0e-3 at 19.1 Hz, between the regular frequencies
    s = 2j * np.pi * np.array([0.3, 7.0, 19.0])
    desired = model(s)
    assert_allclose(small(s), desired, atol=1e-3 * np.abs(desired).max(axis=2).max())
    assert_allclose(small.errors.shape, (3, 2, small.checked.size))
    dense = model.as_dense()
    full = np.linalg.eigvals(mech2ss(dense).A)
    poles = np.linalg.eigvals(mech2ss(small).A)
    slowest = full[np.argsort(np.abs(full))][:8]
    assert_allclose(np.abs(poles[:, None] - slowest).min(axis=0) / np.abs(slowest), 0.0, atol=1e-4)


@pytest.mark.filterwarnings("ignore::halfdof_ctrl.errors.TruncationWarning")
@pytest.mark.parametrize("proportional", [0.0, 2e-4])
def test_the_error_on_a_fine_grid_is_near_the_one_that_is_told(proportional: float) -> None:
    """Lightly damped peaks neither hide the errors beside them nor slip between a few frequencies.

    At the needles of an undamped model their shift is told, so that the grid keeps 2 per cent away from them.
    """
    model = frame_model(proportional=proportional)
    small = truncate_modes(model, f_max=20.0)
    frequencies = np.geomspace(*small.band, 60)
    if proportional == 0.0:
        distance = np.abs(frequencies[:, None] / small.resonances.frequencies - 1.0).min(axis=1)
        frequencies = frequencies[distance > 0.02]
    s = 2j * np.pi * frequencies
    found, desired = small(s), model(s)
    size = np.abs(desired).max(axis=2, keepdims=True)
    assert float((np.abs(found - desired) / size).max()) < 3.0 * small.max_error


@pytest.mark.parametrize("f_max", [8.0, 25.0])
def test_all_modes_up_to_twice_the_band_are_kept(f_max: float) -> None:
    """As many as the dense solver counts with the kept DOFs held, and none beyond."""
    model = frame_model()
    small = truncate_modes(model, f_max=f_max)
    free = [place for place, name in enumerate(model.dofs) if name not in small.kept]
    M, _, K = (as_dense(matrix)[np.ix_(free, free)] for matrix in (model.M, model.C, model.K))
    frequencies = np.sqrt(scipy.linalg.eigh(K, M, eigvals_only=True)) / (2.0 * np.pi)
    assert_allclose(small.mode_frequencies, frequencies[frequencies < 2.0 * f_max], rtol=1e-7)
    assert small.band == pytest.approx((f_max / 100.0, f_max))


@st.composite
def chains(draw: st.DrawFn) -> SecondOrderModel:
    """Draw a chain with masses at some nodes, some dampers, proportional damping or not, free or held."""
    generator = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    n = draw(st.integers(12, 40))
    K = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    if draw(st.booleans()):
        K[0, 0] = K[-1, -1] = 1.0
    mass = generator.uniform(1.0, 3.0, n) * (generator.random(n) < draw(st.sampled_from([0.3, 0.8, 1.0])))
    mass[n // 2] = 2.0
    C = 1e-3 * K + 0.05 * np.diag(mass) if draw(st.booleans()) else np.zeros((n, n))
    for j in generator.choice(n - 1, 2, replace=False).tolist():
        C[j : j + 2, j : j + 2] += 0.3 * np.array([[1.0, -1.0], [-1.0, 1.0]])
    B, F = np.zeros((n, 2)), np.zeros((2, n))
    B[generator.integers(n), 0] = F[0, generator.integers(n)] = 1.0
    B[:, 1], F[1] = generator.uniform(0.1, 1.0, n), 1.0 / n
    return mechss(csc_array(np.diag(mass)), csc_array(C), csc_array(K), B, F)


@pytest.mark.filterwarnings("ignore::halfdof_ctrl.errors.TruncationWarning")
@pytest.mark.filterwarnings("ignore:The state space is exact:halfdof_ctrl.errors.LostDigitsWarning")  # deep in roll-off
@given(model=chains())
def test_small_models_are_exact_at_rest_and_reduce_without_a_word(model: SecondOrderModel) -> None:
    """Half DOFs, static ones, inputs spread over all nodes: the static stiffness is kept, no tiny mass is warned of."""
    small = truncate_modes(model, f_max=0.02)
    s = 1e-2
    desired = model(s)
    assert_allclose(small(s), desired, rtol=1e-5, atol=1e-5 * np.abs(desired).max())
    sys = mech2ss(small)
    assert sys.nstates <= mech2ss(model).nstates + 2 * len(small.dofs)
    values = sys(0.3j)
    assert_allclose(values, small(0.3j), rtol=1e-6, atol=1e-8 * np.abs(values).max())


@pytest.mark.filterwarnings("ignore::halfdof_ctrl.errors.TruncationWarning")
@given(model=chains())
def test_with_all_modes_nothing_is_lost(model: SecondOrderModel) -> None:
    """Every mode kept: the transfer function is that of the full model at any frequency."""
    small = truncate_modes(model, n_modes=len(model.dofs))
    points: npt.NDArray[np.complex128] = np.array([0.05j, 0.6 + 0.7j, 2.0j, 40.0])
    desired = model(points)
    assert_allclose(small(points), desired, rtol=0.0, atol=EVERYTHING * np.abs(desired).max())


def test_dense_models_are_taken_too() -> None:
    """The same small model, from a dense copy."""
    model = frame_model()
    sparse, dense = truncate_modes(model, f_max=10.0), truncate_modes(model.as_dense(), f_max=10.0)
    assert sparse.dofs == dense.dofs
    s = 2j * np.pi * np.array([1.0, 9.0])
    assert_allclose(dense(s), sparse(s), rtol=1e-6, atol=1e-9 * np.abs(sparse(s)).max())


def test_half_dofs_and_dampers_are_kept_proportional_damping_not() -> None:
    """A massless node with a damper is kept; Rayleigh damping touches every DOF and keeps none."""
    structure = spring_grid(12, 9, 90, dampers=2)
    damped = tuple(f"q{k}" for k in np.unique(structure.C.indices))
    C = csc_array(structure.C + 1e-4 * structure.K + 0.2 * structure.M)
    small = truncate_modes(mechss(structure.M, C, structure.K).select("F_q3", "q3"), f_max=1.0)
    assert set(small.kept) == {"q3", *damped}
    everywhere = csc_array(diags_array(np.linspace(1.0, 2.0, structure.size)))
    few = truncate_modes(mechss(structure.M, everywhere, structure.K).select("F_q3", "q3"), f_max=1.0)
    assert len(few.kept) == structure.size


def test_a_damping_spread_over_too_many_dofs_is_projected(monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither proportional nor at a few places: no DOF is kept for it, and the error says what that costs."""
    monkeypatch.setattr(craig_bampton, "MOST_KEPT", 20)
    structure = spring_grid(12, 9, 90)
    C = csc_array(diags_array(np.linspace(1.0, 2.0, structure.size)))
    small = truncate_modes(mechss(structure.M, C, structure.K).select("F_q3", "q3"), f_max=2.0)
    assert small.kept == ("q3",)
    assert small.max_error < 0.02


def test_velocities_accelerations_and_prescribed_motion_go_through() -> None:
    """The motion of a node prescribed before or after: reaction, displacement and acceleration are the same."""
    structure = spring_grid(10, 8, 80)
    model = mechss(structure.M, csc_array(1e-4 * structure.K), structure.K)
    before = model.prescribe_motion("q9", outputs=["q4_ddot", "q20", "R_q9"])
    small = truncate_modes(before, f_max=6.0)
    assert small.prescribed == ("q9",)
    assert small.max_error < 1e-3
    after = truncate_modes(model.select("F_q9", ["q4", "q20", "q9"]), f_max=6.0)
    moved = after.prescribe_motion("q9", "acceleration", outputs=["q4_ddot", "q20", "R_q9"])
    s = 2j * np.pi * 1.7
    assert_allclose(moved(s) * s**2, small(s), rtol=1e-3)
    assert mech2ss(moved).noutputs == 3
    with pytest.raises(MatrixError, match="on the small model"):
        truncate_modes(model.prescribe_motion("q9", "acceleration"), f_max=6.0)


def test_it_selects_and_saves_like_any_model(tmp_path: Any) -> None:  # noqa: ANN401
    """Signals of kept DOFs are there by name, modes too."""
    small = truncate_modes(frame_model(), f_max=10.0)
    picked = small.select("F_q61", ["q61_ddot", "mode1"])
    assert isinstance(picked, TruncatedModel)
    assert_allclose(picked(1j)[0, 0], small(1j)[1, 1] * -1.0)
    save_model(small, tmp_path / "small.npz")
    assert load_model(tmp_path / "small.npz").dofs == small.dofs
    assert descriptor_response(small, [1.0]).ninputs == 2


def test_repr_shows_size_and_error() -> None:
    """What was kept of how much, and the largest error with its place."""
    small = truncate_modes(frame_model(), f_max=10.0, points=5)
    text = repr(small)
    assert text.startswith("TruncatedModel 'frame': ")
    assert f"of {small.full_size} DOFs: {len(small.kept)} kept, {small.mode_frequencies.size} modes up to" in text
    assert f"error between them from 0.1 to 10 Hz, at {small.checked.size} frequencies: {small.max_error:.1e}" in text
    assert f"{small.resonances.frequencies.size} resonances from" in text
    assert "worst: q" in text
    assert 5 <= small.checked.size <= 5 + truncation.DOUBTFUL_POINTS


def test_an_error_that_is_large_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    """A shift of a resonance beyond what is allowed, here next to nothing."""
    monkeypatch.setattr(truncation, "ALLOWED_SHIFT", 1e-9)
    words = r"not close to the full one: \d+ resonances from .* frequency within .*Raise f_max"
    with pytest.warns(TruncationWarning, match=words):
        small = truncate_modes(frame_model(proportional=0.0), n_modes=60)
    assert small.max_shift > 1e-9


@pytest.mark.parametrize("damping", [0.0, 1e-6])
def test_the_shift_of_needle_sharp_resonances_is_told(damping: float) -> None:
    """A chain of 400 masses, undamped or nearly so: poles against those of the dense solver, two digits right.

    No warning is given, although values at the needles differ by far more than they are.
    """
    n = 400
    K = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    K[-1, -1] = 1.0
    small = truncate_modes(
        mechss(np.eye(n), damping * K, K).select([f"F_q{n - 1}"], [f"q{n - 1}"]), f_max=30.0 / (2.0 * np.pi * n)
    )
    full = np.sqrt(scipy.linalg.eigvalsh(K))
    found = small.resonances
    nearest = np.abs(2.0 * np.pi * found.frequencies[:, None] - full).argmin(axis=1)
    shift = np.abs(2.0 * np.pi * found.frequencies / full[nearest] - 1.0)
    assert found.frequencies.size > 5
    told = shift > 1e-11
    assert told.sum() >= 3
    assert_allclose(found.frequency_shift[told], shift[told], rtol=0.05)
    assert small.max_error < 1e-3


def test_n_modes_sets_the_band_by_its_highest_mode() -> None:
    """Half of the highest frequency."""
    small = truncate_modes(frame_model(), n_modes=7)
    assert small.mode_frequencies.size == 7
    assert small.band[1] == pytest.approx(small.mode_frequencies[-1] / 2.0)


def test_nothing_but_kept_dofs_is_the_model_itself() -> None:
    """Two masses, both with a force: no mode, no correction, the band from their own frequencies."""
    K = np.array([[5.0, -2.0], [-2.0, 2.0]])
    model = mechss(csc_array(np.diag([1.0, 2.0])), csc_array(0.1 * K), K)
    small = truncate_modes(model, n_modes=3)
    assert small.dofs == model.dofs
    assert_allclose(small(0.7j), model(0.7j), rtol=1e-12)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({}, "Give either f_max"),
        ({"f_max": 1.0, "n_modes": 3}, "Give either f_max"),
        ({"f_max": -1.0}, "f_max = -1.0 Hz, but it must be a positive"),
        ({"f_max": float("nan")}, "f_max = nan Hz"),
        ({"n_modes": 0}, "n_modes = 0, but it must be a whole number"),
        ({"n_modes": 2.5}, r"n_modes = 2\.5"),
        ({"n_modes": 2, "points": 0}, "points = 0"),
    ],
)
def test_impossible_requests_are_refused(options: dict[str, Any], words: str) -> None:
    """Before anything is factorized."""
    with pytest.raises(ParameterError, match=words):
        truncate_modes(frame_model(), **options)


def test_models_without_real_modes_are_refused() -> None:
    """A complex damping, and an unsymmetric stiffness."""
    K = np.array([[2.0, -1.0], [-1.0, 2.0]])
    with pytest.raises(ComplexModelError, match="C has imaginary parts"):
        truncate_modes(mechss(csc_array(np.eye(2)), 0.1j * K, K), n_modes=1)
    with pytest.raises(MatrixError, match="K is not symmetric") as caught:
        truncate_modes(mechss(csc_array(np.eye(2)), None, np.triu(K)), n_modes=1)
    assert caught.value.matrix == "K"


def test_too_much_to_keep_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """All forces of a model that was not selected, and modes without end."""
    structure = spring_grid(6, 5, 30)
    monkeypatch.setattr(craig_bampton, "MOST_KEPT", 10)
    with pytest.raises(ModelSizeError, match="30 DOFs of inputs, outputs and dampers would be kept") as caught:
        truncate_modes(structure.model(), f_max=1.0)
    assert (caught.value.size, caught.value.limit) == (30, 10)
    monkeypatch.setattr(craig_bampton, "MOST_MODES", 5)
    with pytest.raises(ModelSizeError, match="modes are to be kept, all below 40 Hz, twice f_max; the limit is 5"):
        truncate_modes(structure.model().select("F_q0", "q0"), f_max=20.0)
    with pytest.raises(ModelSizeError, match="6 modes are to be kept; the limit is 5"):
        truncate_modes(structure.model().select("F_q0", "q0"), n_modes=6)


def test_what_floats_without_mass_is_named() -> None:
    """A node without spring and mass beside a chain."""
    K = np.zeros((4, 4))
    K[:3, :3] = 2.0 * np.eye(3) - np.eye(3, k=1) - np.eye(3, k=-1)
    model = mechss(csc_array(np.diag([1.0, 1.0, 1.0, 0.0])), None, csc_array(K)).select("F_q0", "q0")
    with pytest.raises(SingularPencilError, match="DOFs q3 still move") as caught:
        truncate_modes(model, n_modes=1)
    assert caught.value.dofs == ("q3",)


def test_names_of_coordinates_keep_clear_of_dofs() -> None:
    """A DOF that is called mode1 already."""
    n = 8
    K = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    dofs = ["mode1", *[f"x{k}" for k in range(n - 1)]]
    small = truncate_modes(mechss(csc_array(np.eye(n)), None, csc_array(K), dofs=dofs).select("F_x3", "x3"), n_modes=2)
    assert small.dofs == ("x3", "mode_1", "mode_2", "correction1")


def test_the_shift_of_antiresonances_is_told() -> None:
    """Notches of a cantilever at its own force are the modes with that DOF held: two digits are right.

    A force in the middle keeps a second DOF, so that the modes of the small model are not those very ones.
    """
    M, K = beam_matrices(60)
    tip = 118
    small = truncate_modes(mechss(M, None, K).select([f"F_q{tip}", "F_q60"], f"q{tip}"), f_max=60.0)
    held = np.delete(np.arange(len(K)), tip)
    full = np.sqrt(scipy.linalg.eigvalsh(K[np.ix_(held, held)], M[np.ix_(held, held)])) / (2.0 * np.pi)
    found = small.antiresonances
    shift = np.abs(found.frequencies[:, None] / full - 1.0).min(axis=1)
    told = (found.shift > 100.0 * np.maximum(found.floor, 1e-11)) & (shift < 1e-3)
    assert found.shift.size >= 4
    assert told.any()
    assert_allclose(found.shift[told], shift[told], rtol=0.05)
    assert f"{found.shift.size} antiresonances: frequency within" in repr(small)


def test_a_clamped_beam_that_rounding_undoes_is_not_refused() -> None:
    """6000 elements: rounding of the entries moves the first mode by per cents, and more modes would not help."""
    model = long_cantilever(6000)
    with pytest.warns(TruncationWarning, match=r"known to their last digit.*More modes do not help; fewer elements do"):
        small = truncate_modes(model, f_max=5.0, points=3)
    assert small.resonances.floor[0] > 0.01


def long_cantilever(elements: int) -> SecondOrderModel:
    """Give the sparse matrices of a unit cantilever, force and displacement at its tip."""
    M, K = beam_matrices(2, clamped=False)
    scale = np.tile([1.0, 2.0 / elements], 2)  # rotations by the length of an element
    parts = []
    for whole, factor in ((M, 2.0 / elements), (K, (elements / 2.0) ** 3)):
        first = whole[:4, :4].copy()
        first[2:, 2:] = whole[4:, 4:]
        block = first * scale[:, None] * scale * factor
        places = 2 * np.arange(elements)[:, None] + np.arange(4)
        rows, columns = np.repeat(places, 4, axis=1).ravel(), np.tile(places, (1, 4)).ravel()
        size = 2 * elements + 2
        entries = np.tile(block.ravel(), elements), (rows, columns)
        parts.append(csc_array(csc_array(coo_array(entries, shape=(size, size)))[2:][:, 2:]))
    tip = f"q{2 * elements - 2}"
    return mechss(parts[0], None, parts[1]).select(f"F_{tip}", tip)


@pytest.mark.filterwarnings("ignore::halfdof_ctrl.errors.LostDigitsWarning")
def test_a_small_model_of_a_file_with_few_digits_says_what_its_entries_are_known_to() -> None:
    """The stiffness of 200 springs in a row is a sum that cancels: it loses more digits than each of them."""
    n, digits = 200, 5e-7
    K = csc_array(2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    name = f"q{n // 2}"
    exact = mechss(csc_array(diags_array(np.ones(n))), 1e-3 * K, K).select(f"F_{name}", name)
    known = truncate_modes(replace(exact, known_to=digits), n_modes=3)
    assert truncate_modes(exact, n_modes=3).known_to == EPS
    found = []
    for seed in range(8):
        noise = 1.0 + digits * np.random.default_rng(seed).uniform(-1.0, 1.0, (n, n))
        rounded = csc_array(K.multiply(np.tril(noise) + np.tril(noise, -1).T))
        small = truncate_modes(replace(exact, K=rounded, C=1e-3 * rounded), n_modes=3)
        found.append(abs(small.K[0, 0] / known.K[0, 0] - 1.0))
    assert 0.3 * known.known_to < max(found) < 3.0 * known.known_to  # at random, so neither all nor nothing
    assert known.known_to > 10.0 * digits
    assert float(known.data_limit.max()) > 1e6 * float(truncate_modes(exact, n_modes=3).data_limit.max())
