"""The uncertainty of a corrected rate vector, against drawn fixtures, closed forms and units simulated with numpy."""

from __future__ import annotations

import json
from dataclasses import replace
from datetime import UTC, datetime
from functools import cache

import numpy as np
import pytest

from labctl.errors import BadInput
from labctl.fitting import FitResult, fit
from labctl.fitting.uncertainty import (
    AxisEvidence,
    BenchConditions,
    RateVectorUncertainty,
    coefficient_budgets,
    conditions_of,
    evidence_of,
    rate_uncertainty,
    rate_vector_uncertainty,
)
from labctl.fitting.uncertainty.document import Covered, uncertainty_json
from labctl.fitting.uncertainty.vector_bound import cross_rates, vector_bounds
from labctl.recording import Recording, RecordingInfo, Standard
from studies.rate_vector_coverage import scores
from studies.rate_vector_simulation import AXES, SIX, THREE, Bench, Noise, Plan, Statement, Unit, campaign

EFFECTS = ["bias", "scale_factor", "misalignment"]
FIXTURE_DEG = 0.05
W = {"x": 100.0, "y": -60.0, "z": 30.0}


@cache
def ideal() -> Recording:
    """Return a tri-axial unit in three mountings."""
    return measured()


IDEAL = Unit(np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((3, 4)))


def measured(positions: tuple[str, ...] = THREE, outputs: tuple[str, ...] = AXES, unit: Unit = IDEAL) -> Recording:
    """Return a recording of one unit by an ideal bench that states its fixture."""
    rng = np.random.default_rng(4)
    plan = Plan("", positions, (-100.0, -50.0, 0.0, 50.0, 100.0), (0.0, 15.0, 30.0, 45.0))
    ideal = Statement(*[0.0] * 7)
    columns = campaign(unit, Bench.of(rng, ideal, positions), plan, Noise(), 0.0, rng)
    columns["temperature_c"] = columns.pop("chamber_c")
    info = RecordingInfo(
        serial="VECTOR", axes=outputs, kind="points", started_at=datetime(2026, 1, 5, tzinfo=UTC), max_rate_dps=100,
        standards=(Standard(quantity="fixture_angle", u=FIXTURE_DEG),), datasheet={"bias_stability_dps": 5e-4},
    )  # fmt: skip
    return Recording(info, columns)


@cache
def known_of_ideal() -> tuple[FitResult, dict[str, AxisEvidence], BenchConditions]:
    """Return what is known of it."""
    return known(ideal())


def known(recording: Recording) -> tuple[FitResult, dict[str, AxisEvidence], BenchConditions]:
    result = fit(recording, effects=EFFECTS)
    evidence = {
        axis: AxisEvidence.from_json(json.loads(json.dumps(one.to_json())))
        for axis, one in evidence_of(recording, None, EFFECTS).items()
    }
    bench = conditions_of(recording.info, result.environment, mountings=result.mountings)
    return result, evidence, BenchConditions.from_json(json.loads(json.dumps(bench.to_json())))


def at(recording: Recording, rates_dps: dict[str, float], temperature_c: float = 20.0) -> RateVectorUncertainty:
    result, evidence, bench = known_of_ideal() if recording is ideal() else known(recording)
    return rate_vector_uncertainty(result.fitted, rates_dps, temperature_c, evidence=evidence, name="unit", bench=bench)


def part(found: RateVectorUncertainty, source: str, *, aligned: bool = False) -> np.ndarray:
    """Return what one source adds to the covariance."""
    for each in found.aligned_sources if aligned else found.sources:
        if each.lines[0].source == source:
            return each.covariance
    raise AssertionError(source)


def test_a_fixture_that_leans_adds_what_drawn_fixtures_add() -> None:
    """Each mounting p turns the unit about a_p + f_p x a_p; the error of a corrected rate is f_p x a_p times w_p."""
    found, w = at(ideal(), W), np.array(list(W.values()))
    rng, draws, u = np.random.default_rng(1), 40_000, np.radians(FIXTURE_DEG)
    leaning = rng.normal(0, u, (draws, 3, 3)) * (1 - np.eye(3))  # column p: where mounting p leans to
    assert part(found, "fixture_angle") == pytest.approx(np.cov((leaning @ w).T), rel=0.05, abs=2e-4)
    turned_back = (leaning + leaning.transpose(0, 2, 1)) / 2  # the closest rotation is the antisymmetric part
    assert part(found, "fixture_angle", aligned=True) == pytest.approx(np.cov((turned_back @ w).T), rel=0.05, abs=2e-4)


def test_table_tops_that_lean_within_limits_cover_as_drawn_ones_do() -> None:
    """Two mountings lean independently of each other: the sum of two rectangular errors is triangular, and k is 1.93.

    As one rectangular error it had k = 1.65, so that U about any axis was too small.
    """
    recording = ideal()
    top = Standard(quantity="tilt", half_width=0.5, distribution="rectangular")
    leaning = replace(recording, info=recording.info.model_copy(update={"standards": (top,)}))
    found = at(leaning, {"x": 0.0, "y": 100.0, "z": 100.0}).budgets["x"]
    (tilt,) = (line for line in found.lines if line.source == "tilt")
    assert tilt.contribution is not None
    assert np.linalg.norm(tilt.parts) == pytest.approx(tilt.contribution)
    assert found.combined == pytest.approx(tilt.contribution, rel=1e-3)
    drawn = np.random.default_rng(2).uniform(-np.sqrt(3), np.sqrt(3), (400_000, 2)) @ np.array(tilt.parts[:2])
    assert found.expanded == pytest.approx(np.quantile(np.abs(drawn), 0.9545), rel=0.005)
    assert found.k == pytest.approx(np.sqrt(6) * (1 - np.sqrt(1 - 0.9545)), rel=0.002)


def test_along_its_own_axis_it_is_the_uncertainty_of_a_rate_about_this_axis() -> None:
    result, evidence, bench = known_of_ideal()
    alone = rate_uncertainty(result.fitted, 80.0, 20.0, evidence=evidence, name="unit", bench=bench)
    vector = at(ideal(), {"y": 80.0})
    assert vector.budgets["y"].expanded == alone["y"].expanded_dps
    assert np.diag(vector.covariance) == pytest.approx(
        [vector.budgets[axis].combined ** 2 for axis in AXES],
        rel=1e-12,  # type: ignore[operator]
    )
    assert vector.budgets["x"].expanded > 20 * vector.budgets["y"].expanded  # type: ignore[operator]


def test_two_faces_of_each_axis_halve_the_variance_of_the_fixture() -> None:
    three, six = (part(at(measured(positions), W), "fixture_angle") for positions in (THREE, SIX))
    assert six == pytest.approx(three / 2, rel=1e-4)


def test_outputs_that_drift_together_are_uncertain_together() -> None:
    recording = ideal()
    same = {f"gyro_{axis}": recording.columns["gyro_x"] - recording.columns["table_rate_dps"] for axis in AXES}
    rates = {axis: recording.columns["table_rate_dps"] * (recording.columns["position"] == axis) for axis in AXES}
    drift = same["gyro_x"] + recording.columns["table_rate_dps"] - rates["x"]
    together = Recording(recording.info, {**recording.columns, **{f"gyro_{a}": rates[a] + drift for a in AXES}})
    covariance = part(at(together, W), "coefficients")
    correlation = covariance / np.sqrt(np.outer(np.diag(covariance), np.diag(covariance)))
    assert correlation == pytest.approx(np.ones((3, 3)), abs=0.02)
    apart = part(at(recording, W), "coefficients")
    assert np.abs(apart[0, 1]) < 0.4 * np.sqrt(apart[0, 0] * apart[1, 1])


def test_a_rate_that_one_output_cannot_know_is_a_line_of_its_own() -> None:
    gain = np.zeros((3, 3))
    gain[2] = [0.012, -0.005, 0.001]
    unit = Unit(gain, np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((3, 4)))
    found = at(measured(outputs=("z",), unit=unit), W)
    budget = found.budgets["z"]
    line = next(line for line in budget.lines if line.source == "cross_rates")
    assert line.uncorrected == pytest.approx(0.012 * 100 + 0.005 * 60, rel=1e-3)
    assert budget.expanded == pytest.approx(1.5 + 1.69 * (budget.combined or 0.0), rel=0.01)
    result, evidence, bench = known(measured(outputs=("z",), unit=unit))
    budgets = coefficient_budgets(result.fitted, 20.0, evidence=evidence, name="unit", bench=bench)["z"]
    stated = cross_rates(result.fitted, budgets)
    assert stated is not None
    assert stated["about"] == ["x", "y"]
    assert stated["per_dps"] == pytest.approx(0.013 + 1.69 * np.radians(FIXTURE_DEG), rel=0.02)


def test_about_an_axis_that_was_never_turned_nothing_is_promised() -> None:
    recording = measured(positions=("z",), outputs=("z",))
    result, evidence, bench = known(recording)
    found = rate_vector_uncertainty(
        result.fitted, {"x": 5.0, "z": 50.0}, 20.0, evidence=evidence, name="unit", bench=bench
    )
    assert found.budgets["z"].expanded is None
    assert np.isnan(found.covariance).all()
    assert found.unknown["z"] == {"model": "the unit was not turned about x"}
    bounds = vector_bounds(result.fitted, 100.0, [20.0], evidence=evidence, name="unit", bench=bench)
    assert bounds["z"]["bound_dps"] is None
    assert "the unit was not turned about" in bounds["z"]["why"]


@pytest.mark.parametrize(
    ("positions", "said"),
    [
        (("z",), "the misalignments towards x and y are not known: turn the unit on the table with x up and with y up"),
        (("z", "x"), "the misalignment towards y is not known: turn the unit on the table with y up too"),
    ],
)
def test_the_axes_that_were_never_up_are_named(positions: tuple[str, ...], said: str) -> None:
    result, evidence, bench = known(measured(positions=positions, outputs=("z",)))
    budgets = coefficient_budgets(result.fitted, 20.0, evidence=evidence, name="unit", bench=bench)["z"]
    stated = cross_rates(result.fitted, budgets)
    assert stated is not None
    assert stated["per_dps"] is None
    assert stated["why"].startswith(said)


def test_a_version_that_did_not_store_the_mountings_says_to_fit_again() -> None:
    result, evidence, bench = known_of_ideal()
    records = {axis: one.to_json() for axis, one in evidence.items()}
    for record in records.values():
        del record["across_dps"]
    older = {axis: AxisEvidence.from_json(record) for axis, record in records.items()}
    found = rate_vector_uncertainty(result.fitted, W, 20.0, evidence=older, name="unit", bench=bench)
    assert all("older version" in found.unknown[axis]["model"] for axis in AXES)
    alone = rate_vector_uncertainty(result.fitted, {"x": 9.0}, 20.0, evidence=older, name="unit", bench=bench)
    assert alone.budgets["x"].expanded is not None


def test_the_bound_is_the_largest_of_the_ball() -> None:
    result, evidence, bench = known_of_ideal()
    bounds = vector_bounds(result.fitted, 100.0, [0.0, 45.0], evidence=evidence, name="unit", bench=bench)
    rng = np.random.default_rng(8)
    directions = rng.normal(size=(60, 3))
    rates = 100.0 * directions / np.linalg.norm(directions, axis=1, keepdims=True) * rng.uniform(0, 1, (60, 1))
    for rate in rates.tolist():
        w = dict(zip(AXES, rate, strict=True))
        found = rate_vector_uncertainty(result.fitted, w, 20.0, evidence=evidence, name="unit", bench=bench)
        for axis, budget in found.budgets.items():
            assert (budget.expanded or np.inf) <= 1.02 * (bounds[axis]["bound_dps"] or 0.0)


def test_the_bound_about_any_axis_is_at_least_that_about_one() -> None:
    result, evidence, bench = known_of_ideal()
    stated = uncertainty_json(result.fitted, Covered((-100.0, 100.0), (0.0, 45.0)), evidence, bench)
    assert stated is not None
    for axis in AXES:
        alone, about_any = stated["axes"][axis]["bound_dps"], stated["axes"][axis]["vector"]["bound_dps"]
        assert alone is not None
        assert about_any is not None
        assert 0 < alone <= about_any


@pytest.mark.parametrize("rates", [{"q": 1.0}, {"x": float("nan")}, {"z": 1e9}])
def test_what_is_no_rate_vector_is_refused(rates: dict[str, float]) -> None:
    result, evidence, bench = known_of_ideal()
    with pytest.raises(BadInput, match=r"name one of them|give a number between"):
        rate_vector_uncertainty(result.fitted, rates, 20.0, evidence=evidence, name="unit", bench=bench)


@pytest.mark.slow
def test_units_that_turn_about_any_axis_are_inside_u() -> None:
    """One unit of each plan; `python -m studies rate_vector_coverage` has 400."""
    found = [scores(number) for number in (0, 8, 5)]
    every = np.concatenate([each.over_u.ravel() for each in found])
    assert np.isfinite(every).all()
    assert np.mean(np.abs(every) <= 1) > 0.9
    assert np.sqrt(np.mean(every**2)) > 0.2  # and U is not far larger than the errors


def test_a_slope_that_the_model_lacks_is_in_the_budget_of_the_coefficient() -> None:
    """A misalignment and a scale factor that change with temperature, by a model in which they do not."""
    slope = np.zeros((3, 3))
    slope[2] = [40 * 2e-5, 0.0, 40 * 1e-5]  # of output z over 40 K, about x and z
    result, evidence, bench = known(measured(unit=Unit(np.zeros((3, 3)), slope, np.zeros((3, 3)), np.zeros((3, 4)))))
    for warm_c, away_k in ((0.0, 22.5), (45.0, 22.5), (22.5, 0.0)):
        budgets = coefficient_budgets(result.fitted, warm_c, evidence=evidence, name="unit", bench=bench)["z"]
        for name, per_k in (("misalignment_x", 2e-5), ("scale_factor", 1e-5)):
            (line,) = [line for line in budgets[name].lines if line.source == "model"]
            assert line.u == pytest.approx(per_k * max(away_k, 6.0), rel=0.6)
        (line,) = [line for line in budgets["misalignment_y"].lines if line.source == "model"]
        assert line.u is not None
        assert line.u < 3e-5  # about y the model lacks nothing


def test_the_model_error_of_a_slope_that_nothing_shows_is_said_and_not_in_its_u() -> None:
    result, evidence, bench = known_of_ideal()
    budgets = coefficient_budgets(result.fitted, 20.0, evidence={}, name="unit", bench=bench)["z"]
    assert "model" in budgets["misalignment_x"].not_stated
    assert budgets["misalignment_x"].expanded is not None
    budgets = coefficient_budgets(result.fitted, 20.0, evidence=evidence, name="unit", bench=bench)["z"]
    assert "model" not in budgets["misalignment_x"].not_stated
