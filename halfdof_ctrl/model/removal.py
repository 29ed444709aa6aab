"""DOFs taken out of a model, with their rows and columns and the signals that are about them alone."""

from collections.abc import Sequence
from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from halfdof_ctrl.base.arrays import IndexArray, ModelMatrix
from halfdof_ctrl.base.errors import SignalNameError
from halfdof_ctrl.base.names import Names, as_tuple, checked_names, listed, unknown_name_error
from halfdof_ctrl.base.sparse_arrays import as_sparse, is_sparse, locked
from halfdof_ctrl.model.motion import Named
from halfdof_ctrl.model.quadratics import Quadratics

BoolArray: TypeAlias = npt.NDArray[np.bool_]


class Kept(NamedTuple):
    """What is left of a model: positions of DOFs, inputs and outputs."""

    dofs: IndexArray
    inputs: IndexArray
    outputs: IndexArray


def kept_without(model: Named, dofs: Names, quadratics: Quadratics) -> Kept:
    """Find what is left of a model without some DOFs.

    Parameters
    ----------
    model : SecondOrderModel
    dofs : str or sequence of str
        Those to be taken out.
    quadratics : Quadratics
        Of the model.

    Returns
    -------
    Kept
        All other DOFs, the inputs that act on something else too, and the outputs that show something else too.

    Raises
    ------
    SignalNameError
        A DOF that is unknown, named twice or prescribed; no DOF, no input or no output left.
    """
    names = as_tuple(dofs, "DOFs")
    checked_names(names, len(names), "DOFs")
    bound = [name for name in names if name in model.prescribed]
    if bound:
        msg = (
            f"The motion of {listed(bound)} is prescribed, and with it inputs and reactions. Take DOFs out of the "
            "model before prescribe_motion."
        )
        raise SignalNameError(msg, names=tuple(bound))
    places = {name: place for place, name in enumerate(model.dofs)}
    for name in names:
        if name not in places:
            raise unknown_name_error(name, "DOF", model.dofs)
    out = np.zeros(len(model.dofs), dtype=bool)
    out[[places[name] for name in names]] = True
    if out.all():
        msg = f"Without {listed(names)} no DOF is left, and a model needs at least one."
        raise SignalNameError(msg, names=names)
    _, B, F, D = quadratics
    inputs = _still_used(B, D, out)
    outputs = _still_used([matrix.T for matrix in F], [matrix.T for matrix in D], out)
    _require_some(inputs, model.inputs, names, "input", "acts on")
    _require_some(outputs, model.outputs, names, "output", "shows")
    return Kept(np.flatnonzero(~out), inputs, outputs)


def _require_some(kept: IndexArray, every: tuple[str, ...], out: tuple[str, ...], what: str, does: str) -> None:
    if not kept.size:
        msg = (
            f"Without {listed(out)} no {what} is left: {listed(every)} {does} nothing else. Give the model another "
            f"{what} by select() first."
        )
        raise SignalNameError(msg, names=every)


def _still_used(columns: Sequence[ModelMatrix], direct: Sequence[ModelMatrix], out: BoolArray) -> IndexArray:
    """Return which columns have an entry in the rows that stay, or in a direct term, or never had any."""
    before, after, fed = (np.zeros(columns[0].shape[1], dtype=bool) for _ in range(3))
    for matrix in columns:
        before |= _filled(matrix)
        after |= _filled(matrix[np.flatnonzero(~out)])
    for matrix in direct:
        fed |= _filled(matrix)
    return np.flatnonzero(after | fed | ~before)


def _filled(matrix: ModelMatrix) -> BoolArray:
    """Return which columns have an entry that is not zero."""
    if isinstance(matrix, np.ndarray):
        return np.asarray(matrix.any(axis=0))
    return np.asarray(np.diff(as_sparse(matrix).indptr) > 0)


def picked(matrix: ModelMatrix, rows: IndexArray, columns: IndexArray) -> ModelMatrix:
    """Return some rows and columns of a matrix, dense or sparse as it is."""
    return locked(matrix[:, columns][rows] if is_sparse(matrix) else matrix[np.ix_(rows, columns)])
