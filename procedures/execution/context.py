"""What a step works with: the bench, its monitor, the recorder, and time that passes under control of requests."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from instruments.clock import Clock
from instruments.configuration import changed, configuration_of
from instruments.errors import InstrumentError, WrongInstrument
from procedures.contracts.bench import Bench
from procedures.contracts.control import Control
from procedures.contracts.journal import ClockRun, Event
from procedures.contracts.operator import Operator
from procedures.contracts.steps import Soak
from procedures.execution.active_bench import ActiveBench
from procedures.monitoring.event_recorder import CampaignRecorder
from procedures.monitoring.guards import GuardViolation
from procedures.monitoring.monitor import BenchMonitor
from procedures.monitoring.unit_response import UnitResponse
from procedures.recipe.recipe import Recipe

#: From poll to poll. With a second of reading and a unit's reply in between, rows of the environment are never more
#: than 10 s apart, which is what effects with a memory need.
POLL_S = 8.5
UNIT_FAULTS = {"stale", "damaged_readings", "invalid_readings"}  #: guards whose violation is one unit's own


@dataclass
class ExecutionContext:
    """Everything a step handler may touch."""

    recipe: Recipe
    bench: ActiveBench
    full_bench: Bench  #: with the units that dropped out
    clock: Clock
    operator: Operator
    control: Control
    recorder: CampaignRecorder
    monitor: BenchMonitor
    added_runs: int = 0  #: powered sessions more than the plan has
    paused_s: float = 0.0  #: how long the campaign was paused so far
    soaked: Soak | None = None  #: the soak that still holds: its temperature has not been left since
    owed_soak: Soak | None = None  #: the soak to be done again before the next data set
    unchecked: list[int] = field(default_factory=list)  #: data sets since home was last found where it was left
    clock_session: int = 1  #: of timed runs: a resumed campaign begins another
    clock_runs: list[ClockRun] = field(default_factory=list)  #: every run so far that timed the step clock
    response: UnitResponse = field(default_factory=UnitResponse)  #: of the units to the rates of the table
    warned_of_rate: bool = False  #: whether it was said that the table does not turn as commanded
    _prompts: int = field(default=0, repr=False)
    _set: dict[str, dict[str, str]] = field(default_factory=dict, repr=False)  #: unit -> how it was set so far

    def poll(self, *, read_latest: bool = True, units_until_s: float = math.inf) -> None:
        """Poll the bench once; the units are read where they are before clock time `units_until_s`.

        Raises GuardTripped for a limit that does more than warn, and InstrumentError.
        """
        until_s = float(self.recorder.time.of(units_until_s)) if read_latest else -math.inf
        violations = self.monitor.poll(POLL_S, units_until_s=until_s)
        raise_violation(violations if self.monitor.is_taking_readings else self.without_dropouts(violations))

    def without_dropouts(self, violations: list[GuardViolation]) -> list[GuardViolation]:
        """Drop the units whose readings failed while others go on; returns the other violations."""
        left = []
        for violation in violations:
            if violation.action == "fail" and violation.kind in UNIT_FAULTS and self.can_drop(violation.device):
                self.drop(violation.device, violation.message)
            else:
                left.append(violation)
        return left

    def can_drop(self, device: str) -> bool:
        """Return whether a device is a unit without which the campaign can go on."""
        return device in self.bench.gyros and len(self.bench.gyros) > 1

    def drop(self, gyro: str, reason: str) -> None:
        """Exclude a unit from the rest of the campaign; the others go on."""
        unit = self.bench.drop(gyro, reason)
        self.monitor.forget(gyro)
        with contextlib.suppress(InstrumentError, OSError):  # its stream is closed once more in the safe state
            unit.stop()
        self.recorder.journal.unit_dropped(gyro, reason)
        self.recorder.tracker.update(dropped=dict(self.bench.dropped))
        text = f"{gyro} is excluded from the rest of the campaign: {reason}"
        self.recorder.event(Event("unit_dropped", text, level="error", device=gyro))

    def require_same_settings(self, gyro: str, reported: Mapping[str, str]) -> None:
        """Raise WrongInstrument where a unit is set otherwise than in the campaign so far, or than it is to be."""
        before = self._set.get(gyro) or self.full_bench.configurations.get(gyro, {})
        if changes := changed(before, reported):
            text = ", ".join(f"{name} was {was} and is {now}" for name, (was, now) in changes.items())
            raise WrongInstrument(
                gyro,
                f"the unit is set otherwise than before: {text}. What was not saved in the unit is lost when it is "
                "switched off: set it as it was, save that, and resume the campaign",
            )
        self._set[gyro] = {**before, **configuration_of(reported)}

    def notice_leaving(self, _t_s: float, chamber_c: float, _gyro_c: object) -> None:
        """Note that a soaked temperature no longer holds, once the air has left its band."""
        if self.soaked and abs(chamber_c - self.soaked.temperature_c) > self.soaked.band_c:
            text = (
                f"the air has left the temperature {self.soaked.temperature_c:g} deg C of the soak and is at "
                f"{chamber_c:.2f} deg C"
            )
            self.recorder.event(Event("soak_owed", text))
            self.soaked = None

    @contextlib.contextmanager
    def owing_soak(self) -> Iterator[None]:
        """Owe the soak that holds now if its temperature is left while the block runs."""
        soaked = self.soaked
        yield
        if soaked is not None and self.soaked is None:
            self.owed_soak = soaked

    def new_prompt_id(self) -> str:
        """Return an id for a question that no other question of this or an earlier process has had."""
        self._prompts += 1
        return f"{self.clock.utc():%Y%m%dT%H%M%S.%f}-{self._prompts}"


def raise_violation(violations: list[GuardViolation]) -> None:
    """Raise GuardTripped for the first limit that does more than warn; one that fails goes before one that suspends."""
    serious = [violation for violation in violations if violation.action != "warn"]
    if serious:
        raise min(serious, key=lambda each: each.action != "fail").error()
