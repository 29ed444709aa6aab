"""The four quadratics of equation (1), each by its three coefficients."""

from collections.abc import Sequence
from typing import NamedTuple, TypeAlias

from halfdof_ctrl.base.arrays import ModelMatrix

Coefficients: TypeAlias = Sequence[ModelMatrix]  #: of 1, s, s^2, all of one shape


class Quadratics(NamedTuple):
    """Coefficients of 1, s and s^2 in ``P(s) q = B(s) u``, ``y = F(s) q + D(s) u``, equation (1).

    For n DOFs, m inputs and p outputs; dense, or all sparse. Unpacks in the order in which functions take them.
    """

    P: tuple[ModelMatrix, ModelMatrix, ModelMatrix]  #: K, C, M, each (n, n)
    B: tuple[ModelMatrix, ModelMatrix, ModelMatrix]  #: B, Bv, Ba, each (n, m)
    F: tuple[ModelMatrix, ModelMatrix, ModelMatrix]  #: F, G, H, each (p, n)
    D: tuple[ModelMatrix, ModelMatrix, ModelMatrix]  #: D, Dv, Da, each (p, m)
