"""Descriptor systems against circuits, constrained mechanics and loops whose transfer functions are known."""

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.testing import assert_allclose

import halfdof_ctrl as hd
from halfdof_ctrl.base.errors import (
    ComplexModelError,
    ImproperError,
    MatrixError,
    ParameterError,
    SignalNameError,
    SingularPencilError,
)

SOLVED = 1e-11  #: a small solve against a formula
S = 1j * np.geomspace(0.01, 100, 12)


def test_rlc_circuit_keeps_its_variables() -> None:
    """Source, R, L and C in a loop: currents and voltages by Kirchhoff, the capacitor's voltage over the source's."""
    R, L, C = 2.0, 0.5, 0.1
    E = np.diag([L, C, 0, 0.0])  # i, vc, vr, vl
    A = np.array([[0, 0, 0, 1], [1, 0, 0, 0], [-R, 0, 1, 0], [0, 1, 1, 1]])
    sys = hd.dss2ss(A, [[0], [0], [0], [-1]], [[0, 1, 0, 0]], 0, E, states=["i", "vc", "vr", "vl"], inputs="source")
    assert sys.state_labels == ["i", "vc"]
    assert_allclose(sys(S), 1.0 / (L * C * S**2 + R * C * S + 1.0), rtol=SOLVED)


def test_variables_stay_where_bases_would_mix_them() -> None:
    """E without a null column: selection by deflation keeps x1 and x3 as states."""
    E, A = np.array([[1, 1, 0], [0, 0, 0], [0, 0, 1.0]]), np.array([[-1, 0, 1.0], [1, -2, 0], [0, 1, -3]])
    sys = hd.dss2ss(A, [[0], [1], [0]], np.eye(3), 0, E, states=["x1", "x2", "x3"])
    assert set(sys.state_labels) <= {"x1", "x2", "x3"}
    desired = np.array([np.linalg.solve(s * np.array(E) - A, [0, 1, 0]) for s in S]).T
    assert_allclose(sys(S)[:, 0], desired, rtol=SOLVED)


def test_pendulum_in_cartesian_coordinates_is_reduced() -> None:
    """Index 3: x, y, their speeds and the rod's force; one oscillation is left, at sqrt(g / l)."""
    g, length = 9.81, 0.5
    E = np.diag([1.0, 1, 1, 1, 0])
    A = np.zeros((5, 5))
    A[0, 2] = A[1, 3] = 1.0
    A[2, 0], A[3, 4] = -g / length, 1.0  # about hanging at rest: x'' = -g x / l, y'' = force
    A[4, 1] = 1.0  # y = 0
    sys = hd.dss2ss(A, [0, 0, 1, 0, 0], [1, 0, 0, 0, 0], 0, E, states=["x", "y", "vx", "vy", "force"])
    assert_allclose(np.abs(sys.poles()), np.sqrt(g / length), rtol=SOLVED)


def test_pid_with_pure_derivative_around_a_plant_is_proper() -> None:
    """The controller alone is improper; with the plant the loop has the plant's and the integrator's states."""
    kp, ki, kd = 3.0, 2.0, 0.7  # plant 1 / (s^2 + s), e = r - y, u = kp e + ki z + kd e'
    names = ["y", "v", "z", "e", "u"]
    E = np.zeros((5, 5))
    A = np.zeros((5, 5))
    E[0, 0], A[0, 1] = 1.0, 1.0
    E[1, 1], A[1, 1], A[1, 4] = 1.0, -1.0, 1.0
    E[2, 2], A[2, 3] = 1.0, 1.0
    A[3, 3], A[3, 0] = -1.0, -1.0
    E[4, 3], A[4, 4], A[4, 3], A[4, 2] = -kd, -1.0, kp, ki
    loop = hd.dss(A, [0, 0, 0, 1, 0], [1, 0, 0, 0, 0], 0, E, states=names, inputs="r")
    sys = hd.dss2ss(loop)
    number = kd * S**2 + kp * S + ki
    assert sys.nstates == 3
    assert_allclose(sys(S), number / (S**3 + S**2 + number), rtol=SOLVED)
    with pytest.raises(ImproperError, match="u from r") as refusal:
        hd.dss2ss(loop.select("r", "u"))
    assert refusal.value.pairs == (("r", "u", 1),)


def test_inverse_of_a_lag_is_refused_with_its_polynomial() -> None:
    """The inverse of 1 / (s + 1) is 1 + s."""
    given = ([[-1, 1], [-1, 0]], [[0], [1]], [[0, 1]], 0, [[1, 0], [0, 0]])
    with pytest.raises(ImproperError, match=r"w from u\[0\] = 1 \+ 1 s \+ \(strictly proper part\)"):
        hd.dss2ss(*given, states=["x", "w"])
    dropped = hd.dss2ss(*given, states=["x", "w"], improper="drop")
    assert_allclose(dropped.D, [[1.0]])


def test_regular_leading_matrix_is_an_ordinary_system() -> None:
    """``E^-1 A``, and None for the unit matrix."""
    g = np.random.default_rng(0)
    A, E = g.standard_normal((3, 3)), g.standard_normal((3, 3)) + 3 * np.eye(3)
    B, C, D = g.standard_normal((3, 2)), g.standard_normal((1, 3)), g.standard_normal((1, 2))
    for leading, matrix in ((E, E), (None, np.eye(3))):
        sys = hd.dss2ss(A, B, C, D, leading)
        desired = np.array([C @ np.linalg.solve(s * matrix - A, B) + D for s in S])
        assert_allclose(np.moveaxis(sys(S), 2, 0), desired, rtol=SOLVED)


def test_sparse_descriptor_system_is_reduced() -> None:
    """A line of resistors with capacitors at every second node."""
    n = 60
    A = sp.csc_array(sp.diags_array([[1.0] * (n - 1), [-2.0] * n, [1.0] * (n - 1)], offsets=[-1, 0, 1]))
    E = sp.csc_array(sp.diags_array(np.arange(n) % 2 * 1.0))
    system = hd.dss(A, np.eye(n)[0], np.eye(n)[-1], 0, E)
    assert system.is_sparse
    sys = hd.dss2ss(system)
    assert sys.nstates == n // 2
    s = 0.3j
    assert_allclose(sys(s), np.linalg.solve(s * E.toarray() - A.toarray(), np.eye(n)[0])[-1], rtol=SOLVED)


def test_singular_pencil_is_told_in_variables_and_equations() -> None:
    """An equation that stands twice."""
    with pytest.raises(
        SingularPencilError, match=r"det\(s E - A\) vanishes .* equations 2, 3 \(counted from 1\)"
    ) as refusal:
        hd.dss2ss(
            [[-1, 1, 0], [1, 1, 1], [1, 1, 1]], [1, 0, 0], [1, 0, 0], 0, np.diag([1, 0, 0]), states=["a", "b", "c"]
        )
    assert "DOF" not in str(refusal.value)


def test_bad_matrices_are_refused_by_their_own_letters() -> None:
    """A, B, C, D, E, not those of a mechanical model."""
    with pytest.raises(MatrixError, match="E must be 2 x 2, but it is 3 x 3"):
        hd.dss(np.eye(2), [1, 0], [1, 0], 0, np.eye(3))
    with pytest.raises(MatrixError, match="A must be square"):
        hd.dss(np.ones((2, 3)), [1, 0], [1, 0], 0, np.eye(2))
    with pytest.raises(MatrixError, match="B must be 2 x 3, but it is 1 x 3"):
        hd.dss(np.eye(2), [[1, 0, 0]], [1, 0], 0, np.eye(2))
    with pytest.raises(ComplexModelError, match="A has imaginary parts"):
        hd.dss2ss(1j * np.eye(2), [1, 0], [1, 0], 0, np.eye(2))
    with pytest.raises(ParameterError, match="the matrices A, B, C, D, E"):
        hd.dss2ss(np.eye(2))
    with pytest.raises(ParameterError, match="improper must be"):
        hd.dss2ss(np.eye(2), [1, 0], [1, 0], 0, np.eye(2), improper="yes")  # type: ignore[arg-type]
    with pytest.raises(SignalNameError, match="brings its matrices and names with it"):
        hd.dss2ss(hd.dss(np.eye(2), [1, 0], [1, 0], 0, np.eye(2)), states=["a", "b"])


def test_print_speaks_of_variables_and_equations() -> None:
    """Not of DOFs."""
    text = repr(hd.dss(np.eye(2), [1, 0], [1, 0], 0, np.diag([1.0, 0.0]), states=["a", "b"], name="net"))
    assert text.startswith("DescriptorSystem 'net': 2 variables, 1 equations with derivatives, 1 without")
    assert "DOF" not in text
