"""Motions that a stiffness leaves free, and those that it nearly does."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from halfdof_ctrl.errors import EnergyFormError
from halfdof_ctrl.reduction.energy.rigid import stiffness_factor
from support.beams import beam_matrices

ROUNDING = 1e-14  #: relative, of small integers


def names(K: np.ndarray) -> tuple[str, ...]:
    """Name as many DOFs as there are."""
    return tuple(f"q{j}" for j in range(len(K)))


@pytest.mark.parametrize("elements", [4, 40])
def test_free_beam_has_a_translation_and_a_rotation(elements: int) -> None:
    """Both are straight lines: deflection a + b x, slope b, though the entries of K are rounded."""
    _, K = beam_matrices(elements, clamped=False)
    factor = stiffness_factor(K, 0, names(K))
    assert factor.supports.size == 2
    x = np.repeat(np.linspace(0.0, 1.0, elements + 1), 2)
    translation, rotation = np.zeros((2, len(K)))
    translation[::2], rotation[::2], rotation[1::2] = 1.0, x[::2], 1.0
    for line in (translation, rotation):
        assert_allclose(factor.motions @ line[factor.supports], line, rtol=0, atol=1e-9)


def test_clamped_beam_is_not_free() -> None:
    """Of 600 DOFs, the first bending mode is softer than 1e-9 of the diagonal, and stays."""
    _, K = beam_matrices(300)
    assert stiffness_factor(K, 0, names(K)).supports.size == 0


@pytest.mark.parametrize("soft", [1e-10, 1e-13])
def test_soft_ground_is_not_forced_free(soft: float) -> None:
    """Two masses with a spring of 1 between them and one of 1e-10 to the ground."""
    K = np.array([[1.0 + soft, -1.0], [-1.0, 1.0]])
    factor = stiffness_factor(K, 0, ("a", "b"))
    assert factor.supports.size == 0
    assert_allclose(np.linalg.det(factor.U) ** 2, soft, rtol=1e-3)


def test_free_motions_of_separate_parts_are_told_apart() -> None:
    """Two pairs joined by springs of 1 and 1e8, and a DOF without any spring: three free motions."""
    K = np.zeros((5, 5))
    K[:2, :2] = [[1, -1], [-1, 1]]
    K[3:, 3:] = [[1e8, -1e8], [-1e8, 1e8]]
    factor = stiffness_factor(K, 0, names(K))
    assert factor.supports.size == 3
    assert_allclose(K @ factor.motions, 0.0, rtol=0, atol=1e-7 * ROUNDING)


def test_static_dofs_are_no_supports() -> None:
    """A massless node between two free masses, first in the order."""
    K = np.array([[300.0, -100, -200], [-100, 100, 0], [-200, 0, 200]])
    factor = stiffness_factor(K, 1, ("node", "a", "c"))
    assert factor.supports.tolist() == [1]
    assert_allclose(factor.motions[:, 0], 1.0, rtol=ROUNDING)


@pytest.mark.parametrize(
    ("K", "first", "reason", "text"),
    [
        ([[1.0, -2.0], [-2.0, 1.0]], 0, "indefinite", "negative elastic energy"),
        ([[-1.0]], 0, "indefinite", "negative elastic energy"),
        ([[0.0, 1.0], [1.0, 4.0]], 0, "indefinite", "negative elastic energy"),
        ([[1.0, -1.0, 0.0], [-1.0, 1.0, 0.0], [0.0, 0.0, 1.0]], 2, "floating", "moves without any force"),
    ],
)
def test_stiffness_without_an_energy_is_refused(K: list[list[float]], first: int, reason: str, text: str) -> None:
    """Indefinite at a glance, indefinite by a pivot, static DOFs that float."""
    with pytest.raises(EnergyFormError, match=text) as caught:
        stiffness_factor(np.array(K), first, names(np.array(K)))
    assert caught.value.reason == reason
    assert caught.value.dofs
