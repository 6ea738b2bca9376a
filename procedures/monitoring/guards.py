"""Limits that are watched while anything runs. Each is checked at every poll."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

from procedures.contracts.errors import GuardTripped
from procedures.contracts.journal import Event
from procedures.monitoring.bench_snapshot import BenchSnapshot
from procedures.planning.limits import BenchLimits
from procedures.recipe.rules import Action, GuardKind, GuardRules


@dataclass(frozen=True)
class GuardViolation:
    """A limit that was passed."""

    kind: GuardKind
    action: Action
    device: str
    value: float
    limit: float
    unit: str
    message: str

    def event(self) -> Event:
        """Return the event for the journal."""
        return Event(
            kind=f"guard.{self.kind}",
            message=self.message,
            level="warning" if self.action == "warn" else "error",
            device=self.device,
            value=self.value,
            limit=self.limit,
            unit=self.unit,
        )

    def error(self) -> GuardTripped:
        """Return what ends the step."""
        return GuardTripped(self.kind, self.action, self.message, self.device)


@dataclass(frozen=True)
class WatchedValue:
    """A value that is watched now, and the limits that it has to keep, before the recipe has said what a trip does."""

    device: str
    value: float
    low: float  #: minus infinity: none
    high: float
    unit: str
    title: str  #: what is watched
    text: str  #: what is wrong where it is beyond its limit
    is_beyond: bool

    @property
    def limit(self) -> float:
        """The limit that was passed, or that on the side of the value."""
        return self.low if self.value < self.low else self.high


Check = Callable[["Guards", BenchSnapshot], Iterator[WatchedValue]]


class Guards:
    """All limits of one campaign."""

    def __init__(
        self,
        rules: GuardRules,
        limits: BenchLimits | Callable[[], BenchLimits],
        chamber: str = "chamber",
        table: str = "table",
    ) -> None:
        self.rules = rules
        self._limits = limits
        self.chamber = chamber
        self.table = table

    @property
    def limits(self) -> BenchLimits:
        """The limits of the bench; its controllers are asked at first use."""
        if not isinstance(self._limits, BenchLimits):
            self._limits = self._limits()
        return self._limits

    def watched(self, now: BenchSnapshot) -> Iterator[tuple[GuardKind, WatchedValue]]:
        """Yield every value that is watched at this moment."""
        for kind, check in CHECKS.items():
            for watched in check(self, now):
                yield kind, watched

    def violation(self, kind: GuardKind, watched: WatchedValue) -> GuardViolation:
        """Return what a value beyond its limit leads to by the rules of the recipe."""
        return GuardViolation(
            kind,
            self.rules.action_of(kind),
            watched.device,
            watched.value,
            watched.limit,
            watched.unit,
            f"{watched.device}: {watched.text}: {watched.value:.6g} {watched.unit}".rstrip()
            + f", limit {watched.limit:.6g}",
        )

    def check(self, now: BenchSnapshot) -> list[GuardViolation]:
        """Return every limit that is passed at this moment."""
        return [self.violation(kind, watched) for kind, watched in self.watched(now) if watched.is_beyond]


def _between(device: str, value_c: float, limits_c: tuple[float, float], title: str, text: str) -> WatchedValue:
    low_c, high_c = limits_c
    return WatchedValue(device, value_c, low_c, high_c, "deg C", title, text, not low_c <= value_c <= high_c)


def _at_most(device: str, value: float, limit: float, unit_symbol: str, title: str, text: str) -> WatchedValue:
    return WatchedValue(device, value, -math.inf, limit, unit_symbol, title, text, value > limit)


def _chamber_limits(guards: Guards, now: BenchSnapshot) -> Iterator[WatchedValue]:
    limits, margin_c = guards.limits.chamber, guards.rules.chamber_margin_c
    if limits is None or now.chamber_c is None:
        return
    text = "the air is beyond the limits of the chamber"
    limits_c = limits.min_c - margin_c, limits.max_c + margin_c
    yield _between(guards.chamber, now.chamber_c, limits_c, "air, limits of the chamber", text)


def _unit_air(guards: Guards, now: BenchSnapshot) -> Iterator[WatchedValue]:
    margin_c = guards.rules.chamber_margin_c
    if now.chamber_c is None:
        return
    for name, limits in guards.limits.gyros.items():
        text = f"the air is beyond what unit {name} may be exposed to"
        limits_c = limits.min_c - margin_c, limits.max_c + margin_c
        yield _between(guards.chamber, now.chamber_c, limits_c, f"air, limits of {name}", text)


def _unit_temperature(guards: Guards, now: BenchSnapshot) -> Iterator[WatchedValue]:
    margin_c = guards.rules.gyro_margin_c
    for name, temperature_c in now.gyro_c.items():
        limits = guards.limits.gyros[name]
        limits_c, text = (limits.min_c - margin_c, limits.max_c + margin_c), "its own thermometer"
        yield _between(name, temperature_c, limits_c, text, text)


def _chamber_deviation(guards: Guards, now: BenchSnapshot) -> Iterator[WatchedValue]:
    if now.chamber_c is None or now.setpoint_c is None:
        return
    is_foreign = any(each.is_beyond for each in _foreign_change(guards, now))
    if is_foreign and guards.rules.action_of("foreign_change") != "warn":
        return  # the air follows what others have set: what is done about that also ends the data set
    if now.taking_readings and not now.air_moves:
        text = f"the air left its set point of {now.setpoint_c:g} deg C while readings were taken"
        off_c = abs(now.chamber_c - now.setpoint_c)
        yield _at_most(guards.chamber, off_c, guards.rules.chamber_deviation_c, "deg C", "air off its set point", text)


def _unit_off_air(guards: Guards, now: BenchSnapshot) -> Iterator[WatchedValue]:
    if now.chamber_c is None or not now.taking_readings or now.air_moves:
        return
    text = f"its own thermometer differs from the air, {now.chamber_c:.1f} deg C, by"
    for name, temperature_c in now.gyro_c.items():
        off_c = abs(temperature_c - now.chamber_c)
        yield _at_most(name, off_c, guards.rules.max_gyro_off_air_c, "deg C", "off the air", text)


def _chamber_alarm(guards: Guards, now: BenchSnapshot) -> Iterator[WatchedValue]:
    if now.chamber_c is not None or now.alarms:
        text = f"alarms ({', '.join(now.alarms)})"
        yield _at_most(guards.chamber, float(len(now.alarms)), 0.0, "", "alarms", text)


def _foreign_change(guards: Guards, now: BenchSnapshot) -> Iterator[WatchedValue]:
    if (now.chamber_c is not None or now.foreign) and not now.attended:
        text = f"changed by others ({'; '.join(now.foreign)})"
        yield _at_most(guards.chamber, float(len(now.foreign)), 0.0, "", "changed by others", text)


def _stale(guards: Guards, now: BenchSnapshot) -> Iterator[WatchedValue]:
    for device, silent_s in now.silent_s.items():
        yield _at_most(device, silent_s, guards.rules.stale_s, "s", "silent", "no answer; check cable and power")


def _damaged(guards: Guards, now: BenchSnapshot) -> Iterator[WatchedValue]:
    for name, count in now.counts.items():
        yield _fraction(name, count.damaged, count.base, guards.rules.max_damaged_fraction, "lost or damaged")


def _invalid(guards: Guards, now: BenchSnapshot) -> Iterator[WatchedValue]:
    for name, count in now.counts.items():
        yield _fraction(name, count.invalid, count.base, guards.rules.max_invalid_fraction, "marked bad")


def is_too_many(count: float, base: float, limit: float) -> bool:
    """Return whether `count` of `base` readings are more than the share `limit`; a single one is never a trend."""
    return count > 1 + limit * base


def _fraction(name: str, count: int, base: float, limit: float, quantity: str) -> WatchedValue:
    share, title = 100 * count / base if base else 0.0, f"readings {quantity}"
    return WatchedValue(name, share, -math.inf, 100 * limit, "%", title, title, is_too_many(count, base, limit))


def _rate(guards: Guards, now: BenchSnapshot) -> Iterator[WatchedValue]:
    if now.taking_readings or now.rate_dps != now.asked_dps:
        text = f"runs {now.rate_dps:g} deg/s instead of {now.asked_dps:g} deg/s, off by"
        limit_dps = guards.rules.max_rate_error_fraction * abs(now.asked_dps)
        title = "rate error" if now.asked_dps else "motion while at rest"
        yield _at_most(guards.table, abs(now.rate_dps - now.asked_dps), limit_dps, "deg/s", title, text)


CHECKS: Mapping[GuardKind, Check] = {
    "chamber_limits": _chamber_limits,
    "unit_air": _unit_air,
    "unit_temperature": _unit_temperature,
    "chamber_deviation": _chamber_deviation,
    "chamber_alarm": _chamber_alarm,
    "foreign_change": _foreign_change,
    "stale": _stale,
    "damaged_readings": _damaged,
    "invalid_readings": _invalid,
    "rate": _rate,
    "unit_off_air": _unit_off_air,
}
