"""What a file of a calibration says of its uncertainty: the largest U over the calibrated range, by output."""

from __future__ import annotations

import math
from collections.abc import Mapping

from labctl.answers.budget import UncertaintyJson, VectorBoundJson
from labctl.calibration import Calibration


def bounds_dps(calibration: Calibration) -> dict[str, float | None]:
    """Return axis -> the largest expanded uncertainty over the calibrated range, deg/s; None: unknown.

    It is that of a rotation about the axis itself, the others at rest.
    """
    use_bounds = _of(calibration)
    return {axis: None if use_bounds is None else use_bounds["axes"][axis]["bound_dps"] for axis in calibration.axes}


def any_axis_bounds_dps(calibration: Calibration) -> dict[str, float | None]:
    """Return axis -> the largest expanded uncertainty where the unit turns about any axis, deg/s; None: unknown.

    It holds in the frame of the case.
    """
    return {axis: None if vector is None else vector["bound_dps"] for axis, vector in _vectors(calibration).items()}


def _vectors(calibration: Calibration) -> dict[str, VectorBoundJson | None]:
    use_bounds = _of(calibration)
    return {axis: None if use_bounds is None else use_bounds["axes"][axis].get("vector") for axis in calibration.axes}


def bound_lines(calibration: Calibration) -> list[str]:
    """Return the lines of a comment: U of each axis, alone and turned about any axis, and standards not in it."""
    use_bounds, bounds = _of(calibration), bounds_dps(calibration)
    bound_list = _listed(bounds)
    lines = []
    if bound_list:
        lines.append(
            "Expanded uncertainty U (95.45 %) of a corrected rate on later days, about its own axis alone, at most: "
            f"{bound_list}."
        )
    if unknown := [axis for axis, bound in bounds.items() if bound is None]:
        lines.append(f"Uncertainty of a corrected rate: unknown for {', '.join(unknown)}.")
    lines += _any_axis_lines(calibration)
    if bound_list and use_bounds is not None and use_bounds["not_stated"]:
        lines.append(
            f"Uncertainties that are not stated, and that U does not contain: {', '.join(use_bounds['not_stated'])}."
        )
    return lines


def _any_axis_lines(calibration: Calibration) -> list[str]:
    vectors, bounds = _vectors(calibration), any_axis_bounds_dps(calibration)
    lines = []
    if bound_list := _listed(bounds):
        reach = max(vector["reach_dps"] for vector in vectors.values() if vector is not None)
        aligned = _listed({axis: vector and vector["aligned_bound_dps"] for axis, vector in vectors.items()})
        lines.append(
            f"U turned about any axis at up to {reach:.4g} deg/s, in the frame of the case, at most: {bound_list}; up "
            "to a "
            f"rotation of the frame: {aligned}."
        )
    if unknown := [axis for axis, bound in bounds.items() if bound is None]:
        lines.append(f"U turned about any axis: unknown for {', '.join(unknown)}.")
    for axis in calibration.axes:
        use_bounds = _of(calibration)
        cross = None if use_bounds is None else use_bounds["axes"][axis].get("cross_rates")
        if cross is not None and cross["per_dps"] is not None:
            about = " and ".join(cross["about"])
            lines.append(f"A rate about {about} adds up to {_at_least(cross['per_dps']):g} of it to {axis}.")
    return lines


def _listed(bounds: Mapping[str, float | None]) -> str:
    return ", ".join(f"{axis} {_at_least(bound):g} deg/s" for axis, bound in bounds.items() if bound is not None)


def bound_constant(name: str, calibration: Calibration) -> str:
    """Return the C constants of U, deg/s by axis; NAN where it is unknown.

    `<name>_u_dps` is that of a rotation about the axis itself, `<name>_u_any_axis_dps` about any axis.
    """
    bounds_by_name = {"u": bounds_dps(calibration), "u_any_axis": any_axis_bounds_dps(calibration)}
    return "".join(
        f"static const double {name}_{bound_name}_dps[{len(bounds)}] = "
        f"{{{', '.join(map(_c_number, bounds.values()))}}};\n"
        for bound_name, bounds in bounds_by_name.items()
    )


def _c_number(bound: float | None) -> str:
    return "NAN" if bound is None else f"{_at_least(bound):g}"


def _of(calibration: Calibration) -> UncertaintyJson | None:
    return calibration.document.get("uncertainty")


def _at_least(bound: float) -> float:
    """Return a bound with two significant digits, rounded up."""
    if bound == 0:
        return 0.0
    last_digit = 10.0 ** (math.floor(math.log10(bound)) - 1)
    return float(f"{math.ceil(bound / last_digit - 1e-9) * last_digit:.3g}")
