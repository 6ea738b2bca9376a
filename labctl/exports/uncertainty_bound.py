"""What a file of a calibration says of its uncertainty: the largest U over the calibrated range, by axis."""

from __future__ import annotations

import math

from labctl.calibration import Calibration
from labctl.json_types.budget import UncertaintyJson


def bounds_dps(calibration: Calibration) -> dict[str, float | None]:
    """Return axis -> the largest expanded uncertainty over the calibrated range, deg/s; None: unknown."""
    found = _of(calibration)
    return {axis: None if found is None else found["axes"][axis]["bound_dps"] for axis in calibration.axes}


def bound_lines(calibration: Calibration) -> list[str]:
    """Return the lines of a comment: U of each axis, and the standards that are not in it."""
    found, bounds = _of(calibration), bounds_dps(calibration)
    known = ", ".join(f"{axis} {_at_least(bound):g} deg/s" for axis, bound in bounds.items() if bound is not None)
    unknown = ", ".join(axis for axis, bound in bounds.items() if bound is None)
    lines = []
    if known:
        lines.append(f"Expanded uncertainty U (95.45 %) of a corrected rate on later days, at most: {known}.")
    if unknown:
        lines.append(f"Uncertainty of a corrected rate: unknown for {unknown}.")
    if known and found is not None and found["not_stated"]:
        lines.append(
            f"Uncertainties that the bench does not state, and that U does not contain: "
            f"{', '.join(found['not_stated'])}."
        )
    return lines


def bound_constant(name: str, calibration: Calibration) -> str:
    """Return the C constant `<name>_u_dps`, deg/s by axis; NAN where it is unknown."""
    numbers = ["NAN" if bound is None else f"{_at_least(bound):g}" for bound in bounds_dps(calibration).values()]
    return f"static const double {name}_u_dps[{len(numbers)}] = {{{', '.join(numbers)}}};\n"


def _of(calibration: Calibration) -> UncertaintyJson | None:
    return calibration.document.get("uncertainty")


def _at_least(bound: float) -> float:
    """Return a bound with two significant digits, rounded up."""
    if bound == 0:
        return 0.0
    unit = 10.0 ** (math.floor(math.log10(bound)) - 1)
    return float(f"{math.ceil(bound / unit - 1e-9) * unit:.3g}")
