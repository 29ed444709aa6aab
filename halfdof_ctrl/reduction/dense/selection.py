"""Take T of equation (2a) as a selection of the DOFs.

Null columns of M are half or static, of these the null columns of C static (Simionatto and others, section 2).
"""

from dataclasses import replace
from functools import lru_cache

import numpy as np

from halfdof_ctrl.base.arrays import FEW_NUMBERS, read_only
from halfdof_ctrl.model.kinds import null_column_kinds
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.reduction.dense.partition import DofPartition
from halfdof_ctrl.reduction.method.evidence import LightMasses
from halfdof_ctrl.reduction.method.masses import mass_ratios, spread_is_wide


def select_columns(model: SecondOrderModel, tol: float | None = None) -> DofPartition:
    """Split the DOFs by the null columns of M and C.

    Parameters
    ----------
    model : SecondOrderModel
        A real model.
    tol : float, optional
        A column of M counts as null where its scaled size is at most `tol` times the largest one. By
        default only exact zeros count. The scale is unit-free: see `masses.mass_ratios`.

    Returns
    -------
    DofPartition
        With the masses that are not zero but hardly count as `light`.
    """
    if tol is None and model.M.size <= FEW_NUMBERS:  # as plain numbers, in half the time
        massive, damped = (tuple(map(any, zip(*X.tolist(), strict=True))) for X in (model.M, model.C))
        if massive.count(True) <= 1:
            return _selection(massive, tuple([d > m for m, d in zip(massive, damped, strict=True)]), model.dofs)
    inertial, half = null_column_kinds(model.M, model.C)
    light = None
    if tol is not None or spread_is_wide(model, inertial):
        ratio = mass_ratios(model)
        inertial = inertial & (ratio > (0.0 if tol is None else tol))
        half = model.C.any(axis=0) & ~inertial
        light = LightMasses.among(ratio, inertial, model.dofs)
    partition = _selection(tuple(inertial.tolist()), tuple(half.tolist()), model.dofs)
    return partition if light is None else replace(partition, light=light)


@lru_cache(maxsize=32)
def _selection(massive: tuple[bool, ...], damped: tuple[bool, ...], dofs: tuple[str, ...]) -> DofPartition:
    every = range(len(massive))
    with_mass, with_damping = [i for i in every if massive[i]], [i for i in every if damped[i]]
    order = [*with_mass, *with_damping, *[i for i in every if not (massive[i] or damped[i])]]
    return DofPartition(
        method="selection",
        order=read_only(np.array(order)),
        basis=None,
        sizes=None,
        in_order=order == list(every),
        n_inertial=len(with_mass),
        n_half=len(with_damping),
        n_static=len(order) - len(with_mass) - len(with_damping),
        coordinates=tuple([dofs[i] for i in order]),
        evidence=(),
    )
