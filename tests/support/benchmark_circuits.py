"""Benchmark problems beside mechanisms: circuits, flows, mounts, beams and rotors (see `benchmark_problems`)."""

import numpy as np

from halfdof_ctrl import SecondOrderModel, mechss
from support.benchmark_problems import FloatArray, bordered, first_order, forces


def rotating_masses(J1: float = 1.0, J2: float = 2.0) -> SecondOrderModel:
    """Couple two rotating masses rigidly, unknowns are speeds and torques: index 2.

    Source: T. Schoen, M. Gerdin, T. Glad, F. Gustafsson, A modeling and filtering framework for linear
    differential-algebraic equations, 42nd IEEE Conference on Decision and Control, 2003.
    """
    A = [[0, 0, 1, 0], [0, 0, 0, 1], [0, 0, -1, -1], [-1, 1, 0, 0]]
    return first_order(np.diag([J1, J2, 0, 0]), A, np.eye(4)[:, :2], np.eye(4), "rotating masses")


def rl_network(R: float = 1.0e3, L: float = 1.0e-3) -> SecondOrderModel:
    """Feed a current into a resistor and an inductor in series: index 2, a voltage that grows as s.

    Source: N. Banagaaya, Index-aware model order reduction methods, PhD thesis, Eindhoven 2014, section 5.3.
    """
    E, A = np.diag([0.0, 0.0, L]), [[-1 / R, 1 / R, 0.0], [1 / R, -1 / R, -1.0], [0.0, 1.0, 0.0]]
    return first_order(E, A, [1.0, 0.0, 0.0], np.eye(3), "RL network")


def generator(J: float = 0.5, L: float = 1e-3, R1: float = 10.0, R2: float = 0.3, k: float = 0.8) -> SecondOrderModel:
    """Turn an electric generator by a given angle: the torque grows with the second derivative.

    Source: M. Gerdin, Parameter estimation in linear descriptor systems, licentiate thesis, Linkoeping 2004; example
    3.2.2 of N. Banagaaya's thesis. The input is the angle; unknowns are torques, angle, speed, currents and voltages.
    """
    E, A = np.zeros((9, 9)), np.zeros((9, 9))
    E[1, 3], E[2, 2], E[5, 4] = 1.0, J, L
    for i, j, value in (
        (0, 3, -1.0), (1, 2, 1.0), (2, 0, 1.0), (2, 1, 1.0), (3, 1, -1.0), (3, 4, k), (4, 2, k), (4, 5, -1.0),
        (5, 6, 1.0), (6, 4, R1), (6, 7, -1.0), (7, 4, R2), (7, 8, -1.0), (8, 5, -1.0), (8, 6, 1.0), (8, 7, 1.0),
        (8, 8, 1.0),
    ):  # fmt: skip
        A[i, j] = value
    return first_order(E, A, np.eye(9)[:, 0], np.eye(9)[[0, 4, 8]], "generator")


def stokes(n: int = 3, *, pinned: bool = True) -> SecondOrderModel:
    """Discretize Stokes flow in a square by marker and cell; pressures are multipliers of the divergence: index 2.

    Source: T. Stykel, Balanced truncation model reduction for semidiscretized Stokes equation, Linear Algebra Appl.
    415 (2006) 262-289. No flow through the walls; the pressure is fixed in one cell, or in none (singular).
    """
    h = 1.0 / n
    second = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    across = second + np.diag([1.0] + [0.0] * (n - 2) + [1.0])  # no slip half a cell away
    along = second[: n - 1, : n - 1]
    viscous_x = np.kron(np.eye(n), along) + np.kron(across, np.eye(n - 1))
    viscous_y = np.kron(along, np.eye(n)) + np.kron(np.eye(n - 1), across)
    difference = np.eye(n - 1, n, k=1) - np.eye(n - 1, n)
    gradient = np.vstack([np.kron(np.eye(n), difference), np.kron(difference, np.eye(n))]) / h
    if pinned:
        gradient = gradient[:, 1:]
    faces = len(gradient)
    K = np.zeros((faces, faces))
    half = faces // 2
    K[:half, :half], K[half:, half:] = viscous_x / h**2, viscous_y / h**2
    _, E, stiffness = bordered(np.zeros_like(K), np.eye(faces), K, gradient.T)
    size = len(E)
    return mechss(None, E, stiffness, forces(size, faces)[:, [0, half]], np.eye(size)[[0, half, faces]], name="Stokes")


def closed_stokes() -> SecondOrderModel:
    """Stokes flow with a pressure that is fixed nowhere: singular, to be refused."""
    return stokes(pinned=False)


def rlc_loop() -> SecondOrderModel:
    """Loop of capacitors and node of inductors as charges with Kirchhoff's laws as constraints: index 2 and 3.

    Formulas: modified nodal analysis of loops of capacitors and cutsets of inductors, C. Tischendorf, Topological index
    calculation of differential-algebraic equations in circuit simulation, Surv. Math. Ind. 8 (1999) 187-199. Unknowns
    are four charges and the voltages of two nodes; values in H, ohm and F over nine decades.
    """
    inductance, resistance = np.diag([2.0e-3, 5.0e-3, 0.0, 0.0]), np.diag([0.0, 12.0, 0.0, 0.0])
    elastance = np.diag([0.0, 0.0, 1.0 / 4.7e-6, 1.0 / 2.2e-9])
    nodes = [[1.0, -1.0, 0.0, 0.0], [0.0, 1.0, -1.0, -1.0]]
    matrices = bordered(inductance, resistance, elastance, nodes)
    return mechss(*matrices, np.eye(6)[:, [0]], np.eye(6), name="RLC loop")


MOUNT = {"m": 180.0, "k": 2.25e5, "c": 1.0e3, "A": 2.5e-3, "I": 4.0e6, "R": 1.05e8, "C1": 3.0e-11, "C2": 2.6e-9}
"""Mass [kg], rubber [N/m, N s/m], piston [m^2], oil column [kg/m^4, N s/m^5], chambers [m^5/N]."""


def inertia_track_mount() -> SecondOrderModel:
    """Model a hydraulic mount with inertia track: displacement, oil volume and two pressures over 17 decades.

    Formulas: R. Singh, G. Kim, P. V. Ravindra, Linear analysis of automotive hydro-mechanical mount with emphasis on
    decoupler characteristics, J. Sound Vib. 158 (1992) 219-243; values of the size that is usual for such mounts.
    """
    p = MOUNT
    M, C = np.diag([p["m"], p["I"], 0.0, 0.0]), np.diag([p["c"], p["R"], 0.0, 0.0])
    K = np.array(
        [
            [p["k"], 0.0, p["A"], 0.0],
            [0.0, 0.0, -1.0, 1.0],
            [p["A"], -1.0, -p["C1"], 0.0],
            [0.0, 1.0, 0.0, -p["C2"]],
        ]
    )
    return mechss(M, C, K, np.eye(4)[:, 0], np.eye(4)[[0, 1, 2]], name="inertia track mount")


def inertia_track_mount_with_flow() -> SecondOrderModel:
    """Take the same mount with the oil's flow in place of its volume: pressures become half DOFs."""
    p = MOUNT
    M = np.diag([p["m"], 0.0, 0.0, 0.0])
    C = np.array(
        [
            [p["c"], 0.0, 0.0, 0.0],
            [0.0, p["I"], 0.0, 0.0],
            [-p["A"], 0.0, p["C1"], 0.0],
            [0.0, 0.0, 0.0, p["C2"]],
        ]
    )
    K = np.array([[p["k"], 0.0, p["A"], 0.0], [0.0, p["R"], -1.0, 1.0], [0.0, 1.0, 0.0, 0.0], [0.0, -1.0, 0.0, 0.0]])
    return mechss(M, C, K, np.eye(4)[:, 0], np.eye(4)[:3], name="mount with flow")


def rigid_mount() -> SecondOrderModel:
    """Take the same mount with a stiff upper chamber: its pressure is a multiplier of ``A y = V``, index 3."""
    model = inertia_track_mount()
    K = model.K.copy()
    K[2, 2] = 0.0
    return mechss(model.M, model.C, K, model.B, model.F, name="rigid mount")


def two_track_mount() -> SecondOrderModel:
    """Add a second, massless orifice beside the track and a rigid lower chamber: mixed kinds, index 2."""
    p = MOUNT
    M = np.diag([p["m"], p["I"], 0.0, 0.0, 0.0])
    C = np.diag([p["c"], p["R"], 3.0e9, 0.0, 0.0])
    K = np.zeros((5, 5))
    K[0, [0, 3]] = p["k"], p["A"]
    K[[1, 2], 3], K[[1, 2], 4] = -1.0, 1.0
    K[3, :4] = p["A"], -1.0, -1.0, -p["C1"]
    K[4, 1:3] = 1.0  # what flows has nowhere to go
    return mechss(M, C, K, np.eye(5)[:, 0], np.eye(5), name="two tracks")


def beam_with_massless_rotations(elements: int = 5, *, lumped: int | None = None) -> SecondOrderModel:
    """Clamp a beam with lumped masses at its nodes, rotations and unlumped nodes without inertia: index 1.

    Formulas: Euler-Bernoulli elements, e.g. K.-J. Bathe, Finite Element Procedures, 1996; steel, 1 m x 20 mm x 10 mm.
    """
    length, EI, mass = 1.0 / elements, 2.1e11 * 0.02 * 0.01**3 / 12, 7850 * 0.02 * 0.01 / elements
    K = np.zeros((2 * elements + 2, 2 * elements + 2))
    element = (EI / length**3) * np.array(
        [
            [12.0, 6 * length, -12.0, 6 * length],
            [6 * length, 4 * length**2, -6 * length, 2 * length**2],
            [-12.0, -6 * length, 12.0, -6 * length],
            [6 * length, 2 * length**2, -6 * length, 4 * length**2],
        ]
    )
    for i in range(elements):
        K[2 * i : 2 * i + 4, 2 * i : 2 * i + 4] += element
    K = K[2:, 2:]
    masses = np.zeros(2 * elements)
    masses[::2] = mass
    if lumped is not None:
        masses[: 2 * (elements - lumped)] = 0.0
    C = 1e-5 * K * np.outer(masses > 0.0, masses > 0.0)
    tip = np.eye(2 * elements)[-2]
    return mechss(np.diag(masses), C, K, tip, np.eye(2 * elements)[[0, -2, -1]], name="beam")


def beam_with_few_masses() -> SecondOrderModel:
    """Only two of eight nodes carry mass."""
    return beam_with_massless_rotations(8, lumped=2)


def hinged_beam() -> SecondOrderModel:
    """Put a rigid prop under the tip of the beam, its force as multiplier; rotations massless: index 3."""
    model = beam_with_massless_rotations(4)
    n = len(model.dofs)
    matrices = bordered(model.M, model.C, model.K, np.eye(n)[-2])
    return mechss(*matrices, np.eye(n + 1)[:, [2, -3]], np.eye(n + 1)[[0, 2, n - 1, n]], name="propped beam")


def rotor_in_massless_bearings(speed: float = 400.0) -> SecondOrderModel:
    """Put a disk on a shaft between fluid-film bearings without mass: unsymmetric C and K, gyroscopic.

    Formulas: a rigid disk in the middle of a massless shaft, bearings with eight coefficients, J. M. Vance,
    Rotordynamics of Turbomachinery, Wiley 1988. Coordinates: disk, then left and right journal, each in x and y, and
    the disk's tilts. Whirl `speed` in rad/s.
    """
    m, Jt, Jp, half, k = 30.0, 1.2, 2.0, 0.4, 5.0e6
    M = np.diag([m, m, Jt, Jt, 0, 0, 0, 0])
    C, K = np.zeros((8, 8)), np.zeros((8, 8))
    C[2, 3], C[3, 2] = Jp * speed, -Jp * speed
    for side, sign in ((4, -1.0), (6, 1.0)):
        for axis in range(2):
            stretch = np.zeros(8)
            stretch[[axis, side + axis]] = 1.0, -1.0
            stretch[2 + axis] = sign * half
            K += k * np.outer(stretch, stretch)
        K[side : side + 2, side : side + 2] += np.array([[4.0e7, 6.0e7], [-8.0e7, 9.0e7]])
        C[side : side + 2, side : side + 2] += np.array([[1.2e5, 5.0e4], [5.0e4, 2.1e5]])
    return mechss(M, C, K, forces(8, 2), np.eye(8)[[0, 1, 4, 5]], name="rotor")


def rotor_in_rigid_bearing() -> SecondOrderModel:
    """Hold the left journal of the rotor by multipliers: index 2 and unsymmetric."""
    model = rotor_in_massless_bearings()
    G: FloatArray = np.eye(8)[4:6]
    matrices = bordered(model.M, model.C, model.K, G)
    return mechss(*matrices, forces(10, 2), np.eye(10)[[0, 1, 4, 8, 9]], name="rotor, one rigid bearing")
