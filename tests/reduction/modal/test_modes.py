"""The lowest modes against dense eigenvalue solvers."""

from typing import Any

import numpy as np
import pytest
import scipy.linalg
from numpy.testing import assert_allclose
from scipy.sparse import csc_array, diags_array
from scipy.sparse.linalg import ArpackError

from halfdof_ctrl.base.errors import ParameterError
from halfdof_ctrl.reduction.modal import modes, slices
from halfdof_ctrl.reduction.modal.modes import ShiftedStiffness, count_below, is_unsymmetric, lowest_modes
from support.fe_models import Structure, space_frame, spring_grid

DIGITS = 1e-8  # of frequencies of small frames, whose condition is 1e6


def with_mass(structure: Structure, share: float = 1.0) -> csc_array:
    """Give a mass to a share of the DOFs."""
    generator = np.random.default_rng(0)
    return csc_array(
        diags_array(generator.uniform(1.0, 2.0, structure.size) * (generator.random(structure.size) < share))
    )


def exact_frequencies(K: csc_array, M: csc_array) -> Any:  # noqa: ANN401
    """Give all finite natural frequencies [rad/s] by the dense solver, rising."""
    inverse = scipy.linalg.eigh(M.toarray(), K.toarray(), eigvals_only=True)
    return np.sort(1.0 / np.sqrt(inverse[inverse > 1e-14 * inverse.max()]))


@pytest.mark.parametrize("few", [0, 10_000])
@pytest.mark.parametrize("structure", [space_frame(3, 3, 3, 1), spring_grid(15, 11, 0)])
@pytest.mark.parametrize("share", [1.0, 0.3])
def test_modes_are_those_of_the_dense_solver(
    structure: Structure, share: float, few: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By Lanczos and from the flexibility, with mass everywhere or at some DOFs, multiple modes included."""
    monkeypatch.setattr(modes, "FEW_MASSES", few)
    K, M = structure.K, with_mass(structure, share)
    stiffness = ShiftedStiffness.factorized(K, M)
    assert stiffness is not None
    assert stiffness.sigma == 0.0
    found = lowest_modes(stiffness, 9)
    assert_allclose(found.omega, exact_frequencies(K, M)[:9], rtol=DIGITS)
    assert_allclose(found.shapes.T @ (M @ found.shapes), np.eye(9), atol=1e-9)
    energy = np.asarray(found.shapes.T @ (K @ found.shapes))
    assert_allclose(energy / found.omega / found.omega[:, None], np.eye(9), atol=1e-6)


@pytest.mark.parametrize("few", [0, 10_000])
def test_a_free_structure_has_rigid_modes(few: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """A net without ground: K is singular, the first frequency is zero to rounding, the others are right."""
    monkeypatch.setattr(modes, "FEW_MASSES", few)
    K = spring_grid(9, 8, 0).K
    K = csc_array(K - diags_array(np.asarray(K.sum(axis=1))))
    M = csc_array(diags_array(np.linspace(1.0, 2.0, 72)))
    stiffness = ShiftedStiffness.factorized(K, M)
    assert stiffness is not None
    assert stiffness.sigma < 0.0
    omega = lowest_modes(stiffness, 5).omega
    exact = np.sqrt(np.maximum(scipy.linalg.eigh(K.toarray(), M.toarray(), eigvals_only=True), 0.0))[:5]
    assert omega[0] < 1e-4 * omega[1]
    assert_allclose(omega[1:], exact[1:], rtol=DIGITS)
    assert count_below(stiffness, 1.001 * float(exact[3])) == 4


def test_modes_below_a_frequency_are_counted_without_being_found() -> None:
    """Sylvester's law of inertia, between any two frequencies."""
    structure = space_frame(3, 2, 3, 1)
    K, M = structure.K, with_mass(structure)
    stiffness = ShiftedStiffness.factorized(K, M)
    assert stiffness is not None
    omega = exact_frequencies(K, M)
    for count in (0, 1, 7, 30, omega.size - 1):
        between = np.sqrt((omega[count - 1] if count else 0.1 * omega[0]) * omega[count])
        assert count_below(stiffness, float(between)) == count


def test_more_modes_than_there_are_give_all() -> None:
    """Three masses on a net."""
    structure = spring_grid(6, 6, 3)
    stiffness = ShiftedStiffness.factorized(structure.K, structure.M)
    assert stiffness is not None
    assert lowest_modes(stiffness, 20).omega.size == 3
    massless = ShiftedStiffness.factorized(structure.K, csc_array(structure.K.shape))
    assert massless is not None
    assert lowest_modes(massless, 20).omega.size == 0


def test_what_floats_without_mass_has_no_modes() -> None:
    """K is singular, and mass does not help."""
    assert ShiftedStiffness.factorized(csc_array(np.diag([1.0, 0.0])), csc_array(np.diag([1.0, 0.0]))) is None


def test_lanczos_that_does_not_converge_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """With the number that was wanted, and what to look at, whatever ARPACK raises."""

    def fails(*_: object, **__: object) -> None:
        raise ArpackError(-9999)

    monkeypatch.setattr(modes, "FEW_MASSES", 0)
    monkeypatch.setattr(modes, "eigsh", fails)
    monkeypatch.setattr(slices, "eigsh", fails)
    structure = spring_grid(9, 9, 0)
    stiffness = ShiftedStiffness.factorized(structure.K, with_mass(structure))
    assert stiffness is not None
    with pytest.raises(ParameterError, match=r"does not find the \d+ modes that lie between"):
        lowest_modes(stiffness, 5)


def test_slices_find_clustered_modes_all() -> None:
    """A chain of 300 unit masses on hard springs has 300 modes within 0.2 per cent: each is found, by closed form.

    omega^2 = k + 4 c sin^2(j pi / (2 n + 2)).
    """
    n, ground, coupling = 300, 1e4, 10.0
    chain = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    K, M = csc_array(coupling * chain + ground * np.eye(n)), csc_array(np.eye(n))
    squares, shapes = slices.modes_by_slices(K, M, 200)
    desired = ground + 4.0 * coupling * np.sin(np.arange(1, 201) * np.pi / (2 * n + 2)) ** 2
    assert_allclose(squares, desired, rtol=1e-12)
    assert_allclose(shapes.T @ shapes, np.eye(200), atol=1e-8)


def test_symmetry_is_judged_by_the_largest_entry() -> None:
    """Rounding is no asymmetry."""
    matrix = np.array([[2.0, 1.0], [1.0 + 1e-12, 3.0]])
    assert is_unsymmetric(csc_array(matrix)) == 0.0
    matrix[1, 0] = 1.3
    assert is_unsymmetric(csc_array(matrix)) == pytest.approx(0.1)
    assert is_unsymmetric(csc_array((2, 2))) == 0.0
