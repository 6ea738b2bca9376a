"""One output measured in three mountings: the residual is what the model leaves, not what one output cannot correct."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from labctl.compensator import Compensator
from labctl.errors import BadInput
from labctl.fitting.criticism import criticise
from labctl.fitting.criticism.criticism import FittedMeans, fit_means
from labctl.fitting.estimation.fit import fit
from labctl.recording import to_points
from labctl.services.criticism.answer import sentences
from labctl.services.criticism.verification.of_version import applied_errors
from studies.campaigns import campaign
from studies.effect_sizes import sizes
from studies.single_outputs import AT_FLOOR, of_one_output, outcome_of
from tests.helpers.calibrations import calibrated


@pytest.fixture(scope="module")
def recording() -> Any:
    """Output x of a tri-axial unit with an odd scale factor hidden in it."""
    hidden = {"scale_factor_odd": sizes("Y")["scale_factor_odd"]["100"]}
    return of_one_output(campaign("Y", 5100, hidden), "x")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("hidden", "axis"), [("scale_factor_odd", "x"), ("mounting_shift", "z"), ("supply_sensitivity", "y")]
)
def test_the_error_falls_to_the_floor_once_the_missing_effect_is_added(hidden: str, axis: str) -> None:
    found = outcome_of(hidden, "100", axis, 5200)
    assert hidden in found.named
    assert found.before_over_floor > 2.0
    assert found.after_over_floor is not None
    assert found.after_over_floor < AT_FLOOR
    assert not found.contradicts


def test_the_terms_across_are_part_of_a_law_of_the_output_too(recording: Any) -> None:
    effects = ["bias", "bias_temperature:2", "scale_factor", "misalignment", "scale_factor_odd"]
    forward = fit(recording, effects=effects)
    direct = fit(recording, "ojeda2000", ["misalignment"])
    assert direct.fitted.model.argument == "output"
    names = direct.fitted.axes["x"].names
    for name in ("misalignment_y", "misalignment_z"):
        there, here = direct.fitted.axes["x"], forward.fitted.axes["x"]
        expected = here.values[here.names.index(name), 0]
        assert there.values[names.index(name), 0] == pytest.approx(expected, rel=0.1)
    assert direct.error.rms_dps is not None
    assert forward.error.raw_rms_dps is not None
    assert direct.error.rms_dps < 0.02 * forward.error.raw_rms_dps


def test_rates_across_are_corrected_where_they_are_given(recording: Any) -> None:
    calibration = calibrated(recording, "yang2018", ["scale_factor_odd"])
    errors, _ = applied_errors(calibration, recording)
    assert np.sqrt(np.mean(errors["x"] ** 2)) < 0.003

    compensator = Compensator(calibration)
    fitted = calibration.fitted.axes["x"]
    across = fitted.values[fitted.names.index("misalignment_y")]
    low, high = calibration.temperature_c
    middle = 0.5 * (low + high)
    still = compensator.compensate(np.zeros(3), middle).rate_dps
    turned = compensator.compensate(np.zeros(3), middle, cross_rates_dps={"y": [0.0, 100.0, -100.0]}).rate_dps
    assert turned[0] == pytest.approx(still[0], abs=1e-9)
    change = still - turned
    assert np.all(np.sign(change[1:]) == np.sign([np.mean(across), -np.mean(across)]))
    assert abs(change[1]) == pytest.approx(100.0 * abs(np.mean(across)), rel=0.05)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"x": 1.0}, "cross_rates_dps of axis 'x'.*give rates about y and z only"),
        ({"y": [1.0, 2.0]}, r"shape \(2,\); give one rate, or one for each of the 3 samples"),
    ],
)
def test_rates_across_that_do_not_fit_are_refused(recording: Any, given: Any, message: str) -> None:
    compensator = Compensator(calibrated(recording, "yang2018"))
    with pytest.raises(BadInput, match=message):
        compensator.compensate(np.zeros(3), 20.0, cross_rates_dps=given)


@pytest.mark.slow
def test_no_model_is_adequate_that_leaves_a_large_multiple_of_the_floor(recording: Any) -> None:
    """The verdict of an adequate model, beside a fit that left far more: the words do not contradict the figure."""
    model = fit(recording, "yang2018", ["scale_factor_odd"]).fitted.model
    means = fit_means(to_points(recording), model)
    assert criticise(recording, model, fitted=means).verdict.form == "adequate"
    floor = means.base.error.noise_floor_dps
    assert floor is not None
    base = replace(means.base, error=replace(means.base.error, rms_dps=50.0 * floor))
    found = criticise(recording, model, fitted=FittedMeans(means.data, base))
    assert found.verdict.form == "unexplained"
    text = " ".join(sentences(found))
    assert "depends on no recorded channel" in text
    assert "dequate" not in text
