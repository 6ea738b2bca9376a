"""Recordings as a fit takes them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from labctl.answers.inspection import DataWarning
from labctl.errors import BadInput, NotEnoughData, NotFound
from labctl.recording import Recording, to_points
from labctl.recording.output_steps import per_reading
from labctl.recording.points import with_pieces
from labctl.recording.quantisation import QUANTISATION
from labctl.recording.sanity import Finding
from labctl.recording.verification import is_marked
from labctl.services.cache import UNNAMED, compute
from labctl.services.recordings.inspection import inspect_stored
from labctl.services.recordings.warnings import warning_of
from labctl.store import RecordingRow, Store

#: Recordings that are fitted together, at most.
MAX_TOGETHER = 32


def points_of(
    store: Store, row: RecordingRow, pieces: Callable[[], Mapping[int, Recording]] | None = None
) -> Recording:
    """Return a recording's means as a fit takes them: a long data set through which the temperature moved in pieces.

    Of turns they are integrals over the readings, which are few. Where the rate changes within data sets (motion
    "profile") every reading is returned: a fit needs the rate of each. `pieces` gives `to_points` of long data sets, by
    their numbers, where their readings are read for something else.
    """
    if is_profile(row):
        return store.recordings.samples(row.id)
    points = store.recordings.points(row.id, head=row)
    if row.kind != "samples":
        return points
    if points.info.motion == "turns":
        return to_points(store.recordings.samples(row.id))

    def pieces_of(dataset: int) -> Recording:
        kept = None if pieces is None else pieces().get(dataset)
        if kept is not None:
            return kept
        compute(UNNAMED)
        info = points.info.model_copy(update={"kind": "samples"})
        return to_points(Recording(info, store.recordings.dataset(row.id, dataset)))

    inspection = inspect_stored(store, row)
    return with_steps(with_pieces(points, pieces_of), inspection.dataset, inspection.quantisation_dps)


def source_of(store: Store, row: RecordingRow) -> Recording:
    """Return what a recording is fitted by: its means, or in poses, where it is turned between rests, its readings."""
    if motion_of(row) == "poses" and row.kind == "samples":
        return store.recordings.samples(row.id)
    return points_of(store, row)


def motion_of(row: RecordingRow) -> str:
    """Return what moved the unit."""
    return str(row.info.get("motion", "rates"))


def is_profile(row: RecordingRow) -> bool:
    """Return whether a recording holds readings whose rate changes within data sets."""
    return row.kind == "samples" and row.info.get("motion") == "profile"


def with_steps(
    points: Recording, numbers_of_sets: Sequence[int], quantisation_dps: Mapping[str, Sequence[float]]
) -> Recording:
    """Return means with a column for what coarse steps of an output leave in them, where they do.

    `quantisation_dps` is that of each axis, by data set.
    """
    if not quantisation_dps:
        return points
    columns = dict(points.columns)
    numbers, dataset = np.asarray(numbers_of_sets), np.asarray(columns["dataset"], dtype=np.int64)
    for axis, u_dps in quantisation_dps.items():
        output_unit = next((output_unit for name, output_unit in points.info.output.items() if name == axis), None)
        scale = abs(output_unit.scale) if output_unit else 1.0
        columns[f"gyro_{axis}{QUANTISATION}"] = per_reading(dataset, numbers, scale * np.asarray(u_dps))
    return replace(points, columns=columns)


def newest_row(
    store: Store, serial: str, recording: int | None, *, other_unit: bool = False, to_fit: bool = False
) -> RecordingRow:
    """Return the recording asked for, or the unit's newest in which something was measured.

    With `to_fit` the newest in which something was measured that is fitted, if the unit has one. It must be a recording
    of the unit, unless `other_unit`. Raises NotFound, NotEnoughData where no data set is complete yet.
    """
    store.units.get(serial)
    rows = store.recordings.of_unit(serial) if recording is None else [store.recordings.get(recording)]
    if not rows:
        raise NotFound(f"unit {serial!r} has no recording; `labctl import DIR` or a campaign creates a recording")
    measured = [row for row in rows if _measured(row)]
    fitted = (row for row in measured if to_fit and recording is None and not is_to_verify(store, row))
    row = next(fitted, next(iter(measured), rows[0]))
    if row.serial != serial and not other_unit:
        raise NotFound(
            f"recording {recording} is of unit {row.serial!r}, not of {serial!r}; name another recording, or "
            "give --other-unit"
        )
    if not _measured(row):
        raise NotEnoughData(
            f"recording {row.id} of unit {serial!r} has no complete data set yet; wait for its first data set, "
            "or name another recording"
        )
    return row


def chosen_rows(
    store: Store, serial: str, recording: int | None, recordings: Sequence[int] = (), *, other_unit: bool = False
) -> tuple[RecordingRow, ...]:
    """Return the recordings asked for, several or one, rising; else the unit's newest that can be fitted.

    Where that one belongs to a diagnosis, all recordings of the diagnosis: an experiment measures a few points, which
    say something beside the recordings that it was chosen for, and rarely determine a model alone.

    Raises BadInput where both are given and differ, and what `newest_row` raises.
    """
    numbers = sorted(set(recordings))
    if recording is not None and numbers and numbers != [recording]:
        raise BadInput(
            f"recording {recording} and recordings {', '.join(map(str, numbers))} were both requested: give "
            "one of the two"
        )
    if len(numbers) > MAX_TOGETHER:
        raise BadInput(
            f"{len(numbers)} recordings were given, but at most {MAX_TOGETHER} can be fitted together; name fewer"
        )
    if not numbers and recording is None:
        newest = newest_row(store, serial, None, to_fit=True)
        numbers = _of_diagnosis(store, newest)
        if len(numbers) < 2:
            return (newest,)
    if len(numbers) < 2:
        one = numbers[0] if numbers else recording
        return (newest_row(store, serial, one, other_unit=other_unit, to_fit=True),)
    return tuple(newest_row(store, serial, number, other_unit=other_unit) for number in numbers)


def _of_diagnosis(store: Store, newest: RecordingRow) -> list[int]:
    """Return the recordings of the newest diagnosis with an experiment that a recording belongs to, rising."""
    for diagnosis in store.diagnoses.of_unit(newest.serial):
        measured = [
            each.recording
            for each in store.diagnoses.rounds(diagnosis.id)
            if each.recording is not None and each.came == "measured"
        ]
        together = sorted({*diagnosis.recordings, *measured})
        if measured and newest.id in together:
            return together[-MAX_TOGETHER:]
    return []


def is_to_verify(store: Store, row: RecordingRow) -> bool:
    """Return whether all that was measured in a recording was measured to verify a calibration, so that none is fitted.

    False where nothing was measured yet.
    """
    if row.kind == "samples":
        sets = [
            data_set for data_set in store.recordings.data_sets(row.id) if data_set.state == "complete" and data_set.n
        ]
        return bool(sets) and all(each.verification for each in sets)
    marked = is_marked(store.recordings.points(row.id, head=row)) if row.kind == "points" else np.zeros(0)
    return bool(len(marked) and marked.all())


def passed_over(
    store: Store, rows: Sequence[RecordingRow], recording: int | None, recordings: Sequence[int] = ()
) -> list[DataWarning]:
    """Return a warning for the recordings that `chosen_rows` passed over: newer than its choice, and only to verify.

    `recording` and `recordings` are what was asked for; none is passed over where they name any.
    """
    if recording is not None or recordings:
        return []
    chosen = rows[-1]
    newer = [row for row in store.recordings.of_unit(chosen.serial) if row.id > chosen.id and _measured(row)]
    passed = [row.id for row in reversed(newer) if is_to_verify(store, row)]
    if not passed:
        return []
    named = f"recording {passed[0]}" if len(passed) == 1 else f"recordings {', '.join(map(str, passed))}"
    finding = Finding(
        "passed_over", "likely", named, f"measured only to verify a calibration, so recording {chosen.id} was used",
        None, "", "data sets that a fit takes in", "name another recording with --recording ID",
    )  # fmt: skip
    return [warning_of(finding)]


def readings_question(store: Store, rows: Sequence[RecordingRow]) -> dict[str, object]:
    """Return what an answer about recordings depends on."""
    readings = [store.recordings.fingerprint(row.id, head=row) for row in rows]
    if len(rows) == 1:
        return {"recording": rows[0].id, "readings": readings[0]}
    return {"recordings": [row.id for row in rows], "readings": readings}


def _measured(row: RecordingRow) -> bool:
    return row.kind != "samples" or row.datasets > 0
