"""HTTP: the same answers as the command line, problem documents, tags, and campaigns that can be followed."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from fastapi.testclient import TestClient

from instruments.clock import SystemClock, VirtualClock
from labctl.api import create_app
from labctl.calibration import Calibration
from labctl.exports import FORMATS, Format
from labctl.services import units
from labctl.services.campaigns.bench_runner import BenchRunner
from labctl.services.lab_service import LabService
from labctl.services.planning.loading import load_bench
from labctl.store import Store
from labctl.store.connection.database import Database
from tests.helpers.paths import EXAMPLES
from tests.helpers.plugins import register
from tests.helpers.service import open_client


def upload(client: TestClient, folder: Path, **changed: bytes) -> object:
    content = {path.name: path.read_bytes() for path in folder.iterdir() if path.suffix in {".toml", ".csv"}}
    content |= {name.replace("_", "."): data for name, data in changed.items()}
    return client.post("/api/recordings", files=[("files", (name, data)) for name, data in content.items()])


def with_fog(client: TestClient) -> TestClient:
    assert upload(client, EXAMPLES / "osu-fog").status_code == 201  # type: ignore[attr-defined]
    assert client.post("/api/units/OSU-FOG-2024/calibrations", json={"model": "ojeda2000"}).status_code == 201
    return client


@pytest.fixture
def fog(client: TestClient, shared_answers: Path) -> TestClient:
    return with_fog(client)


@pytest.fixture(scope="module")
def unchanged_fog(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TestClient]:
    """The same service for all requests that are refused: none of them changes it."""
    with open_client(tmp_path_factory.mktemp("fog") / "lab.sqlite") as client:
        yield with_fog(client)


def test_health_and_metrics_describe_an_idle_bench(client: TestClient) -> None:
    body = client.get("/health").json()
    assert body["status"] == "ok"
    assert body["bench"]["name"] == "single-axis-sim"
    assert "labctl_units 0.0" in client.get("/metrics").text
    assert client.get("/openapi.json").json()["info"]["title"] == "labctl"


@pytest.mark.slow
def test_uncertainty_criticism_improve_and_ladder(fog: TestClient) -> None:
    path = "/api/units/OSU-FOG-2024/calibrations/1"
    here = fog.get(f"{path}/uncertainty", params={"rate_dps": 50, "temperature_c": 40}).json()
    assert here["inside"] is True
    along = here["axes"]["z"]
    assert 0 < along["coefficients_dps"] < along["same_run_dps"] < 0.2
    assert along["repeatability_source"] == "none"  # one power-on and no data sheet: unknown for later days, not 0
    assert along["repeatability_dps"] is along["combined_dps"] is along["expanded_dps"] is None
    assert fog.get(f"{path}/uncertainty", params={"rate_dps": 50, "temperature_c": 400}).json()["inside"] is False
    assert fog.get(f"{path}/uncertainty", params={"rate_dps": "nan", "temperature_c": 40}).status_code == 400
    criticism = fog.get(f"{path}/criticism").json()
    assert criticism["verdict"] in {"adequate", "missing", "ambiguous", "unexplained"}
    assert set(criticism["error"]) >= {"rms_dps", "noise_floor_dps", "explained"}
    better = fog.post(f"{path}/improve", json={"add": ["scale_factor_asymmetry"]})
    assert better.status_code == 201
    assert (better.json()["version"], better.json()["parent"]) == (2, 1)
    steps = fog.get("/api/units/OSU-FOG-2024/ladder").json()["steps"]
    assert [step["version"] for step in steps] == [1, 2]
    assert better.json()["error"]["rms_dps"] < better.json()["before"]["rms_dps"]  # both in the forward form
    formula = fog.get(f"{path}/criticism", params={"formula": "odd: __import__('os')"})
    assert formula.status_code == 400
    assert formula.headers["content-type"] == "application/problem+json"


@pytest.mark.slow
def test_the_uncertainty_over_what_was_calibrated_is_that_of_each_place(fog: TestClient) -> None:
    path = "/api/units/OSU-FOG-2024/calibrations/1"
    place = {"rate_dps": 50, "temperature_c": 40}
    assert fog.get(f"{path}/uncertainty", params=place).json()["grid"] is None
    answer = fog.get(f"{path}/uncertainty", params={**place, "grid": True}).json()
    grid, valid = answer["grid"], fog.get(path).json()["validity"]
    low, high = valid["rate_dps"]
    cold, warm = valid["temperature_c"]
    assert grid["rate_dps"] == [low, low / 2, 0, high / 2, high]
    assert grid["temperature_c"] == [cold, (cold + warm) / 2, warm]
    for temperature, row in zip(grid["temperature_c"], grid["axes"]["z"], strict=True):
        for rate, cell in zip(grid["rate_dps"], row, strict=True):
            there = {"rate_dps": rate, "temperature_c": temperature}
            assert fog.get(f"{path}/uncertainty", params=there).json()["axes"]["z"] == cell
            assert cell["expanded_dps"] is None
            assert list(cell["unknown"]) == ["repeatability"]
            assert "one power-on was recorded" in cell["unknown"]["repeatability"]
    assert grid["axes"]["z"][0][0]["same_run_dps"] > grid["axes"]["z"][1][2]["same_run_dps"]


def test_an_unknown_uncertainty_has_its_reason(client: TestClient) -> None:
    assert upload(client, EXAMPLES / "weiss-gyrostar").status_code == 201
    units = "/api/units/WEISS-ENV05S/calibrations"
    assert client.post(units, json={"model": "weiss1995"}).status_code == 201
    place = {"rate_dps": 10, "temperature_c": 25, "grid": True}
    answer = client.get(f"{units}/1/uncertainty", params=place).json()
    cells = [answer["axes"]["z"], *(cell for row in answer["grid"]["axes"]["z"] for cell in row)]
    for cell in cells:
        assert {cell[name] for name in cell if name.endswith("_dps")} == {None}
        assert cell["unknown"]["coefficients"] == "published coefficients come without uncertainties"
        assert set(cell["unknown"]) == {"coefficients", "model", "repeatability"}


@pytest.fixture
def formats_read_again() -> Iterator[None]:
    """Forget the formats that a request of this process has listed, before a test that installs one and after it."""
    units._formats.cache_clear()
    yield
    units._formats.cache_clear()


@pytest.mark.usefixtures("formats_read_again")
def test_a_unit_names_every_format_of_the_registry(fog: TestClient, monkeypatch: pytest.MonkeyPatch) -> None:
    register(monkeypatch, FORMATS, "text", Format("Plain text", "text/plain", "txt", Calibration.to_bytes))
    formats = {each["id"]: each for each in fog.get("/api/units/OSU-FOG-2024").json()["formats"]}
    assert next(iter(formats)) == "json"
    assert {"c", "c-q31", "python", "table-csv", "px4", "ardupilot", "kalibr", "ros2-imu"} < set(formats)
    assert formats["c"] == {"id": "c", "title": "C header", "suffix": "h", "options": {}}
    assert formats["text"] == {"id": "text", "title": "Plain text", "suffix": "txt", "options": {}}
    assert list(formats["px4"]["options"]) == ["device_id", "instance", "tolerance_dps"]
    got = fog.get("/api/units/OSU-FOG-2024/calibration", params={"version": 1, "format": "text"})
    assert got.headers["content-type"].startswith("text/plain")


def test_what_an_export_loses_is_in_the_answer(client: TestClient) -> None:
    assert upload(client, EXAMPLES / "freeimu-warmup").status_code == 201
    unit = "/api/units/FREEIMU-2014"
    assert client.post(f"{unit}/calibrations", json={"model": "bias_temperature"}).status_code == 201
    asked = {"version": 1, "format": "px4"}
    got = client.get(f"{unit}/calibration", params={**asked, "option": ["device_id=77", "tolerance_dps=9"]})
    assert got.status_code == 200
    assert "TC_G0_ID\t77\t6" in got.text
    lost = got.headers.get_list("X-Labctl-Lost")
    assert lost[0] == "scale factor and misalignment are not in this calibration"
    assert all(f"# LOST {line}." in got.text for line in lost)
    plain = client.get(f"{unit}/calibration", params=asked)
    assert plain.headers["etag"] != got.headers["etag"]
    again = client.get(f"{unit}/calibration", params=asked, headers={"If-None-Match": plain.headers["etag"]})
    assert again.status_code == 304
    for options, said in (
        (["imu=1"], "option 'imu' is not known; options of this format: device_id, instance, tolerance_dps"),
        (["device_id"], "option 'device_id': give each option once, as KEY=VALUE"),
    ):
        refused = client.get(f"{unit}/calibration", params={**asked, "option": options})
        assert refused.status_code == 400
        assert said in refused.json()["detail"]
    silent = client.get(f"{unit}/calibration", params={"version": 1, "format": "kalibr"})
    assert "noise_dps_rthz of FREEIMU-2014 is not known" in silent.json()["detail"]


def test_import_fit_certify_fetch(fog: TestClient) -> None:
    unit = fog.get("/api/units/OSU-FOG-2024").json()
    assert unit["calibrations"] == [1]
    assert unit["certified_version"] is None
    refused = fog.get("/api/units/OSU-FOG-2024/calibration")
    assert refused.status_code == 404
    assert refused.headers["content-type"] == "application/problem+json"
    assert refused.json()["type"].endswith("not-certified")
    fog.post("/api/units/OSU-FOG-2024/calibrations/1/certify", json={"by": "A", "reason": "fits", "due_days": 365})
    got = fog.get("/api/units/OSU-FOG-2024/calibration")
    assert got.status_code == 200
    tag = got.headers["etag"]
    assert tag == f'"{got.json()["hash"]}"'
    assert fog.get("/api/units/OSU-FOG-2024/calibration", headers={"If-None-Match": tag}).status_code == 304
    header = fog.get("/api/units/OSU-FOG-2024/calibration", params={"format": "c", "version": 1})
    assert header.text.startswith("/* Calibration of gyro OSU-FOG-2024")
    assert header.headers["etag"] != tag
    rows = fog.get("/api/units/OSU-FOG-2024/calibrations").json()
    assert [(row["version"], row["certified"]) for row in rows] == [(1, True)]
    fog.post("/api/units/OSU-FOG-2024/calibrations/1/revoke", json={"by": "A", "reason": "dropped"})
    assert fog.get("/api/units/OSU-FOG-2024/calibration").status_code == 404


def test_the_fit_is_the_command_lines(fog: TestClient) -> None:
    answer = fog.post("/api/units/OSU-FOG-2024/calibrations", json={"effects": ["bias", "scale_factor"]}).json()
    assert answer["version"] == 2
    expected = {"name": "custom", "effects": ["bias", "scale_factor"], "argument": "rate"}
    assert answer["model"].items() >= expected.items()
    assert set(answer["axes"]["z"]["coefficients"]) == {"bias", "scale_factor"}


@pytest.mark.parametrize(
    ("method", "path", "body", "status", "slug"),
    [
        ("get", "/api/units/NO_SERVICE", None, 404, "not-found"),
        ("get", "/api/recordings/9", None, 404, "not-found"),
        ("get", "/api/campaigns/9", None, 404, "not-found"),
        ("get", "/api/campaigns/9/events", None, 404, "not-found"),
        ("get", "/api/nowhere", None, 404, "http-404"),
        ("post", "/api/units/NO_SERVICE/calibrations", {"model": "ojeda2000"}, 404, "not-found"),
        ("post", "/api/units/OSU-FOG-2024/calibrations", {"model": "x"}, 400, "bad-input"),
        ("post", "/api/units/OSU-FOG-2024/calibrations", {"modell": "x"}, 422, "bad-request"),
        ("post", "/api/units/OSU-FOG-2024/calibrations/1/revoke", {"by": "A", "reason": "B"}, 409, "conflict"),
        ("get", "/api/units/OSU-FOG-2024/calibration?version=1&format=pdf", None, 400, "bad-input"),
        ("post", "/api/campaigns", {"recipe": "no-such"}, 400, "recipe"),
        ("post", "/api/campaigns", {"recipe": "table1-x-table2"}, 400, "plan-refused"),
    ],
)
def test_errors_are_problem_documents(
    unchanged_fog: TestClient, method: str, path: str, body: object, status: int, slug: str
) -> None:
    answer = unchanged_fog.request(method, path, json=body)
    assert answer.status_code == status, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    problem = answer.json()
    assert problem["type"] == f"urn:labctl:problem:{slug}"
    assert problem["status"] == status
    assert problem["detail"]


def test_a_bad_upload_leaves_nothing(client: TestClient) -> None:
    answer = upload(client, EXAMPLES / "osu-fog", points_csv=b"dataset,table_rate_dps\n1,x\n")
    assert answer.status_code == 400  # type: ignore[attr-defined]
    assert answer.json()["detail"].startswith("points.csv: column")  # type: ignore[attr-defined]
    assert client.get("/api/units").json() == []
    evil = client.post("/api/recordings", files=[("files", ("../../evil.toml", b"x"))])
    assert evil.status_code == 400


def followed(client: TestClient, number: int, **headers: str) -> tuple[list[Any], list[Any]]:
    """Return a campaign's events, which have ids, and the pictures of where it stood in between, which have none."""
    with client.stream("GET", f"/api/campaigns/{number}/events", headers=headers) as stream:
        messages = "\n".join(stream.iter_lines()).split("\n\n")
    said = [dict(line.split(": ", 1) for line in message.splitlines()) for message in messages if "data: " in message]
    events = [json.loads(each["data"]) for each in said if "id" in each]
    return events, [json.loads(each["data"]) for each in said if each["event"] == "progress"]


@pytest.mark.slow
def test_a_campaign_runs_and_can_be_followed(client: TestClient) -> None:
    started = client.post("/api/campaigns", json={"recipe": "short"}).json()
    number = started["id"]
    events, pictures = followed(client, number)
    assert events[0]["message"].startswith("campaign running")
    assert events[-1]["message"].startswith("campaign done")
    resumed = events[1]["id"]
    later, _ = followed(client, number, **{"Last-Event-ID": str(resumed)})
    assert [event["id"] for event in later] == [event["id"] for event in events[2:]]
    assert pictures[-1]["state"] == "done"
    assert {"step", "progress", "expected_end", "chamber_c", "gyro_c", "rate_dps", "last_error"} <= set(pictures[0])
    answer = client.get(f"/api/campaigns/{number}").json()
    assert answer["state"] == "done"
    assert answer["progress"] == 1.0
    recording = answer["recordings"]["FOG-0001"]
    shown = client.get(f"/api/recordings/{recording}/samples", params={"dataset": 1, "limit": 5}).json()
    assert shown["readings"] >= 99
    assert len(shown["columns"]["gyro_z"]) == 5


@pytest.mark.slow
def test_a_service_that_starts_again_says_what_was_left(tmp_path: Path) -> None:
    location = str(tmp_path / "lab.sqlite")
    from labctl.services.campaigns.preparation import prepare

    store = Store(Database(location, write=True))
    prepare(store, "short", load_bench("single-axis-sim"), VirtualClock(), clip=False).bench.close()
    with TestClient(create_app(LabService(store, SystemClock()))) as client:
        answer = client.get("/api/campaigns").json()
        assert (answer[0]["state"], answer[0]["abandoned"]) == ("planned", True)
        assert "no process runs the campaign any more" in answer[0]["reason"]
    store = Store(Database(location, write=True))
    runner = BenchRunner(store, load_bench("single-axis-sim"), VirtualClock)
    with TestClient(create_app(LabService(store, SystemClock(), runner))) as client:
        events, _ = followed(client, 1)
        assert "taken_up" in [event["kind"] for event in events]
        assert client.get("/api/campaigns/1").json()["state"] == "done"
        again = client.post("/api/campaigns/1/resume", json={"by": "Ada"})
        assert (again.status_code, "is done and cannot be resumed" in again.json()["detail"]) == (409, True)
