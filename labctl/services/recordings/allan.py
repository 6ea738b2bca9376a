"""The Allan deviation of a recording: of its static record, or of one data set."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from labctl.answers.recordings import AllanResponse
from labctl.errors import BadInput, NotEnoughData
from labctl.fitting.data.static_record import StaticRecord, longest_stretch, static_record
from labctl.fitting.numeric.allan import MIN_READINGS, allan
from labctl.progress import report_stage
from labctl.recording import Columns, Recording, RecordingInfo
from labctl.recording.recording import temperature_of
from labctl.services.cache import cached
from labctl.store import RecordingRow, Store

#: Of a unit with many recordings the newest are used.
MAX_RECORDINGS = 32
#: What a static record is looked for in, beside the outputs.
NEEDED = ("dataset", "t_s", "run", "mounting", "position", "table_rate_dps", "temperature_c", "chamber_c", "valid")


def allan_unit(store: Store, recording: int, dataset: int | None) -> AllanResponse:
    """Return the Allan deviation of a data set, or of the longest section at rest and at one temperature.

    Its figures enter performance sheets and the uncertainty in use, so the section has no data set that was measured
    to verify a calibration; one of these can be asked for by its number.

    Raises NotFound, BadInput for a recording without readings, NotEnoughData.
    """
    head = store.recordings.get(recording)
    if head.kind != "samples":
        raise BadInput(
            f"recording {recording} holds {head.kind}: an Allan deviation needs single readings; name a recording of "
            "readings"
        )
    info = head.recording_info
    if info.motion == "poses":
        raise BadInput(
            f"recording {recording} is of poses (turned by hand between rests), from which no Allan deviation "
            "can be computed; import one long rest of it with motion = 'rest'"
        )

    def work() -> AllanResponse:
        if dataset is None:
            return _response(recording, _at_rest(store, recording, info), info)
        return _response(recording, _of_set(valid_part(store, recording, dataset), dataset), info)

    question = {"recording": recording, "readings": store.recordings.fingerprint(recording), "dataset": dataset}
    return cached(AllanResponse, question, work)


def noise_of_recordings(store: Store, rows: Sequence[RecordingRow]) -> AllanResponse | None:
    """Return the Allan deviation of the recording with the longest data set at rest; None where none has one.

    Performance sheets and exports take their N, B and K from here, so that both state the same.
    """
    at_rest = [(_longest_rest(store, row), row) for row in rows if row.kind == "samples"]
    for readings, row in sorted(at_rest, key=lambda each: each[0], reverse=True):
        if not readings:
            break
        report_stage(f"noise of recording {row.id}")
        try:
            return allan_unit(store, row.id, None)
        except (BadInput, NotEnoughData):
            continue
    return None


def _longest_rest(store: Store, row: RecordingRow) -> int:
    sets = store.recordings.data_sets(row.id)
    still = [each for each in sets if each.state == "complete" and each.table_rate_dps == 0 and not each.verification]
    return max((each.n for each in still), default=0)


def _response(recording: int, record: StaticRecord, info: RecordingInfo) -> AllanResponse:
    answer = {"recording": recording, "datasheet": dict(info.datasheet), **record.to_json()}
    return AllanResponse.model_validate(answer, extra="forbid")


def rest_of(store: Store, recording: int) -> Recording:
    """Return the readings of the longest section at rest that is fitted: what `allan_unit` takes without a data set.

    Raises NotFound, NotEnoughData.
    """
    info = store.recordings.get(recording).recording_info
    _, still = _still(store, recording)
    parts = [_needed(info, store.recordings.dataset(recording, number)) for number in still]
    together = Recording(info, _joined(parts)) if parts else None
    rows = None if together is None else longest_stretch(together)
    if together is None or rows is None:
        raise NotEnoughData(f"recording {recording} has no section at rest; name a data set")
    return Recording(info, {name: values[rows] for name, values in together.columns.items()})


def valid_part(store: Store, recording: int, dataset: int) -> Recording:
    """Return the valid readings of a data set; raises NotFound, NotEnoughData where they are too few."""
    info = store.recordings.get(recording).recording_info
    columns = store.recordings.dataset(recording, dataset)
    if "valid" in columns:
        valid = np.asarray(columns["valid"]) != 0
        columns = {name: values[valid] for name, values in columns.items()}
    if len(columns["t_s"]) < MIN_READINGS:
        raise NotEnoughData(
            f"data set {dataset} has {len(columns['t_s'])} valid readings; name a data set with {MIN_READINGS} or more"
        )
    return Recording(info, columns)


def _of_set(recording: Recording, dataset: int) -> StaticRecord:
    columns = recording.columns
    t_s = np.asarray(columns["t_s"], dtype=np.float64)
    period_s = float((t_s[-1] - t_s[0]) / (len(t_s) - 1))
    deviations = {str(axis): allan(recording.gyro_dps(axis), period_s) for axis in recording.info.axes}
    axes = {axis: noise for axis, noise in deviations.items() if noise is not None}
    if not axes:
        raise NotEnoughData(
            f"data set {dataset}: its readings are all equal, so their noise is unknown; name another data set"
        )
    temperature_c = temperature_of(columns)
    mean_c = float(temperature_c.mean()) if temperature_c is not None else np.nan
    return StaticRecord(dataset, dataset, mean_c, len(t_s) * period_s, axes)


class StillReadings:
    """Collects of a recording, while its readings are read for something else, those that its static record needs."""

    def __init__(self, store: Store, row: RecordingRow) -> None:
        self._info = row.recording_info
        _, still = _still(store, row.id)
        self._still, self._parts = set(still), list[Columns]()

    def add(self, number: int, columns: Columns) -> None:
        """Keep what is needed of the readings of a data set, in the order of measurement."""
        if number in self._still:
            self._parts.append(_needed(self._info, columns))

    def record(self) -> StaticRecord | None:
        """Return the longest section at rest of what is fitted, as `allan_unit` states it; None: there is none."""
        return _together(self._info, self._parts) if self._parts else None


def _still(store: Store, recording: int) -> tuple[int, list[int]]:
    """Return how many data sets were measured at rest, and the numbers of those that are fitted."""
    rows = store.recordings.data_sets(recording)
    at_rest = [row for row in rows if row.state == "complete" and row.n and row.table_rate_dps == 0]
    return len(at_rest), [row.number for row in at_rest if not row.verification]


def _static_record(store: Store, recording: int, info: RecordingInfo, still: Sequence[int]) -> StaticRecord | None:
    return _together(info, [_needed(info, store.recordings.dataset(recording, number)) for number in still])


def _needed(info: RecordingInfo, columns: Columns) -> Columns:
    names = (*NEEDED, *(f"gyro_{axis}" for axis in info.axes))
    return {name: columns[name] for name in names if name in columns}


def _together(info: RecordingInfo, parts: Sequence[Columns]) -> StaticRecord | None:
    return static_record(Recording(info, _joined(parts)))


def _joined(parts: Sequence[Columns]) -> Columns:
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def _at_rest(store: Store, recording: int, info: RecordingInfo) -> StaticRecord:
    """Return the static record, looked for only in what was measured at rest: the rest of the readings stay unread."""
    at_rest, still = _still(store, recording)
    record = None if not still else _static_record(store, recording, info, still)
    if record is not None:
        return record
    aside = at_rest - len(still)
    beside = f" beside the {aside} data sets at rest that were measured to verify a calibration" if aside else ""
    raise NotEnoughData(
        f"recording {recording} has no section of {MIN_READINGS} readings at rest and at one temperature{beside}; "
        "name a data set, or record the unit at rest"
    )
