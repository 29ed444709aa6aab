"""Judge errors by two limits: a tolerance that is good, and what the numbers allow on top of it.

An error is *ok* up to the tolerance, *within* what the numbers allow up to the tolerance and the allowance together,
and *failed* beyond. Figures are given as they are: nothing is subtracted from an error before it is shown.
"""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from halfdof_ctrl.base.arrays import FloatArray

SAFETY = 16.0  #: times the root of the number of unknowns: how many roundings of each number are no fault


def safety(unknowns: int) -> float:
    """Return how many times what one rounding of each number changes is allowed: sums of roundings grow by the root.

    >>> safety(4)
    32.0
    """
    return float(SAFETY * np.sqrt(max(unknowns, 1)))


class Grade(IntEnum):
    """How an error stands to its limits."""

    OK = 0
    WITHIN = 1
    FAILED = 2


@dataclass(frozen=True, slots=True)
class Judged:
    """The largest error among those with the worst grade, and where it is."""

    grade: Grade
    error: float  #: relative, as it is
    allowed: float  #: by the numbers, in the same place, relative to the same
    where: str

    @classmethod
    def nothing(cls, where: str) -> "Judged":
        """Say that there was nothing to compare."""
        return cls(Grade.OK, 0.0, 0.0, where)


def graded(errors: FloatArray, allowed: FloatArray, tolerance: float) -> tuple[Grade, int]:
    """Grade relative errors of any shape and give the place of the largest one with the worst grade, flat.

    An error that is no number has failed.

    Examples
    --------
    The larger error is the smaller fault where more is allowed:

    >>> graded(np.array([1e-6, 1e-9]), np.array([1e-5, 0.0]), 1e-10)
    (<Grade.FAILED: 2>, 1)
    """
    flat, room = np.nan_to_num(errors.ravel(), nan=np.inf), np.nan_to_num(allowed.ravel(), nan=0.0)
    grades = np.where(flat <= tolerance, Grade.OK, np.where(flat <= tolerance + room, Grade.WITHIN, Grade.FAILED))
    worst = Grade(int(grades.max()))
    return worst, int(np.argmax(np.where(grades == worst, flat, -1.0)))
