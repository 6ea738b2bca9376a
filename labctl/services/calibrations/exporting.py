"""Calibrations in the formats of consumers, with what a format does not carry of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from labctl.calibration import read_calibration
from labctl.errors import BadInput, NotFound
from labctl.exports import Loss, format_named, written_calibration
from labctl.exports.noise.figures import DPS_RTHZ_PER_DEG_RTH, DPS_S_RTHZ_PER_DEG_H_RTH, RATE, WALK, WHITE
from labctl.json_types.noise import AllanJson
from labctl.services.recordings.allan import MOST_RECORDINGS, noise_of_recordings
from labctl.store import Store


@dataclass(frozen=True)
class Exported:
    """A calibration in a consumer's format, and what the format lost."""

    content: bytes
    media_type: str
    tag: str  #: of format and options, for the end of an ETag
    losses: tuple[Loss, ...] = ()


def exported(store: Store, document: bytes, format_name: str, options: Sequence[str] = ()) -> Exported:
    """Return a calibration document in a consumer's format. Options: lines KEY=VALUE.

    Raises BadInput for an unknown format or option, and for a calibration that the format cannot carry.
    """
    given = read_options(options, format_name)
    chosen = format_named(format_name)
    if chosen.needs_noise:
        given = {**_noise(store, document, chosen.options), **given}
    written = written_calibration(document, format_name, given)
    tag = "-".join([format_name, *(f"{key}={value}" for key, value in sorted(given.items()))])
    plain = "".join(char if char.isascii() and char.isprintable() and char not in '"\\' else "_" for char in tag)
    return Exported(written.content, chosen.media_type, plain, written.losses)


def read_options(lines: Sequence[str], format_name: str) -> dict[str, str]:
    """Return options by name from lines KEY=VALUE; raises BadInput for another form, or one that is given twice."""
    found: dict[str, str] = {}
    for line in lines:
        key, sign, value = (part.strip() for part in line.partition("="))
        if not (sign and key and value) or key in found:
            raise BadInput(f"format {format_name}: option {line!r}: give each option once, as KEY=VALUE")
        found[key] = value
    return found


def _noise(store: Store, document: bytes, wanted: Mapping[str, str]) -> dict[str, str]:
    """Return the noise of the unit as options, from the recording that its data sheet takes it from."""
    calibration = read_calibration(document)
    try:
        rows = store.recordings.of_unit(calibration.serial)
    except NotFound:  # a file of a unit that is not in this database
        return {}
    newest = sorted(rows, key=lambda row: row.id, reverse=True)[:MOST_RECORDINGS]
    answer = noise_of_recordings(store, newest)
    if answer is None:
        return {}
    found = noise_options([answer.axes[axis] for axis in calibration.axes if axis in answer.axes])
    return {key: value for key, value in found.items() if key in wanted}


def noise_options(axes: Sequence[AllanJson]) -> dict[str, str]:
    """Return the noise figures of a unit's axes as options of a format; without those that an axis lacks."""
    found: dict[str, str] = {}
    for name, figures, unit in (
        (WHITE, [axis["N"] for axis in axes], DPS_RTHZ_PER_DEG_RTH),
        (WALK, [axis["K"] for axis in axes], DPS_S_RTHZ_PER_DEG_H_RTH),
    ):
        values = [figure["value"] for figure in figures]
        if values and all(value is not None and value > 0 for value in values):
            found[name] = ",".join(f"{value * unit:.9e}" for value in values if value is not None)
    shortest = [axis["tau_s"][0] for axis in axes if axis["tau_s"]]
    if shortest and shortest[0]:
        found[RATE] = f"{1 / shortest[0]:.9g}"
    return found
