"""Every installed export format by name: the entry points of the group `labctl.exports`."""

from __future__ import annotations

from instruments.plugins import PluginError, PluginGroup, failure, instance_of
from labctl.calibration import read_calibration
from labctl.errors import BadInput, LabctlError
from labctl.exports.format import Format

FORMATS: PluginGroup[Format] = PluginGroup("labctl.exports", "export format", instance_of(Format))
#: The calibration file itself.
FIRST = "json"


def export_formats() -> dict[str, Format]:
    """Return the formats that can be used by name, the calibration file itself first."""
    return dict(sorted(FORMATS.all().items(), key=lambda each: each[0] != FIRST))


def export_calibration(document: bytes, format_name: str) -> tuple[bytes, str]:
    """Return a calibration in a format, and its media type; raises BadInput for one that cannot be used."""
    try:
        chosen = FORMATS.get(format_name)
    except PluginError as error:
        raise BadInput(f"format {format_name!r} is not known: {error}") from error
    calibration = read_calibration(document)
    try:
        return chosen.write(calibration), chosen.media_type
    except LabctlError:
        raise
    except Exception as error:
        raise BadInput(failure(FORMATS.plugin(format_name), "write this calibration", error)) from error
