"""What the stored numbers say exactly about ``P(s) = R_0 + R_1 s + R_2 s^2``: regularity, degree, blocks.

With R_2 = U V and the pencil (8), E = [R_1, U; V, 0] and A = [-R_0, 0; 0, I], one matrix at a random point s_0,

    N = (s_0 E - A)^-1 E = [ X; s_0 V X - [V, 0] ],   X = P(s_0)^-1 [R_1 + s_0 R_2, U]                     (31)

holds everything: its eigenvalues are ``1 / (s_0 - s)`` for each finite eigenvalue s, and zero for each infinite one.
So the ranks of N, N^2, ... fall to ``deg det P``, their differences count the blocks at infinity, and I - s_0 N tells
the eigenvalues at the origin in the same way. All of it is done modulo primes (`residues`): there is no threshold
anywhere. What comes out is a fact about the doubles; what was meant by them may have more structure than rounding left.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from halfdof_ctrl.base.arrays import DenseMatrix
from halfdof_ctrl.descriptor.residues import PRIMES, Residues, product, rank, reduced, residues

NOT_ROUNDED_BITS = 51  #: of an entry that was not rounded, at most: one that was fills its double, but for one in four
RANK_SEED = 20261129  #: of the points at which ranks are looked at


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ExactCounts:
    """Counts that hold for the doubles as they are stored."""

    size: int  #: n
    rank: int  #: of P(s) at almost every s
    dimension: int  #: n + rank R_2, of the pencil (8)
    degree: int  #: of det P(s), which is the number of finite eigenvalues; 0 if it vanishes identically
    at_origin: int  #: finite eigenvalues that are exactly zero
    steps: tuple[int, ...]  #: blocks at infinity of the pencil (8) of size one or more, two or more, ...

    @property
    def is_regular(self) -> bool:
        """Whether det P(s) does not vanish identically."""
        return self.rank == self.size

    @property
    def blocks(self) -> tuple[int, ...]:
        """Sizes of the Jordan blocks at infinity of the pencil (8), the largest first."""
        return tuple([sum(step > block for step in self.steps) for block in range(max(self.steps, default=0))])


def were_rounded(coefficients: Sequence[DenseMatrix]) -> bool:
    """Return whether entries fill the digits of a double, as rounded ones do; others are what they say.

    Examples
    --------
    >>> were_rounded([np.array([[3.0, 1.0 + 2.0**-45]])]), were_rounded([np.array([[0.1, 3.0]])])
    (False, True)
    """
    parts = [part for matrix in coefficients for part in (matrix.real, matrix.imag)]
    return any(bool((np.ldexp(np.frexp(part)[0], NOT_ROUNDED_BITS) % 1.0).any()) for part in parts)


def exact_counts(
    coefficients: Sequence[DenseMatrix], *, at_infinity: bool = True, primes: Sequence[int] = PRIMES
) -> ExactCounts:
    """Count what the square matrix polynomial has, modulo two primes.

    Parameters
    ----------
    coefficients : sequence of (n, n) ndarrays
        Of 1, s, s^2, real or complex.
    at_infinity : bool
        Whether `steps` are asked for, which take a reduction each.
    primes : sequence of int
        Moduli; one is enough where the counts of all blocks together are known.

    Returns
    -------
    ExactCounts
        Of the prime with the larger rank and degree, should they differ.

    Examples
    --------
    Two masses tied by a rigid link: two finite eigenvalues, one block of size three at infinity.

    >>> K = np.array([[2.0, 0, 1], [0, 3, -1], [1, -1, 0]])
    >>> counts = exact_counts([K, np.zeros((3, 3)), np.diag([1.0, 1.0, 0.0])])
    >>> counts.degree, counts.blocks, counts.at_origin
    (2, (3,), 0)
    """
    found = [_counts(coefficients, p, at_infinity=at_infinity) for p in primes]
    return max(found, key=lambda counts: (counts.rank, counts.degree, -counts.at_origin))


def normal_rank(coefficients: Sequence[DenseMatrix]) -> int:
    """Return the rank that a matrix polynomial of any shape has almost everywhere."""
    return max(rank(at_point([residues(part, p) for part in coefficients], random_point(p), p), p) for p in PRIMES)


def shifted_inverse(parts: Sequence[Residues], s0: int, p: int) -> tuple[Residues | None, int, int]:
    """Return N of (31) modulo p, None where P(s_0) is singular; its rank; the rank of R_2."""
    R0, R1, R2 = parts
    n = len(R0)
    V, places = reduced(R2, p)
    U, r = R2[:, places], places.size
    whole, pivots = reduced(np.hstack([at_point([R0, R1, R2], s0, p), (R1 + s0 * R2) % p, U]), p, n)
    if pivots.size < n:
        return None, int(pivots.size), r
    X = whole[:, n:]
    lower = s0 * product(V, X, p) % p
    lower[:, :n] = (lower[:, :n] - V) % p
    return np.vstack([X, lower]), n, r


def invertible_part(N: Residues, p: int) -> tuple[Residues, list[int]]:
    """Return a matrix with the nonzero eigenvalues of N, and the ranks of N, N^2, ... down to its own."""
    ranks: list[int] = []
    while True:
        rows, places = reduced(N, p)
        ranks.append(int(places.size))
        if places.size == len(N):
            return N, ranks[:-1]
        N = product(rows, N[:, places], p)  # N = L R with L its pivot columns: R L has the same nonzero eigenvalues


def core(N: Residues, p: int) -> Residues:
    """Return a matrix with the nonzero eigenvalues of N without the ranks between, by squaring."""
    power, size = N, len(N)
    while True:
        _, places = reduced(power, p)
        if places.size == len(N):
            return N
        if places.size == size:
            break
        size, power = int(places.size), product(power, power, p)
    Q = power[:, places]  # spans what all powers leave: N Q = Q X
    _, rows = reduced(Q.T.copy(), p)
    both = np.hstack([Q[rows], product(N[rows], Q, p)])
    return reduced(both, p, Q.shape[1])[0][:, Q.shape[1] :]


def random_point(p: int) -> int:
    """Return a point that knows nothing of the numbers."""
    return int(np.random.default_rng(RANK_SEED).integers(2**16, p - 1))


def at_point(parts: Sequence[Residues], s0: int, p: int) -> Residues:
    """Return the value of a matrix polynomial."""
    value = parts[-1]
    for part in reversed(parts[:-1]):
        value = (value * s0 + part) % p
    return value


def _counts(coefficients: Sequence[DenseMatrix], p: int, *, at_infinity: bool) -> ExactCounts:
    parts, s0 = [residues(part, p) for part in coefficients], random_point(p)
    n = len(parts[0])
    N, normal, r = shifted_inverse(parts, s0, p)
    if N is None:
        return ExactCounts(size=n, rank=normal, dimension=n + r, degree=0, at_origin=0, steps=())
    steps: tuple[int, ...] = ()
    if at_infinity:
        inner, ranks = invertible_part(N, p)
        steps = tuple([larger - smaller for larger, smaller in pairwise([n + r, *ranks])])
    else:
        inner = core(N, p)
    zeros = 0 if rank(parts[0], p) == n else zeros_at_origin(inner, s0, p)
    return ExactCounts(size=n, rank=n, dimension=n + r, degree=len(inner), at_origin=zeros, steps=steps)


def zeros_at_origin(N: Residues, s0: int, p: int) -> int:
    """Count the eigenvalues at the origin, where I - s_0 N is singular."""
    return len(N) - len(core((np.eye(len(N), dtype=np.int64) - s0 * N) % p, p))
