"""The state space as users get it: with a word where it holds free motions as rounding.

In DOF states the stiffness of a body that floats cancels in sums, not entry by entry: eigenvalue solvers find poles at
1e-8 of the other poles in the place of 0, also where A is singular to the last bit, and a static gain that is infinite
comes out finite, of any sign. That is usual; where much more is lost it is said.
"""

import control
import numpy as np

from halfdof_ctrl.base.errors import LostDigitsWarning, give_warning
from halfdof_ctrl.model.free_motions import FreeMotionCount

USUAL_SPURIOUS = 1e-6  #: of the slowest other pole: a double pole at 0 is moved by 1e-8 of it in any case


def warn_of_free_motions(sys: control.StateSpace, free: FreeMotionCount) -> bool:
    """Warn of poles at the origin that a state space in DOFs does not hold as such, and return whether there are.

    Warns
    -----
    LostDigitsWarning
        Rounding of A moves them further than that of a double pole does.
    """
    size = np.sort(np.abs(np.linalg.eigvals(sys.A)))
    if size.size <= free.poles:  # there is no other pole beside which they might be large
        return False
    spurious, slowest = float(size[free.poles - 1]), float(size[free.poles])
    if not spurious > USUAL_SPURIOUS * slowest:
        return False
    msg = (
        f"The model has {free.in_words()}. In these states rounding of A moves them to {spurious:.1e} rad/s, "
        f"beside a slowest other pole of {slowest:.1e} rad/s, and the static gain of python-control is finite. "
        "mech2ss(model, states='energy') keeps them at 0; frequency_response(model) and the plots know them."
    )
    give_warning(msg, LostDigitsWarning)
    return True
