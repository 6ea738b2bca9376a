"""A calibration with a lag and a hysteresis in use: sample by sample, in an array, and in C, the same."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from labctl.calibration import Calibration
from labctl.compensator import Compensator
from labctl.errors import BadInput
from labctl.exports import export_calibration
from labctl.exports.c_header import c_name
from labctl.fitting import fit, fit_data_of
from labctl.recording import to_points
from tests.helpers.calibrations import calibrated
from tests.helpers.rest import NOISE_DPS, at_rest, loop_course

EFFECTS = ["bias", "bias_temperature", "thermal_lag"]
BOTH = [*EFFECTS, "thermal_hysteresis"]

MAIN = """
#include <stdio.h>
#include "calibration.h"
int main(void) {{
    {name}_state state; double t, c, in; LABCTL_REAL w[1], rate[1];
    {name}_begin(&state);
    while (scanf("%lf %lf %lf", &t, &c, &in) == 3) {{
        w[0] = (LABCTL_REAL)in;
        printf("%d ", {name}_step(&state, w, (LABCTL_REAL)c, t, rate));
        printf("%.17g\\n", (double)rate[0]);
    }}
    return 0;
}}
"""


@pytest.fixture(scope="module")
def lagging() -> Calibration:
    return calibrated(at_rest(("z",), lag_s=400.0), effects=BOTH)


def test_the_time_constant_of_a_lag_is_found_and_kept() -> None:
    found = fit(at_rest(("z",), lag_s=400.0), effects=EFFECTS)
    term = next(term for term in found.fitted.model.terms if term.effect == "thermal_lag")
    assert term.parameters["tau_s"] == pytest.approx(400.0, rel=0.04)
    fitted = found.fitted.axes["z"]
    assert fitted.values[fitted.names.index("thermal_lag"), 0] == pytest.approx(2e-3, rel=0.03)


def test_readings_are_corrected_for_a_lag_as_they_come() -> None:
    calibration = calibrated(at_rest(("z",), lag_s=400.0), effects=EFFECTS)
    later = at_rest(("z",), lag_s=400.0, minutes=80.0, seed=9)
    t_s, warm, raw = (np.asarray(later.columns[name], dtype=np.float64) for name in ("t_s", "temperature_c", "gyro_z"))
    whole = Compensator(calibration).compensate(raw, warm, {"t_s": t_s}).rate_dps
    minutes = whole.reshape(-1, 120).mean(axis=1)
    assert np.sqrt(np.mean(minutes**2)) < 1.5 * NOISE_DPS / np.sqrt(120)
    running = Compensator(calibration)
    stepped = [float(running.step(raw[k : k + 1], warm[k], t_s[k])[0][0]) for k in range(600)]
    assert stepped == pytest.approx(whole[:600], abs=1e-12)


def test_what_remembers_follows_time_and_not_the_number_of_samples(lagging: Calibration) -> None:
    t_s, warm = loop_course(40.0)
    often = Compensator(lagging).compensate(np.zeros(len(t_s)), warm, {"t_s": t_s}).rate_dps
    seldom = Compensator(lagging).compensate(np.zeros(len(t_s[::60])), warm[::60], {"t_s": t_s[::60]}).rate_dps
    assert seldom[:20] == pytest.approx(often[::60][:20], abs=1e-9)  # a straight line is followed exactly


def test_a_sample_without_its_time_or_from_before_is_refused(lagging: Calibration) -> None:
    running = Compensator(lagging)
    with pytest.raises(BadInput, match="give t_s"):
        running.step([0.1], 20.0)
    running.step([0.1], 20.0, 5.0)
    with pytest.raises(BadInput, match="before the last sample"):
        running.step([0.1], 20.0, 4.0)
    running.reset()
    first, _ = running.step([0.1], 20.0, 0.0)
    with pytest.raises(BadInput, match="needs channel 't_s'"):
        Compensator(lagging).compensate(np.array([0.1]), np.array([20.0]))
    again, _ = Compensator(lagging).step([0.1], 20.0, 100.0)
    assert first == pytest.approx(again)


@pytest.mark.needs_cc
@pytest.mark.parametrize(("real", "tolerance"), [("double", 1e-12), ("float", 2e-5)])
def test_c_remembers_what_python_does(lagging: Calibration, tmp_path: Path, real: str, tolerance: float) -> None:
    assert Compensator(lagging).remembers
    name = c_name(lagging.serial)
    (tmp_path / "calibration.h").write_bytes(export_calibration(lagging.to_bytes(), "c")[0])
    (tmp_path / "main.c").write_text(MAIN.format(name=name))
    compiler = shutil.which("cc")
    assert compiler is not None
    command = [compiler, "-std=c99", "-Wall", "-Wextra", "-Werror", f"-DLABCTL_REAL={real}", "-O1", "main.c"]
    subprocess.run([*command, "-o", "main", "-lm"], cwd=tmp_path, check=True, capture_output=True)
    rng = np.random.default_rng(4)
    t_s = np.cumsum(rng.uniform(0.01, 30.0, 400))
    warm = 30.0 + 45.0 * np.sin(t_s / 700.0)  # beyond the calibrated temperatures too
    warm[7] = np.nan
    raw = rng.normal(0, 0.2, 400)
    lines = "\n".join(f"{t:.17g} {c:.17g} {w:.17g}" for t, c, w in zip(t_s, warm, raw, strict=True))
    out = subprocess.run([tmp_path / "main"], input=lines, text=True, check=True, capture_output=True).stdout
    table = np.array([[float(word) for word in line.split()] for line in out.splitlines()])
    found = Compensator(lagging).compensate(raw, warm, {"t_s": t_s})
    assert table[:, 1] == pytest.approx(found.rate_dps, abs=tolerance, nan_ok=True)
    assert table[:, 0].astype(bool).tolist() == found.outside.tolist()


def test_what_is_not_exported_is_said_with_its_size() -> None:
    recording = at_rest(("z",), lag_s=400.0)
    calibration = calibrated(recording, effects=["bias", "bias_temperature", "bias_drift"])
    (left,) = calibration.document["left_out"]
    assert left["effect"] == "bias_drift"
    result = fit(recording, effects=["bias", "bias_temperature", "bias_drift"])
    slope = result.fitted.axes["z"].values[result.fitted.axes["z"].names.index("bias_drift"), 0]
    hours = np.asarray(fit_data_of(to_points(recording)).channels["t_s"]) / 3600.0
    assert left["rms_dps"] == pytest.approx(np.sqrt(np.mean((slope * hours) ** 2)), rel=1e-9)
