"""Criticism of recordings whose rate changes: delay and bandwidth are named, and nothing else is for want of them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from labctl.fitting import fit_data_of
from labctl.fitting.criticism import criticise
from labctl.fitting.criticism.criticism import Criticism
from labctl.fitting.criticism.reduction import reduce_recording
from labctl.fitting.models.presets import preset_for
from labctl.recording import Recording
from tests.helpers.profiles import profile_recording, ramp, sweep

PLAIN = ["bias", "scale_factor"]
SWEEP = sweep(60.0, 0.1, 10.0, 50.0, 100.0)


def criticised(recording: Recording, effects: list[str], *, full: bool = False) -> Criticism:
    """Compare effects with a recording."""
    model, _ = preset_for(None, effects).build(fit_data_of(recording))
    return criticise(recording, model, full=full)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("hidden", "named", "parameters"),
    [
        ({}, set(), {}),
        ({"delay_s": 0.005}, {"time_delay"}, {"delay_s": 0.005}),
        ({"bandwidth_hz": 40.0}, {"bandwidth"}, {"time_constant_s": 1 / (80 * np.pi)}),
        (
            {"delay_s": 0.005, "bandwidth_hz": 40.0},
            {"time_delay", "bandwidth"},
            {"delay_s": 0.005, "time_constant_s": 1 / (80 * np.pi)},
        ),
    ],
)
def test_what_is_hidden_in_a_sweep_is_named_with_its_size(
    hidden: dict[str, Any], named: set[str], parameters: dict[str, float]
) -> None:
    verdict = criticised(profile_recording(SWEEP, scale=0.024, bias_dps=0.05, **hidden), PLAIN).verdict
    assert verdict.form == ("missing" if named else "adequate")
    assert set(verdict.named) == named
    found = {name: value for term in verdict.terms.values() for name, value in term.parameters.items()}
    assert found == pytest.approx(parameters, rel=2e-3)


@pytest.mark.slow
def test_a_model_that_has_them_is_adequate_and_its_floor_is_that_of_a_piece() -> None:
    recording = profile_recording(SWEEP, delay_s=0.005, bandwidth_hz=40.0, scale=0.024)
    found = criticised(recording, [*PLAIN, "time_delay", "bandwidth"], full=True)
    assert found.verdict.form == "adequate"
    left = found.residuals["z"]
    assert float(np.sqrt(np.mean(left.score**2))) == pytest.approx(1.0, abs=0.15)
    assert float(left.floor_dps.mean()) < 0.02 / 4  # a piece has some twenty windows


@pytest.mark.slow
def test_slow_ramps_cannot_tell_a_delay_from_a_bandwidth_and_say_which_experiment_would() -> None:
    up = ramp(30.0, -60.0, 60.0, 100.0)
    found = criticised(profile_recording(np.concatenate([up, up[::-1]]), delay_s=0.005), PLAIN)
    assert found.verdict.form == "ambiguous"
    assert {"time_delay", "bandwidth"} <= set(found.verdict.named)


def test_at_one_rate_they_are_not_testable() -> None:
    still = profile_recording(np.concatenate([np.full(60 * 2000, 30.0), np.full(60 * 2000, -30.0)]))
    columns = {**still.columns, "dataset": np.repeat(np.arange(1, 121), 100)}
    info = still.info.model_copy(update={"motion": "rates"})
    found = criticised(Recording(info, columns), PLAIN, full=True)
    why = {line["effect"]: line["why"] for line in found.not_testable}
    assert why["time_delay"] == why["bandwidth"] == "schedule"


def test_the_mean_of_a_piece_is_its_first_coordinate() -> None:
    recording = profile_recording(SWEEP)
    data = reduce_recording(recording)
    assert len(data) == pytest.approx(300, abs=5)
    outputs = np.asarray(recording.columns["gyro_z"], dtype=np.float64)
    # the last piece ends where the last kept window does, 0.25 s before the end
    per_piece = len(data.nodes) // len(data)
    assert data.output["z"][0][-1] == pytest.approx(outputs[-25 - (per_piece - 1) - 1 : -25].mean(), abs=0.5)
    assert np.all(data.present[0])
