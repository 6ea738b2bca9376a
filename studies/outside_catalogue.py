"""Errors that no effect of the catalogue describes, added to a simulated output: other channels, time, foreign laws."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from labctl.recording import Recording

Array = NDArray[np.float64]
Columns = Mapping[str, NDArray[Any]]


@dataclass(frozen=True)
class Kind:
    """One error: its law, of unit size, and the channels that an honest answer names."""

    law: Callable[[Columns, Array, int], Array]  #: of the columns, the own rate over its largest, and a seed
    channels: tuple[str, ...]

    def added(self, recording: Recording, seed: int, size_dps: float) -> Recording:
        """Return the recording with this error in every output, `size_dps` at its largest."""
        columns = dict(recording.columns)
        position = np.asarray(columns["position"]).astype(np.str_)
        for axis in recording.info.axes:
            up = (position == axis).astype(np.float64) - (position == f"-{axis}")
            rate = np.asarray(columns["table_rate_dps"], dtype=np.float64) * up
            values = self.law(columns, rate / max(float(np.abs(rate).max()), 1e-9), seed)
            columns[f"gyro_{axis}"] = columns[f"gyro_{axis}"] + size_dps * values
        return replace(recording, columns=columns)


def _unit(columns: Columns, name: str) -> Array:
    """Return a channel centred and scaled to -1..1."""
    values = np.asarray(columns[name], dtype=np.float64)
    return np.asarray((values - values.mean()) / max(float(np.ptp(values)), 1e-12) * 2)


def _elapsed(columns: Columns) -> Array:
    """Return the time as a share of the campaign, 0 to 1."""
    t_s = np.asarray(columns["t_s"], dtype=np.float64)
    return np.asarray((t_s - t_s[0]) / (t_s[-1] - t_s[0]))


def _hours(columns: Columns, period_h: float) -> Array:
    return np.asarray(np.sin(2 * np.pi * np.asarray(columns["t_s"], dtype=np.float64) / 3600 / period_h))


def _step(columns: Columns) -> Array:
    return (_elapsed(columns) > 0.6).astype(np.float64)


def _spline(columns: Columns, rate: Array, seed: int) -> Array:
    """Return a random cubic spline of temperature through seven knots, of unit size."""
    del rate
    warm = np.asarray(columns["temperature_c"], dtype=np.float64)
    knots = np.random.default_rng([seed, 71]).normal(size=7)
    values = CubicSpline(np.linspace(warm.min(), warm.max(), 7), knots)(warm)
    return np.asarray(values / np.abs(values).max())


def _field(columns: Columns, rate: Array, seed: int) -> Array:
    """Return a random smooth field over rate and temperature, of unit size."""
    warm = _unit(columns, "temperature_c")
    rng = np.random.default_rng([seed, 72])
    waves = rng.normal(size=(40, 2)) * 2.0
    phases, sizes = rng.uniform(0, 2 * np.pi, 40), rng.normal(size=40)
    values = np.zeros(len(rate))
    for (a, b), phase, size in zip(waves, phases, sizes, strict=True):
        values += size * np.cos(a * rate + b * warm + phase)
    return np.asarray(values / np.abs(values).max())


def _etalon(columns: Columns, rate: Array, seed: int) -> Array:
    del rate, seed
    return np.asarray(np.sin(2 * np.pi * np.asarray(columns["temperature_c"]) / 13 + 0.4))


def _bump(columns: Columns, rate: Array, seed: int) -> Array:
    del seed
    warm = np.asarray(columns["temperature_c"], dtype=np.float64)
    return np.asarray(np.exp(-(((warm - warm.mean()) / 5) ** 2)) * rate)


def _of(shape: Callable[[Columns], Array], *, scaled: bool = False) -> Callable[[Columns, Array, int], Array]:
    """Return a law of the columns alone, as bias or, times the rate, as scale factor."""

    def law(columns: Columns, rate: Array, seed: int) -> Array:
        del seed
        return shape(columns) * rate if scaled else shape(columns)

    return law


def _scaled_spline(columns: Columns, rate: Array, seed: int) -> Array:
    return _spline(columns, rate, seed) * rate


KINDS: dict[str, Kind] = {
    "humidity_bias": Kind(_of(lambda c: np.asarray(np.tanh(2 * _unit(c, "humidity_pct")))), ("humidity_pct",)),
    "humidity_scale": Kind(_of(lambda c: _unit(c, "humidity_pct"), scaled=True), ("humidity_pct",)),
    "supply_cubic": Kind(_of(lambda c: _unit(c, "supply_v") ** 3), ("supply_v",)),
    "supply_scale": Kind(_of(lambda c: _unit(c, "supply_v"), scaled=True), ("supply_v",)),
    "chamber_scale": Kind(_of(lambda c: _unit(c, "chamber_c"), scaled=True), ("chamber_c",)),
    "time_step_bias": Kind(_of(_step), ("t_s",)),
    "time_step_scale": Kind(_of(_step, scaled=True), ("t_s",)),
    "daily_wave": Kind(_of(lambda c: _hours(c, 24.0)), ("t_s",)),
    "two_hour_wave": Kind(_of(lambda c: _hours(c, 2.0)), ("t_s",)),
    "etalon": Kind(_etalon, ("temperature_c",)),
    "bump_scale": Kind(_bump, ("temperature_c",)),
    "power_scale": Kind(_of(lambda c: np.asarray(np.exp(-c["power_s"] / 7200)), scaled=True), ("power_s", "t_s")),
    "spline_bias": Kind(_spline, ("temperature_c",)),
    "spline_scale": Kind(_scaled_spline, ("temperature_c",)),
    "field": Kind(_field, ("table_rate_dps", "temperature_c")),
}
