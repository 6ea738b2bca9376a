"""The page in place of a web process: it stops, shows what runs, and lets only those stop who may."""

from __future__ import annotations

import hashlib
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx
import pytest

from labctl.stop.latch import StopRequest
from labctl.stop.page import BenchNow, PageAccess, StopPage, write_keys
from tests.helpers.fake_stopping import FakeStopping

HOSTS = frozenset({"127.0.0.1", "localhost"})


@contextmanager
def page(access: PageAccess, stopping: FakeStopping, asked: list[StopRequest]) -> Iterator[httpx.Client]:
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        listener.listen()
        shown = StopPage(
            listener, access, lambda stop: asked.append(stop) or stopping, lambda: BenchNow("Campaign 3 <runs>.")
        )
        shown.start()
        with httpx.Client(base_url=f"http://127.0.0.1:{listener.getsockname()[1]}", timeout=20) as http:
            yield http
        shown.close()


@pytest.fixture
def standing() -> FakeStopping:
    stopping = FakeStopping()
    stopping.heard.set()
    stopping.over.set()
    return stopping


def test_the_page_shows_the_campaign_and_stops_it(standing: FakeStopping) -> None:
    asked: list[StopRequest] = []
    with page(PageAccess(HOSTS), standing, asked) as http:
        shown = http.get("/bench")
        assert (shown.status_code, "Campaign 3 &lt;runs&gt;." in shown.text) == (503, True)
        assert http.get("/api/units").json()["type"] == "urn:labctl:problem:no-web-process"
        assert http.post("/api/units/A/calibrations", json={}).status_code == 503
        assert asked == []
        stopped = http.post("/api/campaigns/3/abort", json={"reason": "smoke", "by": "Ada"})
        assert (stopped.status_code, stopped.json()["stands"]) == (200, True)
        assert http.post("/api/stop", headers={"Accept": "text/html"}).status_code == 200
    assert [(stop.campaign, stop.reason, stop.by) for stop in asked] == [
        (3, "smoke (Ada)", "Ada"),
        (None, "stopped on the page (local)", "local"),
    ]


def test_a_table_that_does_not_stop_is_reported(standing: FakeStopping) -> None:
    standing.stands, standing.text = False, "table to rest: no answer"
    with page(PageAccess(HOSTS), standing, []) as http:
        said = http.post("/api/stop")
        assert (said.status_code, said.json()["type"]) == (503, "urn:labctl:problem:not-stopped")
        assert said.json()["detail"].startswith("NOT STOPPED: table to rest: no answer. Use the stop switch")


@pytest.mark.parametrize("headers", [
    {"Host": "evil.example"}, {"Origin": "http://evil.example"}, {"Sec-Fetch-Site": "cross-site"},
])  # fmt: skip
def test_another_site_stops_nothing(standing: FakeStopping, headers: dict[str, str]) -> None:
    asked: list[StopRequest] = []
    with page(PageAccess(HOSTS), standing, asked) as http:
        assert http.post("/api/stop", headers=headers).status_code == 403
    assert asked == []


def test_where_keys_are_asked_for_an_operator_stops_and_a_viewer_does_not(
    standing: FakeStopping, tmp_path: Path
) -> None:
    asked: list[StopRequest] = []
    digests = {hashlib.sha256(key.encode()).hexdigest(): (key, role) for key, role in
               (("k-op", "operator"), ("k-view", "viewer"))}  # fmt: skip
    write_keys(tmp_path / "keys.json", digests)
    assert (tmp_path / "keys.json").stat().st_mode & 0o777 == 0o600
    with page(PageAccess(HOSTS, tmp_path / "keys.json"), standing, asked) as http:
        assert http.post("/api/stop").status_code == 401
        assert http.post("/api/stop", headers={"Authorization": "Bearer k-view"}).status_code == 401
        assert http.post("/api/stop", headers={"Authorization": "Bearer k-op"}).status_code == 200
    assert [stop.by for stop in asked] == ["k-op"]


def test_garbage_ends_no_page(standing: FakeStopping) -> None:
    asked: list[StopRequest] = []
    with page(PageAccess(HOSTS), standing, asked) as http:
        at = (http.base_url.host, http.base_url.port)
        for sent in (b"\x00\xff\r\n\r\n", b"POST /api/stop HTTP/1.1\r\nContent-Length: x\r\n\r\n", b"GET"):
            with socket.create_connection((at[0], at[1] or 0)) as raw:
                raw.sendall(sent)
        assert http.post("/api/stop").status_code == 200
    assert len(asked) == 1
