"""Circuits of partial elements in modified nodal analysis: index 2, entries over twelve decades, no mass.

Of the kind of Y. Chahlaoui and P. Van Dooren, A collection of benchmark examples for model reduction of linear time
invariant dynamical systems, SLICOT working note 2002-2 (example PEEC), with numbers of our own.
"""

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]

CAPACITANCE, INDUCTANCE, RESISTANCE = 3e-12, 2e-9, 0.7  # F, H, ohm: of one cell
COUPLING = 0.4  # of neighbouring inductances; falls by this factor from cell to cell
BARE = 3  # every third node has no capacitance, and nothing but inductances is attached to it


def partial_element_circuit(cells: int) -> tuple[tuple[FloatArray, FloatArray], int]:
    """Give E and A of ``E x' = A x`` for a ladder of coupled inductances, and how many finite eigenvalues it has.

    The unknowns are the voltages of the nodes and the currents of the branches, each from a node to the next. A node
    without capacitance says that the current that arrives goes on, which takes one current away: there are as many
    finite eigenvalues as capacitances and inductances less bare nodes.
    """
    nodes = np.arange(cells)
    bare = nodes % BARE == 1
    capacitance = np.where(bare, 0.0, CAPACITANCE * (1.0 + 0.3 * np.sin(nodes)))
    incidence = np.eye(cells) - np.eye(cells, k=-1)
    distance = np.abs(nodes[:, None] - nodes)
    inductance = INDUCTANCE * COUPLING**distance
    zero = np.zeros((cells, cells))
    E = np.block([[np.diag(capacitance), zero], [zero, inductance]])
    A = np.block([[zero, -incidence], [incidence.T, -RESISTANCE * np.eye(cells)]])
    return (E, A), 2 * (cells - int(bare.sum()))


def rotated(matrices: tuple[FloatArray, FloatArray], seed: int) -> tuple[FloatArray, FloatArray]:
    """Scale E and A by powers of two to entries near one, and write them in rotated coordinates, which rounds them."""
    E, A = matrices
    half = len(E) // 2
    units = np.concatenate([np.full(half, 2.0**19), np.full(half, 2.0**14)])
    scale = units[:, None] * units
    turn = np.linalg.qr(np.random.default_rng(seed).standard_normal(E.shape))[0]
    return turn.T @ (E * scale) @ turn, turn.T @ (A * scale * 2.0**-33) @ turn
