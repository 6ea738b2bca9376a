"""A recording at rest, as people have them: several axes, no table, no position, with and without a thermometer."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from labctl.recording import write_recording
from tests.helpers.lab import Lab
from tests.helpers.rest import at_rest


@pytest.fixture
def lab(tmp_path: Path) -> Lab:
    return Lab(tmp_path)


def imported(lab: Lab, **how: object) -> dict[str, object]:
    folder = lab.folder / "recording"
    write_recording(at_rest(**how), folder, "csv")  # type: ignore[arg-type]
    text = (folder / "samples.csv").read_text().splitlines()
    names = text[0].split(",")
    kept = [k for k, name in enumerate(names) if name not in {"table_rate_dps", "position", "run", "mounting"}]
    rows = [",".join(np.array(line.split(","))[kept]) for line in text]
    (folder / "samples.csv").write_text("\n".join(rows) + "\n")
    return lab.json("import", str(folder))


@pytest.mark.slow
def test_a_ramp_in_one_data_set_is_fitted_in_windows_and_left_out_leg_by_leg(lab: Lab) -> None:
    assert imported(lab)["suggested_model"] == "bias_temperature"
    answer = lab.json("fit", "REST-1", "--model", "bias_temperature")
    for k, axis in enumerate("xyz"):
        found = answer["axes"][axis]["coefficients"]
        assert found["bias_t2"]["value"] == pytest.approx(-1e-5 * (k + 1), abs=4 * found["bias_t2"]["u"])
    error = answer["error"]
    assert error["rms_dps"] < 4e-4
    assert error["raw_rms_dps"] > 0.1
    assert [(leg["fitted"], leg["tested"]) for leg in error["heldout_by_leg"]] == [
        ("heating", "cooling"), ("cooling", "heating"), ("all legs but one", "each leg in turn"),
    ]  # fmt: skip
    assert all(leg["rms_dps"] < 5e-4 for leg in error["heldout_by_leg"])
    assert answer["validity"]["rate_dps"] == [None, None]


@pytest.mark.slow
def test_a_leg_left_out_shows_a_lag_that_leaving_out_temperatures_does_not(lab: Lab) -> None:
    imported(lab, axes=("z",), lag_s=400.0)
    error = lab.json("fit", "REST-1", "--model", "bias_temperature")["error"]
    heating = error["heldout_by_leg"][0]
    assert heating["rms_dps"] > 1.5 * error["heldout_rms_dps"]
    found = lab.json("criticise", "REST-1")
    assert found["verdict"] == "missing"
    assert found["named"] == ["thermal_lag"]
    better = lab.json("improve", "REST-1", "--add", "thermal_lag")
    assert better["left_out"] == []
    one_leg_out = better["error"]["heldout_by_leg"][-1]
    assert one_leg_out["rms_dps"] < 1.2 * better["error"]["noise_floor_dps"] < 0.1 * heating["rms_dps"]
    checked = lab.json("verify", "REST-1")
    assert checked["rms_dps"] == pytest.approx(better["error"]["rms_dps"], rel=1e-6)


@pytest.mark.slow
def test_without_a_thermometer_the_bias_is_fitted_criticised_verified_and_improved(lab: Lab) -> None:
    assert imported(lab, thermometer=False)["suggested_model"] == "bias"
    refused = lab.run("fit", "REST-1", "--model", "bias_temperature", status=2)
    assert "bias_temperature needs column 'temperature_c'" in refused.stderr
    answer = lab.json("fit", "REST-1", "--model", "bias")
    assert answer["validity"] == {"temperature_c": [None, None], "rate_dps": [None, None]}
    assert answer["axes"]["y"]["coefficients"]["bias"]["value"] == pytest.approx(0.2, abs=1e-3)
    assert answer["error"]["heldout_rms_dps"] is not None  # an eighth of the time at a time
    found = lab.json("criticise", "REST-1")
    assert found["verdict"] == "adequate"
    needs = {one["effect"]: one["needs"] for one in found["not_testable"]}
    assert "temperature_c" in needs["thermal_lag"]
    assert lab.json("verify", "REST-1")["ok"]
    assert lab.json("improve", "REST-1", "--add", "bias_drift")["model"]["effects"] == ["bias", "bias_drift"]


def test_a_rest_with_a_latitude_needs_the_position(lab: Lab) -> None:
    folder = lab.folder / "recording"
    write_recording(at_rest(), folder, "csv")
    head = (folder / "recording.toml").read_text().replace('motion = "rest"', 'motion = "rest"\nlatitude_deg = 48.0')
    (folder / "recording.toml").write_text(head)
    table = (folder / "samples.csv").read_text().replace("position", "note")
    (folder / "samples.csv").write_text(table)
    refused = lab.run("import", str(folder), status=2)
    assert "column 'position' is missing" in refused.stderr
