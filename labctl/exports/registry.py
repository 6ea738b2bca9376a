"""Every export format by name: register a new one here."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from labctl.calibration import Calibration, read_calibration
from labctl.errors import BadInput
from labctl.exports.c_header import c_header


@dataclass(frozen=True)
class Format:
    """A consumer's format: its title on a page, and the suffix of its files."""

    title: str
    media_type: str
    suffix: str
    write: Callable[[Calibration], bytes]


FORMATS: dict[str, Format] = {
    "json": Format("JSON", "application/json", "json", Calibration.to_bytes),
    "c": Format("C header", "text/x-c", "h", c_header),
}


def export_calibration(document: bytes, format_name: str) -> tuple[bytes, str]:
    """Return a calibration in a format, and its media type; raises BadInput for an unknown format."""
    if format_name not in FORMATS:
        raise BadInput(f"format {format_name!r} is not known (there are {', '.join(FORMATS)})")
    chosen = FORMATS[format_name]
    return chosen.write(read_calibration(document)), chosen.media_type
