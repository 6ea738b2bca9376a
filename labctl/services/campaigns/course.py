"""The temperatures that were logged while a campaign ran, few enough for a picture."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from labctl.answers.course import CourseResponse
from labctl.natural_order import natural_key
from labctl.store import Store

Column = NDArray[np.float64]
Logged = dict[str, NDArray[np.generic]]  #: columns of one unit


def campaign_course(store: Store, campaign: int, points: int, from_s: float = 0.0) -> CourseResponse:
    """Return at most about `points` samples of the environment of a campaign from a time, s, on. Raises NotFound."""
    row = store.campaigns.get(campaign)
    serials = sorted(row.recordings, key=natural_key)
    units = {serial: store.recordings.environment(row.recordings[serial]) for serial in serials}
    logged = {serial: columns for serial, columns in units.items() if columns}
    logged = {serial: _since(columns, from_s) for serial, columns in logged.items()}
    times = [np.asarray(columns["t_s"], dtype=np.float64) for columns in logged.values()]
    t_s = np.unique(np.concatenate([np.zeros(0), *times]))
    # units that are switched on are logged together: the air of any of them is that of all
    air = {name: _merged(t_s, logged, name) for name in ("chamber_c", "chamber_setpoint_c")}
    own = {serial: _merged(t_s, {serial: columns}, "temperature_c") for serial, columns in logged.items()}
    shown = _extremes(air["chamber_c"] if np.isfinite(air["chamber_c"]).any() else _first(own, len(t_s)), points)
    return CourseResponse(
        campaign=campaign, samples=len(t_s), t_s=t_s[shown].tolist(), chamber_c=_listed(air["chamber_c"][shown]),
        setpoint_c=_listed(air["chamber_setpoint_c"][shown]),
        units_c={serial: _listed(values[shown]) for serial, values in own.items()},
    )  # fmt: skip


def _since(columns: Logged, from_s: float) -> Logged:
    kept = columns["t_s"].astype(np.float64) >= from_s
    return {name: values[kept] for name, values in columns.items()}


def _merged(
    t_s: NDArray[np.float64], units: dict[str, dict[str, NDArray[np.generic]]], name: str
) -> NDArray[np.float64]:
    """Return a column of the units at times (n,); NaN where none has it."""
    merged = np.full(len(t_s), np.nan)
    for columns in units.values():
        if name in columns:
            merged[np.searchsorted(t_s, columns["t_s"].astype(np.float64))] = columns[name].astype(np.float64)
    return merged


def _first(columns: dict[str, Column], n: int) -> Column:
    return next(iter(columns.values()), np.full(n, np.nan))


def _extremes(values: Column, points: int) -> NDArray[np.int64]:
    """Return the indices of values (n,) to show: all, or the ends and the lowest and highest of each span."""
    n = len(values)
    if n <= points:
        return np.arange(n)
    chosen = [0, n - 1]
    for span in np.array_split(np.arange(n), max(points // 2 - 1, 1)):
        known = span[np.isfinite(values[span])]
        chosen += [span[0]] if not len(known) else [known[np.argmin(values[known])], known[np.argmax(values[known])]]
    return np.unique(np.array(chosen, dtype=np.int64))


def _listed(values: Column) -> list[float | None]:
    return [float(value) if np.isfinite(value) else None for value in values]
