"""Exports of a calibration, one module per format; `registry.py` lists them by name."""

from __future__ import annotations

from labctl.exports.registry import FORMATS, Format, export_calibration

__all__ = ["FORMATS", "Format", "export_calibration"]
