"""A client that has an answer is not sent it again, and gets the new one as soon as anything of it has changed."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from fastapi import FastAPI, Response
from fastapi.testclient import TestClient
from starlette.responses import StreamingResponse

from labctl.api.routers import recordings
from labctl.api.validators import ValidatorMiddleware, is_known
from tests.helpers.certifying import OVERRIDE
from tests.helpers.recordings import points
from tests.helpers.service import add_recording

RATES = np.linspace(-100.0, 100.0, 21)
UNIT = "/api/units/B-1"
MODEL = {"effects": ["bias", "scale_factor"]}


def measured(client: TestClient, serial: str = "B-1", bias_dps: float = 0.1) -> int:
    """Store a recording of a unit; returns its number."""
    return add_recording(
        client, points(RATES, np.full(21, 25.0), 1.01 * RATES + bias_dps + 0.01 * np.sin(RATES), serial=serial)
    )


@pytest.fixture
def fitted(client: TestClient) -> TestClient:
    measured(client)
    assert client.post(f"{UNIT}/calibrations", json=MODEL).status_code == 201
    return client


def tag_of(client: TestClient, path: str) -> str:
    """Return the ETag of an answer, after a second request that names it was answered without a body."""
    first = client.get(path)
    assert first.status_code == 200, path
    assert first.headers["cache-control"] == "no-cache"
    tag = first.headers["etag"]
    assert tag.startswith('W/"')
    again = client.get(path, headers={"If-None-Match": tag})
    assert (again.status_code, again.content, again.headers["etag"]) == (304, b"", tag), path
    assert "content-length" not in again.headers
    assert "content-type" not in again.headers
    assert client.get(path, headers={"If-None-Match": 'W/"of before"'}).json() == first.json()
    return tag


@pytest.mark.parametrize(
    "path",
    [
        "/api/recordings/1", "/api/recordings/1/datasets",
        f"{UNIT}/calibrations/1", f"{UNIT}/calibrations/1/criticism", f"{UNIT}/calibrations/1/comparison",
        "/api/units?limit=50",
    ],
)  # fmt: skip
def test_an_unchanged_answer_is_sent_once(fitted: TestClient, path: str) -> None:
    tag_of(fitted, path)


@pytest.mark.slow
@pytest.mark.parametrize("path", ["trace?channel=gyro_z&points=50", "inspection"])
def test_what_depends_on_a_recording_alone_is_not_computed_for_a_client_that_has_it(
    ran: TestClient, monkeypatch: pytest.MonkeyPatch, path: str
) -> None:
    address = f"/api/recordings/1/{path}"
    tag = tag_of(ran, address)
    computed: list[int] = []
    for name in ("trace_of", "inspection_of_recording"):
        monkeypatch.setattr(recordings, name, lambda _, recording, *__: computed.append(recording))
    assert ran.get(address, headers={"If-None-Match": tag}).status_code == 304
    assert computed == []


@pytest.mark.slow
def test_a_data_set_that_is_marked_changes_what_shows_the_recording(ran: TestClient, tmp_path: Path) -> None:
    paths = [f"/api/recordings/1/{path}" for path in ("trace?channel=gyro_z&points=50", "inspection", "datasets")]
    before = [tag_of(ran, path) for path in paths]
    assert tag_of(ran, paths[0].replace("50", "60")) != before[0], "another part of it is asked for"
    with closing(sqlite3.connect(tmp_path / "lab.sqlite")) as database, database:
        database.execute("UPDATE data_sets SET state = 'interrupted' WHERE recording_id = 1 AND number = 2")
    after = [ran.get(path, headers={"If-None-Match": tag}) for path, tag in zip(paths, before, strict=True)]
    assert [answer.status_code for answer in after] == [200, 200, 200]
    assert {answer.headers["etag"] for answer in after}.isdisjoint(before)


@pytest.mark.slow
def test_each_data_set_of_a_running_campaign_changes_the_answers_that_show_it(client: TestClient) -> None:
    paths = ("/api/campaigns/{}", "/api/campaigns/{}/plan", "/api/recordings/1/datasets", "/api/recordings/1")
    ids = [client.post("/api/campaigns", json={"recipe": "short"}).json()["id"]]
    client.get(f"/api/campaigns/{ids[0]}/events")  # to its end
    before = [tag_of(client, path.format(ids[0])) for path in paths]
    other = client.post("/api/campaigns", json={"recipe": "short"}).json()["id"]
    client.get(f"/api/campaigns/{other}/events")
    assert [tag_of(client, path.format(ids[0])) for path in paths[1:]] == before[1:], "the first campaign has ended"
    second = [tag_of(client, path) for path in ("/api/recordings/2/datasets", "/api/recordings/2")]
    assert set(second).isdisjoint(before)


def test_a_new_recording_and_a_new_version_change_what_lists_them(fitted: TestClient) -> None:
    paths = (UNIT, f"{UNIT}/calibrations", "/api/recordings", f"{UNIT}/ladder")
    before = [tag_of(fitted, path) for path in paths]
    recording = measured(fitted, bias_dps=0.2)
    with_recording = [tag_of(fitted, path) for path in paths]
    assert [new != old for new, old in zip(with_recording, before, strict=True)] == [True, False, True, False]
    fit = {**MODEL, "recording": recording}
    assert fitted.post(f"{UNIT}/calibrations", json=fit).status_code == 201
    assert fitted.get(UNIT, headers={"If-None-Match": with_recording[0]}).json()["calibrations"] == [1, 2]
    assert tag_of(fitted, paths[1]) != with_recording[1]


def test_a_certification_changes_the_answers_that_state_it(fitted: TestClient) -> None:
    paths = (UNIT, f"{UNIT}/calibrations", f"{UNIT}/calibrations/1")
    before = [tag_of(fitted, path) for path in paths]
    certified = fitted.post(f"{UNIT}/calibrations/1/certify", json={"by": "A. Person", "due_days": 365, **OVERRIDE})
    assert certified.status_code == 200, certified.text
    after = [tag_of(fitted, path) for path in paths]
    assert set(after).isdisjoint(before)
    revoked = fitted.post(f"{UNIT}/calibrations/1/revoke", json={"by": "A. Person", "reason": "the table was loose"})
    assert revoked.status_code == 200, revoked.text
    assert {tag_of(fitted, path) for path in paths}.isdisjoint(after)


@pytest.mark.slow
def test_a_criticism_of_other_data_or_of_another_version_has_another_tag(fitted: TestClient) -> None:
    first = tag_of(fitted, f"{UNIT}/calibrations/1/criticism")
    other = measured(fitted, bias_dps=0.3)
    assert tag_of(fitted, f"{UNIT}/calibrations/1/criticism?recording={other}") != first
    assert tag_of(fitted, f"{UNIT}/calibrations/1/criticism") != first, "by default it is of the newest recording"
    fitted.post(f"{UNIT}/calibrations", json={**MODEL, "recording": 1})
    assert tag_of(fitted, f"{UNIT}/calibrations/2/criticism?recording=1") != first


def test_the_number_of_all_rows_is_part_of_the_answer(fitted: TestClient) -> None:
    path = "/api/units?limit=1"
    before = tag_of(fitted, path)
    measured(fitted, serial="C-1")
    assert fitted.get(path).json()[0]["serial"] == "B-1"
    after = fitted.get(path, headers={"If-None-Match": before})
    assert (after.status_code, after.headers["x-total-count"]) == (200, "2")


def test_head_has_the_tag_of_get(fitted: TestClient) -> None:
    path = f"{UNIT}/calibrations"
    tag = tag_of(fitted, path)
    assert fitted.head(path).headers["etag"] == tag
    assert fitted.head(path, headers={"If-None-Match": tag}).status_code == 304


@pytest.mark.slow
def test_a_followed_criticism_is_tagged_once_it_is_known(fitted: TestClient) -> None:
    path = f"{UNIT}/calibrations/1/criticism/events"
    computed = fitted.get(path)
    assert "event: stage" in computed.text
    assert "etag" not in computed.headers, "a problem could still have ended it"
    known = fitted.get(path)
    tag = known.headers["etag"]
    assert known.text.startswith("event: answer")
    again = fitted.get(path, headers={"If-None-Match": tag})
    assert (again.status_code, again.content) == (304, b"")
    measured(fitted, bias_dps=0.3)
    newer = fitted.get(path, headers={"If-None-Match": tag})
    assert newer.status_code == 200
    assert newer.headers.get("etag") != tag


def test_files_streams_errors_and_acts_keep_their_own_headers(fitted: TestClient) -> None:
    file = fitted.get(f"{UNIT}/calibration?version=1")
    assert file.headers["etag"] == f'"{fitted.get(f"{UNIT}/calibrations/1").json()["hash"]}"'
    assert "etag" not in fitted.get("/api/recordings/1/file?format=csv").headers
    assert "etag" not in fitted.get("/api/recordings/77").headers
    assert "etag" not in fitted.post(f"{UNIT}/calibrations", json=MODEL).headers


def test_a_document_that_comes_in_parts_passes_as_it_is() -> None:
    app = FastAPI()
    app.add_middleware(ValidatorMiddleware)
    app.add_api_route("/api/parts", lambda: StreamingResponse(iter([b"[1", b"]"]), media_type="application/json"))
    app.add_api_route("/api/text", lambda: Response("1", media_type="text/plain"))
    client = TestClient(app)
    parts = client.get("/api/parts")
    assert parts.json() == [1]
    assert "etag" not in parts.headers
    assert "etag" not in client.get("/api/text").headers


@pytest.mark.parametrize(
    ("named", "known"),
    [
        ('W/"1"', True),
        ('"1"', True),
        ('W/"0", W/"1"', True),
        ("*", True),
        ('W/"11"', False),
        ("", False),
        (None, False),
    ],
)
def test_tags_are_compared_whole_and_weakly(named: str | None, known: bool) -> None:
    assert is_known('W/"1"', named) is known
