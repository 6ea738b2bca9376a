"""The calibration file itself, as a format."""

from __future__ import annotations

from labctl.calibration import Calibration
from labctl.exports.format import Format

FORMAT = Format("JSON", "application/json", "json", Calibration.to_bytes)
