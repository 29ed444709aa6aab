"""One door to SuperLU: exact singularity is an exception, and nothing on stdout."""

import ctypes
import os
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress

import hypothesis.extra.numpy as hn
import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given
from numpy.testing import assert_allclose
from scipy.sparse import csc_array
from scipy.sparse.csgraph import structural_rank

from halfdof_ctrl import exact_reduction, frequency_response, mechss
from halfdof_ctrl.base.errors import HalfdofError, recording_warnings
from halfdof_ctrl.base.sparse_factors import PIVOTINGS, has_permutation, sparse_lu

TRIALS = 400
ROUNDING = 1e-9  #: of a system of 30 small integers

PATTERNS = st.integers(1, 7).flatmap(lambda n: hn.arrays(np.bool_, (n, n)))


def singular_matrix(seed: int) -> csc_array:
    """Make a matrix of small integers that is singular more often than not, in numbers or by its pattern."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 30))
    thin = rng.integers(-2, 3, (n, int(rng.integers(1, n + 1))))
    dense = thin @ (thin.T if seed % 2 else rng.integers(-2, 3, thin.T.shape))
    return csc_array((dense * (rng.random((n, n)) < rng.choice([1.0, 0.5, 0.3]))).astype(float))


def flush_compiled() -> None:
    """Write out what compiled code has printed."""
    if os.name == "posix":
        ctypes.CDLL(None).fflush(None)


@given(pattern=PATTERNS)
def test_a_permutation_is_found_where_there_is_one(pattern: np.ndarray) -> None:
    """As scipy's structural rank says."""
    matrix = csc_array(pattern.astype(float))
    assert has_permutation(matrix) == (structural_rank(matrix) == matrix.shape[0])


@pytest.mark.parametrize("way", PIVOTINGS)
def test_singular_matrices_are_refused_without_a_word(
    capfd: pytest.CaptureFixture[str], way: tuple[str, float]
) -> None:
    """SuperLU alone prints errors of BLAS for some of these, and crashes for others."""
    refused = 0
    for seed in range(TRIALS):
        matrix = singular_matrix(seed)
        right = np.arange(1.0, matrix.shape[0] + 1.0)
        try:
            factors = sparse_lu(matrix, *way)  # type: ignore[arg-type]  # pytest gives tuples of str
        except RuntimeError:
            refused += 1
            assert np.linalg.matrix_rank(matrix.toarray()) < matrix.shape[0]
            continue
        if way == PIVOTINGS[-1] and np.linalg.cond(matrix.toarray()) < 1e4:  # the other ways may lose all digits
            assert_allclose(matrix @ factors.solve(right), right, rtol=ROUNDING, atol=ROUNDING)
    flush_compiled()
    assert refused > TRIALS / 4
    assert capfd.readouterr() == ("", "")


def test_sparse_models_with_singular_matrices_leave_stdout_alone(capfd: pytest.CaptureFixture[str]) -> None:
    """Whatever becomes of them, from eight threads at a time."""

    def answer(seed: int) -> None:
        M, K = singular_matrix(2 * seed + 1), singular_matrix(2 * seed)
        n = min(M.shape[0], K.shape[0])
        with suppress(HalfdofError), recording_warnings():
            model = mechss(M[:n, :n], None, K[:n, :n])
            with suppress(HalfdofError):
                exact_reduction(model)
            frequency_response(model.select(model.inputs[0], model.outputs[0]), np.array([0.7, 1.9]))

    with ThreadPoolExecutor(8) as executor:
        list(executor.map(answer, range(60)))
    flush_compiled()
    assert capfd.readouterr().out == ""
