"""How fast transfer functions grow: which pairs of input and output are improper.

With S_ij(s) the system pencil (9) of one input and one output,

    H_ij = det S_ij / det P,   order of growth = deg det S_ij - deg det P                  (20)

Most pairs need no determinant. P(s)^-1 grows at most as s^(index - 1), which settles displacements under forces up to
index one. For the rest, H(s) is a strictly proper part and a polynomial D_0 + D_1 s + D_2 s^2 + ..., and Cauchy's
formula on a circle around all finite eigenvalues gives its coefficients for all pairs at once. Only where rounding
leaves one of them in doubt the degrees in (20) are counted, exactly.
"""

import numpy as np
import numpy.typing as npt

from halfdof_ctrl.base.arrays import ComplexArray, DenseMatrix, FloatArray
from halfdof_ctrl.base.errors import UncertainRankError
from halfdof_ctrl.descriptor.exact_counts import exact_counts
from halfdof_ctrl.descriptor.first_order import time_scale
from halfdof_ctrl.model.evaluation import data_limit, quadratic_transfer
from halfdof_ctrl.model.second_order import SecondOrderModel

IntArray = npt.NDArray[np.int64]

RADIUS = 8.0  #: of the circle, in units of the largest finite eigenvalue
FEWEST_GROWTH_POINTS = 32  #: on the circle: the strictly proper part returns with 8^-24 at most
NO_GROWTH = -1000  #: degree of a polynomial that is zero
ROUNDED = 16.0  #: coefficients below so many of their rounding errors are zero
CLEAR = 4096.0  #: coefficients above so many are not


def improper_pairs(
    model: SecondOrderModel, eigenvalues: ComplexArray | None, index: int, degree: int | None = None
) -> tuple[tuple[str, str, int], ...]:
    """List the (input, output, order of growth) of all transfer functions that grow with frequency.

    Parameters
    ----------
    model : SecondOrderModel
        With a regular pencil.
    eigenvalues : (k,) complex ndarray, optional
        Its finite eigenvalues; None where rounding left no way to tell them from infinite ones.
    index : int
        Index of the pencil (8).
    degree : int, optional
        Of det P of the stored numbers exactly, where it is larger than the number of eigenvalues that are known.

    Returns
    -------
    tuple of (str, str, int)
        Output by output, as matrices are read.

    Raises
    ------
    UncertainRankError
        A part that grows is of the size of rounding, and the stored numbers were rounded.
    """
    if eigenvalues is None:
        return _none_or_undecided(model, _bounds(model, index))
    order = growth_orders(model, eigenvalues, index, degree)
    return tuple([(model.inputs[j], model.outputs[i], int(order[i, j])) for i, j in np.argwhere(order > 0).tolist()])


def growth_orders(
    model: SecondOrderModel, eigenvalues: ComplexArray, index: int, degree: int | None = None
) -> IntArray:
    """Find the order of growth of each pair (p, m), 0 for all that do not grow."""
    bound = _bounds(model, index)
    if bound.max() <= 0:
        return np.zeros_like(bound)
    order, unclear, size = _by_circle(model, eigenvalues, bound)
    if unclear.any() and degree is not None and degree != eigenvalues.size:
        raise _undecided(model, unclear, size)
    for i, j in np.argwhere(unclear).tolist():
        order[i, j] = max(0, _degree_of_pair(model, i, j) - eigenvalues.size)
    return order


def _none_or_undecided(model: SecondOrderModel, bound: IntArray) -> tuple[tuple[str, str, int], ...]:
    """Return no pair where none can grow, and refuse to tell otherwise."""
    growing = np.argwhere(bound > 0)
    if not growing.size:
        return ()
    i, j = growing[0].tolist()
    msg = (
        f"Whether the transfer function from {model.inputs[j]} to {model.outputs[i]} grows with frequency cannot be "
        "told: parts of the size of rounding hide which eigenvalues of the pencil are finite, so that no circle is "
        "around them. Give the model in the coordinates in which its constraints are plain numbers, or in units in "
        "which its entries are of one size."
    )
    raise UncertainRankError(msg, dofs=(model.inputs[j], model.outputs[i]), gap=1.0)


def _undecided(model: SecondOrderModel, unclear: npt.NDArray[np.bool_], size: FloatArray) -> UncertainRankError:
    """Refuse to tell a part that grows from rounding."""
    i, j = np.argwhere(unclear)[0].tolist()
    ratio = float(size[i, j])
    msg = (
        f"Whether the transfer function from {model.inputs[j]} to {model.outputs[i]} grows with frequency cannot be "
        f"told: its part that grows is {ratio:.0f} times what rounding of M, C, K lets it be ({ROUNDED:.0f} times "
        f"are rounding and {CLEAR:.0f} times are not), and the stored numbers are rounded ones. Give the model in the "
        "coordinates in which its constraints are plain numbers, or in units in which its entries are of one size."
    )
    return UncertainRankError(msg, dofs=(model.inputs[j], model.outputs[i]), gap=ratio)


def _bounds(model: SecondOrderModel, index: int) -> IntArray:
    """Bound the growth by the degrees of B(s), F(s), D(s) and the growth of P(s)^-1."""
    inputs = _degrees(model.quadratics.B).max(axis=0)
    outputs = _degrees(model.quadratics.F).max(axis=1)
    return np.asarray(np.maximum(outputs[:, None] + inputs + index - 1, _degrees(model.quadratics.D)))


def _degrees(coefficients: tuple[DenseMatrix, ...]) -> IntArray:
    """Return the degree of each entry of a matrix polynomial."""
    degrees = np.full(coefficients[0].shape, NO_GROWTH, dtype=np.int64)
    for power, matrix in enumerate(coefficients):
        degrees[matrix != 0.0] = power
    return degrees


def _by_circle(
    model: SecondOrderModel, eigenvalues: ComplexArray, bound: IntArray
) -> tuple[IntArray, npt.NDArray[np.bool_], FloatArray]:
    """Find the last coefficient of each polynomial part, the pairs that are unclear, and sizes in units of rounding."""
    most = int(bound.max())
    count = max(FEWEST_GROWTH_POINTS, 2 ** int(np.ceil(np.log2(4 * (most + 1)))))
    largest = float(np.abs(eigenvalues).max(initial=0.0))
    radius = RADIUS * largest if largest > 0.0 else time_scale(model.quadratics.P)
    points = radius * np.exp(2j * np.pi * np.arange(count) / count)
    coefficients = model.quadratics
    with np.errstate(invalid="ignore"):
        parts = np.abs(np.fft.fft(quadratic_transfer(*coefficients, points), axis=2) / count)[:, :, 1 : most + 1]
    rounding = data_limit(*coefficients, points).data.max(axis=2, keepdims=True)
    powers = np.arange(1, most + 1)
    possible = powers <= bound[:, :, None]
    present = possible & ~(parts <= ROUNDED * rounding)
    clear = possible & (parts > CLEAR * rounding)
    order, at_least = (np.where(which, powers, 0).max(axis=2) for which in (present, clear))
    with np.errstate(invalid="ignore", divide="ignore"):
        size = np.where(present & ~clear, parts / rounding, 0.0).max(axis=2)
    return order, order > at_least, size


def _degree_of_pair(model: SecondOrderModel, i: int, j: int) -> int:
    """Return the degree of the determinant of the system pencil of one pair, exactly."""
    counts = exact_counts(system_pencil(model, [i], [j]), at_infinity=False)
    return counts.degree if counts.is_regular else NO_GROWTH


def system_pencil(model: SecondOrderModel, outputs: list[int], inputs: list[int]) -> list[DenseMatrix]:
    """Return the coefficients of the system pencil (9) of some outputs and inputs."""
    return [
        np.block([[P, -B[:, inputs]], [F[outputs], D[np.ix_(outputs, inputs)]]])
        for P, B, F, D in (
            (model.K, model.B, model.F, model.D),
            (model.C, model.Bv, model.G, model.Dv),
            (model.M, model.Ba, model.H, model.Da),
        )
    ]
