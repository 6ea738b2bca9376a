"""The comment lines at the head of a text file: which calibration, how far off, what was lost."""

from __future__ import annotations

from collections.abc import Iterable

from labctl.calibration import Calibration
from labctl.exports.format import Loss
from labctl.exports.uncertainty_bound import bound_lines
from labctl.fitting.numeric.rounding import at_most


def plain(text: str) -> str:
    """Return text as printable ASCII: without line breaks."""
    return "".join(char if char.isascii() and char.isprintable() else "?" for char in text)


def head_lines(
    calibration: Calibration, carries: str, differs_dps: float | None, losses: Iterable[Loss], notes: Iterable[str] = ()
) -> list[str]:
    """Return the lines, without the sign that begins a comment."""
    (low, high), (slow, fast) = calibration.temperature_c, calibration.rate_dps
    serial, model = plain(calibration.serial), plain(calibration.fitted.model.name)
    lines = [
        f"Gyro {serial}, calibration version {calibration.version}: model {model}",
        f"Hash of the calibration: {calibration.calibration_hash}",
        f"Calibrated from {low:g} to {high:g} deg C and from {slow:g} to {fast:g} deg/s.",
        f"Carries: {carries}.",
        *configuration_lines(calibration),
    ]
    if differs_dps is not None:
        lines.append(
            f"Rates corrected by this file differ from those of the calibration by at most "
            f"{at_most(differs_dps):.3g} deg/s, apart from what the format cannot express."
        )
    lines += [plain(line) for line in bound_lines(calibration)]
    lines += [f"LOST {loss.text}." for loss in losses]
    return lines + list(notes)


def configuration_lines(calibration: Calibration) -> list[str]:
    """Return the line that says how the unit was set when it was measured; none where it does not say that."""
    settings_text = "; ".join(f"{name} = {value}" for name, value in calibration.configuration.items())
    return [plain(f"The unit was set to: {settings_text}.")] if settings_text else []


def commented(lines: Iterable[str], sign: str = "# ") -> str:
    """Return lines as comments, each with its line end."""
    return "".join(f"{sign}{line}".rstrip() + "\n" for line in lines)
