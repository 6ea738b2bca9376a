"""HTTP: a log is inspected, and imported by its map; whatever is sent, one problem document."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest
from fastapi.testclient import TestClient

from tests.helpers.written_logs import at_rest, csv_text, moved, resting_ulog

LOGS, PREVIEW = "/api/recordings/logs", "/api/recordings/logs/preview"
GOOD = csv_text(at_rest()).encode()
NAMES = "time (s),gyro_x,gyro_y,gyro_z,temperature (degC)"


def sent(name: str, content: bytes) -> dict[str, tuple[str, bytes]]:
    return {"file": (name, content)}


def test_a_preview_of_a_log_stores_nothing(client: TestClient) -> None:
    seen = client.post(PREVIEW, files=sent("chamber.csv", GOOD)).json()
    assert seen["problems"] == []
    assert (seen["importer"], seen["rows"], seen["motion"], seen["datasets"]) == ("text", 400, "rest", 1)
    assert seen["column_map"]["columns"]["gyro_x"] == {"from": "gyro_x (deg/s)", "unit": "deg/s"}
    assert 'from = "gyro_x (deg/s)"' in seen["map_toml"]
    assert len(seen["first_rows"]) == 8
    assert seen["first_rows"][0][0] == "0.000000"
    trace = next(each for each in seen["traces"] if each["name"] == "gyro_x (deg/s)")
    assert len(trace["x"]) == len(trace["low"]) == 300
    assert any(each["name"] == "turn_deg" and "turn" in each["units"] for each in seen["targets"])
    rate = next(each for each in seen["targets"] if each["name"] == "gyro_z")
    assert rate["aliases"]["dps"] == "deg/s"  # a page lists the unit of a header once
    assert set(rate["aliases"].values()) <= set(rate["units"])
    assert client.get("/api/recordings").json() == []


def test_problems_are_listed_in_a_preview_and_refused_in_an_import(client: TestClient) -> None:
    odd = csv_text(at_rest(), NAMES).encode()
    seen = client.post(PREVIEW, files=sent("odd.csv", odd)).json()
    assert len(seen["problems"]) == 3
    assert seen["motion"] is None
    refused = client.post(LOGS, files=sent("odd.csv", odd))
    assert refused.status_code == 400
    assert refused.json()["type"] == "urn:labctl:problem:bad-file"
    assert refused.json()["problems"] == seen["problems"]
    assert refused.json()["detail"].startswith("odd.csv: column 'gyro_x'")
    assert client.get("/api/recordings").json() == []
    changed = json.dumps({**seen["column_map"], "units": {"gyro": {"unit": "mdps"}}, "serial": "U-9"})
    made = client.post(LOGS, files=sent("odd.csv", odd), data={"column_map": changed, "modified_ms": "1750000000000"})
    assert made.status_code == 201
    assert made.json()["serial"] == "U-9"
    info = client.get("/api/recordings/1").json()["info"]
    assert info["started_at"] > "2026"  # of the import, for order
    assert info["date_known"] is False


def test_a_wrong_unit_of_the_output_is_said_before_the_import(client: TestClient) -> None:
    """The map then states the unit, which leaves no such finding, and the scale factor error to the fit."""
    rows = [
        (0.1 * k, rate_dps, math.radians(1.003 * rate_dps + 0.01 * (-1) ** k), 25.0)
        for k, rate_dps in enumerate(rate for rate in (-60, -30, 0, 30, 60) for _ in range(20))
    ]
    lines = ["t_s,table_rate_dps,gyro_z (dps),temperature (degC)", *(",".join(map(str, row)) for row in rows)]
    file = sent("gyro.csv", "\n".join(lines).encode())
    seen = client.post(PREVIEW, files=file).json()
    (wrong,) = (each for each in seen["warnings"] if each["what"] == "unit")
    assert "near pi/180: the output is in rad/s" in wrong["text"]
    assert "state rad/s as the unit of this output, in the map of the columns" in wrong["text"]
    seen["column_map"]["columns"]["gyro_z"]["unit"] = "rad/s"
    again = client.post(PREVIEW, files=file, data={"column_map": json.dumps(seen["column_map"])}).json()
    assert [each for each in again["warnings"] if each["what"] in {"unit", "scale"}] == []


def test_a_ulog_is_imported_with_an_option(client: TestClient, tmp_path: Path) -> None:
    content = resting_ulog(tmp_path / "log.ulg").read_bytes()
    made = client.post(LOGS, files=sent("log.ulg", content), data={"option": "instance=1"})
    assert made.json()["serial"] == "00ab12cd-1"
    refused = client.post(PREVIEW, files=sent("log.ulg", content), data={"option": "instance=9"})
    assert refused.status_code == 400
    assert "no instance 9" in refused.json()["detail"]


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("a.csv", b"", "the file is empty"),
        ("../../etc/passwd", b"\0\1\2", "passwd: the file is binary (byte 1 is 0x00)"),
        ("a.csv", csv_text(moved()).encode(), "free motion without a reference"),
        (".", b"PK\x03\x04", "log: this is a zip archive"),
    ],
)
def test_what_is_no_log_is_one_problem_without_the_staging_folder(
    client: TestClient, name: str, content: bytes, said: str
) -> None:
    refused = client.post(LOGS, files=sent(name, content))
    assert refused.status_code == 400
    assert said in refused.json()["detail"]
    assert "staging" not in refused.text


@pytest.mark.parametrize("text", ["{", "[[[", '{"columns": 3}', "gyro = 1", "{" * 5000])
def test_a_wrong_map_is_a_problem(client: TestClient, text: str) -> None:
    refused = client.post(PREVIEW, files=sent("a.csv", GOOD), data={"column_map": text})
    assert refused.status_code == 400
    assert refused.json()["detail"].startswith("map: ")


def test_templates_are_downloads(client: TestClient) -> None:
    answer = client.get("/api/recordings/templates/rest")
    assert answer.text.startswith("t (s),gyro_x (deg/s)")
    assert 'filename="rest.csv"' in answer.headers["content-disposition"]
    assert client.get("/api/recordings/templates/flight").status_code == 422
