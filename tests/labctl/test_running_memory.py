"""A calibration with a lag and a hysteresis in use: sample by sample, in an array, and in C, the same."""

from __future__ import annotations

import json
import shutil
import subprocess
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from labctl.calibration import Calibration, build_calibration
from labctl.compensator import Compensator, MemoryState
from labctl.errors import BadInput
from labctl.exports import export_calibration
from labctl.exports.c_header import c_name
from labctl.fitting import fit, fit_data_of
from labctl.fitting.effects import Term
from labctl.fitting.estimation.fit import fit_preset
from labctl.fitting.models.presets import changed, preset_for
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


@pytest.fixture(scope="module")
def flows() -> dict[str, Calibration]:
    """Return calibrations with heat flows of every kind: their shape is set, whatever their recording shows."""
    recording = at_rest(("z",), lag_s=400.0)
    shapes = {
        "two flows": {"tau_s": 60.0, "second_tau_s": 1500.0},
        "two ways": {"tau_z_s": 150.0, "cooling_tau_z_s": 900.0},
        "curved": {"tau_s": 300.0, "curved": 1.0},
        "curved, two ways": {"tau_s": 300.0, "cooling_tau_s": 700.0, "curved": 1.0},
    }
    data = fit_data_of(to_points(recording))
    model, _ = preset_for(None, EFFECTS[:2]).build(data)
    return {
        name: build_calibration(
            recording.info, fit_preset(data, changed(model, (Term("thermal_lag", None, shape),))), version=1,
            parent=None, issued_at=recording.info.started_at, provenance={},
        )
        for name, shape in shapes.items()
    }  # fmt: skip


KINDS = ["two flows", "two ways", "curved", "curved, two ways"]


def trace(n: int = 400) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return times at uneven distances, temperatures beyond the calibrated ones too, one not a number, and outputs."""
    rng = np.random.default_rng(4)
    t_s = np.cumsum(rng.uniform(0.01, 30.0, n))
    warm = 30.0 + 45.0 * np.sin(t_s / 700.0) + rng.normal(0, 0.1, n)
    warm[7] = np.nan
    return t_s, warm, rng.normal(0, 0.2, n)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("is_even", [False, True])
def test_samples_one_by_one_in_blocks_and_in_one_array_are_corrected_alike(
    flows: dict[str, Calibration], kind: str, is_even: bool
) -> None:
    t_s, warm, raw = trace()
    if is_even:
        t_s = 1e5 + 0.01 * np.arange(len(t_s))
    whole = Compensator(flows[kind]).compensate(raw, warm, {"t_s": t_s}).rate_dps
    running, blocks = Compensator(flows[kind]), Compensator(flows[kind])
    stepped = [float(running.step(raw[k : k + 1], warm[k], t_s[k])[0][0]) for k in range(len(t_s))]
    cuts = np.split(np.arange(len(t_s)), [1, 8, 100, 101, 390])
    parts = [blocks.compensate(raw[b], warm[b], {"t_s": t_s[b]}, continued=True).rate_dps for b in cuts]
    assert stepped == pytest.approx(whole, abs=1e-12, nan_ok=True)
    assert np.concatenate(parts) == pytest.approx(whole, abs=1e-12, nan_ok=True)


def test_another_process_goes_on_from_the_state(flows: dict[str, Calibration]) -> None:
    t_s, warm, raw = trace()
    first = Compensator(flows["two flows"])
    assert first.state is None
    first.compensate(raw[:200], warm[:200], {"t_s": t_s[:200]}, continued=True)
    assert first.state is not None
    document = json.loads(json.dumps(asdict(first.state)))
    second = Compensator(flows["two flows"])
    second.start(MemoryState(document["t_s"], document["temperature_c"], tuple(document["at_c"])))
    given = raw[200:], warm[200:], {"t_s": t_s[200:]}
    later = second.compensate(*given, continued=True).rate_dps
    assert later == pytest.approx(first.compensate(*given, continued=True).rate_dps, abs=1e-12)
    assert later != pytest.approx(Compensator(flows["two flows"]).compensate(*given).rate_dps, abs=1e-6)
    with pytest.raises(BadInput, match="this calibration has 2 followers"):
        second.start(MemoryState(0.0, 20.0, (20.0,)))
    with pytest.raises(BadInput, match="before"):
        second.compensate(raw[:2], warm[:2], {"t_s": t_s[:2]}, continued=True)
    with pytest.raises(BadInput, match="no state to start from"):
        Compensator(calibrated(at_rest(("z",)), effects=["bias"])).start(MemoryState(0.0, 20.0, ()))


def test_a_calibration_file_says_its_state_equation(flows: dict[str, Calibration], lagging: Calibration) -> None:
    state = flows["two ways"].document["state"]
    assert "d at_c / dt = (T - at_c) / tau" in state["equation"]
    (element,) = state["elements"]
    assert (element["tau_s"], element["cooling_tau_s"]) == (150.0, 900.0)
    kinds = [element["kind"] for element in lagging.document["state"]["elements"]]
    assert kinds[0] == "lag"
    assert set(kinds[1:]) == {"play"}
    assert "state" not in calibrated(at_rest(("z",)), effects=["bias"]).document


@pytest.mark.parametrize("kind", [*KINDS, "lag and hysteresis"])
def test_an_exported_python_module_keeps_the_same_state(
    flows: dict[str, Calibration], lagging: Calibration, kind: str
) -> None:
    calibration = flows.get(kind, lagging)
    module: dict[str, Any] = {}
    exec(export_calibration(calibration.to_bytes(), "python")[0], module)
    t_s, warm, raw = trace()
    state = module["State"]()
    found = [module["correct_with_state"](state, [w], c, t)[0][0] for w, c, t in zip(raw, warm, t_s, strict=True)]
    expected = Compensator(calibration).compensate(raw, warm, {"t_s": t_s}).rate_dps
    assert found == pytest.approx(expected, abs=1e-12, nan_ok=True)
    with pytest.raises(ValueError, match="before the last sample"):
        module["correct_with_state"](state, [0.0], 20.0, 0.0)


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
@pytest.mark.parametrize("kind", [*KINDS, "lag and hysteresis"])
@pytest.mark.parametrize(("real", "tolerance"), [("double", 1e-12), ("float", 2e-5)])
def test_c_remembers_what_python_does(
    flows: dict[str, Calibration], lagging: Calibration, tmp_path: Path, kind: str, real: str, tolerance: float
) -> None:
    lagging = flows.get(kind, lagging)
    assert Compensator(lagging).remembers
    name = c_name(lagging.serial)
    (tmp_path / "calibration.h").write_bytes(export_calibration(lagging.to_bytes(), "c")[0])
    (tmp_path / "main.c").write_text(MAIN.format(name=name))
    compiler = shutil.which("cc")
    assert compiler is not None
    command = [compiler, "-std=c99", "-Wall", "-Wextra", "-Werror", f"-DLABCTL_REAL={real}", "-O1", "main.c"]
    subprocess.run([*command, "-o", "main", "-lm"], cwd=tmp_path, check=True, capture_output=True)
    t_s, warm, raw = trace()
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
    hours -= (hours.min() + hours.max()) / 2  # a coefficient of time counts from the middle of the recording
    assert left["rms_dps"] == pytest.approx(np.sqrt(np.mean((slope * hours) ** 2)), rel=1e-3)


def test_a_long_array_is_that_of_its_parts_and_a_refusal_names_the_sample(flows: dict[str, Calibration]) -> None:
    n = 40_000
    t_s = 1e5 + 0.01 * np.arange(n)
    warm = 30.0 + 20.0 * np.sin(t_s / 70.0)
    warm[21_000] = np.nan
    raw = np.random.default_rng(8).normal(0, 0.2, n)
    for kind in KINDS:
        whole, parts = Compensator(flows[kind]), Compensator(flows[kind])
        found = whole.compensate(raw, warm, {"t_s": t_s}, continued=True)
        halves = [
            parts.compensate(raw[rows], warm[rows], {"t_s": t_s[rows]}, continued=True).rate_dps
            for rows in (slice(0, 17_003), slice(17_003, n))
        ]
        assert np.concatenate(halves) == pytest.approx(found.rate_dps, abs=1e-12, nan_ok=True)
        assert np.flatnonzero(found.outside).tolist() == [21_000]
        assert whole.state is not None
        assert parts.state is not None
        assert whole.state.at_c == pytest.approx(parts.state.at_c, abs=1e-10)
    with pytest.raises(BadInput, match="sample 21001: temperature"):
        Compensator(flows["two ways"], "refuse").compensate(raw, warm, {"t_s": t_s})
