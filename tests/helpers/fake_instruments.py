"""Fake instruments in virtual time: every call is traced, and every call can be made to fail."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from instruments.clock import VirtualClock
from instruments.errors import RequestRejected
from instruments.interfaces.chamber import ChamberLimits, ChamberState
from instruments.interfaces.gyro import Channel, GyroIdentity, GyroLimits, Readings
from instruments.interfaces.table import Spin, TableLimits

TABLE = TableLimits(max_rate_dps=450, max_acceleration_dps2=200, step_deg=0.225)
CHAMBER = ChamberLimits(min_c=-70, max_c=150, resolution_c=0.1, ramp_c_per_min=10)
UNIT = GyroLimits(max_rate_dps=400, min_c=-40, max_c=85)


@dataclass
class Fake:
    """Every call is traced with its time, and fails when a fault is set for it."""

    clock: VirtualClock
    trace: list[str]
    name: str
    faults: dict[str, Callable[[], None]] = field(default_factory=dict)

    def called(self, method: str) -> None:
        self.trace.append(f"{self.name}.{method}")
        if fault := self.faults.get(method):
            fault()

    def fail(self, method: str, error: BaseException, times: int = 10**9) -> None:
        """Let `method` raise `error`, the next `times` times it is called."""
        left = [times]

        def fault() -> None:
            if left[0] > 0:
                left[0] -= 1
                raise error

        self.faults[method] = fault


class FakeTable(Fake):
    limits = TABLE
    rate_error = 1e-5
    moving = False
    rate_dps = 0.0
    short_s = 0.0

    def identify(self) -> str:
        self.called("identify")
        return "fake"

    def achievable_dps(self, rate_dps: float) -> float:
        return rate_dps * (1 + self.rate_error)

    def home(self) -> None:
        self.called("home")
        self.clock.sleep(20)

    def spin(self, rate_dps: float, steady_s: float) -> Spin:
        self.called("spin")
        real_dps = self.achievable_dps(rate_dps)
        self.clock.sleep(abs(rate_dps) / self.limits.max_acceleration_dps2)
        self.moving, self.rate_dps = rate_dps != 0, real_dps
        now_s = self.clock.now_s()
        return Spin(rate_dps, real_dps, now_s, now_s + steady_s - self.short_s, 7.0, self.limits.step_deg)

    def settle(self, spin: Spin) -> None:
        self.called("settle")
        self.clock.sleep(spin.steady_until_s - self.clock.now_s())
        self.moving, self.rate_dps = False, 0.0

    def stop(self) -> None:
        self.called("stop")
        self.moving, self.rate_dps = False, 0.0

    def is_moving(self) -> bool:
        if fault := self.faults.get("is_moving"):  # not traced: it is asked by the clock, not by the order of a step
            fault()
        return self.moving

    def angle_deg(self) -> float:
        return 0.0

    def close(self) -> None:
        self.called("close")


class FakeChamber(Fake):
    limits = CHAMBER
    safe_c = 25.0
    setpoint_c = 25.0
    alarms: tuple[str, ...] = ()
    from_c, from_s = 25.0, 0.0
    misread_c = 0.0
    given_c: float | None = None
    hindrance = ""  #: a set point is refused because of it
    runs = True  #: heating and cooling are on; a set point switches them on

    def at_the_panel(self, setpoint_c: float) -> None:
        """Let a person change the set point."""
        self.from_c, self.from_s, self.setpoint_c = self.air_c(), self.clock.now_s(), setpoint_c

    def disturbance_c(self, t_s: float) -> float:
        return 0.0

    def air_c(self) -> float:
        reach_c = (self.clock.now_s() - self.from_s) * self.limits.ramp_c_per_min / 60
        way_c = self.setpoint_c - self.from_c
        return self.from_c + float(np.clip(way_c, -reach_c, reach_c)) + self.disturbance_c(self.clock.now_s())

    def identify(self) -> str:
        self.called("identify")
        return "fake"

    def set_temperature_c(self, temperature_c: float) -> float:
        self.called("set_temperature_c")
        if self.hindrance:
            raise RequestRejected(self.name, self.hindrance)
        self.at_the_panel(temperature_c)
        self.given_c, self.runs = temperature_c, True
        return temperature_c + self.misread_c

    def read(self) -> ChamberState:
        self.called("read")
        foreign = [self.hindrance] if self.hindrance and self.given_c is not None else []
        if self.given_c is not None and self.setpoint_c != self.given_c:
            foreign.append(f"the set point is {self.setpoint_c:g} deg C, labctl gave {self.given_c:g} deg C")
        if self.given_c is not None and not self.runs:
            foreign.append("event output 1 is off")
        now_s, air_c = self.clock.now_s(), self.air_c()
        return ChamberState(now_s, air_c, self.setpoint_c, self.alarms, self.given_c, tuple(foreign))

    def make_safe(self) -> float:
        self.called("make_safe")
        return self.set_temperature_c(self.safe_c)

    def close(self) -> None:
        self.called("close")


class FakeGyro(Fake):
    axes = ("z",)
    channels = (Channel("gyro_z", "deg/s", 0.001), Channel("temperature_c", "deg C", 0.01, 1.0))
    sample_rate_hz = 10.0
    limits = UNIT
    bench: Any = None
    next_sample = 0
    lost = 0
    invalid = False
    silent = False
    lag_c = 0.0
    started = False
    reported: Mapping[str, str] = {}

    def identify(self) -> GyroIdentity:
        self.called("identify")
        return GyroIdentity("0001", "fake", reported=self.reported)

    def start(self) -> None:
        self.called("start")
        self.started = True
        self.next_sample = self._index()

    def _index(self) -> int:
        return int(np.floor(self.clock.now_s() * self.sample_rate_hz + 1e-9)) + 1

    def temperature_c(self) -> float:
        return self.bench.chamber.air_c() + self.lag_c

    def _readings(self, n: int) -> Readings:
        assert self.started, "read from a stream that was never started"
        first = self.next_sample
        self.next_sample += n
        raw = {
            "gyro_z": np.full(n, round(self.bench.sign * self.bench.table.rate_dps / 0.001)),
            "temperature_c": np.full(n, round((self.temperature_c() - 1.0) / 0.01)),
        }
        t_s = np.arange(first, first + n) / self.sample_rate_hz
        return Readings(t_s, raw, np.full(n, not self.invalid), lost=self.lost)

    def read(self, duration_s: float) -> Readings:
        self.called("read")
        self.clock.sleep(duration_s)
        return self._readings(0 if self.silent else max(self._index() - self.next_sample, 0))

    def read_latest(self) -> Readings:
        self.called("read_latest")
        self.clock.sleep(1 / self.sample_rate_hz)
        self.next_sample = self._index() - 1
        return self._readings(1)

    def stop(self) -> None:
        self.called("stop")
        self.started = False

    def close(self) -> None:
        pass
