"""Exports of a calibration, one module per format; found by name as entry points."""

from __future__ import annotations

from labctl.exports.format import Format
from labctl.exports.registry import FORMATS, export_calibration, export_formats

__all__ = ["FORMATS", "Format", "export_calibration", "export_formats"]
