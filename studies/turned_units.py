"""Simulated gyros on a rate table that turns while the temperature goes up and down: the scale factor may lag behind.

Made by numpy alone: the element is integrated second by second by Heun's rule, bias and scale factor are laws of its
temperature, and labctl has no part in it.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime

import numpy as np

from labctl.recording import Recording, RecordingInfo
from studies.rest_units import DRIFT_DPS, DRIFT_TAU_S, WHITE, Array

COLD_C, HOT_C, DWELL_S = -10.0, 55.0, 1200.0
#: Seconds of a data set and between two, and the rates that are drawn from, deg/s.
SET_S, GAP_S = 60, 15
RATES_DPS = np.array([0.0, 10.0, -10.0, 50.0, -50.0, 100.0, -100.0, 150.0, -150.0, 200.0, -200.0])


@dataclass(frozen=True)
class Turned:
    """What is hidden: time constants of scale factor and bias, s (0: none), slopes of the laws, 1/K and deg/s/K."""

    scale_lag_s: float = 0.0
    bias_lag_s: float = 0.0
    scale_1_k: float = 2e-4
    bias_dps_k: float = 2e-3
    speed_k_min: float = 1.0
    loops: int = 2
    axes: tuple[str, ...] = ("z",)
    of_axes: tuple[float, ...] = (1.0, 1.0, 1.0)  #: factors of the time constants on each axis


def course(hidden: Turned) -> Array:
    """Return the thermometer second by second, deg C: loops with dwells, the corners rounded over two minutes."""
    leg_s = (HOT_C - COLD_C) / hidden.speed_k_min * 60.0
    t_s, warm = [0.0, DWELL_S], [COLD_C, COLD_C]
    for _ in range(hidden.loops):
        for target in (HOT_C, COLD_C):
            t_s += [t_s[-1] + leg_s, t_s[-1] + leg_s + DWELL_S]
            warm += [target, target]
    kernel = np.hanning(121) / np.hanning(121).sum()
    sharp = np.interp(np.arange(0.0, t_s[-1]), t_s, warm)
    return np.convolve(np.pad(sharp, 60, mode="edge"), kernel, mode="valid")


def followed(warm: Array, tau_s: float) -> Array:
    """Return the temperature of an element that follows `warm`, given second by second, by Heun's rule.

    The slope at the start of each second is that towards the temperature then: taken towards the one at its end, the
    element would be half a second ahead, which a rate table shows.
    """
    now, found = float(warm[0]), np.empty(len(warm))
    found[0] = now
    values = warm.tolist()
    for k in range(1, len(values)):
        slope = (values[k - 1] - now) / tau_s
        now += (slope + (values[k] - (now + slope)) / tau_s) / 2
        found[k] = now
    return found


def turned_unit(seed: int, hidden: Turned) -> Recording:
    """Return readings of a unit, one a second, of data sets at constant rates; each axis is up for a powered run."""
    rng = np.random.default_rng([seed, 31])
    warm = course(hidden)
    parts = [_run(rng, hidden, warm, number) for number in range(len(hidden.axes))]
    columns = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    info = RecordingInfo(
        serial=f"TURN-{seed}", technology="mems", kind="samples", motion="rates", sample_rate_hz=1.0,
        axes=hidden.axes, started_at=datetime(2026, 1, 5, tzinfo=UTC),
    )  # fmt: skip
    return Recording(info, columns, _environment(warm, len(parts)))


def _environment(warm: Array, runs: int) -> dict[str, Array]:
    """Return the thermometer every ten seconds, between the data sets too, of all runs."""
    seconds = np.arange(0.0, len(warm), 10.0)
    return {
        "t_s": np.concatenate([seconds + _begin_s(warm, number) for number in range(runs)]),
        "temperature_c": np.tile(warm[::10], runs),
        "run": np.repeat(np.arange(1, runs + 1), len(seconds)),
    }


def _begin_s(warm: Array, number: int) -> float:
    """Return when a run begins, s: ten hours after the last, when the unit is back at the first temperature."""
    return number * (len(warm) + 36_000.0)


def _run(rng: np.random.Generator, hidden: Turned, warm: Array, number: int) -> dict[str, Array]:
    """Return the columns of a run with one axis up."""
    sets = (len(warm) - GAP_S) // (SET_S + GAP_S)
    begins = GAP_S + (SET_S + GAP_S) * np.arange(sets)
    rates = np.concatenate([rng.permutation(RATES_DPS) for _ in range(sets // len(RATES_DPS) + 1)])[:sets]
    rows = (begins[:, None] + np.arange(SET_S)).ravel()
    rate = np.repeat(rates, SET_S)
    thermometer = warm[rows] + rng.normal(0.0, 0.01, len(rows))
    t_s = rows + _begin_s(warm, number)
    found = {
        "dataset": np.repeat(np.arange(1, sets + 1) + number * sets, SET_S), "run": np.full(len(rows), number + 1),
        "t_s": t_s, "table_rate_dps": rate, "temperature_c": thermometer,
        "position": np.full(len(rows), hidden.axes[number]),
    }  # fmt: skip
    for k, axis in enumerate(hidden.axes):
        of_scale, of_bias = (
            followed(warm, tau_s * hidden.of_axes[k])[rows] if tau_s else warm[rows]
            for tau_s in (hidden.scale_lag_s, hidden.bias_lag_s)
        )
        turning = rate if k == number else np.zeros(len(rows))
        scale = 1.001 + hidden.scale_1_k * (of_scale - 25.0) + 2e-7 * (warm[rows] - 25.0) ** 2
        bias = 0.2 + hidden.bias_dps_k * (of_bias - 25.0) - 1e-5 * (warm[rows] - 25.0) ** 2
        noise = rng.normal(0.0, WHITE, len(rows)) + np.repeat(_drift(rng, sets), SET_S)
        found[f"gyro_{axis}"] = scale * turning + bias + noise
    return found


def _drift(rng: np.random.Generator, sets: int) -> Array:
    """Return a first-order process data set by data set, (sets,) deg/s."""
    keep = float(np.exp(-(SET_S + GAP_S) / DRIFT_TAU_S))
    found = np.empty(sets)
    found[0] = rng.normal()
    for k, step in enumerate(rng.normal(0.0, np.sqrt(1 - keep**2), sets - 1).tolist()):
        found[k + 1] = keep * found[k] + step
    return DRIFT_DPS * found
