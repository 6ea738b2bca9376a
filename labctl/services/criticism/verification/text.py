"""A verification in words; apart from the computation, whose libraries take longer to load."""

from __future__ import annotations

from labctl.answers.verification import AxisVerification, VerificationResponse


def verification_sentence(found: VerificationResponse) -> str:
    """Return what a version leaves of a recording in words."""
    of = "" if found.recorded_unit == found.serial else f" of unit {found.recorded_unit}"
    part = f"the {found.datasets} data sets that verify of " if found.part == "verification" else ""
    text = (
        f"Version {found.version} applied without refitting to {part}recording {found.recording}{of}: error "
        f"{found.rms_dps:.3g} deg/s "
        f"RMS, {found.max_dps:.3g} deg/s at most"
    )
    if found.expected_dps is None:
        text += "; the expected error of this version is not known"
    else:
        text += f"; expected of this version: {found.expected_dps:.3g} deg/s RMS"
    if found.outside_validity:
        text += f"; {found.outside_validity} of {found.datasets} data sets lie outside its validity"
    return ". ".join([text, *(_off(axis, found.axes[axis]) for axis in found.axes_off)]) + "."


def _off(axis: str, found: AxisVerification) -> str:
    return (
        f"Axis {axis} is off: {found.rms_dps:.3g} deg/s RMS, {found.bias_dps:+.3g} deg/s in the mean, where "
        f"{found.expected_dps:.3g} deg/s RMS is expected and {found.limit_dps:.3g} deg/s is the limit"
    )
