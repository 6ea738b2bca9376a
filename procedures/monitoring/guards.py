"""Limits that are watched while anything runs. Each is checked at every poll."""

from __future__ import annotations

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
class Excess:
    """A value beyond its limit, before the recipe has said what that leads to."""

    device: str
    value: float
    limit: float
    unit: str
    text: str


Check = Callable[["Guards", BenchSnapshot], Iterator[Excess]]


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

    def check(self, now: BenchSnapshot) -> list[GuardViolation]:
        """Return every limit that is passed at this moment."""
        return [
            GuardViolation(
                kind,
                self.rules.action_of(kind),
                excess.device,
                excess.value,
                excess.limit,
                excess.unit,
                f"{excess.device}: {excess.text}: {excess.value:.6g} {excess.unit}".rstrip()
                + f", limit {excess.limit:.6g}",
            )
            for kind, check in CHECKS.items()
            for excess in check(self, now)
        ]


def _outside(device: str, value_c: float, low_c: float, high_c: float, text: str) -> Iterator[Excess]:
    if not low_c <= value_c <= high_c:
        yield Excess(device, value_c, low_c if value_c < low_c else high_c, "deg C", text)


def _chamber_limits(guards: Guards, now: BenchSnapshot) -> Iterator[Excess]:
    limits, margin_c = guards.limits.chamber, guards.rules.chamber_margin_c
    if limits is None or now.chamber_c is None:
        return iter(())
    text = "the air is beyond the limits of the chamber"
    return _outside(guards.chamber, now.chamber_c, limits.min_c - margin_c, limits.max_c + margin_c, text)


def _unit_air(guards: Guards, now: BenchSnapshot) -> Iterator[Excess]:
    margin_c = guards.rules.chamber_margin_c
    if now.chamber_c is None:
        return
    for name, unit in guards.limits.gyros.items():
        text = f"the air is beyond what unit {name} may be exposed to"
        yield from _outside(guards.chamber, now.chamber_c, unit.min_c - margin_c, unit.max_c + margin_c, text)


def _unit_temperature(guards: Guards, now: BenchSnapshot) -> Iterator[Excess]:
    margin_c = guards.rules.gyro_margin_c
    for name, temperature_c in now.gyro_c.items():
        unit = guards.limits.gyros[name]
        yield from _outside(name, temperature_c, unit.min_c - margin_c, unit.max_c + margin_c, "its own thermometer")


def _chamber_deviation(guards: Guards, now: BenchSnapshot) -> Iterator[Excess]:
    if now.chamber_c is None or now.setpoint_c is None:
        return
    if any(True for _ in _foreign_change(guards, now)) and guards.rules.action_of("foreign_change") != "warn":
        return  # the air follows what others have set: what is done about that also ends the data set
    off_c = abs(now.chamber_c - now.setpoint_c)
    if now.taking_readings and off_c > guards.rules.chamber_deviation_c:
        text = f"the air left its set point of {now.setpoint_c:g} deg C while readings were taken"
        yield Excess(guards.chamber, off_c, guards.rules.chamber_deviation_c, "deg C", text)


def _unit_off_air(guards: Guards, now: BenchSnapshot) -> Iterator[Excess]:
    limit_c = guards.rules.max_gyro_off_air_c
    if now.chamber_c is None:
        return
    for name, temperature_c in now.gyro_c.items():
        off_c = abs(temperature_c - now.chamber_c)
        if now.taking_readings and off_c > limit_c:
            text = f"its own thermometer differs from the air, {now.chamber_c:.1f} deg C, by"
            yield Excess(name, off_c, limit_c, "deg C", text)


def _chamber_alarm(guards: Guards, now: BenchSnapshot) -> Iterator[Excess]:
    if now.alarms:
        yield Excess(guards.chamber, float(len(now.alarms)), 0.0, "", f"alarms ({', '.join(now.alarms)})")


def _foreign_change(guards: Guards, now: BenchSnapshot) -> Iterator[Excess]:
    if now.foreign and not now.attended:
        yield Excess(guards.chamber, float(len(now.foreign)), 0.0, "", f"changed by others ({'; '.join(now.foreign)})")


def _stale(guards: Guards, now: BenchSnapshot) -> Iterator[Excess]:
    for device, silent_s in now.silent_s.items():
        if silent_s > guards.rules.stale_s:
            yield Excess(device, silent_s, guards.rules.stale_s, "s", "no answer; check cable and power")


def _damaged(guards: Guards, now: BenchSnapshot) -> Iterator[Excess]:
    for name, count in now.counts.items():
        yield from _fraction(name, count.damaged, count.base, guards.rules.max_damaged_fraction, "lost or damaged")


def _invalid(guards: Guards, now: BenchSnapshot) -> Iterator[Excess]:
    for name, count in now.counts.items():
        yield from _fraction(name, count.invalid, count.base, guards.rules.max_invalid_fraction, "marked bad")


def is_too_many(count: float, base: float, limit: float) -> bool:
    """Return whether `count` of `base` readings are more than the share `limit`; a single one is never a trend."""
    return count > 1 + limit * base


def _fraction(name: str, count: int, base: float, limit: float, quantity: str) -> Iterator[Excess]:
    if is_too_many(count, base, limit):
        yield Excess(name, 100 * count / base, 100 * limit, "%", f"readings {quantity}")


def _rate(guards: Guards, now: BenchSnapshot) -> Iterator[Excess]:
    limit_dps = guards.rules.max_rate_error_fraction * abs(now.asked_dps)
    off_dps = abs(now.rate_dps - now.asked_dps)
    if off_dps > limit_dps:
        text = f"runs {now.rate_dps:g} deg/s instead of {now.asked_dps:g} deg/s, off by"
        yield Excess(guards.table, off_dps, limit_dps, "deg/s", text)


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
