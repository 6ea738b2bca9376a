"""Looks at the bench: polls chamber and units, writes the environment down, holds what it sees against the guards."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Literal

from instruments.errors import InstrumentError, LinkError
from instruments.interfaces.chamber import ChamberState
from instruments.interfaces.gyro import Gyro, Readings
from instruments.interfaces.table import Spin
from procedures.contracts.bench import Bench
from procedures.contracts.journal import EnvironmentSample, Event
from procedures.monitoring.bench_snapshot import BenchSnapshot, ReadingCounts, gyro_temperature_c
from procedures.monitoring.guards import Guards, GuardViolation
from procedures.monitoring.recorder import CampaignRecorder

Listener = Callable[[float, float, Mapping[str, float]], None]  #: campaign time, air and unit temperatures

LinkState = Literal["degraded", "lost"]  #: silent for a moment; silent for too long
WHILE_READING = {
    "chamber_deviation",
    "damaged_readings",
    "invalid_readings",
    "rate",
    "unit_off_air",
}  #: armed only during a data set


class BenchMonitor:
    """The eyes of a campaign.

    A device that is silent for a moment is noted and asked again at the next look; the guard on stale readings ends
    that patience. A limit that is passed is an event once, when it trips, and once more when it holds again.
    """

    def __init__(self, bench: Bench, guards: Guards, log: CampaignRecorder) -> None:
        self._bench = bench
        self._guards = guards
        self._log = log
        self._listeners: list[Listener] = []
        self._tripped: set[tuple[str, str]] = set()
        self._heard_s: dict[str, float] = {}
        self._links: dict[str, LinkState] = {}
        self._chamber: ChamberState | None = None
        self._gyro_c: dict[str, float] = {}
        self._spin: Spin | None = None
        self._tallies: Mapping[str, ReadingCounts] = {}
        self._taking_readings = False
        self._next_look_s = 0.0
        self.run = 0  #: powered session; 0 while the units are off

    def begin(self) -> None:
        """Look for the first time; here a silent chamber is an error at once. Raises InstrumentError."""
        self._chamber = self._bench.chamber.read()
        self._heard_s = {self._bench.chamber.name: self._log.t_s()}

    def powered(self, run: int) -> None:
        """Take in that the units were switched on (session number) or off (0)."""
        self.run = run
        self._gyro_c = {}
        self._log.board.live.forget()
        for name in self._bench.gyros:
            self._links.pop(name, None)
            self._heard_s.pop(name, None)
            if run:
                self._heard_s[name] = self._log.t_s()

    def forget(self, gyro: str) -> None:
        """Take in that a unit takes no further part."""
        self._log.board.live.forget(gyro)
        self._gyro_c.pop(gyro, None)
        self._heard_s.pop(gyro, None)
        self._tripped = {each for each in self._tripped if each[1] != gyro}

    @property
    def taking(self) -> bool:
        """Whether readings are taken now."""
        return self._taking_readings

    @property
    def chamber_c(self) -> float:
        """Air temperature at the last look."""
        assert self._chamber is not None
        return self._chamber.temperature_c

    @property
    def setpoint_c(self) -> float:
        """Set point of the chamber at the last look."""
        assert self._chamber is not None
        return self._chamber.setpoint_c

    @contextmanager
    def telling(self, listener: Listener) -> Iterator[None]:
        """Let somebody hear of every look while the block runs, also of those during a pause."""
        self._listeners.append(listener)
        try:
            yield
        finally:
            self._listeners.remove(listener)

    @contextmanager
    def taking_readings(
        self, spin: Spin | None = None, tallies: Mapping[str, ReadingCounts] | None = None
    ) -> Iterator[None]:
        """Arm the guards on rate, readings and the air's deviation while the block runs."""
        self._taking_readings, self._spin, self._tallies = True, spin, tallies or {}
        self._log.board.update(rate_dps=spin.rate_dps if spin else 0.0)
        try:
            yield
        finally:
            self._taking_readings, self._spin, self._tallies = False, None, {}
            self._tripped = {each for each in self._tripped if each[0] not in WHILE_READING}  # disarmed, not released
            self._log.board.update(rate_dps=0.0)

    def heard(self, name: str, gyro: Gyro, readings: Readings) -> None:
        """Take in that a unit sent readings."""
        self._heard_s[name] = self._log.t_s()
        self._log.board.live.heard(name, gyro, readings, self._log.start_s)
        if (temperature_c := gyro_temperature_c(gyro, readings)) is not None:
            self._gyro_c[name] = temperature_c

    def due(self, within_s: float = 0.0) -> bool:
        """Return whether the chamber is to be looked at again within `within_s`."""
        return self._log.t_s() + within_s >= self._next_look_s

    def look(self, every_s: float, *, read_latest: bool = True) -> list[GuardViolation]:
        """Poll the chamber and, unless their streams are being read, the units; returns the limits that are passed."""
        self._next_look_s = self._log.t_s() + every_s
        air_heard = self._poll_chamber()
        if read_latest and self.run:
            self._glance()
        t_s = self._log.t_s()
        self._log.board.update(t_s, chamber_c=self.chamber_c, setpoint_c=self.setpoint_c, gyro_c=dict(self._gyro_c))
        if air_heard:
            sample = EnvironmentSample(t_s, self.run, self.chamber_c, self.setpoint_c, dict(self._gyro_c))
            self._log.journal.environment(sample)
            for listener in self._listeners:
                listener(t_s, self.chamber_c, self._gyro_c)
        return self.judge()

    def judge(self) -> list[GuardViolation]:
        """Hold what is known now against the guards; writes down what has changed since the last time."""
        trips = self._guards.check(self._situation())
        for trip in trips:
            if trip.kind == "stale":
                self.link(trip.device, "lost", trip.message)
        tripped: set[tuple[str, str]] = {(trip.kind, trip.device) for trip in trips}
        for trip in trips:
            if (trip.kind, trip.device) not in self._tripped:
                self._log.event(trip.event())
        for kind, device in sorted(self._tripped - tripped):
            self._log.event(Event(f"guard.{kind}", f"{device}: within its limit again", device=device))
        self._tripped = tripped
        return trips

    def _situation(self) -> BenchSnapshot:
        assert self._chamber is not None
        t_s = self._log.t_s()
        return BenchSnapshot(
            t_s=t_s,
            chamber_c=self._chamber.temperature_c,
            setpoint_c=self._chamber.setpoint_c,
            alarms=self._chamber.alarms,
            gyro_c=self._gyro_c,
            silent_s={device: t_s - heard_s for device, heard_s in self._heard_s.items()},
            taking_readings=self._taking_readings,
            asked_dps=self._spin.asked_dps if self._spin else 0.0,
            rate_dps=self._spin.rate_dps if self._spin else 0.0,
            tallies=self._tallies,
        )

    def _poll_chamber(self) -> bool:
        name = self._bench.chamber.name
        try:
            self._chamber = self._bench.chamber.read()
        except LinkError as error:
            self._note_silence(name, error)
            return False
        self._heard_s[name] = self._log.t_s()
        self.link(name, "well")
        return True

    def _glance(self) -> None:
        for name, gyro in self._bench.gyros.items():
            try:
                if name in self._links:
                    gyro.start()  # a port that broke is opened again
                readings = gyro.read_latest()
            except LinkError as error:
                self._note_silence(name, error)
                continue
            self.heard(name, gyro, readings)
            self.link(name, "well")

    def _note_silence(self, device: str, error: InstrumentError) -> None:
        self._gyro_c.pop(device, None)
        self.link(device, "degraded", f"{error}; asked again at the next look")

    def link(self, device: str, state: Literal["well", "degraded", "lost"], why: str = "") -> None:
        """Take in how a device can be reached; a change is an event. What is lost is not merely degraded again."""
        before = self._links.get(device, "well")
        if state == before or (before == "lost" and state == "degraded"):
            return
        if state == "well":
            del self._links[device]
            self._log.event(Event("link.well", f"{device}: answers again", device=device))
        else:
            self._links[device] = state
            level = "warning" if state == "degraded" else "error"
            self._log.event(Event(f"link.{state}", why, level=level, device=device))
        self._log.board.update(links=dict(self._links))
