"""LU factors of dense matrices by LAPACK, without words: SciPy warns the whole process where a pivot is zero.

What a singular matrix makes of a solution is infinite or no number, and seen by who looks at it.
"""

from typing import Any

import numpy as np
from scipy.linalg import get_lapack_funcs

from halfdof_ctrl.base.arrays import DenseMatrix


def lu_factors(matrix: DenseMatrix) -> tuple[Any, Any]:
    """Factorize a real or complex matrix for `scipy.linalg.lu_solve`.

    Examples
    --------
    A singular one is factorized too:

    >>> factors, pivots = lu_factors(np.array([[2.0, 2.0], [1.0, 1.0]]))
    >>> factors.tolist(), pivots.tolist()
    ([[2.0, 2.0], [0.5, 0.0]], [0, 1])
    """
    getrf: Any = get_lapack_funcs("getrf", (np.asarray(matrix),))
    factors, pivots, _ = getrf(matrix)
    return factors, pivots
