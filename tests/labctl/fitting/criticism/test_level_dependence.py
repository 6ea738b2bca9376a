"""What a residual follows level by level, and that a law that turns between the rates gets no name of the catalogue."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from labctl.fitting.criticism import criticise
from labctl.fitting.criticism.level_dependence import levels_behind
from labctl.fitting.data.fit_data import FitData, fit_data_of
from labctl.fitting.models.presets import preset_for
from labctl.recording import Recording, to_points
from tests.helpers.simulated_recordings import single_axis

NOISE_DPS = 0.004


RATES_DPS = np.array([0, 10, -10, 25, -25, 50, -50, 80, -80, 120, -120, 160, -160, 200, -200, 250, -250, 300, -300.0])
#: Up and down again, so that most rates and temperatures repeat.
TEMPERATURES_C = np.array([-5.0, 10.0, 25.0, 40.0, 55.0, 40.0, 25.0, 10.0])


def means(wave_dps: float = 0.0) -> Recording:
    """Return means without readings, with a wave in the rate of 107 deg/s from one crest to the next."""
    n = len(RATES_DPS) * len(TEMPERATURES_C)
    rng = np.random.default_rng(3)
    rate_dps = np.tile(RATES_DPS, len(TEMPERATURES_C))
    warm_c = np.repeat(TEMPERATURES_C, len(RATES_DPS)) + 0.05 * rng.normal(size=n)
    true_dps = 0.03 + 0.002 * (warm_c - 25) + (1.003 + 1.5e-5 * (warm_c - 25)) * rate_dps
    columns = {
        "dataset": np.arange(1, n + 1), "t_s": 25.0 * np.arange(n) + 1800.0 * (np.arange(n) // len(RATES_DPS)),
        "gyro_z": true_dps + wave_dps * np.sin(rate_dps / 17.0) + NOISE_DPS * rng.normal(size=n),
        "table_rate_dps": rate_dps, "temperature_c": warm_c,
    }  # fmt: skip
    return replace(to_points(single_axis(1)), columns=columns)


@pytest.fixture(scope="module")
def data() -> FitData:
    return fit_data_of(means())


def test_levels_of_the_rate_are_behind_a_law_of_the_rate(data: FitData) -> None:
    by_rate = {"z": np.sin(data.true_rate_dps("z"))}
    by_temperature = {"z": np.sin(np.round(data.temperature_c))}
    noise = {"z": np.random.default_rng(2).normal(size=len(data))}
    assert levels_behind(data, by_rate) == ("table_rate_dps",)
    assert levels_behind(data, by_temperature) == ("temperature_c",)
    assert levels_behind(data, noise) == ()


@pytest.mark.parametrize("wave_dps", [0.0, 0.031])
def test_an_effect_that_leaves_most_of_what_is_far_above_the_repeats_is_not_named(wave_dps: float) -> None:
    recording = means(wave_dps)
    model, _ = preset_for("bias_scale", []).build(fit_data_of(recording))
    found = criticise(recording, model)
    assert found.floor.source == "repeats"
    assert found.floor.rms_dps == pytest.approx(NOISE_DPS, rel=0.2)
    if wave_dps:
        assert (found.verdict.form, found.verdict.named) == ("unexplained", ())
        assert found.verdict.depends_on[0] == "table_rate_dps"
    else:
        assert found.verdict.form == "adequate"
