"""Static bias and orientation of a recording, or of a file of readings, corrected by a calibration or not."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import get_args

import numpy as np
from numpy.typing import NDArray

from labctl.answers.orientation import STOP_S, OrientationOptions, OrientationResponse, StaticBiasResponse
from labctl.answers.recording_head import Axis
from labctl.calibration import Calibration, CalibrationWarning, read_calibration
from labctl.compensator import Compensator
from labctl.error_per_turn import static_bias
from labctl.errors import BadInput, BadRecording, NotCertified, NotEnoughData
from labctl.fitting.numeric.arrays import Array
from labctl.orientation import Orientation
from labctl.recording import OutputUnit
from labctl.recording.recording import Columns
from labctl.services.calibrations.served import calibration_file
from labctl.services.recordings.loading import newest_row
from labctl.store import Store

#: Points of a course that is sent.
MAX_POINTS = 2000
TABLES = frozenset({".csv", ".parquet"})


@dataclass(frozen=True)
class _Source:
    """What the angle is followed in: its name in errors, its columns, the units of its outputs."""

    what: str
    columns: Columns
    units: dict[str, OutputUnit]


def orientation_of_unit(
    store: Store, serial: str, recording: int | None, version: int | None, options: OrientationOptions
) -> OrientationResponse:
    """Follow the angle in a unit's recording (default: the newest); see `orientation_of_recording`."""
    return orientation_of_recording(store, newest_row(store, serial, recording).id, version, options)


def orientation_of_recording(
    store: Store, recording: int, version: int | None, options: OrientationOptions
) -> OrientationResponse:
    """Follow the angle in a recording's readings, corrected by a version: default the one in force, 0 none.

    Raises NotFound, BadInput, NotEnoughData.
    """
    row = store.recordings.get(recording)
    if row.kind != "samples":
        raise BadInput(
            f"recording {recording} holds {row.kind}, but an angle is integrated from single "
            "readings; name a recording of readings"
        )
    info = row.recording_info
    parts = [columns for _, columns in store.recordings.iter_datasets(recording)]
    columns = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]} if parts else {}
    return _follow(
        _Source(f"recording {recording}", columns, dict(info.output.items())),
        _version(store, row.serial, version),
        options,
    )[0]


def orientation_of_file(
    source: Path, calibration: Path | None, target: Path | None, options: OrientationOptions
) -> OrientationResponse:
    """Follow the angle in a file of readings (`t_s`, `gyro_z` in deg/s or in the calibration's unit, `temperature_c`).

    With `target` the rows are written there with `angle_z_deg`. Raises BadInput, BadRecording, BadCalibrationFile,
    NotEnoughData.
    """
    # PyArrow takes 0.2 s to load, and a service follows stored recordings only
    import pyarrow as pa  # noqa: PLC0415
    import pyarrow.csv as pacsv  # noqa: PLC0415
    import pyarrow.parquet as pq  # noqa: PLC0415

    from labctl.recording.data_files import read_table  # noqa: PLC0415

    if target is not None and target.resolve() == source.resolve():
        raise BadInput(f"{target}: this is the input; name another file for the result")
    if target is not None and target.suffix not in TABLES:
        raise BadInput(f"{target}: the result is a table; name a file that ends in .csv or .parquet")
    if source.suffix not in TABLES:
        raise BadInput(
            f"{source}: the file must be a .csv or .parquet table; import any other file with "
            "`labctl import`, then give the serial number of its unit"
        )
    given_calibration = None if calibration is None else read_calibration(calibration)
    columns = read_table(source)
    answer, angle = _follow(_Source(str(source), columns, {}), given_calibration, options)
    if target is not None:
        table = pa.table({**columns, f"angle_{answer.axis}_deg": angle})
        (pq.write_table if target.suffix == ".parquet" else pacsv.write_csv)(table, target)
    return answer


def orientation_of_readings(what: str, columns: Columns, options: OrientationOptions) -> OrientationResponse:
    """Follow the angle in readings (n,): `t_s`, and `gyro_z` or another axis in deg/s. `what` names them in errors.

    Raises BadInput, BadRecording, NotEnoughData.
    """
    return _follow(_Source(what, columns, {}), None, options)[0]


def _version(store: Store, serial: str, version: int | None) -> Calibration | None:
    if version == 0:
        return None
    try:
        return read_calibration(calibration_file(store, serial, version, "json").content)
    except NotCertified:
        return None


def _follow(
    source: _Source, calibration: Calibration | None, options: OrientationOptions
) -> tuple[OrientationResponse, Array]:
    """Return the answer, and the angle at every row, NaN before the end of the rest and where a row is left out."""
    axis = _axis(source, options.axis)
    t_s, (rate, warning) = _column(source, "t_s"), _rate_dps(source, axis, calibration)
    rows, left_out = _rows(source, axis, t_s, rate, options.warm_up_s)
    resting = t_s[rows] - t_s[rows[0]] < options.rest_s
    bias = static_bias(rate[rows][resting], options.instability_dps) if options.rest_s > 0 else None
    moving = rows[~resting]
    o = Orientation(offset_dps=bias.bias_dps if bias else 0.0)
    angle = np.full(len(t_s), np.nan)
    standing_s, before = 0.0, None
    declared = _declared(t_s[moving], options)
    for row, still in zip(moving.tolist(), declared, strict=True):
        angle[row] = o.update(float(t_s[row]), float(rate[row]), still=still)
        standing_s += float(t_s[row]) - before if o.standing and before is not None else 0.0
        before = float(t_s[row])
    seconds = float(t_s[moving[-1]] - t_s[moving[0]]) if len(moving) else 0.0
    shown_rows = (
        moving[np.unique(np.linspace(0, len(moving) - 1, min(len(moving), MAX_POINTS)).astype(int))]
        if len(moving)
        else moving
    )
    answer = OrientationResponse(
        axis=axis, version=calibration.version if calibration else None, readings=len(rows),
        left_out=left_out, seconds=seconds,
        static_bias=None if bias is None else StaticBiasResponse(
            bias_dps=bias.bias_dps, u_dps=bias.u_dps, readings=bias.readings, seconds=options.rest_s
        ),
        angle_deg=o.angle_deg, drift_deg_per_min=60 * o.angle_deg / seconds if seconds > 0 else None,
        drift_between_stops_deg_per_min=_between_stops(t_s[moving], angle[moving], declared, options),
        offset_dps=o.offset_dps, standing_s=standing_s, gap_s=o.gap_s, t_s=t_s[shown_rows].tolist(),
        course_deg=angle[shown_rows].tolist(), warning=warning,
    )  # fmt: skip
    return answer, angle


def _rows(source: _Source, axis: str, t_s: Array, rate: Array, warm_up_s: float) -> tuple[NDArray[np.int64], int]:
    """Return the valid rows after the warm-up, and how many were not valid. Raises NotEnoughData, BadRecording."""
    good = np.isfinite(rate) & np.isfinite(t_s)
    if "valid" in source.columns:
        good &= _column(source, "valid") != 0
    rows = np.flatnonzero(good)
    if len(rows) == 0:
        raise NotEnoughData(f"{source.what}: column gyro_{axis} has no valid reading; check that it holds numbers")
    if len(back := np.flatnonzero(np.diff(t_s[rows]) <= 0)):
        row = int(rows[back[0] + 1])
        raise BadRecording(
            f"{source.what}: column 't_s', row {row + 1}: {t_s[row]:g} s is not later than the row before; sort the "
            "rows by time"
        )
    after_warm_up = rows[t_s[rows] - t_s[rows[0]] >= warm_up_s]
    if len(after_warm_up) == 0:
        raise NotEnoughData(
            f"{source.what}: its readings last {t_s[rows[-1]] - t_s[rows[0]]:.0f} s, but the warm-up to leave "
            f"out is {warm_up_s:g} s; give a shorter warm-up, or record for longer"
        )
    return after_warm_up, len(t_s) - len(rows)


def _declared(t_s: Array, options: OrientationOptions) -> list[bool | None]:
    """Return what is declared of each reading (n,): True at a stop, False between stops, None where nothing is."""
    if options.stop_every_s is None:
        return [None if options.standstill else False] * len(t_s)
    if not options.stop_every_s > 2 * STOP_S:
        raise BadInput(
            f"a stop every {options.stop_every_s:g} s is too often: a stop lasts {STOP_S:g} s; give more than "
            f"{2 * STOP_S:g} s"
        )
    return [bool(since % options.stop_every_s < STOP_S) for since in (t_s - t_s[0]).tolist()] if len(t_s) else []


def _between_stops(
    t_s: Array, angle_deg: Array, declared: list[bool | None], options: OrientationOptions
) -> list[float]:
    """Return by how much the angle drifts between two stops, deg/min, one number for each whole leg."""
    if options.stop_every_s is None:
        return []
    moves = np.array(declared) == False  # noqa: E712  None is neither
    edges = np.flatnonzero(np.diff(np.concatenate([[False], moves, [False]]).astype(int)))
    legs = [(a, b - 1) for a, b in edges.reshape(-1, 2).tolist() if b < len(t_s)]  # the last may be broken off
    return [60.0 * float(angle_deg[b] - angle_deg[a]) / float(t_s[b] - t_s[a]) for a, b in legs if b > a]


def _axis(source: _Source, axis_name: str | None) -> str:
    axes = [axis for axis in get_args(Axis) if f"gyro_{axis}" in source.columns]
    if axis_name is None and len(axes) == 1:
        return axes[0]
    if axis_name is None or axis_name not in axes:
        text = ", ".join(axes) or "none"
        raise BadInput(
            f"{source.what}: axis {axis_name or 'not named'}; name an axis that the data have a column for ({text})"
        )
    return axis_name


def _rate_dps(source: _Source, axis: str, calibration: Calibration | None) -> tuple[Array, str]:
    """Return the rate about an axis at every row, deg/s, and what has to be said of the calibration."""
    if calibration is None:
        output_unit = source.units.get(axis, OutputUnit())
        return (_column(source, f"gyro_{axis}") - output_unit.offset) / output_unit.scale, ""
    if axis not in calibration.axes:
        raise BadInput(
            f"{source.what}: the calibration has axes {', '.join(calibration.axes)}, not {axis}; name one of these axes"
        )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", CalibrationWarning)  # the answer says it
        compensator = Compensator(calibration)
    output = np.column_stack([_column(source, f"gyro_{each}") for each in compensator.axes])
    temperature_column = _column(source, "temperature_c") if compensator.needs_temperature else None
    channels = {name: _column(source, name) for name in compensator.needs}
    rates = compensator.compensate_output(output, temperature_column, channels)
    return rates.rate_dps[:, compensator.axes.index(axis)], compensator.warning


def _column(source: _Source, name: str) -> Array:
    if name not in source.columns:
        raise BadRecording(f"{source.what}: column {name!r} is missing; add it")
    return np.asarray(source.columns[name], dtype=np.float64)
