"""Recordings written to a storage in the interchange format, for workers that read them there."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from labctl.answers.fleet import FleetPublishRequest, FleetPublishResponse, FleetUnpublished
from labctl.errors import LabctlError
from labctl.progress import report_stage
from labctl.recording.files import ENVIRONMENT, HEAD, head_of
from labctl.recording.object_storage import ObjectStorage
from labctl.recording.recording import Columns
from labctl.services.fleet.figures import filter_of
from labctl.services.fleet.source import published_name
from labctl.services.recordings.loading import chosen_rows
from labctl.services.recordings.staging import staging_folder
from labctl.store import PublishedReadings, RecordingRow, Store

#: Written last: the recording's fingerprint and the size of each file.
CONTENTS = "published.json"
MAX_CONTENTS_BYTES = 1 << 16
UNITS_AT_ONCE = 200


@dataclass
class _Written:
    """What was written so far."""

    written: int = 0
    unchanged: int = 0
    size_bytes: int = 0


def publish(store: Store, request: FleetPublishRequest) -> FleetPublishResponse:
    """Write the recordings that a job over these units reads to a storage, and those that are there unchanged not.

    Every file is compared with the digests of the database before it is written. A unit that cannot be published has
    its reason in the response. Raises BadInput where the storage cannot be used, NotFound where no unit matches.
    """
    storage, so_far = ObjectStorage(request.url), _Written()
    units, failed = 0, list[FleetUnpublished]()
    for serial in _serials(store, request):
        units += 1
        report_stage(f"publishing unit {units}, {serial}")
        try:
            rows = _read_by_jobs(store, serial)
        except LabctlError as error:
            failed.append(FleetUnpublished(serial=serial, reason=str(error)))
            continue
        for row in rows:
            with staging_folder() as folder:
                try:
                    files = _files_of(store, storage, row, folder, again=request.again)
                except LabctlError as error:
                    failed.append(FleetUnpublished(serial=serial, reason=str(error)))
                    break
                _put(storage, row, files, so_far)
    if not units:
        raise filter_of(request).no_match()
    return FleetPublishResponse(url=storage.url, units=units, failed=failed, **vars(so_far))


def _serials(store: Store, request: FleetPublishRequest) -> Iterator[str]:
    serials = store.fleet.serials(filter_of(request), "", UNITS_AT_ONCE)
    while serials:
        yield from serials
        serials = store.fleet.serials(filter_of(request), serials[-1], UNITS_AT_ONCE)


def _read_by_jobs(store: Store, serial: str) -> list[RecordingRow]:
    """Return the recordings that a job reads of a unit: those that it chooses, and the newer ones that it examines."""
    chosen = chosen_rows(store, serial, None)
    numbers = {row.id for row in chosen}
    newer = [row for row in store.recordings.of_unit(serial) if row.id > max(numbers)]
    return [*chosen, *(row for row in newer if row.kind == "points")]  # of readings, rows say what they verify


def _files_of(
    store: Store, storage: ObjectStorage, row: RecordingRow, folder: Path, *, again: bool
) -> dict[str, Path] | None:
    """Write the files of a recording into a folder, by their names; None: the storage has them already.

    Raises BadRecording for one that is not as the database has it when it is read back.
    """
    fingerprint = store.recordings.fingerprint(row.id, head=row)
    if not again and _is_there(storage, row, fingerprint, folder):
        return None
    from labctl.recording.data_files import write_table  # noqa: PLC0415  0.2 s that only files need
    from labctl.recording.data_files.row_ranges import write_parts  # noqa: PLC0415  as above

    info, data = row.recording_info, f"{row.kind}.parquet"
    (folder / HEAD).write_bytes(head_of(info))
    write_parts(_parts(store, row), folder / data)
    environment = store.recordings.environment(row.id)
    if environment:
        write_table(environment, folder / f"{ENVIRONMENT}.parquet")
    names = [HEAD, data, *([f"{ENVIRONMENT}.parquet"] if environment else [])]
    with staging_folder() as beside:
        copies = PublishedReadings(_copy_from(folder), beside, lambda _recording, file: file)
        store.reading_from(copies).recordings.check_readings(row.id)
    sizes = {name: (folder / name).stat().st_size for name in names}
    contents = {"recording": row.id, "serial": row.serial, "fingerprint": fingerprint, "bytes": sizes}
    (folder / CONTENTS).write_text(json.dumps(contents, indent=2))
    return {name: folder / name for name in (*names, CONTENTS)}


def _copy_from(folder: Path) -> Callable[[int, str, Path, int], None]:
    def copy(_recording: int, file: str, target: Path, _max_bytes: int) -> None:
        shutil.copyfile(folder / file, target)

    return copy


def _parts(store: Store, row: RecordingRow) -> Iterator[Columns]:
    """Yield the readings of each data set, or the table that was imported."""
    if row.kind != "samples":
        yield store.recordings.points(row.id, head=row).columns
        return
    for _, columns in store.recordings.iter_datasets(row.id, times=True):
        yield columns


def _is_there(storage: ObjectStorage, row: RecordingRow, fingerprint: str, folder: Path) -> bool:
    """Whether a storage has a recording as it is now: by what was written last, and the sizes of its files."""
    try:
        storage.fetch(published_name(row.id, CONTENTS), folder / CONTENTS, MAX_CONTENTS_BYTES)
        contents = json.loads((folder / CONTENTS).read_bytes())
    except (LabctlError, ValueError):
        return False
    sizes = contents.get("bytes") if isinstance(contents, dict) else None
    if not isinstance(sizes, Mapping) or contents.get("fingerprint") != fingerprint:
        return False
    return bool(sizes) and all(storage.size(published_name(row.id, str(name))) == sizes[name] for name in sizes)


def _put(storage: ObjectStorage, row: RecordingRow, files: Mapping[str, Path] | None, so_far: _Written) -> None:
    """Write the files of a recording to a storage. Raises BadInput."""
    if files is None:
        so_far.unchanged += 1
        return
    for name, path in files.items():
        storage.put(published_name(row.id, name), path)
        so_far.size_bytes += path.stat().st_size
    so_far.written += 1
