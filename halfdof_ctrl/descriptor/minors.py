"""Where a matrix polynomial of any shape loses rank, as often as its determinantal divisor has that root.

A square one with a determinant vanishes where this does, and `finite_spectrum` finds its roots. Of any other one, of
normal rank r, two square polynomials of order r are made by adding random multiples of the rows and columns that are
too many to the others. Their determinants are random combinations of all minors of order r (Cauchy and Binet), so what
they have in common is the divisor and, almost surely, nothing else. How many roots they have in common is counted
exactly, by the greatest common divisor of two characteristic polynomials modulo a prime; which ones these are is seen
from those that agree.

Entries that were rounded before they were stored have hardly ever a root in common, where what was meant by them has
some: a motion that no input reaches, in rotated coordinates. So roots that agree to within their bounds are given as
well, and said to be such.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy.optimize

from halfdof_ctrl.base.arrays import EPS, ComplexArray, DenseMatrix, FloatArray
from halfdof_ctrl.descriptor.balancing import balancing_powers
from halfdof_ctrl.descriptor.exact_counts import (
    normal_rank,
    random_point,
    shifted_inverse,
    were_rounded,
)
from halfdof_ctrl.descriptor.finite_spectrum import finite_spectrum
from halfdof_ctrl.descriptor.nearness import UNDECIDED, nearly_singular, share_of_rounding
from halfdof_ctrl.descriptor.residues import PRIMES, characteristic, common_divisor, multiplicity, product, residues
from halfdof_ctrl.descriptor.scaled_polynomial import mean_frequency

SEEDS = (1, 2)  #: of the two combinations
AGREE = 1e-6  #: relative distance up to which a root of one is clearly one of the other
ROUNDED_ALIKE = 64.0  #: times their bounds: roots that agree to that may be common ones before the entries were rounded
TOLD_ALIKE = 1e-3  #: of their size: where bounds are wider, that they agree says nothing
SYSTEM_PENCIL = "of the system pencil"
NO_PAIR = 0.03  #: relative distance above which two roots are two
ZEROS_APART = 100.0  #: ratio of the distances of the first that does not count and the last that does


@dataclass(frozen=True, slots=True, eq=False)
class Zeros:
    """Roots of a determinantal divisor."""

    values: ComplexArray  #: (k,) [rad/s]; those at the origin are exactly zero
    bounds: FloatArray  #: (k,) how far rounding of the entries may have moved each [rad/s]
    doubts: tuple[str, ...]  #: what is uncertain, in words


@np.errstate(all="ignore")  # numbers near the largest and the smallest doubles; what comes of them is proved or doubted
def invariant_zeros(coefficients: Sequence[DenseMatrix]) -> Zeros:
    """Find the roots of the greatest common divisor of the largest minors that do not all vanish.

    Parameters
    ----------
    coefficients : sequence of (k, l) ndarrays
        Of 1, s, s^2.

    Examples
    --------
    ``(s + 2, 0)`` has rank one but at -2:

    >>> parts = [np.array([[2.0, 0.0]]), np.array([[1.0, 0.0]]), np.zeros((1, 2))]
    >>> invariant_zeros(parts).values.real.round(12).tolist()
    [-2.0]
    """
    rank = normal_rank(coefficients)
    if rank == 0:
        return _at_origin(0)
    if coefficients[0].shape == (rank, rank):
        spectrum = finite_spectrum(coefficients)
        return Zeros(spectrum.values, spectrum.bounds, (*spectrum.doubts, *_rank_doubts([coefficients])))
    found = (_common(coefficients, rank, p) for p in PRIMES)
    count, at_origin = next((common for common in found if common is not None), (0, 0))
    rounded = were_rounded(coefficients)
    if count == at_origin and not rounded:
        return _at_origin(count)
    squares = [_combined(coefficients, rank, seed) for seed in SEEDS]
    common = _common_roots(squares, count, at_origin, rounded=rounded)
    return Zeros(common.values, common.bounds, (*common.doubts, *_rank_doubts(squares)))


def _at_origin(count: int) -> Zeros:
    return Zeros(np.zeros(count, dtype=np.complex128), np.zeros(count), ())


def _rank_doubts(squares: Sequence[Sequence[DenseMatrix]]) -> list[str]:
    """Say where the rank itself rests on rounding: of fewer rows there are other zeros."""
    share = max(share_of_rounding(square) for square in squares)
    return [nearly_singular(share, SYSTEM_PENCIL)] if share > UNDECIDED else []


def _common(coefficients: Sequence[DenseMatrix], rank: int, p: int) -> tuple[int, int] | None:
    """Count the roots that two random combinations of minors have in common, and those at the origin, modulo a prime.

    That polynomials without a common root have one modulo p happens once in p.
    """
    parts, s0 = [residues(part, p) for part in coefficients], random_point(p)
    generator = np.random.default_rng(SEEDS)
    polynomials, zeros = [], []
    for _ in SEEDS:
        square = parts
        for _ in range(2):  # rows, then columns
            factors = generator.integers(1, p, (rank, square[0].shape[0] - rank))
            square = [((part[:rank] + product(factors, part[rank:], p)) % p).T for part in square]
        N, _, _ = shifted_inverse(square, s0, p)
        if N is None:  # the combinations are no random ones modulo this prime
            return None
        found = np.trim_zeros(characteristic(N, p), "b")  # without the eigenvalues at infinity
        polynomials.append(found)
        zeros.append(multiplicity(found, pow(s0, -1, p), p))
    return int(common_divisor(polynomials[0], polynomials[1], p).size) - 1, min(zeros)


def _combined(coefficients: Sequence[DenseMatrix], rank: int, seed: int) -> list[DenseMatrix]:
    """Add random multiples of the last rows and columns to the first, which leaves a square polynomial."""
    generator = np.random.default_rng(seed)
    unit = mean_frequency(_squared(coefficients))
    R0, R1, R2 = (np.abs(part) for part in coefficients)
    size = np.maximum(np.maximum(R0, R1 * unit), R2 * unit * unit)
    rows, columns = balancing_powers(size)
    parts = [part * rows[:, None] * columns for part in coefficients]
    more_rows, more_columns = parts[0].shape[0] - rank, parts[0].shape[1] - rank
    down = generator.uniform(0.5, 1.0, (rank, more_rows)) * generator.choice([-1.0, 1.0], (rank, more_rows))
    across = generator.uniform(0.5, 1.0, (more_columns, rank)) * generator.choice([-1.0, 1.0], (more_columns, rank))
    parts = [part[:rank] + down @ part[rank:] for part in parts]
    return [part[:, :rank] + part[:, rank:] @ across for part in parts]


def _squared(coefficients: Sequence[DenseMatrix]) -> list[DenseMatrix]:
    """Fill up with zeros to a square."""
    rows, columns = coefficients[0].shape
    return [np.pad(part, ((0, max(columns - rows, 0)), (0, max(rows - columns, 0)))) for part in coefficients]


def _common_roots(squares: Sequence[Sequence[DenseMatrix]], count: int, at_origin: int, *, rounded: bool) -> Zeros:
    """Pick the roots of the first that the second has too."""
    spectra = [finite_spectrum(square, primes=PRIMES[:1]) for square in squares]
    first, second = (_without_zeros(spectrum.values, spectrum.bounds, at_origin) for spectrum in spectra)
    wanted = count - at_origin
    values, bounds, distance = _matched(first, second)
    doubts = [doubt for spectrum in spectra for doubt in spectrum.doubts if spectrum.values.size < count]
    if values.size < wanted:
        doubts.append(
            f"{count} are common to two combinations of minors, but only {at_origin + values.size} were found"
        )
    elif wanted:
        last = distance[wanted - 1]
        following = distance[wanted] if distance.size > wanted else np.inf
        if last > AGREE and following < ZEROS_APART * last:
            doubts.append(
                f"{count} are common to two combinations of minors, the last of them to {last:.0e}, and another to "
                f"{following:.0e}"
            )
    chosen = np.arange(values.size) < wanted
    if rounded:
        alike, perhaps = (~chosen & which for which in _agree(values, bounds, distance))
        chosen |= alike
        doubts += _more_by_rounding(int(alike.sum()), int(perhaps.sum()), count)
    zeros = _at_origin(at_origin)
    bounds = np.maximum(bounds, distance * np.abs(values))
    return Zeros(
        np.concatenate([zeros.values, values[chosen]]), np.concatenate([zeros.bounds, bounds[chosen]]), tuple(doubts)
    )


def _agree(
    values: ComplexArray, bounds: FloatArray, distance: FloatArray
) -> tuple[npt.NDArray[np.bool_], npt.NDArray[np.bool_]]:
    """Return which pairs rounding has parted, and which it may have: where bounds are wide, agreement says little."""
    size, room = np.abs(values), ROUNDED_ALIKE * bounds
    within, told = 2.0 * distance * size <= room, (room <= TOLD_ALIKE * size) | (size == 0.0)
    return within & told, within & ~told


def _more_by_rounding(more: int, perhaps: int, exact: int) -> list[str]:
    """Say how many are no common roots of the stored numbers."""
    found = []
    if more:
        are = "one of them is a zero" if more == 1 else f"{more} of them are zeros"
        found.append(f"{are} but for rounding of the entries, and the stored numbers have {exact}")
    if perhaps:
        found.append(f"{perhaps} more may be {'a zero' if perhaps == 1 else 'zeros'}, which rounding hides")
    return found


def _without_zeros(values: ComplexArray, bounds: FloatArray, count: int) -> tuple[ComplexArray, FloatArray]:
    """Leave out so many of those at the origin, the exact ones first."""
    order = np.lexsort((bounds, np.abs(values)))
    return values[order[count:]], bounds[order[count:]]


def _matched(
    first: tuple[ComplexArray, FloatArray], second: tuple[ComplexArray, FloatArray]
) -> tuple[ComplexArray, FloatArray, FloatArray]:
    """Match roots of the first with those of the second; means, sums of bounds and distances, the closest first.

    Those that rounding does not tell from zero are zero.
    """
    (one, its), (other, others) = first, second
    one, other = (np.where(np.abs(values) <= bounds, 0.0, values) for values, bounds in (first, second))
    with np.errstate(invalid="ignore"):
        distance = np.abs(one[:, None] - other) / (np.abs(one)[:, None] + np.abs(other))
    distance = np.nan_to_num(distance)  # 0 from 0 is no distance
    rows, columns = scipy.optimize.linear_sum_assignment(np.log(distance + EPS))
    paired = np.flatnonzero(distance[rows, columns] <= NO_PAIR)
    order = paired[np.argsort(distance[rows, columns][paired], kind="stable")]
    rows, columns = rows[order], columns[order]
    return (one[rows] + other[columns]) / 2.0, its[rows] + others[columns], distance[rows, columns]
