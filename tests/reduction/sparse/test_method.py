"""Sparse models reduce to what their dense copies do, whatever the structure, and to the exact answer."""

from collections.abc import Callable
from typing import Any

import control
import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.sparse import block_diag, coo_array, csc_array, csr_matrix, diags_array
from scipy.sparse.linalg import splu

from halfdof_ctrl import ExactReduction, SecondOrderModel, exact_reduction, mech2ss, mechss
from halfdof_ctrl.base.arrays import as_dense
from halfdof_ctrl.base.errors import (
    HalfdofError,
    ImproperError,
    InconsistentStateError,
    LostDigitsWarning,
    ModelSizeError,
    SingularLeadingMatrixError,
    SingularPencilError,
)
from halfdof_ctrl.reduction.algebra.sparse_lu import SparseLU
from halfdof_ctrl.reduction.sparse import displacement
from halfdof_ctrl.reduction.sparse.partition import SparsePartition
from support import exact
from support.fe_models import space_frame, spring_grid
from support.structures import Structure, on_axis, structures

EPS = float(np.finfo(float).eps)
TRANSFER = 1e-10  # as for dense models: random structures, n <= 12, relative to the channel
LOSS = 64  # times eps / rcond(W)
POINTS: npt.NDArray[np.complex128] = np.array([0.3j, 1.1j, 4.7j, 0.6 + 0.2j])  # [rad/s]
MAY_LOSE = pytest.mark.filterwarnings("ignore::halfdof_ctrl.errors.LostDigitsWarning")  # the tolerance has rcond
AT_SIZE = 1e-8  # eigenvalues and responses of frames and grids against other solves


def sparse_model(structure: Structure, **options: Any) -> SecondOrderModel:  # noqa: ANN401  # those of mechss
    """Make the sparse model of a structure."""
    M, C, K = (csc_array(matrix.astype(float)) for matrix in structure.matrices)
    return mechss(M, C, K, **options)


def response(sys: control.StateSpace, points: npt.NDArray[np.complex128] = POINTS) -> npt.NDArray[np.complex128]:
    """Evaluate a state space by a plain solve at each point: (p, m, k)."""
    A, B, C, D = (np.asarray(matrix) for matrix in (sys.A, sys.B, sys.C, sys.D))
    unit = np.eye(A.shape[0])
    return np.stack([C @ np.linalg.solve(s * unit - A, B) + D for s in points], axis=2)


def reduced(model: SecondOrderModel, method: Any = None) -> ExactReduction | str:  # noqa: ANN401
    """Reduce, or name the refusal."""
    try:
        return exact_reduction(model, method=method)
    except HalfdofError as refusal:
        return type(refusal).__name__


@given(structure=structures())
def test_order_is_the_degree_of_the_determinant(structure: Structure) -> None:
    """In exact arithmetic, or the pencil is exactly singular."""
    reduction = reduced(sparse_model(structure))
    if isinstance(reduction, str):
        assert reduction == "SingularPencilError"
        assert exact.order(*structure.matrices) < 0
    else:
        assert reduction.order == exact.order(*structure.matrices)


@MAY_LOSE
@given(structure=structures(), method=st.sampled_from([None, "selection", "orthogonal"]))
def test_every_method_gives_what_it_gives_dense(structure: Structure, method: Any) -> None:  # noqa: ANN401
    """The same refusals, and the exact transfer function."""
    mine, dense = reduced(sparse_model(structure), method), reduced(structure.model(), method)
    if isinstance(mine, str) or isinstance(dense, str):
        assert mine == dense
        return
    assert (mine.order, mine.index, mine.n_infinite, mine.method) == (
        dense.order,
        dense.index,
        dense.n_infinite,
        dense.method,
    )
    desired = exact.transfer(structure.model(), POINTS)
    size = np.abs(desired).max(axis=2, keepdims=True)
    size = np.where(size > 0.0, size, np.abs(desired).max(initial=1e-300))
    loss = TRANSFER + LOSS * EPS / min(mine.rcond, dense.rcond)
    assert_allclose(response(mech2ss(mine)) / size, desired / size, rtol=0.0, atol=loss)


def improper_pairs(model: SecondOrderModel) -> tuple[tuple[str, str, int], ...]:
    """Give the pairs for which there is no state space."""
    try:
        mech2ss(model)
    except ImproperError as refusal:
        return refusal.pairs
    return ()


@st.composite
def signals(draw: st.DrawFn) -> tuple[Structure, dict[str, npt.NDArray[np.float64]]]:
    """Draw a structure with inputs and outputs of every kind."""
    structure = draw(structures(largest=7))
    n, generator = structure.size, np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    shapes = {"F": (3, n), "G": (3, n), "H": (3, n), "Bv": (n, 2), "Ba": (n, 2), "D": (3, 2), "Dv": (3, 2)}
    matrices = {"B": generator.integers(-1, 2, (n, 2)).astype(float)}
    for letter, shape in shapes.items():
        if draw(st.booleans()):
            matrices[letter] = generator.integers(-2, 3, shape) * (generator.random(shape) < 0.3) * 1.0
    return structure, matrices


@MAY_LOSE
@given(drawn=signals())
def test_all_signals_are_those_of_the_dense_model(drawn: tuple[Structure, dict[str, npt.NDArray[np.float64]]]) -> None:
    """Velocities, accelerations, derivatives of inputs: the same improper pairs, or the same transfer function."""
    structure, matrices = drawn
    try:
        mine, dense = sparse_model(structure, **matrices), structure.model(**matrices)
    except HalfdofError:  # no output at all
        assume(False)  # noqa: FBT003
        raise
    reduction = reduced(dense)
    assume(isinstance(reduction, ExactReduction))
    assert isinstance(reduction, ExactReduction)
    refusals = [improper_pairs(model) for model in (mine, dense)]
    assert refusals[0] == refusals[1]
    if refusals[0]:
        return
    desired = response(mech2ss(reduction))
    scale = max(float(np.abs(desired).max(initial=0.0)), 1.0)
    loss = scale * (TRANSFER + LOSS * EPS / reduction.rcond**2)
    assert_allclose(response(mech2ss(mine)), desired, rtol=0.0, atol=loss)


@given(structure=structures(largest=7), seed=st.integers(0, 2**32 - 1))
def test_states_and_recovered_motion_are_those_of_the_dense_model(structure: Structure, seed: int) -> None:
    """All DOFs back from a response, and the state from all DOFs, without the matrix of equation (4)."""
    mine, dense = reduced(sparse_model(structure)), reduced(structure.model())
    if isinstance(mine, str) or isinstance(dense, str) or not isinstance(mine.partition, SparsePartition):
        return
    generator = np.random.default_rng(seed)
    time, u = np.linspace(0.0, 1e-2, 5), generator.standard_normal((structure.size, 5))
    loss = TRANSFER + LOSS * EPS / dense.rcond**2
    motions = []
    for reduction in (mine, dense):
        answer = control.forced_response(mech2ss(reduction), time, u, return_states=True, squeeze=False)
        motions.append(reduction.recover(answer))
        moving = reduction.order - len(reduction.partition.inertial)
        state = reduction.state(motions[-1].displacement[:, 0], u0=u[:, 0])
        assert_allclose(state[:moving], answer.states[:moving, 0], atol=10 * loss)
    for name in ("displacement", "velocity"):
        found, desired = (getattr(motion, name) for motion in motions)
        assert_allclose(found, desired, rtol=0.0, atol=loss * max(1.0, float(np.abs(desired).max())))


def test_contradicting_initial_values_are_refused() -> None:
    """A static node between two springs follows from its neighbour."""
    model = mechss(csc_array(np.diag([1.0, 0.0])), None, [[2.0, -1.0], [-1.0, 2.0]])
    reduction = exact_reduction(model)
    assert reduction.state({"q0": 2.0, "q1": 1.0}).tolist() == [2.0, 0.0]
    with pytest.raises(InconsistentStateError, match=r"q1 = 5 \(must be 1\)"):
        reduction.state({"q0": 2.0, "q1": 5.0})


def test_inverse_rows_are_those_of_the_leading_matrix() -> None:
    """The paper's gamma and alpha, ``[gamma; alpha] W = [I 0]``."""
    structure = spring_grid(4, 3, 2, dampers=2)
    reduction = exact_reduction(structure.model())
    part = reduction.partition
    assert isinstance(part, SparsePartition)
    M, C, K = (matrix.toarray()[:, part.order] for matrix in (structure.M, structure.C, structure.K))
    W = np.hstack([M[:, :2], C[:, 2:4], K[:, 4:]])
    rows = np.vstack([reduction.gamma, reduction.alpha])
    assert_allclose(rows @ W, np.eye(4, 12), atol=1e-12)
    assert_allclose(reduction.B[-2:], reduction.gamma, atol=1e-15)


def test_old_matrices_of_scipy_are_taken() -> None:
    """``spmatrix`` multiplies by ``*`` where arrays do not."""
    M, K = csr_matrix(np.diag([2.0, 0.0])), csr_matrix([[8.0, -8.0], [-8.0, 16.0]])
    assert_allclose(mech2ss(M, None, K).A, [[0.0, 1.0], [-2.0, 0.0]])


@pytest.mark.parametrize("structure", [space_frame(4, 3, 4, 6, parts=3, dampers=2), spring_grid(60, 50, 12, dampers=3)])
def test_frames_and_grids_agree_with_other_solves(structure: Any) -> None:  # noqa: ANN401
    """Eigenvalues from the flexibility at the masses, responses from factorizations of P(s)."""
    model = structure.model()
    names = [f"q{k}" for k in (*structure.massive[:2], 5, structure.size // 2)]
    model = model.select(inputs=[f"F_{name}" for name in names[:3]], outputs=[*names, f"{names[0]}_dot"])
    sys = mech2ss(model)
    points = on_axis([0.7, 23.0, 311.0])
    desired = np.stack([_solved(structure, model, s) for s in points], axis=2)
    assert_allclose(response(sys, points), desired, rtol=0.0, atol=AT_SIZE * np.abs(desired).max())
    undamped = mechss(structure.M, None, structure.K).select(inputs=names[0].join(("F_", "")), outputs=names[0])
    found = np.sort(np.abs(np.linalg.eigvals(mech2ss(undamped).A)))[::2]
    places = structure.massive
    unit = np.zeros((structure.size, places.size))
    unit[places, range(places.size)] = 1.0
    flexibility = splu(structure.K).solve(unit)[places]
    mass = np.sqrt(structure.M.diagonal()[places])
    exact_values = np.sort(1.0 / np.sqrt(np.linalg.eigvalsh(mass[:, None] * flexibility * mass)))
    assert_allclose(found, exact_values, rtol=AT_SIZE)


@pytest.mark.skipif(bool(np.finfo(np.longdouble).eps > 1e-18), reason="a long double is a double on this machine")
def test_a_slender_beam_keeps_the_digits_that_its_condition_takes() -> None:
    """A cantilever of 1000 elements without mass (rcond 3e-12) under a tip mass of 1 kg: ``k = 3 EI / L^3``."""
    n = 1000
    element = np.array([[12.0, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]])
    places = 2 * np.arange(n)[:, None] + np.arange(4)
    entries = np.tile(element.ravel(), n), (np.repeat(places, 4, axis=1).ravel(), np.tile(places, (1, 4)).ravel())
    K = csc_array(csc_array(coo_array(entries, shape=(2 * n + 2, 2 * n + 2)))[2:, 2:])
    tip = 2 * n - 2
    M = csc_array(([1.0], ([tip], [tip])), shape=K.shape)
    with pytest.warns(LostDigitsWarning, match=r"lose .*e-0[78] of q1998 from F_q1998"):  # beside the resonance
        A = mech2ss(mechss(M, None, K).select(f"F_q{tip}", f"q{tip}")).A
    assert_allclose(-A[1, 0], 3.0 / n**3, rtol=1e-8)  # 1.6e-6 off without corrections in extended precision


def test_slanted_dampers_take_a_single_factorization(monkeypatch: pytest.MonkeyPatch) -> None:
    """Columns of C depend where a damper acts along no axis, which is seen before W is factorized by null columns."""
    structure = space_frame(4, 3, 4, 6, parts=2, dampers=0)
    damped = np.setdiff1d(np.arange(structure.size), structure.massive)[:3]
    along = csc_array(([0.6, 0.64, 0.48], (damped, [0, 0, 0])), shape=(structure.size, 1))
    model = mechss(structure.M, 40.0 * (along @ along.T), structure.K).select("F_q0", f"q{damped[0]}")
    used: list[str] = []
    monkeypatch.setattr(SparseLU, "factorized", _noting(used, "factorized", SparseLU.factorized))
    reduction = exact_reduction(model)
    assert reduction.method == "orthogonal"
    assert len(reduction.partition.half) == 1
    assert used == ["factorized"]
    desired = model.as_dense()(POINTS, squeeze=False)
    assert_allclose(response(mech2ss(reduction)), desired, rtol=0.0, atol=TRANSFER * np.abs(desired).max())


def test_a_singular_small_model_takes_the_dense_methods() -> None:
    """Its refusal is that of the dense model; with a method of its own choice it stays sparse."""
    loose = np.diag([1.0, 1.0]), np.array([[1.0, -1.0], [-1.0, 1.0]])
    model = mechss(csc_array(np.zeros((2, 2))), None, loose[1])
    for method in ("selection", "orthogonal"):
        with pytest.raises(SingularLeadingMatrixError, match="DOFs q0, q1") as caught:
            exact_reduction(model, method=method)
        assert caught.value.dofs == ("q0", "q1")
    with pytest.raises(SingularPencilError, match="q0, q1 float as one body"):
        exact_reduction(model)


def test_a_singular_large_model_names_what_floats() -> None:
    """A net of springs without ground and mass beside one that is held: 2700 DOFs, no dense copy."""
    held, loose = spring_grid(45, 40, 3), spring_grid(30, 30, 0)
    floating = loose.K - diags_array(loose.K.sum(axis=1))
    M, K = (block_diag(parts, format="csc") for parts in ((held.M, loose.M), (held.K, floating)))
    with pytest.raises(SingularLeadingMatrixError, match="by orthogonal") as caught:
        exact_reduction(mechss(M, None, K).select("F_q0", "q0"))
    assert caught.value.dofs == tuple(f"q{k}" for k in range(1800, 2700))


def test_too_many_states_are_refused_with_count_memory_and_a_way_on() -> None:
    """Before anything is factorized."""
    n = 200_000
    unit = csc_array((np.ones(n), (range(n), range(n))))
    words = r"200000 DOFs with mass .* 400000 states: A .* 1.28e\+03 GB.*truncate_modes"
    with pytest.raises(ModelSizeError, match=words):
        mech2ss(mechss(unit, None, unit).select("F_q0", "q0"))


def test_too_many_inputs_and_outputs_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """They are to be selected by name."""
    monkeypatch.setattr(displacement, "MOST_SYSTEM_ENTRIES", 40)
    structure = spring_grid(5, 5, 2)
    with pytest.raises(ModelSizeError, match="B would be a dense matrix of 4 x 25"):
        exact_reduction(structure.model(), method="selection")
    model = structure.model().select(inputs="F_q0")
    with pytest.raises(ModelSizeError, match="C would be a dense matrix of 25 x 4"):
        mech2ss(model)
    reduction = exact_reduction(model)
    with pytest.raises(ModelSizeError, match="The recovery of all DOFs would be a dense matrix of 25 x 4"):
        reduction.motion(0)
    with pytest.raises(ModelSizeError, match="gamma and alpha would be a dense matrix of 2 x 25"):
        _ = reduction.gamma
    assert mech2ss(model.select(outputs="q3")).nstates == 4


def test_many_outputs_are_solved_for_by_states(monkeypatch: pytest.MonkeyPatch) -> None:
    """All displacements of a net: a solution for each state and input, not one for each static DOF."""
    structure = spring_grid(6, 5, 2, dampers=1)
    model = structure.model().select(inputs="F_q0")
    used: list[str] = []
    for name in ("solve", "solve_transposed"):
        monkeypatch.setattr(SparseLU, name, _noting(used, name, getattr(SparseLU, name)))
    every = mech2ss(model)
    assert used == ["solve_transposed", "solve", "solve"]
    desired = model.as_dense()(POINTS, squeeze=False)
    assert_allclose(response(every), desired, rtol=0.0, atol=TRANSFER * np.abs(desired).max())


def _noting(used: list[str], name: str, method: Callable[..., Any]) -> Callable[..., Any]:
    """Note each use of a method."""

    def noted(*given: Any) -> Any:  # noqa: ANN401
        used.append(name)
        return method(*given)

    return noted


def _solved(structure: Any, model: SecondOrderModel, s: complex) -> npt.NDArray[np.complex128]:  # noqa: ANN401
    """Evaluate the transfer function by scipy's factorization of P(s) as it stands."""
    B, F, G = (as_dense(matrix) for matrix in (model.B, model.F, model.G))
    P = csc_array(structure.K + s * structure.C + s**2 * structure.M)
    return np.asarray((F + s * G) @ splu(P).solve(B.astype(np.complex128)))
