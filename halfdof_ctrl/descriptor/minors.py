"""Where a matrix polynomial of any shape loses rank, as often as its determinantal divisor has that root.

A square one with a determinant vanishes where this does, and `finite_spectrum` finds its roots. Of any other one, of
normal rank r, two square polynomials of order r are made by adding random multiples of the rows and columns that are
too many to the others. Their determinants are random combinations of all minors of order r (Cauchy and Binet), so what
they have in common is the divisor and, almost surely, nothing else. How many roots they have in common is counted
exactly, by the greatest common divisor of two characteristic polynomials modulo a prime; which ones these are is seen
from those that agree.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.optimize

from halfdof_ctrl.base.arrays import EPS, ComplexArray, DenseMatrix, FloatArray
from halfdof_ctrl.descriptor.balancing import balancing_powers
from halfdof_ctrl.descriptor.exact_counts import (
    normal_rank,
    random_point,
    shifted_inverse,
)
from halfdof_ctrl.descriptor.finite_spectrum import finite_spectrum
from halfdof_ctrl.descriptor.residues import PRIMES, characteristic, common_divisor, multiplicity, product, residues
from halfdof_ctrl.descriptor.scaled_polynomial import mean_frequency

SEEDS = (1, 2)  #: of the two combinations
AGREE = 1e-6  #: relative distance up to which a root of one is clearly one of the other
ZEROS_APART = 100.0  #: ratio of the distances of the first that does not count and the last that does


@dataclass(frozen=True, slots=True, eq=False)
class Zeros:
    """Roots of a determinantal divisor."""

    values: ComplexArray  #: (k,) [rad/s]; those at the origin are exactly zero
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
        return Zeros(np.zeros(0, dtype=np.complex128), ())
    if coefficients[0].shape == (rank, rank):
        spectrum = finite_spectrum(coefficients)
        return Zeros(spectrum.values, spectrum.doubts)
    found = (_common(coefficients, rank, p) for p in PRIMES)
    count, at_origin = next((common for common in found if common is not None), (0, 0))
    if count == at_origin:
        return Zeros(np.zeros(count, dtype=np.complex128), ())
    return _common_roots([_combined(coefficients, rank, seed) for seed in SEEDS], count, at_origin)


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


def _common_roots(squares: Sequence[Sequence[DenseMatrix]], count: int, at_origin: int) -> Zeros:
    """Pick the roots of the first that the second has too."""
    spectra = [finite_spectrum(square, primes=PRIMES[:1]) for square in squares]
    first, second = (_without_zeros(spectrum.values, spectrum.bounds, at_origin) for spectrum in spectra)
    wanted = count - at_origin
    values, distance = _matched(first, second)
    chosen = values[: min(wanted, values.size)]
    doubts = [doubt for spectrum in spectra for doubt in spectrum.doubts if spectrum.values.size < count]
    if chosen.size < wanted:
        doubts.append(
            f"{count} are common to two combinations of minors, but only {at_origin + chosen.size} were found"
        )
    elif wanted:
        last = distance[wanted - 1]
        following = distance[wanted] if distance.size > wanted else np.inf
        if last > AGREE and following < ZEROS_APART * last:
            doubts.append(
                f"{count} are common to two combinations of minors, the last of them to {last:.0e}, and another to "
                f"{following:.0e}"
            )
    return Zeros(np.concatenate([np.zeros(at_origin, dtype=np.complex128), chosen]), tuple(doubts))


def _without_zeros(values: ComplexArray, bounds: FloatArray, count: int) -> ComplexArray:
    """Leave out so many of those at the origin, the exact ones first."""
    order = np.lexsort((bounds, np.abs(values)))
    return values[order[count:]]


def _matched(first: ComplexArray, second: ComplexArray) -> tuple[ComplexArray, FloatArray]:
    """Match roots of the first with those of the second, the closest first."""
    with np.errstate(invalid="ignore"):
        distance = np.abs(first[:, None] - second) / (np.abs(first)[:, None] + np.abs(second))
    distance = np.nan_to_num(distance)  # 0 from 0 is no distance
    rows, columns = scipy.optimize.linear_sum_assignment(np.log(distance + EPS))
    order = np.argsort(distance[rows, columns], kind="stable")
    return (first[rows] + second[columns])[order] / 2.0, distance[rows, columns][order]
