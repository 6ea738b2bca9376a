"""Exports of a calibration, one module per format; found by name as entry points."""

from __future__ import annotations

from labctl.exports.format import Format, Loss, Written
from labctl.exports.registry import FORMATS, export_calibration, export_formats, format_named, written_calibration

__all__ = [
    "FORMATS",
    "Format",
    "Loss",
    "Written",
    "export_calibration",
    "export_formats",
    "format_named",
    "written_calibration",
]
