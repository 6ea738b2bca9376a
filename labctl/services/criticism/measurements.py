"""Measurements of one recording, as criticism uses them: each part is read from the store at most once."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from labctl.errors import BadInput
from labctl.fitting.criticism import decimate
from labctl.progress import report_stage
from labctl.recording import Recording
from labctl.recording.output_steps import per_reading, quantisation_of
from labctl.services.recordings.inspection import inspect_stored
from labctl.services.recordings.loading import is_profile, points_of
from labctl.services.schemas.warnings import RecordingInspection
from labctl.store import RecordingRow, Store


@dataclass(frozen=True)
class Measurements:
    """One recording of the store; its means and its readings are read when they are first used."""

    store: Store
    row: RecordingRow

    @cached_property
    def points(self) -> Recording:
        """The means as a fit takes them, one row per data set or piece of a long one."""
        return points_of(self.store, self.row)

    @cached_property
    def inspection(self) -> RecordingInspection:
        """What is wrong with the recording, and what its readings cover."""
        return inspect_stored(self.store, self.row)

    @cached_property
    def readings(self) -> Recording:
        """The readings at no more than criticism needs; the means where there are no readings. Raises BadInput."""
        report_stage("reading the recording")
        return load_reduced_readings(self.store, self.row, self.points)


def load_reduced_readings(store: Store, row: RecordingRow, points: Recording) -> Recording:
    """Return a recording's readings, decimated data set by data set; `points`, its means, where it has none.

    Raises BadInput for a table of coefficients, which holds no measurement.
    """
    if row.kind == "coefficients":
        raise BadInput(
            f"recording {row.id} is a table of coefficients: a model is compared with readings or means; name a "
            "recording of these"
        )
    if row.kind != "samples" or is_profile(row):  # of a rate that changes decimated readings are those of another
        return points
    info = points.info.model_copy(update={"kind": "samples"})
    parts = [decimate(Recording(info, columns, None)).columns for _, columns in store.recordings.iter_datasets(row.id)]
    columns = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    for name, values in quantisation_of(points).items():  # decimated readings do not show their steps any more
        numbers = np.asarray(points.columns["dataset"], dtype=np.int64)
        columns[name] = per_reading(np.asarray(columns["dataset"], dtype=np.int64), numbers, values)
    return Recording(info, columns, points.environment)
