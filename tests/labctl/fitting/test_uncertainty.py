"""The uncertainty of a corrected rate: what the coefficients' covariance does to it, against drawn coefficients."""

from __future__ import annotations

import json
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
from labctl.fitting.uncertainty import AxisEvidence, RateUncertainty, evidence_of, rate_uncertainty
from labctl.fitting.uncertainty.grid import grid_rates, grid_temperatures
from labctl.fitting.uncertainty.local_model_error import LocalModelError
from labctl.recording import Recording, read_recording
from labctl.services.calibrations.uncertainty import (
    is_inside,
    uncertainty_grid,
    uncertainty_of,
)
from tests.helpers.paths import EXAMPLES
from tests.helpers.recordings import points

AT = datetime(2026, 1, 5, 8, tzinfo=UTC)
NOISE_DPS = 0.01


def calibrated(make_points: Callable[..., Recording], grid: Any, model: str) -> Calibration:
    rate, warm = grid
    noise = np.random.default_rng(5).normal(0, NOISE_DPS, len(rate))
    output = rate * (1.2 + 1e-3 * (warm - 35)) + 0.3 + 0.01 * (warm - 35) + noise
    recording = make_points(rate, warm, output, datasheet={"bias_stability_dps": NOISE_DPS})
    return build_calibration(
        recording.info,
        fit(recording, model),
        version=1,
        parent=None,
        issued_at=AT,
        provenance={"recording": 1},
        evidence=evidence_of(recording, model, None),
    )


def drawn(fitted: FittedModel, rng: np.random.Generator) -> FittedModel:
    def other(name: str) -> Any:
        axis = fitted.axes[name]
        values = rng.multivariate_normal(axis.values.ravel(), axis.covariance, method="svd")
        return replace(axis, values=values.reshape(axis.values.shape))

    return FittedModel(fitted.model, {name: other(name) for name in fitted.axes})


@pytest.mark.slow
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


def test_uncertainty_grows_outside_the_range(make_points: Callable[..., Recording], grid_11_by_11: Any) -> None:
    calibration = calibrated(make_points, grid_11_by_11, "ojeda2000")
    inside, outside = (uncertainty_of(calibration, 0.0, warm)["z"] for warm in (35.0, 80.0))
    assert inside.coefficients_dps is not None
    assert inside.combined_dps is not None
    assert outside.coefficients_dps > 3 * inside.coefficients_dps
    assert outside.model_dps is outside.expanded_dps is None  # nothing was measured near there
    assert is_inside(calibration, [0.0], 35.0)
    assert not is_inside(calibration, [0.0], 80.0)
    assert inside.expanded_dps == pytest.approx(2 * inside.combined_dps)


@pytest.mark.parametrize(("rate", "warm"), [(np.nan, 35.0), (0.0, np.inf), (1e157, 35.0)])
def test_a_number_that_is_none_is_refused(
    make_points: Callable[..., Recording], grid_11_by_11: Any, rate: float, warm: float
) -> None:
    calibration = calibrated(make_points, grid_11_by_11, "bias_scale")
    with pytest.raises(BadInput, match="give a number between"):
        uncertainty_of(calibration, rate, warm)


def campaign(misfit: float = 0.0, shifts: tuple[float, ...] = (0.0,), **info: Any) -> Recording:
    """Return two passes over 11 rates and 9 temperatures per run, with a cubic of the rate of `misfit` deg/s."""
    rng = np.random.default_rng(3)
    rate, warm = np.tile(np.linspace(-100, 100, 11), 18), np.tile(np.repeat(np.linspace(0, 40, 9), 11), 2)
    n, runs = len(rate), len(shifts)
    error = 0.1 + 1e-3 * rate + 2e-3 * warm + misfit * (rate / 100) ** 3
    made = points(np.tile(rate, runs), np.tile(warm, runs), np.tile(rate + error, runs), **info)
    noise = rng.normal(0, 1e-3, n * runs) + np.repeat(shifts, n)
    columns = {
        **made.columns, "gyro_z": made.columns["gyro_z"] + noise, "run": np.repeat(np.arange(1, runs + 1), n),
        "gyro_z_std": np.full(n * runs, 1e-2), "n": np.full(n * runs, 100),
    }  # fmt: skip
    return Recording(made.info, columns)


STRAIGHT = ["bias", "bias_temperature:1", "scale_factor"]


def of_use(recording: Recording, rate: float, warm: float) -> RateUncertainty:
    evidence = evidence_of(recording, None, STRAIGHT)
    again = {axis: AxisEvidence.from_json(json.loads(json.dumps(one.to_json()))) for axis, one in evidence.items()}
    return rate_uncertainty(fit(recording, effects=STRAIGHT).fitted, rate, warm, evidence=again, name="unit")["z"]


@pytest.mark.parametrize("rate", [-100.0, -50.0, 60.0, 100.0])
def test_an_error_that_only_the_rate_shows_is_promised_where_it_is(rate: float) -> None:
    """Leaving out temperatures cannot see it: U was 0 there and a quarter of the error."""
    recording = campaign(misfit=0.1)
    fitted = fit(recording, effects=STRAIGHT).fitted
    left = 0.1 * (rate / 100) ** 3 - (fitted.axes["z"].values[2, 0] - 1e-3) * rate
    found = of_use(recording, rate, 20.0)
    assert found.model_dps is not None
    assert 0.5 * abs(left) < found.model_dps < 3 * max(abs(left), 0.01)


def test_a_model_that_is_adequate_is_promised_little_more_than_its_coefficients() -> None:
    found = of_use(campaign(), 40.0, 20.0)
    assert found.model_dps is not None
    assert 0 < found.model_dps < 7e-4


def test_the_scatter_between_runs_is_repeatability_and_not_the_models() -> None:
    found = of_use(campaign(shifts=(0.02, -0.02, 0.01)), 40.0, 20.0)
    assert found.repeatability_source == "between runs"
    assert found.repeatability_dps == pytest.approx(0.0208 * np.sqrt(4 / 3), rel=0.1)
    assert found.combined_dps == pytest.approx(found.repeatability_dps * 4.53 / 2, rel=0.02)  # two degrees of freedom
    assert found.model_dps is not None
    assert found.model_dps < 2e-3


def test_what_is_not_known_is_none_and_never_zero() -> None:
    one_run = of_use(campaign(), 0.0, 20.0)
    assert one_run.same_run_dps is not None
    assert one_run.repeatability_dps is one_run.combined_dps is one_run.expanded_dps is None
    assert list(one_run.unknown) == ["repeatability"]
    by_sheet = of_use(campaign(datasheet={"bias_stability_dps": 0.01}), 0.0, 20.0)
    assert by_sheet.repeatability_dps == pytest.approx(0.01 * np.sqrt(2))
    assert by_sheet.expanded_dps is not None
    assert by_sheet.unknown == {}
    far = of_use(campaign(datasheet={"bias_stability_dps": 0.01}), 0.0, 90.0)
    assert far.model_dps is far.expanded_dps is None
    assert far.unknown == {"model": "no data set was measured near there"}


@pytest.mark.parametrize(
    ("convention", "u_over_figure", "shape"),
    [
        ("1 sigma", 1.0, "normal"),
        ("maximum", 1 / np.sqrt(3), "triangular"),
        ("peak to peak", 1 / np.sqrt(12), "triangular"),
        ("typical", 1.48, "normal"),
    ],
)
def test_a_figure_of_the_data_sheet_counts_by_its_convention_and_the_line_names_it(
    convention: str, u_over_figure: float, shape: str
) -> None:
    sheet = {"bias_stability_dps": 0.01}
    recording = campaign(datasheet=sheet, datasheet_conventions={"bias_stability_dps": convention})
    budget = of_use(recording, 0.0, 20.0).budget
    line = next(line for line in budget.lines if line.source == "repeatability")
    assert line.u == pytest.approx(0.01 * u_over_figure * np.sqrt(2))
    assert (line.name, line.kind, line.distribution) == (f"data sheet, {convention}", "B", shape)
    assert line.why.startswith(f"bias stability 0.01 deg/s, {convention}: ")
    assert of_use(recording, 0.0, 20.0).repeatability_source == "data sheet"


def test_a_version_from_before_conventions_says_that_its_figure_was_halved() -> None:
    [evidence] = evidence_of(campaign(datasheet={"bias_stability_dps": 0.01}), None, STRAIGHT).values()
    record = evidence.to_json()
    assert AxisEvidence.from_json(record).repeatability == evidence.repeatability
    for key in ("repeatability_convention", "repeatability_text"):
        del record[key]
    earlier = AxisEvidence.from_json(record).repeatability
    assert earlier is not None
    assert "half the figure" in earlier.text


def test_too_few_data_sets_near_a_place_are_said() -> None:
    rate, warm, nothing = np.array([0.0, 100.0, 100.0]), np.array([0.0, 40.0, 40.0]), np.full(3, np.nan)
    error = LocalModelError(rate, warm, np.full(3, 1e-4), np.zeros(3))
    assert error.at(0.0, 0.0) is None
    assert error.unknown_at(0.0, 0.0) == "fewer than 3 data sets were measured near there"
    everywhere = LocalModelError(rate, warm, nothing, np.zeros(3))
    assert everywhere.at(0.0, 0.0) is None
    assert "no data set could be left out" in str(everywhere.unknown_at(0.0, 0.0))


def test_a_version_that_kept_no_evidence_says_to_fit_again(
    make_points: Callable[..., Recording], grid_11_by_11: Any
) -> None:
    calibration = calibrated(make_points, grid_11_by_11, "bias_scale")
    found = rate_uncertainty(calibration.fitted, 0.0, 35.0, evidence={}, name="unit")["z"]
    assert found.coefficients_dps is not None
    assert found.same_run_dps is found.expanded_dps is None
    assert set(found.unknown) == {"model", "repeatability"}
    assert "fit it again" in found.unknown["model"]


@pytest.mark.parametrize(
    ("limits", "expected"),
    [
        ((-400.0, 400.0), [-400, -200, 0, 200, 400]),
        ((-399.9, 400.1), [-399.9, -199.95, 0, 200.05, 400.1]),
        ((-0.003, 400.0), [0, 200, 400]),
        ((10.0, 100.0), [10, 50, 100]),
        ((80.0, 100.0), [80, 100]),
        ((0.0028, 0.0028), [0.0028]),
        ((0.0, 0.0), [0]),
    ],
)
def test_a_grid_has_the_limits_half_of_them_and_rest(limits: tuple[float, float], expected: list[float]) -> None:
    assert grid_rates(*limits) == pytest.approx(expected)


def test_a_calibration_at_one_temperature_has_one_row() -> None:
    assert grid_temperatures(24.9, 25.1) == pytest.approx([25])
    assert grid_temperatures(-40, 60) == [-40, 10, 60]


def test_a_model_without_a_rate_is_shown_at_the_rates_that_were_measured(
    make_points: Callable[..., Recording], grid_11_by_11: Any
) -> None:
    rate, warm = grid_11_by_11
    recording = make_points(rate, warm, rate + 0.3 + 1e-3 * np.random.default_rng(5).normal(size=len(rate)))
    calibration = build_calibration(
        recording.info, fit(recording, effects=["bias"]), version=1, parent=None, issued_at=AT, provenance={},
        evidence=evidence_of(recording, None, ["bias"]),
    )  # fmt: skip
    assert calibration.rate_dps == (-np.inf, np.inf)
    grid = uncertainty_grid(calibration)
    assert (grid.rate_dps[0], grid.rate_dps[-1]) == (rate.min(), rate.max())


def test_a_table_of_coefficients_is_uncertain_by_an_unknown_amount() -> None:
    table = read_recording(EXAMPLES / "weiss-gyrostar")
    found = rate_uncertainty(
        fit(table, "weiss1995").fitted, 50.0, 25.0, evidence=evidence_of(table, "weiss1995", None), name="table"
    )
    for one in found.values():
        assert one.coefficients_dps is one.model_dps is one.combined_dps is one.expanded_dps is None
