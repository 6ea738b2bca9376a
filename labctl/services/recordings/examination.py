"""Inspection of a recording or a file as one answer: findings, what was left out, and a picture of all channels."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

from labctl.answers.inspection import DataWarning, InspectionResponse, ReadingsExamined
from labctl.answers.views import PictureResponse
from labctl.errors import BadInput
from labctl.recording import RecordingInfo, read_recording
from labctl.recording.column_map import ColumnMap
from labctl.recording.sanity import findings_of, summarise
from labctl.recording.sanity.readings import examination
from labctl.services.recordings.importers import INTERCHANGE, parsed_options, read_with, surest
from labctl.services.recordings.inspection import inspect_stored
from labctl.services.recordings.readings_examined import examined_stored
from labctl.services.recordings.time_order import OutOfOrder
from labctl.services.recordings.warnings import warning_of
from labctl.store import Store


def inspection_of_recording(store: Store, recording: int) -> InspectionResponse:
    """Return the inspection of a stored recording; computed once. Raises NotFound."""
    row = store.recordings.get(recording)
    info = row.recording_info
    stored_warnings = inspect_stored(store, row).warnings
    return _answer(
        f"recording {recording}", recording, info, row.readings or 0, stored_warnings, examined_stored(store, row)
    )


def inspection_of_file(
    path: Path, name: str | None = None, options: Sequence[str] = (), column_map: ColumnMap | None = None,
    beside: Sequence[Path] = (),
) -> InspectionResponse:  # fmt: skip
    """Return the inspection of a file or folder that could be imported; nothing is stored.

    Rows whose time goes back are a finding here, and no refusal. Raises BadRecording for what cannot be read or made a
    recording of, BadInput for an importer or option that there is not.
    """
    chosen = name or surest(path)
    given_options = parsed_options(options)
    out_of_order = OutOfOrder(also_steps=True)
    if chosen == INTERCHANGE and not given_options:
        if column_map is not None or beside:
            raise BadInput(
                f"{path}: a recording in labctl's own format has no column map and no further files; "
                "leave --map and --beside out"
            )
        recording = read_recording(path)
    else:
        recording = read_with(chosen, path, given_options, column_map, None, beside, out_of_order)
    part = examination(recording)
    of_readings = [*out_of_order.findings, *part.findings]
    warnings = [warning_of(each) for each in findings_of(summarise(recording), recording.environment, of_readings)]
    examined = ReadingsExamined(
        warnings=[warning_of(finding) for finding in of_readings], courses=part.courses, marks=part.marks
    )
    return _answer(str(path), None, recording.info, len(recording), warnings, examined)


def _answer(
    source: str, number: int | None, info: RecordingInfo, readings: int, warnings: list[DataWarning],
    examined: ReadingsExamined,
) -> InspectionResponse:  # fmt: skip
    return InspectionResponse(
        source=source, recording=number, serial=info.serial, kind=info.kind, motion=info.motion, readings=readings,
        warnings=warnings, left_out=list(info.left_out), courses=examined.courses, marks=examined.marks,
        picture=_picture(examined),
    )  # fmt: skip


def _picture(examined: ReadingsExamined) -> PictureResponse | None:
    from labctl.plots.inspection import inspection_picture  # noqa: PLC0415  a service starts without a drawing library

    picture = inspection_picture(examined.courses, examined.marks)
    if picture is None:
        return None
    return PictureResponse(
        id=picture.id, title=picture.title, how_to_read=picture.caption, effects=[],
        figure=json.loads(picture.figure.to_json()),
    )  # fmt: skip
