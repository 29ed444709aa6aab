"""Claims about MATLAB workspaces and NumPy files: taken as what they say, refused with what they hold."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.io
import scipy.sparse

from halfdof_ctrl import SecondOrderModel, inspect_files, load_model, mechss, save_model
from halfdof_ctrl.base.errors import FileFormatError, ImportedModelWarning

M = np.diag([3.0, 2.0, 0.0])
C = np.array([[0.0, 0.0, 0.0], [0.0, 0.5, -0.5], [0.0, -0.5, 0.5]])
K = np.array([[6.0, -2.0, 0.0], [-2.0, 3.0, -1.0], [0.0, -1.0, 1.0]])
MODEL = {"M": M, "C": C, "K": K}
KINDS = pytest.mark.parametrize("ending", [".npz", ".mat", "v4.mat", "v73.mat"])


def written(path: Path, variables: dict[str, Any]) -> Path:
    """Write variables in the format of the ending."""
    if path.suffix == ".npz":
        np.savez(path, **variables)
    elif path.name.endswith("v73.mat"):
        with pytest.importorskip("h5py").File(path, "w") as file:
            for name, value in variables.items():
                file[name] = value.T
    else:
        scipy.io.savemat(str(path), variables, format="4" if path.name.endswith("v4.mat") else "5")
    return path


def is_the_model(model: SecondOrderModel) -> bool:
    """Compare with the matrices above, to the last bit."""
    parts = [part if isinstance(part, np.ndarray) else part.toarray() for part in (model.M, model.C, model.K)]
    return all(np.array_equal(part, wanted) for part, wanted in zip(parts, (M, C, K), strict=True))


@KINDS
def test_plain_letters_are_the_model(tmp_path: Path, ending: str) -> None:
    """In NumPy's archive and the three formats of MATLAB."""
    assert is_the_model(load_model(written(tmp_path / f"a{ending}", MODEL)))


@KINDS
@pytest.mark.parametrize("name", ["D", "E", "Cv"])
def test_damping_of_another_name_is_taken_when_said(tmp_path: Path, ending: str, name: str) -> None:
    """matrices={'C': 'D'}."""
    path = written(tmp_path / f"a{ending}", {"M": M, name: C, "K": K})
    assert is_the_model(load_model(path, matrices={"C": name}))


@KINDS
def test_damping_called_d_is_no_direct_term_in_silence(tmp_path: Path, ending: str) -> None:
    """As large as the stiffness, without a C: both readings, and each of them can be said."""
    path = written(tmp_path / f"a{ending}", {"M": M, "D": C, "K": K})
    with pytest.raises(FileFormatError, match=r"could be the damping or a direct term.*matrices=\{'C': 'D'\}"):
        load_model(path)
    with pytest.warns(ImportedModelWarning, match="no damping C"):
        assert np.array_equal(load_model(path, matrices={"D": "D"}).D, C)
    with pytest.warns(ImportedModelWarning, match="no damping C"):
        assert not load_model(path, matrices={"D": None}).D.any()


def test_a_gyroscopic_matrix_is_no_output(tmp_path: Path) -> None:
    """A skew G beside C, M and K belongs into the equations."""
    G = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    with pytest.raises(FileFormatError, match="could be gyroscopic forces"):
        load_model(written(tmp_path / "a.npz", {**MODEL, "G": G}))


@KINDS
def test_a_matrix_as_large_as_the_stiffness_is_not_left_out_in_silence(tmp_path: Path, ending: str) -> None:
    """E is half of the literature's damping."""
    with pytest.warns(ImportedModelWarning) as caught:
        load_model(written(tmp_path / f"a{ending}", {"M": M, "E": C, "K": K}))
    words = " ".join([str(warning.message) for warning in caught])
    assert "E (3 x 3), as large as the stiffness" in words
    assert "no damping C" in words


@KINDS
@pytest.mark.parametrize("side", ["lower", "upper"])
def test_half_a_matrix_is_told_and_completed_on_request(tmp_path: Path, ending: str, side: str) -> None:
    """As in any other file."""
    half = np.tril(K) if side == "lower" else np.triu(K)
    path = written(tmp_path / f"a{ending}", {**MODEL, "K": half})
    with pytest.warns(ImportedModelWarning, match=f"half of it seems to be missing.*triangle='{side}'"):
        load_model(path)
    assert is_the_model(load_model(path, triangle=side))  # type: ignore[arg-type]


@KINDS
def test_a_load_vector_f_is_a_column_of_forces(tmp_path: Path, ending: str) -> None:
    """A column of n is no row of outputs; the report says what was done."""
    path = written(tmp_path / f"a{ending}", {**MODEL, "F": np.array([[0.0], [2.0], [0.5]])})
    model = load_model(path)
    np.testing.assert_array_equal(np.asarray(model.B).reshape(-1), [0.0, 2.0, 0.5])
    assert model.outputs == ("q0", "q1", "q2")
    assert "taken for the load B" in repr(inspect_files(path))


@KINDS
def test_names_of_its_own_are_listed_with_the_argument(tmp_path: Path, ending: str) -> None:
    """And the argument works."""
    path = written(tmp_path / f"a{ending}", {"M_c1": M, "C_c1": C, "K_c1": K})
    words = r"C_c1.*\(3 x 3\).*matrices=\{'K': 'K_c1', 'M': 'M_c1', 'C': 'C_c1'\}"
    with pytest.raises(FileFormatError, match=words):
        load_model(path)
    assert is_the_model(load_model(path, matrices={"K": "K_c1", "M": "M_c1", "C": "C_c1"}))


def test_parameters_called_k_and_m_are_no_model_of_one_dof(tmp_path: Path) -> None:
    """Beside the matrices of other names that they belong to."""
    path = written(tmp_path / "a.mat", {"K": 3.0, "M": 2.0, "KK": K, "MM": M})
    with pytest.raises(FileFormatError, match=r"single numbers are called .*matrices=\{'K': 'KK', 'M': 'MM'\}"):
        load_model(path)


def test_a_state_space_beside_the_matrices_is_left_out_when_said(tmp_path: Path) -> None:
    """Its C is no damping, its B acts on states; each refusal says how."""
    path = written(
        tmp_path / "a.mat", {"K": K, "M": M, "Cd": C, "A": np.eye(6), "B": np.ones((6, 1)), "C": np.ones((1, 6))}
    )
    with pytest.raises(FileFormatError, match=r"C must be square, but it is 1 x 6.*matrices=\{'C': name\}"):
        load_model(path)
    with pytest.raises(FileFormatError, match=r"B is 6 x 1, which does not fit 3 DOFs.*matrices=\{'B': None\}"):
        load_model(path, matrices={"C": "Cd"})
    assert is_the_model(load_model(path, matrices={"C": "Cd", "B": None}))


def test_structs_and_cells_are_looked_into(tmp_path: Path) -> None:
    """sys.K and K{1}, by the names that MATLAB gives them."""
    scipy.io.savemat(str(tmp_path / "s.mat"), {"sys": MODEL, "note": "by hand"})
    with pytest.raises(FileFormatError, match=r"sys \(struct\).*matrices=\{'K': 'sys.K', 'M': 'sys.M', 'C': 'sys.C'\}"):
        load_model(tmp_path / "s.mat")
    assert is_the_model(load_model(tmp_path / "s.mat", matrices={"K": "sys.K", "M": "sys.M", "C": "sys.C"}))
    cell = np.empty(3, dtype=object)
    cell[:] = [M, C, K]
    scipy.io.savemat(str(tmp_path / "c.mat"), {"all": cell})
    assert is_the_model(load_model(tmp_path / "c.mat", matrices={"M": "all{1}", "C": "all{2}", "K": "all{3}"}))


def test_a_cell_array_called_k_is_named_as_such(tmp_path: Path) -> None:
    """With the name of the matrix in it."""
    cell = np.empty(1, dtype=object)
    cell[0] = K
    scipy.io.savemat(str(tmp_path / "c.mat"), {"K": cell})
    with pytest.raises(FileFormatError, match=r"cell array of matrices. A matrix in it is called 'K\{1\}'"):
        load_model(tmp_path / "c.mat")


@pytest.mark.parametrize("ending", [".npy", ".npz", ".mat"])
def test_files_side_by_side_are_one_model(tmp_path: Path, ending: str) -> None:
    """From one of them, by folder, by mapping: whatever the variable is called."""
    for letter, matrix in MODEL.items():
        if ending == ".npy":
            np.save(tmp_path / f"{letter}.npy", matrix)
        else:
            written(tmp_path / f"{letter}{ending}", {"data": matrix})
    paths = {letter: tmp_path / f"{letter}{ending}" for letter in MODEL}
    for given in (paths, tmp_path, paths["K"]):
        assert is_the_model(load_model(given))


def test_a_matrix_of_save_npz_is_what_its_file_is_called(tmp_path: Path) -> None:
    """In the three layouts that say where each entry is."""
    for letter, layout in zip("MCK", ("csc", "csr", "coo"), strict=True):
        scipy.sparse.save_npz(tmp_path / f"{letter}.npz", scipy.sparse.coo_array(MODEL[letter]).asformat(layout))  # type: ignore[call-overload]
    model = load_model(tmp_path)
    assert model.is_sparse
    assert is_the_model(model)


def test_objects_are_named_with_a_way_out(tmp_path: Path) -> None:
    """They are not damage."""
    np.savez(tmp_path / "a.npz", K=np.array([scipy.sparse.eye_array(2)], dtype=object))
    with pytest.raises(FileFormatError, match=r"K holds objects.*K\.toarray\(\)"):
        load_model(tmp_path / "a.npz")


def test_options_mean_the_same_for_every_kind_of_file(tmp_path: Path) -> None:
    """remove_fixed takes a DOF with a penalty out of a workspace too."""
    held = K.copy()
    held[0, 0] = 1e36
    path = written(tmp_path / "a.mat", {**MODEL, "K": held, "B": np.eye(3)[:, 1:]})
    with pytest.warns(ImportedModelWarning, match="remove_fixed=True"):
        load_model(path)
    model = load_model(path, remove_fixed=True)
    assert model.dofs == ("q1", "q2")
    np.testing.assert_array_equal(model.B, np.eye(2))


def test_numbers_called_like_names_are_left_alone(tmp_path: Path) -> None:
    """A finite-element program in MATLAB has tables of elements, fixed DOFs, counts."""
    tables = {"elements": np.ones((7, 2)), "dofs": np.arange(6.0), "inputs": 3.0, "outputs": {"a": 1.0}, "name": 5.0}
    assert is_the_model(load_model(written(tmp_path / "a.mat", {**MODEL, **tables})))


def test_a_state_space_is_called_one(tmp_path: Path) -> None:
    """Its C is no damping."""
    np.savez(tmp_path / "a.npz", A=np.eye(2), B=np.eye(2), C=np.eye(2), D=np.eye(2))
    with pytest.raises(FileFormatError, match=r"state space.*load_system"):
        load_model(tmp_path / "a.npz")


def test_what_save_model_wrote_comes_back_without_a_word(tmp_path: Path) -> None:
    """Also a triangle, which is what was saved, and the digits."""
    model = mechss(M, C, np.tril(K))
    save_model(model, tmp_path / "a.npz")
    back = load_model(tmp_path / "a.npz")
    np.testing.assert_array_equal(back.K, np.tril(K))
    assert back.known_to == model.known_to


def test_an_array_of_objects_or_names_is_no_missing_mass(tmp_path: Path) -> None:
    """A file that is there is read or refused."""
    np.save(tmp_path / "K.npy", K)
    for mass in (np.array([1, None], dtype=object), np.array(["a"])):
        np.save(tmp_path / "M.npy", mass, allow_pickle=True)
        with pytest.raises(FileFormatError, match=r"M\.npy: it (holds|is) "):
            load_model(tmp_path)


def test_an_array_of_one_number_is_a_model_of_one_dof(tmp_path: Path) -> None:
    """In files of one matrix each."""
    for letter, value in (("M", 2.0), ("C", 0.5), ("K", 8.0)):
        np.save(tmp_path / f"{letter}.npy", np.array([[value]]))
    model = load_model(tmp_path / "K.npy")
    assert (float(model.M[0, 0]), float(model.C[0, 0]), float(model.K[0, 0])) == (2.0, 0.5, 8.0)


def test_a_d_beside_the_damping_is_a_direct_term_only_where_there_are_signals(tmp_path: Path) -> None:
    """Forces on all DOFs that appear in all displacements are nobody's model."""
    with pytest.raises(FileFormatError, match="another matrix of the equations or a direct term"):
        load_model(written(tmp_path / "a.npz", {**MODEL, "D": np.eye(3)}))
    model = load_model(written(tmp_path / "b.npz", {**MODEL, "D": np.eye(3), "B": np.eye(3), "F": np.eye(3)}))
    np.testing.assert_array_equal(model.D, np.eye(3))


@pytest.mark.parametrize("ending", [".mat", "v4.mat"])
def test_an_empty_matrix_says_that_there_is_none(tmp_path: Path, ending: str) -> None:
    """[] is how MATLAB says so, and it is as if it were not in the file."""
    path = written(tmp_path / f"a{ending}", {"M": M, "C": np.zeros((0, 0)), "D": np.zeros((0, 0)), "K": K})
    with pytest.warns(ImportedModelWarning, match="no damping C"):
        model = load_model(path)
    assert not model.C.any()
    assert not model.D.any()


def test_the_way_out_fits_what_is_there(tmp_path: Path) -> None:
    """A lumped mass as a column, a number for a matrix, a cell array whose name is no letter."""
    with pytest.raises(FileFormatError, match=r"M must be square, but it is 3 x 1\. If these are .*diag\("):
        load_model(written(tmp_path / "a.mat", {"M": M.diagonal()[:, None], "K": K}))
    with pytest.raises(FileFormatError, match=r"differ in size \(M 3 x 3, C 1 x 1, .*matrices=\{'C': None\}"):
        load_model(written(tmp_path / "a.mat", {"M": M, "K": K, "C": np.zeros((1, 1))}))
    cells = np.empty((1, 2), dtype=object)
    cells[0, 0], cells[0, 1] = M, K
    with pytest.raises(FileFormatError, match=r"mats\{1\}, mats\{2\} .*matrices=\{'K': name, 'M': name, 'C': name\}"):
        load_model(written(tmp_path / "a.mat", {"mats": cells}))


def test_a_load_is_told_as_what_it_is_taken_for(tmp_path: Path) -> None:
    """And not as unused at the same time."""
    found = inspect_files(written(tmp_path / "a.mat", {**MODEL, "F": np.array([[0.0], [0.0], [1.0]])}))
    assert found.signals == ("B from a.mat: F",)
    assert found.unused == ()


def test_what_is_missing_is_proposed_and_what_is_there_is_not(tmp_path: Path) -> None:
    """C is known, so that B is not proposed for it; what K is called cannot be guessed."""
    np.savez(tmp_path / "a.npz", A=K, B=M, C=C)
    with pytest.raises(FileFormatError, match=r"besides C \(3 x 3\) it holds B, A \(3 x 3\).*\{'K': name, 'M': name\}"):
        load_model(tmp_path / "a.npz")
    np.savez(tmp_path / "b.npz", A=K, M=M, Damp=C)
    with pytest.raises(FileFormatError, match=r"matrices=\{'K': name, 'C': 'Damp'\}"):
        load_model(tmp_path / "b.npz")
