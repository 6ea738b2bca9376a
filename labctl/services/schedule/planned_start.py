"""The start for which a plan is made: now, at a time, or when a cron line is due next."""

from __future__ import annotations

from datetime import datetime
from zoneinfo import ZoneInfo

from labctl.errors import BadInput
from labctl.services.schedule import times


def planned_start(at: str | None, cron: str | None, time_zone: str | None, now: datetime) -> tuple[datetime, ZoneInfo]:
    """Return when a plan would begin, and its time zone. Raises BadInput."""
    zone = times.time_zone(time_zone)
    if at is not None and cron is not None:
        raise BadInput("a scheduled start has either a time or a cron line; leave one of the two out")
    if cron is not None:
        return times.check_cron(cron, zone, now), zone
    return (now if at is None else times.moment(at, zone, now)), zone
