"""Recordings: taken in, given out, looked at."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, Literal

import numpy as np

from labctl.errors import BadRecording, NotEnoughData, NotFound
from labctl.recording import Recording, RecordingInfo, read_recording, write_recording
from labctl.recording.points import with_pieces
from labctl.services.schemas.recordings import ImportResponse
from labctl.store import RecordingRow, Store

if TYPE_CHECKING:
    from labctl.services.commands.protocol import Commands

STEMS = ("samples", "points", "coefficients", "environment")
FILE_NAMES = frozenset({"recording.toml", *(f"{stem}.{suffix}" for stem in STEMS for suffix in ("csv", "parquet"))})


def import_folder(store: Store, folder: Path, at: datetime) -> ImportResponse:
    """Take in a recording from a folder; all of it or nothing. Raises BadRecording."""
    recording = read_recording(folder)
    number = store.recordings.add_import(recording, at)
    row = store.recordings.get(number)
    readings = row.readings if recording.info.kind == "samples" else len(recording)
    datasets = 0 if recording.info.kind == "coefficients" else row.datasets
    return ImportResponse(
        serial=row.serial,
        recording=number,
        datasets=datasets,
        readings=readings,
        suggested_model=suggested_model(recording.info),
    )


def suggested_model(info: RecordingInfo) -> str:
    """Return the published model that a recording of this kind is usually fitted with."""
    if info.kind == "coefficients":
        return "weiss1995"
    return "yang2018" if len(info.axes) > 1 else "ojeda2000"


def import_files(commands: Commands, files: Sequence[tuple[str, BinaryIO]]) -> ImportResponse:
    """Take in a recording from uploaded files; their names may only be the format's. Raises BadRecording."""
    names = [name for name, _ in files]
    for name in names:
        if name not in FILE_NAMES:
            raise BadRecording(f"file {name!r} is not part of a recording (expected {', '.join(sorted(FILE_NAMES))})")
        if names.count(name) > 1:
            raise BadRecording(f"file {name!r} came more than once")
    with tempfile.TemporaryDirectory(prefix="labctl-import-") as folder:
        for name, content in files:
            with (Path(folder) / name).open("wb") as target:
                shutil.copyfileobj(content, target)
        try:
            return commands.import_recording(Path(folder))
        except BadRecording as error:
            raise BadRecording(str(error).replace(f"{folder}/", "")) from None


def export_recording(
    store: Store, recording: int, folder: Path, file_format: Literal["parquet", "csv"], *, points: bool = False
) -> list[str]:
    """Write a recording, or its points (one row per data set), into a new folder; returns the names of its files."""
    taken = store.recordings.points(recording) if points else store.recordings.samples(recording)
    return write_recording(taken, folder, file_format)


def points_of(store: Store, recording: int) -> Recording:
    """Return a recording's means as a fit takes them: a long data set through which the temperature moved in pieces."""
    points = store.recordings.points(recording)
    if store.recordings.get(recording).kind != "samples":
        return points
    return with_pieces(points, lambda dataset: store.recordings.dataset(recording, dataset))


def newest_recording(store: Store, serial: str, recording: int | None) -> int:
    """Return the recording asked for, checked to be the unit's, or the newest in which something was measured.

    Raises NotFound, NotEnoughData where no data set is complete yet.
    """
    store.units.get(serial)
    rows = store.recordings.of_unit(serial) if recording is None else [store.recordings.get(recording)]
    if not rows:
        raise NotFound(f"unit {serial!r} has no recording; `labctl import DIR` or a campaign makes one")
    row = next((row for row in rows if _measured(row)), rows[0])
    if row.serial != serial:
        raise NotFound(f"recording {recording} is of unit {row.serial!r}, not of {serial!r}")
    if not _measured(row):
        raise NotEnoughData(
            f"recording {row.id} of unit {serial!r} holds no complete data set yet; wait for its first, or name another"
        )
    return row.id


def _measured(row: RecordingRow) -> bool:
    return row.kind != "samples" or row.datasets > 0


def describe_recording(store: Store, recording: int, *, points: bool = True) -> dict[str, Any]:
    """Return what a recording is and, if asked for, the means of its data sets."""
    row = store.recordings.get(recording)
    about = {
        "id": row.id,
        "serial": row.serial,
        "campaign": row.campaign,
        "kind": row.kind,
        "info": dict(row.info),
        "created_at": row.created_at.isoformat(),
        "datasets": row.datasets,
        "readings": row.readings,
    }
    if not points:
        return about
    columns = store.recordings.points(recording).columns
    return {**about, "points": {name: np.asarray(values).tolist() for name, values in columns.items()}}


def dataset_samples(store: Store, recording: int, dataset: int, limit: int) -> dict[str, Any]:
    """Return the readings of one data set, at most `limit`."""
    columns = store.recordings.dataset(recording, dataset)
    n = len(next(iter(columns.values()), ()))
    return {
        "recording": recording,
        "dataset": dataset,
        "readings": n,
        "columns": {name: np.asarray(values)[:limit].tolist() for name, values in columns.items()},
    }
