"""A calibration file alone is enough: corrected rates, flags, a C header that computes the same, static bias, turns."""

from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from labctl.calibration import Calibration, build_calibration, read_calibration
from labctl.compensator import Compensator
from labctl.error_per_turn import error_per_turn, static_bias
from labctl.errors import BadCalibrationFile, BadInput, NotEnoughData
from labctl.exports import export_calibration
from labctl.fitting import Channels, fit
from labctl.recording import Recording

AT = datetime(2026, 1, 5, 8, tzinfo=UTC)
Grid = tuple[np.ndarray, np.ndarray]


def calibrated(recording: Recording, model: str | None = None, effects: list[str] | None = None) -> Calibration:
    result = fit(recording, model, effects)
    return build_calibration(recording.info, result, version=1, parent=None, issued_at=AT, provenance={"recording": 1})


@pytest.fixture
def fog(make_points: Callable[..., Recording], grid_11_by_11: Grid) -> Calibration:
    rate, warm = grid_11_by_11
    rng = np.random.default_rng(1)
    u = (warm - 35) / 10
    output = rate + 0.2 + 0.05 * u + rate * (0.01 + 0.003 * u) - 4e-7 * rate**3 + rng.normal(0, 1e-3, 121)
    return calibrated(make_points(rate, warm, output), "ojeda2000")


@pytest.fixture
def mems(triaxial: Callable[[int], Any]) -> Calibration:
    return calibrated(triaxial(2).campaign(2), "yang2018")


@pytest.fixture(params=["fog", "mems", "plain"])
def any_calibration(request: pytest.FixtureRequest) -> Calibration:
    if request.param == "plain":
        make, (rate, warm) = request.getfixturevalue("make_points"), request.getfixturevalue("grid_11_by_11")
        output = rate * (1.01 + 1e-4 * (warm - 30)) + 0.1 + 0.01 * (warm - 30)
        return calibrated(make(rate, warm, output), "bias_scale")
    return request.getfixturevalue(request.param)  # type: ignore[no-any-return]


def inside(calibration: Calibration, n: int = 500) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(3)
    (low, high), (slow, fast) = calibration.temperature_c, calibration.rate_dps
    return rng.uniform(slow, fast, (n, len(calibration.axes))) * 0.9, rng.uniform(low, high, n)


def test_every_fast_way_agrees_with_the_model(any_calibration: Calibration) -> None:
    raw, warm = inside(any_calibration)
    found = Compensator(any_calibration).compensate(raw, warm)
    outputs = {axis: raw[:, i] for i, axis in enumerate(any_calibration.axes)}
    expected = any_calibration.fitted.compensate(outputs, Channels({"temperature_c": warm}, outputs))
    for i, axis in enumerate(any_calibration.axes):
        assert found.rate_dps[:, i] == pytest.approx(expected[axis], abs=1e-10)
    assert not found.outside.any()


def test_sample_by_sample_is_the_same_as_arrays(any_calibration: Calibration) -> None:
    raw, warm = inside(any_calibration, 20)
    compensator = Compensator(any_calibration)
    whole = compensator.compensate(raw, warm)
    for row in range(20):
        rate, outside = compensator.step(raw[row], warm[row])
        assert rate == pytest.approx(whole.rate_dps[row], abs=1e-12)
        assert not outside


def test_yang_undoes_k_and_b(mems: Calibration, triaxial: Callable[[int], Any]) -> None:
    unit = triaxial(2)
    true = np.array([120.0, -35.0, 300.0])
    for warm in (-38.0, 3.0, 47.0):
        output = unit.k(warm) @ true + unit.bias(warm)
        rate, _ = Compensator(mems).step(output, warm)
        assert rate == pytest.approx(true, abs=0.02)
        assert np.max(np.abs(output - true)) > 1.0


def test_outside_is_flagged_or_refused_never_silent(fog: Calibration) -> None:
    clamp, refuse = Compensator(fog), Compensator(fog, outside="refuse")
    raw = np.array([10.0, 10.0, 500.0, np.nan, 10.0])
    warm = np.array([35.0, 60.0, 35.0, 35.0, np.nan])
    found = clamp.compensate(raw, warm)
    assert found.outside.tolist() == [False, True, True, True, True]
    assert found.rate_dps[1] == pytest.approx(clamp.compensate(raw[:1], np.array([45.0])).rate_dps[0])
    assert np.isnan(found.rate_dps[3])
    with pytest.raises(BadInput, match=r"sample 2: temperature \[60.0\] deg C outside 25 to 45 deg C"):
        refuse.compensate(raw[:2], warm[:2])
    with pytest.raises(BadInput, match=r"sample 1: rate \[500.0\] deg/s outside"):
        refuse.compensate(raw[2:3], warm[2:3])


def test_volts_are_converted_first(make_points: Callable[..., Recording], grid_11_by_11: Grid) -> None:
    rate, warm = grid_11_by_11
    volts = 2.5 + 0.022 * (1.01 * rate)
    recording = make_points(rate, warm, volts, output={"z": {"unit": "V", "offset": 2.5, "scale": 0.022}})
    compensator = Compensator(calibrated(recording, effects=["scale_factor"]))
    found = compensator.compensate_output(volts, warm)
    assert found.rate_dps == pytest.approx(rate, abs=1e-9)


def test_the_file_survives_the_way_to_disk(any_calibration: Calibration, tmp_path: Path) -> None:
    path = tmp_path / "calibration.json"
    path.write_bytes(any_calibration.to_bytes())
    back = read_calibration(path)
    assert back.hash == any_calibration.hash
    assert back.to_bytes() == any_calibration.to_bytes()


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (lambda text: text.replace('"version":1', '"version":7'), "was edited or damaged"),
        (lambda text: text[: len(text) // 2], "cut short"),
        (lambda text: text.replace("labctl-calibration/1", "labctl-calibration/9"), "this labctl reads"),
        (lambda _: "[]", "schema None"),
    ],
)
def test_a_spoilt_file_is_refused(fog: Calibration, tmp_path: Path, spoil: Callable[[str], str], said: str) -> None:
    path = tmp_path / "calibration.json"
    path.write_text(spoil(fog.to_bytes().decode()))
    with pytest.raises(BadCalibrationFile, match=said):
        Compensator.from_file(path)


def test_only_what_belongs_to_the_unit_leaves_the_house(fog: Calibration, mems: Calibration) -> None:
    assert fog.document["left_out"] == []
    assert {effect["effect"] for effect in mems.document["model"]["terms"]} == {"bias", "scale_factor", "misalignment"}
    assert json.loads(mems.to_bytes())["papers"]["yang2018"][0].keys() >= {"Kxx", "Kxy", "Kyx", "Bz", "temperature_c"}


MAIN = """
#include <stdio.h>
#include "calibration.h"
int main(void) {{
    double in[{axes}], t; LABCTL_REAL w[{axes}], rate[{axes}]; int a;
    while (scanf("%lf", &t) == 1) {{
        for (a = 0; a < {axes}; a++) {{ if (scanf("%lf", &in[a]) != 1) return 1; w[a] = (LABCTL_REAL)in[a]; }}
        printf("%d", {name}_correct(w, (LABCTL_REAL)t, rate));
        for (a = 0; a < {axes}; a++) printf(" %.17g", (double)rate[a]);
        printf("\\n");
    }}
    return 0;
}}
"""


@pytest.mark.needs_cc
@pytest.mark.parametrize(("real", "tolerance"), [("double", 1e-11), ("float", 2e-3)])
def test_the_c_header_computes_the_same(
    any_calibration: Calibration, tmp_path: Path, real: str, tolerance: float
) -> None:
    content, media_type = export_calibration(any_calibration.to_bytes(), "c")
    assert media_type == "text/x-c"
    (tmp_path / "calibration.h").write_bytes(content)
    name = next(
        line.split()[1] for line in content.decode().splitlines() if line.endswith(f"_AXES {len(any_calibration.axes)}")
    )
    source = MAIN.format(axes=len(any_calibration.axes), name=name.removesuffix("_AXES"))
    (tmp_path / "main.c").write_text(source)
    compiler = shutil.which("cc")
    assert compiler is not None
    command = [
        compiler,
        "-std=c99",
        "-Wall",
        "-Wextra",
        "-Werror",
        f"-DLABCTL_REAL={real}",
        "-O1",
        "main.c",
        "-o",
        "main",
    ]
    subprocess.run(command, cwd=tmp_path, check=True, capture_output=True)
    raw, warm = inside(any_calibration, 200)
    warm = np.append(warm, [any_calibration.temperature_c[1] + 50])
    raw = np.vstack([raw, raw[:1]])
    lines = "\n".join(f"{t:.17g} " + " ".join(f"{v:.17g}" for v in row) for t, row in zip(warm, raw, strict=True))
    out = subprocess.run([tmp_path / "main"], input=lines, text=True, check=True, capture_output=True).stdout
    table = np.array([[float(word) for word in line.split()] for line in out.splitlines()])
    expected = Compensator(any_calibration).compensate(raw, warm)
    assert table[:, 1:] == pytest.approx(expected.rate_dps, abs=tolerance)
    assert table[:-1, 0].sum() == 0
    assert table[-1, 0] == 1


def test_unknown_formats_are_named(fog: Calibration) -> None:
    with pytest.raises(BadInput, match="format 'pdf' is not known"):
        export_calibration(fog.to_bytes(), "pdf")


def test_error_per_turn_is_error_times_time() -> None:
    assert error_per_turn(np.array([0.1, 0.1]), np.array([10.0, -90.0])) == pytest.approx([3.6, 0.4])
    with pytest.raises(BadInput, match="rate 4 deg/s"):
        error_per_turn(np.array([0.1]), np.array([4.0]))


def test_static_bias_says_how_well_it_is_known() -> None:
    rng = np.random.default_rng(1)
    at_rest = 0.02 + rng.normal(0, 0.0044, 100)
    found = static_bias(at_rest, instability_dps=0.002)
    assert found.bias_dps == pytest.approx(0.02, abs=3 * found.u_dps)
    assert found.u_dps == pytest.approx(np.hypot(0.00044, 0.002), rel=0.1)
    with pytest.raises(NotEnoughData, match="at least 10"):
        static_bias(at_rest[:5])
