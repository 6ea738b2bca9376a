"""Polls chamber and units, records the environment and checks what was read against the guards."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from typing import Literal

import numpy as np

from instruments.errors import InstrumentError, LinkError
from instruments.interfaces.chamber import ChamberState
from instruments.interfaces.gyro import Gyro, Readings
from instruments.interfaces.reference import Reference
from instruments.interfaces.table import Spin
from procedures.contracts.bench import MonitoredBench
from procedures.contracts.journal import EnvironmentSample, Event
from procedures.monitoring.bench_snapshot import BenchSnapshot, ReadingCounts, gyro_temperature_c
from procedures.monitoring.event_recorder import CampaignRecorder
from procedures.monitoring.guards import Guards, GuardViolation
from procedures.monitoring.host_stalls import HostStalls, not_run
from procedures.monitoring.progress import WatchedLimit

LinkState = Literal["well", "degraded", "lost"]  #: degraded: silent for a moment; lost: silent for too long


class LinkStates:
    """The links of one bench. A change of state is an event; only what is not well is shown in the progress."""

    def __init__(self, recorder: CampaignRecorder, stalls: HostStalls) -> None:
        self._recorder, self._stalls = recorder, stalls
        #: device -> campaign time, and the stalls of this computer until then, s of the bench's clock
        self._heard_s: dict[str, tuple[float, float]] = {}
        self._broken: dict[str, LinkState] = {}

    def restart(self) -> None:
        """Reset the times of the devices' last answers."""
        self._heard_s = {}

    def heard(self, device: str) -> None:
        """Note that a device answered just now."""
        self._heard_s[device] = self._recorder.t_s(), self._stalls.total_clock_s()

    def forget(self, device: str, *, repaired: bool = False) -> None:
        """Note that a device no longer answers; with `repaired` a broken link is well again without an event."""
        self._heard_s.pop(device, None)
        if repaired:
            self._broken.pop(device, None)

    def is_broken(self, device: str) -> bool:
        """Return whether a device is degraded or lost."""
        return device in self._broken

    def silent_s(self, t_s: float) -> dict[str, float]:
        """Return how long each device has been silent at campaign time `t_s`, in s, without this computer's stalls."""
        stalled_s = self._stalls.total_clock_s()
        return {
            device: max(t_s - heard_s - (stalled_s - before_s), 0.0)
            for device, (heard_s, before_s) in self._heard_s.items()
        }

    def is_silent_by_stalls(self, device: str, t_s: float) -> bool:
        """Return whether this computer's stalls are the greater part of a device's silence at campaign time `t_s`."""
        silent_s = self.silent_s(t_s).get(device)
        return silent_s is not None and silent_s < 0.5 * (t_s - self._heard_s[device][0])

    def change(self, device: str, state: LinkState, why: str = "") -> None:
        """Take in how a device can be reached. What is lost is not merely degraded again."""
        before = self._broken.get(device, "well")
        if state == before or (before == "lost" and state == "degraded"):
            return
        if state == "well":
            del self._broken[device]
            self._recorder.event(Event("link.well", f"{device}: answers again", device=device))
        else:
            self._broken[device] = state
            level = "warning" if state == "degraded" else "error"
            self._recorder.event(Event(f"link.{state}", why, level=level, device=device))
        self._recorder.tracker.update(links=dict(self._broken))


class ReferenceWatch:
    """Reads each instrument at every poll; its last answer holds until the next one, for as long as the links allow."""

    def __init__(self, references: Mapping[str, Reference], links: LinkStates) -> None:
        self._references, self._links = references, links
        self._raw: dict[str, int] = {}
        self.values: dict[str, float] = {}  #: column -> value, in the unit of its channel

    def begin(self) -> None:
        """Ask each for the first time; here silence is an error at once. Raises InstrumentError."""
        for reference in self._references.values():
            self._take(reference)

    def poll(self, on_silence: Callable[[str, LinkError], None]) -> None:
        """Ask each; one that is silent is reported, and keeps its last value."""
        for name, reference in self._references.items():
            try:
                self._take(reference)
            except LinkError as error:
                on_silence(name, error)
            else:
                self._links.change(name, "well")

    def beside(self, readings: Readings) -> Readings:
        """Return readings of a unit with a column for each quantity, as it was last read."""
        if not self._raw:
            return readings
        columns = {name: np.full(len(readings), value, dtype=np.int64) for name, value in self._raw.items()}
        return replace(readings, raw={**readings.raw, **columns})

    def _take(self, reference: Reference) -> None:
        raw = reference.read().raw
        self._raw |= raw
        self.values |= {
            channel.name: channel.offset + channel.scale * raw[channel.name] for channel in reference.channels
        }
        self._links.heard(reference.name)


Listener = Callable[[float, float, Mapping[str, float]], None]  #: campaign time, air and unit temperatures

WHILE_READING = {
    "chamber_deviation",
    "damaged_readings",
    "invalid_readings",
    "rate",
    "unit_off_air",
}  #: armed only during a data set


class BenchMonitor:
    """Watches one bench during a campaign.

    A device that is silent for a moment is noted and asked again at the next poll, until the guard on stale readings
    trips. A limit that is passed is an event once, when it trips, and once more when it holds again.
    """

    def __init__(
        self, bench: MonitoredBench, guards: Guards, recorder: CampaignRecorder, stalls: HostStalls | None = None
    ) -> None:
        self._bench = bench
        self._guards = guards
        self._recorder = recorder
        self.stalls = stalls or HostStalls(recorder.clock)
        self.links = LinkStates(recorder, self.stalls)
        self.references = ReferenceWatch(bench.references, self.links)
        self._listeners: list[Listener] = []
        self._tripped: set[tuple[str, str]] = set()
        self._chamber: ChamberState | None = None
        self._gyro_c: dict[str, float] = {}
        self._spin: Spin | None = None
        self._counts: Mapping[str, ReadingCounts] = {}
        self.ended_counts: Mapping[str, ReadingCounts] = {}  #: of the data set that ended last
        self._taking_readings = self._attended = False
        self._next_poll_s = 0.0
        self.air_moves = False  #: readings are taken while the temperature moves: the air is off its set point
        self.run = 0  #: powered session; 0 while the units are off

    def begin(self) -> None:
        """Poll the chamber for the first time; here its silence is an error at once. Raises InstrumentError."""
        self.links.restart()
        if (chamber := self._bench.air_chamber) is not None:
            self._chamber = chamber.read()
            self.links.heard(chamber.name)
        self.references.begin()

    def units_powered(self, run: int) -> None:
        """Note that the units were switched on (session number) or off (0)."""
        self.run = run
        self._gyro_c = {}
        self._recorder.tracker.live.forget()
        for name in self._bench.gyros:
            self.links.forget(name, repaired=True)
            if run:
                self.links.heard(name)

    def forget(self, gyro: str) -> None:
        """Note that a unit is excluded from the rest of the campaign."""
        self._recorder.tracker.live.forget(gyro)
        self._gyro_c.pop(gyro, None)
        self.links.forget(gyro)
        self._tripped = {each for each in self._tripped if each[1] != gyro}

    @property
    def is_taking_readings(self) -> bool:
        """Whether readings are taken now."""
        return self._taking_readings

    @property
    def chamber_c(self) -> float:
        """Air temperature at the last poll."""
        assert self._chamber is not None
        return self._chamber.temperature_c

    @property
    def setpoint_c(self) -> float:
        """Set point of the chamber at the last poll."""
        assert self._chamber is not None
        return self._chamber.setpoint_c

    @property
    def air_c(self) -> float | None:
        """Air temperature at the last poll; None without a chamber."""
        return None if self._chamber is None else self._chamber.temperature_c

    @property
    def air_setpoint_c(self) -> float | None:
        """Set point of the chamber at the last poll; None without a chamber."""
        return None if self._chamber is None else self._chamber.setpoint_c

    @property
    def given_c(self) -> float | None:
        """The set point that labctl gave last, by the last poll; None before it did, and without a chamber."""
        return None if self._chamber is None else self._chamber.given_c

    @property
    def _wanted_c(self) -> float | None:
        """The set point that labctl gave, else that of the chamber; None without a chamber."""
        return self.air_setpoint_c if self.given_c is None else self.given_c

    @contextmanager
    def listening(self, listener: Listener) -> Iterator[None]:
        """Call `listener` after every poll while the block runs, also during a pause."""
        self._listeners.append(listener)
        try:
            yield
        finally:
            self._listeners.remove(listener)

    @contextmanager
    def attended(self) -> Iterator[None]:
        """Take what is changed at the bench while the block runs for what a person was asked to do there."""
        self._attended = True
        try:
            yield
        finally:
            self._attended = False

    @contextmanager
    def taking_readings(
        self, spin: Spin | None = None, counts: Mapping[str, ReadingCounts] | None = None
    ) -> Iterator[None]:
        """Arm the guards on rate, readings and the air's deviation while the block runs."""
        self._taking_readings, self._spin, self._counts = True, spin, counts or {}
        self._recorder.tracker.update(rate_dps=spin.rate_dps if spin else 0.0)
        try:
            yield
        finally:
            self.ended_counts = self._counts
            self._taking_readings, self._spin, self._counts = False, None, {}
            self._tripped = {each for each in self._tripped if each[0] not in WHILE_READING}  # disarmed, not released
            self._recorder.tracker.update(rate_dps=0.0)

    def add_readings(self, name: str, gyro: Gyro, readings: Readings) -> None:
        """Note that a unit sent readings."""
        self.links.heard(name)
        self._recorder.tracker.live.heard(name, gyro, readings, self._recorder.time)
        if (temperature_c := gyro_temperature_c(gyro, readings)) is not None:
            self._gyro_c[name] = temperature_c

    def is_due(self, within_s: float = 0.0) -> bool:
        """Return whether the chamber is to be polled again within `within_s`."""
        return self._recorder.t_s() + within_s >= self._next_poll_s

    def poll(self, every_s: float, *, units_until_s: float = math.inf) -> list[GuardViolation]:
        """Poll the chamber and, before campaign time `units_until_s`, the units; returns the limits that are passed.

        A unit that is polled drops all readings but the newest.
        """
        self._next_poll_s = self._recorder.t_s() + every_s
        air_heard = self._poll_chamber()
        self.references.poll(self._note_silence)
        if self.run and self._recorder.t_s() < units_until_s:
            self._poll_units()
        t_s = self._recorder.t_s()
        chamber_c, setpoint_c = self.air_c, self.air_setpoint_c
        gyro_c, references = dict(self._gyro_c), dict(self.references.values)
        self._recorder.tracker.update(
            t_s, chamber_c=chamber_c, setpoint_c=setpoint_c, gyro_c=gyro_c, references=references,
            limits=tuple(self._watched_limits()),
        )  # fmt: skip
        if air_heard:
            sample = EnvironmentSample(t_s, self.run, chamber_c, setpoint_c, gyro_c, references)
            self._recorder.journal.environment(sample)
            if chamber_c is not None:
                for listener in self._listeners:
                    listener(t_s, chamber_c, self._gyro_c)
        return self.check_guards()

    def _watched_limits(self) -> Iterator[WatchedLimit]:
        now = self._snapshot()
        for kind, watched in self._guards.watched(now):
            yield WatchedLimit(
                kind, watched.device, watched.title, watched.value, watched.low if math.isfinite(watched.low) else None,
                watched.high, watched.unit, self._guards.rules.action_of(kind), watched.is_beyond,
                now.silent_s.get(watched.device),
            )  # fmt: skip

    def check_guards(self) -> list[GuardViolation]:
        """Return every limit that is passed by what was read last; records what has changed since the last check."""
        self.tell_stalls()
        violations = self._guards.check(self._snapshot())
        for violation in violations:
            if violation.kind == "stale":
                self.links.change(violation.device, "lost", violation.message)
        tripped: set[tuple[str, str]] = {(violation.kind, violation.device) for violation in violations}
        for violation in violations:
            if (violation.kind, violation.device) not in self._tripped:
                self._recorder.event(violation.event())
        for kind, device in sorted(self._tripped - tripped):
            self._recorder.event(Event(f"guard.{kind}", f"{device}: within its limit again", device=device))
        self._tripped = tripped
        return violations

    def _snapshot(self) -> BenchSnapshot:
        t_s = self._recorder.t_s()
        return BenchSnapshot(
            t_s=t_s,
            chamber_c=self.air_c,
            setpoint_c=self._wanted_c,
            alarms=() if self._chamber is None else self._chamber.alarms,
            foreign=() if self._chamber is None else self._chamber.foreign,
            attended=self._attended,
            gyro_c=self._gyro_c,
            silent_s=self.links.silent_s(t_s),
            taking_readings=self._taking_readings,
            air_moves=self.air_moves,
            asked_dps=self._spin.asked_dps if self._spin else 0.0,
            rate_dps=self._spin.rate_dps if self._spin else 0.0,
            counts=self._counts,
        )

    def _poll_chamber(self) -> bool:
        """Read the chamber; returns whether it answered. Without one the units are all of the environment."""
        if (chamber := self._bench.air_chamber) is None:
            return True
        name, before = chamber.name, (self._recorder.t_s(), self.stalls.total_s())
        try:
            self._chamber = chamber.read()
        except LinkError as error:
            self._note_silence(name, error, before)
            return False
        self.links.heard(name)
        self.links.change(name, "well")
        return True

    def _poll_units(self) -> None:
        for name, gyro in self._bench.gyros.items():
            before = self._recorder.t_s(), self.stalls.total_s()
            try:
                if self.links.is_broken(name):
                    gyro.start()  # a port that broke is opened again
                readings = gyro.read_latest()
            except LinkError as error:
                self._note_silence(name, error, before)
                continue
            self.add_readings(name, gyro, readings)
            self.links.change(name, "well")

    def _note_silence(self, device: str, error: InstrumentError, before: tuple[float, float] | None = None) -> None:
        """Note that a device did not answer, or that this computer was not there to hear it for most of the time.

        `before` is the campaign time at which the device was asked, and the total of the stalls then.
        """
        self._gyro_c.pop(device, None)
        why = str(error)
        asked_s, stalled_before_s = before or (math.inf, math.inf)
        stalled_s = self.stalls.total_s() - stalled_before_s
        if stalled_s > 0 and self.stalls.speed * stalled_s > 0.5 * (self._recorder.t_s() - asked_s):
            why = f"{device}: no answer in time, but {not_run(stalled_s)} meanwhile"
        self.links.change(device, "degraded", f"{why}; labctl asks again at the next check")

    def tell_stalls(self, *, at_the_end: bool = False) -> None:
        """Record the stalls of this computer that were not reported yet, and how long they were in all."""
        if (event := self.stalls.news(at_the_end=at_the_end)) is not None:
            self._recorder.event(event)
        if (total_s := self.stalls.total_s()) != self._recorder.tracker.progress.stalled_s:
            self._recorder.tracker.update(stalled_s=total_s)
