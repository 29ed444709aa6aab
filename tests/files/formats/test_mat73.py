"""Claims about MATLAB 7.3 files: what MATLAB lays down in HDF5 is read, and without h5py the extra is named.

Files are written here by h5py in MATLAB's layout; tests that need it skip where it is not installed.
"""

import importlib
import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.sparse

from halfdof_ctrl import load_model, mechss
from halfdof_ctrl.base.errors import FileFormatError, MissingExtraError
from halfdof_ctrl.files.formats.mat73 import is_mat73, read_mat73
from support.fe_files import CHAIN, K, M

HEADER = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(512)


def written(**variables: Any) -> bytes:  # noqa: ANN401
    """Write variables as MATLAB does, behind its header."""
    h5py = pytest.importorskip("h5py")
    stream = io.BytesIO()
    with h5py.File(stream, "w", userblock_size=512) as file:
        for name, value in variables.items():
            put(h5py, file, name, value)
    return HEADER + stream.getvalue()[512:]


def put(h5py: Any, file: Any, name: str, value: Any) -> Any:  # noqa: ANN401
    """Write one variable."""
    if isinstance(value, scipy.sparse.csc_array):
        group = file.create_group(name)
        group.attrs["MATLAB_class"], group.attrs["MATLAB_sparse"] = np.bytes_(b"double"), np.uint64(value.shape[0])
        columns = value
        group["jc"] = columns.indptr.astype(np.uint64)
        if columns.nnz:
            group["ir"], group["data"] = columns.indices.astype(np.uint64), in_two_fields(columns.data)
        return group
    if isinstance(value, str):
        units = np.frombuffer(value.encode("utf-16-le"), np.uint16).reshape(-1, 1)
        item = file.create_dataset(name, data=units)
        item.attrs["MATLAB_class"] = np.bytes_(b"char")
        return item
    if isinstance(value, list):
        cells = [put(h5py, file, f"#refs#/{name}{k}", text).ref for k, text in enumerate(value)]
        item = file.create_dataset(name, data=np.array(cells, dtype=h5py.ref_dtype).reshape(-1, 1))
        item.attrs["MATLAB_class"] = np.bytes_(b"cell")
        return item
    item = file.create_dataset(name, data=in_two_fields(np.asarray(value)).T)
    item.attrs["MATLAB_class"] = np.bytes_(b"double")
    return item


def in_two_fields(array: np.ndarray) -> np.ndarray:
    """Put complex numbers into the two fields of MATLAB."""
    if not np.iscomplexobj(array):
        return array
    parts = np.empty(array.shape, dtype=[("real", "f8"), ("imag", "f8")])
    parts["real"], parts["imag"] = array.real, array.imag
    return parts


@pytest.mark.parametrize(
    "matrix", [K, K * (1 - 2j), np.arange(6.0).reshape(2, 3), np.array([[7]], dtype=np.int32), np.array([[True]])]
)
def test_a_full_matrix_comes_back(matrix: np.ndarray) -> None:
    """HDF5 has the axes reversed, and complex numbers in two fields."""
    content = written(K=matrix)
    assert is_mat73(content)
    np.testing.assert_array_equal(read_mat73(content, ["K", "M"])["K"], matrix)


@pytest.mark.parametrize("matrix", [K, K * 1j, np.zeros((2, 3))])
def test_a_sparse_matrix_stays_sparse(matrix: np.ndarray) -> None:
    """A matrix without entries has no data at all."""
    found = read_mat73(written(K=scipy.sparse.csc_array(matrix)), ["K"])["K"]
    assert isinstance(found, scipy.sparse.csc_array)
    np.testing.assert_array_equal(found.toarray(), matrix)


def test_names_are_read_from_cells_and_chars() -> None:
    """As MATLAB stores them, in units of 16 bits."""
    names = ["n1_u1", "ü 漢", "🔩"]
    assert read_mat73(written(dofs=names, name="mount"), ["dofs", "name"]) == {"dofs": names, "name": ["mount"]}


def test_a_model_is_loaded_from_such_a_file(tmp_path: Path) -> None:
    """With MATLAB's mechss names, sparse or full."""
    (tmp_path / "a.mat").write_bytes(written(M=scipy.sparse.csc_array(M), K=K, C=CHAIN["C"], dofs=["a", "b", "c"], x=1))
    model = load_model(tmp_path / "a.mat")
    expected = mechss(M, CHAIN["C"], K, dofs=["a", "b", "c"])
    assert (model.dofs, model.inputs) == (expected.dofs, expected.inputs)
    for found, wanted in ((model.M, M), (model.C, CHAIN["C"]), (model.K, K)):
        np.testing.assert_array_equal(scipy.sparse.csc_array(found).toarray(), wanted)


def test_without_h5py_the_extra_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """And the way round it."""

    def missing(name: str) -> None:
        msg = f"No module named {name!r}"
        raise ImportError(msg)

    monkeypatch.setattr(importlib, "import_module", missing)
    (tmp_path / "a.mat").write_bytes(HEADER + b"\x89HDF\r\n\x1a\n")
    with pytest.raises(MissingExtraError, match=r"a\.mat: .*pip install 'halfdof_ctrl\[hdf5\]'.*-v7") as caught:
        load_model(tmp_path / "a.mat")
    assert (caught.value.extra, caught.value.path) == ("hdf5", str(tmp_path / "a.mat"))


def bent(change: str) -> bytes:
    """Write a file in which something is not as it should be."""
    h5py = pytest.importorskip("h5py")
    stream = io.BytesIO()
    with h5py.File(stream, "w") as file:
        group = put(h5py, file, "K", scipy.sparse.csc_array(K))
        if change == "row":
            group["ir"][0] = 9
        elif change == "rows":
            group.attrs["MATLAB_sparse"] = np.uint64(10**12)
        elif change == "starts":
            group["jc"][1] = 99
        elif change == "struct":
            del file["K"]
            file.create_group("K")
        elif change == "text":
            del file["K"]
            file["K"] = "text"
        elif change == "large":
            del file["K"]
            file.create_dataset("K", shape=(10**5, 10**5), dtype="f8", chunks=(100, 100))
        elif change == "cells":
            del file["K"]
            file["K"] = np.array([put(h5py, file, "inner", K).ref], dtype=h5py.ref_dtype)
        elif change == "external":
            del file["K"]
            file.create_dataset("K", shape=(2,), dtype="f8", external=[("/etc/passwd", 0, 16)])
    return stream.getvalue()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("row", "indices out of bounds"),
        ("rows", "indices out of bounds"),
        ("starts", "indices out of bounds"),
        ("struct", "K is a struct, string or other object"),
        ("text", "K is a struct, string or other object|K has"),
        ("cells", "K is a struct, string or other object"),
        ("large", "K would take 80000000000 bytes, more than are unpacked"),
        ("external", "K lies in another file"),
    ],
)
def test_what_is_no_matrix_is_refused(change: str, message: str) -> None:
    """Before it does harm."""
    with pytest.raises(FileFormatError, match=message):
        read_mat73(bent(change), ["K"])


def test_links_out_of_the_file_are_not_followed() -> None:
    """A file must not read another one."""
    h5py = pytest.importorskip("h5py")
    stream = io.BytesIO()
    with h5py.File(stream, "w") as file:
        file["K"] = h5py.ExternalLink("other.mat", "/K")
        file["M"] = h5py.SoftLink("/K")
    assert read_mat73(stream.getvalue(), ["K", "M"]) == {}


def test_damaged_structure_is_one_refusal() -> None:
    """HDF5's own errors are told as ours."""
    content = written(K=K)
    with pytest.raises(FileFormatError, match="the HDF5 structure is damaged"):
        read_mat73(content[:600], ["K"])
