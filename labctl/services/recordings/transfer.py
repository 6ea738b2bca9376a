"""Import and export of recordings in the interchange format."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import IO, BinaryIO, Literal
from zipfile import ZIP_DEFLATED, ZIP_STORED, ZipFile

from labctl.answers.recordings import ImportResponse
from labctl.errors import BadRecording
from labctl.fitting.estimation.suggestion import suggested_model
from labctl.recording import Recording, read_recording, write_recording
from labctl.recording.files import FILE_NAMES
from labctl.recording.info import NO_DATE
from labctl.recording.verification import is_marked
from labctl.services.recordings.inspection import inspect_stored
from labctl.services.recordings.loading import points_of
from labctl.services.recordings.staging import staging_folder
from labctl.store import RecordingRow, Store

CHUNK_BYTES = 1 << 20
#: CSV shrinks to a fifth at the quickest; Parquet is packed already.
EFFORT = 1


def import_folder(store: Store, folder: Path, at: datetime) -> ImportResponse:
    """Import a recording from a folder; all of it or nothing. Raises BadRecording."""
    recording = _ordered(read_recording(folder), at)
    is_new = not store.units.has(recording.info.serial)
    number = store.recordings.add_import(recording, at)
    row = store.recordings.get(number)
    readings = row.readings if recording.info.kind == "samples" else len(recording)
    datasets = 0 if recording.info.kind == "coefficients" else row.datasets
    return ImportResponse(
        serial=row.serial,
        recording=number,
        datasets=datasets,
        readings=readings,
        suggested_model=model_for(store, row),
        measured_at=recording.info.measured_at,
        warnings=inspect_stored(store, row, recording).warnings,
        left_out=list(recording.info.left_out),
        new_unit=is_new,
        similar_unit=store.units.most_similar(row.serial) if is_new else None,
    )


def _ordered(recording: Recording, at: datetime) -> Recording:
    """Return a recording without a date with the time of its import in its place, which only orders recordings."""
    if recording.info.date_known or recording.info.started_at != NO_DATE:
        return recording
    return replace(recording, info=recording.info.model_copy(update={"started_at": at}))


def model_for(store: Store, row: RecordingRow) -> str:
    """Return the fullest published model that a stored recording determines."""
    if row.kind == "samples" and not row.datasets:
        return "bias"
    points = points_of(store, row)
    if len(points) and is_marked(points).all():
        return "bias"  # all of it verifies, and is fitted by no model
    return suggested_model(points)


def import_files(
    files: Sequence[tuple[str, BinaryIO]], import_from: Callable[[Path], ImportResponse]
) -> ImportResponse:
    """Import a recording from uploaded files; their names may only be the format's. Raises BadRecording.

    `import_from` imports the folder that they are written to.
    """
    names = [name for name, _ in files]
    for name in names:
        if name not in FILE_NAMES:
            raise BadRecording(f"file {name!r} is not part of a recording; send only {', '.join(sorted(FILE_NAMES))}")
        if names.count(name) > 1:
            raise BadRecording(f"file {name!r} was sent more than once; send it once")
    with staging_folder() as folder:
        for name, content in files:
            with (folder / name).open("wb") as target:
                shutil.copyfileobj(content, target)
        try:
            return import_from(folder)
        except BadRecording as error:
            raise BadRecording(str(error).replace(f"{folder}/", "")) from None


def export_recording(
    store: Store, recording: int, folder: Path, file_format: Literal["parquet", "csv"], *, points: bool = False
) -> list[str]:
    """Write a recording, or its points (one row per data set), into a new folder; returns the names of its files."""
    columns = store.recordings.points(recording) if points else store.recordings.samples(recording, times=True)
    return write_recording(columns, folder, file_format)


@dataclass(frozen=True)
class Download:
    """A file without a name on the disk: it goes when it is closed, or with the process."""

    name: str
    size: int
    content: IO[bytes]

    def chunks(self) -> Iterator[bytes]:
        """Yield the bytes, then close the file; also when the reader disconnects."""
        with self.content:
            while chunk := self.content.read(CHUNK_BYTES):
                yield chunk


def zip_recording(store: Store, recording: int, file_format: Literal["parquet", "csv"]) -> Download:
    """Return a recording in the interchange format as a zip with one folder. Raises NotFound."""
    name = f"recording-{recording}"
    with staging_folder() as made:
        folder = made / name
        written = export_recording(store, recording, folder, file_format)
        target = tempfile.TemporaryFile(prefix="labctl-export-")  # noqa: SIM115  closed by the sender
        try:
            packing = ZIP_DEFLATED if file_format == "csv" else ZIP_STORED
            with ZipFile(target, "w", packing, compresslevel=EFFORT) as archive:
                for file in written:
                    archive.write(folder / file, f"{name}/{file}")
                    (folder / file).unlink()
            size = target.tell()
            target.seek(0)
        except BaseException:
            target.close()
            raise
    return Download(f"{name}.zip", size, target)
