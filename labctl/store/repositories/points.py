"""The points of a recording: one row per complete data set, from the rows of data sets and means alone."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import sqlalchemy as sa
from numpy.typing import NDArray

from labctl.recording.columns import VERIFICATION
from labctl.store.schema import tables


def points_columns(connection: sa.Connection, recording: int) -> dict[str, NDArray[np.generic]]:
    """Return the points of a recording's complete data sets, column by column, from rows alone."""
    d, m = tables.data_sets.c, tables.data_set_means.c
    heads = connection.execute(
        sa.select(
            d.number, d.position, d.run, d.mounting, d.table_rate_dps, d.table_angle_deg, d.chamber_setpoint_c,
            d.gate_from_s, d.gate_until_s, d.power_on_s, d.n, d.verification,
        )
        .where(d.recording_id == recording, d.state == "complete", d.n > 0)
        .order_by(d.number)
    ).all()  # fmt: skip
    index = {row[0]: i for i, row in enumerate(heads)}
    columns: dict[str, NDArray[np.generic]] = {"dataset": np.array([row[0] for row in heads], dtype=np.int64)}
    begin, end = _floats(heads, 7), _floats(heads, 8)
    t_s = (begin + end) / 2
    columns["t_s"], columns["duration_s"] = t_s, end - begin
    columns["position"] = np.array([row[1] for row in heads], dtype=np.str_)
    columns["run"] = np.array([row[2] for row in heads], dtype=np.int64)
    columns["mounting"] = np.array([row[3] for row in heads], dtype=np.int64)
    if any(row[11] for row in heads):
        columns[VERIFICATION] = np.array([bool(row[11]) for row in heads], dtype=np.int64)
    columns["table_rate_dps"] = _floats(heads, 4)
    known = {
        "table_angle_deg": _floats(heads, 5),
        "chamber_setpoint_c": _floats(heads, 6),
        "power_s": t_s - _floats(heads, 9),
    }
    columns |= {name: values for name, values in known.items() if np.isfinite(values).all()}
    columns["n"] = np.array([row[10] for row in heads], dtype=np.int64)
    means = connection.execute(
        sa.select(m.channel, m.number, m.mean, m.std, m.white_std).where(m.recording_id == recording)
    )
    for channel, number, mean, std, white in means:
        if number not in index:
            continue
        row = index[number]
        for name, value in ((channel, mean), (f"{channel}_std", std), (f"{channel}_white_std", white)):
            if value is not None and (name == channel or channel.startswith("gyro_")):
                columns.setdefault(name, np.full(len(heads), np.nan))[row] = value
    return {name: values for name, values in columns.items() if values.dtype.kind != "f" or np.isfinite(values).all()}


def _floats(rows: Sequence[Sequence[object]], column: int) -> NDArray[np.float64]:
    return np.array([np.nan if row[column] is None else row[column] for row in rows], dtype=np.float64)
