"""What `repr` and `info` say of models that are negative, indefinite, unsymmetric or unstable."""

from pathlib import Path

import hypothesis.strategies as st
import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given

from halfdof_ctrl import hydromount, mechss, save_model
from halfdof_ctrl.cli import main
from halfdof_ctrl.model.oddities import oddities
from support.nets import net
from support.structures import Structure, assembly, passive, structures

AB = ("a", "b")


@pytest.mark.parametrize(
    ("matrix", "said"),
    [
        ([[2.0, -1.0], [-1.0, 2.0]], None),
        ([[1.0, -1.0], [-1.0, 1.0]], None),
        ([[0.0, 0.0], [0.0, 0.0]], None),
        ([[2.0, 0.0], [0.0, -1e-9]], "negative on the diagonal at b"),
        ([[2.0, -1.0], [-1.0 - 1e-9, 2.0]], "unsymmetric between a and b"),
        ([[0.0, 3.0], [0.0, 0.0]], "unsymmetric between a and b"),
        ([[1.0, -1.1], [-1.1, 1.0]], "indefinite: its entry between a and b exceeds both their own"),
        ([[0.0, 1.0], [1.0, 2.0]], "indefinite: its entry between a and b exceeds both their own"),
    ],
)
@pytest.mark.parametrize("kind", [np.array, sp.csc_array])
def test_small_matrices_are_described_as_they_are(matrix: list[list[float]], said: str | None, kind: type) -> None:
    """By hand."""
    assert oddities({"K": kind(matrix)}, AB) == ([] if said is None else [f"K is {said}"])


def test_an_indefinite_matrix_with_small_entries_is_found() -> None:
    """Three springs of the wrong sign: 1 - 2 * 0.6 < 0 with no pair of DOFs to show it."""
    matrix = np.array([[1.0, -0.6, -0.6], [-0.6, 1.0, -0.6], [-0.6, -0.6, 1.0]])
    assert oddities({"M": matrix}, ("a", "b", "c")) == ["M is indefinite in a motion of a, b, c"]


@given(case=structures(passive, assembly), seed=st.integers(0, 99))
def test_passive_structures_are_not_unusual(case: Structure, seed: int) -> None:
    """Positive semidefinite matrices, in any units."""
    units = np.exp2(np.random.default_rng(seed).integers(-20, 20, case.size).astype(float))
    M, C, K = (units[:, None] * matrix * units for matrix in case.matrices)
    assert oddities({"M": M, "C": C, "K": K}, tuple(f"q{k}" for k in range(case.size))) == []


@given(scale=st.floats(1e-6, 1e6))
def test_what_is_said_does_not_depend_on_units(scale: float) -> None:
    """A congruence with a diagonal matrix keeps signs and symmetry."""
    T = np.diag([1.0, scale])
    for matrix in ([[2.0, -1.0], [-1.0, 2.0]], [[1.0, -1.1], [-1.1, 1.0]], [[2.0, 0.5], [-0.5, 1.0]]):
        assert oddities({"K": T @ np.array(matrix) @ T}, AB) == oddities({"K": np.array(matrix)}, AB)


def test_repr_says_what_is_unusual() -> None:
    """On a line of its own, which usual models do not have."""
    assert "unusual" not in repr(hydromount())
    assert "unusual" not in repr(net(47))
    model = mechss([[1, 0], [0, -1]], None, [[2, 1], [-1, 2]], dofs=AB)
    assert repr(model).splitlines()[-1] == (
        "  unusual: M is negative on the diagonal at b; K is unsymmetric between a and b"
    )


@pytest.mark.parametrize(
    ("C", "K", "said"),
    [
        (1.0, 4.0, ""),
        (0.0, 4.0, ""),
        (0.0, 0.0, ""),
        (-1.0, 4.0, "Unstable: 2 of 2 poles are right of the imaginary axis, the fastest 0.5 "),
        (0.0, -4.0, "Unstable: 1 of 2 poles are right of the imaginary axis, the fastest 2 rad/s"),
    ],
)
def test_info_says_what_is_unstable(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], C: float, K: float, said: str
) -> None:
    """A mass of 1 kg: poles at (-c +- sqrt(c^2 - 4 k)) / 2."""
    save_model(mechss([[1.0]], [[C]], [[K]]), tmp_path / "model.npz")
    assert main(["info", str(tmp_path / "model.npz")]) == 0
    out = capsys.readouterr().out
    assert said in out
    assert ("Unstable" in out) == bool(said)
