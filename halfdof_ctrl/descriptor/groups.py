"""Multiple eigenvalues and close ones: what a contour around a group says, where the single estimates do not.

Rounding splits an eigenvalue of multiplicity k by the k-th root of eps, so that estimates of it lie on a ring, each
with a bound of the size of the ring. The number in a circle around the ring and the mean of them are known to many
digits (`contours`): the number decides, and the mean is what each of them is.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from halfdof_ctrl.base.arrays import EPS, ComplexArray, FloatArray
from halfdof_ctrl.descriptor.contours import Contour, contour
from halfdof_ctrl.descriptor.quotients import Estimates
from halfdof_ctrl.descriptor.scaled_polynomial import ScaledPolynomial

GROUP_REACH = 8.0  #: estimates within so many of their bounds belong together
SAME_GROUP = 1e-6  #: estimates that were not settled and are closer than this part of their size belong together
WELL_KNOWN = 1e-9  #: relative bound below which estimates stand for themselves, however close they are
GROUP_CLEARANCE = 6.0  #: ratio of the distance of the next eigenvalue to the spread of a group
FLOOR = 1e-9  #: relative radius of a group that seems to be one point
ALIKE = 0.02  #: of the spread of the estimates: a smaller spread by the contour means one multiple eigenvalue
TWO_MEMBERS = 2  #: two eigenvalues follow from their mean and their spread


@dataclass(frozen=True, slots=True, eq=False)
class Listed:
    """Eigenvalues with conjugates, in the unit of the polynomial."""

    values: ComplexArray
    bounds: FloatArray
    doubts: tuple[str, ...] = ()

    @classmethod
    def none(cls) -> "Listed":
        """Return an empty list."""
        return cls(np.zeros(0, dtype=np.complex128), np.zeros(0))


def separated(
    polynomial: ScaledPolynomial,
    estimates: Estimates,
    which: npt.NDArray[np.bool_],
    others: ComplexArray,
    *,
    has_zeros: bool,
) -> Listed:
    """Take some of the estimates, groups of uncertain ones by contours, and add conjugates.

    Parameters
    ----------
    polynomial : ScaledPolynomial
    estimates : Estimates
    which : (k,) bool ndarray
        The estimates that stand for finite eigenvalues.
    others : (l,) complex ndarray
        Estimates from which circles keep a distance.
    has_zeros : bool
        Whether the origin is an eigenvalue.
    """
    values, bounds = estimates.values[which], estimates.bounds[which]
    is_settled = estimates.is_settled[which]
    if polynomial.is_real:
        twins = np.flatnonzero(values.imag != 0.0)
        values, bounds = np.concatenate([values, values[twins].conj()]), np.concatenate([bounds, bounds[twins]])
        is_settled = np.concatenate([is_settled, is_settled[twins]])
        others = np.concatenate([others, others.conj()])
    others = np.append(others, 0.0) if has_zeros else others
    doubtful = ~is_settled | (bounds > WELL_KNOWN * np.abs(values))
    if not doubtful.any():
        return Listed(values, bounds)
    groups = _groups(values, bounds, doubtful)
    found_values, found_bounds, doubts = [values[~doubtful]], [bounds[~doubtful]], []
    settled_elsewhere = np.flatnonzero(~doubtful)
    while groups:
        members = groups.pop()
        rest = np.concatenate(
            [values[settled_elsewhere], others, *[values[group] for group in groups], *found_values[1:]]
        )
        value, bound, merged, doubt = _resolved(polynomial, values[members], bounds[members], rest)
        if merged is not None and groups:
            nearest = min(range(len(groups)), key=lambda k: np.abs(values[groups[k]] - merged).min())
            if np.abs(values[groups[nearest]] - merged).min() == 0.0:
                groups.append(np.concatenate([members, groups.pop(nearest)]))
                continue
        found_values.append(value)
        found_bounds.append(bound)
        if doubt:
            doubts.append(doubt.format(np.abs(value.mean()) * polynomial.unit))
    return Listed(np.concatenate(found_values), np.concatenate(found_bounds), tuple(dict.fromkeys(doubts)))


def _groups(values: ComplexArray, bounds: FloatArray, doubtful: npt.NDArray[np.bool_]) -> list[npt.NDArray[np.intp]]:
    """Join doubtful estimates that bounds do not tell apart."""
    places = np.flatnonzero(doubtful)
    v, b = values[places], np.minimum(bounds[places], np.abs(values[places]))
    distance = np.abs(v[:, None] - v)
    near = (distance <= GROUP_REACH * (b[:, None] + b)) & (distance <= 0.7 * np.maximum(np.abs(v)[:, None], np.abs(v)))
    near |= distance <= SAME_GROUP * np.abs(v)
    count, labels = connected_components(csr_array(near.astype(np.int8)), directed=False)
    return [places[labels == label] for label in range(count)]


def _resolved(
    polynomial: ScaledPolynomial, values: ComplexArray, bounds: FloatArray, rest: ComplexArray
) -> tuple[ComplexArray, FloatArray, complex | None, str | None]:
    """Return what a contour says of a group; or the eigenvalue outside that is too close; or why it says nothing."""
    center = complex(values.mean())
    if polynomial.is_real and abs(center.imag) <= FLOOR * abs(center):
        center = complex(center.real)
    spread = float(np.abs(values - center).max())
    inner = max(spread, float(np.minimum(bounds, np.abs(values)).min()), FLOOR * abs(center))
    gaps = np.abs(rest - center)
    outer = float(gaps.min(initial=np.inf))
    if values.size == 1 and (outer > GROUP_CLEARANCE * inner or bounds[0] <= SAME_GROUP * abs(center)):
        return values, bounds, None, None
    if outer < GROUP_CLEARANCE * inner:
        return values, bounds, complex(rest[int(gaps.argmin())]), None
    radius = np.sqrt(inner * min(outer, GROUP_CLEARANCE**2 * inner))
    circle = contour(polynomial, center, radius)
    if circle.count is None:
        return values, bounds, None, "a group of eigenvalues near {:.4g} rad/s is not resolved"
    if circle.count == 0:
        return values[:0], bounds[:0], None, None
    return (*_by_moments(circle, center, values, bounds), None, None)


def _by_moments(
    circle: Contour, center: complex, values: ComplexArray, bounds: FloatArray
) -> tuple[ComplexArray, FloatArray]:
    """Return as many eigenvalues as a circle holds: one multiple, two from mean and spread, or the estimates."""
    count, radius = int(circle.count or 0), circle.radius
    mean = complex(circle.moments[1] * radius / circle.moments[0])
    variance = complex(circle.moments[2] * radius**2 / circle.moments[0]) - mean**2
    spread, wide = float(np.abs(values - center).max()), float(np.sqrt(abs(variance)))
    noise = radius * abs(complex(circle.moments[0]) - count)
    if wide <= max(ALIKE * spread, FLOOR * abs(center)) or wide**2 <= 4.0 * noise * radius:
        size = max(noise, EPS * abs(center)) + wide
        return np.full(count, center + mean), np.full(count, size)
    if count == TWO_MEMBERS:
        step = np.sqrt(variance)
        found = np.array([center + mean + step, center + mean - step])
        return found, np.full(TWO_MEMBERS, min(float(bounds.max()), wide) + noise)
    if count == values.size:
        return values, np.maximum(bounds, wide)
    return np.full(count, center + mean), np.full(count, spread + wide)
