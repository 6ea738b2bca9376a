"""The engine's journal in the database.

Every call outlives this process when it returns. A power cut may take the readings and the environment of the data set
that is open, which is redone anyway; closing a data set, and every change of step or state, is on the disk.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from datetime import datetime
from typing import Any

import numpy as np
import sqlalchemy as sa
from numpy.typing import NDArray

from instruments.interfaces.gyro import Readings
from labctl.recording.columns import ARRIVAL_S, DEVICE_S
from labctl.store import sample_codec
from labctl.store.connection.database import Database
from labctl.store.connection.transactions import outlasting
from labctl.store.dataset_statistics import means_rows
from labctl.store.repositories import benches
from labctl.store.repositories.audit import append
from labctl.store.repositories.sample_blocks import (
    STORED_TIMES,
    angle_values,
    blocks_of,
    head_of,
    scaled,
    write_block,
    write_final_block,
)
from labctl.store.repositories.timed_runs import write_step_clock
from labctl.store.schema import tables
from labctl.store.sealing.seals import changing, of_campaign, prepared_recordings, sealed_at
from procedures.contracts.campaign_state import ENDED, CampaignState
from procedures.contracts.journal import (
    NOT_SAFE,
    ClockRun,
    DataSetHeader,
    DataSetState,
    EnvironmentSample,
    Event,
    TableAngles,
)
from procedures.contracts.steps import Acquire, StepResult
from procedures.execution.signals import defer_signals

#: Built once: a statement that is built anew for every second of a campaign costs more than writing it.
_ADD_ENVIRONMENT = sa.insert(tables.environment)
#: Of a turn by hand: what is known at its end, and the column of the readings that says it.
KNOWN_LATE = {"table_rate_dps": "table_rate_dps", "gate_until_s": "t_s"}


class StoreJournal:
    """Writes one campaign down. Sample blocks hold whole numbers, as the device sent them."""

    def __init__(self, database: Database, campaign: int) -> None:
        self._database = database
        self._campaign = campaign
        r = tables.recordings.c
        with database.reading() as connection:
            self._sealed_at = sealed_at(connection, campaign)
            rows = connection.execute(sa.select(r.gyro, r.id, r.channels).where(r.campaign_id == campaign)).all()
            self._power_on_s: float | None = connection.scalar(
                sa.select(tables.campaigns.c.powered_on_s).where(tables.campaigns.c.id == campaign)
            )
        self._recordings = {gyro: recording for gyro, recording, _ in rows}
        self._channels = {gyro: channels for gyro, _, channels in rows}
        #: What the open data sets' blocks hold, so that closing one need not read it back.
        self._open: dict[tuple[int, str], list[dict[str, NDArray[np.generic]]]] = {}

    @contextmanager
    def _writing(self, *, synced: bool = True) -> Iterator[sa.Connection]:
        """Write in one transaction; what is written after the campaign was sealed makes new manifests."""
        with defer_signals(), self._database.writing(synced=synced) as connection:
            if self._sealed_at is None:
                yield connection
            else:
                records = of_campaign(connection, self._campaign)
                with changing(connection, records, self._sealed_at, "written after the end"):
                    yield connection

    @outlasting
    def campaign_state(self, state: CampaignState, reason: str, t_s: float, at: datetime) -> None:
        """Record a change of state and why, as the campaign's state and as an event."""
        values: dict[str, Any] = {"state": state, "reason": reason}
        if state is CampaignState.RUNNING:
            values["started_at"] = sa.func.coalesce(
                tables.campaigns.c.started_at, sa.bindparam("at", at, tables.Instant)
            )
        if state in ENDED:
            values["ended_at"] = at
        level = "error" if state is CampaignState.FAILED else "info"
        message = f"campaign {state.value}" + (f": {reason}" if reason else "")
        with self._changing_state(state, at) as connection:
            connection.execute(
                sa.update(tables.campaigns).where(tables.campaigns.c.id == self._campaign).values(**values)
            )
            self._add_event(connection, Event("state", message, level), t_s, at)
            change = {"state": state, "reason": reason}
            append(connection, at, "campaign state", f"campaign {self._campaign}", change)
        self._sealed_at = at if state in ENDED else None

    @contextmanager
    def _changing_state(self, state: CampaignState, at: datetime) -> Iterator[sa.Connection]:
        """Write in one transaction, which seals the campaign and its recordings where it ends with it."""
        if state not in ENDED and self._sealed_at is None:
            with self._writing() as connection:
                yield connection
            return
        with self._database.reading() as connection:
            records = of_campaign(connection, self._campaign)
        prepared = prepared_recordings(self._database, records)
        with (
            defer_signals(),
            self._database.writing() as connection,
            changing(connection, records, at, state.value, prepared),
        ):
            yield connection

    def step_started(self, index: int, t_s: float, at: datetime) -> None:
        """Record that a step begins."""
        self._mark(index, {"state": "running", "started_s": t_s, "started_at": at})

    def step_ended(self, index: int, result: StepResult, t_s: float, at: datetime) -> None:
        """Record how a step ended."""
        self._mark(
            index, {"state": result.outcome, "ended_s": t_s, "ended_at": at, "result": result.model_dump(mode="json")}
        )

    @outlasting
    def _mark(self, index: int, values: dict[str, Any]) -> None:
        s = tables.steps
        with self._writing() as connection:
            connection.execute(
                sa.update(s).where(s.c.campaign_id == self._campaign, s.c.number == index).values(**values)
            )

    @outlasting
    def session_began(self, run: int, t_s: float) -> None:  # noqa: ARG002  the number is the plan's and what was added
        """Record that the units were switched on."""
        self._power_on_s = t_s
        c = tables.campaigns
        with self._writing() as connection:
            connection.execute(sa.update(c).where(c.c.id == self._campaign).values(powered_on_s=t_s))

    @outlasting
    def unit_dropped(self, gyro: str, reason: str) -> None:
        """Record that a unit is excluded from the rest of the campaign."""
        r = tables.recordings
        with self._writing() as connection:
            connection.execute(sa.update(r).where(r.c.id == self._recordings[gyro]).values(dropped=reason))

    @outlasting
    def dataset_opened(self, header: DataSetHeader) -> int:
        """Record a data set of every unit before its first reading; returns its number."""
        s, d = header.step, tables.data_sets
        with self._writing() as connection:
            last = connection.scalar(
                sa.select(sa.func.max(d.c.number)).where(d.c.recording_id.in_(self._recordings.values()))
            )
            number = int(last or 0) + 1
            connection.execute(
                sa.insert(d),
                [
                    {
                        "recording_id": recording,
                        "number": number,
                        "state": DataSetState.OPEN.value,
                        "reason": "",
                        "position": s.position,
                        "run": header.run,
                        "mounting": s.mounting,
                        "table_rate_dps": header.rate_dps,
                        "asked_dps": header.asked_dps,
                        "table_angle_deg": header.angle_from_deg,
                        "chamber_setpoint_c": header.setpoint_c,
                        "gate_from_s": header.gate_from_s,
                        "gate_until_s": header.gate_until_s,
                        "power_on_s": self._power_on_s,
                        "n": 0,
                        "turn_deg": header.turn_deg,
                        "turn_u_deg": header.turn_u_deg,
                        "planned": header.planned,
                        "verification": isinstance(s, Acquire) and s.verification,
                    }
                    for recording in (self._recordings[gyro] for gyro in header.gyros)
                ],
            )
        return number

    @outlasting
    def readings(self, dataset: int, gyro: str, readings: Readings, chamber_c: float | None) -> None:
        """Record one block of one unit; times are campaign time."""
        if not len(readings) and not readings.lost and not readings.damaged:
            return
        recording = self._recordings[gyro]
        parts = self._open.setdefault((dataset, gyro), [])
        columns = _columns(readings, chamber_c)
        d = tables.data_sets
        with self._writing(synced=False) as connection:
            if len(readings):
                write_block(connection, recording, dataset, len(parts), sample_codec.pack(columns))
            if readings.lost or readings.damaged:
                connection.execute(
                    sa.update(d)
                    .where(d.c.recording_id == recording, d.c.number == dataset)
                    .values(lost=d.c.lost + readings.lost, damaged=d.c.damaged + readings.damaged)
                )
        if len(readings):
            parts.append(columns)

    @outlasting
    def table_angles(self, dataset: int, angles: TableAngles) -> None:
        """Record what the table's encoder said; the rate by it is the reference where the bench file says so."""
        values = angle_values(angles)
        d = tables.data_sets
        mine = (d.c.recording_id.in_(self._recordings.values()), d.c.number == dataset)
        with self._writing(synced=False) as connection:
            connection.execute(sa.update(d).where(*mine).values(**values))

    @outlasting
    def timed_run(self, run: ClockRun) -> None:
        """Record a run that times the step clock."""
        with self._writing() as connection:
            connection.execute(sa.insert(tables.timed_runs).values(campaign_id=self._campaign, **asdict(run)))

    @outlasting
    def step_clock(self, u_ppm: float, freedom: int, factor: Callable[[float], float]) -> None:
        """Correct the rates of the data sets so far, and record their uncertainty among the standards of recordings.

        It takes the place of what was expected when the campaign was planned.
        """
        measured = {"u": u_ppm, "expanded": None, "half_width": None, "freedom": float(freedom)}
        with self._writing() as connection:
            write_step_clock(connection, self._campaign, measured, factor)

    @outlasting
    def dataset_closed(self, dataset: int, state: DataSetState, reason: str = "") -> None:
        """Record that no more readings follow: figures are derived and blocks packed into one, in one transaction.

        A complete data set becomes partial where its readings turn out to be wrong afterwards; they are kept.
        """
        with self._writing() as connection:
            d = tables.data_sets.c
            mine = d.recording_id.in_(self._recordings.values())
            this_one = (mine, d.number == dataset, d.state == DataSetState.OPEN.value)
            recordings = set(connection.scalars(sa.select(d.recording_id).where(*this_one)))
            if state is DataSetState.PARTIAL:
                self._withdraw(connection, mine, dataset, reason)
            for gyro, recording in self._recordings.items():
                if recording in recordings:
                    raw = self._raw_of(connection, gyro, recording, dataset)
                    self._close_one(connection, gyro, recording, dataset, state, reason, raw)
        for gyro in self._recordings:
            self._open.pop((dataset, gyro), None)

    def dataset_withdrawn(self, dataset: int, gyro: str, reason: str) -> None:
        """Mark a complete data set as partial for one unit: its readings are kept, and not fitted."""
        with self._writing() as connection:
            mine = tables.data_sets.c.recording_id == self._recordings[gyro]
            self._withdraw(connection, mine, dataset, reason)

    @staticmethod
    def _withdraw(connection: sa.Connection, which: sa.ColumnElement[bool], dataset: int, reason: str) -> None:
        d = tables.data_sets.c
        withdrawn = (which, d.number == dataset, d.state == DataSetState.COMPLETE.value)
        values = {"state": DataSetState.PARTIAL.value, "reason": reason}
        connection.execute(sa.update(tables.data_sets).where(*withdrawn).values(**values))

    def _raw_of(
        self, connection: sa.Connection, gyro: str, recording: int, dataset: int
    ) -> dict[str, NDArray[np.generic]] | None:
        """Return a data set's readings as the device sent them; None when there are none."""
        parts = self._open.get((dataset, gyro)) or blocks_of(connection, recording, dataset)
        return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]} if parts else None

    def _close_one(
        self,
        connection: sa.Connection,
        gyro: str,
        recording: int,
        dataset: int,
        state: DataSetState,
        reason: str,
        raw: dict[str, NDArray[np.generic]] | None,
    ) -> None:
        d = tables.data_sets
        this = (d.c.recording_id == recording, d.c.number == dataset)
        n = 0
        late_values: dict[str, float] = {}
        if raw is not None:
            valid = raw["valid"] != 0
            n = int(valid.sum())
            head = connection.execute(sa.select(d).where(*this)).mappings().one()
            columns = scaled(raw, self._channels[gyro], head_of(head))
            if head["turn_deg"] is not None:  # how long it took is known only now
                late_values = {name: float(columns[key][-1].item()) for name, key in KNOWN_LATE.items()}
            means = means_rows(recording, dataset, columns, valid)
            connection.execute(sa.insert(tables.data_set_means), means)
            write_final_block(connection, recording, dataset, raw)
        connection.execute(sa.update(d).where(*this).values(state=state.value, reason=reason, n=n, **late_values))

    @outlasting
    def environment(self, sample: EnvironmentSample) -> None:
        """Record the environment, once for each unit whose thermometer, or that which stands for it, was read."""
        temperatures_c = {gyro: self._temperature_c(gyro, sample) for gyro in self._recordings}
        rows = [
            {
                "recording_id": recording,
                "t_s": sample.t_s,
                "run": sample.run,
                "temperature_c": temperatures_c[gyro],
                "chamber_c": sample.chamber_c,
                "chamber_setpoint_c": sample.chamber_setpoint_c,
            }
            for gyro, recording in self._recordings.items()
            if temperatures_c[gyro] is not None
        ]
        if rows:
            with self._writing(synced=False) as connection:
                connection.execute(_ADD_ENVIRONMENT, rows)

    def _temperature_c(self, gyro: str, sample: EnvironmentSample) -> float | None:
        """Return the temperature of a unit: by a reference thermometer where that stands for its own."""
        for channel in self._channels[gyro]:
            if channel.get("stands_for") == "temperature_c" and sample.run:
                return sample.references.get(channel["name"])
        return sample.gyro_c.get(gyro)

    @outlasting
    def event(self, event: Event, t_s: float, at: datetime) -> None:
        """Record something worth telling a person; a safe state that was not confirmed is also marked on the bench."""
        with self._writing() as connection:
            self._add_event(connection, event, t_s, at)
            if event.kind == "safe_state" and event.level == "error":
                c = tables.campaigns.c
                bench = connection.scalar(sa.select(c.bench_name).where(c.id == self._campaign)) or ""
                benches.mark(connection, bench, event.message.removeprefix(NOT_SAFE), at)

    def _add_event(self, connection: sa.Connection, event: Event, t_s: float, at: datetime) -> None:
        connection.execute(
            sa.insert(tables.events).values(
                campaign_id=self._campaign,
                at=at,
                t_s=t_s,
                kind=event.kind,
                level=event.level,
                message=event.message,
                device=event.device,
                value=event.value,
                limit_value=event.limit,
                unit=event.unit,
            )
        )


def _columns(readings: Readings, chamber_c: float | None) -> dict[str, NDArray[np.generic]]:
    columns: dict[str, NDArray[np.generic]] = {
        "t_ns": np.rint(readings.t_s * 1e9).astype(np.int64),
        **readings.raw,
        "valid": readings.valid.astype(np.int64),
    }
    for name, times_s in ((DEVICE_S, readings.device_s), (ARRIVAL_S, readings.arrival_s)):
        if times_s is not None:
            stored, per_s = STORED_TIMES[name]
            columns[stored] = np.rint(times_s * per_s).astype(np.int64)
    if chamber_c is not None:
        columns["chamber_mc"] = np.full(len(readings), round(chamber_c * 1e3), dtype=np.int64)
    return columns
