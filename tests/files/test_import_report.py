"""Claims about the report: what the table shows, and how mass is summed."""

from pathlib import Path

import numpy as np
import pytest
from scipy.sparse import csc_array

from halfdof_ctrl import inspect_files, save_model
from halfdof_ctrl.files.formats.raw_matrix import storage
from halfdof_ctrl.files.import_report import mass_per_direction, matrix_report
from halfdof_ctrl.model.mechss import mechss
from support.fe_files import K, M, abaqus


def report_of(matrix: np.ndarray, largest: int = 1000) -> object:
    """Look at one matrix."""
    sparse = csc_array(matrix)
    words = {
        "format": "test",
        "stored": storage(sparse),
        "completed": False,
        "half_stored": False,
        "notes": (),
        "doubts": (),
    }
    return matrix_report("K", "file", sparse, largest, **words)


def test_the_table_shows_each_matrix_and_what_is_missing(tmp_path: Path) -> None:
    """To the letter, for two files of Abaqus."""
    (tmp_path / "job_STIF1.mtx").write_text(abaqus(K))
    (tmp_path / "job_MASS1.mtx").write_text(abaqus(M))
    assert repr(inspect_files(tmp_path / "job_STIF1.mtx")).splitlines() == [
        "ImportReport: 3 DOFs, named by node and component",
        "     from           size   nonzero  stored            symmetry   definiteness",
        "  M  job_MASS1.mtx  3 x 3  2        diagonal          symmetric  positive semidefinite, rank 2",
        "  K  job_STIF1.mtx  3 x 3  7        lower, completed  symmetric  positive definite, rank 3",
        "  files: job_STIF1.mtx, job_MASS1.mtx",
        "  C  no damping in the files: taken as zero",
        "  DOFs by null columns: 2 inertial, 0 half, 1 static",
        "  sum of M: 5 along u1",
        "  note: 1 DOFs are in K but not in M",
    ]


@pytest.mark.parametrize(
    ("matrix", "words"),
    [
        (K, "symmetric"),
        (K + np.triu(K, 1), "unsymmetric (3e-01)"),
        (np.array([[0.0, 2.0], [-2.0, 0.0]]), "skew-symmetric"),
        (np.zeros((2, 2)), "symmetric"),
        (K * (1 + 0.1j), "symmetric"),
    ],
)
def test_symmetry_is_measured(matrix: np.ndarray, words: str) -> None:
    """By the largest difference across the diagonal over the largest entry."""
    assert report_of(matrix).symmetry == words  # type: ignore[attr-defined]


def test_rank_says_what_it_is_of() -> None:
    """Of the symmetric real part, or not determined."""
    assert report_of(K).rank == "positive definite, rank 3"  # type: ignore[attr-defined]
    assert report_of(K * (1 + 0.1j)).rank == "positive definite (of the symmetric real part), rank 3"  # type: ignore[attr-defined]
    wide = np.eye(400) + np.eye(400, k=1) * 0.1 + np.eye(400, k=-1) * 0.1
    assert report_of(wide, largest=0).rank == "not determined"  # type: ignore[attr-defined]


def test_a_consistent_mass_sums_to_the_mass_of_the_bar() -> None:
    """Two elements of mass 6 in three directions: 12 along each, however it is spread; rotations do not count."""
    bar = np.array([[2.0, 1.0, 0.0], [1.0, 4.0, 1.0], [0.0, 1.0, 2.0]])
    mass = np.kron(bar, np.eye(3))
    names = [f"n{node}_u{axis}" for node in (1, 2, 3) for axis in (1, 2, 3)]
    assert mass_per_direction(csc_array(mass), names) == {"u1": 12.0, "u2": 12.0, "u3": 12.0}
    assert mass_per_direction(csc_array(mass), [name.replace("u", "r") for name in names]) == {}
    assert mass_per_direction(None, names) == {}


def test_negative_eigenvalues_are_a_warning(tmp_path: Path) -> None:
    """A negative mass is a sign of damage or of a wrong sign convention."""
    save_model(mechss(np.diag([1.0, -2.0]), None, np.eye(2)), tmp_path / "a.npz")
    assert inspect_files(tmp_path / "a.npz").warnings == (
        "M (a.npz) is indefinite: 1 eigenvalues of its symmetric part are negative.",
    )


def test_a_container_is_looked_at_like_any_other_file(tmp_path: Path) -> None:
    """Names and counts from .npz and .mat."""
    save_model(mechss(M, None, np.tril(K), dofs=["a", "b", "n3_u1"]), tmp_path / "a.mat")
    report = inspect_files(tmp_path / "a.mat")
    assert (report.n_dofs, report.labelled, report.n_inertial, report.files) == (3, True, 2, ("a.mat",))
    assert "half of it seems to be missing" in report.warnings[0]
    assert inspect_files(str(tmp_path / "a.mat"), triangle="lower").warnings == ()
