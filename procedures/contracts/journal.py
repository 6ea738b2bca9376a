"""The interface the engine records to. Everything handed over here is durable before the call returns."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from datetime import datetime
from enum import StrEnum
from typing import Literal, Protocol

from instruments.interfaces.gyro import Readings
from procedures.contracts.campaign_state import CampaignState
from procedures.contracts.measured_course import MeasuredCourse
from procedures.contracts.steps import Acquire, StepResult, Turn


class DataSetState(StrEnum):
    """What became of a data set. Only complete ones are fitted; the others are kept and marked."""

    OPEN = "open"
    COMPLETE = "complete"
    PARTIAL = "partial"


@dataclass(frozen=True)
class DataSetHeader:
    """One fixed rate at one fixed temperature in one position, as it was really run, for all units at once.

    Of a step that turns the units by hand it is a rest or the turn, by `part`.
    """

    step: Acquire | Turn
    rate_dps: float  #: the reference: steps inside the gate over gate time
    asked_dps: float
    gate_from_s: float  #: campaign time
    gate_until_s: float | None  #: absent: it lasts until a person says so
    angle_from_deg: float | None  #: table angle at `gate_from_s`; absent without a table
    setpoint_c: float | None  #: absent without a chamber
    run: int  #: powered session as it really was: the plan's, and those that a power cut added
    gyros: tuple[str, ...]  #: the units that take part, by name
    turn_deg: float | None = None  #: by which angle the units are turned; 0 for a rest, absent for a rate of the table
    turn_u_deg: float | None = None  #: its standard uncertainty
    part: Literal[-1, 0, 1] = 0  #: of a turn: the rest before it, the turn, the rest after it

    @property
    def planned(self) -> int:
        """Its number in the plan."""
        return self.step.dataset + self.part


@dataclass(frozen=True)
class CourseTime:
    """Standard uncertainties of the time of a rate that changes, s: the whole course may be early or late by these."""

    own_u_s: float  #: of one data set, independent of that of others
    common_u_s: float  #: that all data sets have in common: when in its reply an angle is read


@dataclass(frozen=True)
class TableAngles:
    """What the table's encoder said during one data set, and the mean rate that follows from it."""

    t_s: tuple[float, ...]  #: campaign time
    angle_deg: tuple[float, ...]  #: unwrapped
    rate_dps: float  #: of the line through them
    rate_u_dps: float  #: its standard uncertainty
    angle_from_deg: float  #: of the line, when the gate opens
    computed_dps: float  #: the rate that the table was taken to run at
    is_reference: bool  #: whether the measured rate is the reference of the readings
    course: MeasuredCourse | None = None  #: of a rate that changes; `rate_dps` is then its mean
    time: CourseTime | None = None  #: of a rate that changes: how well the time of its reference is known


@dataclass(frozen=True)
class EnvironmentSample:
    """What happened between the data sets: one row per 10 s or oftener, from power-on to the last data set."""

    t_s: float  #: campaign time
    run: int
    chamber_c: float | None  #: absent without a chamber
    chamber_setpoint_c: float | None
    gyro_c: dict[str, float]  #: gyro name -> its own thermometer (the mean where it has one per axis)
    references: Mapping[str, float] = field(default_factory=dict)  #: column -> value of a reference instrument


@dataclass(frozen=True)
class ClockRun:
    """One run of a table without an encoder that was timed to measure its step clock."""

    session: int  #: of this process and its link: replies are equally late in it
    block: int  #: runs that were made one after the other
    t_s: float  #: campaign time of its middle
    nominal_s: float  #: time that its steps take at the nominal step rate
    duration_s: float  #: by the computer's clock
    step_hz: float  #: nominal step rate: ramps are equal at one rate
    used: bool = False  #: whether the rates of the data sets so far are by it, too


#: Beginning of the text of a `safe_state` event that names what could not be confirmed.
NOT_SAFE = "NOT confirmed safe: "


@dataclass(frozen=True)
class Event:
    """Something worth telling a person: a guard trip, a retry, a state change, with value, limit and reason."""

    kind: str
    message: str
    level: str = "info"  #: "info", "warning" or "error"
    device: str | None = None
    value: float | None = None
    limit: float | None = None
    unit: str | None = None


class Journal(Protocol):
    """Where a campaign is written down. Times `t_s` are campaign time: clock seconds since the campaign started."""

    def campaign_state(self, state: CampaignState, reason: str, t_s: float, at: datetime) -> None:
        """Record a change of state and why."""
        ...

    def step_started(self, index: int, t_s: float, at: datetime) -> None:
        """Record that step `index` of the plan begins."""
        ...

    def step_ended(self, index: int, result: StepResult, t_s: float, at: datetime) -> None:
        """Record how step `index` ended."""
        ...

    def session_began(self, run: int, t_s: float) -> None:
        """Record that the units were switched on for session `run`."""
        ...

    def unit_dropped(self, gyro: str, reason: str) -> None:
        """Record that a unit is excluded from the rest of the campaign, and why."""
        ...

    def dataset_opened(self, header: DataSetHeader) -> int:
        """Record a data set before its first reading; returns its number, unique in the campaign."""
        ...

    def readings(self, dataset: int, gyro: str, readings: Readings, chamber_c: float | None) -> None:
        """Record one block of one unit, times in campaign time; durable when this returns."""
        ...

    def table_angles(self, dataset: int, angles: TableAngles) -> None:
        """Record what the table's encoder said during a data set that is open, and the rate that follows."""
        ...

    def timed_run(self, run: ClockRun) -> None:
        """Record a run that times the step clock."""
        ...

    def step_clock(self, u_ppm: float, freedom: int, factor: Callable[[float], float]) -> None:
        """Record that rates are by all timed runs so far: their standard uncertainty and its degrees of freedom.

        `factor` gives by what the rate of a data set so far is multiplied, from the campaign time of its gate.
        """
        ...

    def dataset_closed(self, dataset: int, state: DataSetState, reason: str = "") -> None:
        """Record that no more readings follow; statistics are derived and blocks compacted here.

        Called with PARTIAL for a complete data set, it is withdrawn: kept, marked, not fitted.
        """
        ...

    def dataset_withdrawn(self, dataset: int, gyro: str, reason: str) -> None:
        """Mark a complete data set as partial for one unit, whose readings turned out to be wrong: kept, not fitted."""
        ...

    def environment(self, sample: EnvironmentSample) -> None:
        """Record the environment between and during data sets."""
        ...

    def event(self, event: Event, t_s: float, at: datetime) -> None:
        """Record something worth telling a person."""
        ...
