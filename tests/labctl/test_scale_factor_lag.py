"""A scale factor that follows the temperature with a delay: named on a turning table, and corrected as samples come.

The units are those of `studies.turned_units`, and a law written out here; both by numpy alone.
"""

from __future__ import annotations

import shutil
import subprocess
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from labctl.calibration import Calibration, build_calibration
from labctl.compensator import Compensator
from labctl.exports import export_calibration
from labctl.exports.c_header import c_name
from labctl.fitting.criticism import criticise
from labctl.fitting.data.fit_data import FitData, fit_data_of
from labctl.fitting.effects import Term
from labctl.fitting.estimation.fit import fit_preset
from labctl.fitting.estimation.shapes import with_shapes
from labctl.fitting.models.error_model import ErrorModel
from labctl.fitting.models.presets import changed, preset_for, unchanged
from labctl.recording import Recording, to_points
from studies.turned_units import Turned, turned_unit
from tests.helpers.c_header import STRICT

MODEL = ["bias", "bias_temperature", "scale_factor", "scale_factor_temperature"]
LAGS = (Term("scale_factor_lag", None, {"tau_s": 400.0}), Term("thermal_lag", None, {"tau_s": 250.0}))
SINE = Term("sine_response", None, {"k": 0.05})
#: The laws of a correction, by what is solved for the rate.
LAWS = ("linear", "three axes", "sine", "polynomial", "direct", "flows")

MAIN = """
#include <stdio.h>
#include "calibration.h"
int main(void) {{
    {name}_state state; double t, c, in; LABCTL_REAL w[{name}_AXES], rate[{name}_AXES]; int a;
    {name}_begin(&state);
    while (scanf("%lf %lf", &t, &c) == 2) {{
        for (a = 0; a < {name}_AXES; a++) {{ if (scanf("%lf", &in) != 1) return 1; w[a] = (LABCTL_REAL)in; }}
        printf("%d", {name}_step(&state, w, (LABCTL_REAL)c, t, rate));
        for (a = 0; a < {name}_AXES; a++) printf(" %.17g", (double)rate[a]);
        printf("\\n");
    }}
    return 0;
}}
"""


def based(recording: Recording, more: tuple[str, ...] = ()) -> tuple[Recording, FitData, ErrorModel]:
    points = to_points(recording)
    data = fit_data_of(points)
    return points, data, preset_for(None, [*MODEL, *more]).build(data)[0]


def issued(recording: Recording, data: FitData, model: ErrorModel) -> Calibration:
    result = fit_preset(data, unchanged(model))
    at = datetime(2026, 1, 6, tzinfo=UTC)
    return build_calibration(recording.info, result, version=1, parent=None, issued_at=at, provenance={})


@pytest.fixture(scope="module")
def laws() -> dict[str, Calibration]:
    """Return calibrations of every form in which a correction is solved, each with lags of bias and scale factor."""
    one = turned_unit(1, Turned(scale_lag_s=400.0, bias_lag_s=250.0, loops=1))
    three = turned_unit(2, Turned(scale_lag_s=400.0, axes=("x", "y", "z"), loops=1))
    _, data, model = based(one)
    _, of_three, across = based(three, ("misalignment",))
    flows = (
        Term("scale_factor_lag", None, {"tau_s": 100.0, "second_tau_s": 900.0, "curved": 1.0}),
        Term("thermal_lag", None, {"tau_s": 250.0, "cooling_tau_s": 500.0}),
    )
    return {
        "linear": issued(one, data, model.with_added(LAGS)),
        "three axes": issued(three, of_three, across.with_added(LAGS)),
        "sine": issued(one, data, model.with_added((SINE, *LAGS))),
        "polynomial": issued(one, data, model.with_added((Term("scale_factor_odd", 3), *LAGS))),
        "direct": issued(one, data, ErrorModel("direct", (Term("rate_temperature_surface", 3), *LAGS), "output")),
        "flows": issued(one, data, model.with_added(flows)),
    }


def trace(calibration: Calibration, n: int = 300) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return times at uneven distances, temperatures and outputs beyond the calibrated ones, some no numbers."""
    rng = np.random.default_rng(4)
    t_s = np.cumsum(rng.uniform(0.01, 30.0, n))
    warm = 25.0 + 40.0 * np.sin(t_s / 900.0) + rng.normal(0, 0.1, n)
    raw = rng.uniform(-220.0, 220.0, (n, len(calibration.axes)))
    warm[7], raw[11, 0] = np.nan, np.nan
    return t_s, warm, raw


@pytest.mark.parametrize("law", LAWS)
def test_samples_one_by_one_in_blocks_and_in_one_array_are_corrected_alike(
    laws: dict[str, Calibration], law: str
) -> None:
    calibration = laws[law]
    t_s, warm, raw = trace(calibration)
    whole = Compensator(calibration).compensate(raw, warm, {"t_s": t_s})
    running, blocks = Compensator(calibration), Compensator(calibration)
    stepped = [running.step(raw[k], warm[k], t_s[k]) for k in range(len(t_s))]
    cuts = np.split(np.arange(len(t_s)), [1, 8, 100, 101, 290])
    parts = [blocks.compensate(raw[b], warm[b], {"t_s": t_s[b]}, continued=True).rate_dps for b in cuts]
    assert np.array([rate for rate, _ in stepped]) == pytest.approx(whole.rate_dps, abs=1e-12, nan_ok=True)
    assert np.concatenate(parts) == pytest.approx(whole.rate_dps, abs=1e-12, nan_ok=True)
    assert [outside for _, outside in stepped] == whole.outside.tolist()
    assert np.isnan(whole.rate_dps[7]).all()
    assert np.isfinite(np.delete(whole.rate_dps, [7, 11], axis=0)).all()


def test_the_rate_of_a_law_written_out_is_found_again(laws: dict[str, Calibration]) -> None:
    calibration = laws["linear"]
    fit = calibration.fitted.axes["z"]
    c = dict(zip(fit.names, fit.values[:, 0].tolist(), strict=True))
    t_s = np.arange(0.0, 4000.0, 5.0)
    warm = 20.0 + 20.0 * np.clip((t_s - 300.0) / 2400.0, 0.0, 1.0)
    rate = 180.0 * np.sin(t_s / 40.0)

    def behind(tau_s: float) -> np.ndarray:  # the answer to a ramp that begins at 300 s and ends at 2,700 s
        def ramp(since_s: np.ndarray) -> np.ndarray:
            return np.where(since_s > 0, since_s - tau_s * -np.expm1(-np.maximum(since_s, 0.0) / tau_s), 0.0)

        return 20.0 + (ramp(t_s - 300.0) - ramp(t_s - 2700.0)) / 120.0 - warm

    u = warm - calibration.fitted.model.reference.temperature_c
    scale = 1 + c["scale_factor"] + c["scale_factor_t1"] * u + c["scale_factor_t2"] * u**2
    bias = c["bias"] + c["bias_t1"] * u + c["bias_t2"] * u**2 + c["thermal_lag"] * behind(250.0)
    output = (scale + c["scale_factor_lag"] * behind(400.0)) * rate + bias
    found = Compensator(calibration).compensate(output, warm, {"t_s": t_s}).rate_dps
    assert found == pytest.approx(rate, abs=1e-9)
    assert np.abs(c["scale_factor_lag"] * behind(400.0) * rate).max() > 0.05


@pytest.mark.parametrize("law", ["linear", "three axes", "sine", "direct", "flows"])
def test_an_exported_python_module_keeps_the_same_state(laws: dict[str, Calibration], law: str) -> None:
    calibration = laws[law]
    module: dict[str, Any] = {}
    exec(export_calibration(calibration.to_bytes(), "python")[0], module)
    t_s, warm, raw = trace(calibration)
    state = module["State"]()
    found = [module["correct_with_state"](state, w.tolist(), c, t) for w, c, t in zip(raw, warm, t_s, strict=True)]
    expected = Compensator(calibration).compensate(raw, warm, {"t_s": t_s})
    assert np.array([rates for rates, _ in found]) == pytest.approx(expected.rate_dps, abs=1e-12, nan_ok=True)
    assert [outside for _, outside in found] == expected.outside.tolist()


@pytest.mark.needs_cc
@pytest.mark.parametrize("law", ["linear", "three axes", "sine", "direct", "flows"])
@pytest.mark.parametrize(("real", "tolerance"), [("double", 1e-12), ("float", 5e-3)])
def test_c_corrects_as_python_does(
    laws: dict[str, Calibration], tmp_path: Path, law: str, real: str, tolerance: float
) -> None:
    calibration = laws[law]
    (tmp_path / "calibration.h").write_bytes(export_calibration(calibration.to_bytes(), "c")[0])
    (tmp_path / "main.c").write_text(MAIN.format(name=c_name(calibration.serial)))
    compiler = shutil.which("cc")
    assert compiler is not None
    command = [compiler, "-std=c99", *STRICT, f"-DLABCTL_REAL={real}", "-O1", "main.c"]
    subprocess.run([*command, "-o", "main", "-lm"], cwd=tmp_path, check=True, capture_output=True)
    t_s, warm, raw = trace(calibration)
    rows = np.column_stack([t_s, warm, raw])
    lines = "\n".join(" ".join(f"{value:.17g}" for value in row) for row in rows)
    out = subprocess.run([tmp_path / "main"], input=lines, text=True, check=True, capture_output=True).stdout
    table = np.array([[float(word) for word in line.split()] for line in out.splitlines()])
    found = Compensator(calibration).compensate(raw, warm, {"t_s": t_s})
    assert table[:, 1:] == pytest.approx(found.rate_dps, abs=tolerance, nan_ok=True)
    assert table[:, 0].astype(bool).tolist() == found.outside.tolist()


def test_a_calibration_file_says_how_the_scale_factor_follows(laws: dict[str, Calibration]) -> None:
    state = laws["linear"].document["state"]
    assert "scale * difference * rate" in state["equation"]
    of_scale, of_bias = state["elements"]
    assert of_scale["tau_s"] == 400.0
    assert of_scale["scale"][0] == pytest.approx(2e-4, rel=0.05)
    assert of_scale["size"] == [0.0]
    assert "scale" not in of_bias
    assert "scale * difference * output" in laws["direct"].document["state"]["equation"]


@pytest.mark.parametrize("name", ["px4", "ardupilot"])
def test_a_flight_controller_says_what_it_loses(laws: dict[str, Calibration], name: str) -> None:
    text = export_calibration(laws["three axes"].to_bytes(), name)[0].decode()
    assert "thermal lag of the scale factor at 20" in text
    assert "thermal lag of the bias" in text


@pytest.mark.slow
def test_a_scale_factor_that_lags_is_named_on_a_turning_table_and_found_with_its_u() -> None:
    recording = turned_unit(3, Turned(scale_lag_s=400.0, loops=1))
    points, data, model = based(recording)
    verdict = criticise(recording, model, points=points, full=False).verdict
    assert (verdict.form, verdict.named) == ("missing", ("scale_factor_lag",))
    terms = tuple(verdict.terms[name] for name in verdict.named)
    result = fit_preset(data, with_shapes(data, changed(model, terms), all_of_them=True))
    shape = result.shapes["scale_factor_lag"]["tau_s"]
    assert shape["u"] is not None
    assert abs(shape["value"] - 400.0) < 4 * shape["u"] < 20.0
    assert result.error.noise_floor_dps == pytest.approx(8e-4, rel=0.4)  # the lag is none of the noise
    assert result.error.heldout_rms_dps < 1.2 * result.error.noise_floor_dps
    after = criticise(recording, result.fitted.model, points=points, full=False).verdict
    assert (after.form, after.named) == ("adequate", ())


@pytest.mark.slow
def test_axes_have_time_constants_of_their_own_where_they_differ() -> None:
    recording = turned_unit(4, Turned(scale_lag_s=400.0, axes=("x", "y", "z"), of_axes=(0.6, 1.0, 1.6), loops=1))
    _, data, model = based(recording, ("misalignment",))
    result = fit_preset(data, with_shapes(data, changed(model, (Term("scale_factor_lag"),))))
    found = result.shapes["scale_factor_lag"]
    assert list(found) == ["tau_x_s", "tau_y_s", "tau_z_s"]
    for (_, shape), true_s in zip(found.items(), (240.0, 400.0, 640.0), strict=True):
        assert shape["value"] == pytest.approx(true_s, rel=0.02)


@pytest.mark.parametrize("seed", range(10, 14))
def test_nothing_is_named_where_the_scale_factor_follows_at_once(seed: int) -> None:
    recording = turned_unit(seed, Turned(loops=1))
    points, _, model = based(recording)
    assert criticise(recording, model, points=points, full=False).verdict.form == "adequate"
