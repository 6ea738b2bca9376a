"""The journal of a campaign, written to the log as well: every change of state, of step and of data set, every event.

The engine knows no log. What it hands to its journal is all that happens, so the log is written there; readings and
the environment, which come every second, stay in the database.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from datetime import datetime
from typing import Any

from instruments.interfaces.gyro import Readings
from labctl.log import get_logger
from labctl.log.rendering import error_fields
from procedures.contracts.campaign_state import CampaignState
from procedures.contracts.journal import (
    ClockRun,
    DataSetHeader,
    DataSetState,
    EnvironmentSample,
    Event,
    Journal,
    TableAngles,
)
from procedures.contracts.steps import StepResult
from procedures.monitoring.step_text import describe_step
from procedures.planning.plan import Plan

#: States that a person wants to read about, by the level of their records.
LEVELS: Mapping[CampaignState, str] = {CampaignState.FAILED: "error", CampaignState.INTERRUPTED: "warning"}


class LoggedJournal:
    """Hands everything to a journal and logs it once it is durable. What the journal refuses is logged as well."""

    def __init__(self, journal: Journal, campaign: int, bench: str, plan: Plan, serials: Mapping[str, str]) -> None:
        """`serials` names the unit behind each gyro of the bench."""
        self._journal, self._plan, self._serials = journal, plan, serials
        self._log = get_logger(campaign=campaign, bench=bench)
        self._attempts: Counter[int] = Counter()
        self._refused = False

    @contextmanager
    def _entry(self, event: str, level: str = "info", **fields: Any) -> Iterator[None]:
        with self._refusals(event, **fields):
            yield
        entered = {name: value for name, value in fields.items() if value is not None and value != ""}
        getattr(self._log, level)(event, **entered)

    @contextmanager
    def _refusals(self, event: str, **fields: Any) -> Iterator[None]:
        try:
            yield
        except Exception as error:
            if not self._refused:  # one record for a disk that is full, not one for every second
                self._log.error("journal.refused", entry=event, **{**fields, **error_fields(error)})
            self._refused = True
            raise
        self._refused = False

    def campaign_state(self, state: CampaignState, reason: str, t_s: float, at: datetime) -> None:
        """Record and log a change of state and why."""
        fields = {"state": state.value, "reason": reason, "t_s": _seconds(t_s), "at": at}
        with self._entry("campaign.state", LEVELS.get(state, "info"), **fields):
            self._journal.campaign_state(state, reason, t_s, at)

    def step_started(self, index: int, t_s: float, at: datetime) -> None:
        """Record and log that a step begins; the second time it is a retry."""
        self._attempts[index] += 1
        step_text = describe_step(self._plan.steps[index], self._plan.datasets)
        again: dict[str, Any] = {"attempt": self._attempts[index]} if self._attempts[index] > 1 else {}
        with self._entry("step.started", **self._step(index), what=step_text, **again, t_s=_seconds(t_s), at=at):
            self._journal.step_started(index, t_s, at)

    def step_ended(self, index: int, result: StepResult, t_s: float, at: datetime) -> None:
        """Record and log how a step ended."""
        figures = {name: float(f"{value:.6g}") for name, value in result.figures.items()}
        level = {"failed": "error", "interrupted": "warning", "skipped": "warning"}.get(result.outcome, "info")
        fields = {"outcome": result.outcome, "reason": result.reason, **figures, "t_s": _seconds(t_s), "at": at}
        with self._entry("step.ended", level, **self._step(index), **fields):
            self._journal.step_ended(index, result, t_s, at)

    def _step(self, index: int) -> dict[str, Any]:
        return {"step": index + 1, "steps": len(self._plan.steps), "kind": self._plan.steps[index].kind}

    def session_began(self, run: int, t_s: float) -> None:
        """Record and log that the units were switched on."""
        with self._entry("units.powered", session=run, units=list(self._serials.values()), t_s=_seconds(t_s)):
            self._journal.session_began(run, t_s)

    def unit_dropped(self, gyro: str, reason: str) -> None:
        """Record and log that a unit is excluded from the rest of the campaign."""
        with self._entry("unit.dropped", "error", **self._unit(gyro), reason=reason):
            self._journal.unit_dropped(gyro, reason)

    def dataset_opened(self, header: DataSetHeader) -> int:
        """Record a data set before its first reading, and log it once it has a number."""
        with self._refusals("dataset.opened"):
            number = self._journal.dataset_opened(header)
        units = [self._serials.get(gyro, gyro) for gyro in header.gyros]
        self._log.info(
            "dataset.opened", dataset=number, planned=header.planned, rate_dps=header.rate_dps,
            asked_dps=header.asked_dps, setpoint_c=header.setpoint_c, position=header.step.position, units=units,
            **({} if header.turn_deg is None else {"turn_deg": header.turn_deg}),
        )  # fmt: skip
        return number

    def readings(self, dataset: int, gyro: str, readings: Readings, chamber_c: float | None) -> None:
        """Record one block of one unit."""
        with self._refusals("readings", dataset=dataset, **self._unit(gyro)):
            self._journal.readings(dataset, gyro, readings, chamber_c)

    def table_angles(self, dataset: int, angles: TableAngles) -> None:
        """Record what the table's encoder said."""
        with self._refusals("table.angles", dataset=dataset):
            self._journal.table_angles(dataset, angles)

    def timed_run(self, run: ClockRun) -> None:
        """Record and log a run that times the step clock."""
        late_s = round(run.duration_s - run.nominal_s, 6)
        with self._entry("table.timed_run", nominal_s=run.nominal_s, late_s=late_s, t_s=_seconds(run.t_s)):
            self._journal.timed_run(run)

    def step_clock(self, u_ppm: float, freedom: int, factor: Callable[[float], float]) -> None:
        """Record that rates are by all timed runs so far; the event that says so is logged."""
        with self._refusals("step_clock"):
            self._journal.step_clock(u_ppm, freedom, factor)

    def dataset_closed(self, dataset: int, state: DataSetState, reason: str = "") -> None:
        """Record and log that no more readings follow."""
        level = "info" if state is DataSetState.COMPLETE else "warning"
        with self._entry("dataset.closed", level, dataset=dataset, state=state.value, reason=reason):
            self._journal.dataset_closed(dataset, state, reason)

    def dataset_withdrawn(self, dataset: int, gyro: str, reason: str) -> None:
        """Record and log that a unit's readings of a complete data set are wrong."""
        with self._entry("dataset.withdrawn", "warning", dataset=dataset, **self._unit(gyro), reason=reason):
            self._journal.dataset_withdrawn(dataset, gyro, reason)

    def environment(self, sample: EnvironmentSample) -> None:
        """Record the environment."""
        with self._refusals("environment"):
            self._journal.environment(sample)

    def event(self, event: Event, t_s: float, at: datetime) -> None:
        """Record and log something worth telling a person."""
        measured = {"value": event.value, "limit": event.limit, "in": event.unit}
        entered = {"kind": event.kind, "message": event.message, **self._unit(event.device), **measured}
        with self._entry("campaign.event", event.level, **entered, t_s=_seconds(t_s), at=at):
            self._journal.event(event, t_s, at)

    def _unit(self, device: str | None) -> dict[str, str | None]:
        """Name an instrument, and the unit where it is one."""
        serial = self._serials.get(device or "")
        return {"device": device} if serial is None else {"device": device, "unit": serial}


def _seconds(t_s: float) -> float:
    return round(t_s, 1)
