"""A bench of fake instruments with everything an engine needs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import SimpleNamespace
from typing import Any

from instruments.clock import VirtualClock
from instruments.positions import Position
from procedures.contracts.control import Control
from procedures.contracts.operator import UnitHandlerOperator
from procedures.execution.engine import Engine
from procedures.execution.resume import Restart
from procedures.planning.limits import BenchLimits
from procedures.planning.plan import Plan, make_plan
from procedures.recipe.recipe import Recipe
from tests.helpers.fake_instruments import CHAMBER, TABLE, UNIT, FakeChamber, FakeGyro, FakeTable
from tests.helpers.recording_journal import RecordingJournal


class Rig:
    """A fake bench with everything an engine needs."""

    limits = BenchLimits(TABLE, CHAMBER, {"imu": UNIT})
    configurations: Mapping[str, Mapping[str, str]] = {}

    def __init__(self, gyros: tuple[str, ...] = ("imu",)) -> None:
        self.clock = VirtualClock()
        self.clock.sleep(1000.25)  # campaign time is not clock time
        self.trace: list[str] = []
        self.sign = 1.0  #: of the units' mounting
        self.table = FakeTable(self.clock, self.trace, "table")
        self.chamber = FakeChamber(self.clock, self.trace, "chamber")
        self.gyros = {name: FakeGyro(self.clock, self.trace, name) for name in gyros}
        for gyro in self.gyros.values():
            gyro.bench = self
        self.imu = self.gyros[gyros[0]]
        self.references: dict[str, Any] = {}
        self.supply: Any = None
        self.journal = RecordingJournal(self.trace)
        self.journal.hooks.append(self._mounted)
        self.control = Control()
        self.unit_handler = SimpleNamespace(
            mount=lambda position: self.trace.append(f"hand.mount {position}"),
            power=lambda on: self.trace.append(f"hand.power {on}"),
        )
        self.operator: Any = UnitHandlerOperator(self.unit_handler)
        self.engine: Any = None

    def _mounted(self, what: str, header: Any) -> None:
        """Have the units in the position of a data set."""
        if what == "dataset_opened":
            self.sign = Position.of(header.step.position).sign

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
        units = {name: gyro.limits for name, gyro in self.gyros.items()}
        limits = BenchLimits(TABLE, CHAMBER, units, supply=None if self.supply is None else self.supply.limits)
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
