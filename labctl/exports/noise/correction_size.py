"""The size of a calibration's correction, for formats that do not carry it."""

from __future__ import annotations

import numpy as np

from labctl.calibration import Calibration
from labctl.errors import BadInput
from labctl.exports.force_text import force_losses
from labctl.exports.format import Loss
from labctl.exports.static_part import differences, static_part


def correction_losses(calibration: Calibration, reason: str) -> tuple[Loss, ...]:
    """Return the whole correction as what is lost, with its size where it depends on output and temperature alone."""
    subject = f"the correction of bias, scale factor and misalignment ({reason})"
    if not np.isfinite(calibration.temperature_c).all():
        return (Loss(subject), *force_losses(calibration))
    try:
        part = static_part(calibration, "", carries="")
    except BadInput:
        return (Loss(subject), *force_losses(calibration))
    size = differences(part, lambda raw, _: raw).together
    return (Loss(subject, size), *force_losses(calibration))
