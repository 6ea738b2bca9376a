"""Time stamps of a recording that are not in seconds, or count from another instant."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from labctl.recording.recording import Columns
from labctl.recording.sanity.finding import Finding
from labctl.recording.sanity.summary import Summary

#: Units that time stamps come in, and how many of them are a second.
UNITS = {"ms": 1e3, "us": 1e6, "ns": 1e9}
#: A ratio within this share of a unit's is that unit.
NEAR_UNIT = 0.25
#: A table angle tells the unit of time from this rate on, deg/s; the angle may be off by this share.
TELLING_DPS, ANGLE_SETS = 1.0, 3
#: Readings this far apart, s, or recordings that last so long, are not in seconds.
SLOW_STEP_S, LONG_S = 60.0, 1e7
#: Whole numbers are what a counter of ms or us has: of them readings are in question that are this far apart, s.
WHOLE_STEP_S = 5.0
#: Readings within a data set that slow are no data set of a minute.
MIN_READINGS = 16
#: Time stamps that begin later than this after `started_at`, s, count from somewhere else.
LATE_S = 1e8


def check_time(summary: Summary, environment: Columns | None = None) -> Iterator[Finding]:
    """Yield what is wrong with the time stamps."""
    begin = np.asarray(summary["t_begin_s"], dtype=np.float64)
    if not np.isfinite(begin).all() or not len(begin):
        return
    yield from _unit(summary, environment)
    yield from _origin(summary, float(begin[0]))


def _unit(summary: Summary, environment: Columns | None) -> Iterator[Finding]:
    step = np.asarray(summary["step_s"], dtype=np.float64)
    usual = float(np.nanmedian(step)) if np.isfinite(step).any() else np.nan
    for evidence, ratio in (
        (
            f"successive time stamps differ by {usual:.4g}, but sample_rate_hz = {summary.info.sample_rate_hz or 0:g}",
            _by_rate(summary, usual),
        ),
        ("the rate of change of the table angle differs from the table's rate", _by_angle(summary)),
        ("the times of the environment end at another value", _by_environment(summary, environment)),
    ):
        unit = next((name for name, per_s in UNITS.items() if abs(np.log(max(ratio, 1e-12) / per_s)) < NEAR_UNIT), None)
        if unit is not None:
            text = f"the time stamps are in {unit}: {evidence}"
            do = f"divide column t_s by {UNITS[unit]:g}"
            yield Finding("time_unit", "certain", "column t_s", text, ratio, "per s", "seconds", do)
            return
    span = float(summary["t_end_s"][-1] - summary["t_begin_s"][0])
    slow = (
        summary.info.sample_rate_hz is None and usual > (WHOLE_STEP_S if _whole(summary) else SLOW_STEP_S)
        and float(np.median(np.asarray(summary["n"], dtype=np.float64))) >= MIN_READINGS
    )  # fmt: skip
    if slow or span > LONG_S:
        text = (
            f"a reading every {usual:.4g} s" if slow else f"the recording lasts {span:.3g} s ({span / 86400:.0f} days)"
        )
        do = "if the time stamps are in ms or us, divide column t_s by 1e3 or 1e6; if not, give sample_rate_hz"
        value = usual if slow else span
        yield Finding("time_unit", "likely", "column t_s", text, value, "s", "seconds", do)


def _whole(summary: Summary) -> bool:
    """Whether the data sets begin and end at whole numbers, with whole steps between."""
    ends = np.concatenate([np.asarray(summary[name], dtype=np.float64) for name in ("t_begin_s", "t_end_s", "step_s")])
    ends = ends[np.isfinite(ends)]
    return bool(np.all(ends == np.round(ends)))


def _by_rate(summary: Summary, usual: float) -> float:
    rate_hz = summary.info.sample_rate_hz
    return usual * rate_hz if rate_hz and np.isfinite(usual) else 1.0


def _by_angle(summary: Summary) -> float:
    """Return how many units of time are a second by the table's angle; 1 where it does not say."""
    rate, turning = (np.asarray(summary[name], dtype=np.float64) for name in ("table_rate_dps", "turning_dps"))
    telling = np.isfinite(turning) & (np.abs(rate) > TELLING_DPS) & (turning != 0)
    return float(np.median(rate[telling] / turning[telling])) if telling.sum() >= ANGLE_SETS else 1.0


def _by_environment(summary: Summary, environment: Columns | None) -> float:
    """Return the end of the data sets over that of the environment; 1 without an environment."""
    if environment is None or "t_s" not in environment or len(environment["t_s"]) < 2:
        return 1.0
    theirs = np.asarray(environment["t_s"], dtype=np.float64)
    span = float(np.ptp(theirs))
    return float(summary["t_end_s"][-1] - summary["t_begin_s"][0]) / span if span > 0 else 1.0


def _origin(summary: Summary, first_s: float) -> Iterator[Finding]:
    if abs(first_s) <= LATE_S:
        return
    text = (
        f"the first reading is at {first_s:.6g} s: the time stamps count from another instant, such as 1970, not "
        "from started_at"
    )
    begun = summary.info.measured_at
    instant = f"the instant of started_at ({begun:%Y-%m-%d %H:%M} UTC)" if begun else "the time of the first reading"
    do = f"subtract {instant} from column t_s"
    yield Finding("time_origin", "likely", "column t_s", text, first_s, "s", "seconds since started_at", do)
