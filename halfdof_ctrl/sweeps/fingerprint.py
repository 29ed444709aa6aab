"""What a sweep is, as a short text by which another run knows its own: function, parameters, frequencies, signals.

Values are described by what they are, never by where they are in memory. The code of the function itself belongs to
it, the code of what it calls does not.
"""

import dataclasses
import functools
import hashlib
import types
from collections.abc import Iterator, Mapping
from pathlib import PurePath
from typing import Any

import numpy as np
import scipy.sparse as sp

from halfdof_ctrl.base.errors import ParameterError

DEEPEST = 12  #: levels of containers that are looked into


def fingerprint(**facts: object) -> str:
    """Describe named facts by a short text that other facts do not give.

    Raises
    ------
    ParameterError
        A value that does not say what it is.

    Examples
    --------
    >>> fingerprint(k=[1.0, 2.0]) == fingerprint(k=[1.0, 2.0]), fingerprint(k=[1.0]) == fingerprint(k=[2.0])
    (True, False)
    """
    digest = hashlib.sha256()
    for name, value in facts.items():
        for piece in _described(value, name, 0):
            digest.update(len(piece).to_bytes(8, "little"))
            digest.update(piece)
    return digest.hexdigest()


def _described(value: object, name: str, depth: int) -> Iterator[bytes]:  # noqa: C901, PLR0912  # one case a kind
    """Yield what a value is, piece by piece."""
    if depth > DEEPEST:
        raise _unknown(value, name)
    yield f"{name}:{type(value).__name__}".encode()
    below = functools.partial(_described, depth=depth + 1)
    if value is None or isinstance(value, bool | int | float | complex | str | bytes | PurePath | np.generic):
        yield repr(value).encode()
    elif isinstance(value, sp.sparray | sp.spmatrix):
        matrix: sp.csc_array[Any] = sp.csc_array(value, copy=True)
        matrix.sum_duplicates()
        for places in (matrix.shape, matrix.indptr, matrix.indices):
            yield np.asarray(places, dtype=np.int64).tobytes()
        yield from below(matrix.data, name)
    elif isinstance(value, np.ndarray) and value.dtype != object:
        yield f"{value.dtype.str}{value.shape}".encode()
        yield np.ascontiguousarray(value).tobytes()
    elif isinstance(value, np.ndarray | list | tuple):
        for number, item in enumerate(value):
            yield from below(item, f"{name}[{number}]")
    elif isinstance(value, Mapping):
        for key, item in value.items():
            yield from below(item, f"{name}[{key!r}]")
    elif isinstance(value, functools.partial):
        yield from below([value.func, value.args, value.keywords], name)
    elif isinstance(value, types.MethodType):
        yield from below([value.__func__, value.__self__], name)
    elif isinstance(value, types.FunctionType):
        yield f"{value.__module__}.{value.__qualname__}".encode()
        yield from below([value.__code__, value.__defaults__, value.__kwdefaults__, _enclosed(value)], name)
    elif isinstance(value, types.CodeType):
        yield value.co_code
        yield from below([value.co_names, value.co_varnames, value.co_consts], name)
    elif isinstance(value, type | types.BuiltinFunctionType | types.ModuleType):
        yield f"{getattr(value, '__module__', '')}.{getattr(value, '__qualname__', value.__name__)}".encode()
    elif isinstance(value, frozenset):  # among the constants of code
        yield repr(sorted(map(repr, value))).encode()
    elif dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            yield from below(getattr(value, field.name), f"{name}.{field.name}")
    elif type(value).__repr__ is not object.__repr__ and " at 0x" not in repr(value):
        yield repr(value).encode()
    elif hasattr(value, "__dict__"):
        yield f"{type(value).__module__}.{type(value).__qualname__}".encode()
        yield from below(vars(value), name)
    else:
        raise _unknown(value, name)


def _enclosed(function: types.FunctionType) -> list[object]:
    """Return what a function has taken with it from around it."""
    cells = []
    for cell in function.__closure__ or ():
        try:
            cells.append(cell.cell_contents)
        except ValueError:  # a name that is not set yet
            cells.append(None)
    return cells


def _unknown(value: object, name: str) -> ParameterError:
    msg = (
        f"A checkpoint cannot tell whether another run has the same {name}: a {type(value).__name__} does not say what "
        "it is. Give numbers, texts or arrays as parameters and make the object in the function."
    )
    return ParameterError(msg, parameter=name, value=value)
