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
from collections.abc import Iterable

TRANSLATIONS = ("u1", "u2", "u3")
COMPONENTS = {1: "_u1", 2: "_u2", 3: "_u3", 4: "_r1", 5: "_r2", 6: "_r3", 0: ""}
ANSYS = {"UX": "u1", "UY": "u2", "UZ": "u3", "ROTX": "r1", "ROTY": "r2", "ROTZ": "r3"}
WORD = re.compile(r"[A-Za-z][A-Za-z0-9]*\Z")


def dof_names(nodes: Iterable[int], components: Iterable[int]) -> tuple[str, ...]:
    """Name DOFs by node and component number.

    >>> dof_names([101, 101, 900, -7], [1, 4, 0, 1])
    ('n101_u1', 'n101_r1', 'n900', 'internal7_1')
    """
    return tuple(
        [
            f"n{node}{COMPONENTS.get(component) if component in COMPONENTS else f'_d{component}'}"
            if node >= 0
            else f"internal{-node}_{component}"
            for node, component in zip(nodes, components, strict=True)
        ]
    )


def ansys_name(node: int, label: str) -> str:
    """Name a DOF by node and ANSYS label.

    >>> ansys_name(101, "ROTX"), ansys_name(101, "PRES")
    ('n101_r1', 'n101_pres')
    """
    return f"n{node}_{ANSYS.get(label.upper(), label.lower())}"


def direction_of(name: str) -> str | None:
    """Return the direction u1, u2 or u3 of a node's translation, and None for any other name."""
    ending = name[-2:]
    return ending if ending in TRANSLATIONS and name.startswith("n") and name[-3:-2] == "_" else None
