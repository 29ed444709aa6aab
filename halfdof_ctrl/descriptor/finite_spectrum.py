"""All finite eigenvalues of a regular matrix polynomial, how many there are, and what of it is in doubt.

Three things are found apart from each other and must agree: the exact count of the stored numbers (`exact_counts`), the
eigenvalues that quotients with QZ vectors make sharp (`quotients`), and where these are fewer, the count by circles
(`contours`). The list that comes out is proved in the end: ``sum 1 / (s - s_i) = tr P(s)^-1 P'(s)`` at a few s, where
one that is missing, doubled or invented shows as a number of order one.

Stored numbers that were rounded may have eigenvalues that nobody meant, of the size of the parts that rounding left:
zeros of a free body become small numbers, infinite eigenvalues large ones. So the count is an interval from what is
told from rounding to what the doubles say exactly.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from halfdof_ctrl.base.arrays import ComplexArray, DenseMatrix, FloatArray
from halfdof_ctrl.descriptor.contours import contour
from halfdof_ctrl.descriptor.exact_counts import ExactCounts, exact_counts
from halfdof_ctrl.descriptor.groups import Listed, separated
from halfdof_ctrl.descriptor.patterns import diagonal_blocks
from halfdof_ctrl.descriptor.quotients import KNOWN, Estimates, eigenvalue_estimates
from halfdof_ctrl.descriptor.residues import PRIMES
from halfdof_ctrl.descriptor.scaled_polynomial import ScaledPolynomial
from halfdof_ctrl.descriptor.unit_ranges import over_more_decades

OUTSIDE_CIRCLE = 8.0  #: circles around what is known have this radius, in units of the largest, or the smallest over it
TINY_CIRCLE = 1e-3  #: in the unit of a polynomial: estimates below may stand for zeros where nothing else is known
FAINT = 1e-4  #: relative bound above which an eigenvalue far from all others stands for zero or infinity
FAR_CIRCLE = 100.0  #: ratio to the next one
PLACES = (
    0.5,
    0.75,
    0.25,
    0.9,
)  #: between the inner and the outer eigenvalues, in the logarithm, where circles are tried
GROUP_AROUND = 0.3  #: of the largest: eigenvalues around zero have a smaller mean
CHECKS = 5  #: points at which the list is proved
FINITE_SPECTRUM_SAME = 1e-3  #: of the number of eigenvalues: largest difference of the two sides there
DIRECTION_SEED = 7  #: of the directions of these points


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class FiniteSpectrum:
    """Finite eigenvalues with bounds."""

    values: ComplexArray  #: (k,) [rad/s]; those at the origin are exactly zero
    bounds: FloatArray  #: (k,) of the error of each [rad/s]
    most: int  #: what the stored numbers say exactly; k where nothing is in doubt
    doubts: tuple[str, ...]  #: what is uncertain, in words
    close: int = 0  #: how many of the largest rest on parts that stand little above rounding
    unsure: int = 0  #: how many may be none where no circle counts as many as the list, or the list is not proved
    is_open: bool = False  #: whether that is so


@dataclass(slots=True)
class _Findings:
    """What a block has, as it is collected, in its own unit."""

    listed: Listed
    zeros: int = 0
    radius: float = 0.0  #: zeros are known to this
    doubts: list[str] = field(default_factory=list)
    close: int = 0
    is_open: bool = False


def finite_spectrum(
    coefficients: Sequence[DenseMatrix], counts: ExactCounts | None = None, *, primes: Sequence[int] = PRIMES
) -> FiniteSpectrum:
    """Find the finite eigenvalues of a regular matrix polynomial.

    Parameters
    ----------
    coefficients : sequence of (n, n) ndarrays
        Of 1, s, s^2.
    counts : ExactCounts, optional
        Of the same, where they are known.
    primes : sequence of int
        For counts of their blocks.
    """
    blocks = diagonal_blocks(np.any([part != 0.0 for part in coefficients], axis=0))
    values, bounds, doubts = [np.zeros(0, dtype=np.complex128)], [np.zeros(0)], []
    most = close = unsure = 0
    is_open = False
    for rows, columns in blocks:
        parts = [part[np.ix_(rows, columns)] for part in coefficients]
        if counts is not None and len(blocks) == 1:
            of_block = counts
        else:
            of_block = exact_counts(parts, at_infinity=False, primes=primes)
        polynomial = ScaledPolynomial.of(parts)
        found = _of_block(polynomial, of_block)
        zeros = np.zeros(found.zeros)
        values += [zeros.astype(np.complex128), found.listed.values * polynomial.unit]
        bounds += [_zero_bounds(found, of_block.at_origin) * polynomial.unit, found.listed.bounds * polynomial.unit]
        doubts += found.doubts
        most += of_block.degree
        close += found.close
        unsure += _unsure(found, of_block.at_origin) if found.is_open else 0
        is_open |= found.is_open
    return FiniteSpectrum(
        values=np.concatenate(values),
        bounds=np.concatenate(bounds),
        most=most,
        doubts=tuple(doubts),
        close=close,
        unsure=unsure,
        is_open=is_open,
    )


def _unsure(found: _Findings, exact_zeros: int) -> int:
    """Count those of a list that is not proved which rounding moves by more than a little."""
    clear = found.listed.bounds <= FAINT * np.abs(found.listed.values)
    return int(np.count_nonzero(~clear)) + max(found.zeros - exact_zeros, 0)


def _zero_bounds(found: _Findings, exact: int) -> FloatArray:
    """Return exact zeros no bound, the others the radius within which they are."""
    return np.where(np.arange(found.zeros) < exact, 0.0, found.radius)


def _of_block(polynomial: ScaledPolynomial, counts: ExactCounts) -> _Findings:
    if counts.degree == counts.at_origin:
        return _Findings(Listed.none(), zeros=counts.degree)
    estimates = eigenvalue_estimates(polynomial)
    if int(_weights(polynomial, estimates)[estimates.is_known].sum()) + counts.at_origin != counts.degree:
        estimates = over_more_decades(polynomial, estimates)
    near = _near_zero(estimates, counts.at_origin, is_real=polynomial.is_real)
    known = _is_told(estimates) & ~near
    weights = _weights(polynomial, estimates)
    found = _Findings(Listed.none(), zeros=counts.at_origin)
    if int(weights[near].sum()) > counts.at_origin:
        found.zeros, found.radius = _count_zeros(polynomial, estimates, near, counts.at_origin)
        if found.zeros == counts.at_origin:
            near &= _first(weights, counts.at_origin)
            known = _is_told(estimates) & ~near
    missing = counts.degree - found.zeros
    if int(weights[known].sum()) != missing:
        within = _within_gap(polynomial, estimates, near, weights, counts.degree)
        if within is None:
            within = _within_circle(polynomial, estimates, known, near, weights, found.zeros)
        known = known if within is None else within
    others = estimates.values[~known & ~near]
    found.listed = separated(polynomial, estimates, known, others, has_zeros=found.zeros > 0)
    _count_missing_zeros(polynomial, found, counts)
    _doubt_far_ones(polynomial, found)
    _judge(polynomial, found, counts)
    return found


def _count_missing_zeros(polynomial: ScaledPolynomial, found: _Findings, counts: ExactCounts) -> None:
    """Count by circles just below and above the list where it is too short: QZ may lose eigenvalues at the origin."""
    size = np.abs(found.listed.values)
    if size.size == 0 or found.zeros + size.size == counts.degree:
        return
    around, below = (
        contour(polynomial, 0.0, radius).count for radius in (OUTSIDE_CIRCLE * size.max(), size.min() / OUTSIDE_CIRCLE)
    )
    if around is not None and below is not None and around == below + size.size and below > found.zeros:
        found.zeros, found.radius = below, max(found.radius, float(np.sqrt(TINY_CIRCLE) * size.min()))


def _doubt_far_ones(polynomial: ScaledPolynomial, found: _Findings) -> None:
    """Leave out eigenvalues far above all others that rounding moves by their size, and doubt those it moves much.

    They stand for infinite ones if a part of M, C, K that is no more than rounding is taken for one: a decision that a
    method with ranks may take otherwise.
    """
    values, bounds = found.listed.values, found.listed.bounds
    size = np.abs(values)
    clear = bounds <= FAINT * size
    far = ~clear & (size > FAR_CIRCLE * size[clear].max(initial=0.0))
    lost = far & ~(bounds <= (KNOWN if clear.any() else 1.0) * size)
    far &= clear.any()
    close = far & ~lost
    found.listed = Listed(values[~lost], bounds[~lost], found.listed.doubts)
    found.close = int(np.count_nonzero(close))
    if found.close:
        above = float((size[close] / bounds[close]).min())
        found.doubts.append(
            f"{found.close} of the eigenvalues, from {size[close].min() * polynomial.unit:.3g} rad/s on, "
            f"{'rests' if found.close == 1 else 'rest'} on a part of M, C, K that stands {above:.1g} times above "
            f"rounding: if that part is meant as zero, {'it is' if found.close == 1 else 'they are'} at infinity"
        )


def _first(weights: npt.NDArray[np.int64], count: int) -> npt.NDArray[np.bool_]:
    """Mark the smallest estimates, as many as stand for a number of eigenvalues."""
    return np.asarray(np.cumsum(weights) - weights < count)


def _weights(polynomial: ScaledPolynomial, estimates: Estimates) -> npt.NDArray[np.int64]:
    """Count conjugates, which are left out of real polynomials."""
    return np.where((estimates.values.imag != 0.0) & polynomial.is_real, 2, 1)


def _is_told(estimates: Estimates) -> npt.NDArray[np.bool_]:
    """Return which estimates are known, but for those that parts of some hundred roundings make far from all others.

    A product of matrices rounds by tens of eps, which the entries of the result do not show. So what such parts could
    make of an infinite eigenvalue, far above the others, or of one at the origin, far below, is not told from rounding.
    """
    told = estimates.is_known
    places = np.flatnonzero(told)
    size, bounds = np.abs(estimates.values[places]), estimates.bounds[places]
    clear = np.flatnonzero(bounds <= FAINT * size)
    if clear.size == 0:
        return told
    first, last = int(clear[0]), int(clear[-1])
    if last + 1 < places.size and size[last + 1] > FAR_CIRCLE * size[last]:
        told[places[last + 1 :]] = False
    if first > 0 and size[first] > FAR_CIRCLE * size[first - 1]:
        told[places[:first]] = False
    return told


def _near_zero(estimates: Estimates, exact: int, *, is_real: bool) -> npt.NDArray[np.bool_]:
    """Return which estimates stand for eigenvalues at the origin: below all known ones, and not told from zero."""
    size = np.abs(estimates.values)
    known = np.flatnonzero(_is_told(estimates))
    below = np.arange(size.size) < known[0] if known.size else size <= TINY_CIRCLE
    near = below & ~(estimates.bounds <= FAINT * size)  # bounds may be nan where all is zero
    total = 0
    for k, value in enumerate(estimates.values):
        if total >= exact:
            break
        near[k] = True
        total += 2 if is_real and value.imag != 0.0 else 1
    return np.asarray(near)


def _count_zeros(
    polynomial: ScaledPolynomial, estimates: Estimates, near: npt.NDArray[np.bool_], exact: int
) -> tuple[int, float]:
    """Count what is not told from zero by a circle between it and the rest; none if it is not around zero."""
    size = np.abs(estimates.values)
    inner, outer = float(size[near].max(initial=0.0)), float(size[~near].min(initial=np.inf))
    spread = float(np.maximum(size, np.minimum(estimates.radii, TINY_CIRCLE))[near].max(initial=0.0))
    if not np.isfinite(outer):
        outer = OUTSIDE_CIRCLE**2 * max(inner, TINY_CIRCLE)
    for part in PLACES:
        radius = max(inner, TINY_CIRCLE**3 * outer) ** (1.0 - part) * outer**part
        circle = contour(polynomial, 0.0, radius)
        if circle.count is None:
            continue
        mean = abs(complex(circle.moments[1] * radius)) / max(circle.count, 1)
        if mean > GROUP_AROUND * inner and mean > TINY_CIRCLE**2 * radius:
            return exact, 0.0
        return max(circle.count, exact), min(spread, radius)
    return max(int(_weights(polynomial, estimates)[near].sum()), exact), spread


def _within_gap(
    polynomial: ScaledPolynomial,
    estimates: Estimates,
    near: npt.NDArray[np.bool_],
    weights: npt.NDArray[np.int64],
    degree: int,
) -> npt.NDArray[np.bool_] | None:
    """Take the estimates within the circle that holds as many eigenvalues as the exact count; None without one.

    Multiple eigenvalues are among them, whose estimates are too uncertain to be known one by one.
    """
    size = np.abs(estimates.values)
    total = np.cumsum(weights)
    place = np.flatnonzero(total == degree)
    if not place.size or not np.isfinite(size[place[0]]):
        return None
    inner = size[place[0]]
    outer = size[place[0] + 1] if place[0] + 1 < size.size else np.inf
    radius = np.sqrt(inner * outer) if np.isfinite(outer) else OUTSIDE_CIRCLE * inner
    if not 0.0 < radius < np.inf or contour(polynomial, 0.0, radius).count != degree:
        return None
    return np.asarray((np.arange(size.size) <= place[0]) & ~near)


def _within_circle(
    polynomial: ScaledPolynomial,
    estimates: Estimates,
    known: npt.NDArray[np.bool_],
    near: npt.NDArray[np.bool_],
    weights: npt.NDArray[np.int64],
    zeros: int,
) -> npt.NDArray[np.bool_] | None:
    """Take all estimates in a circle around the known ones, if they are as many as it holds; None otherwise."""
    size = np.abs(estimates.values)
    radius = OUTSIDE_CIRCLE * float(size[known].max(initial=0.0))
    inside = (size < radius) & ~near
    if int(weights[inside].sum()) == int(weights[known].sum()):
        return None
    count = contour(polynomial, 0.0, radius).count
    return inside if count == zeros + int(weights[inside].sum()) else None


def _judge(polynomial: ScaledPolynomial, found: _Findings, counts: ExactCounts) -> None:
    """Compare the number of what was found with the exact one, and prove the list."""
    total = found.zeros + found.listed.values.size
    largest = float(np.abs(found.listed.values).max(initial=0.0))
    if found.zeros > counts.at_origin:
        more = found.zeros - counts.at_origin
        found.doubts.append(
            f"{more} of {counts.degree} eigenvalues {'is' if more == 1 else 'are'} within "
            f"{found.radius * polynomial.unit:.2g} rad/s of the origin and not told from zero: free bodies in rounded "
            "numbers have such eigenvalues instead of zeros"
        )
    if total != counts.degree:
        within = contour(polynomial, 0.0, OUTSIDE_CIRCLE * largest).count if largest > 0.0 else None
        told = f"{total} eigenvalues are told from rounding, up to {largest * polynomial.unit:.3g} rad/s"
        if within == total:
            more = counts.degree - total
            found.doubts.append(
                f"{told}, and a circle around them holds as many, but the stored numbers have {counts.degree}: {more} "
                f"of them {'is' if more == 1 else 'are'} so large that parts of the size of rounding make "
                f"{'it' if more == 1 else 'them'}, which an exact model would have at infinity"
            )
        else:
            found.is_open = True
            around = "no whole number" if within is None else f"{within}"
            found.doubts.append(f"{told}; a circle around them holds {around}, the stored numbers have {counts.degree}")
    found.doubts += found.listed.doubts
    if total and not _is_proved(polynomial, found, largest):
        found.is_open = True
        found.doubts.append(
            f"the list of {total} eigenvalues does not reproduce the logarithmic derivative of det P(s): some are "
            "missing, doubled or invented"
        )


def _is_proved(polynomial: ScaledPolynomial, found: _Findings, largest: float) -> bool:
    """Compare ``sum s / (s - s_i)`` with ``s tr P(s)^-1 P'(s)`` at points that spread over the eigenvalues."""
    values = found.listed.values
    size = np.sort(np.abs(values)) if values.size else np.array([1.0])
    low = max(float(size[0]), 4.0 * found.radius)
    radii = np.unique(
        np.concatenate([np.quantile(size, np.linspace(0.1, 0.9, CHECKS - 2)), [low / 2.0, 2.0 * max(largest, low)]])
    )
    angles = np.random.default_rng(DIRECTION_SEED).uniform(0.2, 1.3, radii.size)  # off the axes
    points = np.asarray(radii * np.exp(1j * angles) * (1.0 + 0.01 * angles))
    with np.errstate(all="ignore"):
        right = points * polynomial.logarithmic_derivative(points)
        left = found.zeros + (points[:, None] / (points[:, None] - values)).sum(axis=1)
        difference = np.abs(left - right)
        room = FINITE_SPECTRUM_SAME * max(1.0, np.sqrt(values.size + found.zeros)) + _slack(points, found)
    return bool((np.isfinite(difference) & (difference <= room)).all())


def _slack(points: ComplexArray, found: _Findings) -> FloatArray:
    """Bound what errors of the eigenvalues within their bounds change in the sums."""
    distance = np.abs(points[:, None] - found.listed.values)
    share = np.abs(points)[:, None] * found.listed.bounds / np.maximum(distance, np.finfo(float).tiny) ** 2
    return np.asarray(np.minimum(share, 1.0).sum(axis=1) + found.zeros * np.minimum(found.radius / np.abs(points), 0.5))
