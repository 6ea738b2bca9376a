"""The uncertainty of a corrected rate: what the coefficients' covariance does to it, against drawn coefficients."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime
from typing import Any

import numpy as np
import pytest

from labctl.calibration import Calibration, build_calibration
from labctl.errors import BadInput
from labctl.fitting import FittedModel, fit
from labctl.fitting.data.channels import Channels
from labctl.recording import Recording
from labctl.services.calibrations.uncertainty import is_inside, uncertainty_of

AT = datetime(2026, 1, 5, 8, tzinfo=UTC)
NOISE_DPS = 0.01


def calibrated(make_points: Callable[..., Recording], grid: Any, model: str) -> Calibration:
    rate, warm = grid
    noise = np.random.default_rng(5).normal(0, NOISE_DPS, len(rate))
    output = rate * (1.2 + 1e-3 * (warm - 35)) + 0.3 + 0.01 * (warm - 35) + noise
    recording = make_points(rate, warm, output)
    return build_calibration(
        recording.info, fit(recording, model), version=1, parent=None, issued_at=AT, provenance={"recording": 1}
    )


def drawn(fitted: FittedModel, rng: np.random.Generator) -> FittedModel:
    def other(name: str) -> Any:
        axis = fitted.axes[name]
        values = rng.multivariate_normal(axis.values.ravel(), axis.covariance, method="svd")
        return replace(axis, values=values.reshape(axis.values.shape))

    return FittedModel(fitted.model, {name: other(name) for name in fitted.axes})


@pytest.mark.parametrize("model", ["bias_scale", "ojeda2000"])
@pytest.mark.parametrize(("rate", "warm"), [(0.0, 35.0), (90.0, 26.0)])
def test_it_is_the_spread_of_what_drawn_coefficients_give(
    make_points: Callable[..., Recording], grid_11_by_11: Any, model: str, rate: float, warm: float
) -> None:
    calibration = calibrated(make_points, grid_11_by_11, model)
    fitted, rng = calibration.fitted, np.random.default_rng(1)
    columns: dict[str, Any] = {
        "temperature_c": np.array([warm]), "table_rate_dps": np.array([rate]), "position": np.array(["z"])
    }  # fmt: skip
    channels = Channels(columns, {name: np.array([rate if name == "z" else 0.0]) for name in "xyz"})
    forward = fitted.model.argument == "rate"
    output = np.array([rate]) + (fitted.error_dps(channels, "z") if forward else 0.0)
    if not forward:  # the law is a function of the output; its argument is what the output is near
        output = np.array([rate])
    found = [drawn(fitted, rng).compensate({"z": output}, channels)["z"][0] for _ in range(600)]
    expected = uncertainty_of(calibration, rate, warm)["z"].coefficients_dps
    assert expected > 0
    assert np.std(found) == pytest.approx(expected, rel=0.12)


def test_it_grows_outside_and_says_so(make_points: Callable[..., Recording], grid_11_by_11: Any) -> None:
    calibration = calibrated(make_points, grid_11_by_11, "ojeda2000")
    inside, outside = (uncertainty_of(calibration, 0.0, warm)["z"] for warm in (35.0, 80.0))
    assert outside.combined_dps > 3 * inside.combined_dps
    assert is_inside(calibration, 0.0, 35.0)
    assert not is_inside(calibration, 0.0, 80.0)
    assert inside.expanded_dps == pytest.approx(2 * inside.combined_dps)


@pytest.mark.parametrize(("rate", "warm"), [(np.nan, 35.0), (0.0, np.inf), (1e157, 35.0)])
def test_a_number_that_is_none_is_refused(
    make_points: Callable[..., Recording], grid_11_by_11: Any, rate: float, warm: float
) -> None:
    calibration = calibrated(make_points, grid_11_by_11, "bias_scale")
    with pytest.raises(BadInput, match="must be a number between"):
        uncertainty_of(calibration, rate, warm)
