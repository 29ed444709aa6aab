"""Random structures of any index: constraints, algebraic loops, chains of derivatives, and mixtures of all.

Entries are small integers, so that exact arithmetic can judge what comes of them. Every kind takes a generator and a
size, as in `structures`. Some of what they draw is a singular pencil: it must be refused.
"""

from collections.abc import Callable
from typing import TypeAlias

import numpy as np
from hypothesis import strategies as st

from halfdof_ctrl import SecondOrderModel, mechss
from support.structures import (
    FloatArray,
    IntArray,
    Structure,
    assembled,
    assembly,
    gyroscopic,
    null_columns,
    passive,
    rank_deficient,
    semidefinite,
)

Kind: TypeAlias = Callable[[np.random.Generator, int], Structure]
Polynomial: TypeAlias = tuple[IntArray, IntArray, IntArray]

STRONGEST = 6  #: longest chain of derivatives: 6 derivatives mean index 7


def sparse_integers(generator: np.random.Generator, shape: tuple[int, int], largest: int = 2) -> IntArray:
    """Draw integers of which about half are zero."""
    return generator.integers(-largest, largest + 1, shape) * generator.integers(0, 2, shape)


def _with_masses(generator: np.random.Generator, size: int) -> Structure:
    """Draw masses on most DOFs, springs and dampers between them, as the constrained kinds start from."""
    M = np.diag(generator.integers(1, 6, size) * (generator.random(size) < 0.85))
    C = assembled(generator, size, int(generator.integers(0, size + 1))) if size else np.zeros((0, 0), dtype=np.int64)
    K = assembled(generator, size, int(generator.integers(0, 2 * size + 1))) if size else np.zeros_like(C)
    return Structure("masses", M, C, K)


def _bordered(structure: Structure, equations: Polynomial, forces: Polynomial, kind: str) -> Structure:
    """Append constraint equations (r, n) of order 0, 1, 2, and the columns (n, r) of their forces."""
    r = equations[0].shape[0]
    corner = np.zeros((r, r), dtype=np.int64)
    K, C, M = (
        np.block([[matrix, force], [equation, corner]])
        for matrix, equation, force in zip(structure.matrices[::-1], equations, forces, strict=True)
    )
    return Structure(kind, M, C, K)


def _split(generator: np.random.Generator, size: int) -> tuple[int, int]:
    """Split a size into moving DOFs and constraints, at most half of them constraints."""
    constraints = int(generator.integers(min(1, size // 2), size // 2 + 1))
    return size - constraints, constraints


def holonomic(generator: np.random.Generator, size: int) -> Structure:
    """Draw masses tied by position constraints ``G q = 0`` with their multipliers, index 3."""
    n, r = _split(generator, size)
    G = sparse_integers(generator, (r, n))
    no = np.zeros_like(G)
    return _bordered(_with_masses(generator, n), (G, no, no), (G.T, no.T, no.T), "holonomic")


def nonholonomic(generator: np.random.Generator, size: int) -> Structure:
    """Draw masses tied by velocity constraints ``G q' = 0`` (a blade, a rolling wheel), index 2."""
    n, r = _split(generator, size)
    G = sparse_integers(generator, (r, n))
    no = np.zeros_like(G)
    return _bordered(_with_masses(generator, n), (no, G, no), (G.T, no.T, no.T), "nonholonomic")


def constrained(generator: np.random.Generator, size: int) -> Structure:
    """Draw constraints in positions, velocities and accelerations, with forces that need not do without work."""
    n, r = _split(generator, size)
    equations = [sparse_integers(generator, (r, n)) * int(generator.random() < share) for share in (0.8, 0.4, 0.2)]
    forces = [sparse_integers(generator, (n, r)) * int(generator.random() < share) for share in (1.0, 0.2, 0.1)]
    base = _with_masses(generator, n) if generator.random() < 0.6 else gyroscopic(generator, n)
    return _bordered(base, (equations[0], equations[1], equations[2]), (forces[0], forces[1], forces[2]), "constrained")


def redundant(generator: np.random.Generator, size: int) -> Structure:
    """Draw position constraints of which one follows from the others: singular, unless there is but one."""
    n, r = _split(generator, size)
    G = sparse_integers(generator, (r, n))
    if r > 1:
        G[-1] = generator.integers(-2, 3, r - 1) @ G[:-1]
    no = np.zeros_like(G)
    return _bordered(_with_masses(generator, n), (G, no, no), (G.T, no.T, no.T), "redundant")


def massless_nodes(generator: np.random.Generator, size: int) -> Structure:
    """Draw few masses in a net of dampers and springs: loops of dampers, springs in series."""
    M = np.diag((generator.random(size) < 0.3) * generator.integers(1, 6, size))
    C = assembled(generator, size, int(generator.integers(0, 2 * size + 1)), grounded=0.1)
    K = assembled(generator, size, int(generator.integers(size, 2 * size + 1)), grounded=0.2)
    return Structure("massless nodes", M, C, K)


def manipulator(generator: np.random.Generator, size: int) -> Structure:
    """Draw unsymmetric C of low rank and unsymmetric K, held by multipliers with forces of the other sign."""
    n, r = _split(generator, size)
    rank = int(generator.integers(0, n + 1))
    M = semidefinite(generator, n, int(generator.integers((n + 1) // 2, n + 1)))
    C = generator.integers(-2, 3, (n, rank)) @ generator.integers(-2, 3, (rank, n))
    K = generator.integers(-4, 5, (n, n))
    G = np.eye(n, dtype=np.int64)[generator.permutation(n)[:r]]
    no = np.zeros_like(G)
    return _bordered(Structure("arm", M, C, K), (G, no, no), (-G.T, no.T, no.T), "manipulator")


def floating(generator: np.random.Generator, size: int) -> Structure:
    """Draw a free body: no spring or damper goes to the ground, mass of any rank."""
    M = semidefinite(generator, size, int(generator.integers(0, size + 1)))
    C = assembled(generator, size, int(generator.integers(0, size + 1)), grounded=0.0)
    K = assembled(generator, size, int(generator.integers(0, size + 1)), grounded=0.0)
    free = np.arange(size)  # what `assembled` ties to the ground, a spring from a DOF to itself, is taken out
    for matrix in (C, K):
        matrix[free, free] -= matrix.sum(axis=1)
    return Structure("floating", M, C, K)


def chain(generator: np.random.Generator, size: int) -> Structure:
    """Draw unknowns that are derivatives of each other, driven by or driving an ordinary structure."""
    length = int(generator.integers(1, size + 1))
    rest = size - length
    base = _with_masses(generator, rest)
    M, C, K = (np.zeros((size, size), dtype=np.int64) for _ in range(3))
    for matrix, part in zip((M, C, K), base.matrices, strict=True):
        matrix[:rest, :rest] = part
    K[rest:, rest:] = np.diag(generator.choice([-2, -1, 1, 2], length))
    derivatives = 0
    for i in range(rest + 1, size):
        order = int(generator.integers(0, 3))
        if derivatives + order <= STRONGEST:
            derivatives += order
            (K, C, M)[order][i, i - 1] = int(generator.choice([-2, -1, 1, 2]))
    if rest and generator.random() < 0.5:
        (K, C)[int(generator.integers(0, 2))][rest, int(generator.integers(0, rest))] = 1
    if rest and generator.random() < 0.4:
        K[int(generator.integers(0, rest)), size - 1] = 1
    return Structure("chain", M, C, K)


def unsymmetric(generator: np.random.Generator, size: int) -> Structure:
    """Draw sparse unsymmetric matrices, some of them zero."""
    M, C, K = (
        sparse_integers(generator, (size, size), 3) * (generator.random((size, size)) < share)
        for share in generator.choice([0.0, 0.3, 0.6, 1.0], 3)
    )
    return Structure("unsymmetric", M, C, K + np.diag(generator.integers(0, 2, size)))


PLAIN: tuple[Kind, ...] = (
    passive,
    assembly,
    null_columns,
    rank_deficient,
    gyroscopic,
    holonomic,
    nonholonomic,
    constrained,
    redundant,
    massless_nodes,
    manipulator,
    floating,
    chain,
    unsymmetric,
)


def combined(generator: np.random.Generator, size: int) -> Structure:
    """Draw two structures, one of which acts on the other."""
    first = int(generator.integers(0, size + 1))
    parts = [
        PLAIN[int(generator.integers(0, len(PLAIN)))](generator, part) for part in (first, size - first) if part > 0
    ]
    if len(parts) == 1:
        return Structure("combined", *parts[0].matrices)
    M, C, K = (
        np.block(
            [
                [one, np.zeros((first, size - first), dtype=np.int64)],
                [sparse_integers(generator, (size - first, first), 1) * int(generator.random() < share), other],
            ]
        )
        for one, other, share in zip(parts[0].matrices, parts[1].matrices, (0.1, 0.3, 0.7), strict=True)
    )
    return Structure("combined", M, C, K)


def unimodular(generator: np.random.Generator, size: int, steps: int) -> IntArray:
    """Draw an integer matrix of determinant one: rows added to each other, one after the other, and permuted."""
    matrix = np.eye(size, dtype=np.int64)
    for _ in range(steps if size > 1 else 0):
        i, j = generator.permutation(size)[:2]
        matrix[i] += int(generator.choice([-1, 1])) * matrix[j]
    return np.asarray(matrix[generator.permutation(size)])


def mixed(generator: np.random.Generator, size: int) -> Structure:
    """Draw any structure, its equations and its unknowns mixed by unimodular matrices."""
    structure = combined(generator, size)
    left, right = (unimodular(generator, size, int(generator.integers(0, 2 * size + 1))) for _ in range(2))
    M, C, K = (left @ matrix @ right for matrix in structure.matrices)
    return Structure("mixed", M, C, K)


ANY_KIND: tuple[Kind, ...] = (*PLAIN, combined, mixed)


def signals(generator: np.random.Generator, structure: Structure) -> SecondOrderModel:
    """Give a structure up to three inputs and outputs of all kinds: forces, motions and their derivatives."""
    n = structure.size
    m, p = generator.integers(1, 4, 2)
    often, seldom, never = 1.0, 0.25, 0.1

    def drawn(shape: tuple[int, int], share: float) -> IntArray:
        return sparse_integers(generator, shape) * int(generator.random() < share)

    F, G, H = (drawn((p, n), share) for share in (often, 0.5, seldom))
    if generator.random() < 0.5:  # single displacements
        F = np.eye(n, dtype=np.int64)[generator.integers(0, n, p)]
    return mechss(
        *structure.matrices,
        drawn((n, m), often),
        F,
        G,
        H=H,
        D=drawn((p, m), seldom),
        Bv=drawn((n, m), seldom),
        Ba=drawn((n, m), never),
        Dv=drawn((p, m), never),
        Da=drawn((p, m), never),
    )


def in_units(model: SecondOrderModel, columns: FloatArray, rows: FloatArray, tau: float) -> SecondOrderModel:
    """Measure DOFs, equations and time in other units; inputs and outputs stay what they are."""
    P = [matrix * rows[:, None] * columns * tau**k for k, matrix in enumerate(model.quadratics.P)]
    B = [matrix * rows[:, None] * tau**k for k, matrix in enumerate(model.quadratics.B)]
    F = [matrix * columns * tau**k for k, matrix in enumerate(model.quadratics.F)]
    D = [matrix * tau**k for k, matrix in enumerate(model.quadratics.D)]
    return mechss(P[2], P[1], P[0], B[0], *F[:2], H=F[2], D=D[0], Bv=B[1], Ba=B[2], Dv=D[1], Da=D[2])


def nearly_singular(generator: np.random.Generator, structure: Structure) -> Structure:
    """Move an entry of M by so little, 2^-20 to 2^-45, that where M was singular one of its values becomes that small.

    The entries stay exact. The numbers as they are stored have states more for it, very fast ones.
    """
    M = structure.M.astype(float)
    M[tuple(generator.integers(0, structure.size, 2))] += 2.0 ** -int(generator.integers(20, 46))
    return Structure(structure.kind, M, structure.C, structure.K)  # floats that act as integers


@st.composite
def drawn_models(
    draw: st.DrawFn, kinds: tuple[Kind, ...] = ANY_KIND, largest: int = 12
) -> tuple[Structure, SecondOrderModel]:
    """Draw a structure of the given kinds and a model of it with a few signals."""
    kind = draw(st.sampled_from(kinds))
    size = draw(st.integers(1, largest))
    generator = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    structure = kind(generator, size)
    return structure, signals(generator, structure)
