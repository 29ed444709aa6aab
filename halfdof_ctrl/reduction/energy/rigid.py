"""The factor of a stiffness that may leave motions free, and these motions.

A structure that floats has a K with null vectors Phi, exact ones for translations and some that hold to the rounding of
the entries of K for rotations. With as many support DOFs 2 as there are free motions and the others 1,

    K = U^T U,   U = [U_11 U_12],   Phi = [-U_11^-1 U_12; I],   U Phi = 0.                  (24)

A motion counts as free if its energy is rounding of the terms that it is summed from,

    |Phi^T K Phi| <= eps |Phi|^T |K| |Phi|,                                                 (25)

without a factor n: the first bending mode of a clamped beam of 20 000 DOFs stands at 0.12 eps. What tells it from a
rotation is the next mode, whose ratio must be a thousand times larger.
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg
from scipy.linalg.lapack import dpocon, dpotrf, dpstrf

from halfdof_ctrl.base.arrays import EPS, FloatArray, IndexArray, powers_of_two
from halfdof_ctrl.base.errors import EnergyFormError
from halfdof_ctrl.base.exact_products import SlicedMatrix
from halfdof_ctrl.base.matrix_residual import exact_product, exact_residual, sliced
from halfdof_ctrl.base.names import removal_of
from halfdof_ctrl.reduction.energy.cholesky import corrected_factor, solved

SMALL_PIVOT = 128.0  #: times n eps of the diagonal: a smaller pivot may stand for a motion that is free, or nearly
NEXT_MODE_RATIO = 1e3  #: the ratio (25) of the next mode is larger than that of a free motion by this factor
NEARLY_FREE = 30.0  #: times eps: a ratio (25) up to which rounding of K changes the motion visibly
FIRST_PREFERRED = 1e-3  #: DOFs that come first are preferred as supports by so much, so that rounding does not choose
SURELY_DEFINITE = 1e-10  #: reciprocal condition number from which on rounding does not decide about definiteness
RIGID_ITERATIONS = 8
RIGID_REFINEMENTS = 2


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class StiffnessFactor:
    """``K = U^T U`` for n DOFs of which d are supports, U with n - d rows."""

    U: FloatArray  #: (n - d, n) factor; upper triangular in the columns `carried`
    carried: IndexArray  #: (n - d,) DOFs that are no supports, ascending
    supports: IndexArray  #: (d,) DOFs at which the free motions are measured
    motions: FloatArray  #: (n, d) Phi of equation (24), the identity at the supports
    nearest: float  #: ratio (25) over eps of the softest motion that is not free, where it was looked for, else inf


def stiffness_factor(K: FloatArray, first: int, names: tuple[str, ...]) -> StiffnessFactor:
    """Factorize a positive semidefinite stiffness and find the motions that it leaves free.

    Parameters
    ----------
    K : (n, n) ndarray
        Symmetric.
    first : int
        The first DOFs, so many, cannot be supports (static DOFs).
    names : tuple of str
        Names of the DOFs in this order, for messages.

    Returns
    -------
    StiffnessFactor

    Raises
    ------
    EnergyFormError
        K is indefinite, or its first DOFs float by themselves, or it is not told whether it is singular.

    Examples
    --------
    A spring of 4 N/m between two free masses:

    >>> factor = stiffness_factor(np.array([[4.0, -4.0], [-4.0, 4.0]]), 0, ("a", "b"))
    >>> factor.U.tolist(), factor.motions.ravel().tolist()
    ([[-2.0, 2.0]], [1.0, 1.0])
    """
    n = len(K)
    _require_diagonal(K, names)
    positive = np.diagonal(K) > 0.0
    scale = np.where(positive, powers_of_two(np.sqrt(np.abs(np.diagonal(K)))), 1.0)
    scaled = scale[:, None] * K * scale
    plain, failed = dpotrf(scaled.T, lower=0)
    if not failed and (np.diagonal(plain) ** 2 > SMALL_PIVOT * n * EPS * np.diagonal(scaled)).all():
        U = corrected_factor(scaled)
        if U is not None:
            return _whole(U, scale)
    candidates = _candidates(scaled, first, names)
    exact = sliced(scaled)
    free, rest = _free_motions(scaled, exact, candidates.motions, names)
    nearest = min(rest, _next_ratio(scaled, exact, candidates) if free.shape[1] == candidates.supports.size else np.inf)
    largest = _ratios(scaled, exact, free).max(initial=0.0)
    if free.shape[1] == 0 or nearest <= NEXT_MODE_RATIO * largest or nearest <= 1.0:
        U = corrected_factor(scaled)
        if U is None:
            raise _undecided(nearest, names, candidates.supports)
        return _whole(U, scale, nearest)
    supports = _supports(free, first)
    factor = _with_supports(scaled, supports, _definite(scaled, supports, names))
    return StiffnessFactor(
        U=factor.U / scale,
        carried=factor.carried,
        supports=supports,
        motions=scale[:, None] * factor.motions / scale[supports],
        nearest=nearest,
    )


def _whole(U: FloatArray, scale: FloatArray, nearest: float = np.inf) -> StiffnessFactor:
    n = len(U)
    return StiffnessFactor(
        U=U / scale,
        carried=np.arange(n),
        supports=np.zeros(0, dtype=np.intp),
        motions=np.zeros((n, 0)),
        nearest=nearest,
    )


def _require_diagonal(K: FloatArray, names: tuple[str, ...]) -> None:
    """Refuse what is indefinite at a glance: a negative diagonal, or a zero one beside entries."""
    diagonal = np.diagonal(K)
    wrong = (diagonal < 0.0) | ((diagonal == 0.0) & K.any(axis=0))
    if wrong.any():
        raise indefinite_error("K", [names[j] for j in np.flatnonzero(wrong).tolist()])


def indefinite_error(letter: str, dofs: list[str]) -> EnergyFormError:
    """Make the refusal of an energy that is negative in some motion."""
    meaning = {"K": "elastic energy (negative stiffness, a constraint)", "M": "kinetic energy"}[letter]
    msg = (
        f"There are no energy coordinates: {letter} is not positive semidefinite, so that a motion of DOFs "
        f"{', '.join(dofs[:8])} has negative {meaning}. Keep states='dofs', or 'scaled' for python-control."
    )
    return EnergyFormError(msg, reason="indefinite", dofs=tuple(dofs))


def _undecided(nearest: float, names: tuple[str, ...], candidates: IndexArray) -> EnergyFormError:
    msg = (
        f"There are no energy coordinates: whether K leaves a motion of DOFs "
        f"{', '.join([names[j] for j in candidates.tolist()][:8])} free is not told from rounding of its entries "
        f"(its energy is {nearest:.1e} eps of the terms that it is summed from). Keep states='dofs'."
    )
    return EnergyFormError(msg, reason="undecided", dofs=tuple([names[j] for j in candidates.tolist()]))


def _candidates(K: FloatArray, first: int, names: tuple[str, ...]) -> StiffnessFactor:
    """Take the fewest DOFs without which K is positive definite, those with the smallest pivots, as supports.

    The motions are refined, so that a plain factor serves.
    """
    order, rank = _pivots(K, first, names)
    for count in range(order.size - rank, order.size + 1):
        supports = np.sort(order[order.size - count :])
        carried = np.setdiff1d(np.arange(len(K)), supports)
        inner = _surely_definite(K[np.ix_(carried, carried)])
        if inner is not None:
            return _with_supports(K, supports, inner)
    raise indefinite_error("K", list(names[:first]))


def _surely_definite(K: FloatArray) -> FloatArray | None:
    """Return a factor of K, the corrected one where rounding might decide whether there is one."""
    U, failed = dpotrf(K.T, lower=0, clean=1)
    if failed or K.size == 0 or not dpocon(U, float(np.abs(K).sum(axis=0).max()))[0] >= SURELY_DEFINITE:
        return corrected_factor(K)
    return np.asarray(U)


def _pivots(K: FloatArray, first: int, names: tuple[str, ...]) -> tuple[IndexArray, int]:
    """Return the DOFs in the order of a pivoted factorization behind static ones, and how many pivots are not small."""
    n = len(K)
    schur = np.array(K[first:, first:])
    if first:
        U, failed = dpotrf(K[:first, :first], lower=0, clean=1)
        small = np.diagonal(U) ** 2 <= SMALL_PIVOT * n * EPS * np.diagonal(K)[:first]
        if failed or small.any():
            raise _floating_error(names[failed - 1 if failed else int(np.argmax(small))])
        half = solved(U, K[:first, first:], transposed=True)
        schur -= half.T @ half
    none = bool(np.diagonal(schur).max(initial=0.0) <= SMALL_PIVOT * n * EPS)  # dpstrf asks it of later pivots only
    _, order, rank, _ = dpstrf(schur, tol=SMALL_PIVOT * n * EPS)
    places = first + (np.arange(n - first) if none else order - 1)
    return places.astype(np.intp), 0 if none else int(rank)


def _floating_error(dof: str) -> EnergyFormError:
    msg = (
        f"There are no energy coordinates: static DOF {dof} (no mass, no damping) moves without any force, alone or "
        "together with others of its kind, or the stiffness is negative there. Tie it with a spring, or take it out: "
        f"{removal_of([dof])}."
    )
    return EnergyFormError(msg, reason="floating", dofs=(dof,))


def _definite(K: FloatArray, supports: IndexArray, names: tuple[str, ...]) -> FloatArray:
    """Factorize K without the supports."""
    carried = np.setdiff1d(np.arange(len(K)), supports)
    factor = corrected_factor(K[np.ix_(carried, carried)])
    if factor is None:
        raise indefinite_error("K", [names[j] for j in carried.tolist()])
    return factor


def _with_supports(K: FloatArray, supports: IndexArray, factor: FloatArray) -> StiffnessFactor:
    """Return the factor (24) and its null vectors, for given supports and the factor of what they carry."""
    carried = np.setdiff1d(np.arange(len(K)), supports)
    inner, beside = K[np.ix_(carried, carried)], K[np.ix_(carried, supports)]
    column = np.logical_or.accumulate(beside != 0.0, axis=0)
    across = solved(factor, beside, transposed=True)
    across += solved(factor, exact_residual(beside, factor.T, across), transposed=True)
    across = np.where(column, across, 0.0)
    motions = np.zeros((len(K), supports.size))
    motions[supports] = np.eye(supports.size)
    held = -solved(factor, across)
    exact = sliced(inner)
    for _ in range(RIGID_REFINEMENTS):
        held += solved(factor, solved(factor, exact_residual(-beside, exact, held), transposed=True))
    motions[carried] = held
    U = np.zeros((carried.size, len(K)))
    U[:, carried], U[:, supports] = factor, across
    return StiffnessFactor(U=U, carried=carried, supports=supports, motions=motions, nearest=np.inf)


def _ratios(K: FloatArray, exact: SlicedMatrix, motions: FloatArray) -> FloatArray:
    """Return the ratios (25) over eps, signed, of some motions."""
    energy = np.einsum("ij,ij->j", motions, exact_product(exact, motions))
    terms = np.einsum("ij,ij->j", np.abs(motions), np.abs(K) @ np.abs(motions))
    return np.asarray(energy / np.where(terms > 0.0, terms * EPS, 1.0))


def _free_motions(
    K: FloatArray, exact: SlicedMatrix, motions: FloatArray, names: tuple[str, ...]
) -> tuple[FloatArray, float]:
    """Return those combinations of candidates that are free by (25), and the smallest ratio of the others."""
    if motions.shape[1] == 0:
        return motions, np.inf
    size = np.sqrt(np.einsum("ij,ij->j", np.abs(motions), np.abs(K) @ np.abs(motions)))
    unit = motions / np.where(size > 0.0, size, 1.0)
    energy = unit.T @ exact_product(exact, unit)
    _, turn = np.linalg.eigh((energy + energy.T) / 2.0)
    turned = unit @ turn
    ratios = _ratios(K, exact, turned)
    if (ratios < -1.0).any():
        worst = np.abs(turned[:, int(np.argmin(ratios))])
        raise indefinite_error("K", [names[j] for j in np.argsort(-worst, kind="stable")[:8].tolist()])
    free = np.abs(ratios) <= 1.0
    if free.all():
        return motions, np.inf
    return turned[:, free], float(ratios[~free].min())


def _next_ratio(K: FloatArray, exact: SlicedMatrix, factor: StiffnessFactor) -> float:
    """Return the ratio (25) over eps of the softest motion beside those that are free, by inverse iteration."""
    carried = factor.carried
    if carried.size == 0:
        return np.inf
    U, basis = factor.U[:, carried], np.linalg.qr(factor.motions)[0]
    x = np.random.default_rng(0).standard_normal((len(K), 1))
    for _ in range(RIGID_ITERATIONS):
        x -= basis @ (basis.T @ x)
        held = np.zeros_like(x)
        held[carried] = solved(U, solved(U, x[carried], transposed=True))
        x = held - basis @ (basis.T @ held)
        x /= np.linalg.norm(x)
    return float(_ratios(K, exact, x)[0])


def _supports(free: FloatArray, first: int) -> IndexArray:
    """Choose the DOFs that show the free motions best; of equal ones those that come first."""
    n, d = free.shape
    shown = np.linalg.qr(free)[0]
    preference = 1.0 + FIRST_PREFERRED * np.linspace(1.0, 0.0, n)
    _, _, order = scipy.linalg.qr((shown * preference[:, None])[first:].T, mode="economic", pivoting=True)
    return np.sort(first + np.asarray(order[:d])).astype(np.intp)
