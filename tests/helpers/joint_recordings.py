"""Recordings of one unit, days apart, by plain formulas with a known truth."""

from __future__ import annotations

from datetime import timedelta

import numpy as np

from labctl.recording import Recording, RecordingInfo
from tests.helpers.recordings import STARTED, ou_drift

TEMPERATURES_C = (-20.0, 0.0, 25.0, 45.0, 60.0)
RATES_DPS = (-200.0, -100.0, -50.0, -10.0, 0.0, 10.0, 50.0, 100.0, 200.0)
#: Temperature terms are centred here, deg C: the middle of the temperatures.
CENTRE_C = 20.0
TRUTH = {"bias": 0.05, "bias_t1": 1e-4, "bias_t2": 2e-6, "scale_factor": 2e-3, "scale_factor_t1": 1e-5}
EFFECTS = ["bias", "bias_temperature:2", "scale_factor", "scale_factor_temperature:1"]
WHITE_DPS, DRIFT_DPS, READINGS = 2e-4, 3e-4, 3000


def recording_of_day(
    rng: np.random.Generator,
    day: float = 0.0,
    *,
    bias_shift_dps: float = 0.0,
    scale_shift: float = 0.0,
    quadratic: float = 0.0,
    bias_t1: float = TRUTH["bias_t1"],
) -> Recording:
    """Return 45 data-set means of one powered run about z, with these shifts and an error quadratic in the rate."""
    warm = np.repeat(TEMPERATURES_C, len(RATES_DPS)) + rng.normal(0, 0.05, len(TEMPERATURES_C) * len(RATES_DPS))
    rate = np.tile(RATES_DPS, len(TEMPERATURES_C))
    n = len(rate)
    t_s = 75.0 * np.arange(n) + np.repeat(np.arange(len(TEMPERATURES_C)), len(RATES_DPS)) * 3600.0
    above = warm - CENTRE_C
    error = TRUTH["bias"] + bias_t1 * above + TRUTH["bias_t2"] * above**2 + bias_shift_dps
    error += rate * (TRUTH["scale_factor"] + TRUTH["scale_factor_t1"] * above + scale_shift) + quadratic * rate**2
    noise = ou_drift(t_s, DRIFT_DPS, (1500.0,), rng) + rng.normal(0, WHITE_DPS, n)
    columns = {
        "dataset": np.arange(1, n + 1), "t_s": t_s, "table_rate_dps": rate, "temperature_c": warm,
        "gyro_z": rate + error + noise, "gyro_z_std": np.full(n, WHITE_DPS * np.sqrt(READINGS)),
        "n": np.full(n, READINGS), "duration_s": np.full(n, 60.0),
    }  # fmt: skip
    info = RecordingInfo(
        serial="J-1", axes=("z",), kind="points", started_at=STARTED + timedelta(days=day), technology="mems",
        datasheet={"bias_stability_dps": 2 * DRIFT_DPS},
    )  # fmt: skip
    return Recording(info, columns)


def recordings(
    seed: int, days: tuple[float, ...] = (0.0, 10.0), turn_on_dps: float = 0.01, per_day: float = 1e-4, **common: float
) -> dict[int, Recording]:
    """Return number -> recording, one per day, whose bias and scale factor are shifted by chance."""
    rng = np.random.default_rng([17, seed])
    return {
        number: recording_of_day(
            rng, day, bias_shift_dps=rng.normal(0, turn_on_dps), scale_shift=rng.normal(0, per_day), **common
        )
        for number, day in enumerate(days, start=1)
    }
