"""Eigenvalues before and after: of the descriptor form, of A, and their difference."""

from collections.abc import Iterable
from dataclasses import dataclass

import control
import numpy as np
import scipy.optimize

from halfdof_ctrl.base.arrays import ComplexArray
from halfdof_ctrl.base.words import eigenvalue_in_words
from halfdof_ctrl.descriptor.data_limit import warn_of_eigenvalues
from halfdof_ctrl.descriptor.structure import pencil_structure
from halfdof_ctrl.model.second_order import SecondOrderModel

SAME_PAIR = 1e-8  #: relative distance to the conjugate at which two eigenvalues are one pair
NO_INERTIA = "infinite"
EIGENVALUE_TABLE_MOST_ROWS = 20  #: infinite eigenvalues that have a row each
TABLE_TITLES = ("descriptor form", "state space", "difference")


@dataclass(frozen=True, slots=True, eq=False, kw_only=True, repr=False)
class EigenvalueTable:
    """Eigenvalues of the descriptor form beside those of A, largest first. Printing it gives a table."""

    rows: tuple[tuple[str, str, str], ...]  #: before, after, difference [rad/s]; a pair is one row
    n_finite: int  #: finite eigenvalues of the descriptor form
    n_infinite: int  #: infinite ones
    order: int  #: eigenvalues of A

    @property
    def counts(self) -> str:
        """Say in one sentence how many there are."""
        infinite = f"{self.n_infinite} infinite eigenvalue{'' if self.n_infinite == 1 else 's'}"
        return f"Before: {self.n_finite} finite and {infinite}. After: {self.order} finite and none infinite."

    def __repr__(self) -> str:
        """Print as a table."""
        rows = [TABLE_TITLES, *self.rows]
        widths = [max(len(row[column]) for row in rows) + 3 for column in range(2)]
        lines = [
            f"{before:<{widths[0]}}{after:<{widths[1]}}{difference}".rstrip() for before, after, difference in rows
        ]
        return "\n".join(["Eigenvalues [rad/s]", *lines, self.counts])


def eigenvalue_table(model: SecondOrderModel, sys: control.StateSpace) -> EigenvalueTable:
    """Put the eigenvalues of the descriptor form and of A side by side.

    Parameters
    ----------
    model : SecondOrderModel
        Its finite eigenvalues come from `pencil_structure`, which does not know the reduction.
    sys : control.StateSpace
        Its eigenvalues are those of A, matched one to one with the finite ones.

    Returns
    -------
    EigenvalueTable

    Warns
    -----
    DataLimitWarning
        Entries of the model known to their last digit do not determine its slow motion.

    Examples
    --------
    >>> model = mechss([[0]], [[5]], [[10]])
    >>> eigenvalue_table(model, mech2ss(model)).rows
    (('-2.0000', '-2.0000', '0.0e+00'), ('infinite', 'none', ''))
    """
    structure = pencil_structure(model)
    finite, poles = structure.finite_eigenvalues, np.linalg.eigvals(np.asarray(sys.A)).astype(np.complex128)
    warn_of_eigenvalues(model, poles)
    first, second = scipy.optimize.linear_sum_assignment(np.abs(finite[:, None] - poles))
    rows = _paired_rows(finite[first], poles[second])
    rows += [(eigenvalue_in_words(value), "missing", "") for value in np.delete(finite, first).tolist()]
    rows += [("missing", eigenvalue_in_words(value), "") for value in np.delete(poles, second).tolist()]
    if structure.n_infinite > EIGENVALUE_TABLE_MOST_ROWS:
        rows.append((f"{structure.n_infinite} {NO_INERTIA}", "none", ""))
    else:
        rows += [(NO_INERTIA, "none", "")] * structure.n_infinite
    return EigenvalueTable(
        rows=tuple(rows), n_finite=finite.size, n_infinite=structure.n_infinite, order=int(sys.nstates)
    )


def eigenvalues_in_words(values: Iterable[complex]) -> list[str]:
    """Write eigenvalues, largest first, conjugate pairs as one."""
    found = np.array(sorted(values, key=abs, reverse=True), dtype=np.complex128)
    return [before for before, _, _ in _paired_rows(found, found)]


def _paired_rows(before: ComplexArray, after: ComplexArray) -> list[tuple[str, str, str]]:
    """Make a row of each matched eigenvalue, or of a conjugate pair of them."""
    rows, left = [], np.argsort(-np.abs(before), kind="stable").tolist()
    while left:
        k = left.pop(0)
        value, difference = complex(before[k]), abs(before[k] - after[k])
        partner = None
        if value.imag != 0.0 and left:
            nearest = min(left, key=lambda other: abs(before[other] - value.conjugate()))
            if abs(before[nearest] - value.conjugate()) <= SAME_PAIR * abs(value):
                partner = nearest
                left.remove(partner)
                difference = max(difference, abs(before[partner] - after[partner]))
        pair = partner is not None
        texts = [eigenvalue_in_words(complex(number), pair=pair) for number in (value, after[k])]
        rows.append((texts[0], texts[1], f"{difference:.1e}"))
    return rows
