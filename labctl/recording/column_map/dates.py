"""Dates and times of day as words: ISO 8601, and the forms that spreadsheets and data loggers write."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
_CLOCK = r"(?P<h>\d{1,2}):(?P<min>\d\d)(?::(?P<s>\d\d)(?:[.,](?P<f>\d{1,9}))?)?\s*(?P<half>[AaPp][Mm])?"
_ISO = re.compile(r"\d{4}-\d\d-\d\d[ T]\d\d:\d\d|\d{8}T\d{4}")
_MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")
_NAMED_MONTH = re.compile(
    rf"(?P<a>\d{{1,2}})[ -](?P<b>{'|'.join(_MONTHS)})[a-z]*[ -](?P<y>\d{{4}}),?[ T]+{_CLOCK}", re.IGNORECASE
)
_YEAR_FIRST = re.compile(rf"(?P<y>\d{{4}})[/.](?P<a>\d{{1,2}})[/.](?P<b>\d{{1,2}})[ T]+{_CLOCK}")
_YEAR_LAST = re.compile(rf"(?P<a>\d{{1,2}})(?P<sep>[/.-])(?P<b>\d{{1,2}})[/.-](?P<y>\d{{4}}),?[ T]+{_CLOCK}")
_OF_DAY = re.compile(_CLOCK)
_DAY = timedelta(days=1)
#: Units of a column of dates -> whether the day comes before the month; None: as the dates show it.
ORDERS: dict[str, bool | None] = {"date-time": None, "date-time d/m/y": True, "date-time m/d/y": False}
EXPECTED = (
    "dates such as 2026-01-05T08:00:00.250Z, 05/01/2026 08:00:00.250 or 5-Jan-2026 08:00:00, or times of day such as "
    "08:00:00.250"
)


@dataclass(frozen=True)
class Instants:
    """Times since the first, (n,) s, and the instant of the first; None where only times of day are known."""

    t_s: Array
    first: datetime | None


def is_date(word: str) -> bool:
    """Whether a word is a date with a time, or a time of day."""
    return bool(
        _ISO.match(word) or any(form.fullmatch(word) for form in (_YEAR_FIRST, _YEAR_LAST, _NAMED_MONTH, _OF_DAY))
    )


def instants(words: Sequence[str], unit: str) -> Instants:
    """Return the times that words are by a unit of `ORDERS`.

    Raises ValueError, in words, for one that is no date, and for dates of which day and month cannot be distinguished.
    """
    first = words[0] if words else ""
    if _ISO.match(first):
        return _since_first([_iso(word) for word in words])
    if _OF_DAY.fullmatch(first):
        return _times_of_day(words)
    if _YEAR_FIRST.fullmatch(first):
        return _since_first([_parts(word, _YEAR_FIRST, day_first=False) for word in words])
    if _NAMED_MONTH.fullmatch(first):
        return _since_first([_parts(word, _NAMED_MONTH, day_first=True) for word in words])
    stated = ORDERS.get(unit)
    day_first = _day_first(words) if stated is None else stated
    return _since_first([_parts(word, _YEAR_LAST, day_first=day_first) for word in words])


def _iso(word: str) -> datetime:
    parsed = datetime.fromisoformat(word)
    return parsed.astimezone(UTC).replace(tzinfo=None) if parsed.tzinfo else parsed


def _day_first(words: Sequence[str]) -> bool:
    """Return whether the day comes first: a number above 12 is no month, and with points the day is always first."""
    matches = [each for each in map(_YEAR_LAST.fullmatch, words) if each is not None]
    if not matches:
        raise ValueError(f"{words[0][:40] if words else ''!r} is no date")
    if matches[0]["sep"] == ".":
        return True
    first, second = (max(int(match[key]) for match in matches) for key in "ab")
    if (first > 12) == (second > 12):
        raise ValueError(
            f"{words[0][:40]!r} has the day first or the month first; write unit = 'date-time d/m/y' or unit = "
            "'date-time m/d/y' in [columns.t_s]"
        )
    return first > 12


def _parts(word: str, form: re.Pattern[str], *, day_first: bool) -> datetime:
    match = form.fullmatch(word)
    if match is None:
        raise ValueError(f"{word[:40]!r} is no date like the others")
    a = int(match["a"])
    b = int(match["b"]) if match["b"].isdigit() else _MONTHS.index(match["b"][:3].lower()) + 1
    month, day = (b, a) if day_first else (a, b)
    try:
        return datetime(int(match["y"]), month, day) + _clock(match)  # noqa: DTZ001  as the file has it, UTC
    except ValueError as error:
        raise ValueError(f"{word[:40]!r}: {error}") from error


def _clock(match: re.Match[str]) -> timedelta:
    hour, half = int(match["h"]), (match["half"] or "").lower()
    if half and not 1 <= hour <= 12:
        raise ValueError(f"{match[0][:40]!r} is no time of day")
    if half:
        hour = hour % 12 + 12 * (half == "pm")
    minute, second = int(match["min"]), int(match["s"] or 0)
    if hour > 23 or minute > 59 or second > 60:
        raise ValueError(f"{match[0][:40]!r} is no time of day")
    return timedelta(hours=hour, minutes=minute, seconds=second, microseconds=int(f"{match['f'] or 0:0<6}"[:6]))


def _times_of_day(words: Sequence[str]) -> Instants:
    """Return the times since the first; after midnight they go on."""
    seconds_of_day = []
    for word in words:
        each = _OF_DAY.fullmatch(word)
        if each is None:
            raise ValueError(f"{word[:40]!r} is no time of day like the others")
        seconds_of_day.append(_clock(each) / timedelta(seconds=1))
    t_s = np.unwrap(np.array(seconds_of_day), period=_DAY.total_seconds())
    return Instants(t_s - t_s[0], None)


def _since_first(moments: Sequence[datetime]) -> Instants:
    naive = np.array(moments, dtype="datetime64[us]")
    return Instants((naive - naive[0]) / np.timedelta64(1, "s"), moments[0].replace(tzinfo=UTC))
