"""When a certification ends: the interval it is given, and the units whose date is near."""

from __future__ import annotations

import re
from datetime import timedelta

from labctl import config
from labctl.answers.certification import MAX_DUE_DAYS
from labctl.answers.judgement import DueSource
from labctl.errors import BadInput
from labctl.store import Store

_UNITS = {"h": 1 / 24, "d": 1.0, "w": 7.0}
_SPAN = re.compile(r"(\d{1,6})([hdw])", re.ASCII)


def interval_days(store: Store, serial: str, version: int, days: int | None) -> tuple[int | None, DueSource | None]:
    """Return how many days a certification is valid, and who says so; None where no interval is given.

    What the user gives goes before the recipe of the version's campaign, that before `$LABCTL_DUE_DAYS`; 0 given by
    the user means no date. Raises NotFound, BadInput for a variable that is no number of days.
    """
    if days is not None:
        return (days or None), "user"
    if (of_recipe := _of_recipe(store, serial, version)) is not None:
        return of_recipe, "recipe"
    if (usual := _of_environment()) is not None:
        return usual, "configuration"
    return None, None


def _of_recipe(store: Store, serial: str, version: int) -> int | None:
    campaign = campaign_of(store, serial, version)
    days = None if campaign is None else store.campaigns.get(campaign).recipe.get("recalibrate_after_days")
    return days if isinstance(days, int) else None


def campaign_of(store: Store, serial: str, version: int) -> int | None:
    """Return the campaign of the newest recording that a version was fitted to; None where it was imported."""
    recording = store.calibrations.get(serial, version).recording
    return None if recording is None else store.recordings.get(recording).campaign


def _of_environment() -> int | None:
    text = config.variable(config.DUE_VARIABLE)
    if not text:
        return None
    if not (text.isascii() and text.isdecimal() and 0 < int(text) <= MAX_DUE_DAYS):
        raise BadInput(
            f"${config.DUE_VARIABLE} = {text[:40]!r}: give the days between two calibrations as a whole number "
            f"from 1 to {MAX_DUE_DAYS}, or unset the variable"
        )
    return int(text)


def span(text: str) -> timedelta:
    """Return the span of time in "30d", "12h" or "2w". Raises BadInput."""
    match = _SPAN.fullmatch(text.strip())
    if match is None:
        raise BadInput(
            f"due_within {text[:40]!r} is not a time span; give a whole number and h, d or w for hours, days or weeks, "
            "such as 30d"
        )
    return timedelta(days=int(match[1]) * _UNITS[match[2]])
