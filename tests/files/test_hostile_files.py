"""Claims about files that lie: no crash, no foreign file, no allocation out of proportion, no global state touched."""

import io
import struct
import threading
import tracemalloc
import warnings
import zipfile
from pathlib import Path

import numpy as np
import pytest
import scipy.io
import scipy.sparse
from hypothesis import given
from hypothesis import strategies as st

from halfdof_ctrl import HalfdofError, inspect_files, load_model
from halfdof_ctrl.base.errors import FileFormatError

K = np.array([[6.0, -2.0, 0.0], [-2.0, 3.0, -1.0], [0.0, -1.0, 1.0]])
LARGE = [b"20000000", b"99999999", b"2147483647", b"9223372036854775807", b"-1", b"0", b"1e999", b"nan"]
MOST_BYTES = 2**24  #: that a file of a few hundred bytes may take; names and sums of a model of 10 000 rows fit


def array(**variables: object) -> bytes:
    """Write an archive."""
    stream = io.BytesIO()
    np.savez_compressed(stream, **variables)  # type: ignore[arg-type]
    return stream.getvalue()


def workspace(version: str, **variables: object) -> bytes:
    """Write a file of MATLAB."""
    stream = io.BytesIO()
    scipy.io.savemat(stream, variables, format=version, do_compression=version == "5")  # type: ignore[arg-type]
    return stream.getvalue()


def npy() -> bytes:
    """Write an array."""
    stream = io.BytesIO()
    np.save(stream, K)
    return stream.getvalue()


SOUND = {
    "a.npz": array(M=np.eye(3), C=K, K=K),
    "K.npy": npy(),
    "a.mat": workspace("5", M=np.eye(3), C=K, K=scipy.sparse.csc_array(K), sys={"K": K}),
    "4.mat": workspace("4", M=np.eye(3), K=scipy.sparse.csc_array(K)),
    "K.txt": b"6 -2 0\n-2 3 -1\n0 -1 1.5\n",
    "K.csv": b",a,b,c\na,6,-2,0\nb,-2,3,-1\nc,0,-1,1.5\n",
    "K0.txt": b"0 0 6\n1 0 -2\n1 1 3\n2 2 1\n",
    "k.sti": b"1 1 6.0e+00\n1 2 -2.0e+00\n2 2 3.0e+00\n",
    "K.mtx": b"%%MatrixMarket matrix coordinate real general\n3 3 3\n1 1 6.\n2 2 3.\n3 3 1.\n",
    "j_STIF1.mtx": b"1,1, 1,1, 6.0\n2,1, 1,1, -2.0\n2,1, 2,1, 3.0\n",
    "a.op4": b"       2       2       6       2KAA     1P,3E23.16\n       1       1       1\n 4.0000000000000000E+00\n"
    b"       3       1       1\n 1.0000000000000000E+00\n",
    "a.pch": b"DMIG    KAAX    0       6       2       0\nDMIG    KAAX    1       1               1       1       4.\n",
}


@pytest.mark.filterwarnings("ignore::halfdof_ctrl.base.errors.ImportedModelWarning")
@pytest.mark.parametrize("name", SOUND)
@given(data=st.data())
def test_a_damaged_file_is_read_or_refused_by_its_name(
    name: str, tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    """Cut, changed, or with a huge number in its header: nothing but HalfdofError, in little memory."""
    content = bytearray(SOUND[name])
    place = data.draw(st.integers(0, len(content) - 1))
    kind = data.draw(st.sampled_from(["cut", "byte", "number", "doubled"]))
    if kind == "cut":
        content = content[:place]
    elif kind == "byte":
        content[place] = data.draw(st.integers(0, 255))
    elif kind == "number":
        content[place : place + 1] = data.draw(st.sampled_from(LARGE))
    else:
        content[place:place] = content[place : place + 40]
    path = tmp_path_factory.mktemp("hostile", numbered=True) / name
    path.write_bytes(content)
    tracemalloc.start()
    try:
        for door in (load_model, inspect_files):
            try:
                repr(door(path))
            except HalfdofError as refusal:
                assert str(path) in str(refusal)  # noqa: PT017
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
        path.unlink()
    assert peak < MOST_BYTES


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("K.mtx", b"%%MatrixMarket matrix coordinate real general\n20000000 20000000 1\n1 1 1.0\n"),
        ("a.op4", b"20000000200000000       6       2KAA     1P,3E23.16\n"),
        ("K.txt", b"1 1 1.5\n19999999 19999999 1.5\n"),
        ("k.sti", b"1 1 1.5\n19999999 19999999 1.5\n"),
    ],
)
def test_a_small_file_takes_little_memory(tmp_path: Path, name: str, content: bytes) -> None:
    """Whatever number of rows it says it has."""
    (tmp_path / name).write_bytes(content)
    tracemalloc.start()
    try:
        with pytest.raises(FileFormatError, match=name):
            load_model(tmp_path / name)
        assert tracemalloc.get_traced_memory()[1] < 2**20
    finally:
        tracemalloc.stop()


def test_a_packed_file_is_not_unpacked_out_of_proportion(tmp_path: Path) -> None:
    """Sixteen million equal numbers in sixteen kilobytes; save(sparse) would not help, and is said."""
    np.savez_compressed(tmp_path / "a.npz", K=np.ones((4000, 4000), dtype=np.int8))
    with pytest.raises(FileFormatError, match=r"more than are unpacked from .* save it sparse"):
        load_model(tmp_path / "a.npz")


@pytest.mark.parametrize("ending", ["npz", "mat", "hdf5"])
@pytest.mark.parametrize("damaged", ["", "cut", "longer"])
def test_a_packed_banded_matrix_is_read_without_its_zeros(tmp_path: Path, ending: str, damaged: str) -> None:
    """1000 DOFs saved full: 8 MB from 40 kB, of which a tenth is ever held, and exactly its numbers."""
    n = 1000
    stiffness = np.diag(np.arange(1.0, n + 1)) - 0.25 * (np.eye(n, k=1) + np.eye(n, k=-1)) + 0.125 * np.eye(n, k=3)
    path = tmp_path / ("a.npz" if ending == "npz" else "a.mat")
    if ending == "npz":
        np.savez_compressed(path, K=stiffness, M=np.asfortranarray(2.0 * stiffness))
    elif ending == "mat":
        scipy.io.savemat(path, {"K": stiffness, "M": 2.0 * stiffness}, do_compression=True)
    else:
        h5py = pytest.importorskip("h5py")
        with h5py.File(path, "w", userblock_size=512) as file:
            for name, factor in (("K", 1.0), ("M", 2.0)):
                file.create_dataset(name, data=factor * stiffness.T, compression="gzip", chunks=(100, 100))
        path.write_bytes(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM" + path.read_bytes()[128:])
    if damaged:
        content = path.read_bytes()
        half = len(content) // 3
        path.write_bytes(content[:half] if damaged == "cut" else content[:half] + content[half - 9 :])
        with pytest.raises(FileFormatError, match="a"):
            inspect_files(path)
        return
    tracemalloc.start()
    report = inspect_files(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 10 * path.stat().st_size + MOST_BYTES / 4
    assert [part.shape for part in report.matrices] == [(n, n), (n, n)]
    found = load_model(path, matrices={"C": None})
    assert found.is_sparse
    np.testing.assert_array_equal(found.K.toarray(), stiffness)
    np.testing.assert_array_equal(found.M.toarray(), 2.0 * stiffness)


def test_links_out_of_a_matlab_file_are_not_followed(tmp_path: Path) -> None:
    """HDF5 can name any file."""
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "secret.mat", "w") as file:
        file["K"] = K
    with h5py.File(tmp_path / "a.mat", "w") as file:
        file["K"] = h5py.ExternalLink(str(tmp_path / "secret.mat"), "/K")
        file["L"] = h5py.SoftLink("/K")
    with pytest.raises(FileFormatError, match="nothing says which matrix is M, C or K"):
        load_model(tmp_path / "a.mat")


def test_loading_in_threads_leaves_the_filters_of_warnings_alone(tmp_path: Path) -> None:
    """They belong to the whole process."""
    for name, content in SOUND.items():
        (tmp_path / name).write_bytes(content)
    paths = [tmp_path / name for name in ("K.mtx", "K.txt", "a.npz", "a.mat", "a.pch", "K.npy")]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        before = list(warnings.filters)

        def load() -> None:
            for path in paths * 5:
                load_model({"K": path})

        threads = [threading.Thread(target=load) for _ in range(8)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert list(warnings.filters) == before


def member(header: str, data: bytes) -> bytes:
    """Write an array with any header."""
    return b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header.encode() + data


def archive(members: dict[str, bytes], kind: int = zipfile.ZIP_DEFLATED, *more: tuple[str, bytes]) -> bytes:
    """Write an archive of any members."""
    stream = io.BytesIO()
    with warnings.catch_warnings(), zipfile.ZipFile(stream, "w", kind) as file:
        warnings.simplefilter("ignore")  # of a name that stands there
        for name, content in (*members.items(), *more):
            file.writestr(name, content)
    return stream.getvalue()


ONES = member("{'descr': '|i1', 'fortran_order': False, 'shape': (3000, 3000), }", b"\1" * 3000**2)
LONG = member("{'descr': '<f8', 'fortran_order': False, 'shape': (" + "9" * 99 + ",), }", b"")
FEW = scipy.sparse.csc_array(([1.0], ([0], [0])), shape=(1_000_000, 1_000_000))
EMPTY = b"    9999    9999       6       2KAA     1P,3E23.16\n   10000       1       1\n 1.0000000000000000E+00\n"
WIDE = struct.pack("<5i", 2, 2, 3, 0, 2) + b"K\0" + np.array([1.0, 2e7, 1.0, 2e7, 1.0, 0.0]).tobytes()


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.npz", archive({"K.npy": npy()}, zipfile.ZIP_DEFLATED, ("K.npy", npy())), "two variables 'K'"),
        ("a.npz", archive({"K.npy": npy(), "K": npy()}), "two variables 'K'"),
        ("a.npz", archive({"K.npy": ONES}, zipfile.ZIP_BZIP2), "packed as numpy.savez_compressed packs nothing"),
        ("a.npz", archive({"K.npy": ONES}, zipfile.ZIP_LZMA), "packed as numpy.savez_compressed packs nothing"),
        ("a.npz", archive({"K.npy": ONES}), "more than are unpacked"),
        ("a.npz", archive({"K.npy": LONG}), "a size of 99 digits"),
        ("a.mat", workspace("5", K=FEW), "K is 1000000 x 1000000, more than its file has bytes for"),
        ("4.mat", WIDE, "K is 20000000 x 20000000, more than its file has bytes for"),
        ("a.op4", EMPTY * 2000, "columns in all in a file of"),
        ("k.mtx", b"*INCLUDE, INPUT=/etc/passwd\n1,1, 1,1, 6.0\n", "none of .INCLUDE"),
        ("4.mat", workspace("4", K=K) * 2, "two variables 'K'"),
        ("5.mat", workspace("5", K=K) + workspace("5", K=K)[128:], "two variables 'K'"),
        ("5.mat", workspace("5", **{f"v{number}": 1.0 for number in range(4001)}), "more than 4000 variables"),
    ],
    ids=range(13),
)  # fmt: skip
def test_a_file_that_holds_more_than_it_seems_is_refused(
    tmp_path: Path, name: str, content: bytes, message: str
) -> None:
    """Before it takes memory, and whatever comes first of what contradicts itself."""
    (tmp_path / name).write_bytes(content)
    tracemalloc.start()
    try:
        with pytest.raises(FileFormatError, match=message):
            load_model(tmp_path / name)
        assert tracemalloc.get_traced_memory()[1] < max(10 * len(content), 2**22)
    finally:
        tracemalloc.stop()


def test_names_of_variables_do_not_move_the_cursor(tmp_path: Path) -> None:
    """A terminal would obey them."""
    (tmp_path / "a.npz").write_bytes(archive({"\x1b[31mK.npy": npy(), "L.npy": npy()}))
    with pytest.raises(FileFormatError, match=r"it holds \?\[31mK, L") as refusal:
        load_model(tmp_path / "a.npz")
    assert "\x1b" not in str(refusal.value)
