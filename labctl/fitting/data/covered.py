"""Range that a recording covers, from its readings: temperatures, and rates along each body axis."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.data.channels import Channels, body_rates
from labctl.fitting.numeric.arrays import Array
from labctl.recording import Recording
from labctl.recording.motions.turn_means import rates_as_turned
from labctl.recording.points import dataset_starts
from labctl.recording.recording import temperature_of

Range = tuple[float, float]
#: A range of temperatures, deg C; None where no thermometer says how warm the unit was.
MaybeRange = tuple[float | None, float | None]


@dataclass(frozen=True)
class Covered:
    """Lowest and highest temperature, deg C, and true rate along each body axis, deg/s, over all readings."""

    temperature_c: MaybeRange
    rate_dps: Mapping[str, Range]


def covered_by(
    table_rates_dps: tuple[Array, Array],
    position: NDArray[np.generic],
    temperature_c: MaybeRange,
    up_rate_dps: float = 0.0,
) -> Covered:
    """Return what data sets with lowest and highest table rates, (m,) each, in positions (m,) cover.

    `up_rate_dps` is the Earth's rate along the table axis, deg/s.
    """
    ends = [body_rates(rates + up_rate_dps, position) for rates in table_rates_dps]
    return Covered(
        temperature_c,
        {a: (min(float(r[a].min()) for r in ends), max(float(r[a].max()) for r in ends)) for a in ends[0]},
    )


def covered_by_readings(recording: Recording, up_rate_dps: float = 0.0) -> Covered | None:
    """Return what the valid readings of a recording cover; None without a reading."""
    columns = recording.columns
    valid = np.asarray(columns["valid"]) != 0 if "valid" in columns else np.ones(len(recording), dtype=bool)
    temperature_c = temperature_of(columns)
    if not valid.any():
        return None
    by_hand = recording.info.motion == "turns"
    rate = (rates_as_turned(recording) if by_hand else np.asarray(columns["table_rate_dps"], dtype=np.float64))[valid]
    starts = dataset_starts(np.asarray(columns["dataset"], dtype=np.int64)[valid])
    axis = recording.info.axes[0]
    position = np.asarray(columns["position"])[valid][starts] if "position" in columns else np.full(len(starts), axis)
    ends = np.minimum.reduceat(rate, starts), np.maximum.reduceat(rate, starts)
    span = (
        (None, None)
        if temperature_c is None
        else (float(temperature_c[valid].min()), float(temperature_c[valid].max()))
    )
    return covered_by(ends, position, span, up_rate_dps)


def covered_by_means(channels: Channels) -> Covered:
    """Return what data-set means cover, where their readings are not known."""
    temperature_c = np.asarray(channels["temperature_c"], dtype=np.float64)
    rates = {axis: (float(rate.min()), float(rate.max())) for axis, rate in channels.rates.items()}
    thermometer = channels.history.thermometer
    return Covered((float(temperature_c.min()), float(temperature_c.max())) if thermometer else (None, None), rates)
