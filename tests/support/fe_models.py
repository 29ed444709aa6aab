"""Finite-element models of any size with few masses, for tests and benchmarks: spring grids and space frames."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array, csc_array, csr_array, diags_array, eye_array, kron

if TYPE_CHECKING:  # other tools are measured with these models, where the package is not installed
    from halfdof_ctrl import SecondOrderModel

YOUNG, SHEAR = 2.1e11, 8.1e10  #: steel [Pa]
AREA, BENDING, TORSION = 1e-3, 1e-6, 2e-6  #: section of a beam [m^2, m^4, m^4]
BEAM_DOFS = 6  #: of a node of a frame
SPRING = 1e4  #: of a grid [N/m]


@dataclass(frozen=True, eq=False)
class Structure:
    """M, C and K of n DOFs, sparse, and where the masses sit."""

    M: csc_array
    C: csc_array
    K: csc_array
    massive: npt.NDArray[np.intp]

    @property
    def size(self) -> int:
        """Number of DOFs."""
        return int(self.K.shape[0])

    def model(self, **options: Any) -> "SecondOrderModel":  # noqa: ANN401  # those of mechss
        """Make the sparse model."""
        from halfdof_ctrl import mechss  # noqa: PLC0415

        return mechss(self.M, self.C, self.K, **options)


def spring_grid(nx: int, ny: int, masses: int, *, dampers: int = 0, seed: int = 0) -> Structure:
    """Make a net of nx x ny nodes that move out of the plane, held along its edge, with a mass at some nodes."""
    along, across = (
        2.0 * eye_array(k) - diags_array(np.ones(k - 1), offsets=1) - diags_array(np.ones(k - 1), offsets=-1)
        for k in (nx, ny)
    )
    K = SPRING * (kron(along, eye_array(ny)) + kron(eye_array(nx), across))
    generator = np.random.default_rng(seed)
    places = generator.permutation(nx * ny)[: masses + dampers]
    return _structure(csc_array(K), np.sort(places[:masses]), np.sort(places[masses:]), generator)


def space_frame(
    nx: int, ny: int, nz: int, masses: int, *, parts: int = 1, dampers: int = 0, seed: int = 0
) -> Structure:
    """Make a building of nx x ny x nz corners, clamped at the ground, each member divided into some beams.

    Masses move with the three displacements of a node; a damper acts along the first.
    """
    corners = np.arange(nx * ny * nz).reshape(nx, ny, nz)
    count = corners.size
    rows, columns, values = [], [], []
    for axis in range(3):
        lines = np.moveaxis(corners, axis, 0)
        first, last = lines[:-1].ravel(), lines[1:].ravel()
        inner = count + np.arange(first.size * (parts - 1)).reshape(first.size, parts - 1)
        count += inner.size
        chain = np.column_stack([first, inner, last])
        start, stop = chain[:, :-1].ravel(), chain[:, 1:].ravel()
        stiffness = _turned(beam_stiffness(3.0 / parts), axis)
        places = np.hstack([BEAM_DOFS * node[:, None] + np.arange(BEAM_DOFS) for node in (start, stop)])
        rows.append(np.repeat(places, 2 * BEAM_DOFS, axis=1).ravel())
        columns.append(np.tile(places, (1, 2 * BEAM_DOFS)).ravel())
        values.append(np.tile(stiffness.ravel(), start.size))
    entries = np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))
    K: Any = csr_array(coo_array(entries, shape=(BEAM_DOFS * count, BEAM_DOFS * count)))
    clamped = (BEAM_DOFS * corners[:, :, 0].ravel()[:, None] + np.arange(BEAM_DOFS)).ravel()
    free = np.setdiff1d(np.arange(BEAM_DOFS * count), clamped)
    K = csc_array(K[free][:, free])
    K.eliminate_zeros()
    generator = np.random.default_rng(seed)
    nodes = BEAM_DOFS * generator.permutation(K.shape[0] // BEAM_DOFS)[: masses + dampers]
    massive = np.sort((nodes[:masses, None] + np.arange(3)).ravel())
    return _structure(K, massive, np.sort(nodes[masses:]), generator)


def beam_stiffness(length: float) -> npt.NDArray[np.float64]:
    """Give the stiffness of an Euler-Bernoulli beam along x: 3 displacements and 3 rotations at each end."""
    stretch, twist = YOUNG * AREA / length, SHEAR * TORSION / length
    K = np.zeros((12, 12))
    for i, value in ((0, stretch), (3, twist)):
        K[np.ix_([i, i + 6], [i, i + 6])] = value * np.array([[1, -1], [-1, 1]])
    bend = YOUNG * BENDING / length**3
    for places, sign in (([1, 5, 7, 11], 1.0), ([2, 4, 8, 10], -1.0)):
        a, b = 6.0 * length * sign, length**2
        K[np.ix_(places, places)] = bend * np.array(
            [[12, a, -12, a], [a, 4 * b, -a, 2 * b], [-12, -a, 12, -a], [a, 2 * b, -a, 4 * b]]
        )
    return K


def leading_matrix(structure: Structure) -> csc_array:
    """Assemble W of equation (2), its columns in the order of the DOFs, in a way of its own."""
    with_mass = np.diff(structure.M.indptr) > 0
    with_damping = (np.diff(structure.C.indptr) > 0) & ~with_mass
    kinds = (structure.M, with_mass), (structure.C, with_damping), (structure.K, ~(with_mass | with_damping))
    return csc_array(
        sum((matrix @ diags_array(own * 1.0) for matrix, own in kinds[1:]), structure.M @ diags_array(with_mass * 1.0))
    )


def _structure(
    K: csc_array, massive: npt.NDArray[np.intp], damped: npt.NDArray[np.intp], generator: np.random.Generator
) -> Structure:
    M, C = (
        csc_array(coo_array((generator.uniform(*size, where.size), (where, where)), shape=K.shape))
        for where, size in ((massive, (10.0, 20.0)), (damped, (50.0, 100.0)))
    )
    return Structure(M, C, K, massive)


def _turned(stiffness: npt.NDArray[np.float64], axis: int) -> npt.NDArray[np.float64]:
    """Turn a beam from the x axis to another one."""
    turn = np.roll(np.eye(3), axis, axis=1)
    whole = np.kron(np.eye(4), turn)
    return np.asarray(whole.T @ stiffness @ whole)
