"""What a step works with: the bench, the watch and time that passes under control."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator
from dataclasses import dataclass, field

from instruments.clock import Clock
from instruments.errors import InstrumentError
from procedures.execution.active_bench import ActiveBench
from procedures.contracts.bench import Bench
from procedures.contracts.control import Control
from procedures.contracts.errors import Aborted, Interrupted, StepFailed, Unanswered
from procedures.contracts.journal import CampaignState, Event
from procedures.contracts.operator import Answer, Operator, Prompt
from procedures.contracts.steps import Soak
from procedures.monitoring.guards import GuardViolation
from procedures.monitoring.monitor import BenchMonitor
from procedures.monitoring.recorder import CampaignRecorder, warning
from procedures.recipe.recipe import Recipe

CHECK_S = 1.0  #: how long the clock runs at most between two looks at what a person wants
#: From look to look. With a second of reading and a unit's reply in between, rows of the environment are never more
#: than 10 s apart, which is what effects with a memory need.
LOOK_S = 8.5
UNIT_FAULTS = {"stale", "damaged_readings", "invalid_readings"}  #: a trip that is one unit's own


@dataclass
class ExecutionContext:
    """Everything a step handler may touch."""

    recipe: Recipe
    bench: ActiveBench
    whole: Bench  #: with the units that dropped out
    clock: Clock
    operator: Operator
    control: Control
    log: CampaignRecorder
    watch: BenchMonitor
    added_runs: int = 0  #: powered sessions more than the plan has
    paused_s: float = 0.0  #: how long the campaign was paused so far
    soaked: Soak | None = None  #: the soak that still holds: its temperature has not been left since
    _questions: int = field(default=0, repr=False)

    def checkpoint(self) -> None:
        """Obey a wish to abort. Raises Aborted."""
        wish = self.control.wish
        if wish.abort:
            raise Interrupted(wish.reason) if wish.taken_up else Aborted(wish.reason)

    def pass_time(self, duration_s: float, *, pausing: bool = True) -> None:
        """Let the clock run, looking at least once a second at what a person wants. Raises Aborted."""
        until_s = self.clock.now_s() + duration_s
        self.checkpoint()
        while (left_s := until_s - self.clock.now_s()) > 0:
            self.clock.sleep(min(CHECK_S, left_s))
            self.checkpoint()
            if pausing and self.control.wish.pause:
                self.hold()

    def looks(self, *, pausing: bool = True) -> Iterator[None]:
        """Look at the bench now and then every few seconds until the caller has seen enough.

        Raises Aborted, GuardTripped, InstrumentError.
        """
        while True:
            self.look()
            yield
            self.pass_time(LOOK_S, pausing=pausing)

    def watch_for(self, duration_s: float) -> None:
        """Let time pass with the environment recorded."""
        until_s = self.clock.now_s() + duration_s
        self.look()
        while (left_s := until_s - self.clock.now_s()) > 0:
            self.pass_time(min(LOOK_S, left_s))
            self.look()

    def look(self, *, read_latest: bool = True) -> None:
        """Look at the bench once. Raises GuardTripped for a limit that does more than warn, and InstrumentError."""
        trips = self.watch.look(LOOK_S, read_latest=read_latest)
        raise_violation(trips if self.watch.taking else self.without_dropouts(trips))

    def without_dropouts(self, trips: list[GuardViolation]) -> list[GuardViolation]:
        """Let units drop out whose readings failed while others go on; returns the other trips."""
        left = []
        for trip in trips:
            if trip.action == "fail" and trip.kind in UNIT_FAULTS and self.can_drop(trip.device):
                self.drop(trip.device, trip.message)
            else:
                left.append(trip)
        return left

    def can_drop(self, device: str) -> bool:
        """Return whether a device is a unit without which the campaign can go on."""
        return device in self.bench.gyros and len(self.bench.gyros) > 1

    def drop(self, gyro: str, reason: str) -> None:
        """Let a unit take no further part; the others go on."""
        unit = self.bench.drop(gyro, reason)
        self.watch.forget(gyro)
        with contextlib.suppress(InstrumentError, OSError):  # its stream is closed once more in the safe state
            unit.stop()
        self.log.journal.unit_dropped(gyro, reason)
        self.log.board.update(dropped=dict(self.bench.dropped))
        self.log.event(Event("unit_dropped", f"{gyro} takes no further part: {reason}", level="error", device=gyro))

    def hold(self) -> None:
        """Stay as things are while a person wants a pause; the environment is recorded and guards stay armed."""
        if not self.control.wish.pause:
            return
        before, began_s = self.log.state, self.clock.now_s()
        self.log.change_state(CampaignState.PAUSED, self.control.wish.reason)
        next_look_s = began_s
        with self.watch.telling(self.notice_leaving):
            while self.control.wish.pause:
                if self.clock.now_s() >= next_look_s:
                    self.look()
                    next_look_s = self.clock.now_s() + LOOK_S
                self.clock.sleep(CHECK_S)
                self.checkpoint()
        self.paused_s += self.clock.now_s() - began_s
        self.log.change_state(before, self.control.wish.reason)

    def notice_leaving(self, _t_s: float, chamber_c: float, _gyro_c: object) -> None:
        """Forget that a temperature was taken once the air has left its band."""
        if self.soaked and abs(chamber_c - self.soaked.temperature_c) > self.soaked.band_c:
            text = f"{self.soaked.temperature_c:g} deg C was left: the air is at {chamber_c:.2f} deg C"
            self.log.event(Event("soak_owed", text))
            self.soaked = None

    def ask(self, prompt: Prompt) -> Answer:
        """Ask a person and wait for the answer, with the environment recorded.

        Raises StepFailed when the answer is no or does not come in time, and what `looks` raises.
        """
        self.log.event(Event("operator.asked", f"{prompt.text} [question {prompt.id}]"))
        self.operator.ask(prompt)
        answer = self.operator.answer(prompt.id)
        if answer is None:
            answer = self._wait_for(prompt)
        if not answer.confirmed:
            raise StepFailed(f"{answer.by} declined: {prompt.text}: {answer.reason}")
        self.log.event(Event(f"operator.{prompt.kind}", f"{prompt.text}: confirmed by {answer.by}"))
        return answer

    def _wait_for(self, prompt: Prompt) -> Answer:
        rules = self.recipe.on_failure
        timeout_s, remind_s = rules.operator_timeout_s, rules.operator_remind_s or math.inf
        began_s = next_look_s = self.clock.now_s()
        remind_at_s = began_s + remind_s
        self.log.board.update(prompt=prompt)
        self.log.change_state(CampaignState.WAITING, prompt.text)
        try:
            while (answer := self.operator.answer(prompt.id)) is None:
                if timeout_s is not None and self.clock.now_s() - began_s >= timeout_s:
                    raise Unanswered(f"nobody answered within {timeout_s:g} s: {prompt.text}")
                if self.clock.now_s() >= remind_at_s:
                    remind_at_s += remind_s
                    waited = f"since {self.clock.now_s() - began_s:.0f} s"
                    self.log.event(warning("operator.reminded", f"{prompt.text} [question {prompt.id}], open {waited}"))
                if self.clock.now_s() >= next_look_s:
                    self.look()
                    next_look_s = self.clock.now_s() + LOOK_S
                self.pass_time(CHECK_S, pausing=False)
        finally:
            self.operator.withdraw(prompt.id)
            self.log.board.update(prompt=None)
        self.log.change_state(CampaignState.RUNNING, f"answered by {answer.by}")
        return answer

    def new_prompt_id(self) -> str:
        """Return an id for a question that no other question of this or an earlier process has had."""
        self._questions += 1
        return f"{self.clock.utc():%Y%m%dT%H%M%S.%f}-{self._questions}"


def raise_violation(trips: list[GuardViolation]) -> None:
    """Raise GuardTripped for the first limit that does more than warn; one that fails goes before one that suspends."""
    serious = [trip for trip in trips if trip.action != "warn"]
    if serious:
        raise min(serious, key=lambda trip: trip.action != "fail").error()
