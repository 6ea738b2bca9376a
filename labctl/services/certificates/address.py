"""Where a version is found by its address, for the QR code."""

from __future__ import annotations

from urllib.parse import quote

from labctl.store import CalibrationRecord


def address_of(url: str, row: CalibrationRecord) -> str:
    """Return the address of a version; without a laboratory's address the path alone."""
    return f"{url.rstrip('/')}/api/units/{quote(row.serial, safe='')}/calibration?version={row.version}"
