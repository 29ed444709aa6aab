"""Frequencies that show what a transfer function does: a logarithmic grid, refined at peaks and notches.

At a lightly damped root -sigma + j w a peak (pole) or notch (zero) is sigma wide. Points at w + sigma sinh(x), x evenly
spread, are dense at its tip and go over into the logarithmic grid.
"""

import numpy as np

from halfdof_ctrl.base.arrays import ComplexArray, FloatArray

BASE_POINTS = 600  #: of the logarithmic grid
DEFAULT_GRID_MOST_POINTS = 2000
FALLBACK_RANGE = (0.1, 10.0)  #: [rad/s] grid of a system that shows no mode away from the origin
MARGIN = 10.0  #: a grid reaches this factor below and above the modes that are seen
LIGHT = 0.3  #: damping ratio below which a root makes a peak or notch
NARROWEST = 1e-6  #: half width of the finest refinement, of the frequency
REACH = 0.2  #: a refinement ends at this part of its frequency to both sides
SPACING = 0.45  #: of x, in w + sigma sinh(x)
FEWEST_AROUND, MOST_AROUND = 3, 41  #: points of a refinement, odd
UNSEEN_PAIR = 1e-3  #: a zero so near to a pole that is not seen cancels it


def default_frequencies(poles: ComplexArray, roots: ComplexArray | None = None) -> FloatArray:
    """Choose frequencies [rad/s] for poles that are seen.

    Parameters
    ----------
    poles : (k,) complex ndarray
        Poles that are seen [rad/s], none at the origin; they set the range, a tenth of the slowest to ten times the
        fastest, or 0.1 to 10 rad/s where there are none.
    roots : (l,) complex ndarray, optional
        Zeros, at which the grid is refined as at the poles.

    Returns
    -------
    (n,) ndarray
        At most 2000, rising.

    Examples
    --------
    >>> grid = default_frequencies(np.array([-0.01 + 1j, -0.01 - 1j]))
    >>> round(float(grid[0]), 2), round(float(grid[-1]), 2), bool(1.0 in grid)
    (0.1, 10.0, True)
    """
    low, high = FALLBACK_RANGE
    poles = poles[poles != 0.0]
    if poles.size:
        low, high = np.abs(poles).min() / MARGIN, np.abs(poles).max() * MARGIN
    grid = np.geomspace(low, high, BASE_POINTS)
    light = np.concatenate([poles, np.zeros(0, dtype=np.complex128) if roots is None else roots])
    light = light[(light.imag > 0.0) & (np.abs(light.real) < LIGHT * np.abs(light))]
    light = light[(light.imag > low) & (light.imag < high)]
    if light.size == 0:
        return grid
    most = (DEFAULT_GRID_MOST_POINTS - BASE_POINTS) // light.size
    most = int(np.clip(most - (most % 2 == 0), 1, MOST_AROUND))
    around = [_around(root, most) for root in light[np.argsort(light.imag)].tolist()]
    near = np.unique(np.concatenate(around))
    near = near[(near > low) & (near < high)]
    centres = np.unique(light.imag)
    if near.size > DEFAULT_GRID_MOST_POINTS - BASE_POINTS:
        near = centres[:: -(-centres.size // (DEFAULT_GRID_MOST_POINTS - BASE_POINTS))]
    return np.unique(np.concatenate([grid, near]))


def _around(root: complex, most: int) -> FloatArray:
    """Return frequencies around a peak or notch, its centre among them."""
    centre = root.imag
    half = max(abs(root.real), NARROWEST * centre)
    reach = np.arcsinh(REACH * centre / half)
    count = int(np.clip(2 * round(reach / SPACING) + 1, FEWEST_AROUND, MOST_AROUND))
    count = min(count, most)
    points = centre + half * np.sinh(np.linspace(-reach, reach, count))
    points[count // 2] = centre
    return points


def visible_zeros(zeros: ComplexArray, hidden: ComplexArray) -> ComplexArray:
    """Leave out zeros that cancel poles that are not seen."""
    if zeros.size == 0 or hidden.size == 0:
        return zeros
    distance = np.abs(zeros[:, None] - hidden).min(axis=1)
    return np.asarray(zeros[distance > UNSEEN_PAIR * np.abs(zeros)])
