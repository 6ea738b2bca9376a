"""Every request has a number, which its answer and every record that it leads to have; a flood fills no disk."""

from __future__ import annotations

import logging
from pathlib import Path

import pytest
from fastapi.testclient import TestClient
from starlette.types import ASGIApp

from labctl.api.connection_limits import ConnectionLimits
from labctl.api.request_log import MAX_REFUSED, RequestFigures, RequestLogMiddleware
from labctl.log.repetition import MAX_FOREIGN
from tests.helpers.bounded_server import bounded_server, request, rest_of
from tests.helpers.log_records import logged


@pytest.mark.slow
def test_an_act_is_one_record_with_the_number_of_its_request(client: TestClient, tmp_path: Path) -> None:
    with logged(tmp_path) as records:
        answer = client.post("/api/campaigns", json={"recipe": "short"}, headers={"X-Request-ID": "mine-1"})
        number = answer.json()["id"]
        client.get(f"/api/campaigns/{number}/events")
        client.get("/api/units?key=labctl_not_to_be_shown")
    assert answer.headers["x-request-id"] == "mine-1"
    (ended,) = records.named("request.ended")  # what only reads is reported at DEBUG
    assert (ended["method"], ended["path"], ended["status"]) == ("POST", "/api/campaigns", 201)
    assert (ended["request_id"], ended["by"], ended["level"]) == ("mine-1", "local", "info")
    (planned,) = records.named("campaign.planned")
    assert (planned["request_id"], planned["campaign"]) == ("mine-1", number)


def test_reading_requests_are_logged_at_debug_level(client: TestClient, tmp_path: Path) -> None:
    with logged(tmp_path, logging.DEBUG) as records:
        client.get("/api/units?key=labctl_not_to_be_shown")
    (ended,) = records.named("request.ended")
    assert (ended["path"], ended["level"]) == ("/api/units", "debug")


@pytest.mark.parametrize("given", ["", "two words", "x" * 65, "a\nb", "<script>"])
def test_a_number_that_is_none_is_replaced(client: TestClient, given: str) -> None:
    numbers = {
        client.get("/health", headers={"X-Request-ID": given.encode()}).headers["x-request-id"] for _ in range(3)
    }
    assert len(numbers) == 3
    assert all(len(number) == 16 for number in numbers)


@pytest.mark.slow
def test_refused_requests_are_bounded_and_counted(client: TestClient, tmp_path: Path) -> None:
    with logged(tmp_path) as records:
        for _ in range(500):
            client.get("/api/units/NO_SERVICE")
    assert len(records.named("request.ended")) == MAX_REFUSED
    assert f"labctl_log_records_held_back_total {500 - MAX_REFUSED}.0" in client.get("/metrics").text


def test_an_error_of_the_program_is_logged_with_its_traceback_and_the_number_of_the_request(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(logging.getLogger("uvicorn"), "propagate", True)  # a server of another test may have ended it

    def numbered(app: ASGIApp) -> ASGIApp:
        return RequestLogMiddleware(app, RequestFigures())

    with (
        logged(tmp_path) as records,
        bounded_server(ConnectionLimits(), log_level="warning", within=numbered) as server,
        server.connect(request("/mistake", "X-Request-ID: r-9", "Connection: close")) as client,
    ):
        assert b" 500 " in rest_of(client)
    ended, traceback = records.all()
    assert (ended["event"], ended["level"], ended["status"], ended["error"]) == (
        "request.ended", "error", 500, "RuntimeError",
    )  # fmt: skip
    assert "a mistake of the program" in traceback["exception"]
    assert {ended["request_id"], traceback["request_id"]} == {"r-9"}


def test_a_flood_of_requests_that_cannot_be_read_is_a_few_records(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(logging.getLogger("uvicorn"), "propagate", True)  # a server of another test may have ended it
    with logged(tmp_path) as records, bounded_server(ConnectionLimits(), log_level="warning") as server:
        for _ in range(200):
            with server.connect(b"NO HTTP AT ALL\r\n\r\n") as client:
                assert b"400" in rest_of(client)
    reported = [each for each in records.all() if each.get("logger") == "uvicorn.error"]
    assert len(reported) == MAX_FOREIGN
    (held_back,) = records.named("log.held_back")
    assert held_back["records"] == 200 - MAX_FOREIGN
