"""Faults of readings, made one by one with numpy alone: how many labctl finds, and what it says of clean records.

`LABCTL_STUDY_FORENSICS` is how many records of each kind are made; ten times as many are clean.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Collection
from datetime import UTC, datetime

import numpy as np

from labctl.recording import Recording, RecordingInfo
from labctl.recording.sanity import inspect_recording
from studies.forensics_records import AXES, FAULTS, Record, clean_record, faulty

RECORDS = int(os.environ.get("LABCTL_STUDY_FORENSICS", "20"))
#: What labctl may call a fault of each kind; a clock that is set on looks as readings that are missing, and a vibration
#: at the frequency at which the mains are seen looks as they do.
NAMES: dict[str, frozenset[str]] = {
    "frozen": frozenset({"frozen"}),
    "clipped": frozenset({"clipped"}),
    "moved_at_rest": frozenset({"moved", "moves_at_rest"}),
    "spikes": frozenset({"spikes"}),
    "dead_thermometer": frozenset({"thermometer"}),
    "quantised": frozenset({"quantised"}),
    "dropped": frozenset({"gaps"}),
    "repeated": frozenset({"repeated"}),
    "mixed_units": frozenset({"mixed_units"}),
    "two_devices": frozenset({"two_devices"}),
    "copied": frozenset({"copied"}),
    "hum": frozenset({"mains"}),
    "vibration": frozenset({"vibration", "mains"}),
    "time_back": frozenset({"time_back"}),
    "clock_step": frozenset({"clock_step", "gaps"}),
}


def recording_of(record: Record) -> Recording:
    """Return a made record as a recording, as an importer hands it over before it is checked."""
    info = RecordingInfo(
        serial="FORENSIC-1", axes=("x", "y", "z"), kind="samples", motion=record.motion,  # type: ignore[arg-type]
        started_at=datetime(2026, 1, 5, 8, tzinfo=UTC),
    )  # fmt: skip
    columns: dict[str, np.ndarray[tuple[int], np.dtype[np.generic]]] = {
        "dataset": record.dataset, "t_s": record.t_s, "temperature_c": record.temperature_c,
        "position": np.full(len(record), record.axis), "table_rate_dps": record.table_rate_dps,
        **{f"gyro_{axis}": record.gyro_dps[:, k] for k, axis in enumerate(AXES)},
    }  # fmt: skip
    return Recording(info, columns)


def said_of(record: Record) -> Counter[str]:
    """Return the kinds of findings of a record."""
    return Counter(finding.what for finding in inspect_recording(recording_of(record)))


def run(records: int = RECORDS, kinds: Collection[str] = tuple(FAULTS), clean: int | None = None) -> str:
    """Return a table: of each kind how many records, in how many it was found, and what else was said."""
    lines = [f"{'kind':18}{'records':>8}{'found':>7}{'share':>8}   also said"]
    for kind in kinds:
        said = [said_of(faulty(kind, seed)) for seed in range(1, records + 1)]
        found = sum(bool(NAMES[kind] & set(each)) for each in said)
        others = Counter(name for each in said for name in each if name not in NAMES[kind])
        lines.append(f"{kind:18}{records:8}{found:7}{100 * found / records:7.0f} %   {_words(others)}")
    number = 10 * records if clean is None else clean
    said = [said_of(clean_record(seed)) for seed in range(1, number + 1)]
    false = sum(bool(each) for each in said)
    lines.append(
        f"{'clean':18}{number:8}{false:7}{100 * false / max(number, 1):7.1f} %   {_words(sum(said, Counter()))}"
    )
    return "\n".join(lines)


def _words(counts: Counter[str]) -> str:
    return ", ".join(f"{name} {count}" for name, count in counts.most_common()) or "nothing"


if __name__ == "__main__":
    print(run())
