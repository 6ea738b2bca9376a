"""Measurements of one recording, or of several as one, as fits and criticism use them: read from the store once."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from instruments.configuration import changed
from labctl.answers.inspection import DataWarning, RecordingInspection
from labctl.errors import BadInput
from labctl.fitting.data.covered import Covered
from labctl.fitting.data.fit_data import refuse_poses
from labctl.fitting.data.joined import joined_coverage, joined_recording
from labctl.fitting.data.static_record import StaticRecord
from labctl.progress import report_stage
from labctl.recording import Recording
from labctl.recording.columns import OWN_DATASET, RECORDING
from labctl.recording.info import GIVE_DATE, measured_at
from labctl.recording.output_steps import per_reading, quantisation_of
from labctl.services.criticism.decimated_readings import (
    Decimated,
    ReadRecording,
    is_decimated,
    read_recording_of,
)
from labctl.services.recordings.coverage import covered_of
from labctl.services.recordings.inspection import inspect_stored
from labctl.services.recordings.loading import (
    chosen_rows,
    motion_of,
    passed_over,
    points_of,
    readings_question,
    source_of,
)
from labctl.store import RecordingRow, Store


@dataclass(frozen=True)
class Measurements:
    """One recording of the store, or several; means and readings are read when they are first used."""

    store: Store
    rows: tuple[RecordingRow, ...]  #: by number, rising
    decimated: Decimated | None = None  #: gives readings that are being read beside this process
    newer: tuple[DataWarning, ...] = ()  #: of recordings that were passed over

    @property
    def row(self) -> RecordingRow:
        """The recording; of several the newest."""
        return self.rows[-1]

    @property
    def recordings(self) -> tuple[int, ...]:
        """The numbers of all of them, rising."""
        return tuple(row.id for row in self.rows)

    @property
    def named(self) -> str:
        """The recordings in words."""
        return recordings_text(self.recordings)

    @cached_property
    def of_each(self) -> Mapping[int, Recording]:
        """The means of each recording, by its number."""
        return {row.id: points_of(self.store, row, self._pieces_of(row)) for row in self.rows}

    def _pieces_of(self, row: RecordingRow) -> Callable[[], Mapping[int, Recording]] | None:
        """Return what gives the means of long data sets, where their readings are being read for this anyway."""
        decimated = self.decimated
        if decimated is None or not is_decimated(row):
            return None
        return lambda: decimated(row).pieces

    @cached_property
    def points(self) -> Recording:
        """The means as a fit takes them, one row per data set or piece of a long one. Raises BadInput."""
        return joined_recording(self.of_each)

    @property
    def newest(self) -> Measurements:
        """The newest of several recordings; itself where there is one."""
        return self if len(self.rows) == 1 else Measurements(self.store, (self.row,))

    @property
    def source(self) -> Recording:
        """What a fit takes: the means, or of one recording in poses its readings. Raises BadInput."""
        is_by_hand = len(self.rows) == 1 and motion_of(self.row) == "poses"
        return source_of(self.store, self.row) if is_by_hand else self.points

    @cached_property
    def inspections(self) -> Mapping[int, RecordingInspection]:
        """What is wrong with each recording, and what its readings cover, by its number."""
        return {row.id: inspect_stored(self.store, row) for row in self.rows}

    @cached_property
    def warnings(self) -> list[DataWarning]:
        """What is wrong with the data that are fitted; of several recordings each says which.

        What is wrong with data sets that were measured to verify is an objection to certifying a version.
        """
        found_in = {
            n: [w for w in inspection.warnings if w.part == "fitted"] for n, inspection in self.inspections.items()
        }
        if len(self.rows) == 1:
            return [*found_in[self.row.id], *self.newer]
        return [
            warning.model_copy(
                update={"where": f"recording {n}, {warning.where}", "text": f"recording {n}: {warning.text}"}
            )
            for n, inspection in found_in.items()
            for warning in inspection
        ] + [*undated_warnings(self.rows), *other_settings_warnings(self.rows)]

    @property
    def covered(self) -> Covered | None:
        """The range of the readings behind the means; None where it is not known."""
        return joined_coverage(
            [
                covered_of(self.inspections[row.id], self.of_each[row.id]) if row.kind == "samples" else None
                for row in self.rows
            ]
        )

    @cached_property
    def readings(self) -> Recording:
        """The readings at no more than criticism needs; the means where there are no readings. Raises BadInput."""
        report_stage("reading the recording" if len(self.rows) == 1 else f"reading {self.named}")
        return joined_recording(
            {row.id: _reduced_readings(self.of_each[row.id], self._read.get(row.id)) for row in self.rows}
        )

    @cached_property
    def _read(self) -> Mapping[int, ReadRecording]:
        """What was read of each recording of which a criticism takes decimated readings."""
        for row in self.rows:
            refuse_unmeasured(row, self.of_each[row.id])
        decimated_rows = [row for row in self.rows if is_decimated(row)]
        return {
            row.id: read_recording_of(self.store, row) if self.decimated is None else self.decimated(row)
            for row in decimated_rows
        }

    @property
    def is_decimated(self) -> bool:
        """Whether the readings are averages, so that only `static` has the noise of single ones."""
        return bool(self._read)

    @cached_property
    def static(self) -> StaticRecord | None:
        """The longest static record by all readings, data sets as `readings` numbers them; None: there is none."""
        static_records = [(number, read.static) for number, read in self._read.items() if read.static is not None]
        if not static_records:
            return None
        recording, longest = max(static_records, key=lambda static_record: static_record[1].duration_s)
        columns = self.readings.columns
        if RECORDING not in columns:
            return longest
        own_numbers = np.asarray(columns[OWN_DATASET])[np.asarray(columns[RECORDING]) == recording]
        joined = np.asarray(columns["dataset"])[np.asarray(columns[RECORDING]) == recording]
        first, last = (int(joined[own_numbers == n][0]) for n in (longest.first_dataset, longest.last_dataset))
        return replace(longest, first_dataset=first, last_dataset=last)

    def question(self) -> dict[str, object]:
        """Return what an answer about these measurements depends on."""
        passed = {"passed_over": [each.where for each in self.newer]} if self.newer else {}
        return {**readings_question(self.store, self.rows), **passed}


def measurements_of(
    store: Store, serial: str, recording: int | None, recordings: Sequence[int] = (), *, other_unit: bool = False
) -> Measurements:
    """Return the measurements that were asked for, as `chosen_rows` does; says which newer ones were passed over."""
    rows = chosen_rows(store, serial, recording, recordings, other_unit=other_unit)
    return Measurements(store, rows, newer=tuple(passed_over(store, rows, recording, recordings)))


def undated_warnings(rows: Sequence[RecordingRow]) -> Iterator[DataWarning]:
    """Yield that the order of recordings is not known, where some of several have no date of measurement."""
    undated = tuple(row.id for row in rows if measured_at(row.info) is None)
    if not undated or len(rows) < 2:
        return
    named = recordings_text(undated)
    text = f"{named} {'have' if len(undated) > 1 else 'has'} no date of measurement, so their order is not known"
    yield DataWarning(
        what="date", severity="likely", where=named, said=text, value=None, unit="",
        expected="a date of measurement of each recording", do=GIVE_DATE,
        text=f"{text}, and no trend over the recordings is looked for; {GIVE_DATE}",
    )  # fmt: skip


def other_settings_warnings(rows: Sequence[RecordingRow]) -> Iterator[DataWarning]:
    """Yield that the unit was set otherwise in one of several recordings than in the first one that says how."""
    configurations = [(row.id, row.recording_info.configuration) for row in rows]
    first, *others = [configuration for configuration in configurations if configuration[1]] or [(0, {})]
    for number, settings in others:
        if differs := changed(first[1], settings):
            sentence = ", ".join(f"{name} was {was} and is {now}" for name, (was, now) in differs.items())
            text = f"the unit is set otherwise than in recording {first[0]}: {sentence}"
            do = "fit the recordings of each setting by themselves"
            yield DataWarning(
                what="configuration", severity="likely", where=f"recording {number}", said=text, value=None, unit="",
                expected="one setting of the unit", do=do, text=f"recording {number}: {text}; {do}",
            )  # fmt: skip


def recordings_text(recordings: tuple[int, ...]) -> str:
    """Return "recording 3" or "recordings 1, 2 and 3"."""
    *first, last = map(str, recordings)
    return f"recordings {', '.join(first)} and {last}" if first else f"recording {last}"


def refuse_unmeasured(row: RecordingRow, points: Recording) -> None:
    """Raise BadInput for a table of coefficients, which holds no measurement, and for readings in poses."""
    if row.kind == "coefficients":
        raise BadInput(
            f"recording {row.id} is a table of coefficients, but a model is compared with measurements; name a "
            "recording of readings or means"
        )
    if row.kind == "samples":
        refuse_poses(points.info)


def _reduced_readings(points: Recording, read: ReadRecording | None) -> Recording:
    """Return a recording's readings, decimated data set by data set; `points`, its means, where it has none."""
    if read is None:
        return points
    columns = dict(read.columns)
    for name, values in quantisation_of(points).items():  # decimated readings do not show their steps any more
        numbers = np.asarray(points.columns["dataset"], dtype=np.int64)
        columns[name] = per_reading(np.asarray(columns["dataset"], dtype=np.int64), numbers, values)
    return Recording(points.info.model_copy(update={"kind": "samples"}), columns, points.environment)
