"""Units: who they are, what is known of them, and when they are due."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime, timedelta
from functools import cache
from typing import get_args

from labctl.answers.common_fields import CriticismVerdict
from labctl.answers.units import (
    BatchRequest,
    BatchResponse,
    CalibrationEventResponse,
    ExportFormatResponse,
    RecalibrationResponse,
    UnitResponse,
    UnitState,
    VersionErrors,
)
from labctl.errors import BadInput
from labctl.services.standards.usage import Notices
from labctl.store import CampaignRow, CertificationRow, Store, Unit
from labctl.store.paging import Page, PageRequest
from labctl.store.records import UnitHoldings
from labctl.store.repositories.calibrations import FitError
from labctl.store.repositories.units import UnitFilter

#: Versions of a unit whose errors its answer has.
MAX_ERRORS = 24
#: Every unit, in one part.
ANY_UNIT: PageRequest[str] = PageRequest()


def list_units(
    store: Store,
    now: datetime,
    request: PageRequest[str],
    within: timedelta | None = None,
    calibration: str | None = None,
    verdict: str | None = None,
    batch: str | None = None,
) -> Page[UnitResponse, str]:
    """Return units by serial number in natural order: all, those in a state, with a verdict, of a batch.

    `within` a span those that are due (`units_due`). Raises BadInput for a state or a verdict that there is not.
    """
    if within is not None:
        if calibration or verdict or batch:
            raise BadInput("due_within is given together with calibration, verdict or batch; give one of them")
        return units_due(store, now, within, request)
    for name, value, choices in (("calibration", calibration, UnitState), ("verdict", verdict, CriticismVerdict)):
        if value is not None and value not in get_args(choices):
            raise BadInput(f"{name} {value!r}: choose one of {', '.join(get_args(choices))}")
    page = store.units.page(request, UnitFilter(now, calibration, verdict, batch or None))
    return Page(_answers(store, now, page.rows), page.total, page.next_after)


def units_due(
    store: Store, now: datetime, within: timedelta, request: PageRequest[str] = ANY_UNIT
) -> Page[UnitResponse, str]:
    """Return the units whose certification ends within a span, or has ended: the earliest date first.

    A unit without a date, or without a version in force, is never due.
    """
    page = store.due_units.page(request, now + within)
    return Page(_whole(store, _answers(store, now, page.rows)), page.total, page.next_after)


def unit(store: Store, serial: str, now: datetime) -> UnitResponse:
    """Return one unit; raises NotFound."""
    (answer,) = _whole(store, _answers(store, now, [store.units.get(serial)]))
    if not answer.recordings:
        return answer
    newest = store.recordings.get(max(answer.recordings))
    return answer.model_copy(update={"axes": list(newest.recording_info.axes)})


def _whole(store: Store, answers: Sequence[UnitResponse]) -> list[UnitResponse]:
    """Return units with what lists of all units leave out: how each is recalibrated, and its newest draft."""
    from labctl.services.drafts.answers import newest_drafts  # noqa: PLC0415  lists of units have no drafts

    serials = [answer.serial for answer in answers]
    campaigns, drafts = store.due_units.campaigns(serials), newest_drafts(store, serials)
    again = {row.id: _recalibration(row) for row in store.campaigns.some(sorted(set(campaigns.values())))}
    return [
        answer.model_copy(
            update={"recalibration": again.get(campaigns.get(answer.serial, 0)), "draft": drafts.get(answer.serial)}
        )
        for answer in answers
    ]


def calibration_events(store: Store, most: int) -> list[CalibrationEventResponse]:
    """Return the newest versions and certifications of all units, at most so many, newest first."""
    return [
        CalibrationEventResponse(
            serial=each.serial, version=each.version, act=each.act, at=each.at, by=each.by, model=each.model
        )
        for each in store.calibration_events.newest(most)
    ]


def batches(store: Store) -> list[BatchResponse]:
    """Return every batch that a unit is of, by name."""
    return [BatchResponse(batch=row.batch, units=row.units) for row in store.units.batches()]


def set_batch(store: Store, request: BatchRequest, at: datetime) -> BatchResponse:
    """State the batch of some units, all or none. Raises NotFound for a unit that is absent."""
    store.units.set_batch(list(dict.fromkeys(request.serials)), request.batch, request.supplier, request.by, at)
    of_batch = PageRequest("", 1, None)
    total = store.units.page(of_batch, UnitFilter(at, batch=request.batch)).total
    return BatchResponse(batch=request.batch, units=total)


def count_due(store: Store, now: datetime, within: timedelta) -> tuple[int, int]:
    """Return how many units are overdue, and how many are or will be within a span."""
    overdue, due = store.due_units.count(now, now + within)
    return overdue, due


def _answers(store: Store, now: datetime, units: Sequence[Unit]) -> list[UnitResponse]:
    serials = [unit.serial for unit in units]
    held, notices = store.units.holdings(serials), Notices.of(store)
    errors = store.calibrations.newest_errors(serials, MAX_ERRORS)
    in_force, verdicts = store.certifications.in_force(serials), store.certifications.verdicts(serials)
    answers = []
    for unit in units:
        act = in_force.get(unit.serial)
        newest_errors = _over_floor(errors.get(unit.serial, []))
        answer = _answer(unit, held[unit.serial], newest_errors, act, now, _notices(store, notices, act))
        answers.append(answer.model_copy(update={"certified_verdict": verdicts.get(unit.serial)}))
    return answers


def _over_floor(errors: Sequence[FitError]) -> VersionErrors:
    return VersionErrors(
        version=[each.version for each in errors],
        over_floor=[
            each.rms_dps / each.noise_floor_dps if each.rms_dps is not None and each.noise_floor_dps else None
            for each in errors
        ],
    )


def _answer(
    unit: Unit, held: UnitHoldings, errors: VersionErrors, act: CertificationRow | None, now: datetime,
    notices: list[str],
) -> UnitResponse:  # fmt: skip
    return UnitResponse(
        serial=unit.serial,
        model=unit.model,
        technology=unit.technology,
        batch=unit.batch,
        supplier=unit.supplier,
        recordings=held.recordings,
        calibrations=held.versions,
        newest_errors=errors,
        certified_version=act.version if act else None,
        due=act.due_at if act else None,
        overdue=bool(act and act.due_at and act.due_at <= now),
        notices=notices,
        recalibration=None,
        draft=None,
        formats=_formats(),
    )


@cache
def _formats() -> list[ExportFormatResponse]:
    """Return what a calibration can be exported as: the same for every unit."""
    from labctl.exports import export_formats  # noqa: PLC0415  loads what a calibration is computed with

    return [
        ExportFormatResponse(id=name, title=each.title, suffix=each.suffix, options=dict(each.options))
        for name, each in export_formats().items()
    ]


def _notices(store: Store, notices: Notices, act: CertificationRow | None) -> list[str]:
    if act is None or not notices.bad:
        return []
    return notices.of_recordings(store.calibrations.get(act.serial, act.version).recordings)


def _recalibration(row: CampaignRow) -> RecalibrationResponse | None:
    from labctl.services.planning.recipe_text import recipe_text  # noqa: PLC0415  lists of units have no recipes

    text = recipe_text(row.recipe)
    return RecalibrationResponse(recipe=text, name=row.recipe_name, bench=row.bench_name) if text else None
