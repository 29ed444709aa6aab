"""Claims about putting matrices on one list of DOFs, and what the report says of them."""

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

from halfdof_ctrl import load_model
from halfdof_ctrl.base.errors import FileFormatError, ImportedModelWarning
from halfdof_ctrl.files.assembly import ImportedModel, read_matrices
from support.fe_files import CHAIN, NAMES, C, K, M, abaqus, dmig, harwell_boeing, mapping, matrix_market, output4_binary


def laid(folder: Path, **files: str | bytes) -> Path:
    """Write files, the double underscore of a name standing for its full stop."""
    for name, content in files.items():
        path = folder / name.replace("__", ".")
        path.write_bytes(content.encode() if isinstance(content, str) else content)
    return folder


def dense(part: Any) -> npt.NDArray[Any]:  # noqa: ANN401  # dense or sparse
    """Expand a matrix that must be there."""
    assert part is not None
    return np.asarray(part.toarray())


def require_chain(found: ImportedModel) -> None:
    """Compare with the model that the files were written from."""
    assert found.dofs == NAMES
    for letter, matrix in CHAIN.items():
        np.testing.assert_array_equal(dense(getattr(found, letter)), matrix)
    report = found.report
    assert (report.n_inertial, report.n_half, report.n_static) == (2, 1, 0)
    assert report.mass == {"u1": 5.0}
    assert (report.missing, report.warnings) == ((), ())


def test_abaqus_files_give_the_chain(tmp_path: Path) -> None:
    """A mass file that does not know node 3 is put on the DOFs of the stiffness."""
    laid(tmp_path, j_STIF1__mtx=abaqus(K), j_MASS1__mtx=abaqus(M[:2, :2]), j_DMPV1__mtx=abaqus(C, "upper"))
    found = read_matrices([tmp_path])
    require_chain(found)
    assert found.report.notes == ("1 DOFs are in K but not in M", "1 DOFs are in K but not in C")


def test_ansys_files_give_the_chain(tmp_path: Path) -> None:
    """With one mapping file for all."""
    files = {
        f"{word.lower()}__matrix": harwell_boeing(matrix, title=f"{word} matrix")
        for word, matrix in (("Stiffness", K), ("Mass", M), ("Damping", C))
    }
    laid(tmp_path, **files, stiffness__mapping=mapping())
    require_chain(read_matrices([tmp_path / "stiffness.matrix"]))


def test_a_punch_file_gives_the_chain(tmp_path: Path) -> None:
    """Matrices of different DOFs in one file."""
    laid(tmp_path, a__pch=dmig({"KAAX": K, "MAAX": M, "BAAX": C}))
    require_chain(read_matrices([tmp_path / "a.pch"]))


def test_output4_with_its_punch_file_gives_the_chain(tmp_path: Path) -> None:
    """The EXTRN entry names the rows."""
    matrices = {"KXX": K, "MXX": M, "BXX": C}
    laid(tmp_path, a__op4=output4_binary(matrices, "sparse"), a__pch="EXTRN,1,1,2,1,3,1\n")
    require_chain(read_matrices([tmp_path / "a.op4"]))


def test_matrix_market_files_have_no_names(tmp_path: Path) -> None:
    """The report says so, and the model counts from q0."""
    laid(tmp_path, **{f"{letter}__mtx": matrix_market(matrix) for letter, matrix in CHAIN.items()})
    found = read_matrices([tmp_path])
    assert (found.dofs, found.report.labelled, found.report.mass) == (None, False, {})
    np.testing.assert_array_equal(dense(found.K), K)


def test_structural_damping_is_the_imaginary_part_of_the_stiffness(tmp_path: Path) -> None:
    """K + i S."""
    laid(tmp_path, j_STIF1__mtx=abaqus(K), j_DMPS1__mtx=abaqus(0.1 * K), j_MASS1__mtx=abaqus(M))
    found = read_matrices([tmp_path])
    np.testing.assert_allclose(dense(found.K), K * (1 + 0.1j), rtol=1e-15)
    assert [part.letter for part in found.report.matrices] == ["M", "K", "S"]
    assert found.report.missing == ("C",)


def test_structural_damping_alone_is_told_with_the_stiffness_missing(tmp_path: Path) -> None:
    """As matrix, it is all imaginary."""
    laid(tmp_path, j_DMPS1__mtx=abaqus(K))
    found = read_matrices([tmp_path])
    np.testing.assert_array_equal(dense(found.K), K * 1j)
    assert found.report.missing == ("M", "C", "K")


def test_dofs_of_the_mass_alone_come_last_and_are_told(tmp_path: Path) -> None:
    """A mass on a node that no element holds."""
    laid(tmp_path, j_STIF1__mtx=abaqus(K), j_MASS1__mtx=abaqus(M[:2, :2], nodes=(2, 9, 0)))
    report = read_matrices([tmp_path]).report
    assert report.unsupported == ("n9_u1",)
    assert "1 DOFs are in M but not in K (n9_u1)" in report.notes
    assert any("have mass or damping but no stiffness (n9_u1)" in text for text in report.warnings)


def test_dofs_without_any_entry_are_told(tmp_path: Path) -> None:
    """The third row of K is empty, in a file that claims three."""
    hollow = K.copy()
    hollow[2], hollow[:, 2] = 0.0, 0.0
    laid(tmp_path, K__mtx=matrix_market(hollow), M__mtx=matrix_market(M))
    report = read_matrices([tmp_path]).report
    assert report.empty == ("q2",)
    assert any("no entry in any matrix (q2)" in text for text in report.warnings)


def test_boundary_conditions_as_huge_springs_are_told_and_removed_on_request(tmp_path: Path) -> None:
    """Abaqus writes 1e36 on the diagonal of a DOF that is held."""
    held = K.copy()
    held[0, 0] = 1e36
    laid(tmp_path, j_STIF1__mtx=abaqus(held), j_MASS1__mtx=abaqus(M))
    kept = read_matrices([tmp_path])
    assert kept.report.penalized == ("n1_u1",)
    assert any("1 DOFs have a stiffness of 1e+35 or more" in text for text in kept.report.warnings)
    removed = read_matrices([tmp_path], remove_fixed=True)
    assert (removed.dofs, removed.report.removed, removed.report.warnings) == (NAMES[1:], ("n1_u1",), ())
    np.testing.assert_array_equal(dense(removed.K), K[1:, 1:])
    np.testing.assert_array_equal(dense(removed.M), M[1:, 1:])


def test_removed_rows_of_nameless_matrices_keep_their_numbers(tmp_path: Path) -> None:
    """And inputs and outputs lose theirs."""
    held = K.copy()
    held[0, 0] = 1e36
    force, motion = np.array([[1.0], [2.0], [3.0]]), np.array([[1.0, 0.0, 4.0]])
    general = "array real general"
    laid(
        tmp_path,
        K__mtx=matrix_market(held),
        B__mtx=f"%%MatrixMarket matrix {general}\n3 1\n" + "\n".join(map(str, force[:, 0])),
        F__mtx=f"%%MatrixMarket matrix {general}\n1 3\n" + "\n".join(map(str, motion[0])),
    )
    found = read_matrices([tmp_path], remove_fixed=True)
    assert found.dofs == ("q1", "q2")
    np.testing.assert_array_equal(dense(found.signals["B"]), force[1:])
    np.testing.assert_array_equal(dense(found.signals["F"]), motion[:, 1:])
    assert found.report.unused == ()


def test_a_half_is_told_and_completed_only_on_request(tmp_path: Path) -> None:
    """A general Matrix Market file with one triangle."""
    laid(tmp_path, K__mtx=matrix_market(K, "coordinate real general"), M__mtx=matrix_market(M))
    found = read_matrices([tmp_path])
    np.testing.assert_array_equal(dense(found.K), np.tril(K))
    assert any(
        "half of it seems to be missing" in text and "triangle='lower'" in text for text in found.report.warnings
    )
    whole = read_matrices([tmp_path], triangle="lower")
    np.testing.assert_array_equal(dense(whole.K), K)
    assert whole.report.warnings == ()
    with pytest.raises(
        FileFormatError, match=r"K\.mtx: triangle='upper', but its off-diagonal entries are in the lower"
    ):
        read_matrices([tmp_path], triangle="upper")


def test_labels_of_one_file_serve_others_of_its_size(tmp_path: Path) -> None:
    """And that is told."""
    laid(tmp_path, j_STIF1__mtx=abaqus(K), M__mtx=matrix_market(M))
    found = read_matrices([tmp_path])
    assert found.dofs == NAMES
    assert "M has no labels; its rows are taken in the order of K" in found.report.notes


@pytest.mark.parametrize(
    ("files", "message"),
    [
        ({"K__mtx": matrix_market(K), "M__mtx": matrix_market(M[:2, :2])}, "differ in size .M 2 x 2, K 3 x 3."),
        ({"K__mtx": matrix_market(K[:2], "coordinate real general", "both")}, "K.mtx is 2 x 3, but .* must be square"),
        (
            {"stiff__matrix": harwell_boeing(K), "stiff__mapping": mapping(("UX", "UY"), (1, 1))},
            "3 rows, but stiff.mapping names 2",
        ),
        (
            {"stiff__matrix": harwell_boeing(K), "stiff__mapping": mapping(("UX",) * 3, (1, 1, 2))},
            "names of its rows are not all different",
        ),
        (
            {"K__mtx": matrix_market(K), "B__mtx": matrix_market(np.ones((2, 1)), "coordinate real general", "both")},
            "B is 2 x 1, which does not fit 3 DOFs",
        ),
    ],
)
def test_what_does_not_fit_together_is_refused(tmp_path: Path, files: dict[str, str], message: str) -> None:
    """With the file and the sizes."""
    with pytest.raises(FileFormatError, match=message):
        read_matrices([laid(tmp_path, **files)])


@given(seed=st.integers(0, 10**6))
def test_the_order_of_lines_and_the_triangle_do_not_matter(seed: int, tmp_path_factory: pytest.TempPathFactory) -> None:
    """Shuffled lines with either entry of each pair give the same matrices under the same names."""
    rng = np.random.default_rng(seed)
    folder = tmp_path_factory.mktemp("shuffled")
    for name, matrix in (("j_STIF1.mtx", K), ("j_MASS1.mtx", M), ("j_DMPV1.mtx", C)):
        lines = abaqus(matrix).strip().split("\n")[1:]
        swapped = []
        for line in lines:
            a, b, c, d, value = line.split(",")
            swapped.append(line if rng.random() < 0.5 else f"{c},{d}, {a},{b}, {value}")
        (folder / name).write_text("\n".join(rng.permutation(swapped).tolist()) + "\n")
    require_chain(read_matrices([folder]))


def test_one_matrix_under_two_names_is_warned_of(tmp_path: Path) -> None:
    """A file that was copied over another one, or saved under the wrong name; identities and chains may be alike."""
    whole = np.diag([3.0, 2.0, 4.0]) + np.diag([-1.0, -1.0], 1) + np.diag([-1.0, -1.0], -1)
    np.savez(tmp_path / "a.npz", M=whole, C=0.5 * whole, K=whole)
    with pytest.warns(ImportedModelWarning, match="M and K are the same matrix, number for number"):
        load_model(tmp_path / "a.npz")
    np.savez(tmp_path / "b.npz", M=np.eye(3), C=0.5 * whole, K=np.eye(3))
    load_model(tmp_path / "b.npz")
