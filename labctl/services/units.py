"""Units: who they are, what is known of them, and when they are due."""

from __future__ import annotations

from datetime import datetime, timedelta

from labctl.exports import export_formats
from labctl.services.calibrations.due import campaign_of
from labctl.services.campaigns.plan_view import recipe_text
from labctl.services.drafts.answers import newest_draft
from labctl.services.schemas.units import ExportFormatResponse, RecalibrationResponse, UnitResponse
from labctl.services.standards.usage import Notices
from labctl.store import CertificationRow, Store, Unit


def list_units(store: Store, now: datetime, due_within: timedelta | None = None) -> list[UnitResponse]:
    """Return every unit; with a span those whose certification ends within it, or has ended: the earliest date first.

    A unit without a date, or without a version in force, is never due.
    """
    in_force = store.certifications.in_force()
    if due_within is None:
        return [
            _answer(store, unit_answers, in_force.get(unit_answers.serial), now) for unit_answers in store.units.all()
        ]
    near = {
        serial: act for serial, act in in_force.items() if act.due_at is not None and act.due_at <= now + due_within
    }
    unit_answers = [
        _answer(store, each, near[each.serial], now, whole=True) for each in store.units.all() if each.serial in near
    ]
    return sorted(unit_answers, key=lambda unit: (unit.due or now, unit.serial))


def unit(store: Store, serial: str, now: datetime) -> UnitResponse:
    """Return one unit; raises NotFound."""
    row = store.units.get(serial)
    return _answer(store, row, store.certifications.in_force().get(row.serial), now, whole=True)


def count_due(store: Store, now: datetime, within: timedelta) -> tuple[int, int]:
    """Return how many units are overdue, and how many are or will be within a span."""
    dates = [act.due_at for act in store.certifications.in_force().values() if act.due_at is not None]
    return sum(date <= now for date in dates), sum(date <= now + within for date in dates)


def _answer(
    store: Store, unit_row: Unit, act: CertificationRow | None, now: datetime, *, whole: bool = False
) -> UnitResponse:
    return UnitResponse(
        serial=unit_row.serial,
        model=unit_row.model,
        technology=unit_row.technology,
        recordings=[row.id for row in store.recordings.of_unit(unit_row.serial)],
        calibrations=store.calibrations.versions(unit_row.serial),
        certified_version=act.version if act else None,
        due=act.due_at if act else None,
        overdue=bool(act and act.due_at and act.due_at <= now),
        notices=_notices(store, act),
        recalibration=_recalibration(store, act) if act and whole else None,
        draft=newest_draft(store, unit_row.serial) if whole else None,
        formats=[
            ExportFormatResponse(
                id=name, title=export_format.title, suffix=export_format.suffix, options=dict(export_format.options)
            )
            for name, export_format in export_formats().items()
        ],
    )


def _notices(store: Store, act: CertificationRow | None) -> list[str]:
    if act is None or not (notices := Notices.of(store)).bad:
        return []
    return notices.of_recordings(store.calibrations.get(act.serial, act.version).recordings)


def _recalibration(store: Store, act: CertificationRow) -> RecalibrationResponse | None:
    campaign = campaign_of(store, act.serial, act.version)
    if campaign is None:
        return None
    row = store.campaigns.get(campaign)
    text = recipe_text(row.recipe)
    return RecalibrationResponse(recipe=text, name=row.recipe_name, bench=row.bench_name) if text else None
