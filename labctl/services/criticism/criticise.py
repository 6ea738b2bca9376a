"""Criticism: a calibration version held against a recording, and the ladder of versions."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from labctl.errors import BadInput
from labctl.services.cache import cached_group
from labctl.services.recordings.loading import newest_row
from labctl.services.schemas.base import ResponseModel
from labctl.services.schemas.calibrations import LadderResponse, LadderRow
from labctl.services.schemas.criticism import CriticismResponse, ResidualsResponse
from labctl.store import CalibrationRecord, Store

if TYPE_CHECKING:
    from labctl.fitting.effects import Formula

A = TypeVar("A", bound=ResponseModel)
ERRORS = ("raw_rms_dps", "rms_dps", "heldout_rms_dps", "noise_floor_dps")


def criticise_unit(
    store: Store, serial: str, version: int | None, recording: int | None, competing: Sequence[Formula] = ()
) -> CriticismResponse:
    """Hold a version (default: the newest) against a recording (default: the newest). Raises NotFound, BadInput."""
    return _cached_criticism(CriticismResponse, store, serial, version, recording, competing)


def residuals_unit(store: Store, serial: str, version: int | None, recording: int | None) -> ResidualsResponse:
    """Return what the same criticism leaves, data set by data set. Raises NotFound, BadInput."""
    return _cached_criticism(ResidualsResponse, store, serial, version, recording, ())


def _cached_criticism(
    kind: type[A], store: Store, serial: str, version: int | None, recording: int | None, competing: Sequence[Formula]
) -> A:
    """Return one of the answers of a criticism; the first request computes and caches all of them."""
    row = version_of(store, serial, version)
    measured = newest_row(store, serial, recording)

    def work() -> Sequence[ResponseModel]:
        from labctl.services.criticism.evaluation import evaluate  # noqa: PLC0415  half a second that a kept answer does not need

        return evaluate(store, row, measured, competing)

    question = {
        "serial": serial, "version": row.version, "model": row.answer["model"], "recording": measured.id,
        "readings": store.recordings.fingerprint(measured.id, head=measured),
        "formulas": [[each.id, each.text] for each in competing],
    }  # fmt: skip
    return cached_group(kind, question, work)


def ladder(store: Store, serial: str) -> LadderResponse:
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
    return LadderResponse(serial=serial, steps=steps, noise_floor_dps=min(floors) if floors else None)


def version_of(store: Store, serial: str, version: int | None) -> CalibrationRecord:
    """Return a version, or the newest. Raises NotFound, BadInput where there is none yet."""
    rows = store.calibrations.of_unit(store.units.get(serial).serial)
    if not rows:
        raise BadInput(f"unit {serial!r} has no calibration yet; `labctl fit {serial}` makes the first")
    if version is None:
        return max(rows, key=lambda row: row.version)
    return store.calibrations.get(serial, version)


def write_next(answer: CriticismResponse, path: Path) -> None:
    """Write the best next experiment as a recipe that a campaign can be started from. Raises BadInput without one."""
    if not answer.experiments:
        raise BadInput(f"{path}: there is no experiment to write; the verdict is {answer.verdict!r}")
    path.write_text(answer.experiments[0]["toml"], encoding="utf-8")
