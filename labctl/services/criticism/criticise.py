"""Criticism: a calibration version held against a recording."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from labctl.errors import BadInput
from labctl.services.cache import cached_group
from labctl.services.criticism.versions import version_of
from labctl.services.recordings.loading import newest_row
from labctl.services.schemas.base import ResponseModel
from labctl.services.schemas.criticism import CriticismResponse, ResidualsResponse
from labctl.store import Store

if TYPE_CHECKING:
    from labctl.fitting.effects import Formula

A = TypeVar("A", bound=ResponseModel)


def criticise_unit(
    store: Store,
    serial: str,
    version: int | None,
    recording: int | None,
    competing: Sequence[Formula] = (),
    *,
    other_unit: bool = False,
) -> CriticismResponse:
    """Hold a version (default: the newest) against a recording (default: the unit's newest).

    `other_unit` allows a recording of another unit. Raises NotFound, BadInput.
    """
    return _cached_criticism(CriticismResponse, store, serial, version, recording, competing, other_unit=other_unit)


def residuals_unit(store: Store, serial: str, version: int | None, recording: int | None) -> ResidualsResponse:
    """Return what the same criticism leaves, data set by data set. Raises NotFound, BadInput."""
    return _cached_criticism(ResidualsResponse, store, serial, version, recording, ())


def _cached_criticism(
    kind: type[A],
    store: Store,
    serial: str,
    version: int | None,
    recording: int | None,
    competing: Sequence[Formula],
    *,
    other_unit: bool = False,
) -> A:
    """Return one of the answers of a criticism; the first request computes and caches all of them."""
    row = version_of(store, serial, version)
    measured = newest_row(store, serial, recording, other_unit=other_unit)

    def work() -> Sequence[ResponseModel]:
        from labctl.services.criticism.evaluation import evaluate  # noqa: PLC0415  slow to import

        return evaluate(store, row, measured, competing)

    question = {
        "serial": serial, "version": row.version, "calibration": row.hash, "model": row.answer["model"],
        "recording": measured.id,
        "readings": store.recordings.fingerprint(measured.id, head=measured),
        "formulas": [[each.id, each.text] for each in competing],
    }  # fmt: skip
    return cached_group(kind, question, work)


def write_next(answer: CriticismResponse, path: Path) -> None:
    """Write the best next experiment as a recipe that a campaign can be started from. Raises BadInput without one."""
    if not answer.experiments:
        raise BadInput(
            f"{path}: there is no experiment to write, since the verdict is {answer.verdict!r}; leave --next out"
        )
    path.write_text(answer.experiments[0]["toml"], encoding="utf-8")
