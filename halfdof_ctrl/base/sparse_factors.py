"""How sparse matrices are factorized by SuperLU: orders and pivots, from the fastest way to the safest."""

from typing import Literal, TypeAlias

from halfdof_ctrl.base.arrays import EPS

Pivoting: TypeAlias = tuple[Literal["MMD_AT_PLUS_A", "COLAMD"], float]  #: order, least pivot over the column's largest

PIVOTINGS: tuple[Pivoting, ...] = (("MMD_AT_PLUS_A", 0.0), ("MMD_AT_PLUS_A", 0.1), ("COLAMD", 1.0))
SYMMETRIC_SHARE = 0.5  #: of the entries that have a partner across the diagonal where the order is a symmetric one
COLUMNS_AT_A_TIME = 8  #: right-hand sides worked at a time
CORRECTED_ABOVE = 64 * EPS  #: componentwise backward error above which a solution is corrected once
