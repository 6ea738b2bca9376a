"""Versions of a unit's accelerometer and magnetometer over HTTP: kept, listed, fetched as the file that a fit wrote."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient

from labctl.answers.accelerometer import AccelerometerResponse
from labctl.answers.magnetometer import MagnetometerResponse
from labctl.services.accelerometer import Source, accelerometer_of_files
from labctl.services.magnetometer import Source as FieldSource
from labctl.services.magnetometer import magnetometer_of_file
from labctl.services.sensor_exports import export_of
from labctl.services.sensor_versions import measured_data
from tests.helpers.magnetic_turns import fields, readings_of
from tests.helpers.poses_at_rest import poses, readings_in, write_readings
from tests.helpers.service import service_of

UNIT = "/api/units/IMU-7"


@pytest.fixture(scope="module")
def bodies(tmp_path_factory: pytest.TempPathFactory) -> dict[str, dict[str, Any]]:
    """Return requests to keep an accelerometer and a magnetometer, as a program sends them."""
    folder = tmp_path_factory.mktemp("sensors")
    force = Path(write_readings(folder / "a.csv", readings_in(poses(26, 1), 1)))
    field = folder / "m.csv"
    np.savetxt(field, readings_of(fields(600), 1), delimiter=",", header="mag_x,mag_y,mag_z", comments="")
    results = {
        "accelerometer": accelerometer_of_files([force], Source()),
        "magnetometer": magnetometer_of_file(field, FieldSource()),
    }
    paths = {"accelerometer": force, "magnetometer": field}
    return {
        name: {
            "data": measured_data([paths[name]], "as it is").model_dump(mode="json"),
            "result": result.model_dump(mode="json"), "by": "Ada",
        }
        for name, result in results.items()
    }  # fmt: skip


def test_both_sensors_are_kept_listed_and_fetched(client: TestClient, bodies: dict[str, dict[str, Any]]) -> None:
    assert client.get(f"{UNIT}/sensors").status_code == 404
    for name, body in bodies.items():
        for version in (1, 2):
            answer = client.post(f"{UNIT}/sensors/{name}", json=body)
            assert answer.status_code == 201, answer.text
            assert answer.json()["version"] == version
        assert client.get(f"{UNIT}/sensors/{name}").json() == answer.json()
        first = client.get(f"{UNIT}/sensors/{name}?version=1").json()
        assert first["result"] == body["result"]
        assert first["data"] == body["data"]
        assert client.get(f"{UNIT}/sensors/{name}?version=3").status_code == 404
    listed = client.get(f"{UNIT}/sensors").json()
    assert [(each["sensor"], each["version"]) for each in listed] == [
        ("accelerometer", 2), ("accelerometer", 1), ("magnetometer", 2), ("magnetometer", 1),
    ]  # fmt: skip
    assert client.get(UNIT).json()["recordings"] == []
    rows = service_of(client).store.audit.rows()
    assert [row.action for row in rows if row.who == "Ada"] == ["accelerometer version"] * 2 + [
        "magnetometer version"
    ] * 2


def test_a_file_of_a_version_is_that_of_its_fit(client: TestClient, bodies: dict[str, dict[str, Any]]) -> None:
    for name, body in bodies.items():
        client.post(f"{UNIT}/sensors/{name}", json=body).raise_for_status()
        stored = client.get(f"{UNIT}/sensors/{name}").json()
        assert {each["id"] for each in stored["formats"]} >= {"px4", "ardupilot", "json", "python", "c"}
        for each in stored["formats"]:
            answer = client.get(f"{UNIT}/sensors/{name}/file", params={"format": each["id"]})
            result = service_of(client).store.sensor_versions.get("IMU-7", name).result  # type: ignore[arg-type]
            kind = type_of(name)
            assert answer.text == export_of(kind.model_validate(body["result"]), each["id"])
            assert result == body["result"]
    assert client.get(f"{UNIT}/sensors/magnetometer/file?format=kalibr").status_code == 400


def type_of(name: str) -> Any:
    return {"accelerometer": AccelerometerResponse, "magnetometer": MagnetometerResponse}[name]


def test_a_result_that_contradicts_itself_is_refused(client: TestClient, bodies: dict[str, dict[str, Any]]) -> None:
    body = bodies["accelerometer"]
    result = body["result"]
    wrong = {
        "u = 1 where the covariance says": {"bias_g": {**result["bias_g"], "x": {"value": 0.0, "u": 1.0}}},
        "1 of 9 parameters are missing": {"scale_factor": {"x": {"value": 0, "u": 0}, "y": {"value": 0, "u": 0}}},
        "the covariance is not 9 by 9": {"covariance": [[1.0]]},
    }
    for said, change in wrong.items():
        answer = client.post(f"{UNIT}/sensors/accelerometer", json={**body, "result": {**result, **change}})
        assert answer.status_code == 400, answer.text
        assert said in answer.json()["detail"]
    nameless = client.post("/api/units/%20/sensors/accelerometer", json=body)
    assert "give 1 to 64 characters" in nameless.json()["detail"]
    assert client.get(UNIT).status_code == 404  # nothing was stored
