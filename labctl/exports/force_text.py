"""What a file says of g-sensitivity: its size, what was not measured, and that a format does not carry it."""

from __future__ import annotations

from labctl.calibration import Calibration
from labctl.exports.format import Loss
from labctl.fitting.models.force_sensitivity import ForceSensitivity
from labctl.fitting.numeric.rounding import at_most


def size_line(force: ForceSensitivity, function: str) -> str:
    """Return the line which says that only one function corrects g-sensitivity, with its size."""
    sizes = ", ".join(f"{a} {at_most(size):.3g}" for a, size in zip(force.axes, force.at_1_g_dps, strict=True))
    return f"g-sensitivity, at 1 g at most {sizes} deg/s, is corrected by {function} alone"


def unmeasured_line(force: ForceSensitivity) -> str:
    """Return what the fit saw no force along, and so is not corrected; empty where there is nothing."""
    unmeasured = "; ".join(f"axis {axis}: along {', '.join(bodies)}" for axis, bodies in force.not_measured.items())
    return f"Sensitivity that was not measured and is not corrected, {unmeasured}" if unmeasured else ""


def force_losses(calibration: Calibration) -> tuple[Loss, ...]:
    """Return what is lost where a format has no input of specific force; nothing without g-sensitivity."""
    force = calibration.force_sensitivity
    return () if force is None else (Loss("g-sensitivity, at 1 g", float(force.at_1_g_dps.max())),)
