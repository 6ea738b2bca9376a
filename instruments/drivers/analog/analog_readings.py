"""Scans of analog inputs as readings of a gyro: means over groups of scans, their times, and what is missing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from instruments.interfaces.gyro import Channel, GyroIdentity, GyroLimits, Readings
from instruments.protocols.analog_settings import AnalogSettings
from instruments.transport.sample_timing import StreamTime, refuse_other_rate
from instruments.transport.scan_means import Counts, ScanMeans


def analog_channels(settings: AnalogSettings, scaling: list[tuple[float, float]]) -> tuple[Channel, ...]:
    """Return the channels: each rate output in V, and the temperature in deg C where there is a thermometer.

    `scaling` holds (V per code, code at 0 V) of each input. A raw value is the sum of `average` codes.
    """
    options = settings.options
    channels = [
        Channel(f"gyro_{axis}", "V", v_per_code / options.average, -centre * v_per_code)
        for axis, (v_per_code, centre) in zip(settings.axes, scaling, strict=False)
    ]
    if options.thermometer_input is not None:
        v_per_code, centre = scaling[-1]
        per_v = options.thermometer_c_per_v
        zero_c = options.thermometer_zero_c - centre * v_per_code * per_v
        channels.append(Channel("temperature_c", "deg C", per_v * v_per_code / options.average, zero_c))
    return tuple(channels)


def analog_identity(settings: AnalogSettings, model: str, reported: dict[str, str]) -> GyroIdentity:
    """Return the identity of the unit, which reports no identification, and what its inputs say."""
    options = settings.options
    output: dict[str, dict[str, float | str]] = {
        axis: {"unit": "V", "offset": options.rest_v, "scale": options.v_per_dps} for axis in settings.axes
    }
    return GyroIdentity(
        settings.serial, settings.model or model, settings.technology or "piezo", settings.datasheet, output, reported
    )


def limits_of(settings: AnalogSettings) -> GyroLimits:
    """Return what the unit may be exposed to, by its bench file."""
    return GyroLimits(settings.max_rate_dps, settings.min_c, settings.max_c)


@dataclass(frozen=True)
class Scans:
    """n scans that were received together."""

    numbers: Counts  #: (n,) rising
    codes: Counts  #: (n, inputs)
    good: NDArray[np.bool_]  #: (n,) whether no input is at the end of its range
    arrival_s: NDArray[np.float64]  #: (n,) clock time at which each was there


class AnalogReadings:
    """Turns numbered scans into readings. `channels` are set once the scaling of the inputs is known."""

    def __init__(self, settings: AnalogSettings, address: str) -> None:
        self.name, self._address = settings.name, address
        self._options = settings.options
        self._scans_per_s = settings.scans_per_s
        self._period_s = settings.options.average / settings.scans_per_s
        self._names = [
            channel.name for channel in analog_channels(settings, [(1.0, 0.0)] * len(self._options.all_inputs))
        ]
        self._means = ScanMeans(self._options.average, len(self._options.all_inputs))
        self._newest: int | None = None
        self._time = StreamTime(self._period_s, 0.0)

    def start(self, now_s: float) -> None:
        """Begin anew: nothing is known of the device's clock."""
        self._means.drop()
        self._newest = None
        self._time = StreamTime(self._period_s, now_s)

    def drop(self) -> None:
        """Expect any number of missing scans before the next ones."""
        self._means.drop()
        self._newest = None
        self._time.drop()

    def add(self, scans: Scans, came_s: tuple[float, float | None, float | None], damaged: int = 0) -> Readings:
        """Return the readings that scans complete, with the count of those that are missing.

        `came_s` is a clock time at which the newest scan was there and, where it is known better, the end and the width
        of the interval in which it arrived, s. Raises WrongInstrument for another rate.
        """
        numbers = scans.numbers
        groups, sums, valid = self._means.add(numbers, scans.codes, scans.good)
        if not len(groups):
            none = np.zeros(0, dtype=np.int64)
            no_time, no_flag = np.zeros(0), np.zeros(0, dtype=bool)
            return Readings(no_time, dict.fromkeys(self._names, none), no_flag, 0, damaged, no_time, no_time)
        advance = np.diff(groups, prepend=groups[0] - 1 if self._newest is None else self._newest)
        self._newest = int(groups[-1])
        last = (groups + 1) * self._options.average - 1  # number of the last scan of each reading
        ahead_s = int(numbers[-1] - last[-1]) / self._scans_per_s
        now_s, newest_s, width_s = came_s
        now_s = now_s if newest_s is None else newest_s  # scans come in packets: the newest is older than now
        times, uncounted = self._time.times(
            advance, now_s - ahead_s, newest_s=None if newest_s is None else newest_s - ahead_s, width_s=width_s
        )
        refuse_other_rate(self.name, self._address, self._time.line)
        raw = {name: sums[:, n] for n, name in enumerate(self._names)}
        lost = int(advance.sum() - len(advance)) + uncounted
        arrival_s = scans.arrival_s[np.searchsorted(numbers, last)]
        return Readings(times, raw, valid, lost, damaged, last / self._scans_per_s, arrival_s)
