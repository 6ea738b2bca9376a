"""Noise floor of a recording: that of the simulated units, whatever is hidden in them and however many data sets."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from labctl.fitting import fit
from labctl.fitting.data.fit_data import FitData, fit_data_of
from labctl.fitting.data.rich_surface import rich_surface
from tests.helpers.simulated_recordings import single_axis

#: Standard deviation of what a simulated unit's bias wanders by, deg/s: half of the data sheet's stability.
DRIFT_DPS = 0.001
#: Bias stability of the data sheet, 1 sigma; the simulated unit is better than its sheet.
SHEET_DPS = 0.002


def true_floor_dps(data: FitData) -> float:
    """Return the noise of a mean from the readings' own spread and the drift that was simulated."""
    assert data.white_var is not None
    return float(np.sqrt(data.white_var["z"].mean() + DRIFT_DPS**2))


def test_it_is_the_noise_that_was_simulated() -> None:
    ratios = []
    for seed in range(1, 9):
        data = fit_data_of(single_axis(seed))
        floor = data.noise_floor
        assert floor.source == "within and between data sets"
        ratios.append((floor.rms_dps or 0.0) / true_floor_dps(data))
    assert 0.8 < np.mean(ratios) < 1.1  # on one rising leg of temperatures a long drift is partly a temperature
    assert max(ratios) < 1.7
    assert min(ratios) > 0.5  # of 15 h of drift a few hours of one unit may show little


@pytest.mark.parametrize(
    "hidden",
    [
        {"scale_factor_odd": 1e-6},
        {"dead_band": 0.02},
        {"missed_steps": 1e-3},
        {"saturation": -0.01},
        {"supply_sensitivity": 0.01},
    ],
    ids=lambda hidden: next(iter(hidden)),
)
def test_it_does_not_depend_on_what_the_model_misses(hidden: dict[str, float]) -> None:
    bare, spoiled = single_axis(3), single_axis(3, **hidden)
    before, after = fit(bare, "bias_scale").error, fit(spoiled, "bias_scale").error
    assert before.noise_floor_dps is not None
    assert after.noise_floor_dps == pytest.approx(before.noise_floor_dps, rel=0.1)


def test_it_does_not_depend_on_the_model() -> None:
    recording = single_axis(2, scale_factor_odd=1e-6)
    floors = {fit(recording, model).error.noise_floor_dps for model in ("bias_scale", "ojeda2000", "weiss1995")}
    assert len(floors) == 1


@pytest.mark.parametrize("number", [7, 15])
def test_few_data_sets_have_the_drift_of_the_data_sheet(number: int) -> None:
    """Beside 15 data sets a surface has 7 columns: the laws of a gyro that it cannot have once passed for drift."""
    data = fit_data_of(single_axis(1))
    few = data.take(np.arange(len(data)) < number)
    floor = few.noise_floor
    assert floor.source == "within data sets, and by the data sheet"
    white_var = float(few.white_dps("z") or 0.0) ** 2
    assert floor.rms_dps == pytest.approx(np.sqrt(white_var + SHEET_DPS**2), rel=1e-6)  # in full: it says 1 sigma
    assert floor.axes["z"].correlation_times == {"drift_tau_s": None}  # a data sheet states no time constant
    assert data.noise_floor.axes["z"].correlation_times["drift_tau_s"] is not None


def test_without_readings_repeats_tell_else_the_scatter_else_nothing() -> None:
    data = replace(fit_data_of(single_axis(1)), white_var=None)
    scatter = data.noise_floor
    assert scatter.source == "scatter about a smooth surface"
    assert scatter.rms_dps is not None
    assert 0.35 * DRIFT_DPS < scatter.rms_dps < 1.2 * DRIFT_DPS  # of the drift only what changes from set to set
    twice = np.repeat(np.arange(len(data)), 2)
    doubled = replace(
        data,
        channels=data.channels.take(twice),
        outputs={"z": data.outputs["z"][twice] + np.tile([0.01, -0.01], len(data))},
    )
    repeats = doubled.noise_floor
    assert repeats.source == "repeats"
    assert repeats.rms_dps == pytest.approx(0.01 * np.sqrt(2), rel=0.05)
    few = data.take(np.arange(len(data)) < 7).noise_floor
    assert (few.source, few.rms_dps) == ("none", None)


def test_the_surface_is_orthonormal_and_leaves_at_least_half() -> None:
    data = fit_data_of(single_axis(1))
    surface = rich_surface(data.channels, "z")
    assert surface.shape[0] == len(data)
    assert surface.shape[1] <= len(data) // 2
    assert surface.T @ surface == pytest.approx(np.eye(surface.shape[1]), abs=1e-9)
