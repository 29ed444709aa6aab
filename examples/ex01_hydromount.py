"""A hydraulic engine mount from M, C, K to its eigenvalues, Bode diagram and pole map.

Run ``python examples/ex01_hydromount.py [FIGURE]``: it prints the eigenvalues of the descriptor form beside the poles
of the state space and draws the figure of the README. Imported, it draws and prints nothing.
"""

import sys

import control
import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import linear_sum_assignment

import halfdof_ctrl as hd


def mount() -> hd.SecondOrderModel:
    """Give the model with the force on the engine as input and its displacement as output."""
    mass = np.diag([20.0, 0.0, 0.0])  # [kg]: the nodes y1 and y2 have none
    damping = np.array([[100.0, -100.0, 0.0], [-100.0, 100.0, 0.0], [0.0, 0.0, 300.0]])  # [N s/m]
    stiffness = np.array([[5500.0, 0.0, -500.0], [0.0, 1000.0, 0.0], [-500.0, 0.0, 1000.0]])  # [N/m]
    model = hd.mechss(mass, damping, stiffness, dofs=["y", "y1", "y2"], name="hydromount")
    return model.select(inputs="F_y", outputs="y")


def eigenvalues() -> tuple[np.ndarray, np.ndarray, int]:
    """Give the finite eigenvalues of the descriptor form, the poles matched to them, the number of infinite ones."""
    model = mount()
    before = hd.pencil_structure(model)
    after = hd.mech2ss(model).poles()
    _, match = linear_sum_assignment(np.abs(before.finite_eigenvalues[:, None] - after))
    return before.finite_eigenvalues, after[match], before.n_infinite


def draw() -> control.ControlPlot:
    """Draw the Bode diagram beside the pole map."""
    figure, axes = plt.subplot_mosaic(
        [["magnitude", "map"], ["phase", "map"]],
        figsize=(9.0, 4.0),
        height_ratios=[1.4, 1.0],
        layout="constrained",
    )
    hd.bode_plot(mount(), Hz=True, ax=np.array([axes["magnitude"], axes["phase"]]))
    plot = hd.pole_map_plot(mount(), ax=axes["map"])
    axes["magnitude"].tick_params(labelbottom=False)
    figure.align_ylabels([axes["magnitude"], axes["phase"]])
    return plot


def main(path: str) -> None:
    """Print the table and write the figure."""
    before, after, n_infinite = eigenvalues()
    print("descriptor form       state space           difference")
    for finite, pole in zip(before, after, strict=True):
        print(f"{finite:<20.4f}  {pole:<20.4f}  {abs(finite - pole):.0e}")
    print(f"{n_infinite} infinite            -")
    draw().figure.savefig(path, dpi=100)
    print(f"figure: {path}")


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "hydromount.png")
