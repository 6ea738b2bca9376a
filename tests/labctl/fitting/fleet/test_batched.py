"""Refits of many units at once, against the fit of each alone."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime

import numpy as np
import pytest

from labctl.errors import BadInput, NotEnoughData
from labctl.fitting.data.fit_data import FitData, fit_data_of
from labctl.fitting.estimation.axis_solutions import solve_axes
from labctl.fitting.fleet import batched
from labctl.fitting.fleet.batched import batched_fit, batched_fit_of_each
from labctl.fitting.fleet.refit import refit
from labctl.fitting.models.held import Held, HeldCoefficient
from labctl.fitting.models.presets import PRESETS
from labctl.fitting.numeric.drift_noise import Drift, Noise, Scatter
from labctl.fitting.numeric.least_squares import solve
from labctl.recording import Recording, RecordingInfo

M, UNITS = 24, 5
DRIFT = Drift(0.02, 300.0, 1e-4)


@pytest.fixture(scope="module")
def cubic() -> tuple[np.ndarray, np.ndarray, Scatter]:
    """A cubic in rates of 100 deg/s, raw powers, with the means of five units."""
    rng = np.random.default_rng(1)
    rate = np.linspace(-100.0, 100.0, M)
    design = np.vander(rate, 4, increasing=True)
    y = design @ rng.normal(0.0, [[0.1], [1e-2], [1e-5], [1e-7]], (4, UNITS)) + rng.normal(0.0, 0.03, (M, UNITS))
    t_s = 60.0 * np.concatenate([rng.permutation(M // 2), M // 2 + rng.permutation(M // 2)])
    scatter = Scatter(t_s, np.repeat([1, 2], M // 2), rate, rng.uniform(1e-4, 4e-4, M))
    return design, y, scatter


@pytest.mark.parametrize("drift", [Drift(0.0, 1.0), DRIFT])
def test_units_together_are_fitted_as_each_alone(
    cubic: tuple[np.ndarray, np.ndarray, Scatter], drift: Drift, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(batched, "CHUNK", 2 * M)  # several pieces
    design, y, scatter = cubic
    together = batched_fit(design, y, scatter, drift)
    each = batched_fit_of_each(np.broadcast_to(design, (UNITS, M, 4)), y.T, scatter, drift)
    for unit in range(UNITS):
        alone = solve(design, y[:, unit], scatter, drift)
        for fit in (together, each):
            assert fit.values[unit] == pytest.approx(alone.values, rel=1e-10)
            assert fit.covariance(unit) == pytest.approx(alone.covariance, rel=1e-9)
            assert fit.scale[unit] == pytest.approx(alone.scale, rel=1e-10)
    assert together.u[0] == pytest.approx(np.sqrt(np.diag(together.covariance(0))))


def test_with_equal_noise_it_is_ordinary_least_squares(cubic: tuple[np.ndarray, np.ndarray, Scatter]) -> None:
    design, y, scatter = cubic
    plain = Scatter(scatter.t_s, scatter.run, scatter.rate_dps, None)
    values, residual, *_ = np.linalg.lstsq(design, y)
    found = batched_fit(design, y, plain, Drift(0.0, 1.0))
    np.testing.assert_allclose(found.values.T, values, rtol=1e-9)
    assert found.scale * (M - 4) == pytest.approx(residual, rel=1e-9)


def test_what_is_not_determined_is_said(cubic: tuple[np.ndarray, np.ndarray, Scatter]) -> None:
    design, y, scatter = cubic
    same = np.column_stack([design, design[:, 1]])
    with pytest.raises(NotEnoughData, match="24 data sets determine only 4 of the 5 coefficients"):
        batched_fit(same, y, scatter, DRIFT)
    designs = np.stack([np.column_stack([design, design[:, 0] + scatter.t_s]), same])
    found = batched_fit_of_each(designs, y.T[:2], scatter, DRIFT)
    assert np.all(np.isfinite(found.values[0]))
    assert np.all(np.isnan(found.values[1]))


@pytest.fixture(scope="module")
def data() -> FitData:
    """Points in three positions at five temperatures."""
    rng, rates, levels = np.random.default_rng(2), np.linspace(-100, 100, 7), np.array([0.0, 12.0, 25.0, 38.0, 50.0])
    rate, warm = np.tile(rates, 15), np.tile(np.repeat(levels, 7), 3)
    position, n = np.repeat(np.array(["x", "y", "z"]), 35), 105
    columns = {
        "dataset": np.arange(1, n + 1), "t_s": 60.0 * np.arange(n), "position": position, "n": np.full(n, 100),
        "run": np.ones(n, dtype=np.int64), "table_rate_dps": rate, "temperature_c": warm,
    }  # fmt: skip
    for axis in "xyz":
        along = np.where(position == axis, rate, 0.0)
        columns[f"gyro_{axis}"] = 1.01 * along + 2e-3 * rate + 0.1 + 1e-3 * warm + rng.normal(0, 2e-3, n)
        columns[f"gyro_{axis}_std"] = np.full(n, 0.02)
    info = RecordingInfo(serial="B", axes=("x", "y", "z"), kind="points", started_at=datetime(2026, 1, 1, tzinfo=UTC))
    return fit_data_of(Recording(info, columns))


@pytest.mark.parametrize("name", ["ojeda2000", "yang2018", "bias_scale"])
def test_a_published_model_is_refitted_as_the_fit_of_one_unit_does_it(data: FitData, name: str) -> None:
    model, _ = PRESETS[name][0].build(data)
    drift = dict.fromkeys("xyz", Drift(1e-3, 500.0))
    rng = np.random.default_rng(3)
    outputs = {axis: np.vstack([v + rng.normal(0, 1e-3, len(v)), v]) for axis, v in data.outputs.items()}
    found = refit(data, model, outputs, drift)
    alone = solve_axes(data, model, {axis: Noise(each, 1.0) for axis, each in drift.items()})
    for axis, fit in alone.fits.items():
        assert found[axis].fit.values[1] == pytest.approx(fit.values.ravel(), rel=1e-10)
        assert found[axis].fit.u[1] == pytest.approx(fit.u.ravel(), rel=1e-10)
        assert len(found[axis].names) == fit.values.size


def test_a_model_that_is_not_linear_is_refused(data: FitData) -> None:
    model, _ = PRESETS["bias_scale"][0].build(data)
    held = Held({"x": {"bias": HeldCoefficient((0.1,), (0.01,), "deg/s", "bias")}})
    with pytest.raises(BadInput, match="because it holds coefficients; fit each unit alone"):
        refit(data, replace(model, held=held), {a: v[None] for a, v in data.outputs.items()}, {})
