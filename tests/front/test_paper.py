"""The paper's printed formulas, corrected where its errata say so, against the one solve of the package.

Simionatto, Miyasato, Melo and Dias Junior, Singular mass matrices and half degrees of freedom. J_i, J_c, J_k select
the inertial, half and static DOFs; every other symbol is the paper's, and so is the chain of inverses.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from halfdof_ctrl import exact_reduction, frequency_response, hydromount, mech2ss, pencil_structure
from support.comparison import paired
from support.structures import Structure, on_axis, unsymmetric_structures

FloatArray = npt.NDArray[np.float64]

CHAIN = 1e-11  # the paper's nested inverses of diagonally dominant blocks, up to 15 DOFs, lose four digits
LAST_DIGIT = 4 * np.finfo(float).eps  # "to the last digit but one"
ROOTS = 1e-14  # design, section 7: eigenvalues of A against the exact roots
RATIONAL = 1e-12  # H(jw) within 1e-12 of the exact rational function
PUBLISHED = 5e-5  # the paper prints four decimals
PAPER_EIGENVALUES = np.array([-0.6897 + 17.7059j, -0.6897 - 17.7059j, -8.7797, -3.1742])
EXACT_EIGENVALUES = np.array(
    [
        -0.6897228096519806 + 17.70591511240659j,
        -0.6897228096519806 - 17.70591511240659j,
        -8.779694309560127,
        -3.174193404469245,
    ]
)  # errata: roots of 3 s^4 + 40 s^3 + 1075 s^2 + 11375 s + 26250 in 30-digit arithmetic


@dataclass(frozen=True)
class PaperResult:
    """What the paper's section computes."""

    alpha: FloatArray
    gamma: FloatArray
    A: FloatArray
    B: FloatArray


def selections(structure: Structure) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Give J_i, J_c, J_k by the null columns of M and C."""
    unit = np.eye(structure.size)
    inertial = structure.M.any(axis=0)
    half = ~inertial & structure.C.any(axis=0)
    return unit[:, inertial], unit[:, half], unit[:, ~inertial & ~half]


def section_2_1(structure: Structure) -> PaperResult:
    """Equations (11), (12) and the matrices below them: inertial and half DOFs."""
    M, C, _ = structure.matrices
    Ji, Jc, _ = selections(structure)
    unit = np.eye(structure.size)
    inv = np.linalg.inv
    left = Ji.T @ (unit - C @ Jc @ inv(Jc.T @ C @ Jc) @ Jc.T)
    gamma = inv(left @ M @ Ji) @ left
    alpha = inv(Jc.T @ C @ Jc) @ Jc.T @ (unit - M @ Ji @ gamma)
    return assembled_result(structure, alpha, gamma)


def section_2_2(structure: Structure) -> PaperResult:
    """Equation (20) and the matrices below it: inertial and static DOFs."""
    M, _, K = structure.matrices
    Ji, _, Jk = selections(structure)
    unit = np.eye(structure.size)
    inv = np.linalg.inv
    left = Ji.T @ (unit - K @ Jk @ inv(Jk.T @ K @ Jk) @ Jk.T)
    gamma = inv(left @ M @ Ji) @ left
    return assembled_result(structure, np.zeros((0, structure.size)), gamma)


def section_2_3(structure: Structure) -> PaperResult:
    """Equations (29) to (32), with delta as the errata correct it: all three kinds of DOF."""
    M, C, K = structure.matrices
    Ji, Jc, Jk = selections(structure)
    unit = np.eye(structure.size)
    inv = np.linalg.inv
    P = unit - K @ Jk @ inv(Jk.T @ K @ Jk) @ Jk.T
    delta = inv(Jc.T @ P @ C @ Jc) @ Jc.T @ P
    beta = inv(Jk.T @ K @ Jk) @ Jk.T @ (unit - C @ Jc @ delta)
    left = Ji.T @ (unit - C @ Jc @ delta - K @ Jk @ beta)
    gamma = inv(left @ M @ Ji) @ left
    alpha = delta @ (unit - M @ Ji @ gamma)
    return assembled_result(structure, alpha, gamma)


def assembled_result(structure: Structure, alpha: FloatArray, gamma: FloatArray) -> PaperResult:
    """Assemble [A] and [B] as at the end of section 2.3 (of which those of 2.1 and 2.2 are parts)."""
    _, C, K = structure.matrices
    Ji, Jc, _ = selections(structure)
    n_i, n_c, n = Ji.shape[1], Jc.shape[1], structure.size
    A = np.block(
        [
            [np.zeros((n_i, n_i)), np.zeros((n_i, n_c)), np.eye(n_i)],
            [-alpha @ K @ Ji, -alpha @ K @ Jc, -alpha @ C @ Ji],
            [-gamma @ K @ Ji, -gamma @ K @ Jc, -gamma @ C @ Ji],
        ]
    )
    return PaperResult(alpha, gamma, A, np.vstack([np.zeros((n_i, n)), alpha, gamma]))


def assert_same_as_paper(structure: Structure, paper: PaperResult) -> None:
    """Compare alpha, gamma, A and B of the package with the paper's."""
    reduction = exact_reduction(structure.model())
    assert reduction.method == "selection"
    for ours, theirs in (
        (reduction.alpha, paper.alpha),
        (reduction.gamma, paper.gamma),
        (reduction.A, paper.A),
        (reduction.B, paper.B),
    ):
        assert_allclose(ours, theirs, rtol=0.0, atol=CHAIN * np.abs(theirs).max(initial=1e-3))


COUNTS = st.integers(1, 5)


@given(structure=unsymmetric_structures(COUNTS, COUNTS, st.just(0)))
def test_inertial_and_half_dofs_follow_section_2_1(structure: Structure) -> None:
    """Equations (11), (12) with their chain of inverses give the alpha, gamma, A, B of the one solve."""
    assert_same_as_paper(structure, section_2_1(structure))


@given(structure=unsymmetric_structures(COUNTS, st.just(0), COUNTS))
def test_inertial_and_static_dofs_follow_section_2_2(structure: Structure) -> None:
    """Equation (20) gives the gamma, A, B of the one solve."""
    assert_same_as_paper(structure, section_2_2(structure))


@given(structure=unsymmetric_structures(COUNTS, COUNTS, COUNTS))
def test_all_three_kinds_of_dofs_follow_section_2_3(structure: Structure) -> None:
    """Equations (29) to (32) give the alpha, gamma, A, B of the one solve."""
    assert_same_as_paper(structure, section_2_3(structure))


@given(structure=unsymmetric_structures(COUNTS, COUNTS, COUNTS))
def test_static_recovery_is_the_papers_third_block(structure: Structure) -> None:
    """The rows ``beta (I - M J_i gamma)`` of (30), (31) recover the static displacements from x and u."""
    M, C, K = structure.matrices
    Ji, Jc, Jk = selections(structure)
    paper = section_2_3(structure)
    inv = np.linalg.inv
    P = np.eye(structure.size) - K @ Jk @ inv(Jk.T @ K @ Jk) @ Jk.T
    delta = inv(Jc.T @ P @ C @ Jc) @ Jc.T @ P
    beta = inv(Jk.T @ K @ Jk) @ Jk.T @ (np.eye(structure.size) - C @ Jc @ delta)
    recovery = beta @ (np.eye(structure.size) - M @ Ji @ paper.gamma)
    reduction = exact_reduction(structure.model())
    X = np.hstack([-recovery @ K @ Ji, -recovery @ K @ Jc, -recovery @ C @ Ji])
    assert_allclose(Jk.T @ reduction.displacement.X, X, rtol=0.0, atol=CHAIN)
    assert_allclose(Jk.T @ reduction.displacement.U[0], recovery, rtol=0.0, atol=CHAIN)


def test_mount_has_the_papers_alpha_and_gamma() -> None:
    """Section 3 prints alpha and gamma as fractions."""
    reduction = exact_reduction(hydromount())
    assert_allclose(reduction.alpha, [[0, 1 / 100, 0], [0, 0, 1 / 300]], rtol=LAST_DIGIT)
    assert_allclose(reduction.gamma, [[1 / 20, 1 / 20, 0]], rtol=LAST_DIGIT)


def test_mount_has_the_papers_a_and_b() -> None:
    """Section 3 prints A and B; entry (3, 3) is -10/3 in place of the misprint -1/300."""
    sys = mech2ss(hydromount())
    A = [[0, 0, 0, 1], [0, -10, 0, 1], [5 / 3, 0, -10 / 3, 0], [-275, -50, 25, 0]]
    B = [[0, 0, 0], [0, 1 / 100, 0], [0, 0, 1 / 300], [1 / 20, 1 / 20, 0]]
    assert_allclose(sys.A, np.array(A), rtol=LAST_DIGIT)
    assert_allclose(sys.B, np.array(B), rtol=LAST_DIGIT)
    assert_allclose(sys.C, np.eye(3, 4), rtol=0.0)
    assert_allclose(sys.D, np.zeros((3, 3)), rtol=0.0)


def test_mount_states_are_the_papers_states() -> None:
    """The state is (y, y1, y2, y'), in the paper's order and under those names."""
    assert mech2ss(hydromount()).state_labels == ["y", "y1", "y2", "y_dot"]


def test_mount_eigenvalues_equal_the_exact_roots() -> None:
    """The eigenvalues of A are the roots of the exact characteristic polynomial, each to 1e-14."""
    eigenvalues = np.linalg.eigvals(exact_reduction(hydromount()).A)
    assert_allclose(paired(eigenvalues, EXACT_EIGENVALUES), EXACT_EIGENVALUES, rtol=ROOTS)


@pytest.mark.parametrize("route", ["reduction", "descriptor"])
def test_mount_eigenvalues_show_the_published_digits(route: str) -> None:
    """Section 3: -0.6897 +- 17.7059i, -8.7797, -3.1742 before and after the reduction."""
    model = hydromount()
    found = mech2ss(model).poles() if route == "reduction" else pencil_structure(model).finite_eigenvalues
    assert_allclose(paired(found, PAPER_EIGENVALUES), PAPER_EIGENVALUES, rtol=0.0, atol=PUBLISHED)


def test_mount_loses_two_infinite_eigenvalues() -> None:
    """The descriptor form has two infinite eigenvalues, and both routes agree on the four others to 1e-13."""
    structure, reduction = pencil_structure(hydromount()), exact_reduction(hydromount())
    assert structure.n_infinite == reduction.n_infinite == 2
    difference = structure.finite_eigenvalues - paired(np.linalg.eigvals(reduction.A), structure.finite_eigenvalues)
    assert np.abs(difference).max() < 1e-13


def receptance(s: npt.NDArray[np.complex128]) -> npt.NDArray[np.complex128]:
    """Give y/F of the mount from the errata, exactly rational."""
    numerator = 3 * s**2 + 40 * s + 100
    return np.asarray(numerator / (20 * (3 * s**4 + 40 * s**3 + 1075 * s**2 + 11375 * s + 26250)))


def test_mount_receptance_is_the_exact_rational_function() -> None:
    """The state space, the descriptor form and the fast frequency response all give the errata's y/F."""
    model = hydromount().select(inputs="F_y", outputs="y")
    omega = np.geomspace(1e-3, 1e5, 400)
    desired = receptance(on_axis(omega))
    sys = mech2ss(model)
    assert_allclose(sys(1j * omega), desired, rtol=RATIONAL)
    assert_allclose(model(1j * omega), desired, rtol=RATIONAL)
    assert_allclose(frequency_response(sys, omega).complex, desired, rtol=RATIONAL)


def test_mount_receptance_off_the_axis_is_the_exact_rational_function() -> None:
    """The same on a grid of s in the right and left half plane."""
    model = hydromount().select(inputs="F_y", outputs="y")
    real, imaginary = np.meshgrid([-30.0, -1.5, 0.0, 2.0, 100.0], [0.0, 0.7, 17.7, 300.0])
    s = np.asarray(real + 1j * imaginary, dtype=np.complex128).ravel()
    assert_allclose(mech2ss(model)(s), receptance(s), rtol=RATIONAL)
    assert_allclose(model(s), receptance(s), rtol=RATIONAL)
