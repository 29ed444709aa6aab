"""Benchmark problems from the literature with singular leading coefficient, each with its source.

Quadratic eigenvalue problems here, constrained mechanisms in `benchmark_mechanisms`, circuits, flows, mounts and
rotors in `benchmark_circuits`. First-order systems ``E x' = A x + B u`` enter as ``C = E, K = -A`` without mass.
Numbers are the published ones unless the docstring says otherwise. Every function gives a model whose signals are those
of the source or, where it has none, forces on the equations of motion and all unknowns as outputs.
"""

from collections.abc import Callable
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from halfdof_ctrl import SecondOrderModel, mechss

FloatArray: TypeAlias = npt.NDArray[np.float64]
Problem: TypeAlias = Callable[[], SecondOrderModel]


def bordered(
    M: npt.ArrayLike, C: npt.ArrayLike, K: npt.ArrayLike, G: npt.ArrayLike, sign: float = 1.0, *, derivative: int = 0
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Append multipliers with forces ``sign G^T`` and constraints on the `derivative` of q, (r, n)."""
    G = np.atleast_2d(np.asarray(G, dtype=float))
    r = len(G)
    grown = [np.pad(np.asarray(matrix, dtype=float), (0, r)) for matrix in (K, C, M)]
    grown[0][:-r, -r:] = sign * G.T
    grown[derivative][-r:, :-r] = G
    return grown[2], grown[1], grown[0]


def first_order(
    E: npt.ArrayLike, A: npt.ArrayLike, B: npt.ArrayLike, outputs: npt.ArrayLike | None, name: str
) -> SecondOrderModel:
    """Make a model without mass of ``E x' = A x + B u, y = outputs x``."""
    return mechss(None, E, -np.asarray(A, dtype=float), B, outputs, name=name)


def forces(n: int, moving: int) -> FloatArray:
    """Give unit forces on the first equations."""
    return np.eye(n)[:, :moving]


def mobile_manipulator() -> SecondOrderModel:
    """Linearize a two-dimensional three-link mobile manipulator, two of its motions prescribed: index 3.

    Source: R. Byers, C. He, V. Mehrmann, Where is the nearest non-regular pencil?, Linear Algebra Appl. 285 (1998)
    81-105; problem `mobile_manipulator` of T. Betcke and others, NLEVP: a collection of nonlinear eigenvalue
    problems, ACM Trans. Math. Softw. 39 (2013).
    """
    M0 = [[18.7532, -7.94493, 7.94494], [-7.94493, 31.8182, -26.8182], [7.94494, -26.8182, 26.8182]]
    D0 = [[-1.52143, -1.55168, 1.55168], [3.22064, 3.28467, -3.28467], [-3.22064, -3.28467, 3.28467]]
    K0 = [[67.4894, 69.2393, -69.2393], [69.8124, 1.68624, -1.68617], [-69.8123, -1.68617, -68.2707]]
    matrices = bordered(M0, D0, K0, [[1, 0, 0], [0, 0, 1]], -1.0)
    return mechss(*matrices, forces(5, 3), name="mobile_manipulator")


def spring_dashpot(n: int = 10, seed: int = 1) -> SecondOrderModel:
    """Put Maxwell elements in parallel, mass and damping of low rank; random as in its source.

    Source: A. Gotts, Report regarding model reduction, University of Nottingham, 2005; problem `spring_dashpot` of
    NLEVP, whose random matrices have this structure.
    """
    generator = np.random.default_rng(seed)
    factors = generator.random((2, 2, 2))
    stiffness, mass = (factor @ factor.T for factor in factors)
    e, eta = generator.random((2, n // 2 - 1))
    arrow = np.diag([e.sum(), *e])
    arrow[0, 1:] = arrow[1:, 0] = eta
    M = np.zeros((n, n))
    M[:2, :2] = 7850.0 * mass
    return mechss(M, np.kron(np.diag([0.0, *eta]), stiffness), np.kron(arrow, stiffness), name="spring_dashpot")


def qep_with_one_infinite_eigenvalue() -> SecondOrderModel:
    """Eigenvalues 1/3, 1/2, 1, j, -j.

    Source: F. Tisseur, K. Meerbergen, The quadratic eigenvalue problem, SIAM Rev. 43 (2001) 235-286, page 250.
    """
    return mechss(
        [[0, 6, 0], [0, 6, 0], [0, 0, 1]], [[1, -6, 0], [2, -7, 0], [0, 0, 0]], np.eye(3), name="qep, one infinite"
    )


def qep_with_two_infinite_eigenvalues() -> SecondOrderModel:
    """Eigenvalues -1 and three times 1, with a Jordan chain at infinity.

    Source: F. Tisseur, K. Meerbergen, The quadratic eigenvalue problem, SIAM Rev. 43 (2001) 235-286, page 256.
    """
    C = [[-2, 0, 1], [0, 0, 0], [0, 0, 0]]
    return mechss(np.diag([1, 1, 0]), C, np.diag([1, -1, 1]), name="qep, two infinite")


def qep_with_nearby_eigenvalues() -> SecondOrderModel:
    """Eigenvalues 0, 1, 2, 3 and 1 + e, e = -1 + 1e-8: two of them nearly 0.

    Source: J.-P. Dedieu, F. Tisseur, Perturbation theory for homogeneous polynomial eigenvalue problems, Linear
    Algebra Appl. 358 (2003) 71-94, page 89.
    """
    e = -1.0 + np.sqrt(np.finfo(float).eps / 2.0)
    M = [[1, -1, -1], [0, 1, 0], [0, 0, 0]]
    C = [[-3, 1, 0], [0, -1 - e, 0], [0, 0, 1]]
    return mechss(M, C, [[2, 0, 9], [0, 0, 0], [0, 0, -3]], name="qep, nearby eigenvalues")


def qep_without_regularity() -> SecondOrderModel:
    """Give a singular pencil with Smith form diag(1, s - 1, 0): to be refused.

    Source: P. Van Dooren, P. Dewilde, The eigenstructure of an arbitrary polynomial matrix: computational aspects,
    Linear Algebra Appl. 50 (1983) 545-579.
    """
    M, C = [[1, 4, 2], [0, 0, 0], [1, 4, 2]], [[1, 3, 0], [1, 4, 2], [0, -1, -2]]
    return mechss(M, C, [[1, 2, -2], [0, -1, -2], [0, 0, 0]], name="qep, nonregular")


def bilby(beta: float = 0.5) -> SecondOrderModel:
    """Model a population as quasi-birth-death process; first and last coefficient singular.

    Source: N. J. Higham, H.-M. Kim, Numerical analysis of a quadratic matrix equation, IMA J. Numer. Anal. 20 (2000)
    499-519; problem `bilby` of NLEVP.
    """

    def coefficient(x: list[float]) -> FloatArray:
        matrix = 0.8 * np.diag(x[:4], 1)
        matrix[:, 0] = 0.2 * np.array(x)
        matrix[4, 4] = 0.8 * x[4]
        return matrix

    born, died = [1.0, 0.4, 0.25, 0.1, 0.0], [0.0, 0.5, 0.55, 0.8, 1.0]
    stayed = [1.0 - b - d for b, d in zip(born, died, strict=True)]
    return mechss(
        beta * coefficient(died).T,
        beta * coefficient(stayed).T - np.eye(5),
        beta * coefficient(born).T,
        name="bilby",
    )


def intersection() -> SecondOrderModel:
    """Intersect a cylinder, a sphere and a plane by a resultant: sparse, unsymmetric, entries from 1e-4 to 1.

    Source: D. Manocha, Solving systems of polynomial equations, IEEE Comput. Graph. Appl. 14 (1994) 46-55; problem
    `intersection` of NLEVP.
    """
    cylinder = {(0, 0): (-1.0, 0.0, 1.6e-3), (2, 0): (1.6e-3, 0.0, 0.0)}  # powers of y, z: coefficients of 1, x, x^2
    sphere = {(0, 0): (-1.0, 2.7e-2, 5.3e-4), (2, 0): (5.3e-4, 0.0, 0.0), (0, 2): (5.3e-4, 0.0, 0.0)}
    plane = {(0, 0): (-3.4e-3, -1.4e-4, 0.0), (1, 0): (1.0e-4, 0.0, 0.0), (0, 1): (1.0, 0.0, 0.0)}
    monomials = [(3, 0), (2, 1), (2, 0), (1, 2), (0, 3), (0, 2), (1, 1), (1, 0), (0, 1), (0, 0)]
    multiples = [(surface, power) for surface in (cylinder, sphere) for power in ((1, 0), (0, 1), (0, 0))]
    multiples += [(plane, power) for power in ((1, 1), (1, 0), (0, 1), (0, 0))]
    coefficients = np.zeros((3, 10, 10))
    for row, (surface, (y, z)) in enumerate(multiples):
        for (v, w), values in surface.items():
            coefficients[:, row, monomials.index((y + v, z + w))] = values
    K, C, M = coefficients
    return mechss(M, C, K, name="intersection")
