"""Writes recordings that were made elsewhere: readings, points or coefficients, with their environment."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime
from typing import Any

import numpy as np
import sqlalchemy as sa
from numpy.typing import NDArray

from labctl.recording import Recording, RecordingInfo, dataset_starts
from labctl.store import sample_codec
from labctl.store.dataset_statistics import means_rows
from labctl.store.repositories.sample_blocks import WHOLE_TABLE, block_row
from labctl.store.repositories.units import remember_unit
from labctl.store.schema import tables


def new_recording(
    connection: sa.Connection,
    info: RecordingInfo,
    at: datetime,
    *,
    campaign: int | None = None,
    gyro: str | None = None,
    channels: tuple[Mapping[str, Any], ...] = (),
) -> int:
    """Make the row of a recording, and of its unit where that is new; returns the recording's number."""
    remember_unit(connection, info.serial, info.model, info.technology, at)
    row = sa.insert(tables.recordings).values(
        serial=info.serial,
        campaign_id=campaign,
        gyro=gyro,
        kind=info.kind,
        info=info.model_dump(mode="json"),
        channels=[dict(channel) for channel in channels],
        created_at=at,
    )
    return int(connection.scalar(row.returning(tables.recordings.c.id)) or 0)


def write_recording(connection: sa.Connection, recording: Recording, at: datetime) -> int:
    """Write a whole recording inside the transaction of `connection`; returns its number."""
    number = new_recording(connection, recording.info, at)
    if recording.info.kind == "samples":
        _add_samples(connection, number, recording)
    else:
        _add_table(connection, number, recording)
    _add_environment(connection, number, recording)
    return number


def _add_samples(connection: sa.Connection, recording: int, samples: Recording) -> None:
    columns = {name: np.asarray(values) for name, values in samples.columns.items()}
    starts = dataset_starts(columns["dataset"])
    ends = np.append(starts[1:], len(columns["dataset"]))
    heads, means, packed = [], [], []
    for start, end in zip(starts, ends, strict=True):
        part = {name: values[start:end] for name, values in columns.items()}
        number = int(part["dataset"][0])
        valid = part["valid"] != 0 if "valid" in part else np.ones(end - start, dtype=bool)
        counted = {name: values[valid] for name, values in part.items()} if valid.any() else part
        heads.append(_head_of(recording, number, counted, int(valid.sum())))
        means += means_rows(recording, number, part, valid)
        packed.append(block_row(recording, number, 0, sample_codec.pack(part, sample_codec.FINAL)))
    _insert(connection, (tables.data_sets, heads), (tables.data_set_means, means), (tables.sample_blocks, packed))


def _head_of(recording: int, number: int, part: dict[str, NDArray[Any]], n: int) -> dict[str, Any]:
    angle, setpoint = part.get("table_angle_deg"), part.get("chamber_setpoint_c")
    power = part.get("power_s")
    return {
        "recording_id": recording,
        "number": number,
        "state": "complete",
        "reason": "",
        "position": str(part["position"][0]),
        "run": int(part["run"][0]) if "run" in part else 1,
        "mounting": int(part["mounting"][0]) if "mounting" in part else 1,
        "table_rate_dps": float(part["table_rate_dps"].mean()),
        "table_angle_deg": None if angle is None else float(angle[0]),
        "chamber_setpoint_c": None if setpoint is None else float(setpoint[0]),
        "gate_from_s": float(part["t_s"][0]) if "t_s" in part else None,
        "gate_until_s": float(part["t_s"][-1]) if "t_s" in part else None,
        "power_on_s": None if power is None else float(part["t_s"][0] - power[0]),
        "n": n,
    }


def _add_table(connection: sa.Connection, recording: int, table: Recording) -> None:
    columns = {name: np.asarray(values) for name, values in table.columns.items()}
    packed = [block_row(recording, WHOLE_TABLE, 0, sample_codec.pack(columns, sample_codec.FINAL))]
    heads: list[dict[str, Any]] = []
    if table.info.kind == "points":
        for row in range(len(table)):
            part = {name: values[row : row + 1] for name, values in columns.items()}
            n = int(part["n"][0]) if "n" in part else 1
            heads.append({**_head_of(recording, int(part["dataset"][0]), part, n), "power_on_s": None})
    _insert(connection, (tables.data_sets, heads), (tables.sample_blocks, packed))


def _add_environment(connection: sa.Connection, recording: int, source: Recording) -> None:
    if source.environment is None:
        return
    known = ("t_s", "run", "temperature_c", "chamber_c", "chamber_setpoint_c")
    columns = {name: np.asarray(source.environment[name]).tolist() for name in known if name in source.environment}
    rows = [dict(zip(columns, values, strict=True)) for values in zip(*columns.values(), strict=True)]
    _insert(connection, (tables.environment, [{"recording_id": recording, **row} for row in rows]))


def _insert(connection: sa.Connection, *pieces: tuple[sa.Table, list[dict[str, Any]]]) -> None:
    for table, rows in pieces:
        if rows:
            connection.execute(sa.insert(table), rows)
