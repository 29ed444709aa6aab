"""Benchmark problems: constrained mechanical systems with their multipliers (see `benchmark_problems`)."""

import numpy as np

from halfdof_ctrl import SecondOrderModel, mechss
from support.benchmark_problems import FloatArray, bordered, forces


def mass_spring_with_bar(g: int = 8) -> SecondOrderModel:
    """Join the first and the last of g masses in a chain by a rigid bar: index 3.

    Source: V. Mehrmann, T. Stykel, Balanced truncation model reduction for large-scale systems in descriptor form,
    in: Dimension Reduction of Large-Scale Systems, Springer 2005, 83-115. Input: force on the first mass; outputs: the
    first, the second and the last but one position.
    """
    ends = np.zeros(g)
    ends[[0, -1]] = 1.0
    laplacian = 2.0 * np.eye(g) - np.eye(g, k=1) - np.eye(g, k=-1) - np.diag(ends)
    ground = np.eye(g) + np.diag(ends)
    bar = np.zeros(g)
    bar[[0, -1]] = 1.0, -1.0
    M, C, K = bordered(100.0 * np.eye(g), 5.0 * (laplacian + ground), 2.0 * (laplacian + ground), bar)
    outputs = np.eye(g + 1)[[0, 1, g - 2]]
    return mechss(M, C, K, np.eye(g + 1)[:, 0], outputs, name="mass-spring with bar")


def _triple_chain(n: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Give M, C, K of three chains of n masses that end at a common mass."""
    size = 3 * n + 1
    M, K = np.diag(np.r_[np.repeat([1.0, 2.0, 3.0], n), 10.0]), np.zeros((size, size))
    laplacian = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    for place, k in enumerate((10.0, 20.0, 1.0)):
        part = slice(place * n, (place + 1) * n)
        K[part, part] = k * laplacian
        K[(place + 1) * n - 1, -1] = K[-1, (place + 1) * n - 1] = -k
    K[-1, -1] = 10.0 + 20.0 + 1.0 + 50.0
    C = 0.01 * M + 0.01 * K
    C[[0, n - 1, 2 * n], [0, n - 1, 2 * n]] += 5.0
    return M, C, K


def triple_chain(n: int = 3, weights: tuple[float, float, float] = (-1.0, 2.0, -1.0)) -> SecondOrderModel:
    """Tie first, middle and last mass of each of three chains by a constraint: index 3.

    Source: N. Truhar, K. Veselic, An efficient method for estimating the optimal dampers' viscosity for linear
    vibrating systems using Lyapunov equation, SIAM J. Matrix Anal. Appl. 31 (2009) 18-39; with the constraints of
    J. Saak, M. Voigt, Model reduction of constrained mechanical systems in M-M.E.S.S., IFAC-PapersOnLine 51 (2018)
    661-666. One force on all masses, the sum of all positions, as there.
    """
    G = np.zeros((3, 3 * n + 1))
    for place in range(3):
        G[place, [place * n, place * n + n // 2, (place + 1) * n - 1]] = weights
    M, C, K = bordered(*_triple_chain(n), G)
    moving = np.r_[np.ones(3 * n + 1), np.zeros(3)]
    return mechss(M, C, K, moving, moving, name="triple chain")


def triple_chain_by_means() -> SecondOrderModel:
    """Hold the mean of three masses of each chain of `triple_chain` (weights 1/3, which are no floats): index 3."""
    return triple_chain(3, (1 / 3, 1 / 3, 1 / 3))


def car_and_pendulum(m1: float = 1.0, m2: float = 0.1, length: float = 0.5, g: float = 9.81) -> SecondOrderModel:
    """Hang a pendulum in Cartesian coordinates on a car: index 3, second-order form of a system of seven unknowns.

    Source: N. Banagaaya, Index-aware model order reduction methods, PhD thesis, Eindhoven 2014, section 5.4, after
    V. Mehrmann, A. Steinbrecher and others; the numbers m1, m2, L are free there.
    """
    pull = m2 * g / length
    K = np.array([[pull, -pull, 0.0], [-pull, pull, 0.0], [0.0, 0.0, -pull]])
    matrices = bordered(np.diag([m1, m2, m2]), np.zeros((3, 3)), K, [[0.0, 0.0, -2.0 * length]])
    return mechss(*matrices, [1.0, 0.0, 0.0, 0.0], np.eye(4)[[1, 2, 3]], name="car and pendulum")


def servo_constraint(m1: float = 1.0, m2: float = 2.0, k: float = 5.0, c: float = 0.0) -> SecondOrderModel:
    """Find the force on the first of two masses that moves the second as told: index 5 without damper.

    Source: W. Blajer, K. Kolodziejczyk, A geometric approach to solving problems of control constraints, Multibody
    Syst. Dyn. 11 (2004) 343-364. The input is the position of the second mass, the force is ``m1 m2 s^4 / k + ...``.
    """
    M, C = np.diag([m1, m2, 0.0]), np.zeros((3, 3))
    C[:2, :2] = c * np.array([[1.0, -1.0], [-1.0, 1.0]])
    K = np.array([[k, -k, -1.0], [-k, k, 0.0], [0.0, 1.0, 0.0]])
    return mechss(M, C, K, [0.0, 0.0, 1.0], np.eye(3), name="servo constraint")


def damped_servo_constraint() -> SecondOrderModel:
    """Put a damper beside the spring: index 4 and one zero of the plant as finite eigenvalue."""
    return servo_constraint(c=0.25)


def sleigh(m: float = 2.0, inertia: float = 0.3, b: float = 0.4, speed: float = 1.5) -> SecondOrderModel:
    """Linearize Chaplygin's sleigh about straight motion: a constraint on velocities and angles, index 2.

    Source: J. I. Neimark, N. A. Fufaev, Dynamics of Nonholonomic Systems, AMS 1972. The blade, b behind the centre of
    mass, does not slip: ``y' - b phi' - v phi = 0``; one eigenvalue is ``-m v b / (I + m b^2)``.
    """
    M, C, K = (np.zeros((3, 3)) for _ in range(3))
    M[0, 0], M[1, 1] = m, inertia
    C[2, :2] = 1.0, -b
    K[2, 1] = -speed
    K[:2, 2] = 1.0, -b
    return mechss(M, C, K, forces(3, 2), name="sleigh")


def slider_crank(angle: float = 1.0, torque: float = 0.0) -> SecondOrderModel:
    """Linearize a slider-crank in nine absolute coordinates with eight constraints: index 3, one motion left.

    Source: P. E. Nikravesh, Computer-Aided Analysis of Mechanical Systems, Prentice-Hall 1988 (absolute coordinates);
    crank 0.1 m, rod 0.3 m, a spring and a damper on the slider. Loads that hold it against `torque` [N m] on the crank
    give the constraints' second derivatives their weight.
    """
    r, length = 0.1, 0.3
    rod = -np.arcsin(r * np.sin(angle) / length)
    masses = np.diag([0.4, 0.4, 4e-4, 0.9, 0.9, 7e-3, 1.3, 1.3, 2e-3])
    C, K = np.zeros((9, 9)), np.zeros((9, 9))
    C[6, 6], K[6, 6] = 12.0, 8.0e3

    def arm(theta: float, size: float) -> FloatArray:
        """Differentiate a point `size` along a body that is turned by theta."""
        return size * np.array([-np.sin(theta), np.cos(theta)])

    G = np.zeros((8, 9))
    for row, body, theta, size, sign in (
        (0, 0, angle, -r / 2, 1.0),
        (2, 0, angle, r / 2, 1.0),
        (2, 1, rod, -length / 2, -1.0),
        (4, 1, rod, length / 2, 1.0),
        (4, 2, 0.0, 0.0, -1.0),
    ):
        G[row : row + 2, 3 * body : 3 * body + 2] = sign * np.eye(2)
        G[row : row + 2, 3 * body + 2] = sign * arm(theta, size)
    G[6, 7] = G[7, 8] = 1.0
    load = np.zeros(9)
    load[2] = torque
    free = np.linalg.svd(G)[2][-1]
    load[6] = -free[2] * torque / free[6]  # the force on the slider that holds the crank
    multipliers = np.linalg.lstsq(G.T, load, rcond=None)[0]
    for row, body, theta, size, sign in (
        (0, 0, angle, -r / 2, 1),
        (2, 0, angle, r / 2, 1),
        (2, 1, rod, -length / 2, -1),
    ):
        K[3 * body + 2, 3 * body + 2] -= (
            sign * size * (np.array([np.cos(theta), np.sin(theta)]) @ multipliers[row : row + 2])
        )
    K[5, 5] -= length / 2 * (np.array([np.cos(rod), np.sin(rod)]) @ multipliers[4:6])
    matrices = bordered(masses, C, K, G)
    outputs = np.eye(17)[[2, 6, 9, 10, 16]]
    return mechss(*matrices, forces(17, 9)[:, [2, 6]], outputs, name="slider-crank")


def loaded_slider_crank() -> SecondOrderModel:
    """Take the slider-crank near its dead centre under load."""
    return slider_crank(0.05, 30.0)


def seven_body_mechanism() -> SecondOrderModel:
    """Linearize Andrews' squeezer mechanism at rest in its initial position: 7 angles, 6 loops, index 3.

    Source: W. Schiehlen (ed.), Multibody Systems Handbook, Springer 1990; E. Hairer, G. Wanner, Solving Ordinary
    Differential Equations II, Springer 1996, section VII.7, with its data. The stiffness is that of the first
    loop under the multipliers that are published for this position; the spring on gamma adds its own.
    """
    beta, theta, gamma, phi, delta, omega, epsilon = SEVEN_BODY_POSITION
    M = np.zeros((7, 7))
    M[0, 0] = 0.04325 * 92e-5**2 + 0.00365 * (7e-3**2 - 2 * 115e-5 * 7e-3 * np.cos(theta) + 115e-5**2) + 2.635e-6
    M[0, 1] = M[1, 0] = 0.00365 * (115e-5**2 - 115e-5 * 7e-3 * np.cos(theta)) + 4.410e-7
    M[1, 1] = 0.00365 * 115e-5**2 + 4.410e-7
    M[2, 2] = 0.02373 * (1874e-5**2 + 1043e-5**2) + 5.255e-6
    short, side = 2e-2 - 1421e-5, 4e-2
    M[3, 3] = 0.00706 * short**2 + 5.667e-7
    M[3, 4] = M[4, 3] = 0.00706 * (short**2 + side * short * np.sin(phi)) + 5.667e-7
    M[4, 4] = 0.00706 * (side**2 + 2 * side * short * np.sin(phi) + short**2)
    M[4, 4] += 0.07050 * (2308e-5**2 + 916e-5**2) + 5.667e-7 + 1.169e-5
    M[5, 5] = 0.00706 * short**2 + 5.667e-7
    M[5, 6] = M[6, 5] = 0.00706 * (short**2 - side * short * np.sin(omega)) + 5.667e-7
    M[6, 6] = 0.00706 * (short**2 - 2 * side * short * np.sin(omega) + side**2)
    M[6, 6] += 0.05498 * (1228e-5**2 + 449e-5**2) + 5.667e-7 + 1.912e-5
    G = np.zeros((6, 7))
    crank = np.array([-7e-3 * np.sin(beta) + 28e-3 * np.sin(beta + theta), 28e-3 * np.sin(beta + theta)])
    rise = np.array([7e-3 * np.cos(beta) - 28e-3 * np.cos(beta + theta), -28e-3 * np.cos(beta + theta)])
    G[::2, :2], G[1::2, :2] = crank, rise
    G[:2, 2] = -35e-3 * np.cos(gamma), -35e-3 * np.sin(gamma)
    G[2:4, 3] = -2e-2 * np.cos(phi + delta), -2e-2 * np.sin(phi + delta)
    G[2:4, 4] = G[2:4, 3] + (side * np.sin(delta), -side * np.cos(delta))
    G[4:6, 5] = 2e-2 * np.sin(omega + epsilon), -2e-2 * np.cos(omega + epsilon)
    G[4:6, 6] = G[4:6, 5] + (-side * np.cos(epsilon), -side * np.sin(epsilon))
    K = np.zeros((7, 7))
    K[2, 2] = 4530.0 * (18e-3**2 + 2e-2**2)  # of the order of the spring's about its fixed bearing
    for multiplier, shape in ((98.5668703962410896, np.cos), (-6.12268834425566265, np.sin)):
        K[:2, :2] += multiplier * 28e-3 * shape(beta + theta)
        K[0, 0] -= multiplier * 7e-3 * shape(beta)
    K[2, 2] += 35e-3 * (98.5668703962410896 * np.sin(gamma) + 6.12268834425566265 * np.cos(gamma))
    inputs, outputs = np.eye(13)[:, [0]], np.eye(13)[[0, 2, 7]]
    return mechss(*bordered(M, np.zeros((7, 7)), K, G), inputs, outputs, name="seven-body mechanism")


SEVEN_BODY_POSITION = (
    -0.0617138900142764496358948458001,
    0.0,
    0.455279819163070380255912382449,
    0.222668390165885884674473185609,
    0.487364979543842550225598953530,
    -0.222668390165885884674473185609,
    1.23054744454982119249735015568,
)  #: beta, theta, gamma, phi, delta, omega, epsilon [rad], Hairer and Wanner, section VII.7


def gear_train(stages: int = 3) -> SecondOrderModel:
    """Join shafts of a gear train by multipliers, the tooth forces: index 3; inertias over six decades.

    Formulas: S. S. Rao, Mechanical Vibrations, Pearson 2017, torsional systems with gears. Elastic shafts of 2e5
    N m/rad and less between pairs of ideal gears; the teeth transmit ``r1 phi1 + r2 phi2 = 0``. Input: motor torque.
    """
    n = 2 * stages + 2
    J = np.r_[1.2e-3, [1.0e-6 * 40.0 ** (i / 2) for i in range(2 * stages)], 3.7]
    K, C, G = np.zeros((n, n)), np.zeros((n, n)), np.zeros((stages, n))
    for shaft in range(stages + 1):
        stretch = np.zeros(n)
        stretch[[2 * shaft, 2 * shaft + 1]] = 1.0, -1.0
        K += 1.6e3 * 5.0**shaft * np.outer(stretch, stretch)
        C += 2.0e-3 * 4.0**shaft * np.outer(stretch, stretch)
    for stage in range(stages):
        G[stage, [2 * stage + 1, 2 * stage + 2]] = 0.012, 0.012 * (2.0 + 0.7 * stage)
    C[-1, -1] += 0.05
    M, C, K = bordered(np.diag(J), C, K, G)
    outputs = np.eye(n + stages)[[0, n - 1, n]]
    return mechss(M, C, K, np.eye(n + stages)[:, 0], outputs, name="gear train")


def gear_train_with_massless_gears() -> SecondOrderModel:
    """Take the same with gears that have no inertia: what is left is two inertias and half DOFs."""
    model = gear_train()
    M = np.zeros_like(model.M)
    M[0, 0], M[7, 7] = model.M[0, 0], model.M[7, 7]
    return mechss(M, model.C, model.K, model.B, model.F, name="massless gears")


def redundant_parallelogram() -> SecondOrderModel:
    """Hold a bar by three equal parallel cranks: five loop equations say what four would; singular, to be refused.

    Source: the standard example of redundant constraints, e.g. M. Wojtyra, Joint reaction forces in multibody systems
    with redundant constraints, Multibody Syst. Dyn. 14 (2005) 23-46. Linearized where the cranks stand upright.
    """
    M, K = np.diag([2.0, 2.0, 0.1]), np.diag([40.0, 0.0, 0.0])
    G = [[0.0, 1.0, -1.0], [0.0, 1.0, 0.0], [0.0, 1.0, 1.0]]  # the cranks' tips may not rise at -1, 0, 1
    return mechss(*bordered(M, np.zeros((3, 3)), K, G), name="redundant parallelogram")


def rigid_link(stiffness: float | None = None) -> SecondOrderModel:
    """Join two oscillators by a rigid link, or by a penalty spring of the given stiffness [N/m] instead.

    Source: E. Bayo, J. Garcia de Jalon, M. A. Serna, A modified Lagrangian formulation for the dynamic analysis of
    constrained mechanical systems, Comput. Methods Appl. Mech. Eng. 71 (1988) 183-195 (penalties against multipliers).
    """
    M, C, K = np.diag([1.0, 3.0]), np.diag([0.2, 0.1]), np.diag([50.0, 20.0])
    tie = np.array([1.0, -1.0])
    if stiffness is None:
        M, C, K = bordered(M, C, K, tie)
    else:
        K = K + stiffness * np.outer(tie, tie)
    return mechss(M, C, K, np.eye(len(M))[:, 0], np.eye(len(M))[:2], name="rigid link")


def stiff_link() -> SecondOrderModel:
    """Take the link as a penalty spring of 1e8 N/m, which costs eight digits: two fast states more, no index."""
    return rigid_link(1e8)
