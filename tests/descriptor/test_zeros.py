"""Invariant zeros of any regular model against the greatest common divisor of minors in exact arithmetic.

The zeros of ``[P(s), -B(s); F(s), D(s)]`` of normal rank r are the roots of the greatest common divisor of its minors
of order r, its determinantal divisor (F. R. Gantmacher, The theory of matrices, 1959, chapter VI).
"""

from itertools import combinations
from typing import Any

import flint
import numpy as np
import numpy.typing as npt
from hypothesis import assume, given, settings

from halfdof_ctrl import SecondOrderModel, zeros
from support import exact
from support.anykinds import drawn_models
from support.structures import Structure

SMALL = 4  # DOFs: the number of minors grows fast
SCATTER = 1e-6  # of simple zeros, relative to the largest or one
MOST = settings(max_examples=max(15, settings().max_examples // 4))


def system_matrix(model: SecondOrderModel) -> npt.NDArray[np.float64]:
    """Give the coefficients (3, n + p, n + m) of the system matrix."""
    return np.stack(
        [
            np.block([[model.K, -model.B], [model.F, model.D]]),
            np.block([[model.C, -model.Bv], [model.G, model.Dv]]),
            np.block([[model.M, -model.Ba], [model.H, model.Da]]),
        ]
    )


def determinantal_divisor(S: npt.NDArray[np.float64]) -> flint.fmpq_poly:
    """Give the greatest common divisor of the largest minors that do not all vanish."""
    rows, columns = S.shape[1:]
    for rank in range(min(rows, columns), 0, -1):
        divisor = flint.fmpq_poly([])
        for i in combinations(range(rows), rank):
            for j in combinations(range(columns), rank):
                minor = exact.polynomial_determinant(S[:, list(i)][:, :, list(j)])
                divisor = divisor.gcd(minor)
                if divisor.degree() == 0:
                    return divisor
        if divisor.degree() >= 0:
            return divisor
    return flint.fmpq_poly([1])


@MOST
@given(case=drawn_models(largest=SMALL))
def test_zeros_are_those_of_the_determinantal_divisor(case: tuple[Structure, SecondOrderModel]) -> None:
    """As many as its degree, of any index and any number of signals; each simple one where exact arithmetic has it."""
    _, model = case
    model = model.select(inputs=list(model.inputs[:2]), outputs=list(model.outputs[:2]))
    assume(exact.order(model.M, model.C, model.K) >= 0)
    divisor = determinantal_divisor(system_matrix(model))
    found = zeros(model)
    assert found.size == divisor.degree()
    numerator = flint.fmpz_poly([int(c) for c in divisor.numer().coeffs()])
    roots: Any = numerator.complex_roots() if divisor.degree() > 0 else []
    for root in [complex(root) for root, times in roots if times == 1]:
        assert np.abs(found - root).min() <= SCATTER * max(1.0, float(np.abs(found).max()))
