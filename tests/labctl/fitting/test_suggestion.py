"""The model that is proposed after an import: the fullest published one that the recording determines."""

from __future__ import annotations

from datetime import UTC, datetime

import numpy as np
import pytest

from labctl.fitting import fit
from labctl.fitting.estimation.suggestion import suggested_model
from labctl.recording import Recording, RecordingInfo

RATES = (0.0, 10.0, 20.0, 50.0, 100.0, -10.0, -20.0, -50.0, -100.0, 0.0)


def means(temperature_c: np.ndarray, rate_dps: np.ndarray, motion: str = "rates") -> Recording:
    """Return one row per data set of a gyro about z with a bias of 0.3 deg/s and a scale factor error of 1 %."""
    n = len(rate_dps)
    noise = np.random.default_rng(1).normal(0, 0.002, n)
    info = RecordingInfo.model_validate({
        "serial": "Z-1", "axes": ("z",), "kind": "points", "motion": motion,
        "started_at": datetime(2026, 1, 5, tzinfo=UTC),
    })  # fmt: skip
    return Recording(info, {
        "dataset": np.arange(1, n + 1), "table_rate_dps": rate_dps, "position": np.full(n, "z"),
        "temperature_c": temperature_c, "gyro_z": 0.3 + 1.01 * rate_dps + noise,
    })  # fmt: skip


def at(*temperatures_c: float, rates: tuple[float, ...] = RATES) -> Recording:
    return means(np.repeat(temperatures_c, len(rates)), np.tile(rates, len(temperatures_c)))


@pytest.mark.parametrize(
    ("recording", "expected"),
    [
        (at(25.0), "single_temperature"),
        (at(10.0, 25.0), "single_temperature"),
        (means(24.0 + np.linspace(0.0, 1.4, 20), np.tile(RATES, 2)), "single_temperature"),
        (means(24.0 + np.linspace(0.0, 1.9, 20), np.tile(RATES, 2)), "single_temperature"),
        (means(24.0 + np.linspace(0.0, 12.0, 40), np.tile(RATES, 4)), "ojeda2000"),
        (at(0.0, 20.0, 40.0), "ojeda2000"),
        (at(25.0, rates=(50.0,)), "bias"),
        (at(25.0, rates=(0.0, 0.0, 0.0)), "bias"),
    ],
    ids=[
        "one temperature",
        "two temperatures",
        "room",
        "room, three degrees",
        "no levels",
        "three temperatures",
        "one data set",
        "at rest",
    ],
)
def test_the_fullest_model_that_the_recording_determines_is_proposed(recording: Recording, expected: str) -> None:
    assert suggested_model(recording) == expected
    fitted = fit(recording, expected)
    if expected == "single_temperature":
        z = fitted.fitted.axes["z"]
        place = z.names.index("scale_factor")
        assert z.values[place, 0] == pytest.approx(0.01, abs=5 * z.u[place, 0])
        assert z.names == ("bias", "scale_factor")  # one axis does not tell a misalignment
