"""Records at rest: what a leaning support, an unlogged temperature and coarse steps of the output are not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from labctl.errors import NotEnoughData
from labctl.fitting.criticism import Criticism, criticise
from labctl.fitting.criticism.candidates import options_of
from labctl.fitting.criticism.ranking import largest_plausible
from labctl.fitting.criticism.reduction import reduce_recording
from labctl.fitting.data.fit_data import fit_data_of
from labctl.fitting.effects import CATALOGUE, Reference
from labctl.fitting.estimation.fit import fit, fit_preset
from labctl.fitting.models.presets import preset_for
from labctl.recording import Recording, to_points
from labctl.services.criticism.answer import sentences
from studies.rest_records import CELLS, TYPES, Disturbance, Unit, record

OF_FORCE = ("g_sensitivity", "cross_g_sensitivity", "g_squared_sensitivity")


def at_rest(
    cell: str = "unlogged temperature", *, seed: int = 0, step_dps: float = 0.0, hours: float = 2.8
) -> Recording:
    """Return a record of a consumer unit, or an industrial one without steps."""
    unit = Unit.made(seed, "consumer" if step_dps else "industrial")
    unit = replace(unit, kind=replace(unit.kind, step_dps=step_dps))
    what = replace(CELLS[cell], room_k=8.0) if step_dps else CELLS[cell]
    return record(unit, what, 0, seed=seed, hours=hours)


def criticised(recording: Recording) -> Criticism:
    points = to_points(recording)
    base = fit_preset(fit_data_of(points), preset_for("bias_temperature", []))
    return criticise(recording, base.fitted.model, points=points)


def test_a_support_that_leans_by_milli_g_shows_no_effect_of_g() -> None:
    data = reduce_recording(at_rest())
    assert not {option.candidate for option in options_of(data, "x", Reference())} & {*OF_FORCE, "accel_x_g"}


@pytest.mark.parametrize("effect", OF_FORCE)
def test_an_effect_of_g_is_not_fitted_without_a_change_of_pose(effect: str) -> None:
    with pytest.raises(NotEnoughData, match=f"{effect} cannot be determined: no change of pose.*0.1 g"):
        fit(at_rest(hours=0.5), effects=["bias", effect])


def test_a_bias_beside_a_ramp_is_that_of_the_middle_of_the_record() -> None:
    """The logger's clock counts from 1970: 20 days of ramp lie between that and the record."""
    recording = at_rest("plain")
    with_ramp = fit(recording, effects=["bias", "bias_drift"])
    bias = {axis: found.values[0, 0] for axis, found in with_ramp.fitted.axes.items()}
    means = {axis: float(np.mean(recording.gyro_dps(axis))) for axis in bias}
    assert bias == pytest.approx(means, abs=0.01)


@pytest.mark.slow
def test_a_temperature_that_was_not_logged_is_said_and_nothing_is_advised() -> None:
    found = criticised(at_rest())
    assert (found.verdict.form, found.verdict.named) == ("unexplained", ())
    assert found.verdict.hypothesis == "temperature_not_logged"
    assert found.slow is not None
    assert (found.slow["common"] or 0.0) > 0.8
    assert sentences(found)[0].startswith("The temperature that matters was not logged")
    assert found.advice == ()


@pytest.mark.slow
def test_a_hysteresis_that_holds_on_parts_left_out_is_advised() -> None:
    found = criticised(at_rest("hysteresis"))
    assert [(each["effect"], each["add"]) for each in found.advice] == [("thermal_hysteresis", True)]


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1])
def test_coarse_steps_are_read_from_the_output_and_not_taken_for_a_law_of_temperature(seed: int) -> None:
    found = criticised(at_rest("tilt", seed=seed, step_dps=0.1))
    assert found.verdict.named == ("quantization",)
    assert found.data.steps["x"]["step_dps"] == pytest.approx(0.1)
    assert any(text.startswith("Quantization: the output comes in steps (x by 0.1 deg/s") for text in sentences(found))
    assert not any(each["add"] for each in found.advice)


def test_without_a_technology_the_largest_plausible_size_of_all_counts() -> None:
    ranges = CATALOGUE["cross_g_sensitivity"].ranges
    assert largest_plausible("cross_g_sensitivity", "") == max(high for _, high in ranges.values())
    assert largest_plausible("cross_g_sensitivity", "fog") == 1e-3


@pytest.mark.slow
def test_a_suspect_is_not_listed_with_a_fit_that_is_worse_than_the_model() -> None:
    found = criticised(at_rest("hysteresis"))
    assert found.base is not None
    assert found.base.error.rms_dps is not None
    for suspect in found.suspects:
        if suspect.after is not None and suspect.after.error.rms_dps is not None:
            assert suspect.after.error.rms_dps <= 1.01 * found.base.error.rms_dps
            assert 0.0 <= suspect.share_removed <= 1.0


def test_sizes_of_a_record_are_multiples_of_the_drift_of_its_type() -> None:
    assert Disturbance(walk_dps=3.0).of_type(TYPES["industrial"]).walk_dps == pytest.approx(0.003)
