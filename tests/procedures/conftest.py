"""A bench of tiny fakes in virtual time, and a journal that remembers: every failure can be made to happen anywhere."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from instruments.clock import VirtualClock
from instruments.interfaces.chamber import ChamberLimits, ChamberState
from instruments.interfaces.gyro import Channel, GyroIdentity, GyroLimits, Readings
from instruments.interfaces.table import Spin, TableLimits
from procedures.contracts.control import Control
from procedures.contracts.operator import UnitHandlerOperator
from procedures.execution.engine import Engine
from procedures.execution.resume import Restart
from procedures.planning.limits import BenchLimits
from procedures.planning.plan import Plan, make_plan
from procedures.recipe.recipe import Recipe

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
        self.from_c, self.from_s = self.air_c(), self.clock.now_s()
        self.setpoint_c = temperature_c
        return temperature_c + self.misread_c

    def read(self) -> ChamberState:
        self.called("read")
        return ChamberState(self.clock.now_s(), self.air_c(), self.setpoint_c, self.alarms)

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

    def identify(self) -> GyroIdentity:
        self.called("identify")
        return GyroIdentity("0001", "fake")

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
            "gyro_z": np.full(n, round(self.bench.table.rate_dps / 0.001)),
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


class RecordingJournal:
    """Keeps everything in the order in which it was handed over; `hooks` are called with every entry's name."""

    def __init__(self, trace: list[str]) -> None:
        self.trace = trace
        self.states: list[tuple[str, str]] = []
        self.steps: list[tuple[str, int, Any]] = []
        self.headers: list[Any] = []
        self.closed: list[tuple[int, str, str]] = []
        self.blocks: list[tuple[int, str, Readings, float]] = []
        self.samples: list[Any] = []
        self.events: list[Any] = []
        self.sessions: list[int] = []
        self.dropped: list[tuple[str, str]] = []
        self.hooks: list[Callable[[str, Any], None]] = []

    def _told(self, what: str, detail: Any) -> None:
        self.trace.append(f"journal.{what}")
        for hook in list(self.hooks):
            hook(what, detail)

    def campaign_state(self, state: Any, reason: str, t_s: float, at: Any) -> None:
        assert at.tzinfo is not None
        self.states.append((str(state), reason))
        self._told("state", state)

    def step_started(self, index: int, t_s: float, at: Any) -> None:
        self.steps.append(("started", index, t_s))
        self._told("step_started", index)

    def step_ended(self, index: int, result: Any, t_s: float, at: Any) -> None:
        self.steps.append(("ended", index, result))
        self._told("step_ended", index)

    def session_began(self, run: int, t_s: float) -> None:
        self.sessions.append(run)
        self._told("session_began", run)

    def unit_dropped(self, gyro: str, reason: str) -> None:
        self.dropped.append((gyro, reason))
        self._told("unit_dropped", gyro)

    def dataset_opened(self, header: Any) -> int:
        self.headers.append(header)
        self._told("dataset_opened", header)
        return len(self.headers)

    def readings(self, dataset: int, gyro: str, readings: Readings, chamber_c: float) -> None:
        self.blocks.append((dataset, gyro, readings, chamber_c))
        self._told("readings", dataset)

    def dataset_closed(self, dataset: int, state: Any, reason: str = "") -> None:
        self.closed.append((dataset, str(state), reason))
        self._told("dataset_closed", dataset)

    def environment(self, sample: Any) -> None:
        self.samples.append(sample)
        self._told("environment", sample)

    def event(self, event: Any, t_s: float, at: Any) -> None:
        self.events.append(event)
        self._told("event", event)

    def kinds(self) -> list[str]:
        return [event.kind for event in self.events]

    def results(self) -> list[Any]:
        return [detail for what, _, detail in self.steps if what == "ended"]


class Rig:
    """A fake bench with everything an engine needs."""

    limits = BenchLimits(TABLE, CHAMBER, {"imu": UNIT})

    def __init__(self, gyros: tuple[str, ...] = ("imu",)) -> None:
        self.clock = VirtualClock()
        self.clock.sleep(1000.25)  # campaign time is not clock time
        self.trace: list[str] = []
        self.table = FakeTable(self.clock, self.trace, "table")
        self.chamber = FakeChamber(self.clock, self.trace, "chamber")
        self.gyros = {name: FakeGyro(self.clock, self.trace, name) for name in gyros}
        for gyro in self.gyros.values():
            gyro.bench = self
        self.imu = self.gyros[gyros[0]]
        self.journal = RecordingJournal(self.trace)
        self.control = Control()
        self.unit_handler = SimpleNamespace(
            mount=lambda position: self.trace.append(f"hand.mount {position}"),
            power=lambda on: self.trace.append(f"hand.power {on}"),
        )
        self.operator: Any = UnitHandlerOperator(self.unit_handler)
        self.engine: Any = None

    def recipe(self, **changes: Any) -> Recipe:
        """A small recipe with every kind of step: two mountings, two powered sessions."""
        values: dict[str, Any] = {
            "name": "tiny",
            "temperatures_c": [30.0],
            "rates_dps": [0.0, 20.0],
            "positions": ["z", "-z"],
            "mounting": {"repower_each": True},
            "soak": {"hold_s": 120.0, "max_drift_c": 0.2, "drift_window_s": 60.0, "timeout_s": 1000.0},
            "acquire": {"duration_s": 10.0, "settle_s": 2.0},
        }
        values |= changes
        return Recipe.model_validate(values)

    def plan(self, recipe: Recipe | None = None) -> Plan:
        limits = BenchLimits(TABLE, CHAMBER, {name: gyro.limits for name, gyro in self.gyros.items()})
        return make_plan(recipe or self.recipe(), limits)

    def make(self, recipe: Recipe | None = None, **options: Any) -> Any:
        bench: Any = self
        self.engine = Engine(
            self.plan(recipe), bench, self.journal, self.clock, self.operator, control=self.control, **options
        )
        return self.engine

    def run(
        self, recipe: Recipe | None = None, start_at: int = 0, restart: Restart | None = None, **options: Any
    ) -> Any:
        return self.make(recipe, **options).run(start_at, restart)

    def when_step(self, kind: str, act: Callable[[], None]) -> None:
        """Do something once, when the first step of that kind begins."""
        done: list[int] = []

        def hook(what: str, index: Any) -> None:
            if what == "step_started" and not done and self.engine.plan.steps[index].kind == kind:
                done.append(index)
                act()

        self.journal.hooks.append(hook)

    def assert_safe(self) -> None:
        assert not self.table.moving
        assert self.chamber.setpoint_c == self.chamber.safe_c
        assert not any(gyro.started for gyro in self.gyros.values())


@pytest.fixture
def rig() -> Rig:
    return Rig()


@pytest.fixture
def two_units() -> Rig:
    return Rig(("imu", "fog"))


@pytest.fixture
def limits() -> BenchLimits:
    return Rig.limits
