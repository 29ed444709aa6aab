"""A bound that excludes a loss: never against exact arithmetic, and for ordinary models."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from halfdof_ctrl import SecondOrderModel, exact_reduction, mechss
from halfdof_ctrl.reduction.dense.method import SingleSolve, _is_bounded
from halfdof_ctrl.reduction.method.loss_bound import NO_LOSS
from support.beams import cantilever
from support.rational import rational_transfer
from support.verdict import Improved


def chain(generator: np.random.Generator, n: int) -> SecondOrderModel:
    """Draw masses, springs and dampers in SI units over three decades; some nodes are without mass."""
    k, c = 10.0 ** generator.uniform(3.0, 6.0, n), 10.0 ** generator.uniform(0.0, 3.0, n)
    links = np.eye(n) - np.eye(n, k=1)
    massive = generator.random(n) < 0.6
    massive[0] = True
    M = np.diag(massive * 10.0 ** generator.uniform(-1.0, 2.0, n))
    return mechss(M, links.T @ np.diag(c) @ links, links.T @ np.diag(k) @ links).select("F_q0", ["q0", f"q{n - 1}"])


def solved(model: SecondOrderModel) -> SingleSolve:
    """Reduce a model by one dense solve."""
    solution = exact_reduction(model).solution
    assert isinstance(solution, SingleSolve)
    return solution


@given(seed=st.integers(0, 2**32 - 1), n=st.integers(2, 5))
def test_what_is_bounded_loses_nothing(seed: int, n: int) -> None:
    """At modes and between them, in 600 bits."""
    model = chain(np.random.default_rng(seed), n)
    solution = solved(model)
    if not _is_bounded(solution):
        return
    output = solution.output(model)
    points = 1j * np.geomspace(1e-1, 1e4, 12)
    found = Improved(solution.A, solution.B, output.X, output.direct(1)).exactly_at(points)
    right = rational_transfer(model).at(points)
    size = np.maximum(np.abs(right), 1e-3 * np.maximum.accumulate(np.abs(right), axis=2))
    assert (np.abs(found - right) <= NO_LOSS * size).all()


def test_ordinary_chains_are_bounded_and_beams_are_not() -> None:
    """Most chains in SI units need no measurement; a beam of twenty elements does."""
    drawn = [_is_bounded(solved(chain(np.random.default_rng(seed), 6))) for seed in range(20)]
    assert sum(drawn) >= 15
    assert not _is_bounded(solved(cantilever(20)))


def test_what_static_dofs_leave_of_a_free_body_is_looked_at() -> None:
    """A free mass, whose equation is that of a massless node: A holds rounding in the place of an exact zero."""
    M = [[0, 0, 0], [0, 0, 2.0**-20], [0, 0, 0]]
    found = exact_reduction(mechss(np.array(M), None, [[5, -1, -4], [-1, 1, 0], [-4, 0, 4]], F=np.eye(3)[:1])).solution
    assert isinstance(found, SingleSolve)
    assert found.evidence.loss.omega > 0.0
