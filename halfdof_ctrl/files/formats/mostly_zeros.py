"""Packed matrices of zeros mostly, unpacked piece by piece into sparse ones.

A banded stiffness of 1000 DOFs that was saved full takes 8 MB and packs into 36 kB. Unpacked whole, any file could ask
for a thousand times its length; its nonzeros alone are in proportion to it.
"""

import math
from collections.abc import Iterable
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array, csc_array

from halfdof_ctrl.files.formats.variables import most_unpacked, out_of_room

PIECE = 2**19  #: bytes that are unpacked at once
NUMBERS_AT_ONCE = 2**14  #: of a piece that are looked at together: their places and values take far more bytes
BYTES_OF_NONZERO = 32  #: its place and its value, twice while they are joined
MOSTLY_ZEROS_LARGEST = 2**31  #: bytes in all, 16 000 x 16 000 numbers, which take seconds to look through


def without_zeros(
    pieces: Iterable[bytes], dtype: np.dtype[Any], shape: tuple[int, ...], name: str, length: int, *, by_columns: bool
) -> csc_array:
    """Keep the nonzeros of a matrix whose numbers come in pieces.

    Parameters
    ----------
    pieces : iterable of bytes
    dtype : dtype
        Of the numbers.
    shape : (int, int)
    name : str
        For a refusal.
    length : int
        Bytes of the file, to which the nonzeros must be in proportion.
    by_columns : bool
        Whether the numbers stand column after column.

    Raises
    ------
    FileFormatError
        The matrix is no plane of numbers, is too large, or is not mostly zero.
    ValueError
        More or fewer numbers than the shape says.

    Examples
    --------
    >>> numbers = np.array([[1.0, 0.0], [0.0, 2.0]])
    >>> without_zeros([numbers.tobytes()], numbers.dtype, (2, 2), "K", 99, by_columns=True).nnz
    2
    """
    count = math.prod(shape)
    if len(shape) != 2 or dtype.kind not in "biuf" or count * dtype.itemsize > MOSTLY_ZEROS_LARGEST:  # noqa: PLR2004  # a plane
        raise out_of_room(name, count * dtype.itemsize, length)
    places: list[npt.NDArray[np.int64]] = []
    values: list[npt.NDArray[np.float64]] = []
    done, stored, rest = 0, 0, b""
    for piece in pieces:
        joined = rest + piece
        whole = len(joined) // dtype.itemsize
        numbers = np.frombuffer(joined, dtype, whole)
        rest = joined[whole * dtype.itemsize :]
        for start in range(0, whole, NUMBERS_AT_ONCE):
            nonzero = np.flatnonzero(numbers[start : start + NUMBERS_AT_ONCE]) + start
            stored += nonzero.size
            if stored * BYTES_OF_NONZERO > most_unpacked(length):
                raise out_of_room(name, count * dtype.itemsize, length)
            if nonzero.size:
                places.append(nonzero + done)
                values.append(numbers[nonzero].astype(np.float64))
        done += whole
        if done > count:
            break
    if done != count or rest:
        msg = "a packed variable is not as long as it says"
        raise ValueError(msg)
    where, data = np.concatenate([np.zeros(0, dtype=np.int64), *places]), np.concatenate([np.zeros(0), *values])
    first, second = np.divmod(where, shape[0] if by_columns else shape[1])
    return csc_array(coo_array((data, (second, first) if by_columns else (first, second)), shape=(shape[0], shape[1])))
