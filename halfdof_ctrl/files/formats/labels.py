"""Names of DOFs from the node and DOF labels of finite-element programs.

| label | name |
|---|---|
| node 101, displacement 1, 2, 3 (ANSYS UX, UY, UZ) | ``n101_u1, n101_u2, n101_u3`` |
| node 101, rotation 4, 5, 6 (ANSYS ROTX, ROTY, ROTZ) | ``n101_r1, n101_r2, n101_r3`` |
| node 101, any other DOF number, as 11 (Abaqus: temperature) | ``n101_d11`` |
| node 101, any other ANSYS label, as PRES | ``n101_pres`` |
| scalar point 900 (Nastran component 0) | ``n900`` |
| internal node -7 of Abaqus, DOF 1 | ``internal7_1`` |
"""

import re
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

TRANSLATIONS = ("u1", "u2", "u3")
COMPONENTS = {1: "_u1", 2: "_u2", 3: "_u3", 4: "_r1", 5: "_r2", 6: "_r3", 0: ""}
ANSYS = {"UX": "u1", "UY": "u2", "UZ": "u3", "ROTX": "r1", "ROTY": "r2", "ROTZ": "r3"}
WORD = re.compile(r"[A-Za-z][A-Za-z0-9]*\Z")


def dof_names(nodes: Sequence[int], components: Sequence[int]) -> tuple[str, ...]:
    """Name DOFs by node and component number.

    >>> dof_names([101, 101, 900, -7], [1, 4, 0, 1])
    ('n101_u1', 'n101_r1', 'n900', 'internal7_1')
    """
    nodes, components = list(nodes), list(components)
    endings = {component: COMPONENTS.get(component, f"_d{component}") for component in set(components)}
    if min(nodes, default=0) >= 0:
        return tuple([f"n{node}{endings[component]}" for node, component in zip(nodes, components, strict=True)])
    return tuple(
        [
            f"n{node}{endings[component]}" if node >= 0 else f"internal{-node}_{component}"
            for node, component in zip(nodes, components, strict=True)
        ]
    )


def distinct(*keys: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    """Return what is in any of some arrays, sorted and once.

    `numpy.unique` (2.3) puts keys into a table of hashes first, which takes longer than sorting them.

    >>> distinct(np.array([3, 1]), np.array([1, 2])).tolist()
    [1, 2, 3]
    """
    every = np.sort(np.concatenate(keys))
    return np.asarray(every[np.concatenate([np.ones(min(1, every.size), dtype=bool), every[1:] != every[:-1]])])


def ansys_name(node: int, label: str) -> str:
    """Name a DOF by node and ANSYS label.

    >>> ansys_name(101, "ROTX"), ansys_name(101, "PRES")
    ('n101_r1', 'n101_pres')
    """
    return f"n{node}_{ansys_ending(label)}"


def ansys_ending(label: str) -> str:
    """Return what stands for an ANSYS label at the end of a name.

    >>> ansys_ending("ROTX"), ansys_ending("PRES")
    ('r1', 'pres')
    """
    return ANSYS.get(label.upper(), label.lower())


def translations(names: Sequence[str]) -> dict[str, npt.NDArray[np.float64]]:
    """Return for u1, u2 and u3 a 1 for each name of a node's translation along it, and 0 for any other.

    >>> {direction: found.tolist() for direction, found in translations(["n1_u1", "n1_u2", "n1_r1", "x_u1"]).items()}
    {'u1': [1.0, 0.0, 0.0, 0.0], 'u2': [0.0, 1.0, 0.0, 0.0], 'u3': [0.0, 0.0, 0.0, 0.0]}
    """
    endings = np.array([name[-3:] if name[:1] == "n" else "" for name in names], dtype="U3")
    return {direction: (endings == f"_{direction}").astype(np.float64) for direction in TRANSLATIONS}
