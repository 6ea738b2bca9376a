"""`labctl fit --fixed`: the file, what a version keeps of it, and what later commands make of it."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from instruments.clock import VirtualClock
from labctl.answers.calibrations import FitRequest
from labctl.api import create_app
from labctl.calibration import read_calibration
from labctl.compensator import Compensator
from labctl.errors import BadCalibrationFile, BadInput
from labctl.recording import Recording, write_recording
from labctl.service_connection import ServiceConnection
from labctl.services.campaigns.bench_runner import BenchRunner
from labctl.services.commands.registry import FIT, IMPORT_RECORDING
from labctl.services.commands.remote import HttpExecutor
from labctl.services.commands.requests import RecordingFolder, ToUnit
from labctl.services.fixed_coefficients import read_fixed
from labctl.services.lab_service import LabService
from labctl.services.planning.loading import load_bench
from labctl.store import Store
from labctl.store.connection.database import Database
from tests.helpers.lab import Lab
from tests.helpers.recordings import points
from tests.helpers.service import transport_to

TRUTH = {"bias": 0.2, "bias_t1": 3e-3, "scale_factor": 4e-3}
EFFECTS = "bias,bias_temperature:1,scale_factor"
KNOWN = """
source = "data sheet, page 9"
reference_temperature_c = 25.0
[z]
scale_factor = { value = 0.00401, u = 2e-5, unit = "1" }
bias_t1 = 0.003
"""


def recorded(asymmetry: float = 0.0) -> Recording:
    rng = np.random.default_rng(1)
    rate, warm = np.tile([-100.0, -60.0, -20.0, 0.0, 30.0, 70.0, 100.0], 6), np.repeat(np.arange(0.0, 60.0, 10.0), 7)
    output = rate * 1.004 + 0.2 + 3e-3 * (warm - 25) + asymmetry * np.abs(rate) + rng.normal(0, 1e-3, len(rate))
    recording = points(rate, warm, output, technology="mems", max_rate_dps=100.0)
    n = len(rate)
    return Recording(recording.info, recording.columns | {"gyro_z_std": np.full(n, 1e-2), "n": np.full(n, 100)})


@pytest.fixture
def lab(tmp_path: Path) -> Lab:
    write_recording(recorded(), tmp_path / "recording")
    made = Lab(tmp_path)
    made.run("import", str(tmp_path / "recording"))
    (tmp_path / "known.toml").write_text(KNOWN)
    return made


def fitted(lab: Lab, *more: str) -> Any:
    return lab.json("fit", "ONE", "--effects", EFFECTS, "--fixed", str(lab.folder / "known.toml"), *more)


@pytest.mark.slow
def test_a_fit_holds_the_values_of_the_file_and_says_so(lab: Lab) -> None:
    answer = fitted(lab)
    assert answer["model"]["held"] == {
        "source": "data sheet, page 9",
        "axes": {
            "z": {
                "scale_factor": {"effect": "scale_factor", "value": 0.00401, "u": 2e-5, "unit": "1"},
                "bias_t1": {"effect": "bias_temperature", "value": 0.003, "u": None, "unit": "deg/s/K"},
            }
        },
    }
    coefficients = answer["axes"]["z"]["coefficients"]
    assert coefficients["scale_factor"] == {"value": 0.00401, "u": pytest.approx(2e-5), "unit": "1"}
    assert (coefficients["bias_t1"]["value"], coefficients["bias_t1"]["u"]) == (0.003, None)
    assert coefficients["bias"]["value"] == pytest.approx(0.2, abs=1e-3)
    assert coefficients["bias"]["u"] > 0
    assert answer["reference_temperature_c"] == 25.0
    assert answer["error"]["heldout_rms_dps"] == pytest.approx(1e-3, rel=0.6)
    text = lab.run("fit", "ONE", "--effects", EFFECTS, "--fixed", str(lab.folder / "known.toml")).stdout
    assert "held, axis z       scale_factor, bias_t1" in text
    assert "held values from   data sheet, page 9" in text


def test_the_calibration_file_keeps_what_was_held_under_its_hash(lab: Lab) -> None:
    fitted(lab)
    path = lab.folder / "calibration.json"
    lab.run("calibration", "ONE", "--version", "1", "--out", str(path))
    document = json.loads(path.read_text())
    assert document["model"]["held"]["source"] == "data sheet, page 9"
    assert document["coefficients"]["z"]["bias_t1"]["u"] is None
    assert "held coefficients come without uncertainties (bias_t1)" in document["uncertainty"]["axes"]["z"]["why"]
    assert read_calibration(path).fitted.model.held.of("z", "scale_factor", "scale_factor") is not None
    corrected = Compensator.from_file(path).compensate(np.array([[50 * 1.004 + 0.2]]), np.array([25.0]))
    assert corrected.rate_dps[0, 0] == pytest.approx(50.0, abs=2e-3)
    document["model"]["held"]["axes"]["z"]["bias_t1"]["value"] = 0.0031
    path.write_text(json.dumps(document))
    with pytest.raises(BadCalibrationFile, match="edited or damaged"):
        read_calibration(path)


def test_a_fit_without_the_option_has_no_such_key_in_its_file(lab: Lab) -> None:
    assert lab.json("fit", "ONE", "--effects", EFFECTS)["model"]["held"] is None
    assert "held" not in json.loads(lab.run("calibration", "ONE", "--version", "1").stdout)["model"]


@pytest.mark.slow
def test_a_change_of_the_model_keeps_what_is_held_until_its_effect_is_added_again(lab: Lab) -> None:
    fitted(lab)
    changed = lab.json("improve", "ONE", "--add", "scale_factor_asymmetry")
    assert changed["model"]["held"]["axes"]["z"].keys() == {"scale_factor", "bias_t1"}
    assert changed["axes"]["z"]["coefficients"]["scale_factor"]["value"] == 0.00401
    assert changed["before"]["heldout_rms_dps"] is not None
    less = lab.json("improve", "ONE", "--remove", "scale_factor_asymmetry", "--version", "2")
    assert less["model"]["held"]["axes"]["z"].keys() == {"scale_factor", "bias_t1"}
    freed = lab.json("improve", "ONE", "--add", "scale_factor", "--version", "1")
    assert freed["model"]["held"]["axes"]["z"].keys() == {"bias_t1"}
    assert freed["axes"]["z"]["coefficients"]["scale_factor"]["value"] == pytest.approx(4e-3, abs=1e-5)
    assert {step["version"] for step in lab.json("ladder", "ONE")["steps"]} == {1, 2, 3, 4}


@pytest.mark.slow
def test_a_criticism_takes_what_is_held_as_known(lab: Lab) -> None:
    fitted(lab)
    answer = lab.json("criticise", "ONE")
    assert answer["verdict"] == "adequate"
    assert any("are held at their values (data sheet, page 9)" in sentence for sentence in answer["text"])
    wrong = KNOWN.replace("0.00401, u = 2e-5", "0.00451, u = 2e-6")
    (lab.folder / "known.toml").write_text(wrong)
    fitted(lab)
    answer = lab.json("criticise", "ONE")
    assert answer["verdict"] == "ambiguous"  # the table may be wrong as well
    assert {"scale_factor", "table_rate_ratio"} <= set(answer["named"])
    (suspect,) = (each for each in answer["suspects"] if each["effect"] == "scale_factor")
    assert suspect["coefficients"]["z"]["scale_factor"]["value"] == pytest.approx(-5.1e-4, abs=2e-5)  # off by so much
    assert suspect["rms_after_dps"] == pytest.approx(1e-3, rel=0.3)  # of a fit that estimates it


@pytest.mark.slow
def test_a_calibration_file_holds_all_that_the_new_model_shares_with_it(lab: Lab) -> None:
    first = lab.json("fit", "ONE", "--effects", "bias,scale_factor,bias_temperature:1")
    path = lab.folder / "first.json"
    lab.run("calibration", "ONE", "--version", "1", "--out", str(path))
    second = lab.json("fit", "ONE", "--effects", "bias,bias_temperature:1,scale_factor_asymmetry", "--fixed", str(path))
    held = second["model"]["held"]
    assert held["source"] == f"calibration ONE version 1, sha256 {first['hash']}"
    assert held["axes"]["z"].keys() == {"bias", "bias_t1"}
    for name in ("bias", "bias_t1"):
        before, after = (answer["axes"]["z"]["coefficients"][name] for answer in (first, second))
        assert (after["value"], after["u"]) == (before["value"], pytest.approx(before["u"]))
    assert second["reference_temperature_c"] == first["reference_temperature_c"]
    path.write_text(path.read_text().replace('"version":1', '"version":7'))
    refused = lab.run("fit", "ONE", "--effects", EFFECTS, "--fixed", str(path), status=2).stderr
    assert "edited or damaged" in refused
    lab.run("calibration", "ONE", "--version", "1", "--out", str(path))
    refused = lab.run("fit", "ONE", "--effects", EFFECTS, "--fixed", str(path), status=2).stderr
    assert "all coefficients of model custom are held" in " ".join(refused.split())
    refused = lab.run("fit", "ONE", "--model", "ojeda2000", "--fixed", str(path), status=2).stderr
    assert "belong to a law of the rate" in " ".join(refused.split())


@pytest.mark.slow
def test_over_http_a_fit_is_the_same(lab: Lab, tmp_path: Path) -> None:
    here = fitted(lab)
    store = Store(Database(str(tmp_path / "served.sqlite"), write=True))
    service = LabService(store, VirtualClock(), BenchRunner(store, load_bench("single-axis-sim"), VirtualClock))
    try:
        from fastapi.testclient import TestClient

        inside = TestClient(create_app(service))
        far = HttpExecutor(ServiceConnection("http://testserver", transport=transport_to(inside)))
        far.execute(IMPORT_RECORDING, RecordingFolder(tmp_path / "recording"))
        request = FitRequest(effects=EFFECTS.split(",")).model_copy(
            update={"fixed": read_fixed(tmp_path / "known.toml")}
        )
        there = far.execute(FIT, ToUnit("ONE", request))
        assert there.model.model_dump() == here["model"]
        assert there.axes == here["axes"]
        body = {
            "effects": ["bias", "scale_factor"],
            "fixed": {"z": {"scale_factor": {"value": 0.004, "unit": "deg/s"}}},
        }
        response = inside.post("/api/units/ONE/calibrations", json=body)
        assert response.status_code == 400
        assert "axis z: scale_factor = 0.004 deg/s: the unit of this coefficient is '1'" in response.json()["detail"]
        body["fixed"] = {"z": {"scale_factor": {"value": 0.004, "u": -1}}}
        assert inside.post("/api/units/ONE/calibrations", json=body).status_code == 422
    finally:
        service.close()


@pytest.fixture
def written(tmp_path: Path) -> Iterator[Path]:
    return tmp_path / "known.toml"


WRONG = {
    "w = { bias = 0.1 }": "w = {'bias': 0.1}: is neither an axis (x, y, z) nor one of source",
    "[z]\nbias = inf": "axis z: bias = inf: Input should be a finite number",
    "[z]\nbias = nan": "axis z: bias = nan: Input should be a finite number",
    "[z]\nbias = 1e300": "axis z: bias = 1e+300: Input should be less than or equal to 1000000000000",
    "reference_temperature_c = 1e5": "reference_temperature_c = 100000.0: Input should be less than or equal",
    "[z]\nbias = 'big'": "axis z: bias = 'big': Input should be a valid number",
    "[z]\nbias = true": "axis z: bias = True: Input should be a valid number",
    "[z]\nbias = { value = 1, u = -0.1 }": "axis z: bias, u = -0.1: Input should be greater than or equal to 0",
    "[z]\nbias = { u = 0.1 }": "axis z: bias = {'u': 0.1}: Field required",
    "[z]\nbias = { value = 1, sigma = 1 }": "axis z: bias, sigma = 1: Extra inputs are not permitted",
    "[z]\nbias = { value = [1, 2] }": "value, u and temperature_c must be three lists of the same length",
    "[z]\nbias = { value = [1, 2], u = [1, 1], temperature_c = [9, 3] }": "temperature_c must rise",
    "bias = 1": "bias = 1: is neither an axis",
    "[z": "neither TOML nor a calibration file",
    "a = " + "[" * 90: "more than 32 levels deep",
    '{"schema": 1}': "this version of labctl reads 'labctl-calibration/1'",
}


@pytest.mark.parametrize("text", WRONG, ids=range(len(WRONG)))
def test_a_wrong_file_is_one_clear_error(written: Path, text: str) -> None:
    written.write_text(text)
    with pytest.raises(BadInput) as refused:
        read_fixed(written)
    assert str(refused.value).startswith(str(written))
    assert WRONG[text] in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_file_that_is_not_there_or_too_large_is_one_clear_error(written: Path) -> None:
    with pytest.raises(BadInput, match=r"known\.toml: cannot be read"):
        read_fixed(written)
    written.write_text("#" * (1 << 21))
    with pytest.raises(BadInput, match="larger than 1048576 bytes"):
        read_fixed(written)
