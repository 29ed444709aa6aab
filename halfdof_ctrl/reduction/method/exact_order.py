"""The number of finite eigenvalues in exact arithmetic, where the entries of a small model were not rounded.

Entries of M, C, K that nearly cancel leave parts that rounding could have made, and which therefore count as zero.
Where no entry fills the digits of a double, as rounded ones do, they are what they say, and the degree of ``det P(s)``
is the number of states that the model has as it is stored. Those that were taken as none are then told, and a model is
not called singular that is not.
"""

import numpy as np

from halfdof_ctrl.base.errors import CloseDecisionWarning, give_warning
from halfdof_ctrl.model.second_order import SecondOrderModel
from halfdof_ctrl.reduction.algebra.integers import LARGEST_EXACT, degree_of_determinant, has_short_entries


def exact_order(model: SecondOrderModel) -> int | None:
    """Return the number of finite eigenvalues, -1 for a singular pencil; None if the entries do not tell or are many.

    Examples
    --------
    >>> from halfdof_ctrl import mechss
    >>> exact_order(mechss([[1, 1], [1, 1 + 2.0**-48]], None, [[2, 0], [0, 3]]))
    4
    """
    if len(model.dofs) > LARGEST_EXACT:
        return None
    P = np.stack(model.as_dense().quadratics.P if model.is_sparse else model.quadratics.P)
    return degree_of_determinant(P) if has_short_entries(P) else None


def warn_of_hidden_states(model: SecondOrderModel, order: int) -> None:
    """Warn where a state space has fewer states than the model, or more.

    Warns
    -----
    CloseDecisionWarning
    """
    exact = exact_order(model)
    if exact is not None and exact not in {order, -1}:
        msg = (
            f"The numbers as they are stored have {exact} finite eigenvalues, this state space {order}: a part of M, "
            "C, K that rounding could have made is taken as zero, though their entries have so few digits that they "
            "were not rounded. Pass tol to say what counts as zero, or mend entries that should cancel."
        )
        give_warning(msg, CloseDecisionWarning)
