"""The tests that a deflation must pass: the right spectrum, a singular pencil told, lost digits measured."""

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from halfdof_ctrl import SecondOrderModel, exact_reduction, mechss
from halfdof_ctrl.reduction.method.proof import AXIS_POINTS, Losses, ScaledPencil, has_spectrum
from halfdof_ctrl.reduction.method.signals import Signal, StateEquations
from halfdof_ctrl.reduction.method.units import scaled_rows
from support import exact
from support.mechanisms import blade, derivatives, hanging_chain, rod
from support.row_systems import realization
from support.structures import Structure, rank_deficient, structures

FloatArray = npt.NDArray[np.float64]
SEEDS = st.integers(0, 2**32 - 1)
MEASURED = 0.5  # a loss is a figure of one digit


def pencil_of(model: SecondOrderModel) -> ScaledPencil:
    """Scale a model's quadratics; outputs are all scaled displacements."""
    rows, _ = scaled_rows(np.stack(model.quadratics.P).astype(float), np.stack(model.quadratics.B).astype(float))
    n, m = len(model.dofs), model.B.shape[1]
    F = np.concatenate([np.eye(n)[None], np.zeros((2, n, n))])
    return ScaledPencil(P=rows.coefficients[:, :, :n], B=rows.coefficients[:, :, n:], F=F, D=np.zeros((3, n, m)))


def equations_of(model: SecondOrderModel) -> StateEquations:
    """Give the state equations in scaled units."""
    return realization(model)[0].equations


MECHANISMS = [rod(), blade(), hanging_chain(4), derivatives(3)]
NAMES = ["rod", "blade", "chain", "derivatives"]


@pytest.mark.parametrize("model", MECHANISMS, ids=NAMES)
def test_right_state_matrix_passes(model: SecondOrderModel) -> None:
    """``det P(s) = const det(s I - A)``, without states too."""
    assert pencil_of(model).has_spectrum(equations_of(model).A)


@pytest.mark.parametrize("model", MECHANISMS, ids=NAMES)
@pytest.mark.parametrize("extra", [0.0, -1.0, 30.0, -1e4])
def test_state_too_many_fails(model: SecondOrderModel, extra: float) -> None:
    """One more eigenvalue, slow or fast."""
    A = equations_of(model).A
    larger = np.zeros((len(A) + 1, len(A) + 1))
    larger[: len(A), : len(A)], larger[-1, -1] = A, extra
    assert not pencil_of(model).has_spectrum(larger)


@pytest.mark.parametrize("model", MECHANISMS[:3], ids=NAMES[:3])
def test_state_too_few_fails(model: SecondOrderModel) -> None:
    """The first pair of eigenvalues is left out."""
    values, vectors = np.linalg.eig(equations_of(model).A)
    rest = np.delete(np.arange(values.size), np.argsort(np.abs(values))[-2:])
    fewer = (
        np.diag(values[rest].imag)
        if rest.size < 2
        else np.linalg.pinv(vectors[:, rest]) @ (vectors[:, rest] * values[rest])
    )
    assert not pencil_of(model).has_spectrum(fewer)


@given(structure=structures(largest=6), factor=st.sampled_from([0.3, 3.0]))
def test_eigenvalues_of_another_size_fail(structure: Structure, factor: float) -> None:
    """The same count, but a spectrum three times as slow or as fast."""
    order = exact.order(*structure.matrices)
    assume(order > 0)
    assume(exact.determinant(*structure.matrices).coeffs()[0] != 0)  # not all of them zero
    A = equations_of(structure.model()).A
    assert pencil_of(structure.model()).has_spectrum(A)
    assert not pencil_of(structure.model()).has_spectrum(A * factor)


@given(structure=structures(largest=6))
def test_singular_pencil_is_told_exactly(structure: Structure) -> None:
    """If and only if the determinant vanishes identically in exact arithmetic."""
    assert pencil_of(structure.model()).is_singular() == (exact.order(*structure.matrices) < 0)


def test_matrix_of_zeros_is_singular() -> None:
    """Nothing to scale, nothing to divide by."""
    pencil = pencil_of(mechss(np.zeros((2, 2)), None, None))
    assert pencil.is_singular()


def lost(model: SecondOrderModel, disturbance: float) -> Losses:
    """Measure what state equations lose whose displacements are off by a factor."""
    right = equations_of(model)
    q = right.displacement
    wrong = Signal(q.X * (1.0 + disturbance), tuple([part * (1.0 + disturbance) for part in q.U]))
    return pencil_of(model).losses(StateEquations(A=right.A, B=right.B, displacement=wrong, shift=()))


@pytest.mark.parametrize("model", MECHANISMS, ids=NAMES)
def test_right_equations_lose_nothing(model: SecondOrderModel) -> None:
    """The worst error is below what is warned of by far, or within what the direct solve is known to."""
    assert lost(model, 0.0).worst < 1e-12


@pytest.mark.parametrize("model", MECHANISMS, ids=NAMES)
@pytest.mark.parametrize("disturbance", [1e-9, 1e-5, 0.1])
def test_lost_digits_are_measured(model: SecondOrderModel, disturbance: float) -> None:
    """All displacements off by 1e-9, 1e-5, 0.1 of themselves."""
    losses = lost(model, disturbance)
    assert_allclose(losses.worst, disturbance, rtol=MEASURED)
    assert_allclose(losses.error / losses.size, disturbance, rtol=MEASURED)


def test_difference_that_a_direct_solve_may_make_is_no_loss() -> None:
    """Springs of 1 and 1e12 N/m whose common displacement is known to 1e-5: a difference of 1e-7 says nothing."""
    K = 1e12 * np.array([[1.0, -1.0], [-1.0, 1.0]])
    K[0, 0] += 1.0
    model = mechss(None, None, K)
    assert lost(model, 1e-7).worst == 0.0
    assert_allclose(lost(model, 0.01).worst, 0.01, rtol=MEASURED)


def test_point_at_an_eigenvalue_is_left_out() -> None:
    """An undamped mass that is in resonance at one of the points is measured at the others."""
    stiffness = -((AXIS_POINTS[1] ** np.arange(3))[2]).real
    P = np.array([[[stiffness]], [[0.0]], [[1.0]]])
    pencil = ScaledPencil(P=P, B=np.array([[[1.0]], [[0.0]], [[0.0]]]), F=P * 0 + [[[1]], [[0]], [[0]]], D=P * 0.0)
    A = np.array([[0.0, 1.0], [-stiffness, 0.0]])
    displacement = Signal(np.array([[1.0, 0.0]]), ())
    equations = StateEquations(A=A, B=np.array([[0.0], [1.0]]), displacement=displacement, shift=())
    losses = pencil.losses(equations)
    assert losses.worst < 1e-14
    assert pencil.expected_loss(equations) < 1e-14
    assert 0.0 < losses.size[0] < 2.0


def test_expected_loss_is_that_of_the_last_digits() -> None:
    """``x' = -x + u`` with ``q = x``: two roundings of size eps at |1/(1 + s)|, the first point counts most."""
    pencil = pencil_of(mechss([[0]], [[1]], [[1]]))
    equations = equations_of(mechss([[0]], [[1]], [[1]]))
    found = pencil.expected_loss(equations)
    s = AXIS_POINTS[0]
    desired = np.finfo(float).eps * (abs(1 / (1 + s)) + 1.0)
    assert_allclose(found, desired, rtol=1e-12)


@pytest.mark.parametrize("model", MECHANISMS, ids=NAMES)
def test_expected_loss_is_free_of_the_states_units(model: SecondOrderModel) -> None:
    """States in other units change no digit of it."""
    pencil, right = pencil_of(model), equations_of(model)
    units = 2.0 ** np.arange(-20, -20 + 3 * len(right.A), 3)
    other = StateEquations(
        A=right.A * units / units[:, None],
        B=right.B / units[:, None],
        displacement=Signal(right.displacement.X * units, right.displacement.U),
        shift=(),
    )
    assert_allclose(pencil.expected_loss(other), pencil.expected_loss(right), rtol=1e-6)


@pytest.mark.filterwarnings(
    "ignore:The state space is exact, but:halfdof_ctrl.errors.LostDigitsWarning"
)  # 1e-9 or 2e-9
def test_determinant_far_out_is_exact_where_floating_point_does_not_know_it() -> None:
    """A dense mass of rank 4 among 12 DOFs: P(s) has rcond 1e-17 beyond the fastest pole, and the right A passes."""
    generator = np.random.default_rng([81008307, 12])
    model = rank_deficient(generator, 12).model()
    A = exact_reduction(model, method="orthogonal").A
    assert has_spectrum(model, A)
    assert not has_spectrum(model, np.block([[A, np.zeros((len(A), 1))], [np.zeros((1, len(A))), -np.ones((1, 1))]]))


@pytest.mark.parametrize(("stiffness", "passes"), [(1.0, True), (9.0, False), (0.2, False)])
def test_a_slow_spectrum_below_stiff_constraints_is_looked_at(stiffness: float, *, passes: bool) -> None:
    """An oscillator of 1 rad/s beside four held masses on springs of 65536 N/m, whose units are not its own."""
    M, K = np.diag([1.0] * 5 + [0.0] * 4), np.diag([1.0] + [2.0**16] * 4 + [0.0] * 4)
    K[1:5, 5:] = K[5:, 1:5] = np.eye(4)
    C = np.zeros_like(M)
    C[0, 0] = 0.25
    assert has_spectrum(mechss(M, C, K), np.array([[0.0, 1.0], [-stiffness, -0.25]])) is passes
