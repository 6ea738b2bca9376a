"""A point of a figure, computed again from the raw readings, for every motion of it that the figures have."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator

import numpy as np
import pytest
from fastapi.testclient import TestClient

from labctl.recording import Recording
from labctl.services.criticism.comparison import compare_version
from tests.helpers.service import add_recording, open_client
from tests.helpers.simulated_recordings import single_axis

PATH = "/api/units/{}/calibrations/1"


@pytest.fixture(scope="module")
def unit(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[TestClient, Recording, str]]:
    """A service with a unit and a first model of it; the tests only read."""
    recording = single_axis(3, scale_factor_odd=3e-7)
    with open_client(tmp_path_factory.mktemp("points") / "lab.sqlite") as client:
        add_recording(client, recording)
        path = PATH.format(recording.info.serial)
        assert client.post(path.removesuffix("/1"), json={"effects": ["bias", "scale_factor"]}).status_code == 201
        yield client, recording, path


@pytest.mark.parametrize(("figure", "answer"), [("residual", "residuals"), ("comparison", "comparison")])
def test_what_a_figure_shows_is_what_its_readings_give(
    unit: tuple[TestClient, Recording, str], figure: str, answer: str
) -> None:
    client, recording, path = unit
    columns = client.get(f"{path}/{answer}").json()["columns"]
    numbers = np.asarray(recording.columns["dataset"])
    for k in np.random.default_rng(6).choice(len(columns["axis"]), 6, replace=False).tolist():
        dataset, axis = columns["dataset"][k], columns["axis"][k]
        asked = {"recording": 1, "dataset": dataset, "axis": axis, "figure": figure}
        point = client.get(f"{path}/point", params=asked).json()
        readings = np.asarray(recording.columns[f"gyro_{axis}"])[numbers == dataset]
        assert point["recomputed"]["output_dps"] == pytest.approx(readings.mean(), abs=1e-11)
        assert point["shown"]["residual_dps"] == columns["residual_dps"][k]
        assert (point["equal"], point["readings"]) == (True, len(readings))
        assert point["readings_sha256"] == hashlib.sha256(readings.astype("<f8").tobytes()).hexdigest()
        assert point["summary"] == f"Recomputed from {len(readings)} raw readings: equal."


@pytest.mark.slow
def test_the_rate_of_a_residual_is_the_mean_rate(unit: tuple[TestClient, Recording, str]) -> None:
    client, _, path = unit
    residuals, compared = (client.get(f"{path}/{name}").json()["columns"] for name in ("residuals", "comparison"))
    places = [list(zip(each["dataset"], each["axis"], strict=True)) for each in (residuals, compared)]
    order = [places[1].index(place) for place in places[0]]
    for name in ("own_rate_dps", "measured_error_dps"):
        assert residuals[name] == pytest.approx(np.array(compared[name])[order], abs=1e-9)


def test_a_figure_that_is_not_of_these_readings_is_not_called_equal(
    unit: tuple[TestClient, Recording, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    client, _, path = unit

    def spoiled(*asked: object, **options: object) -> object:
        answer = compare_version(*asked, **options)  # type: ignore[arg-type]
        answer.columns.residual_dps[0] += 1e-9
        return answer

    monkeypatch.setattr("labctl.services.criticism.point.compare_version", spoiled)
    columns = client.get(f"{path}/comparison").json()["columns"]
    asked = {"recording": 1, "dataset": columns["dataset"][0], "axis": columns["axis"][0], "figure": "comparison"}
    point = client.get(f"{path}/point", params=asked).json()
    assert point["equal"] is False
    assert point["largest_difference_dps"] == pytest.approx(1e-9, rel=1e-3)
    assert "not equal, the difference is 1e-09 deg/s" in point["summary"]


@pytest.mark.slow
def test_means_without_readings_say_so_and_a_point_that_is_not_there_too(
    unit: tuple[TestClient, Recording, str],
) -> None:
    client, _, path = unit
    made = client.post("/api/recordings/example", json={"name": "osu-fog"}).json()
    other = PATH.format(made["serial"])
    client.post(other.removesuffix("/1"), json={"model": "bias_scale"})
    asked = {"recording": made["recording"], "dataset": 3, "axis": "z", "figure": "comparison"}
    point = client.get(f"{other}/point", params=asked).json()
    assert (point["recomputed"], point["equal"], point["readings"]) == (None, None, 0)
    assert "has means of data sets and no readings" in point["summary"]
    refused = client.get(f"{path}/point", params={"recording": 1, "dataset": 9999, "axis": "z"})
    assert refused.status_code == 404
    assert "has no data set 9999 of recording 1 on axis z; choose one of its points" in refused.json()["detail"]
