"""Channels: the logged columns that a regressor can depend on, for means of data sets and single readings alike."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.data.response import Response
from labctl.fitting.data.temperature.channel import with_stand_in
from labctl.fitting.data.temperature.history import TemperatureHistory, history_of
from labctl.fitting.numeric.arrays import Array
from labctl.recording import Recording
from labctl.recording.columns import RECORDING, WITHIN_S
from labctl.recording.positions import comparable, lever_in, radius_in, up_in

if TYPE_CHECKING:
    from labctl.fitting.data.rate_profile import RateProfile

BODY_AXES = ("x", "y", "z")
#: What a law sees: the true rate (forward), or the output in its place (direct).
Argument = Literal["rate", "output"]
#: A wave, "cos" or "sin", and how often it comes per turn of the table.
Carrier = tuple[str, int]
#: Duration of a data set, s, where the recording does not give it.
USUAL_DURATION_S = 60.0


@dataclass(frozen=True)
class Channels:
    """Logged channels under the recording's column names, (n,) each, and the rate along each body axis.

    `rates` is the argument of a rate regressor: the true rate for a forward law, the gyro's output for a direct one.
    """

    columns: Mapping[str, NDArray[np.generic]]
    rates: Mapping[str, Array]  #: body axis -> (n,) deg/s
    history: TemperatureHistory = field(default_factory=TemperatureHistory)  #: of the whole recording
    harmonics: Mapping[Carrier, Array] = field(default_factory=dict)  #: means over each row of waves in the table angle
    profile: RateProfile | None = None  #: the table's rate reading by reading, where it changes within a data set
    response: Response = field(default_factory=Response)  #: what the rates have come through

    def __len__(self) -> int:
        return len(next(iter(self.rates.values())))

    def __contains__(self, name: str) -> bool:
        return name in self.columns

    def __getitem__(self, name: str) -> NDArray[np.generic]:
        return self.columns[name]

    def rate_dps(self, axis: str) -> Array:
        """Return the rate along a body axis, (n,) deg/s; zero along an axis without a rate."""
        return self.rates[axis] if axis in self.rates else np.zeros(len(self))

    def temperature_c(self, axis: str) -> Array:
        """Return the thermometer of an axis, (n,) deg C, or the unit's own where there is one for all."""
        name = f"temperature_{axis}_c"
        return np.asarray(self.columns[name if name in self.columns else "temperature_c"], dtype=np.float64)

    def with_rates(self, rates: Mapping[str, Array]) -> Channels:
        """Return the same channels with other rates along the body axes."""
        return replace(self, rates=rates)

    def take(self, rows: NDArray[np.bool_] | NDArray[np.int64]) -> Channels:
        """Return the channels of some rows, by index or mask."""
        return Channels(
            {name: values[rows] for name, values in self.columns.items()},
            {axis: values[rows] for axis, values in self.rates.items()},
            self.history,
            {carrier: values[rows] for carrier, values in self.harmonics.items()},
            None if self.profile is None else self.profile.take(rows),
            self.response,
        )

    def through(self, response: Response) -> Channels:
        """Return the same channels with the table's rate as it comes through a response; the Earth's has no change."""
        if self.profile is None or response == self.response:
            return self
        change = self.profile.seen_dps(response) - self.profile.seen_dps(self.response)
        moved = body_rates(change, np.asarray(self.columns["position"]))
        return replace(self, rates={a: v + moved[a] for a, v in self.rates.items()}, response=response)

    def table_rate_dps(self) -> Array:
        """Return the table's rate, (n,) deg/s."""
        return np.asarray(self.columns["table_rate_dps"], dtype=np.float64)

    def up(self, axis: str) -> Array:
        """Return how much of a body axis points up along the table axis, (n,): 1, -1, 0, or tilted between them."""
        return up_in(np.asarray(self.columns["position"]), axis)

    def radius_m(self) -> Array:
        """Return the unit's distance from the table's axis, (n,) m; NaN where it is not known."""
        return radius_in(np.asarray(self.columns["position"]))

    def lever_m(self, axis: str) -> Array:
        """Return the part along a body axis of the way from the table's axis to the unit, (n,) m; NaN: not known."""
        return lever_in(np.asarray(self.columns["position"]), axis)

    def positions(self) -> list[tuple[str, NDArray[np.bool_]]]:
        """Return every position that occurs and which rows are in it, (n,)."""
        position = np.asarray(self.columns["position"]).astype(np.str_)
        return [(str(up_position), position == up_position) for up_position in np.unique(position)]

    def by_recording(self, rows: NDArray[np.bool_]) -> list[NDArray[np.bool_]]:
        """Return rows (n,) recording by recording, those of each; as they are for a single recording."""
        if RECORDING not in self.columns:
            return [rows]
        of = np.asarray(self.columns[RECORDING])
        return [rows & (of == number) for number in np.unique(of) if np.any(rows & (of == number))]

    def recording_t_s(self) -> Array:
        """Return the time since the start of the row's recording, (n,) s."""
        return np.asarray(self.columns[WITHIN_S if WITHIN_S in self.columns else "t_s"], dtype=np.float64)

    def harmonic(self, carrier: Carrier) -> Array:
        """Return the mean of a wave in the table angle over each row, (n,)."""
        if carrier in self.harmonics:
            return self.harmonics[carrier]
        wave, n = carrier
        begin = np.deg2rad(np.asarray(self.columns["table_angle_deg"], dtype=np.float64))
        turn_rad = np.deg2rad(self.table_rate_dps() * self.durations_s())
        at = n * (begin + turn_rad / 2)
        return np.asarray((np.cos(at) if wave == "cos" else np.sin(at)) * np.sinc(n * turn_rad / 2 / np.pi))

    def durations_s(self) -> Array:
        """Return how long each row lasted, (n,) s."""
        if "duration_s" in self.columns:
            return np.asarray(self.columns["duration_s"], dtype=np.float64)
        return np.full(len(self), USUAL_DURATION_S)

    def decayed(self, tau_s: float) -> Array:
        """Return the mean over each row of exp(-time since the start of its data set / tau), (n,)."""
        begin = np.zeros(len(self))
        if "since_begin_s" in self.columns:
            begin = np.asarray(self.columns["since_begin_s"], dtype=np.float64)
        length = np.maximum(self.durations_s(), 1e-9)
        return np.asarray(np.exp(-begin / tau_s) * -np.expm1(-length / tau_s) * tau_s / length)

    def missing(self, names: Iterable[str]) -> list[str]:
        """Return which of the names are not logged."""
        available = {*self.columns, "table_rate_dps", "temperature_c"}
        if not self.history.thermometer:
            available.remove("temperature_c")
        return [name for name in names if name not in available]


def body_rates(table_rate_dps: Array, position: NDArray[np.generic]) -> dict[str, Array]:
    """Return the table's rate along each body axis, axis -> (n,), for positions like "x" or "-z", (n,)."""
    ups = {axis: up_in(position, axis) for axis in BODY_AXES}
    return {axis: np.where(up != 0, up * table_rate_dps, 0.0) for axis, up in ups.items()}


def channels_of(points: Recording, up_rate_dps: float = 0.0, profile: RateProfile | None = None) -> Channels:
    """Return the channels of a recording, with the true rate along each body axis.

    `up_rate_dps` is added to the table's rate, deg/s: the Earth's rate along the table axis, upwards. `profile` is the
    table's rate over the same rows, where it changes; then there is no rate before a data set.
    """
    columns = with_stand_in(points.columns, len(points))
    columns.setdefault("position", np.full(len(points), points.info.axes[0]))
    columns["position"] = comparable(np.asarray(columns["position"]), np.asarray(columns["table_rate_dps"]) != 0)
    true = np.asarray(columns["table_rate_dps"], dtype=np.float64) + up_rate_dps
    if "previous_rate_dps" not in columns and points.info.kind == "points":
        before = np.concatenate([[0.0], np.asarray(columns["table_rate_dps"])[:-1]])
        columns["previous_rate_dps"] = before if profile is None else np.zeros(len(points))
    return Channels(columns, body_rates(true, np.asarray(columns["position"])), history_of(points), profile=profile)
