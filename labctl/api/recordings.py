"""Recordings: import and look."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Query, UploadFile

from labctl.api.rooms import HouseOf
from labctl.services import looking
from labctl.services import recordings as services
from labctl.services.answers import Imported
from labctl.services.looking import DataSetsAnswer, RecordingAnswer

router = APIRouter(prefix="/api/recordings", tags=["recordings"])


@router.post("", summary="Import a recording", status_code=201)
def import_recording(files: list[UploadFile], house: HouseOf) -> Imported:
    """Take in a recording in the interchange format: `recording.toml`, its data file and, if there is one, the
    environment file, as parts of one multipart form. All of it or nothing; an error names file, column and row."""
    return services.import_files(house.acts(), [(file.filename or "", file.file) for file in files])


@router.get("", summary="All recordings")
def all_recordings(house: HouseOf) -> list[RecordingAnswer]:
    """Every recording, newest first."""
    return looking.list_recordings(house.store)


@router.get("/{recording}", summary="One recording")
def recording(recording: int, house: HouseOf) -> dict[str, Any]:
    """What the recording is: unit, axes, channels, data sets."""
    return services.describe_recording(house.store, recording)


@router.get("/{recording}/datasets", summary="Its data sets")
def datasets(recording: int, house: HouseOf) -> DataSetsAnswer:
    """One row per data set, as columns, with mean and standard deviation of every channel; also incomplete ones."""
    return looking.data_sets(house.store, recording)


@router.get("/{recording}/samples", summary="Readings of one data set")
def samples(
    recording: int,
    house: HouseOf,
    dataset: Annotated[int, Query(description="Number of the data set.")],
    limit: Annotated[int, Query(ge=1, le=100_000, description="At most this many readings.")] = 10_000,
) -> dict[str, Any]:
    """The readings of one data set, column by column, in the units named beside them."""
    return services.dataset_samples(house.store, recording, dataset, limit)
