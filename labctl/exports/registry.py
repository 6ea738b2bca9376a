"""Every installed export format by name: the entry points of the group `labctl.exports`."""

from __future__ import annotations

from collections.abc import Mapping

from instruments.plugins import PluginError, PluginGroup, failure, instance_of
from labctl.calibration import read_calibration
from labctl.errors import BadInput, LabctlError
from labctl.exports.format import Format, Written

FORMATS: PluginGroup[Format] = PluginGroup("labctl.exports", "export format", instance_of(Format))
#: The calibration file itself.
FIRST = "json"


def export_formats() -> dict[str, Format]:
    """Return the formats that can be used by name, the calibration file itself first."""
    return dict(sorted(FORMATS.all().items(), key=lambda each: each[0] != FIRST))


def format_named(format_name: str) -> Format:
    """Return a format; raises BadInput for one that cannot be used."""
    try:
        return FORMATS.get(format_name)
    except PluginError as error:
        raise BadInput(f"format {format_name!r} is not known: {error}") from error


def export_calibration(document: bytes, format_name: str) -> tuple[bytes, str]:
    """Return a calibration in a format, and its media type; raises BadInput for one that cannot be used."""
    return written_calibration(document, format_name).content, format_named(format_name).media_type


def written_calibration(document: bytes, format_name: str, options: Mapping[str, str] | None = None) -> Written:
    """Return a calibration in a format with what was lost; raises BadInput for a format or option that is not known."""
    export_format = format_named(format_name)
    stated_options = dict(options or {})
    unknown = sorted(set(stated_options) - set(export_format.options))
    if unknown:
        option_names = ", ".join(export_format.options) or "none"
        raise BadInput(
            f"format {format_name}: option {unknown[0]!r} is not known; options of this format: {option_names}"
        )
    calibration = read_calibration(document)
    try:
        file_bytes = (
            export_format.write(calibration, stated_options)
            if export_format.options
            else export_format.write(calibration)
        )
    except LabctlError:
        raise
    except Exception as error:
        raise BadInput(failure(FORMATS.plugin(format_name), "write this calibration", error)) from error
    return file_bytes if isinstance(file_bytes, Written) else Written(file_bytes)
