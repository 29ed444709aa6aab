"""Evaluate equation (1), ``F(s) P(s)^-1 B(s) + D(s)``, by a direct solve at each point.

Each ``P(s)`` is scaled by powers of two (which rounds nothing), factorized with partial pivoting,
and its solution is corrected once where the componentwise backward error is above rounding. Where the solution of a
random right-hand side, which is solved beside the others, shows that P(s) is nearly singular, the sum
``K + s C + s^2 M`` itself has lost digits: there the solution is refined with residuals summed term by term in twice
the working precision (`exact_products`).
"""

import numpy as np
import numpy.typing as npt

from halfdof_ctrl.base.arrays import EPS, ComplexArray, FloatArray, powers_of_two
from halfdof_ctrl.base.doors import require_switch, shown
from halfdof_ctrl.base.errors import ParameterError
from halfdof_ctrl.base.exact_products import ExactPolynomial
from halfdof_ctrl.base.sparse_arrays import is_sparse
from halfdof_ctrl.base.sparse_factors import CORRECTED_ABOVE
from halfdof_ctrl.model.quadratics import Coefficients
from halfdof_ctrl.model.refinement import (
    COARSE_GROWTH,
    ENOUGH_FOR_DATA,
    REFINED_ENOUGH,
    SUSPECT_GROWTH,
    DataLimit,
    random_right_side,
)
from halfdof_ctrl.model.sparse_evaluation import sparse_transfer
from halfdof_ctrl.model.weak_directions import Factors, refined_at

BATCH_ENTRIES = 2**21  #: complex entries of P(s) held at a time (32 MB)


def quadratic_transfer(
    P: Coefficients, B: Coefficients, F: Coefficients, D: Coefficients, points: ComplexArray
) -> ComplexArray:
    """Evaluate ``F(s) P(s)^-1 B(s) + D(s)`` at every point.

    Parameters
    ----------
    P, B, F, D : sequences of (n, n), (n, m), (p, n), (p, m) ndarrays, or all csc_arrays
        Coefficients of 1, s, s^2.
    points : (k,) complex ndarray
        Where to evaluate [rad/s].

    Returns
    -------
    (p, m, k) complex ndarray
        ``inf + nan j`` in every entry where ``P(s)`` is exactly singular.
    """
    if is_sparse(P[0]):
        return sparse_transfer(P, B, F, D, points)
    return transfer_and_growth(P, B, F, D, points)[0]


def transfer_and_growth(
    P: Coefficients, B: Coefficients, F: Coefficients, D: Coefficients, points: ComplexArray
) -> tuple[ComplexArray, FloatArray]:
    """Evaluate as `quadratic_transfer` does, dense matrices, and tell how nearly singular P(s) is at every point.

    Returns
    -------
    (p, m, k) complex ndarray
    (k,) ndarray
        Size of ``P(s)^-1 r`` for a random r of size one, in the units in which rows and columns of P(s) are even.
    """
    values, growth = np.empty((*D[0].shape, points.size), dtype=np.complex128), np.zeros(points.size)
    batch = max(1, BATCH_ENTRIES // max(1, P[0].size))
    for start in range(0, points.size, batch):
        part = points[start : start + batch]
        with np.errstate(invalid="ignore", over="ignore"):
            states, growth[start : start + batch] = _states(P, part, _polynomial(B, part), SUSPECT_GROWTH)
            response = _polynomial(F, part) @ states + _polynomial(D, part)
        response[~np.isfinite(states).all(axis=(1, 2))] = complex(np.inf, np.nan)
        values[:, :, start : start + batch] = np.moveaxis(response, 0, 2)
    return values, growth


def random_growth(P: Coefficients, points: ComplexArray) -> FloatArray:
    """Tell how nearly singular P(s), dense, is at every point, as `transfer_and_growth` does."""
    with np.errstate(invalid="ignore", over="ignore"):
        matrix = _polynomial(P, points)
        rows, columns = _scaling_powers(matrix)
        right = np.broadcast_to(random_right_side(P[0].shape[0])[:, None], (*matrix.shape[:2], 1))
        growth = np.abs(_solve_each(matrix * rows * columns, right)).max(axis=(1, 2), initial=0.0)
    return np.where(np.isfinite(growth), growth, np.inf)


def data_limit(P: Coefficients, B: Coefficients, F: Coefficients, D: Coefficients, points: ComplexArray) -> DataLimit:
    """Return (DATA) and the slope ``|s dH/ds|`` of dense models at every point, (p, m, k).

    With x and y the solutions for input and output, ``P x = B`` and ``y P = F``, (DATA) is what relative errors of eps
    in every coefficient change in first order, ``eps (|y| (|P| |x| + |B|) + |F| |x| + |D|)``, where
    ``|P| = |P_0| + |s| |P_1| + |s|^2 |P_2|`` and so on. Infinite where ``P(s)`` is exactly singular.

    Examples
    --------
    A spring of 4 N/m under 2 N gives 0.5 m, to which force and stiffness contribute one eps each:

    >>> one, four, two, zero = (np.array([[value]]) for value in (1.0, 4.0, 2.0, 0.0))
    >>> none = [zero, zero]
    >>> limit = data_limit([four, *none], [two, *none], [one, *none], [zero, *none], np.array([0j]))
    >>> bool(np.isclose(limit.data[0, 0, 0], 1.5 * np.finfo(float).eps))
    True
    """
    data, slope = np.empty((2, *D[0].shape, points.size))
    batch = max(1, BATCH_ENTRIES // max(1, P[0].size))
    transposed = [part.T for part in P]
    for start in range(0, points.size, batch):
        place = slice(start, start + batch)
        part = points[place]
        output = _polynomial(F, part)
        sizes_P, sizes_B, sizes_F, sizes_D = (_sizes(coefficients, part) for coefficients in (P, B, F, D))
        dP, dB, dF, dD = (_polynomial([X[1], 2.0 * X[2]], part) for X in (P, B, F, D))
        with np.errstate(invalid="ignore", over="ignore"):
            x = _states(P, part, _polynomial(B, part), COARSE_GROWTH, ENOUGH_FOR_DATA)[0]
            y = _states(transposed, part, np.swapaxes(output, 1, 2), COARSE_GROWTH, ENOUGH_FOR_DATA)[0]
            y = np.swapaxes(y, 1, 2)
            scale = _scaling_powers(_polynomial(P, part))
            (sx, sy) = _size(x, scale[1]), np.swapaxes(_size(np.swapaxes(y, 1, 2), scale[0]), 1, 2)
            bound = sy @ (sizes_P @ sx + sizes_B) + sizes_F @ sx + sizes_D
            change = dF @ x + y @ (dB - dP @ x) + dD
        data[:, :, place] = EPS * np.moveaxis(np.nan_to_num(bound, nan=np.inf), 0, 2)
        slope[:, :, place] = np.abs(np.moveaxis(change, 0, 2) * part)
    return DataLimit(data, slope)


def _states(
    P: Coefficients, points: ComplexArray, right: ComplexArray, refined_above: float, enough: float = REFINED_ENOUGH
) -> tuple[ComplexArray, FloatArray]:
    """Solve ``P(s) x = b`` at some points, refined where P(s) is nearly singular; give the growth too."""
    states, growth = _solved(_polynomial(P, points), right)
    suspect = np.flatnonzero(growth > refined_above)
    if suspect.size:
        exact = ExactPolynomial(P)
        for k in suspect.tolist():
            states[k] = _refined(P, exact, complex(points[k]), states[k], right[k], enough)
    return states, growth


def _refined(
    P: Coefficients, exact: ExactPolynomial, s: complex, states: ComplexArray, right: ComplexArray, enough: float
) -> ComplexArray:
    """Refine the solution at one point by residuals that are exact but for one rounding."""
    factors = Factors.of_dense(_polynomial(P, np.array([s]))[0])
    if factors is None:
        return states
    is_known = bool(np.isfinite(states).all())
    found = refined_at(exact, s, states if is_known else factors.solve(right), right, factors, enough=enough)
    if found.is_settled or (is_known and not found.is_singular):
        return found.solution
    return np.full(right.shape, complex(np.inf, np.nan))


def _size(x: ComplexArray, scale: FloatArray) -> FloatArray:
    """Return the sizes of the unknowns; one that should be zero is only as small as rounding lets it be."""
    across = scale.reshape(len(x), -1, 1)
    size = np.abs(x) / across
    return np.asarray((size + EPS * size.max(axis=1, keepdims=True, initial=0.0)) * across)


def _sizes(coefficients: Coefficients, points: ComplexArray) -> FloatArray:
    """Add up the sizes of the terms of a matrix polynomial, (k, rows, columns)."""
    return _polynomial([np.abs(coefficient) for coefficient in coefficients], np.abs(points)).real


def checked_points(s: npt.ArrayLike) -> ComplexArray:
    """Read points of the complex plane [rad/s], a number or a 1D array of them.

    Raises
    ------
    ParameterError
        More dimensions, or no numbers.
    """
    try:
        given = np.asarray(s)
        points = given.astype(np.complex128) if given.dtype.kind in "biufcO" else None
    except Exception as cause:
        msg = f"s must be numbers [rad/s], not {shown(s)}: {cause}."
        raise ParameterError(msg, parameter="s", value=s) from cause
    if points is None:
        msg = f"s must be numbers [rad/s], not {shown(s)}."
        raise ParameterError(msg, parameter="s", value=s)
    if points.ndim > 1:
        msg = f"s must be a number or a 1D array, but it has {points.ndim} dimensions."
        raise ParameterError(msg, parameter="s", value=s)
    return points


def squeezed(values: ComplexArray, *, scalar: bool, squeeze: bool | None) -> ComplexArray:
    """Drop axes of a (p, m, k) response as python-control does."""
    if squeeze is not None:
        require_switch(squeeze, "squeeze")
    if squeeze is None:
        squeeze = values.shape[:2] == (1, 1)
        values = values[0, 0] if squeeze else values
        return values[..., 0] if scalar else values
    values = values[..., 0] if scalar else values
    return values.squeeze() if squeeze else values


def _polynomial(coefficients: Coefficients, points: ComplexArray) -> ComplexArray:
    """Stack the values of a matrix polynomial, (k, rows, columns), skipping zero coefficients."""
    values = np.zeros((points.size, *coefficients[0].shape), dtype=np.complex128)
    for power, coefficient in enumerate(coefficients):
        if coefficient.any():
            values += (points**power)[:, None, None] * coefficient
    return values


def _solved(P: ComplexArray, B: ComplexArray) -> tuple[ComplexArray, FloatArray]:
    """Solve ``P x = B`` for a stack of matrices, scaled; give the growth of a random right-hand side too."""
    rows, columns = _scaling_powers(P)
    probe = np.broadcast_to(random_right_side(P.shape[1])[:, None], (*P.shape[:2], 1))
    scaled, right = P * rows * columns, np.concatenate([B * rows, probe], axis=2)
    solution = _solve_each(scaled, right)
    residual = right - scaled @ solution
    size = np.abs(scaled) @ np.abs(solution) + np.abs(right)
    coarse = (np.abs(residual) > CORRECTED_ABOVE * size).any(axis=(1, 2))
    if coarse.any():
        solution[coarse] += _solve_each(scaled[coarse], residual[coarse])
    growth = np.abs(solution[:, :, -1]).max(axis=1, initial=0.0)
    solution *= np.swapaxes(columns, 1, 2)
    return solution[:, :, :-1], np.where(np.isfinite(growth), growth, np.inf)


def _scaling_powers(P: ComplexArray) -> tuple[FloatArray, FloatArray]:
    """Return powers of two for rows (k, n, 1) and columns (k, 1, n) that bring largest entries to one."""
    rows = powers_of_two(np.abs(P).max(axis=2, initial=0.0))[:, :, None]
    return rows, powers_of_two(np.abs(P * rows).max(axis=1, initial=0.0))[:, None, :]


def _solve_each(P: ComplexArray, B: ComplexArray | FloatArray) -> ComplexArray:
    try:
        return np.asarray(np.linalg.solve(P, B), dtype=np.complex128)
    except np.linalg.LinAlgError:  # one of the stack is exactly singular: that one is infinite
        if P.shape[0] == 1:
            return np.full(B.shape, complex(np.inf, np.nan))
        half = P.shape[0] // 2
        return np.concatenate([_solve_each(P[:half], B[:half]), _solve_each(P[half:], B[half:])])
