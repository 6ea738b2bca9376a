"""Where a campaign is, readable from any thread: step, fraction, expected end, temperatures, rate."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from datetime import datetime, timedelta
from typing import Any, Literal

import numpy as np

from instruments.clock import Clock
from instruments.interfaces.gyro import Channel, Gyro, Readings
from procedures.contracts.campaign_state import CampaignState
from procedures.contracts.operator import Prompt
from procedures.monitoring.campaign_time import CampaignTime
from procedures.monitoring.step_text import describe_step
from procedures.planning.plan import Plan


@dataclass(frozen=True)
class Output:
    """A moment of one channel of a unit, in the channel's unit."""

    gyro: str
    channel: str
    unit: str
    mean: float
    std: float  #: of single readings; 0 for a single one
    n: int
    t_s: float  #: campaign time of the last of them


class LiveOutput:
    """The last readings that each unit sent. One thread writes, any thread may read."""

    def __init__(self) -> None:
        self._last: dict[str, tuple[tuple[Channel, ...], Readings, float]] = {}

    def heard(self, name: str, gyro: Gyro, readings: Readings, time: CampaignTime) -> None:
        """Keep the readings that a unit sent, whose times are the clock's."""
        if len(readings):
            self._last[name] = (tuple(gyro.channels), readings, time.of(float(readings.t_s[-1])))

    def forget(self, name: str | None = None) -> None:
        """Note that a unit, or every unit, sends nothing any more."""
        if name is None:
            self._last = {}
        else:
            self._last.pop(name, None)

    def outputs(self) -> tuple[Output, ...]:
        """Return the mean of what each unit sent last, channel by channel; readings it marked bad do not count."""
        channel_outputs = []
        for name, (channels, readings, t_s) in list(self._last.items()):
            for channel in channels:
                if not channel.name.startswith("gyro_"):
                    continue
                values = channel.value(readings.raw[channel.name][readings.valid])
                if n := len(values):
                    spread = float(np.std(values, ddof=1)) if n > 1 else 0.0
                    channel_outputs.append(
                        Output(name, channel.name, channel.unit, float(np.mean(values)), spread, n, t_s)
                    )
        return tuple(channel_outputs)


@dataclass(frozen=True)
class TurnProgress:
    """A turn by hand at one moment."""

    position: str  #: the axis that points up
    asked_deg: float  #: positive counter-clockwise seen from above
    phase: Literal["rest", "turn"]  #: what the units are to do now
    attempt: int  #: from 1
    came_deg: Mapping[str, float] = field(default_factory=dict)  #: unit -> what has come out so far
    refused: str = ""  #: why the attempt before was refused


@dataclass(frozen=True)
class WatchedLimit:
    """A value that a guard watches now, its limits, and how old it is."""

    kind: str
    device: str
    title: str
    value: float
    low: float | None
    high: float
    unit: str
    action: str  #: what a trip does by the rules of the recipe
    is_beyond: bool
    age_s: float | None  #: since the device answered; absent where it is not asked


@dataclass(frozen=True)
class Progress:
    """A running campaign at one moment. Each change makes a new object, so it can be read without a lock."""

    steps: int
    state: CampaignState = CampaignState.PLANNED
    reason: str = ""
    step: int | None = None  #: from 1
    step_text: str = ""
    fraction: float = 0.0  #: of the expected time, 0 to 1
    expected_end: datetime | None = None  #: aware UTC
    t_s: float | None = None  #: campaign time of this progress
    chamber_c: float | None = None
    setpoint_c: float | None = None
    gyro_c: Mapping[str, float] = field(default_factory=dict)
    references: Mapping[str, float] = field(default_factory=dict)  #: column -> value of a reference instrument
    rate_dps: float = 0.0
    prompt: Prompt | None = None  #: the question that waits for a person
    turn: TurnProgress | None = None  #: the turn by hand that is under way
    links: Mapping[str, str] = field(default_factory=dict)  #: devices that are not well: degraded or lost
    dropped: Mapping[str, str] = field(default_factory=dict)  #: units that are excluded, and why
    limits: tuple[WatchedLimit, ...] = ()  #: what the guards watched at the last poll
    last_error: str = ""
    repeated: int = 0  #: data sets that were taken again, since this run began
    stalled_s: float = 0.0  #: how long this computer did not run labctl, real time, since this run began
    live: LiveOutput = field(default_factory=LiveOutput, compare=False, repr=False)  #: newer than the other fields


Observer = Callable[[Progress], None]


class ProgressTracker:
    """Holds the present progress and passes every change to an observer."""

    def __init__(self, plan: Plan, clock: Clock, observer: Observer | None = None) -> None:
        self._plan = plan
        self._clock = clock
        self._observer = observer
        self._lock = threading.RLock()  # a signal handler may update it in the thread that holds it
        self.live = LiveOutput()
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
        """The present progress."""
        return self._progress

    def step_started(self, index: int, t_s: float) -> None:
        """Show the step of the plan that begins."""
        self._index = index
        self.step_began_s = t_s
        self.update(t_s, step=index + 1, step_text=describe_step(self._plan.steps[index], self._plan.datasets))

    def step_ended(self, index: int) -> None:
        """Update the forecast at the end of a step."""
        self._publish(self._forecast(self._left_after_s[index]))

    def update(self, t_s: float | None = None, **changes: object) -> None:
        """Change fields of the progress; with a campaign time the forecast is computed again too."""
        if t_s is not None:
            left_s = max(self._expected_s[self._index] - (t_s - self.step_began_s), 0.0)
            changes |= {**self._forecast(self._left_after_s[self._index] + left_s), "t_s": t_s}
        self._publish(changes)

    def _forecast(self, left_s: float) -> dict[str, Any]:
        return {
            "fraction": min(max(1.0 - left_s / self._total_s, 0.0), 1.0),
            "expected_end": self._clock.utc() + timedelta(seconds=left_s),
        }

    def _publish(self, changes: dict[str, Any]) -> None:
        with self._lock:
            self._progress = replace(self._progress, **changes)
        if self._observer is None:
            return
        try:
            self._observer(self._progress)
        except Exception as error:  # noqa: BLE001  an observer must never stop a bench: it is dropped, and the progress says so
            self._observer = None
            with self._lock:
                self._progress = replace(
                    self._progress, last_error=f"a subscriber to the progress failed and was removed: {error}"
                )
