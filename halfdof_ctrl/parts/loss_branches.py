"""Maxwell branches for a given loss over a band: in closed form where it is constant, refined where it is not.

    sum of g_i s / (s + w_i)  at s = j omega:  imaginary part 1 ± eps on the band                         (L1)

The best g_i, w_i come from Zolotarev's best relative approximation of ``1 / sqrt(x)`` by a rational function, with
Jacobi's elliptic functions (N. I. Achieser, Theory of Approximation, 1956, appendix E). Causality ties the real part to
the imaginary one: constant loss lets the stiffness rise by about ``2 eta / pi`` for every factor e in frequency.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.optimize
from scipy.special import ellipj, ellipkm1

from halfdof_ctrl.base.arrays import ComplexArray, FloatArray
from halfdof_ctrl.base.errors import ParameterError

MOST_BRANCHES = 12
POINTS_PER_DECADE = 400  #: frequencies at which errors are measured
PER_DECADE_FITTED = 60  #: frequencies at which branches are refined
LAWSON_ROUNDS = 12  #: of reweighting towards the largest error (C. L. Lawson, 1961)
SMALLEST_WEIGHT = 1e-3  #: over the mean, so that no frequency is forgotten


@dataclass(frozen=True, slots=True, eq=False)
class Branches:
    """Sizes g_i relative to the stiffness, and rates w_i [rad/s]."""

    g: FloatArray
    w: FloatArray

    def __call__(self, omega: FloatArray) -> ComplexArray:
        """Give ``sum of g_i s / (s + w_i)``."""
        s = 1j * np.asarray(omega, dtype=float)[..., None]
        return np.asarray(np.sum(self.g * s / (s + self.w), axis=-1))


Loss = Callable[[FloatArray], FloatArray]


def constant_loss(count: int, band: tuple[float, float]) -> Branches:
    """Give the best branches for imaginary part 1 over a band [Hz], equation (L1).

    Examples
    --------
    Four branches hold it over two decades to 0.55 per cent:

    >>> branches = constant_loss(4, (1.0, 100.0))
    >>> omega = 2 * np.pi * np.geomspace(1, 100, 500)
    >>> round(float(abs(branches(omega).imag - 1).max()), 4)
    0.0055
    """
    low, high = band
    ratio = (low / high) ** 2
    places = np.arange(1, 2 * count) * ellipkm1(ratio) / (2 * count)
    sine, cosine, _, _ = ellipj(places, 1.0 - ratio)
    c = (sine / cosine) ** 2
    odd, even = c[0::2], c[1::2]
    x = np.geomspace(1.0, 1.0 / ratio, _points(band, POINTS_PER_DECADE))[:, None]
    values = np.sqrt(x[:, 0]) * np.prod(x + even, axis=1) / np.prod(x + odd, axis=1)
    D = 2.0 / (values.max() + values.min())
    others = np.where(np.eye(count, dtype=bool), 1.0, odd[None, :] - odd[:, None])
    g = D * np.prod(even[None, :] - odd[:, None], axis=1) / np.prod(others, axis=1) / np.sqrt(odd)
    return Branches(np.asarray(g), np.asarray(2.0 * np.pi * low * np.sqrt(odd)))


def band_points(band: tuple[float, float], per_decade: int = POINTS_PER_DECADE) -> FloatArray:
    """Give angular frequencies over a band [Hz], its ends among them."""
    return np.asarray(2.0 * np.pi * np.geomspace(*band, _points(band, per_decade)))


def loss_error(branches: Branches, loss: Loss, band: tuple[float, float], reference: float, *, factor: bool) -> float:
    """Give the largest relative error of the loss, or of the loss factor, over the band."""
    omega = band_points(band)
    return float(np.abs(_loss_of(branches, omega, reference, factor=factor) / loss(omega) - 1.0).max())


def branches_for(
    loss: Loss, count: int, band: tuple[float, float], reference: float, *, factor: bool, constant: bool
) -> Branches:
    """Find branches for a loss that depends on frequency, or for a loss factor with its stiffening."""
    start = constant_loss(count, band)
    inside = np.clip(start.w, 2.0 * np.pi * band[0], 2.0 * np.pi * band[1])
    first = Branches(start.g * loss(inside), start.w)
    if constant and not factor:
        return first
    omega = band_points(band, PER_DECADE_FITTED)
    wanted = loss(omega)
    if factor:  # a constant loss factor lets the stiffness rise as a power of the frequency
        power = 2.0 / np.pi * np.arctan(float(np.mean(wanted)))
        first = Branches(first.g * (first.w / omega[0]) ** power, first.w)
    weights = np.ones(omega.size)
    theta = np.log(np.concatenate([first.g, first.w]))
    best, smallest = _at_reference(first, reference, factor=factor), np.inf

    def error(parameters: FloatArray) -> FloatArray:
        g, w = np.exp(parameters).reshape(2, -1)
        values = Branches(g, w)(omega)
        return np.asarray((values.imag / (1.0 + values.real) if factor else values.imag) / wanted - 1.0)

    def weighted(parameters: FloatArray, root: FloatArray) -> FloatArray:
        return np.asarray(root * np.nan_to_num(error(parameters), posinf=1e9, neginf=-1e9))

    for _ in range(LAWSON_ROUNDS):
        with np.errstate(all="ignore"):  # a trial step may overflow, which the trust region answers
            found = scipy.optimize.least_squares(weighted, theta, args=(np.sqrt(weights),))
        theta = np.asarray(found.x)
        trial = _at_reference(Branches(*np.exp(theta).reshape(2, -1)), reference, factor=factor)
        size = loss_error(trial, loss, band, reference, factor=factor)
        if size < smallest:
            best, smallest = trial, size
        weights = weights * np.abs(error(theta))
        weights = np.maximum(weights / weights.mean(), SMALLEST_WEIGHT) if weights.any() else np.ones(omega.size)
    order = np.argsort(best.w)
    return Branches(best.g[order], best.w[order])


def enough_branches(
    loss: Loss,
    band: tuple[float, float],
    reference: float,
    *,
    count: int | None,
    tol: float,
    factor: bool,
    constant: bool,
) -> tuple[Branches, float]:
    """Take as many branches as asked for, or as the tolerance needs, and give their error.

    Raises
    ------
    ParameterError
        Twelve branches do not reach the tolerance.
    """
    error = np.inf
    for number in [count] if count is not None else range(1, MOST_BRANCHES + 1):
        branches = branches_for(loss, number, band, reference, factor=factor, constant=constant)
        error = loss_error(branches, loss, band, reference, factor=factor)
        if count is not None or error <= tol:
            return branches, error
    msg = (
        f"{MOST_BRANCHES} branches leave a loss error of {error:.2g} from {band[0]:.4g} to {band[1]:.4g} Hz, more than "
        f"tol = {tol:g}. Narrow the band or raise tol."
    )
    raise ParameterError(msg, parameter="tol", value=tol)


def _at_reference(branches: Branches, reference: float, *, factor: bool) -> Branches:
    """Make sizes over the stiffness at rest sizes over that at the reference, which keeps ``1 - kappa`` positive."""
    if not factor:
        return branches
    return Branches(branches.g / (1.0 + branches(np.array([reference])).real[0]), branches.w)


def _loss_of(branches: Branches, omega: FloatArray, reference: float, *, factor: bool) -> FloatArray:
    values = branches(omega)
    if not factor:
        return np.asarray(values.imag)
    stiffness = 1.0 + values.real - branches(np.array([reference])).real
    return np.asarray(values.imag / stiffness)


def _points(band: tuple[float, float], per_decade: int) -> int:
    return max(50, int(per_decade * np.log10(band[1] / band[0])) + 1)
