"""Which of python-control's ways to evaluate a system is taken: slycot's, or NumPy's where that is missing."""

import pytest

try:
    import slycot  # noqa: F401

    HAS_SLYCOT = True
except ImportError:
    HAS_SLYCOT = False

needs_slycot = pytest.mark.skipif(not HAS_SLYCOT, reason="slycot's evaluation is the one that loses digits here")
