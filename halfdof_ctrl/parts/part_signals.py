"""Inputs and outputs of an assembly: forces on and motions of its DOFs, then what else the parts have."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.sparse import coo_array, csc_array, csr_array

from halfdof_ctrl.base.names import FORCE_PREFIX, force_names, motions
from halfdof_ctrl.base.sparse_arrays import SparseMatrix, joined_sparse, sparse_zeros
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.parts.points import block_diagonal


def assembled_signals(
    parts: Mapping[str, SecondOrderModel], T: SparseMatrix, dofs: tuple[str, ...], left: int
) -> dict[str, Any]:
    """Give inputs and outputs: those of DOFs that are left, of points, and whatever else parts have."""
    models = list(parts.values())
    size = len(dofs)
    unit = csc_array(coo_array((np.ones(left), (np.arange(left), np.arange(left))), shape=(size, left)))
    inputs, input_places = _own_signals(parts, "input")
    outputs, output_places = _own_signals(parts, "output")
    result: dict[str, Any] = {"dofs": dofs}
    m, p = left + len(inputs), left + len(outputs)
    for letter in ("B", "Bv", "Ba"):
        whole = block_diagonal([getattr(model, letter) for model in models])[:, input_places]
        own = csc_array(T.T @ whole)
        first = unit if letter == "B" else sparse_zeros(size, left)
        result[letter] = joined_sparse([[first, own]])
    for letter in ("F", "G", "H"):
        rows = csr_array(block_diagonal([getattr(model, letter) for model in models]))[output_places]
        own = csc_array(rows @ T)
        first = csc_array(unit.T) if letter == "F" else sparse_zeros(left, size)
        result[letter] = joined_sparse([[first], [own]])
    for letter in ("D", "Dv", "Da"):
        rows = csr_array(block_diagonal([getattr(model, letter) for model in models]))[output_places]
        part = csc_array(csc_array(rows)[:, input_places])
        result[letter] = joined_sparse(
            [[sparse_zeros(left, left), sparse_zeros(left, m - left)], [sparse_zeros(p - left, left), part]]
        )
    result["inputs"] = [*force_names(dofs[:left]), *inputs]
    result["outputs"] = [*dofs[:left], *outputs]
    return result


def _own_signals(parts: Mapping[str, SecondOrderModel], what: str) -> tuple[list[str], list[int]]:
    """Name the signals of parts that are no forces on DOFs, or no motions, with their places among all."""
    names: list[str] = []
    places: list[int] = []
    first = 0
    for part, model in parts.items():
        own = model.inputs if what == "input" else model.outputs
        physical = set(force_names(model.dofs)) if what == "input" else set(motions(model.dofs))
        for i, signal in enumerate(own):
            if signal in physical:
                continue
            force = what == "input" and signal.startswith(FORCE_PREFIX)
            names.append(f"{FORCE_PREFIX}{part}_{signal.removeprefix(FORCE_PREFIX)}" if force else f"{part}_{signal}")
            places.append(first + i)
        first += len(own)
    return names, places
