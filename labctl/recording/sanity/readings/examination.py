"""All checks of readings, in order, and what one finding explains of another."""

from __future__ import annotations

import numpy as np

from labctl.recording.recording import Recording
from labctl.recording.sanity.readings.clock import check_clock, check_gaps
from labctl.recording.sanity.readings.constant import check_frozen, check_repeated
from labctl.recording.sanity.readings.limits import check_clipped, check_steps, check_thermometers
from labctl.recording.sanity.readings.lines import check_lines
from labctl.recording.sanity.readings.mixture import check_copies, check_devices, check_units
from labctl.recording.sanity.readings.series import Marked, Rows, Series, series_of
from labctl.recording.sanity.readings.sudden import check_moved, check_spikes

#: What a finding explains of others: of any rows, or of rows that it covers.
EXPLAINS = {
    "mixed_units": frozenset({"two_devices", "moved", "mains", "vibration", "clipped", "spikes"}),
    "two_devices": frozenset({"moved", "mains", "vibration", "clipped", "spikes", "copied"}),
    "quantised": frozenset({"mains", "vibration", "clipped", "repeated"}),
    "moved": frozenset({"mains", "vibration"}),
    "thermometer": frozenset({"spikes"}),
    "frozen": frozenset({"moved"}),
}
#: Findings that explain others of their own channel only.
OF_CHANNEL = frozenset({"thermometer", "frozen"})


def examine(recording: Recording) -> list[Marked]:
    """Return what is wrong with single readings, with the rows of each; nothing for means and tables."""
    series = series_of(recording)
    if series is None or not all(np.isfinite(values).all() for values in series.outputs.values()):
        return []
    return examined(series)


def examined(series: Series) -> list[Marked]:
    """Return what is wrong with the readings of a series."""
    frozen = list(check_frozen(series))
    repeated = list(check_repeated(series, _all(frozen, len(series))))
    clipped = list(check_clipped(series, _all(repeated, len(series))))
    found = [
        *check_clock(series), *check_gaps(series), *frozen, *repeated, *clipped, *check_thermometers(series),
        *check_steps(series),
        *check_units(series), *check_devices(series), *check_copies(series), *check_spikes(series),
        *check_moved(series), *check_lines(series),
    ]  # fmt: skip
    return [each for each in found if not _is_explained(each, found)]


def _all(found: list[Marked], n: int) -> Rows:
    return np.any([each.rows for each in found], axis=0) if found else np.zeros(n, dtype=bool)


def _is_explained(one: Marked, found: list[Marked]) -> bool:
    for other in found:
        if one.finding.what not in EXPLAINS.get(other.finding.what, frozenset()):
            continue
        if other.finding.what not in OF_CHANNEL or other.finding.channel == one.finding.channel:
            return True
    return False
