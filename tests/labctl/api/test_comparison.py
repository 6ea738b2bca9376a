"""A version without refitting beside a recording: points are the recording's, lines are the model's, nothing is
refitted."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient

from labctl.calibration import read_calibration
from labctl.error_per_turn import MIN_RATE_DPS
from labctl.fitting.data.channels import Channels, body_rates
from labctl.recording import Recording
from labctl.services.criticism import comparison
from tests.helpers.paths import EXAMPLES
from tests.helpers.recordings import Triaxial
from tests.helpers.service import add_recording, open_client
from tests.helpers.simulated_recordings import single_axis

PATH = "/api/units/SIM-3/calibrations"


@pytest.fixture(scope="module")
def three(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[TestClient, Recording]]:
    """A service with a version of a tri-axial unit and its recording; its tests only read."""
    recording = Triaxial(3).campaign(3)
    with open_client(tmp_path_factory.mktemp("three") / "lab.sqlite") as client:
        add_recording(client, recording)
        assert client.post(PATH, json={"model": "yang2018"}).status_code == 201
        yield client, recording


def compared(client: TestClient, path: str = PATH, **query: Any) -> dict[str, Any]:
    answer = client.get(f"{path}/1/comparison", params=query)
    assert answer.status_code == 200
    found: dict[str, Any] = answer.json()
    return found


def columns_of(answer: dict[str, Any]) -> dict[str, np.ndarray]:
    return {name: np.array(values) for name, values in answer["columns"].items()}


def test_every_data_set_of_every_output_is_there_as_it_was_measured(three: tuple[TestClient, Recording]) -> None:
    client, recording = three
    columns = columns_of(compared(client))
    numbers = np.unique(recording.columns["dataset"])
    for axis in "xyz":
        own = columns["axis"] == axis
        assert sorted(columns["dataset"][own]) == numbers.tolist()
        for k in np.flatnonzero(own):
            here = recording.columns["dataset"] == columns["dataset"][k]
            turned = recording.columns["table_rate_dps"][here][0]
            assert columns["table_rate_dps"][k] == pytest.approx(turned)
            assert columns["position"][k] == recording.columns["position"][here][0]
            true = turned if columns["position"][k] == axis else 0.0
            measured = np.mean(recording.columns[f"gyro_{axis}"][here]) - true
            assert columns["measured_error_dps"][k] == pytest.approx(measured, abs=1e-9)
    assert columns["residual_dps"] == pytest.approx(columns["measured_error_dps"] - columns["modelled_error_dps"])


def test_a_comparison_is_computed_once(three: tuple[TestClient, Recording], monkeypatch: pytest.MonkeyPatch) -> None:
    client, _ = three
    first = compared(client)
    monkeypatch.setattr(comparison, "compare_version", None)
    assert compared(client) == compared(client, recording=1) == first


def test_what_remains_is_what_the_fit_said(three: tuple[TestClient, Recording]) -> None:
    client, _ = three
    said = client.get(f"{PATH}/1").json()["error"]["rms_dps"]
    assert np.sqrt(np.mean(columns_of(compared(client))["residual_dps"] ** 2)) == pytest.approx(said, rel=0.01)


def test_lines_of_nine_panels_are_the_model_at_their_points(three: tuple[TestClient, Recording]) -> None:
    client, recording = three
    answer = compared(client)
    document = client.get("/api/units/SIM-3/calibration", params={"version": 1}).content
    fitted = read_calibration(document).fitted
    assert {(line["axis"], line["position"]) for line in answer["over_rate"]} == {(a, p) for a in "xyz" for p in "xyz"}
    rates = np.unique(recording.columns["table_rate_dps"])
    for kind, line in [("over_rate", line) for line in answer["over_rate"]] + [
        ("over_temperature", line) for line in answer["over_temperature"]
    ]:
        assert len(line["level"]) == line["levels"]
        assert len(line["at"]) >= 60
        for level, drawn in zip(line["level"], line["error_dps"], strict=True):
            at = np.array(line["at"])
            rate, warm = (at, np.full(len(at), level)) if kind == "over_rate" else (np.full(len(at), level), at)
            there = np.full(len(at), line["position"])
            columns = {"temperature_c": warm, "table_rate_dps": rate, "position": there}
            here = Channels(columns, body_rates(rate, there))
            assert drawn == pytest.approx(fitted.error_dps(here, line["axis"]), rel=1e-6, abs=1e-9)
        if kind == "over_rate":
            assert np.all(np.min(np.abs(rates[:, None] - np.array(line["at"])), axis=1) < 1e-9)


def test_before_a_turn_only_the_static_bias_is_taken_off(three: tuple[TestClient, Recording]) -> None:
    client, _ = three
    answer = compared(client)
    assert answer["least_turn_rate_dps"] == MIN_RATE_DPS
    rows = [dict(zip(answer["columns"], row, strict=True)) for row in zip(*answer["columns"].values(), strict=True)]
    own = [row for row in rows if row["axis"] == row["position"] == "y"]
    rest = [row for row in own if abs(row["table_rate_dps"]) < answer["at_rest_dps"]]
    warm, bias = zip(*sorted((row["temperature_c"], row["measured_error_dps"]) for row in rest), strict=True)
    seen = 0
    for row in own:
        fast = abs(row["table_rate_dps"]) >= MIN_RATE_DPS
        assert (row["turn_before_deg"] is not None) == fast
        if fast:
            left = row["measured_error_dps"] - np.interp(row["temperature_c"], warm, bias)
            assert row["turn_before_deg"] == pytest.approx(left * 360 / abs(row["table_rate_dps"]))
            seen += 1
    assert seen
    assert all(row["turn_before_deg"] is None for row in rows if row["axis"] != row["position"])


@pytest.mark.slow
def test_another_recording_is_compared_with_the_version_as_it_is(
    client: TestClient, triaxial: Callable[[int], Any]
) -> None:
    for seed in (3, 4):
        recording = triaxial(seed).campaign(seed)  # another unit's errors, under this one's number
        info = recording.info.model_copy(update={"serial": "SIM-3"})
        add_recording(client, replace(recording, info=info))
    client.post(PATH, json={"model": "yang2018", "recording": 1})
    own, other = (compared(client, recording=number) for number in (1, 2))
    assert (own["fitted_to"], other["fitted_to"]) == (1, 1)
    assert "which the version was not fitted to" in other["source"]
    assert own["over_rate"][0]["error_dps"][0][0] == pytest.approx(other["over_rate"][0]["error_dps"][0][0], abs=0.01)
    refitted = client.get(f"{PATH}/1/residuals", params={"recording": 2}).json()["columns"]["residual_dps"]
    applied = other["columns"]["residual_dps"]
    assert np.sqrt(np.mean(np.square(applied))) > np.sqrt(np.mean(np.square(refitted)))


def test_a_law_of_the_output_leaves_what_its_correction_leaves(client: TestClient) -> None:
    files = [path for path in (EXAMPLES / "osu-fog").iterdir() if path.suffix in {".toml", ".csv"}]
    client.post("/api/recordings", files=[("files", (path.name, path.read_bytes())) for path in files])
    path = "/api/units/OSU-FOG-2024/calibrations"
    said = client.post(path, json={"model": "ojeda2000"}).json()["error"]["rms_dps"]
    answer = compared(client, path)
    assert np.sqrt(np.mean(np.square(answer["columns"]["residual_dps"]))) == pytest.approx(said)
    (line,) = answer["over_rate"]
    assert len(line["level"]) < line["levels"]  # the thermometer never rests there: not every level has a line
    (over_temperature,) = answer["over_temperature"]
    assert min(abs(rate) for rate in over_temperature["level"]) < answer["at_rest_dps"]


def test_a_version_that_is_not_there_is_said_so(three: tuple[TestClient, Recording]) -> None:
    assert three[0].get(f"{PATH}/2/comparison").status_code == 404


@pytest.mark.slow
def test_a_coefficient_has_one_value_in_criticism_preview_and_version(client: TestClient) -> None:
    recording = single_axis(5, saturation=-0.01)
    add_recording(client, recording)
    path = f"/api/units/{recording.info.serial}/calibrations"
    client.post(path, json={"model": "ojeda2000"})
    suspects = client.get(f"{path}/1/criticism").json()["suspects"]
    suspect = next(each for each in suspects if each["effect"] == "saturation")
    assert suspect["coefficients_from"] == "fit"
    shown = suspect["coefficients"]["z"]["saturation"]
    change = {"add": ["saturation"]}
    preview = client.post(f"{path}/1/preview", json=change).json()
    made = client.post(f"{path}/1/improve", json=change).json()
    for answer in (preview, made, client.get(f"{path}/2").json()):
        found = answer["axes"]["z"]["coefficients"]["saturation"]
        assert found["value"] == pytest.approx(shown["value"], rel=1e-6)
        assert found["u"] == pytest.approx(shown["u"], rel=1e-6)
        (term,) = (term for term in answer["model"]["terms"] if term["effect"] == "saturation")
        assert term["parameters"] == pytest.approx(suspect["parameters"])
