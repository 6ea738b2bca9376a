"""Criticism: a calibration version held against a recording, and the ladder of versions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TypeVar

import numpy as np

from labctl.errors import BadInput
from labctl.fitting.criticism import Criticism, criticise
from labctl.fitting.criticism.compress import thin
from labctl.fitting.effects import CATALOGUE, Effect, Formula, formulas
from labctl.fitting.model import ErrorModel
from labctl.recording import Recording
from labctl.services.answers import Answer, CriticismAnswer, LadderAnswer, LadderRow
from labctl.services.criticism_text import answer_of
from labctl.services.experiments import experiments_for
from labctl.services.kept import kept_among
from labctl.services.recordings import newest_recording
from labctl.services.residuals import ResidualsAnswer, residual_columns
from labctl.store import CalibrationRecord, Store

A = TypeVar("A", bound=Answer)
ERRORS = ("raw_rms_dps", "rms_dps", "heldout_rms_dps", "noise_floor_dps")


def criticise_unit(
    store: Store, serial: str, version: int | None, recording: int | None, competing: Sequence[Formula] = ()
) -> CriticismAnswer:
    """Hold a version (default: the newest) against a recording (default: the newest). Raises NotFound, BadInput."""
    return _held(CriticismAnswer, store, serial, version, recording, competing)


def residuals_unit(store: Store, serial: str, version: int | None, recording: int | None) -> ResidualsAnswer:
    """Return what the same criticism leaves, data set by data set. Raises NotFound, BadInput."""
    return _held(ResidualsAnswer, store, serial, version, recording, ())


def _held(
    kind: type[A], store: Store, serial: str, version: int | None, recording: int | None, competing: Sequence[Formula]
) -> A:
    """Return one of the answers of a criticism; whichever is asked first, all are kept."""
    row = version_of(store, serial, version)
    number = newest_recording(store, serial, recording)
    catalogue = _catalogue(competing)

    def work() -> list[Answer]:
        found = _criticise(store, number, model_of(row), catalogue)
        columns = residual_columns(found.data, found.residuals, store.recordings.points(number), found.base)
        return [
            answer_of(serial, row.version, number, found, experiments_for(store, number, found)),
            ResidualsAnswer(serial=serial, version=row.version, recording=number, columns=columns),
        ]

    question = {
        "serial": serial, "version": row.version, "model": row.answer["model"], "recording": number,
        "readings": store.recordings.fingerprint(number), "formulas": [[each.id, each.text] for each in competing],
    }  # fmt: skip
    return kept_among(kind, question, work)


def _criticise(store: Store, recording: int, model: ErrorModel, catalogue: Mapping[str, Effect]) -> Criticism:
    return criticise(readings_of(store, recording), model, catalogue, points=store.recordings.points(recording))


def readings_of(store: Store, recording: int) -> Recording:
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


def ladder(store: Store, serial: str) -> LadderAnswer:
    """Return the error of every version, oldest first, down to the noise floor. Raises NotFound."""
    rows = sorted(store.calibrations.of_unit(store.units.get(serial).serial), key=lambda row: row.version)
    if not rows:
        raise BadInput(f"unit {serial!r} has no calibration yet; `labctl fit {serial}` makes the first")
    steps = [
        LadderRow(
            version=row.version, parent=row.parent, model=row.model, effects=list(row.answer["model"]["effects"]),
            **{key: row.answer["error"][key] for key in ERRORS},
        )
        for row in rows
    ]  # fmt: skip
    floors = [step.noise_floor_dps for step in steps if step.noise_floor_dps is not None]
    return LadderAnswer(serial=serial, steps=steps, noise_floor_dps=min(floors) if floors else None)


def model_of(row: CalibrationRecord) -> ErrorModel:
    """Return the whole model of a version, with what does not leave the house. Raises BadInput for an old row."""
    record = row.answer["model"]
    if "terms" not in record:
        raise BadInput(f"version {row.version} was made by an older labctl; fit it again, then criticise that")
    return ErrorModel.from_dict(record)


def version_of(store: Store, serial: str, version: int | None) -> CalibrationRecord:
    """Return a version, or the newest. Raises NotFound, BadInput where there is none yet."""
    rows = store.calibrations.of_unit(store.units.get(serial).serial)
    if not rows:
        raise BadInput(f"unit {serial!r} has no calibration yet; `labctl fit {serial}` makes the first")
    if version is None:
        return max(rows, key=lambda row: row.version)
    return store.calibrations.get(serial, version)


def _catalogue(written: Sequence[Formula]) -> dict[str, Effect]:
    for each in written:
        if each.id in CATALOGUE:
            raise BadInput(f"formula {each.id!r}: the catalogue has an effect of that name; choose another")
    return {**CATALOGUE, **{each.id: each for each in written}}


def with_files(sources: list[str]) -> list[Formula]:
    """Return formulas from lines `name: expression` and from files of this machine; raises BadInput."""
    return [each for source in sources for each in formulas(source)]


def as_lines(sources: list[str]) -> list[str]:
    """Return formulas as lines `name: expression`, with those of files read here; raises BadInput."""
    return [f"{each.id}: {each.text}" for each in with_files(sources)]


def write_next(answer: CriticismAnswer, path: Path) -> None:
    """Write the best next experiment as a recipe that a campaign can be started from. Raises BadInput without one."""
    if not answer.experiments:
        raise BadInput(f"{path}: there is no experiment to write; the verdict is {answer.verdict!r}")
    path.write_text(answer.experiments[0]["toml"], encoding="utf-8")
