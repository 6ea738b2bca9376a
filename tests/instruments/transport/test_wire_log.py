"""The wire log: its file, what is recorded of a real port, and what a replay answers."""

from __future__ import annotations

import gzip
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import serial

from instruments.clock import SystemClock, VirtualClock
from instruments.transport.factory import Ports
from instruments.transport.wire_log.document import Event, event_of, line_of, without_secrets
from instruments.transport.wire_log.log_file import WireLogFile
from instruments.transport.wire_log.record import WireRecord, lines_of
from instruments.transport.wire_log.recorder import WireRecorder
from instruments.transport.wire_log.replay import Replay, ReplayOver
from instruments.transport.wire_log.replayed_links import ReplayedWire
from tests.helpers.paths import ROOT
from tests.helpers.waiting import eventually

HEADER = {"bench": {"name": "b", "token": "s3cret", "table": {"port": "socket://me:pw@host:5001"}}}
KILLED = """
import os, sys
from pathlib import Path
from instruments.transport.wire_log.document import Event
from instruments.transport.wire_log.log_file import WireLogFile
log = WireLogFile(Path(sys.argv[1]), {})
for n in range(1000):
    log.note(Event(float(n), "p", "sent", b"%d" % n))
print("noted", flush=True)
sys.stdin.read()
"""


def documents(file: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in lines_of(file)]


@pytest.mark.parametrize("data", [b"", b"R1 20.5\r\n", b"\x00\xffABC", bytes(range(256)), "°".encode()])
def test_an_event_is_the_same_after_a_line(data: bytes) -> None:
    event = Event(0.1 + 0.2, "/dev/ttyUSB0", "received", data, {"timed_out": True})
    assert event_of(json.loads(line_of(event))) == event


def test_secrets_stay_out_of_the_header(tmp_path: Path) -> None:
    log = WireLogFile(tmp_path / "log.gz", HEADER)
    log.close(0.0)
    bench = documents(log.path)[0]["bench"]
    assert bench == {"name": "b", "token": "removed", "table": {"port": "socket://host:5001"}}
    assert without_secrets({"api_key": None}) == {"api_key": None}
    assert log.path.stat().st_mode & 0o077 == 0


def test_the_file_is_one_of_gzip_and_has_every_event(tmp_path: Path) -> None:
    log = WireLogFile(tmp_path / "log.gz", HEADER)
    for n in range(20_000):
        log.note(Event(n / 8, "p", "arrived", b"\x01" * 100))
    log.close(2500.0, {"state": "done"})
    lines = gzip.decompress(log.path.read_bytes()).splitlines()
    assert len(lines) == 20_002
    assert json.loads(lines[-1]) == {"t_s": 2500.0, "did": "ended", "result": {"state": "done", "left_out": 0}}
    assert log.left_out == 0


def test_a_killed_process_leaves_what_it_noted(tmp_path: Path) -> None:
    file = tmp_path / "log.gz"
    command = [sys.executable, "-c", KILLED, str(file)]
    with subprocess.Popen(command, cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "noted\n"
        eventually(lambda: len(documents(file)) == 1001)
        process.kill()
    assert [each["text"] for each in documents(file)[1:]] == [str(n) for n in range(1000)]
    record = WireRecord(file)
    record.read_to_end()
    assert record.result is None


def test_a_full_disk_ends_the_log_and_nothing_else() -> None:
    log = WireLogFile(Path("/dev/full"), HEADER)
    log.note(Event(0.0, "p", "sent", b"x"))
    log.close(1.0, {})
    assert "cannot be written (No space left on device)" in log.failure


def test_a_disk_that_stands_still_delays_one_event_and_leaves_the_others_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("instruments.transport.wire_log.log_file.STALL_S", 0.001)
    monkeypatch.setattr("instruments.transport.wire_log.log_file.MAX_QUEUED_BYTES", 1000)
    monkeypatch.setattr(WireLogFile, "_run", lambda _: None)  # its thread never writes
    log = WireLogFile(tmp_path / "log.gz", HEADER)
    for n in range(100):
        log.note(Event(float(n), "p", "sent", b"x" * 100))
    assert log.left_out == 100 - 3
    log.close(1.0, {})
    assert documents(log.path)[-1]["result"]["left_out"] == 97


def recorded(tmp_path: Path) -> Path:
    """Record what passes a real port of pyserial, whose far end sends back what it gets."""
    clock = SystemClock()
    log = WireLogFile(tmp_path / "loop.gz", HEADER)
    ports = Ports(clock, wire=WireRecorder(log, clock))
    port = ports.serial("loop://", device="table", baudrate=9600, timeout_s=0.05)
    port.write(b"ONE\r\n")
    assert port.read(3) == b"ONE"
    assert port.in_waiting == 2
    assert port.read(9) == b"\r\n"  # and waits in vain for more
    reader = ports.stream_reader("loop://", port)
    port.write(b"TWO")
    eventually(lambda: port.raw.in_waiting == 0)  # type: ignore[attr-defined]  # the reader's thread has it
    assert reader.take().data == b"TWO"
    reader.close()
    port.close()
    port.close()
    log.close(clock.now_s(), {})
    return log.path


def test_a_real_port_is_recorded(tmp_path: Path) -> None:
    did = [(each["did"], each.get("text", ""), each.get("timed_out")) for each in documents(recorded(tmp_path))[1:-1]]
    assert did == [
        ("opened", "", None), ("sent", "ONE\r\n", None), ("received", "ONE", None), ("received", "\r\n", None),
        ("received", "", True), ("sent", "TWO", None), ("arrived", "TWO", None), ("closed", "", None),
    ]  # fmt: skip


def replayed(file: Path) -> tuple[Replay, Ports]:
    replay = Replay(WireRecord(file), VirtualClock())
    return replay, Ports(replay.clock, wire=ReplayedWire(replay))


def test_the_same_requests_get_the_same_bytes_at_the_same_times(tmp_path: Path) -> None:
    file = recorded(tmp_path)
    replay, ports = replayed(file)
    port = ports.serial("loop://", device="table", baudrate=9600, timeout_s=0.05)
    port.write(b"ON")  # in two pieces
    port.write(b"E\r\n")
    assert port.read(5) == b"ONE\r\n"
    assert port.read(1) == b""
    reader = ports.stream_reader("loop://", port)
    port.write(b"TWO")
    found = reader.take()
    arrived = next(each for each in documents(file) if each.get("did") == "arrived")
    assert found.data == b"TWO"
    assert (found.now_s, found.newest_s, found.width_s) == (arrived["now_s"], arrived["newest_s"], arrived["width_s"])
    assert replay.clock.now_s() == arrived["t_s"]
    port.close()
    assert replay.not_sent() == []


def test_another_request_ends_the_replay_and_is_said(tmp_path: Path) -> None:
    replay, ports = replayed(recorded(tmp_path))
    said = []
    replay.on_over = said.append
    port = ports.serial("loop://", device="table", baudrate=9600, timeout_s=0.05)
    with pytest.raises(
        ReplayOver, match=r"request 1 to loop:// .*: the session sent 'ONE.*', this replay sends 'NOT ONE'"
    ):
        port.write(b"NOT ONE")
    assert [each.request for each in said] == [1]
    with pytest.raises(OSError, match="the replay is over"):
        port.read(1)


def test_a_recorded_failure_fails_again(tmp_path: Path) -> None:
    file = tmp_path / "log.gz"
    log = WireLogFile(file, HEADER)
    log.note(Event(1.0, "/dev/x", "failed", more={"at": "opened", "text_of_error": "busy"}))
    log.note(Event(2.0, "/dev/x", "opened"))
    log.note(Event(3.0, "/dev/x", "failed", more={"at": "received", "text_of_error": "unplugged"}))
    log.close(4.0, {})
    replay, ports = replayed(file)
    with pytest.raises(Exception, match="busy"):
        ports.serial("/dev/x", device="table", baudrate=9600, timeout_s=0.05)
    port = ports.serial("/dev/x", device="table", baudrate=9600, timeout_s=0.05)
    with pytest.raises(OSError, match="unplugged"):
        port.read(1)
    assert replay.clock.now_s() == 3.0
    assert not isinstance(port, serial.SerialBase)
