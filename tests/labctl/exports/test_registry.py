"""Formats of a calibration, by name."""

from __future__ import annotations

import pytest

from labctl.calibration import Calibration
from labctl.errors import BadInput
from labctl.exports import export_calibration


def test_unknown_formats_are_named(fog: Calibration) -> None:
    with pytest.raises(BadInput, match="format 'pdf' is not known"):
        export_calibration(fog.to_bytes(), "pdf")
