"""Fitted Prony series against the series behind exact curves, and against the scatter of others."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import halfdof_ctrl as hd
from halfdof_ctrl.base.errors import ParameterError

EXACT = 1e-10  #: parameters of exact curves
CURVE = 0.015  #: largest error of a curve under 1 per cent of scatter, 1.2 per cent in 19 of 20 trials
NEAR_FLOOR = 1.05
F = np.geomspace(1.0, 100.0, 50)
NOISE = 0.01


def series(f: np.ndarray, k0: float, k: list[float], w: list[float], c0: float = 0.0) -> np.ndarray:
    """``k0 + c0 s + sum of k_i s / (s + w_i)``."""
    s = 2j * np.pi * f
    return np.asarray(k0 + c0 * s + sum(ki * s / (s + wi) for ki, wi in zip(k, w, strict=True)))


def scattered(values: np.ndarray, seed: int) -> np.ndarray:
    """Errors of 1 per cent, in modulus and phase alike."""
    g = np.random.default_rng(seed)
    return np.asarray(
        values * (1 + NOISE * (g.standard_normal(values.size) + 1j * g.standard_normal(values.size)) / 2**0.5)
    )


@pytest.mark.parametrize(
    ("k", "w", "c0"),
    [
        ([5e3], [40.0], 0.0),
        ([2e4, 3e3], [9.0, 70.0], 2.0),
        ([1651.0, 77958.0, 22343.0, 1333.0, 47301.0, 87863.0], [3.8, 36.3, 137.0, 385.0, 1523.0, 9688.0], 0.0),
        ([16319.0, 56500.0, 62478.0, 95189.0, 4648.0], [1.62, 14.3, 102.0, 212.0, 450.0], 1.5),
    ],
)
def test_exact_curves_give_their_parameters_back(k: list[float], w: list[float], c0: float) -> None:
    """2 N + 2 points, rates 0.3 decades apart, a weak branch beside strong ones."""
    f = np.geomspace(w[0] / 20.0, w[-1] / 2.0, 2 * len(k) + 2)
    fit = hd.fit_prony(f, series(f, 6e4, k, w, c0))
    assert fit.k.size == len(k)
    assert_allclose(fit.k, k, rtol=EXACT)
    assert_allclose(fit.k / fit.c, w, rtol=EXACT)
    assert_allclose(fit.k0, 6e4, rtol=EXACT)
    assert fit.follows


def test_as_many_points_as_branches_and_one_suffice() -> None:
    """N + 1 complex points determine N branches and the stiffness at rest."""
    f = np.array([1.0, 6.0, 40.0])
    fit = hd.fit_prony(f, series(f, 1e4, [5e3, 8e3], [10.0, 120.0]), branches=2)
    assert_allclose(fit.k / fit.c, [10.0, 120.0], rtol=1e-8)


@pytest.mark.parametrize("seed", range(6))
def test_curve_under_scatter_is_found_near_the_floor(seed: int) -> None:
    """The curve, not its parameters: many series follow a scattered curve about equally well."""
    g = np.random.default_rng(100 + seed)
    count = int(g.integers(1, 5))
    true = series(
        F, 3e4, list(1e4 * 10 ** g.uniform(-0.5, 1, count)), list(6.3 * 10 ** np.sort(g.uniform(0, 2, count)))
    )
    fit = hd.fit_prony(F, scattered(true, seed))
    assert fit.follows
    assert fit.rms <= NEAR_FLOOR * fit.floor
    assert np.abs(fit(F) / true - 1.0).max() < CURVE


@pytest.mark.parametrize("f0", [6.0, 25.0])
def test_hydraulic_peak_is_named_with_the_mount_that_follows(f0: float) -> None:
    """A fluid column of 100 kg behind a spring beside a Maxwell branch."""
    u = F / f0
    moved = -(u**2) + 0.5j * u
    true = series(F, 2e5, [3e4], [100.0]) + 1.5e5 * moved / (1.0 + moved)
    fit = hd.fit_prony(F, scattered(true, 3))
    assert not fit.follows
    assert fit.fluid is not None
    assert_allclose(fit.fluid.frequency, f0, rtol=0.02)
    assert_allclose(fit.fluid.mass, 1.5e5 / (2 * np.pi * f0) ** 2, rtol=0.1)
    assert f"resonance at {fit.fluid.frequency:.4g} Hz" in fit.verdict
    part = fit.fluid.part.prescribe_motion("bottom").select("F_top", "top")
    assert np.abs(1.0 / part(2j * np.pi * F) / true - 1.0).max() < 2 * CURVE


def test_model_and_part_are_the_series() -> None:
    """On the ground as x with half DOFs, and between two ports."""
    fit = hd.fit_prony(F, series(F, 1e3, [5e2, 2e2], [30.0, 200.0], 0.1))
    assert fit.model.dofs == ("x", "x1", "x2")
    assert fit.part.dofs == ("top", "bottom", "1", "2")
    s = 2j * np.pi * F
    assert_allclose(1.0 / fit.model(s), fit(F), rtol=EXACT)
    assert_allclose(1.0 / fit.part.prescribe_motion("bottom").select("F_top", "top")(s), fit(F), rtol=EXACT)
    assert hd.exact_reduction(fit.model).order == 3  # x is damped, and each branch


def test_static_stiffness_is_kept() -> None:
    """From a static test, where the band does not show the plateau."""
    values = scattered(series(F, 5e3, [2e4, 1e4], [2.0, 60.0]), 1)
    free, told = hd.fit_prony(F, values), hd.fit_prony(F, values, static_stiffness=5e3)
    assert told.k0 == pytest.approx(5e3)
    assert told.standard_errors["k0"].item() == 0.0
    assert "pass static_stiffness" in free.verdict
    assert "pass static_stiffness" not in told.verdict


@pytest.mark.parametrize("weight", ["absolute", "parts"])
def test_other_weights_find_the_same_exact_curve(weight: str) -> None:
    """What is exact is exact in any weight."""
    fit = hd.fit_prony(F, series(F, 1e3, [5e2], [30.0]), weight=weight)  # type: ignore[arg-type]
    assert_allclose(fit.k, [5e2], rtol=1e-8)


def test_points_may_come_in_any_order() -> None:
    """They are sorted by frequency."""
    values = series(F, 1e3, [5e2], [30.0])
    fit = hd.fit_prony(F[::-1], values[::-1])
    assert_allclose(fit.stiffness, values, rtol=EXACT)
    assert_allclose(fit.k, [5e2], rtol=EXACT)


GOOD = series(F, 1e3, [5e2], [30.0])


@pytest.mark.parametrize(
    ("f", "K", "options", "words"),
    [
        (F, GOOD.conj(), {}, "Pass the complex conjugate"),
        (F, np.where(np.arange(50) == 30, GOOD - 2j * GOOD.imag, GOOD), {}, r"The loss is negative at 16\.77 Hz"),
        (-F, GOOD, {}, "every one must be positive"),
        (np.r_[0.0, F[1:]], GOOD, {}, "frequency holds 0"),
        (F[:3], GOOD[:3], {"branches": 4}, "4 branches have 9 unknown sizes, but 3 complex points"),
        (F[:1], GOOD[:1], {}, "two points at least"),
        (F, GOOD[:-1], {}, "lists of the same length"),
        (F, np.where(np.arange(50) == 3, np.nan, GOOD), {}, "NaN, Inf or zero at 1.326 Hz"),
        (F, ["a"] * 50, {}, "stiffness one of complex numbers"),
        (F, GOOD, {"weight": "log"}, "weight must be one of relative, absolute, parts"),
        (F, GOOD, {"branches": -1}, "branches = -1"),
        (F, GOOD, {"static_stiffness": 1e9}, "a passive part is softest at rest"),
    ],
)
def test_what_no_part_can_have_is_refused(f: object, K: object, options: dict[str, object], words: str) -> None:
    """With the frequencies, and the advice."""
    with pytest.raises(ParameterError, match=words):
        hd.fit_prony(f, K, **options)  # type: ignore[arg-type]


def test_scatter_of_a_small_loss_is_no_negative_loss() -> None:
    """Loss of half the scatter: some points come out below zero."""
    values = scattered(np.full(50, 1e3 + 0j) + 5j, 2)
    assert (values.imag < 0).any()
    assert hd.fit_prony(F, values).follows


def test_print_states_sizes_errors_and_verdict() -> None:
    """What a user reads."""
    text = repr(hd.fit_prony(F, scattered(series(F, 3e4, [1e4], [60.0]), 0), branches=1))
    assert text.startswith("PronyFit: 1 branch on 50 points, rms ")
    assert "k0 = " in text
    assert "± " in text
    assert "A Maxwell series follows the curve" in text
