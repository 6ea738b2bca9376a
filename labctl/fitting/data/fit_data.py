"""What a fit works on: data-set means, their noise and their temperature levels."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from labctl.errors import BadInput, NotEnoughData
from labctl.fitting.data.channels import Argument, Channels, channels_of
from labctl.fitting.data.covered import Covered, covered_by_means, covered_by_readings
from labctl.fitting.data.earth_rate import up_rate_dps
from labctl.fitting.data.mean_noise import white_var_of
from labctl.fitting.data.mounting_angles import AngleColumns, angle_columns, placed_rad
from labctl.fitting.data.noise_floor import NoiseFloor, noise_floor_of
from labctl.fitting.data.rate_profile import RateProfile, rate_profile
from labctl.fitting.data.response import Response
from labctl.fitting.data.temperature.channel import with_temperature
from labctl.fitting.data.temperature.levels import folds, temperature_levels
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.drift_noise import Scatter
from labctl.recording import Recording, RecordingInfo, to_points
from labctl.recording.verification import fitted_part


@dataclass(frozen=True)
class FitData:
    """The m data sets of a recording as a fit sees them."""

    info: RecordingInfo
    channels: Channels  #: true rates along the body axes, Earth included where it is known
    outputs: Mapping[str, Array]  #: axis -> (m,) gyro output, deg/s
    white_var: Mapping[str, Array] | None  #: axis -> (m,) variance of the mean from white noise, (deg/s)^2
    covered: Covered  #: by the readings behind the means, where they are known
    angles_known: bool = False  #: whether the true rates are those of a unit that leans as its mountings do

    def __len__(self) -> int:
        return len(self.channels)

    @cached_property
    def temperature_c(self) -> Array:
        """The temperature of each data set, (m,)."""
        return np.asarray(self.channels["temperature_c"], dtype=np.float64)

    @cached_property
    def levels(self) -> NDArray[np.int64] | None:
        """The temperature level of each data set, (m,); None where there are no discrete levels."""
        return temperature_levels(self.temperature_c)

    @cached_property
    def without_each_temperature(self) -> list[tuple[FitData, FitData]]:
        """For each temperature left out (`folds`), rising: the other data sets, and those at it."""
        return [(self.take(~mask), self.take(mask)) for mask in self.folds]

    @property
    def folds(self) -> list[NDArray[np.bool_]]:
        """The data sets that are left out together, (m,) each: of one temperature or, without thermometer, one time."""
        return folds(self.temperature_c, thermometer=self.channels.history.thermometer)

    @cached_property
    def held_out_pairs(self) -> list[tuple[FitData, FitData]]:
        """For each part left out (a temperature or, of turns, a turn): the other data sets, and the part."""
        if self.info.motion != "turns":
            return self.without_each_temperature
        turns = np.eye(len(self), dtype=bool)[self.channels.table_rate_dps() != 0]
        return [(self.take(~mask), self.take(mask)) for mask in turns]

    @cached_property
    def _rate_counts(self) -> dict[str, int]:
        return {}

    @cached_property
    def noise_floor(self) -> NoiseFloor:
        """The noise of these data sets, whatever the model."""
        errors = {axis: self.outputs[axis] - self.true_rate_dps(axis) for axis in self.outputs}
        return noise_floor_of(self.channels, errors, {axis: self.scatter(axis) for axis in self.outputs})

    def angle_columns(self, axis: str) -> AngleColumns:
        """Return the regressors of the angles that the mountings separate, of one output; none where they are known."""
        placed = placed_rad(self.info.standards)
        return AngleColumns.none(len(self)) if self.angles_known else angle_columns(self.channels, axis, placed)

    def true_rate_dps(self, axis: str) -> Array:
        """Return the true rate along an axis, (m,) deg/s."""
        return self.channels.rate_dps(axis)

    @property
    def across_dps(self) -> dict[str, Array]:
        """True rates about the body axes that have no output, axis -> (m,) deg/s: known here, not where it is used."""
        return {axis: rates for axis, rates in self.channels.rates.items() if axis not in self.outputs}

    def seen_by(self, argument: Argument) -> Channels:
        """Return the channels with the rates that a law sees: the true ones, or the outputs in place of theirs."""
        if argument == "rate":
            return self.channels
        return self.channels.with_rates({**self.across_dps, **self.outputs})

    def take(self, rows: NDArray[np.bool_]) -> FitData:
        """Return the context of some data sets, by mask (m,)."""
        white = None if self.white_var is None else {a: v[rows] for a, v in self.white_var.items()}
        return replace(
            self,
            channels=self.channels.take(rows),
            outputs={axis: values[rows] for axis, values in self.outputs.items()},
            white_var=white,
        )

    def through(self, response: Response) -> FitData:
        """Return the same data sets with the true rates as they come through a response."""
        channels = self.channels.through(response)
        return self if channels is self.channels else replace(self, channels=channels)

    def white_dps(self, axis: str) -> float | None:
        """Return the white noise of a data-set mean, root mean square, deg/s; None when it is not known."""
        return None if self.white_var is None else float(np.sqrt(self.white_var[axis].mean()))

    def scatter(self, axis: str) -> Scatter:
        """Return what is known of the noise of one axis before the fit."""
        m = len(self)
        in_order = next((name for name in ("t_s", "dataset") if name in self.channels), None)
        # without times the numbers of the data sets stand for them: some that are left out leave a gap
        t_s = np.arange(float(m)) if in_order is None else np.asarray(self.channels[in_order], dtype=np.float64)
        return Scatter(
            t_s,
            np.asarray(self.channels["run"], dtype=np.int64) if "run" in self.channels else np.ones(m, dtype=np.int64),
            np.asarray(self.channels["table_rate_dps"], dtype=np.float64),
            None if self.white_var is None else self.white_var[axis],
            self.info.stability_dps,
        )

    def distinct_rates(self, axis: str) -> int:
        """Return how many different rates an axis was turned at, to a thousandth of the fastest.

        The Earth's rate, which differs from position to position, is none of them: at rest the answer is 1.
        """
        if not np.any(self.channels.table_rate_dps()):
            return 1
        if axis not in self._rate_counts:
            rates = self.true_rate_dps(axis)
            step = max(float(np.max(np.abs(rates), initial=0.0)) * 1e-3, 1e-9)
            self._rate_counts[axis] = len(np.unique(np.round(rates / step)))
        return self._rate_counts[axis]

    def distinct_temperatures(self) -> int:
        """Return how many different temperatures there are; without discrete levels, how many whole degrees."""
        if self.levels is not None:
            return int(self.levels.max()) + 1
        return len(np.unique(np.round(self.temperature_c)))


def refuse_poses(info: RecordingInfo) -> None:
    """Raise BadInput for a recording in poses: none of its data sets has a known rate."""
    if info.motion == "poses":
        raise BadInput(
            f"{info.serial}: a recording of poses contains the direction of gravity before and after each turn, "
            "but no rate, which other models and criticism need; use `labctl fit --model poses` and `labctl verify`"
        )


def fit_data_of(recording: Recording, covered: Covered | None = None) -> FitData:
    """Return what a fit of this recording works on.

    `covered` is the range of the readings behind a recording of means, where it is known. What was measured to verify a
    calibration is left out.

    Raises BadInput for coefficients, NotEnoughData when empty or where nothing says how warm the unit was.
    """
    if recording.info.kind == "coefficients":
        raise BadInput(
            f"{recording.info.serial}: the recording is a table of coefficients and holds no readings; name a "
            "recording of readings or means"
        )
    refuse_poses(recording.info)
    recording = fitted_part(recording)
    points = to_points(recording)
    if len(points) == 0:
        raise NotEnoughData(
            f"{recording.info.serial}: the recording has no complete data set with valid readings; check column "
            "'valid', or record data sets"
        )
    points = with_temperature(points)
    info = points.info
    outputs: dict[str, Array] = {axis: points.gyro_dps(axis) for axis in info.axes}
    up_dps = up_rate_dps(info)
    channels = channels_of(points, up_dps, profile_of(recording))
    if covered is None and recording.info.kind == "samples":
        covered = covered_by_readings(recording, up_dps)
    return FitData(info, channels, outputs, _white(points), covered or covered_by_means(channels))


def profile_of(recording: Recording) -> RateProfile | None:
    """Return the table's rate over the rows of `to_points`; None where each data set has one rate, or without times."""
    columns = recording.columns
    if recording.info.motion != "profile" or "t_s" not in columns:
        return None
    valid = np.asarray(columns["valid"]) != 0 if "valid" in columns else np.ones(len(recording), dtype=bool)
    rows = {name: np.asarray(columns[name])[valid] for name in ("t_s", "dataset", "table_rate_dps")}
    return rate_profile(rows, windows=recording.info.kind == "samples")


def _white(points: Recording) -> dict[str, Array] | None:
    """Return the variance of each mean from white noise, or None where the spread of the readings is not known.

    `gyro_*_white_std` is taken where it is there: the white level alone, without lines from the table's steps, which
    average out over a data set and are no noise of the mean. What coarse steps of the output leave in a mean is added.
    """
    white_by_axis: dict[str, Array] = {}
    for axis in points.info.axes:
        variance = white_var_of(points, axis)
        if variance is None or not np.all(np.isfinite(variance)) or not np.any(variance > 0):
            return None
        white_by_axis[axis] = np.maximum(variance, 1e-6 * float(np.median(variance[variance > 0])))
    return white_by_axis
