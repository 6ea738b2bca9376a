"""A point of an Allan deviation, a trace, a mean or a trend, computed again from the raw readings."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from datetime import timedelta
from typing import Any

import allantools
import numpy as np
import pytest
from fastapi.testclient import TestClient

from labctl.recording import Recording
from labctl.services.recordings.traces import trace
from tests.helpers.service import add_recording, open_client
from tests.helpers.simulated_recordings import single_axis
from tests.helpers.static_recordings import resting


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[TestClient, Recording]]:
    """A service with two recordings of a unit, a year apart, and a first model; the tests only read."""
    recording = single_axis(3, scale_factor_odd=3e-7)
    later = recording.info.model_copy(update={"started_at": recording.info.started_at + timedelta(days=365)})
    with open_client(tmp_path_factory.mktemp("points") / "lab.sqlite") as client:
        add_recording(client, recording)
        columns = {**recording.columns, "gyro_z": np.asarray(recording.columns["gyro_z"]) + 0.01}
        add_recording(client, Recording(later, columns, recording.environment))
        path = f"/api/units/{recording.info.serial}/calibrations"
        asked = {"effects": ["bias", "scale_factor"], "recording": 1}
        assert client.post(path, json=asked).status_code == 201
        still = resting(np.random.default_rng(7).normal(0.3, 0.01, 4000), position=np.full(4000, "z"))
        add_recording(client, still)
        yield client, recording


def point_of(client: TestClient, path: str, **asked: Any) -> dict[str, Any]:
    answer = client.get(path, params=asked)
    assert answer.status_code == 200, answer.text
    found: dict[str, Any] = answer.json()
    assert found["equal"] is True, found
    assert found["summary"] == f"Recomputed from {found['readings']} raw readings: equal."
    return found


def digest(readings: Any) -> str:
    return hashlib.sha256(np.asarray(readings, dtype="<f8").tobytes()).hexdigest()


def test_a_point_of_an_allan_deviation_is_that_of_allantools(lab: tuple[TestClient, Recording]) -> None:
    client, _ = lab
    shown = client.get("/api/recordings/3/allan").json()
    axis = shown["axes"]["z"]
    k = 3
    point = point_of(client, "/api/recordings/3/allan/point", axis="z", tau_s=axis["tau_s"][k])
    readings = np.random.default_rng(7).normal(0.3, 0.01, 4000)
    assert point["readings"] == len(readings)
    assert point["readings_sha256"] == digest(readings)
    rate_hz = 1 / axis["tau_s"][0]
    _, (deviation,), _, _ = allantools.oadev(readings, rate=rate_hz, data_type="freq", taus=[8 / rate_hz])
    drawn, low, high, tau, clusters, differences = point["numbers"]
    assert drawn["shown"] == axis["deviation_dps"][k]
    assert drawn["recomputed"] == pytest.approx(deviation, rel=1e-9)
    assert low["recomputed"] < deviation < high["recomputed"]
    assert tau["recomputed"] == pytest.approx(8 / rate_hz)
    assert (clusters["recomputed"], differences["recomputed"]) == (500, 4000 - 2 * 8 + 1)
    root, _, _ = point["formula"].partition(" deg/s")
    squares, twice = (float(part) for part in root.rpartition("sqrt(")[2].partition(")")[0].split(" / "))
    assert np.sqrt(squares / twice) == pytest.approx(deviation, rel=1e-8)


@pytest.mark.slow
@pytest.mark.parametrize("points", [100, 19_000])
def test_a_bin_of_a_trace_is_what_its_readings_give(lab: tuple[TestClient, Recording], points: int) -> None:
    client, recording = lab
    shown = client.get("/api/recordings/1/trace", params={"channel": "gyro_z", "points": points}).json()
    assert shown["raw"] is (points > 10_000)
    for k in np.random.default_rng(4).choice(len(shown["t_s"]), 3, replace=False).tolist():
        asked = {"channel": "gyro_z", "t_s": shown["t_s"][k], "points": points}
        point = point_of(client, "/api/recordings/1/trace/point", **asked)
        mean, least, largest, n = point["numbers"]
        assert (mean["shown"], least["shown"], largest["shown"]) == (shown["mean"][k], shown["min"][k], shown["max"][k])
        assert n["shown"] == n["recomputed"] == shown["n"][k] == point["readings"]
        near = np.abs(np.asarray(recording.columns["t_s"]) - shown["t_s"][k])
        readings = np.asarray(recording.columns["gyro_z"])[np.sort(np.argsort(near, kind="stable")[: shown["n"][k]])]
        if points > 10_000:
            assert point["readings_sha256"] == digest(readings)
        assert mean["recomputed"] == pytest.approx(mean["shown"], rel=1e-6)


def test_a_bin_that_is_not_of_these_readings_is_not_called_equal(
    lab: tuple[TestClient, Recording], monkeypatch: pytest.MonkeyPatch
) -> None:
    client, _ = lab

    def spoiled(*asked: Any) -> Any:
        answer = trace(*asked)
        answer.max[5] += 1e-3
        return answer

    monkeypatch.setattr("labctl.services.recordings.trace_point.trace", spoiled)
    shown = client.get("/api/recordings/1/trace", params={"channel": "gyro_z", "points": 100}).json()
    asked = {"channel": "gyro_z", "t_s": shown["t_s"][5], "points": 100}
    point = client.get("/api/recordings/1/trace/point", params=asked).json()
    assert point["equal"] is False
    assert "not equal, largest reading differs by 0.001 deg/s" in point["summary"]


def test_the_mean_of_a_data_set_is_that_of_its_readings(lab: tuple[TestClient, Recording]) -> None:
    client, recording = lab
    rows = np.asarray(recording.columns["dataset"]) == 7
    for channel in ("gyro_z", "temperature_c"):
        values = np.asarray(recording.columns[channel])[rows]
        point = point_of(client, "/api/recordings/1/datasets/7/mean", channel=channel)
        mean, deviation = point["numbers"]
        assert mean["recomputed"] == pytest.approx(values.mean(), abs=1e-12)
        assert deviation["recomputed"] == pytest.approx(values.std(ddof=1), abs=1e-12)
        assert point["readings_sha256"] == digest(values)
    refused = client.get("/api/recordings/1/datasets/7/mean", params={"channel": "gyro_q"})
    assert refused.status_code == 400
    assert "has no mean of 'gyro_q'; choose one of" in refused.json()["detail"]


@pytest.mark.slow
def test_a_point_of_a_trend_is_a_straight_line_through_the_errors_of_its_readings(
    lab: tuple[TestClient, Recording],
) -> None:
    client, recording = lab
    serial = recording.info.serial
    (_, later) = client.get(f"/api/units/{serial}/trend", params={"version": 1}).json()["points"]
    found = {
        quantity: point_of(
            client, f"/api/units/{serial}/trend/point", recording=2, version=1, axis="z", quantity=quantity
        )
        for quantity in ("bias", "scale_factor", "error", "as_found")
    }
    assert found["bias"]["readings"] == len(recording)
    assert found["bias"]["numbers"][0]["shown"] == later["axes"]["z"]["bias_dps"]
    assert found["scale_factor"]["numbers"][0]["shown"] == later["axes"]["z"]["scale_factor"]
    assert found["error"]["numbers"][0]["shown"] == later["rms_dps"]
    assert found["as_found"]["numbers"][0]["shown"] == later["as_found"]["rms_dps"]
    compared = client.get(f"/api/units/{serial}/calibrations/1/comparison", params={"recording": 2}).json()["columns"]
    slope, bias = np.polyfit(compared["own_rate_dps"], compared["residual_dps"], 1)
    assert found["bias"]["numbers"][0]["recomputed"] == pytest.approx(bias, abs=2e-5)
    assert found["scale_factor"]["numbers"][0]["recomputed"] == pytest.approx(slope, abs=2e-7)
    stated = float(found["bias"]["formula"].rpartition(" = ")[2].partition(" ")[0])
    assert stated == pytest.approx(found["bias"]["numbers"][0]["recomputed"], abs=1e-9)
    refused = client.get(
        f"/api/units/{serial}/trend/point", params={"recording": 9, "version": 1, "axis": "z", "quantity": "bias"}
    )
    assert refused.status_code == 404
    assert "has no recording 9; choose one of its points" in refused.json()["detail"]
