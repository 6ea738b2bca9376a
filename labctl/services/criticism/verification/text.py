"""A verification in words; apart from the computation, whose libraries take longer to load."""

from __future__ import annotations

from labctl.answers.verification import AxisVerification, VerificationResponse


def verification_sentence(verification: VerificationResponse) -> str:
    """Return what a version leaves of a recording in words."""
    of = "" if verification.recorded_unit == verification.serial else f" of unit {verification.recorded_unit}"
    part = f"the {verification.datasets} data sets that verify of " if verification.part == "verification" else ""
    text = (
        f"Version {verification.version} applied without refitting to {part}recording {verification.recording}{of}: "
        "error "
        f"{verification.rms_dps:.3g} deg/s "
        f"RMS, {verification.max_dps:.3g} deg/s at most"
    )
    if verification.expected_dps is None:
        text += "; the expected error of this version is not known"
    else:
        text += f"; expected of this version: {verification.expected_dps:.3g} deg/s RMS"
    if verification.outside_validity:
        text += f"; {verification.outside_validity} of {verification.datasets} data sets lie outside its validity"
    return ". ".join([text, *(_off(axis, verification.axes[axis]) for axis in verification.axes_off)]) + "."


def _off(axis: str, verification: AxisVerification) -> str:
    return (
        f"Axis {axis} is off: {verification.rms_dps:.3g} deg/s RMS, {verification.bias_dps:+.3g} deg/s in the mean, "
        "where "
        f"{verification.expected_dps:.3g} deg/s RMS is expected and {verification.limit_dps:.3g} deg/s is the limit"
    )
