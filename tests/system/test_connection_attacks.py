"""Connections without a key: a campaign runs through all of them, others are answered, and an abort always comes in.

The number of files and of connections are a quarter of those that brought a service down: 1,200 at 1,024 files.
"""

from __future__ import annotations

import re
import socket
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path

import pytest

from tests.helpers.patience import WAIT_S
from tests.helpers.processes import ServiceProcess, running

OPEN_FILES, HALF_SENT = 256, 300
MIB = 1 << 20
#: An endless header is sent no further than this, bytes.
MAX_SENT = 64 * MIB


@pytest.fixture
def service(tmp_path: Path) -> Iterator[ServiceProcess]:
    with running(tmp_path / "lab.sqlite", "--speed", "0", open_files=OPEN_FILES) as made:
        yield made


def connection(service: ServiceProcess, sent: str) -> socket.socket:
    address = service.url.partition("://")[2]
    made = socket.create_connection(("127.0.0.1", int(address.rpartition(":")[2])), timeout=WAIT_S)
    made.sendall(sent.replace("HERE", address).encode())
    return made


def most_memory_mib(service: ServiceProcess) -> float:
    """Return the most memory that the web process has had, MiB."""
    text = Path(f"/proc/{service.web_pid}/status").read_text()
    found = re.search(r"VmHWM:\s+(\d+) kB", text)
    assert found is not None
    return int(found[1]) / 1024


def run_campaign(service: ServiceProcess) -> None:
    """Run a campaign to its end, which must be a good one."""
    campaign = service.http.post("/api/campaigns", json={"recipe": "short"}).json()["id"]
    assert "campaign done" in service.http.get(f"/api/campaigns/{campaign}/events").text


HALVES = {
    "nothing": "",
    "headers": "GET /health HTTP/1.1\r\nHost: HERE\r\nX: ",
    "body": "POST /api/recordings HTTP/1.1\r\nHost: HERE\r\nContent-Type: multipart/form-data; boundary=x\r\n"
    "Content-Length: 1000\r\n\r\n--x",
}


@pytest.mark.parametrize("half", HALVES)
def test_half_sent_requests_take_neither_the_files_nor_the_way_in(service: ServiceProcess, half: str) -> None:
    with ExitStack() as stack:
        for _ in range(HALF_SENT):
            stack.enter_context(connection(service, HALVES[half]))
        assert service.http.get("/health").json()["status"] == "ok"
        run_campaign(service)
        for _ in range(HALF_SENT):
            stack.enter_context(connection(service, HALVES[half]))
        service.run("campaign", "list")
        files = list(Path(f"/proc/{service.process.pid}/fd").iterdir())
        assert len(files) < 0.75 * OPEN_FILES


def test_an_abort_comes_in_among_half_sent_requests(tmp_path: Path) -> None:
    with running(tmp_path / "lab.sqlite", open_files=OPEN_FILES) as service, ExitStack() as stack:
        campaign = service.http.post("/api/campaigns", json={"recipe": "short"}).json()["id"]
        service.wait_for_data_set(campaign)
        for half in HALVES.values():
            for _ in range(HALF_SENT):
                stack.enter_context(connection(service, half))
        service.run("campaign", "abort", str(campaign), "--reason", "enough")
        assert service.http.get(f"/api/campaigns/{campaign}").json()["state"] == "aborted"


def test_an_abort_comes_in_among_watchers(tmp_path: Path) -> None:
    """They are answered, so none is closed for another; who acts has the reserve."""
    with running(tmp_path / "lab.sqlite", open_files=OPEN_FILES) as service, ExitStack() as stack:
        campaign = service.http.post("/api/campaigns", json={"recipe": "short"}).json()["id"]
        watch = f"GET /api/campaigns/{campaign}/events HTTP/1.1\r\nHost: HERE\r\n\r\n"
        watchers = [stack.enter_context(connection(service, watch)) for _ in range(OPEN_FILES // 4)]
        assert all(each.recv(12) == b"HTTP/1.1 200" for each in watchers)
        refused = service.http.get("/api/campaigns", headers={"Connection": "close"})
        assert (refused.status_code, refused.json()["type"]) == (503, "urn:labctl:problem:overloaded")
        assert refused.headers["retry-after"] == "5"
        assert service.http.get("/health").status_code == 200
        answer = service.http.post(f"/api/campaigns/{campaign}/abort", json={"by": "me", "reason": "enough"})
        assert answer.json()["state"] == "aborted", answer.text


def test_headers_that_never_end_and_readers_that_never_read_cost_no_memory(service: ServiceProcess) -> None:
    run_campaign(service)
    before = most_memory_mib(service)
    watch = "GET /api/campaigns/1/events HTTP/1.1\r\nHost: HERE\r\n\r\n"
    with ExitStack() as stack, ThreadPoolExecutor(4) as pool:
        for _ in range(20):
            stack.enter_context(connection(service, watch))
        ends = [pool.submit(send_endless_header, service) for _ in range(4)]
        run_campaign(service)
        assert all(each.result() < MAX_SENT for each in ends)  # the service has closed them
    assert most_memory_mib(service) - before < 30


def send_endless_header(service: ServiceProcess) -> int:
    """Send one header until the service closes the connection; returns how much was sent, bytes."""
    piece = b"a" * 65536
    with connection(service, "GET /health HTTP/1.1\r\nHost: HERE\r\nX: ") as client:
        for sent in range(0, MAX_SENT, len(piece)):
            try:
                client.sendall(piece)
            except OSError:
                return sent
    return MAX_SENT
