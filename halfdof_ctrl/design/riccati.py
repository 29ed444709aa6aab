"""The stabilizing solution of the Riccati equation, with the error of its gain.

    A^T X + X A + Q - (X B + N) R^-1 (B^T X + N^T) = 0,    K = R^-1 (B^T X + N^T)          (30)

A solver gives a first X in units in which numbers are of one size (`care_scaling`), or `starts` a gain that stabilizes,
and Newton's method improves it: up to `FEW` states with residuals of many decimal digits (`few_states`), which leaves
nothing but the rounding of the gain; beyond that in doubles (`newton`), and with many digits where these do not do and
the states are not too many.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from halfdof_ctrl.base.arrays import FloatArray
from halfdof_ctrl.design.care_problem import CareProblem, CareSolution
from halfdof_ctrl.design.care_scaling import ScaledCare, scaled_care
from halfdof_ctrl.design.few_states import solved_with_digits
from halfdof_ctrl.design.modal_basis import ModalBasis
from halfdof_ctrl.design.newton import solved_by_newton
from halfdof_ctrl.design.starts import Solver, solutions, stabilizing_gains, starts

FEW = 24  #: states up to which decimals of many digits take milliseconds
MORE = 60  #: states up to which they take seconds, which are worth a gain that doubles do not give
FEWER = 4  #: states up to which a sign of many digits is faster than other starts
GOOD = 1e-10  #: error up to which doubles do ...
FAIR = 1e-8  #: ... and of more states, where another start costs seconds and leads to the same solution


def solved_care(problem: CareProblem, method: Solver, *, balance: bool = True) -> CareSolution | None:
    """Solve (30); None where no stabilizing gain is found.

    Parameters
    ----------
    problem : CareProblem
    method : {"scipy", "slycot"}
        Whose solution is the start; the other one's is tried where it does not stabilize.
    balance : bool
        Whether states are to be balanced: not where they have one unit already.

    Returns
    -------
    CareSolution or None
    """
    scaled = scaled_care(problem, balance=balance)
    n = len(problem.A)
    best = _in_doubles(scaled, problem, method) if n > FEW else None
    if n <= FEW or (n <= MORE and not _is_good(best)):
        exact = solved_with_digits(problem, _first_solutions(scaled, method, best))
        if exact is not None:
            return exact
    return best


def _is_good(found: CareSolution | None) -> bool:
    return found is not None and found.error <= (GOOD if len(found.X) <= MORE else FAIR)


def _in_doubles(scaled: ScaledCare, problem: CareProblem, method: Solver) -> CareSolution | None:
    """Solve in doubles from one start after the other."""
    best: CareSolution | None = None
    for X, gain in starts(scaled.problem, method):
        found = solved_by_newton(scaled.problem, X, gain)
        if found is not None and (best is None or found.error < best.error):
            best = found
        if _is_good(best):
            break
    if best is None:
        return None
    K, X = scaled.gain(best.K), scaled.solution(best.X)
    return replace(best, K=K, X=(X + X.T) / 2.0, closed=problem.A - problem.B @ K)


def _first_solutions(scaled: ScaledCare, method: Solver, best: CareSolution | None) -> Iterator[FloatArray]:
    """Give approximate solutions of the problem, as it was given."""
    if best is not None:
        yield best.X
    for X in solutions(scaled.problem, method):
        yield scaled.solution(X)
    if len(scaled.scale) > FEWER:
        for gain in stabilizing_gains(scaled.problem, method):
            cost = _cost_of(scaled.problem, gain)
            if cost is not None:
                yield scaled.solution(cost)


def _cost_of(problem: CareProblem, gain: FloatArray) -> FloatArray | None:
    """Return the cost of a gain that stabilizes, as x^T X x, for R = 1; None where it does not."""
    try:
        basis = ModalBasis(problem.A - problem.B @ gain)
    except (np.linalg.LinAlgError, ValueError):
        return None
    weighted = problem.Q - problem.N @ gain - gain.T @ problem.N.T + gain.T @ gain
    return basis.solution(basis.components(weighted)) if basis.is_stable else None
