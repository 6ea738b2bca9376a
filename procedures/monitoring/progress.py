"""Where a campaign is, readable from any thread: step, fraction, expected end, temperatures, rate, last event."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from datetime import datetime, timedelta
from typing import Any

from instruments.clock import Clock
from procedures.contracts.journal import CampaignState
from procedures.contracts.operator import Prompt
from procedures.contracts.steps import Acquire, Home, Mount, MoveChamber, PowerOff, PowerOn, Rest, Soak, Step
from procedures.monitoring.live_output import Live
from procedures.planning.plan import Plan


@dataclass(frozen=True)
class Progress:
    """A picture of a running campaign; a new one replaces it, so it can be read without a lock."""

    steps: int
    state: CampaignState = CampaignState.PLANNED
    reason: str = ""
    step: int | None = None  #: from 1
    step_text: str = ""
    fraction: float = 0.0  #: of the expected time, 0 to 1
    expected_end: datetime | None = None  #: aware UTC
    t_s: float | None = None  #: campaign time of this picture
    chamber_c: float | None = None
    setpoint_c: float | None = None
    gyro_c: Mapping[str, float] = field(default_factory=dict)
    rate_dps: float = 0.0
    prompt: Prompt | None = None  #: the question that waits for a person
    links: Mapping[str, str] = field(default_factory=dict)  #: devices that are not well: degraded or lost
    dropped: Mapping[str, str] = field(default_factory=dict)  #: units that take no further part, and why
    last_event: str = ""
    last_error: str = ""
    live: Live = field(default_factory=Live, compare=False, repr=False)  #: newer than the rest of the picture


Observer = Callable[[Progress], None]


class ProgressTracker:
    """Holds the present progress and tells an observer of every change."""

    def __init__(self, plan: Plan, clock: Clock, observer: Observer | None = None) -> None:
        self._plan = plan
        self._clock = clock
        self._observer = observer
        self._lock = threading.RLock()  # a signal during the safe state is told here too, whatever its thread is doing
        self.live = Live()
        self._progress = Progress(steps=len(plan.steps), live=self.live)
        self._expected_s = [step.expected_s for step in plan.steps]
        self._left_after_s = self._remaining(self._expected_s)
        self._total_s = max(math.fsum(self._expected_s), 1e-9)
        self._index = 0
        self.step_began_s = 0.0  #: campaign time

    @staticmethod
    def _remaining(expected_s: list[float]) -> list[float]:
        """Return what is left after each step, in seconds."""
        left_s, lefts_s = 0.0, []
        for step_s in reversed(expected_s):
            lefts_s.append(left_s)
            left_s += step_s
        return lefts_s[::-1]

    @property
    def progress(self) -> Progress:
        """The present picture."""
        return self._progress

    def step_started(self, index: int, t_s: float) -> None:
        """Take a new step of the plan in."""
        self._index = index
        self.step_began_s = t_s
        self.update(t_s, step=index + 1, step_text=describe(self._plan.steps[index], self._plan.datasets))

    def step_ended(self, index: int) -> None:
        """Take the end of a step in."""
        self._tell(self._forecast(self._left_after_s[index]))

    def update(self, t_s: float | None = None, **changes: Any) -> None:
        """Change the picture; with a campaign time the forecast is made anew too."""
        if t_s is not None:
            left_s = max(self._expected_s[self._index] - (t_s - self.step_began_s), 0.0)
            changes |= {**self._forecast(self._left_after_s[self._index] + left_s), "t_s": t_s}
        self._tell(changes)

    def _forecast(self, left_s: float) -> dict[str, Any]:
        return {
            "fraction": min(max(1.0 - left_s / self._total_s, 0.0), 1.0),
            "expected_end": self._clock.utc() + timedelta(seconds=left_s),
        }

    def _tell(self, changes: dict[str, Any]) -> None:
        with self._lock:
            self._progress = replace(self._progress, **changes)
        if self._observer is None:
            return
        try:
            self._observer(self._progress)
        except Exception as error:  # noqa: BLE001  whoever looks on must never stop a bench; he is dropped and it is said
            self._observer = None
            with self._lock:
                self._progress = replace(self._progress, last_error=f"the observer failed and was dropped: {error}")


def describe(step: Step, datasets: int) -> str:
    """Return a step in a person's words."""
    text = "safe state"
    match step:
        case Acquire():
            where = f"at {step.temperature_c:g} deg C, {step.position} up"
            text = f"data set {step.dataset} of {datasets}: {step.rate_dps:+g} deg/s {where}"
        case Soak():
            text = f"soak at {step.temperature_c:g} deg C for {step.hold_s / 60:g} min"
        case MoveChamber():
            text = f"chamber to {step.temperature_c:g} deg C"
        case Mount():
            text = f"turn the units: {step.position} up"
        case PowerOn() | PowerOff():
            text = f"switch the units {'on' if isinstance(step, PowerOn) else 'off'}, session {step.run}"
        case Home():
            text = "home the table"
        case Rest():
            text = f"rest for {step.duration_s:g} s"
    return text
