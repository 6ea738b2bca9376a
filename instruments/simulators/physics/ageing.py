"""Ageing of a simulated unit: what its bias and its scale factors gain with the calendar, powered or not.

A law has no size unless a bench file gives one. Fibre-optic units age little: Ojeda et al. (2000) found two that
needed no other calibration after a year.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, date, datetime, timedelta

import numpy as np
from numpy.typing import NDArray

from instruments.clock import VIRTUAL_START

Array = NDArray[np.float64]

YEAR_S = timedelta(days=365.25).total_seconds()
BIAS, SCALE_FACTOR, SINCE = "bias_dps_per_year", "scale_factor_per_year", "since"


@dataclass(frozen=True)
class Ageing:
    """Drift of each axis per year, in proportion to the time since the day on which the unit was as its profile is."""

    bias_dps_per_year: Array  #: (axes,)
    scale_factor_per_year: Array  #: (axes,), relative
    since: datetime

    def years(self, starts_at: datetime, t_s: Array) -> Array:
        """Return the age of the unit, years, at times (n,) s after an instant; negative before `since`."""
        return ((starts_at - self.since).total_seconds() + t_s) / YEAR_S

    def gain(self, years: Array) -> Array:
        """Return by what the gains of each axis have to be multiplied, (n, axes)."""
        return 1.0 + np.multiply.outer(years, self.scale_factor_per_year)

    def bias_dps(self, years: Array) -> Array:
        """Return what the bias of each axis has gained, (n, axes) deg/s."""
        return np.asarray(np.multiply.outer(years, self.bias_dps_per_year))


def ageing_of(document: object, axes: int) -> Ageing | None:
    """Return the ageing that the settings of a simulated unit state, None where they state none.

    Raises ValueError for what is no such table.
    """
    if document is None:
        return None
    allowed = (BIAS, SCALE_FACTOR, SINCE)
    if not isinstance(document, Mapping) or (unknown := set(document) - set(allowed)):
        given_text = repr(document) if not isinstance(document, Mapping) else ", ".join(sorted(map(str, unknown)))
        raise ValueError(f"simulated unit: ageing has no {given_text}; write a table of {', '.join(allowed)}")
    return Ageing(_per_axis(document, BIAS, axes), _per_axis(document, SCALE_FACTOR, axes), _since(document.get(SINCE)))


def _per_axis(by_axis: Mapping[str, object], name: str, axes: int) -> Array:
    value = by_axis.get(name, 0.0)
    listed: Sequence[object] = value if isinstance(value, list | tuple) else [value] * axes
    numbers = [float(each) for each in listed if isinstance(each, int | float) and np.isfinite(each)]
    if len(numbers) != len(listed) or len(numbers) != axes:
        raise ValueError(f"simulated unit: ageing.{name} = {value!r}: give one number, or {axes}, one for each axis")
    return np.array(numbers)


def _since(value: object) -> datetime:
    """Return the day of a bench file; a campaign keeps it as text."""
    try:
        day = datetime.fromisoformat(value) if isinstance(value, str) else value
    except ValueError:
        day = None
    if value is None:
        return VIRTUAL_START
    if not isinstance(day, date):
        raise ValueError(f"simulated unit: ageing.{SINCE} = {value!r} is not a date; write 2026-01-05")
    moment = day if isinstance(day, datetime) else datetime(day.year, day.month, day.day, tzinfo=UTC)
    return moment.replace(tzinfo=UTC) if moment.tzinfo is None else moment.astimezone(UTC)
