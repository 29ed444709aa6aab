"""The page on Guyan reduction and a small mass says what examples/ex02_alternatives.py measures, and why."""

import dataclasses
import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any, TypeAlias

import flint
import numpy as np
import pytest
import scipy.integrate
from numpy.testing import assert_allclose

import halfdof_ctrl as hd
from halfdof_ctrl.base.arrays import FloatArray
from support.exact import determinant
from support.examples import imported

PAGE = (Path(__file__).parents[2] / "docs" / "explanation" / "alternatives.md").read_text(encoding="utf-8")
TEXT = " ".join(PAGE.split())
EXAMPLE: Any = imported("ex02_alternatives")
Case: TypeAlias = Any  #: EXAMPLE.Case, which mypy cannot follow
CASES = {"Hydraulic mount": EXAMPLE.mount(), "Cantilever": EXAMPLE.cantilever()}
MOUNT, CANTILEVER = CASES.values()
IMPLICIT = EXAMPLE.SOLVERS[1:]

TWO_DIGITS = 0.06  #: relative, of errors printed with two digits
STEP_CONTROL = 0.2  #: relative, of counts in which rounding decides some step of a solver, but not most
DOUBLING, TRIPLING = 1.6, 3.4  #: about, from decade to decade of counts in which rounding decides most steps
HALF_UNIT = 5e-16  #: relative, of a number written with 16 digits
FIRST_ORDER = 1e-3  #: relative, of a perturbation of 1e-5 whose second order is left out
ROUNDING = 1e-13  #: relative, of eigenvalues and responses of these small models


def rows(heading: str) -> dict[str, list[str]]:
    """Give the cells of the table below a heading of the page, by the name of the row."""
    section = re.split(rf"^### {heading}$", PAGE, flags=re.MULTILINE)[1]
    lines = re.match(r"\s*((?:\|.*\n)+)", section)
    assert lines is not None
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[1].splitlines()[2:]]
    return {name: rest for name, *rest in cells}


def assert_cell(cell: str, found: float, rtol: float) -> None:
    """Compare a number with what the page says of it: a value, an upper or a lower bound."""
    if cell.startswith("<"):
        assert found < float(cell[1:])
    elif cell.startswith(">"):
        assert found > float(cell[1:])
    else:
        assert_allclose(found, float(cell), rtol=rtol)


def small_mass_error(case: Case, epsilon: float) -> float:
    """Give the largest eigenvalue error of the usual state space."""
    system = EXAMPLE.textbook(EXAMPLE.with_small_mass(case, epsilon))
    return float(EXAMPLE.eigenvalue_error(np.linalg.eigvals(system.A), case.eigenvalues))


def work(case: Case, epsilon: float, solver: str) -> int:
    """Give the evaluations for a model with a small mass."""
    return int(EXAMPLE.evaluations(EXAMPLE.textbook(EXAMPLE.with_small_mass(case, epsilon)), case, solver))


@pytest.mark.parametrize("heading", CASES)
def test_tables_of_the_page_are_what_the_example_measures(heading: str) -> None:
    """Every row of the page's table, against the same measurement made now."""
    said, measured = rows(heading), list(EXAMPLE.table(CASES[heading]))
    assert list(said) == [row.name for row in measured]
    for row in measured:
        states, eigenvalues, transfer, *counts = said[row.name]
        assert row.states == int(states)
        assert_cell(eigenvalues, row.eigenvalue_error, TWO_DIGITS)
        assert_cell(transfer, row.transfer_error, TWO_DIGITS)
        for cell, count in zip(counts, row.evaluations, strict=True):
            assert_cell(cell, count, STEP_CONTROL)


@pytest.mark.parametrize(
    ("case", "polynomial"),
    [
        (MOUNT, [26250, 11375, 1075, 40, 3]),
        (CANTILEVER, [55296000, 7488000, 613080, 21944, 231, 7]),
    ],
    ids=CASES,
)
def test_eigenvalues_are_the_roots_of_the_exact_polynomial(case: Case, polynomial: list[int]) -> None:
    """The determinant of P(s) in rational arithmetic has the same roots, and these have the digits given."""
    exact = determinant(case.model.M, case.model.C, case.model.K)
    assert exact * polynomial[-1] == flint.fmpq_poly(polynomial) * exact[exact.degree()]
    found: Any = flint.fmpz_poly(polynomial).complex_roots()
    roots = np.array([complex(root) for root, _ in found])
    assert len(roots) == len(case.eigenvalues)
    assert EXAMPLE.eigenvalue_error(case.eigenvalues, roots) < HALF_UNIT


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_error_of_a_small_mass_is_what_first_order_perturbation_says(case: Case) -> None:
    """The page's formula, with null vectors of P at each eigenvalue, against the usual state space at 1e-5."""
    model, change = case.model, []
    for value in case.eigenvalues:
        left, _, right = np.linalg.svd(model.K + model.C * value + model.M * value**2)
        v, w = right[-1].conj(), left[:, -1].conj()
        change.append(value * (w @ (case.inertia * v)) / (w @ (2.0 * value * model.M + model.C) @ v))
    predicted = np.abs(change).max()
    assert_allclose(small_mass_error(case, 1e-5) / 1e-5, predicted, rtol=FIRST_ORDER)
    assert f"{predicted:.2f} $\\varepsilon$" in TEXT


@pytest.mark.parametrize(("case", "best"), [(MOUNT, 3e-10), (CANTILEVER, 5e-9)], ids=CASES)
def test_inverse_of_the_mass_loses_the_digits_that_a_smaller_epsilon_would_buy(case: Case, best: float) -> None:
    """The error has its minimum, within a decade of the page's, well above QZ's, which keeps falling."""
    assert f"{best:.0e}" in TEXT
    lowest = min(small_mass_error(case, epsilon) for epsilon in np.geomspace(1e-14, 1e-6, 33))
    assert best / 10.0 < lowest < best * 10.0
    by_qz = EXAMPLE.eigenvalues_by_qz(EXAMPLE.with_small_mass(case, 1e-14))
    assert EXAMPLE.eigenvalue_error(by_qz, case.eigenvalues) < lowest / 10.0
    no_mass = EXAMPLE.eigenvalues_by_qz(case.model)
    assert EXAMPLE.eigenvalue_error(no_mass, case.eigenvalues) < ROUNDING


def test_below_1e_13_the_mount_has_eigenvalues_without_a_right_digit() -> None:
    """The error of the usual state space is of the size of the eigenvalue."""
    assert small_mass_error(MOUNT, 1e-15) > 0.1


def test_guyan_reduction_of_half_dofs_invents_damping() -> None:
    """Mass 20, damping C_rs + C_h / 4 = 175, stiffness K_r + K_v / 2 = 5250, and the damping ratios of the page."""
    reduced = EXAMPLE.guyan(MOUNT.model, ["y1", "y2"])
    assert_allclose([reduced.M, reduced.C, reduced.K], [[[20.0]], [[175.0]], [[5250.0]]], rtol=ROUNDING)
    pair = MOUNT.eigenvalues[0]
    for ratio in (175.0 / 2.0 / np.sqrt(20.0 * 5250.0), -pair.real / abs(pair)):
        assert f"{ratio:.3f}" in TEXT
    for hertz in (np.sqrt(5250.0 / 20.0) / 2.0 / np.pi, abs(pair) / 2.0 / np.pi):
        assert f"{hertz:.2f} Hz" in TEXT


def test_error_of_guyan_reduction_grows_with_the_square_of_a_low_frequency() -> None:
    """At rest it is right; ten times the frequency gives a hundred times the error."""
    system = hd.mech2ss(EXAMPLE.guyan(MOUNT.model, ["y1", "y2"]))
    low, high = EXAMPLE.transfer_errors(system, MOUNT, np.array([1e-4, 1e-3]))
    assert_allclose(high / low, 100.0, rtol=0.01)
    assert_allclose(EXAMPLE.transfer_errors(system, MOUNT, np.array([0.0])), 0.0, atol=ROUNDING)


def test_guyan_reduction_of_a_mass_is_good_at_low_frequency() -> None:
    """The cantilever without w1: its first pair to about 1 %, its transfer function at 0.1 Hz."""
    system = hd.mech2ss(EXAMPLE.guyan(CANTILEVER.model, CANTILEVER.condensed["static DOFs and w1"]))
    first, second = CANTILEVER.eigenvalues[:2]
    assert np.abs(np.linalg.eigvals(system.A) - first).min() / abs(first) < 0.0125
    (error,) = EXAMPLE.transfer_errors(system, CANTILEVER, np.array([0.1]))
    assert f"{error:.0e}" in TEXT
    assert f"{abs(second) / 2.0 / np.pi:.2f} Hz" in TEXT


def test_guyan_reduction_leaves_the_half_dof_without_mass() -> None:
    """Of static DOFs alone: M_G is singular, and the exact reduction removes what is left."""
    reduced = EXAMPLE.guyan(CANTILEVER.model, ["phi1", "phi2"])
    assert hd.exact_reduction(reduced).partition.half == ("x",)


def test_guyan_reduction_is_exact_where_damping_is_proportional_to_stiffness() -> None:
    """Rotations with C = K / 16: the same transfer function, less the eigenvalue -16 of each rotation."""
    model = CANTILEVER.model
    K, C = np.asarray(model.K)[:4, :4], np.asarray(model.C)[:4, :4]
    damped = hd.mechss(model.M[:4, :4], C + K / 16.0, K, dofs=model.dofs[:4]).select(inputs="F_w2", outputs="w2")
    reduced = EXAMPLE.guyan(damped, ["phi1", "phi2"])
    points = 2j * np.pi * np.geomspace(0.1, 100.0, 20)
    assert_allclose(reduced(points), damped(points), rtol=ROUNDING)
    values = [hd.pencil_structure(each).finite_eigenvalues for each in (damped, reduced)]
    assert len(values[0]) == len(values[1]) + 2
    assert_allclose(np.sort(np.abs(values[0] + 16.0))[:2], 0.0, atol=1e-10)
    assert EXAMPLE.eigenvalue_error(values[0], values[1]) < ROUNDING


@pytest.mark.parametrize("solver", IMPLICIT)
def test_work_of_implicit_solvers_grows_while_they_resolve_an_undamped_vibration(solver: str) -> None:
    """From 1e-2 to 1e-4, however rounding falls."""
    (low, high) = (work(CANTILEVER, epsilon, solver) for epsilon in (1e-2, 1e-4))
    assert DOUBLING < np.sqrt(high / low) < TRIPLING
    assert "about doubles or triples with each decade" in TEXT


@pytest.mark.parametrize(
    ("solver", "count", "text"),
    [
        ("RK45", 10472, "10472"),
        ("BDF", 1000, "1000"),
        ("BDF", 1358, "> 1000"),
        ("BDF", 2500, "> 2000"),
        ("Radau", 14169, "> 10000"),
        ("LSODA", 20001, "> 20000"),
    ],
)
def test_counts_that_hang_on_rounding_are_printed_as_what_they_exceed(solver: str, count: int, text: str) -> None:
    """By the largest of 1, 2, 5 times a power of ten below four fifths of the count."""
    assert EXAMPLE.printed_count(solver, count) == text


def test_work_of_an_explicit_solver_grows_as_one_over_epsilon() -> None:
    """Ten times the evaluations for a tenth of the mass on the half DOFs."""
    assert_allclose(work(MOUNT, 1e-3, "RK45") / work(MOUNT, 1e-2, "RK45"), 10.0, rtol=0.1)


@pytest.mark.parametrize("solver", IMPLICIT)
def test_implicit_solvers_hardly_care_about_half_dofs(solver: str) -> None:
    """In the mount at most about twice the work of the exact system; with x of the cantilever alone, a quarter more."""
    static = CANTILEVER.condensed["static DOFs"]
    only_x = dataclasses.replace(
        CANTILEVER, model=EXAMPLE.guyan(CANTILEVER.model, static), inertia=np.array([0.0, 0.0, 1.0])
    )
    for case, most in ((MOUNT, 2.3), (only_x, 1.3)):
        exact = EXAMPLE.evaluations(hd.mech2ss(case.model), case, solver)
        assert max(work(case, epsilon, solver) for epsilon in (1e-2, 1e-4, 1e-6, 1e-8, 1e-12)) < most * exact


def test_small_inertia_on_a_static_dof_vibrates_almost_undamped() -> None:
    """Frequency and damping ratio of the cantilever's fastest pair, as the page has them."""
    values = np.linalg.eigvals(EXAMPLE.textbook(EXAMPLE.with_small_mass(CANTILEVER, 1e-6)).A)
    fastest = values[np.argmax(values.imag)]
    assert f"{fastest.imag:,.0f} rad/s".replace(",", " ") in TEXT
    assert_allclose(-fastest.real / abs(fastest), 1.5e-11, rtol=TWO_DIGITS)
    assert "damping ratio of 1.5e-11" in TEXT


def test_radau_recovers_later_with_tighter_tolerances(monkeypatch: pytest.MonkeyPatch) -> None:
    """About six times the work of the exact system from 1e-5 to 1e-9, the same at 1e-10; more for more digits."""
    exact = EXAMPLE.evaluations(hd.mech2ss(CANTILEVER.model), CANTILEVER, "Radau")
    for epsilon, times in ((1e-5, 6.5), (1e-9, 6.5), (1e-10, 1.0)):
        assert_allclose(work(CANTILEVER, epsilon, "Radau") / exact, times, rtol=STEP_CONTROL)
    monkeypatch.setattr(EXAMPLE, "LIMIT", 6000)
    assert work(CANTILEVER, 1e-5, "Radau") <= 6000
    monkeypatch.setattr(EXAMPLE, "RTOL", 1e-6)
    monkeypatch.setattr(EXAMPLE, "ATOL", 1e-9)
    assert work(CANTILEVER, 1e-5, "Radau") > 6000


@pytest.mark.parametrize("epsilon", [1e-5, 1e-8, 1e-12])
def test_bdf_formulas_above_order_two_are_what_stops_on_undamped_vibration(
    epsilon: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """BDF and LSODA need far more than 4000 evaluations, LSODA held to order two, which is A-stable, fewer."""
    monkeypatch.setattr(EXAMPLE, "LIMIT", 5000)
    assert work(CANTILEVER, epsilon, "BDF") > 5000
    assert work(CANTILEVER, epsilon, "LSODA") > 5000
    system = EXAMPLE.textbook(EXAMPLE.with_small_mass(CANTILEVER, epsilon))
    b, calls = system.B[:, 0] / CANTILEVER.model(0.0).real, []

    def slope(t: float, x: FloatArray) -> FloatArray:
        calls.append(t)
        return np.asarray(system.A @ x + b)

    run = scipy.integrate.ode(slope, lambda _t, _x: system.A)
    run.set_integrator("lsoda", rtol=EXAMPLE.RTOL, atol=EXAMPLE.ATOL, nsteps=5000, max_order_s=2)
    run.set_initial_value(np.zeros(len(b)), 0.0)
    run.integrate(EXAMPLE.HORIZON)
    assert run.successful()
    assert len(calls) < 4000


def test_solver_that_gives_up_is_not_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its count would look like little work."""
    gave_up = SimpleNamespace(status="running", nfev=7)

    def step() -> str:
        gave_up.status = "failed"
        return "step size is too small"

    gave_up.step = step
    monkeypatch.setattr(scipy.integrate, "RK45", lambda *_, **__: gave_up)
    with pytest.raises(RuntimeError, match="step size is too small"):
        work(MOUNT, 1e-2, "RK45")
