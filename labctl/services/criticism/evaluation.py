"""The work behind a criticism: a whole model, the readings of a recording, and what comes of holding them together.

Apart from who asks: a kept answer needs none of it, and these libraries take longer to load than that answer to read.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from labctl.errors import BadInput
from labctl.fitting.criticism import criticise
from labctl.fitting.criticism.reduction import thin
from labctl.fitting.effects import Formula
from labctl.fitting.models.error_model import ErrorModel
from labctl.recording import Recording
from labctl.services.criticism.next_experiment import experiments_for
from labctl.services.criticism.report_text import answer_of
from labctl.services.criticism.residuals import residual_columns
from labctl.services.effects import catalogue_with
from labctl.services.recordings.loading import points_of
from labctl.services.schemas.criticism import CriticismResponse, ResidualsResponse
from labctl.store import CalibrationRecord, Store


def evaluate(
    store: Store, row: CalibrationRecord, recording: int, competing: Sequence[Formula]
) -> tuple[CriticismResponse, ResidualsResponse]:
    """Hold a version against a recording; returns what is said of it and what it leaves. Raises BadInput."""
    catalogue, points = catalogue_with(competing), points_of(store, recording)
    found = criticise(load_reduced_readings(store, recording), model_of(row), catalogue, points=points)
    columns = residual_columns(found.data, found.residuals, points, found.base)
    return (
        answer_of(row.serial, row.version, recording, found, experiments_for(store, recording, found)),
        ResidualsResponse(serial=row.serial, version=row.version, recording=recording, columns=columns),
    )


def load_reduced_readings(store: Store, recording: int) -> Recording:
    """Return a recording's readings at no more than criticism needs, data set by data set; points as they are.

    Raises BadInput for a table of coefficients: there is nothing measured in it to hold a model against.
    """
    head = store.recordings.get(recording)
    if head.kind == "coefficients":
        raise BadInput(f"recording {recording} is a table of coefficients: a model is held against readings or means")
    points = store.recordings.points(recording)
    if head.kind != "samples":
        return points
    info = points.info.model_copy(update={"kind": "samples"})
    parts = [thin(Recording(info, columns, None)).columns for _, columns in store.recordings.iter_datasets(recording)]
    columns = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    return Recording(info, columns, points.environment)


def model_of(row: CalibrationRecord) -> ErrorModel:
    """Return the whole model of a version, with what does not leave the house. Raises BadInput for an old row."""
    record = row.answer["model"]
    if "terms" not in record:
        raise BadInput(f"version {row.version} was made by an older labctl; fit it again, then criticise that")
    return ErrorModel.from_dict(record)
