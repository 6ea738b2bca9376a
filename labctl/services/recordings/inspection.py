"""Inspection of a stored recording before it is fitted: warnings, range of its readings, coarse steps."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from labctl.answers.inspection import DataWarning, ReadingsExamined, RecordingInspection
from labctl.errors import DataRefused
from labctl.recording import Recording
from labctl.recording.sanity import Summary, findings_of, joined, steps_of, summarise
from labctl.services.cache import cached
from labctl.services.recordings.readings_examined import examined_stored
from labctl.services.recordings.warnings import as_json, finding_of, warning_of
from labctl.store import RecordingRow, Store


def inspect_stored(store: Store, row: RecordingRow, recording: Recording | None = None) -> RecordingInspection:
    """Return what an inspection of a recording finds; computed once for the readings that it holds now.

    `recording` is the whole recording, where it is in memory already.
    """
    question = {"inspect": row.id, "readings": store.recordings.fingerprint(row.id, head=row)}
    return cached(RecordingInspection, question, lambda: _inspected(store, row, recording))


def _inspected(store: Store, row: RecordingRow, recording: Recording | None) -> RecordingInspection:
    if recording is not None:
        return _response(summarise(recording), recording, examined_stored(store, row, recording))
    points = store.recordings.points(row.id, head=row)
    if row.kind != "samples":
        return _response(summarise(points), points, examined_stored(store, row, points))
    info = points.info.model_copy(update={"kind": "samples"})
    parts = [summarise(Recording(info, columns)) for _, columns in store.recordings.iter_datasets(row.id)]
    return _response(joined(info, parts), points, examined_stored(store, row))


def _response(summary: Summary, recording: Recording, readings: ReadingsExamined) -> RecordingInspection:
    of_readings = [finding_of(warning) for warning in readings.warnings]
    warnings = [warning_of(each) for each in findings_of(summary, recording.environment, of_readings)]
    if len(summary) == 0:
        return RecordingInspection(
            warnings=warnings, dataset=[], rate_low_dps=[], rate_high_dps=[], temperature_low_c=[],
            temperature_high_c=[], position=[], quantisation_dps={},
        )  # fmt: skip
    coarse = {axis: steps_of(summary, axis) for axis in summary.info.axes}
    return RecordingInspection(
        warnings=warnings,
        dataset=summary["dataset"].tolist(),
        rate_low_dps=summary["rate_low_dps"].tolist(),
        rate_high_dps=summary["rate_high_dps"].tolist(),
        temperature_low_c=_numbers(np.asarray(summary["temperature_low_c"], dtype=np.float64)),
        temperature_high_c=_numbers(np.asarray(summary["temperature_high_c"], dtype=np.float64)),
        position=[str(position) for position in summary["position"]],
        quantisation_dps={axis: u.tolist() for axis, (step, u) in coarse.items() if step is not None},
    )


def _numbers(values: NDArray[np.float64]) -> list[float | None]:
    return [float(value) if np.isfinite(value) else None for value in values]


INSIST = "; to do it nevertheless: --accept-warnings"


def refuse_wrong(warnings: list[DataWarning], what: str, *, accepted: bool, insist: str = INSIST) -> None:
    """Raise DataRefused for the first certain warning, unless it is accepted; `what` names what is refused."""
    sure = [warning for warning in warnings if warning.severity == "certain"]
    if sure and not accepted:
        more = f" (and {len(sure) - 1} more)" if len(sure) > 1 else ""
        text = f"{what} is refused: {sure[0].text}{more}{insist}"
        raise DataRefused(text, [as_json(warning) for warning in warnings])
