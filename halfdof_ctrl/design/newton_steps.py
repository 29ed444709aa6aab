"""When steps of Newton's method for the Riccati equation lead nowhere, in whatever arithmetic they are taken."""

import math
from dataclasses import dataclass

MOST_NEWTON_STEPS = 100  #: each at least halves the distance, from however far
FROM_AFAR = 0.3  #: steps above this part of the gain halve it, and look alike
CONTRACTION = 0.75  #: of nearer steps, at least ...
STALLED_STEPS = 3  #: ... but for so many: more are rounding, or show that nothing is known of some part


@dataclass(slots=True)
class NewtonSteps:
    """The length of the last step, relative to the gain, and how many did not shrink."""

    last: float = math.inf
    idle: int = 0

    def goes_on(self, length: float) -> bool:
        """Take note of the length of a step, and return whether it is worth taking.

        Examples
        --------
        >>> steps = NewtonSteps()
        >>> [steps.goes_on(length) for length in (0.1, 0.09, 0.09, 0.09, 0.09)]
        [True, True, True, True, False]
        """
        self.idle += self.last < FROM_AFAR and length > CONTRACTION * self.last
        if not math.isfinite(length) or self.idle > STALLED_STEPS:
            return False
        self.last = length
        return True
