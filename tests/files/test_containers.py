"""Claims about archives of named variables: sparse matrices by their parts, and parts that lie."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.io
from scipy.sparse import coo_array, csc_array

from halfdof_ctrl import inspect_files, load_model, load_system, mech2ss, save_model, save_system
from halfdof_ctrl.base.errors import FileFormatError, ImportedModelWarning
from halfdof_ctrl.files.containers import load_variables, sparse_parts
from halfdof_ctrl.model.mechss import mechss
from support.fe_files import K

PARTS = sparse_parts("K", csc_array(K))


def written(path: Path, **changes: Any) -> Path:  # noqa: ANN401
    """Write the parts of K with some of them changed."""
    np.savez(path, **(PARTS | {f"K.{key}": value for key, value in changes.items()}))
    return path


def test_a_sparse_matrix_comes_back_by_its_parts(tmp_path: Path) -> None:
    """Without being expanded: a million by a million would not fit."""
    places = np.random.default_rng(6).integers(0, 10**6, (2, 1000))
    large = csc_array(coo_array((np.arange(1.0, 1001.0), tuple(places)), shape=(10**6, 10**6)))
    np.savez(tmp_path / "a.npz", **sparse_parts("K", large))
    found = load_variables(tmp_path / "a.npz", ["K", "M"])
    assert list(found) == ["K"]
    assert isinstance(found["K"], csc_array)
    assert abs(found["K"] - large).nnz == 0


@pytest.mark.filterwarnings("ignore::halfdof_ctrl.base.errors.ImportedModelWarning")
@pytest.mark.parametrize("ending", [".npz", ".mat"])
def test_sparse_and_full_matrices_give_the_same_model(tmp_path: Path, ending: str) -> None:
    """Parts in an archive, MATLAB's sparse in .mat."""
    path = tmp_path / f"a{ending}"
    if ending == ".npz":
        written(path)
    else:
        scipy.io.savemat(str(path), {"K": csc_array(K)})
    found, expected = load_model(path), mechss(None, None, K)
    np.testing.assert_array_equal(csc_array(found.K).toarray(), csc_array(expected.K).toarray())
    assert inspect_files(path).matrices[0].rank == "positive definite, rank 3"


@pytest.mark.parametrize(
    "changes",
    [
        {"indices": PARTS["K.indices"] + 2},
        {"indices": -PARTS["K.indices"]},
        {"indices": PARTS["K.indices"] * 1.0},
        {"indptr": PARTS["K.indptr"][::-1]},
        {"indptr": PARTS["K.indptr"][:-1]},
        {"data": PARTS["K.data"][:-1]},
        {"data": PARTS["K.data"][:, None]},
        {"shape": [3, 4]},
        {"shape": [0, 3]},
        {"shape": [10**12, 3]},
    ],
)
def test_parts_that_contradict_each_other_are_refused(tmp_path: Path, changes: dict[str, Any]) -> None:
    """Compiled code would follow them out of bounds."""
    with pytest.raises(FileFormatError, match=r"a\.npz: the sparse matrix K has indices out of bounds"):
        load_variables(written(tmp_path / "a.npz", **changes), ["K"])


def test_a_shape_of_another_kind_is_refused(tmp_path: Path) -> None:
    """Three sizes, or text."""
    for shape in ([3, 3, 3], ["a", "b"]):
        with pytest.raises(FileFormatError, match=r"a\.npz: the file is damaged"):
            load_variables(written(tmp_path / "a.npz", shape=shape), ["K"])


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        ({"x": K}, "nothing says which matrix is M, C or K"),
        ({"K": K, "M": K[:2, :2]}, r"differ in size \(M 2 x 2, K 3 x 3\)"),
        ({"K": K[:2]}, "K must be square"),
        ({"K": K, "dofs": ["a"]}, "1 names were given for 3 DOFs"),
        (sparse_parts("K", csc_array(K[:2])), "K is 2 x 3, but the matrices of a model must be square"),
        ({"M": K[:2, :2], **PARTS}, r"differ in size \(M 2 x 2, K 3 x 3\)"),
        (sparse_parts("K", csc_array(np.diag([np.inf, 1.0]))), "K has entries that are not finite"),
    ],
)
def test_what_is_no_model_is_refused_by_inspection(tmp_path: Path, arrays: dict[str, Any], message: str) -> None:
    """With the file's name, as by load_model."""
    np.savez(tmp_path / "a.npz", **arrays)
    with pytest.raises(FileFormatError, match=rf"a\.npz: .*{message}"):
        inspect_files(tmp_path / "a.npz")


def test_a_sparse_model_is_saved_by_its_parts(tmp_path: Path) -> None:
    """What the model holds sparse is written sparse, and comes back."""
    model = mechss(np.eye(3), None, K)
    sparse: Any = csc_array(K)
    save_model(replace(model, K=sparse), tmp_path / "a.npz")
    found = load_variables(tmp_path / "a.npz", ["K"])["K"]
    np.testing.assert_array_equal(found.toarray(), K)


def test_a_name_that_a_terminal_obeys_is_refused(tmp_path: Path) -> None:
    """Neither of a model nor of a state space."""
    np.savez(tmp_path / "a.npz", K=np.eye(2), M=np.eye(2), C=np.eye(2), name=np.array("a\x1b[2J"))
    np.savez(tmp_path / "s.npz", A=np.eye(1), B=np.eye(1), C=np.eye(1), D=np.eye(1), name=np.array("a\nb"))
    for door, file in ((load_model, "a.npz"), (load_system, "s.npz")):
        with pytest.raises(FileFormatError, match="name has control characters"):
            door(tmp_path / file)


@pytest.mark.parametrize("key", ["states", "inputs", "outputs"])
def test_a_state_space_that_lost_names_is_refused(tmp_path: Path, key: str) -> None:
    """It would come back under other names, or as another kind of system, without a word."""
    path = tmp_path / "a.npz"
    save_system(mech2ss(mechss([[1.0]], [[1.0]], [[4.0]])), path)
    with np.load(path) as archive:
        content = dict(archive)
    np.savez(path, **{name: value for name, value in content.items() if name != key})
    with pytest.raises(FileFormatError, match=f"{key} not in the file, though"):
        load_system(path)
    np.savez(path, **{name: value for name, value in content.items() if name != "dt"})
    with pytest.warns(ImportedModelWarning, match="no dt in the file, so the system is taken as continuous"):
        assert load_system(path).dt == 0
    np.savez(path, **{name: content[name] for name in "ABCD"})
    assert load_system(path).nstates == 2


def test_numbers_in_small_matlab_files_carry_a_checksum(tmp_path: Path) -> None:
    """A byte that is lost anywhere behind the header is refused, not another number; large ones are stored plainly."""
    path = tmp_path / "a.mat"
    model = mechss(np.diag([1.0, 2.0]), None, np.array([[3.0, -1.0], [-1.0, 2.0]]))
    save_model(model, path)
    content = path.read_bytes()
    np.testing.assert_array_equal(load_model(path).K, model.K)
    for place in range(128, len(content)):
        path.write_bytes(content[:place] + bytes([content[place] ^ 0x10]) + content[place + 1 :])
        try:
            found = load_model(path)
        except FileFormatError:
            continue
        np.testing.assert_array_equal(found.K, model.K)
        np.testing.assert_array_equal(found.M, model.M)
    save_model(mechss(np.eye(600), None, 2.0 * np.eye(600)), path)  # which would be packed to less than a tenth
    assert path.stat().st_size > 600 * 600 * 8
    np.testing.assert_array_equal(load_model(path).K, 2.0 * np.eye(600))


@pytest.mark.parametrize("key", ["dofs", "inputs", "outputs"])
def test_a_model_that_lost_names_is_warned_of(tmp_path: Path, key: str) -> None:
    """It would come back under others, q0 or F_q0, without a word."""
    path = tmp_path / "a.npz"
    save_model(mechss([[1.0]], [[1.0]], [[4.0]], dofs=["y"], inputs=["f"], outputs=["z"]), path)
    with np.load(path) as archive:
        content = dict(archive)
    np.savez(path, **{name: value for name, value in content.items() if name != key})
    with pytest.warns(ImportedModelWarning, match=f"but not {key}: save_model writes them together"):
        load_model(path)
