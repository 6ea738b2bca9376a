"""Nine parameters of an accelerometer from files of its readings in poses, as a response."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from labctl.answers.accelerometer import AccelerometerResponse, AccelerometerTemperature
from labctl.answers.magnetometer import Estimate
from labctl.errors import BadInput, BadRecording, NotEnoughData
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.poses.at_rest.accelerometer import Accelerometer, calibrate_accelerometer, different_poses
from labctl.fitting.poses.at_rest.adequacy import Adequacy, adequacy_of
from labctl.fitting.poses.at_rest.fewer_poses import by_fewer_poses
from labctl.fitting.poses.at_rest.gravity import STANDARD_GRAVITY
from labctl.fitting.poses.at_rest.rests import Rests, find_rests
from labctl.fitting.poses.at_rest.temperature import OverTemperature, calibrate_over_temperature
from labctl.fitting.poses.description import alignment_json, alignment_text
from labctl.fitting.poses.fit import Solved, solve
from labctl.fitting.poses.readings import AXES, GAP, MIN_READINGS, PoseReadings, readings_of
from labctl.fitting.poses.triad import UPPER
from labctl.recording import RecordingInfo
from labctl.recording.data_files import read_table
from labctl.recording.files import read_recording
from labctl.recording.info import NO_DATE
from labctl.services.pose_triads import Earlier, require_one, solve_even, solve_with_earlier
from labctl.services.table_readings import numbers_of

#: Units of readings, in g.
UNITS_G = {"g": 1.0, "mg": 1e-3, "m/s2": 1 / STANDARD_GRAVITY}
COLUMNS = ("t_s", "accel_x_g", "accel_y_g", "accel_z_g")


@dataclass(frozen=True)
class Source:
    """How a table of readings is read; a recording says it itself."""

    columns: Sequence[str] = COLUMNS  #: time in s, then x, y and z
    unit: str = "g"
    latitude_deg: float | None = None
    temperature: str | None = None  #: column of the temperature, deg C; None: it is not read

    @property
    def text(self) -> str:
        """What was read, in one line."""
        local = "" if self.latitude_deg is None else f", gravity at latitude {self.latitude_deg:g} deg"
        temperature_text = "" if self.temperature is None else f", temperature {self.temperature} in deg C"
        return f"columns {', '.join(self.columns)} in {self.unit}{local}{temperature_text}"


def accelerometer_of_files(
    paths: Sequence[Path], source: Source, serial: str | None = None, earlier: Earlier | None = None
) -> AccelerometerResponse:
    """Return the calibration by all files of one unit; raises BadInput, BadRecording, NotEnoughData.

    `serial` is its serial number where it is known: a recording of another unit is refused. With an earlier version of
    the unit four poses are enough.
    """
    if source.unit not in UNITS_G:
        raise BadInput(f"--unit {source.unit}: give one of {', '.join(UNITS_G)}")
    if source.latitude_deg is not None and not abs(source.latitude_deg) <= 90:
        raise BadInput(f"--latitude {source.latitude_deg:g}: give the latitude in deg, from -90 to 90")
    if len(source.columns) != len(COLUMNS):
        raise BadInput(f"--columns {','.join(source.columns)}: name four columns, of time, x, y and z")
    parts = [_readings(path, source) for path in paths]
    for path, part in zip(paths, parts, strict=True):
        if serial is not None and path.is_dir() and part.info.serial != serial:
            raise BadInput(
                f"{path}: this recording is of unit {part.info.serial}, but --serial is {serial}; name its unit"
            )
    readings = _joined(parts)
    rests = find_rests(readings)
    require_one(source.temperature, earlier)
    if source.temperature is not None:
        over_temperature = calibrate_over_temperature(readings, rests)
        return _with_alignment(
            _over_temperature(over_temperature, rests), readings, lambda: solve_even(readings, rests, over_temperature)
        )
    if earlier is None:
        accelerometer = calibrate_accelerometer(readings, rests)
        answer = _response(accelerometer, rests, adequacy_of(accelerometer, rests))
        return _with_alignment(answer, readings, lambda: solve(readings, (rests, accelerometer)))
    known = earlier.known()
    fewer = by_fewer_poses(readings, rests, known)
    worth = adequacy_of(fewer.accelerometer, rests, known.whitened)
    answer = _response(fewer.accelerometer, rests, worth).model_copy(update={
        "verdict": "adequate" if fewer.agrees else "unexplained", "earlier": earlier.answer(fewer.p_value),
        "text": [*_size_text(fewer.accelerometer, worth), earlier.text(fewer)],
    })  # fmt: skip
    return _with_alignment(answer, readings, lambda: solve_with_earlier(readings, rests, earlier, fewer))


def _readings(path: Path, source: Source) -> PoseReadings:
    if path.is_dir():
        return readings_of(read_recording(path))
    if not path.is_file():
        raise BadRecording(f"{path}: not found; name a CSV or Parquet file of readings, or the folder of a recording")
    table = read_table(path)
    temperature_columns = [] if source.temperature is None else [source.temperature]
    rows = numbers_of(
        path,
        table,
        [*source.columns, *temperature_columns],
        "time, x, y and z" + ", and temperature" * len(temperature_columns),
    )
    if len(rows) < MIN_READINGS:
        raise BadRecording(f"{path}: {len(rows)} rows; rests in poses need at least {MIN_READINGS}; record longer")
    steps = np.diff(rows[:, 0])
    back = np.flatnonzero(steps <= 0)
    if len(back):
        raise BadRecording(f"{path}: row {int(back[0]) + 2}: the time does not increase; sort the rows by time, in s")
    info = RecordingInfo.model_construct(
        serial=str(path), axes=AXES, kind="samples", motion="poses", started_at=NO_DATE,
        latitude_deg=source.latitude_deg,
    )  # fmt: skip
    breaks = np.concatenate([[False], steps > GAP * float(np.median(steps))])
    # without a gyro nothing tells a turn about the vertical, which leaves the specific force as it is
    return PoseReadings(
        info, rows[:, 0], UNITS_G[source.unit] * rows[:, 1:4], np.zeros((len(rows), 3)),
        rows[:, 4] if temperature_columns else None, breaks,
    )  # fmt: skip


def _joined(parts: Sequence[PoseReadings]) -> PoseReadings:
    """Return the readings of all parts, one after the other, with a break between them."""
    whole = parts[0]
    for part in parts[1:]:
        if part.info.latitude_deg != whole.info.latitude_deg:
            raise BadInput(
                f"{part.info.serial}: latitude {part.info.latitude_deg} deg, but {whole.info.latitude_deg} deg of "
                f"{whole.info.serial}; calibrate files of one place together"
            )
        if part.gyro_dps.any() != whole.gyro_dps.any():
            raise BadInput(
                f"{part.info.serial} and {whole.info.serial}: one is a recording with a gyro, the other a table "
                "without; calibrate recordings together, or tables"
            )
        breaks = part.breaks.copy()
        breaks[0] = True
        later = part.t_s - part.t_s[0] + whole.t_s[-1] + 1.0
        whole = replace(
            whole,
            t_s=np.concatenate([whole.t_s, later]),
            accel_g=np.vstack([whole.accel_g, part.accel_g]),
            gyro_dps=np.vstack([whole.gyro_dps, part.gyro_dps]),
            temperature_c=_both(whole.temperature_c, part.temperature_c),
            breaks=np.concatenate([whole.breaks, breaks]),
        )
    return whole


def _both(first: Array | None, then: Array | None) -> Array | None:
    return None if first is None or then is None else np.concatenate([first, then])


def _with_alignment(
    answer: AccelerometerResponse, readings: PoseReadings, solved: Callable[[], Solved]
) -> AccelerometerResponse:
    """Return a calibration with the alignment of the gyro triad, or with why rests and turns do not tell it."""
    if not readings.gyro_dps.any():
        return answer
    try:
        alignment = alignment_json(solved().alignment)
    except NotEnoughData as error:
        return answer.model_copy(update={"text": [*answer.text, f"Alignment of the gyro triad: unknown: {error}"]})
    return answer.model_copy(update={"alignment": alignment, "text": [*answer.text, alignment_text(alignment)]})


def _over_temperature(fitted: OverTemperature, rests: Rests) -> AccelerometerResponse:
    """Return a calibration over temperature as a response."""
    begin = len(fitted.reference.covariance)

    def terms(values: NDArray[np.float64], first: int) -> dict[str, list[Estimate]]:
        places = first + np.arange(values.size).reshape(values.shape)
        return {
            a: [_estimate(value, fitted, place) for value, place in zip(values[:, i], places[:, i], strict=True)]
            for i, a in enumerate(AXES)
        }

    low, high = fitted.range_c
    answer = _response(fitted.reference, rests, fitted.adequacy)
    sentence = (
        f"Over {low:.1f} to {high:.1f} deg C ({fitted.temperatures} temperatures), about {fitted.reference_c:g} deg C: "
        f"bias to the power {len(fitted.bias_g)}, scale factors to the power {len(fitted.scale_factor)}; constants "
        f"would leave {fitted.constant_g:.2g} g."
    )
    return answer.model_copy(update={
        "text": [*answer.text, sentence],
        "temperature": AccelerometerTemperature(
            reference_c=fitted.reference_c, range_c=fitted.range_c, temperatures=fitted.temperatures,
            bias_g=terms(fitted.bias_g, begin), scale_factor=terms(fitted.scale_factor, begin + fitted.bias_g.size),
            covariance=fitted.covariance.tolist(), constant_g=fitted.constant_g,
        ),
    })  # fmt: skip


def _estimate(value: float, fitted: Accelerometer | OverTemperature, place: int) -> Estimate:
    """Return a value with the standard uncertainty that stands at a place of the covariance."""
    return Estimate(value=float(value), u=float(fitted.u[place]), degrees_of_freedom=float(fitted.u_freedom[place]))


def _response(accelerometer: Accelerometer, rests: Rests, worth: Adequacy) -> AccelerometerResponse:
    errors = {
        f"{AXES[i]}{AXES[j]}": _estimate(accelerometer.errors[i, j], accelerometer, 3 + k)
        for k, (i, j) in enumerate(UPPER)
    }
    return AccelerometerResponse(
        verdict=worth.verdict,
        bias_g={a: _estimate(accelerometer.bias_g[i], accelerometer, i) for i, a in enumerate(AXES)},
        scale_factor={a: errors[a + a] for a in AXES},
        misalignment={name: each for name, each in errors.items() if name[0] != name[1]},
        covariance=accelerometer.covariance.tolist(), gravity_g=accelerometer.gravity_g,
        rests=len(rests), left_out=int((~accelerometer.used).sum()), poses=different_poses(accelerometer.up),
        before_g=worth.before_g, residual_g=accelerometer.residual_g, heldout_g=worth.heldout_g,
        expected_g=worth.expected_g,
        noise_density_m_s2={
            a: float(STANDARD_GRAVITY * np.sqrt(rests.density[i])) for i, a in enumerate(AXES)
        },
        text=list(_text(accelerometer, worth)),
    )  # fmt: skip


def _size_text(accelerometer: Accelerometer, worth: Adequacy) -> Iterator[str]:
    worst = float(np.sqrt(np.diag(accelerometer.covariance)[:3]).max())
    yield f"Accelerometer: bias with u up to {worst:.2g} g; local gravity {accelerometer.gravity_g:.6g} g."
    yield (
        f"Size of gravity: off by {worth.before_g:.2g} g before, {worth.heldout_g:.2g} g after, in held-out rests; "
        f"the noise of their means lets expect {worth.expected_g:.2g} g."
    )


def _text(accelerometer: Accelerometer, worth: Adequacy) -> Iterator[str]:
    yield from _size_text(accelerometer, worth)
    if worth.verdict == "unexplained":
        yield (
            f"that is {worth.heldout_g / worth.expected_g:.1f} times as much: the bias drifted, the unit moved in its "
            "rests, or the output is not linear; the uncertainties include it"
        )
