"""The laws of springs and dampers that are built in."""

from halfdof_ctrl.model.laws import bilinear, coulomb, cubic, gap, power, quadratic, table

__all__ = ["bilinear", "coulomb", "cubic", "gap", "power", "quadratic", "table"]
