"""A model as a first-order descriptor system, ``E x' = A x + B u``, ``y = C x + D u``, for other tools.

With x = (q, v), v = q', what equation (1) says is

    [ I  0 ] [q']   [  0   I ] [q]   [0]                         [q]
    [ 0  M ] [v'] = [ -K  -C ] [v] + [B] u,         y = [ F  G ] [v] + D u

If accelerations are among the outputs, a = v' is a third unknown; if derivatives of inputs act, the inputs w = u and
their derivatives w', w'' are unknowns too, so that the system may be of index up to 3. If nothing has mass and no
output is a velocity, x = q alone, ``C q' = -K q + B u``: a descriptor system that was given so comes back as it was.
"""

from typing import Any, NamedTuple, TypeAlias

import numpy as np

from halfdof_ctrl.base.arrays import ModelMatrix, is_zero
from halfdof_ctrl.base.sparse_arrays import is_sparse, joined_sparse, locked, unit_like, zeros_like

Rows: TypeAlias = list[list[ModelMatrix]]


class DescriptorForm(NamedTuple):
    """``E x' = A x + B u``, ``y = C x + D u``; sparse if the model is."""

    E: ModelMatrix  #: (N, N), singular where something has no inertia
    A: ModelMatrix  #: (N, N)
    B: ModelMatrix  #: (N, m)
    C: ModelMatrix  #: (p, N)
    D: ModelMatrix  #: (p, m)


def descriptor_form(model: Any) -> DescriptorForm:  # noqa: ANN401  # a SecondOrderModel, which imports this module
    """Write a model as a descriptor system of first order (singular E, DAE, semistate equations).

    Parameters
    ----------
    model : SecondOrderModel

    Returns
    -------
    DescriptorForm
        With the same transfer function. Unknowns are displacements and velocities of all DOFs, in the order of `dofs`,
        then accelerations if an output has them, then inputs and derivatives if equation (1) has derivatives.
    """
    K = model.K
    n, m, p = len(model.dofs), len(model.inputs), len(model.outputs)
    accelerating = not is_zero(model.H)
    derivatives = [order for order, letters in ((1, ("Bv", "Dv")), (2, ("Ba", "Da")))
                   if not all(is_zero(getattr(model, letter)) for letter in letters)]  # fmt: skip
    plain = is_zero(model.M) and is_zero(model.G) and not accelerating and not derivatives
    if plain:
        return DescriptorForm(model.C, _negative(K), model.B, model.F, model.D)
    inputs = max(derivatives, default=-1) + 1  # w, w', w'' that are unknowns
    one = unit_like(K, n)
    sizes = [n, n] + [n] * accelerating + [m] * inputs
    blocks = _Blocks(K, sizes)
    E, A = blocks.empty(sizes), blocks.empty(sizes)
    B, C = blocks.empty([m]), [[zeros_like(K, p, size) for size in sizes]]
    E[0][0], A[0][1] = one, one
    motion = 2 if accelerating else 1
    if accelerating:
        E[1][1], A[1][2] = one, one
        A[motion][2] = _negative(model.M)
        C[0][2] = model.H
    else:
        E[1][1] = model.M
    A[motion][0], A[motion][1] = _negative(K), _negative(model.C)
    C[0][0], C[0][1] = model.F, model.G
    D = model.D
    if not inputs:
        B[motion][0] = model.B
        return _form(blocks, E, A, B, C, D)
    first = len(sizes) - inputs
    for k, (letter, direct) in enumerate((("B", "D"), ("Bv", "Dv"), ("Ba", "Da"))[:inputs]):
        A[motion][first + k], C[0][first + k] = getattr(model, letter), getattr(model, direct)
    unit = unit_like(K, m)
    A[first][first], B[first][0] = _negative(unit), unit  # 0 = u - w
    for k in range(1, inputs):
        E[first + k][first + k - 1], A[first + k][first + k] = unit, unit  # w' = its derivative
    return _form(blocks, E, A, B, C, zeros_like(K, p, m))


class _Blocks:
    """Rows of blocks, dense or sparse like a pattern."""

    def __init__(self, pattern: ModelMatrix, rows: list[int]) -> None:
        self.pattern, self.rows = pattern, rows

    def empty(self, columns: list[int]) -> Rows:
        return [[zeros_like(self.pattern, row, column) for column in columns] for row in self.rows]

    def joined(self, blocks: Rows) -> ModelMatrix:
        return joined_sparse(blocks) if is_sparse(self.pattern) else np.block(blocks)


def _form(blocks: _Blocks, E: Rows, A: Rows, B: Rows, C: Rows, D: ModelMatrix) -> DescriptorForm:
    joined = [locked(blocks.joined(part)) for part in (E, A, B, C)]
    return DescriptorForm(joined[0], joined[1], joined[2], joined[3], D)


def _negative(matrix: ModelMatrix) -> ModelMatrix:
    return locked(-matrix) if is_sparse(matrix) else locked(0.0 - matrix)
