"""What large sparse models lose: as much as is measured by other solves, and nothing where masses are mixed."""

import re
import warnings
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from numpy.testing import assert_allclose
from scipy.sparse import coo_array, csc_array, diags_array
from scipy.sparse.linalg import splu

from halfdof_ctrl import ExactReduction, SecondOrderModel, exact_reduction, mechss
from halfdof_ctrl.base.exact_products import ExactPolynomial
from halfdof_ctrl.base.spectrum import balanced_states
from halfdof_ctrl.errors import CloseDecisionWarning, LostDigitsWarning
from halfdof_ctrl.model.free_motions import free_motion_count
from halfdof_ctrl.reduction.sparse import loss as sparse_loss
from halfdof_ctrl.reduction.sparse.loss import lifted, measured_sparsely

SIZE = 1.5  # what is lost is measured to a digit
ROUNDS = 4  # of refinement
ALLOWED = 1e-9  # what may be lost without a word

FloatArray = npt.NDArray[np.float64]
ComplexArray = npt.NDArray[np.complex128]


def chain(springs: FloatArray, masses: FloatArray, dampers: FloatArray) -> tuple[csc_array, csc_array, csc_array]:
    """Return M, C, K of masses in a row, the first one on a spring of 1 N/m to the ground."""
    parts = []
    for values, ground in ((dampers, 0.0), (springs, 1.0)):
        main = np.append(values, 0.0) + np.append(ground, values)
        parts.append(csc_array(diags_array([main, -values, -values], offsets=[0, 1, -1])))
    return csc_array(diags_array(masses)), parts[0], parts[1]


def cantilever(elements: int) -> tuple[csc_array, csc_array, csc_array]:
    """Return M, C, K of a clamped beam of unit length, lumped masses, in displacements and angles without inertia."""
    long = 1.0 / elements
    element = np.array([[12.0, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]]) / long**3
    element = np.outer([1, long, 1, long], [1, long, 1, long]) * element
    places = 2 * np.arange(elements)[:, None] + np.arange(4)
    at = np.repeat(places, 4, axis=1).ravel(), np.tile(places, (1, 4)).ravel()
    size = 2 * elements + 2
    K = csc_array(csc_array(coo_array((np.tile(element.ravel(), elements), at), shape=(size, size)))[2:, 2:])
    moving = 2 * np.arange(elements)
    M = csc_array((np.full(elements, long), (moving, moving)), shape=K.shape)
    return M, csc_array(0.1 * M), K


def seen_at(model: SecondOrderModel, dofs: list[str]) -> SecondOrderModel:
    """Drive and see some DOFs."""
    return model.select([f"F_{dof}" for dof in dofs], dofs)


def reduced(model: SecondOrderModel) -> ExactReduction:
    """Reduce without a word."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", LostDigitsWarning)
        return exact_reduction(model)


def lost_at(model: SecondOrderModel, reduction: ExactReduction, omega: float) -> FloatArray:
    """Return what is lost of each channel at a frequency, by factors of P(s) and of s I - A, both refined."""
    s, output = 1j * omega, reduction.output
    P = [csc_array(part) for part in model.quadratics.P]
    true = refined(P, splu(csc_array(P[0] + s * P[1] + s**2 * P[2])).solve, s, csc_array(model.B).toarray())
    A, scale = balanced_states(reduction.A)
    inverse = np.linalg.inv(s * np.eye(len(A)) - A)
    said = refined([-A, np.eye(len(A))], lambda right: inverse @ right, s, reduction.B / scale[:, None])
    H = np.asarray(csc_array(model.F) @ true)
    return np.asarray(np.abs(output.X * scale @ said + output.direct(len(model.inputs)) - H) / np.abs(H))


def refined(parts: Any, solve: Any, s: complex, right: FloatArray) -> ComplexArray:  # noqa: ANN401
    """Solve with residuals in twice the working precision."""
    exact, force = ExactPolynomial(parts), right.astype(np.complex128)
    x = np.asarray(solve(force))
    for _ in range(ROUNDS):
        x = x + solve(exact.residual(s, x, force))
    return x


def test_a_chain_of_springs_over_eight_decades_says_what_it_loses() -> None:
    """W is the mass matrix, whose condition is that of ten masses: it says nothing of what A loses."""
    generator = np.random.default_rng(3)
    matrices = chain(10.0 ** generator.uniform(0, 8, 519), generator.uniform(1, 3, 520), np.full(519, 0.05))
    model = seen_at(mechss(*matrices), ["q0", "q300"])
    with pytest.warns(LostDigitsWarning, match="stores them lose") as said:
        reduction = exact_reduction(model)
    found = reduction.solution.evidence.loss
    told = float(re.findall(r"lose ([0-9.e-]+) of", str(said[0].message))[0])
    assert reduction.rcond > 1e-3
    channel = model.outputs.index(found.output), model.inputs.index(found.source)
    true = lost_at(model, reduction, found.omega)[channel]
    assert true / SIZE < told < true * SIZE


def test_a_cantilever_with_condensed_angles_says_what_it_loses() -> None:
    """The stored numbers of 260 elements hold the first mode, 3.516 rad/s, to some millionths."""
    model = seen_at(mechss(*cantilever(260)), ["q518"])
    with pytest.warns(LostDigitsWarning, match=r"of q518 from F_q518 at 3\.5"):
        loss = exact_reduction(model).solution.evidence.loss
    true = lost_at(model, reduced(model), loss.omega)[0, 0]
    assert true / SIZE < loss.value < true * SIZE


@pytest.mark.parametrize("letter", ["M", "C"])
@pytest.mark.parametrize("power", [20, 30])
def test_blocks_that_are_nearly_singular_get_coordinates_of_their_own(letter: str, power: int) -> None:
    """Pairs ``[1, 1; 1, 1 + 2^-k]`` of masses or of dampers in a chain lose nothing once they are mixed."""
    n = 520
    pairs = np.arange(0, 40, 2)
    values = np.tile([1.0, 1.0, 1.0, 1.0 + 2.0**-power], pairs.size)
    at = np.stack([pairs, pairs, pairs + 1, pairs + 1], axis=1), np.stack([pairs, pairs + 1] * 2, axis=1)
    block = csc_array(coo_array((values, (at[0].ravel(), at[1].ravel())), shape=(n, n)))
    masses = np.where(np.arange(n) < 41, 0.0, 1.0)
    M, C, K = chain(np.linspace(1.0, 3.0, n - 1), masses, np.zeros(n - 1))
    model = mechss(M + block, C, K) if letter == "M" else mechss(M, C + block, K)
    model = seen_at(model, ["q0", "q39", "q60"])
    reduction = exact_reduction(model)
    assert reduction.method == "orthogonal"
    assert reduction.order == 2 * (n - 41) + 2 * pairs.size * (1 + (letter == "M"))
    assert lost_at(model, reduction, 0.3).max() < ALLOWED


def test_states_follow_from_what_solves_with_the_pencil() -> None:
    """``(s I - A)^-1`` of masses, half and static DOFs, those of a mixed pair among them."""
    n = 530
    M, C, K = chain(np.linspace(1.0, 3.0, n - 1), np.where(np.arange(n) % 3 == 1, 1.0, 0.0), np.zeros(n - 1))
    C = C + csc_array(diags_array(np.where(np.arange(n) % 3 == 0, 0.5, 0.0)))
    block = csc_array((np.ones(4), ([0, 0, 2, 2], [0, 2, 0, 2])), shape=(n, n))
    for mass in (M, M + block):
        solution = reduced(seen_at(mechss(mass, C, K), ["q4"])).solution
        s, right = 0.7j, np.random.default_rng(0).standard_normal((len(solution.A), 2)) + 0j
        pencil = splu(csc_array(K + s * C + s**2 * csc_array(mass)))
        found = lifted(solution, pencil.solve, s)(right)  # type: ignore[arg-type]
        desired = np.linalg.solve(s * np.eye(len(solution.A)) - solution.A, right)
        assert_allclose(found, desired, rtol=0.0, atol=1e-10 * np.abs(desired).max())


def test_large_models_are_looked_at_by_a_mixture_of_their_inputs(monkeypatch: pytest.MonkeyPatch) -> None:
    """With few states and the factors of W: an even chain loses nothing, one of soft and stiff springs is found out."""
    monkeypatch.setattr(sparse_loss, "MIXED_FROM", 500)
    monkeypatch.setattr(sparse_loss, "FACTORIZED_DOFS", 500)
    masses = np.where(np.arange(600) % 60 == 0, 1.0, 0.0)
    M, C, K = chain(np.ones(599), masses, np.zeros(599))
    held = csc_array(K + csc_array(diags_array(np.full(600, 0.5))))
    even = reduced(seen_at(mechss(M, C, held), ["q0", "q120"]))
    assert not measured_sparsely(even.solution).found  # type: ignore[arg-type]
    springs = np.where(np.arange(599) % 60 == 30, 1.0, 1e9)
    model = seen_at(mechss(*chain(springs, masses, np.zeros(599))), ["q0", "q120"])
    with pytest.warns(LostDigitsWarning, match="stores them lose"):
        loss = exact_reduction(model).solution.evidence.loss
    true = lost_at(model, reduced(model), loss.omega)[model.outputs.index(loss.output), model.inputs.index(loss.source)]
    assert true / SIZE < loss.value < true * SIZE


def test_free_chains_lose_nothing_worth_a_word() -> None:
    """K is singular: slow modes are looked for beside the origin."""
    n = 540
    M, C, K = chain(np.ones(n - 1), np.ones(n), np.full(n - 1, 0.01))
    K = csc_array(K - csc_array(([1.0], ([0], [0])), shape=(n, n)))
    assert free_motion_count(M, C, K) is not None
    exact_reduction(seen_at(mechss(M, C, K), ["q0", "q200"]))


def test_rounded_dampers_that_end_in_zero_bits_are_no_close_decision() -> None:
    """Among hundreds of rounded pairs some have two zeros at their end by chance, and are as well known as the rest."""
    n = 900
    generator = np.random.default_rng(1)
    C = csc_array((n, n))
    pairs = np.arange(0, n - 3, 3)
    c, d = generator.uniform(0.01, 1.0, (2, pairs.size))
    for rows, columns, value in (
        (0, 0, c),
        (0, 1, -c),
        (1, 0, -c),
        (1, 1, c + d),
        (1, 2, -d),
        (2, 1, -d),
        (2, 2, d),
    ):
        C = C + csc_array((value, (pairs + rows, pairs + columns)), shape=(n, n))
    M, _, K = chain(np.ones(n - 1), np.where(np.arange(n) == n - 1, 1.0, 0.0), np.zeros(n - 1))
    with warnings.catch_warnings():
        warnings.simplefilter("error", CloseDecisionWarning)
        reduction = exact_reduction(seen_at(mechss(M, C, K), ["q0"]))
    assert reduction.order == 2 + 2 * pairs.size
