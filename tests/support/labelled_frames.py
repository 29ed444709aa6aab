"""Stand-ins for the DataFrame and the Series of pandas, which is no dependency."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt


class Frame:
    """Numbers with labels of rows and columns; by default both are counted, as pandas does."""

    def __init__(
        self, numbers: npt.ArrayLike, index: Sequence[object] | None = None, columns: Sequence[object] | None = None
    ) -> None:
        self.numbers = np.array(numbers)
        rows, width = self.numbers.shape
        self.index = list(range(rows)) if index is None else list(index)
        self.columns = list(range(width)) if columns is None else list(columns)

    def to_numpy(self) -> npt.NDArray[Any]:
        """Return the numbers alone."""
        return self.numbers


class OldFrame:
    """The same with `values` in place of `to_numpy`."""

    def __init__(self, numbers: npt.ArrayLike, labels: Sequence[str]) -> None:
        self.values = np.array(numbers)
        self.index = self.columns = np.array(labels)


class Series:
    """A vector with labels."""

    def __init__(self, numbers: npt.ArrayLike, index: Sequence[object]) -> None:
        self.numbers = np.array(numbers)
        self.index = np.array(index)

    def to_numpy(self) -> npt.NDArray[Any]:
        """Return the numbers alone."""
        return self.numbers


class Columns:
    """A table whose rows have no labels, as those of polars."""

    def __init__(self, numbers: npt.ArrayLike, columns: Sequence[str]) -> None:
        self.numbers, self.columns = np.array(numbers), list(columns)

    def to_numpy(self) -> npt.NDArray[Any]:
        """Return the numbers alone."""
        return self.numbers
