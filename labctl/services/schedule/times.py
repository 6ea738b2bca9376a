"""When a campaign is to begin: a time as a person writes it, or a cron line, in a time zone.

Cron lines mean what Debian's cron makes of them (cronsim follows it, and its rules for summer time):

* a fixed time that the clocks jump over runs right after the jump: 02:30 becomes 03:00 on that day;
* a fixed time that comes twice runs the first time only;
* a line whose minute or hour begins with a star runs by elapsed time: in both hours that are called the same, and not
  in one that is left out.
"""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from zoneinfo import ZoneInfo

import tzlocal
from cronsim import CronSim, CronSimError

from labctl.errors import BadInput

FIELDS = 5
#: Cron treats smaller changes of the local time specially, greater ones as a correction of the clock.
LARGEST_CHANGE = timedelta(hours=3)
NOW = "now"


def time_zone(name: str | None) -> ZoneInfo:
    """Return a time zone by its name in the tz database, or else that of this computer. Raises BadInput."""
    try:
        return ZoneInfo(name) if name is not None else ZoneInfo(tzlocal.get_localzone_name())
    except (KeyError, ValueError, OSError) as error:  # unknown, not a name, a folder
        raise BadInput(f"time zone {name!r} is not known; give a name such as Europe/Berlin or UTC") from error


def moment(text: str, zone: ZoneInfo, now: datetime) -> datetime:
    """Return a time as UTC; one without zone of its own is meant in `zone`.

    A time that comes twice is the first of the two. Raises BadInput for one that does not exist or is past.
    """
    if text == NOW:
        return now
    try:
        instant = datetime.fromisoformat(text)
        meant = instant.replace(tzinfo=zone) if instant.tzinfo is None else instant.astimezone(zone)
        start = meant.astimezone(UTC)
    except (ValueError, OverflowError) as error:
        raise BadInput(
            f"time {text!r} cannot be read; write it as 2026-03-28T22:00, 2026-03-28T22:00+01:00 or "
            "2026-03-28T22:00Z, or write `now`"
        ) from error
    if start.astimezone(zone).replace(tzinfo=None, fold=0) != meant.replace(tzinfo=None, fold=0):
        raise BadInput(
            f"time {text!r} does not exist in {zone.key}: the change to summer time skips it; give another time"
        )
    if start <= now:
        local_now = now.astimezone(zone)
        raise BadInput(
            f"time {text!r} ({meant:%Y-%m-%d %H:%M %z}) is in the past: it is now {local_now:%Y-%m-%d %H:%M %z} in "
            f"{zone.key}; give a later time, or `now`"
        )
    return start


def next_due(line: str, zone: ZoneInfo, after: datetime) -> datetime | None:
    """Return when a cron line is due next, strictly after an instant; None when never within 50 years."""
    for due_at in CronSim(line, after.astimezone(zone)):
        if due_at.astimezone(UTC) > after:
            return due_at.astimezone(UTC)
    return None


def last_due(line: str, zone: ZoneInfo, first: datetime, now: datetime) -> datetime:
    """Return the newest time up to `now` at which a cron line was due; `first` is one of them."""
    # backwards from behind any change of the clocks: inside a repeated hour the search would miss the first of the two
    for due_at in CronSim(line, (now + LARGEST_CHANGE).astimezone(zone), reverse=True):
        due = due_at.astimezone(UTC)
        if due <= now:
            return max(due, first)
    return first


def check_cron(line: str, zone: ZoneInfo, now: datetime) -> datetime:
    """Return when a cron line is due for the first time. Raises BadInput naming what is wrong with it."""
    shape = "minute hour day-of-month month day-of-week, such as '30 2 * * MON'"
    if len(line.split()) != FIELDS:
        raise BadInput(f"cron line {line!r} has {len(line.split())} fields; write {FIELDS} fields: {shape}")
    try:
        due = next_due(line, zone, now)
    except CronSimError as error:
        raise BadInput(f"cron line {line!r}: {str(error).lower()}; write {shape}") from error
    if due is None:
        raise BadInput(f"cron line {line!r} matches no time within 50 years; correct its days and months")
    return due
