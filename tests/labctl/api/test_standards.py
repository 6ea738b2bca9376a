"""The register, check gyros and the environment of the room over HTTP."""

from __future__ import annotations

from datetime import date
from typing import Any

import pytest
from fastapi.testclient import TestClient
from prometheus_client.parser import text_string_to_metric_families

from labctl.answers.validity import CheckGyroRequest
from labctl.services.check_gyros import set_check_gyro
from tests.helpers import register
from tests.helpers.register import COUNTER, noon, thermometer
from tests.helpers.service import service_of

STANDARD = {"label": "Pt100-7", "quantity": "thermometer", "serial": "SN-0815", "by": "M"}
POINT = {"value": 0.01, "expanded": 0.04}


def sent(client: TestClient, path: str, body: dict[str, Any], status: int = 201) -> Any:
    answer = client.post(path, json=body)
    assert answer.status_code == status, answer.text
    return answer.json()


def metric(client: TestClient, name: str, **labels: str) -> float:
    families = {each.name: each for each in text_string_to_metric_families(client.get("/metrics").text)}
    (found,) = [sample.value for sample in families[name].samples if sample.labels == labels]
    return float(found)


def test_a_standard_from_its_entry_to_its_finding(client: TestClient) -> None:
    sent(client, "/api/standards", STANDARD)
    sent(client, "/api/standards", STANDARD, 409)
    body = {"number": "T-1", "laboratory": "DKD", "calibrated": "2024-01-10", "points": [POINT], "by": "M"}
    assert sent(client, "/api/standards/Pt100-7/certificates", body)["predictions"][0]["per_year"] is None
    sent(client, "/api/standards/Pt100-7/certificates", body, 409)
    sent(client, "/api/standards/Pt100-7/certificates", {**body, "points": []}, 422)
    check = {"value": 0.011, "u": 0.01, "by": "T"}
    assert sent(client, "/api/standards/SN-0815/checks", check)["state"] == "valid"
    assert sent(client, "/api/standards/SN-0815/checks", {**check, "value": 0.9})["state"] == "check it"
    assert metric(client, "labctl_standards", state="check it") == 1
    store = service_of(client).store
    register.measured(store, "FOG-B", date(2025, 7, 7), COUNTER, thermometer("T-1"))
    bad = {"bad_from": "2025-04-01", "reason": "broken", "by": "M"}
    sent(client, "/api/standards/Pt100-7/findings", bad)
    assert metric(client, "labctl_standards", state="bad") == 1
    (row,) = client.get("/api/standards/Pt100-7/affected").json()["calibrations"]
    assert (row["serial"], row["version"]) == ("FOG-B", 1)
    assert client.get("/api/standards/Pt100-7/affected?bad_until=2025-01-01").json()["calibrations"] == []
    (version,) = client.get("/api/units/FOG-B/calibrations").json()
    assert "Pt100-7 was found bad" in version["notices"][0]
    assert client.get("/api/units/FOG-B").json()["notices"] == version["notices"]
    withdrawn = sent(client, "/api/standards/Pt100-7/findings/1/withdraw", {"reason": "wrong", "by": "Q"}, 200)
    assert withdrawn["findings"][0]["withdrawn"].startswith("Q, ")
    assert [each["label"] for each in client.get("/api/standards?on=2024-06-01").json()] == ["Pt100-7"]
    assert client.get("/api/standards/none").status_code == 404


@pytest.mark.slow
def test_the_alarm_of_a_check_gyro_is_a_metric(client: TestClient) -> None:
    store = service_of(client).store
    for month in (1, 2):
        register.measured(store, "CHECK-1", date(2025, month, 7), COUNTER)
    asked = CheckGyroRequest(reason="stays", by="Q", temperature_c=25.0)
    set_check_gyro(store, "CHECK-1", asked, noon(date(2025, 3, 1)))
    assert metric(client, "labctl_check_gyros_out_of_limits") == 0
    (found,) = client.get("/api/check-gyros").json()
    assert (found["serial"], found["alarm"], len(found["charts"])) == ("CHECK-1", False, 2)
    assert client.get("/api/check-gyros/CHECK-1").json() == found
    sent(client, "/api/check-gyros/CHECK-1", {"marked": False, "reason": "left", "by": "Q"}, 200)
    assert client.get("/api/check-gyros").json() == []
    path = "/api/comparisons?first=CHECK-1:1&second=CHECK-1:2"
    assert client.get(path).json()["satisfactory"]
    assert client.get("/api/comparisons?first=CHECK-1&second=CHECK-1:2").status_code == 400


def test_a_logger_sends_the_environment_of_the_room(client: TestClient) -> None:
    def record(minute: int, **values: tuple[float, str]) -> dict[str, Any]:
        listed = [{"quantity": name, "value": value, "unit": unit} for name, (value, unit) in values.items()]
        return {"measured_at": f"2026-01-05T08:{minute:02d}:00Z", "values": listed}

    readings = [
        record(0, temperature=(294.15, "K"), pressure=(101.3, "kPa")),
        record(1, temperature=(22.0, "deg C"), humidity=(41.0, "%")),
    ]
    answer = sent(client, "/api/environment", {"readings": readings, "source": "TH-3"})
    assert {each["quantity"]: (each["low"], each["high"], each["readings"]) for each in answer["spans"]} == {
        "temperature": (21.0, 22.0, 2), "humidity": (41.0, 41.0, 1), "pressure": (1013.0, 1013.0, 1),
    }  # fmt: skip
    wrong = [record(2, temperature=(22.0, "deg C")), record(3, temperature=(22.0, "V"))]
    assert "give deg C, K, deg F" in sent(client, "/api/environment", {"readings": wrong, "source": "T"}, 400)["detail"]
    times = "begin=2026-01-05T08:00:00Z&end=2026-01-05T09:00:00Z"
    assert len(client.get(f"/api/environment?{times}").json()["readings"]) == 4  # none of the refused request
    assert client.get("/api/environment?begin=2026-01-05T08:00:00Z&end=2025-01-05T08:00:00Z").status_code == 400
    assert not [row for row in service_of(client).store.audit.rows() if row.action == "environment"]
    sent(client, "/api/environment", {"readings": readings, "source": "TH-3", "by": "T. Technician"})
    (typed,) = [row for row in service_of(client).store.audit.rows() if row.action == "environment"]
    assert typed.who == "T. Technician"


@pytest.mark.parametrize(
    "points",
    [
        [{"nominal": 0.0, "value": 0.01, "expanded": 0.02}, {"nominal": 0.0, "value": 0.5, "expanded": 0.02}],
        [{"nominal": 1.0, "value": 1.0, "u": 1e-200}],
    ],
    ids=["two at 0", "no uncertainty"],
)
def test_points_that_give_no_prediction_are_refused(client: TestClient, points: list[dict[str, float]]) -> None:
    sent(client, "/api/standards", STANDARD)
    sent(client, "/api/standards/Pt100-7/certificates", {
        "number": "T-1", "laboratory": "DKD", "calibrated": "2024-01-10", "points": points, "by": "M",
    }, 422)  # fmt: skip


def test_a_finding_is_of_days_that_were_and_in_one_line(client: TestClient) -> None:
    sent(client, "/api/standards", STANDARD)
    bad = {"bad_from": "2099-01-01", "reason": "broken", "by": "M"}
    assert "day to come" in sent(client, "/api/standards/Pt100-7/findings", bad, 400)["detail"]
    sent(client, "/api/standards/Pt100-7/findings", {**bad, "bad_from": "2024-01-01", "reason": "a\nT-2 valid"}, 422)
    reverse = client.get("/api/standards/Pt100-7/affected?bad_from=2024-05-01&bad_until=2024-01-01")
    assert (reverse.status_code, "exchange them" in reverse.json()["detail"]) == (400, True)


def test_a_temperature_that_is_no_number_is_refused(client: TestClient) -> None:
    register.measured(service_of(client).store, "FOG-B", date(2025, 7, 7), COUNTER, thermometer("T-1"))
    for given in ("nan", "5000"):
        answer = client.get(f"/api/check-gyros/FOG-B?temperature_c={given}")
        assert (answer.status_code, "deg C" in answer.json()["detail"]) == (400, True)
