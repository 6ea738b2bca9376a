"""What can be wrong before the first byte, on real ports and sockets: one right line each, and no hang."""

from __future__ import annotations

import errno
import os
import pty
import re
import socket
import struct
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
import serial

from instruments.bench import open_bench
from instruments.bench_config import BenchFile, read_bench
from instruments.clock import VirtualClock
from instruments.errors import LinkError
from instruments.transport import opened_port


def bench_with(section: str, **changes: Any) -> Any:
    """Return a real bench with one instrument changed, opened."""
    record = read_bench("example-real").model_dump()
    record["chamber"] |= {"port": None, "host": "127.0.0.1", "driver": "watlow-f4t"}
    target = record["gyros"][0] if section == "gyro" else record[section]
    target |= changes
    return open_bench(BenchFile.model_validate(record), VirtualClock())


def said_by(section: str, ask: Callable[[Any], object], **changes: Any) -> str:
    """Return the line that an instrument of a bench raises."""
    bench = bench_with(section, **changes)
    device = bench.gyros["fog"] if section == "gyro" else getattr(bench, section)
    with pytest.raises(LinkError) as caught:
        ask(device)
    bench.close()
    assert "\n" not in str(caught.value)
    return str(caught.value)


def identity(device: Any) -> object:
    return device.identify()


PORT_ERRORS = [
    (OSError(errno.EACCES, "Permission denied"), "access to the port: run `sudo usermod -aG dialout $USER`, then"),
    (OSError(errno.EBUSY, "Device or resource busy"), "which other process has it open: run `fuser -v /dev/ttyUSB7`"),
    (serial.SerialException("Could not exclusively lock port"), "which other process has it open: run `fuser -v /dev"),
    (ValueError("Not a valid baudrate: 123"), ("(Not a valid baudrate: 123); check the cable, the "
    "name of the port, and")),
]  # fmt: skip


@pytest.mark.parametrize("section", ["table", "gyro"])
@pytest.mark.parametrize(("error", "text"), PORT_ERRORS, ids=["permission", "busy", "locked", "setting"])
def test_a_port_that_cannot_be_opened(
    monkeypatch: pytest.MonkeyPatch, section: str, error: Exception, text: str
) -> None:
    def refuse(*given: Any, **settings: Any) -> Any:
        raise error

    monkeypatch.setattr(opened_port, "unopened", refuse)
    line = said_by(section, identity, port="/dev/ttyUSB7")
    assert line.startswith("table: port /dev/ttyUSB7 cannot" if section == "table" else "fog: port /dev/ttyUSB7 cannot")
    assert text in line


def test_a_port_that_is_not_there() -> None:
    line = said_by("table", identity, port="/dev/ttyNOTHERE")
    assert "port /dev/ttyNOTHERE cannot be opened" in line
    assert "check the cable and the port's name; " in line


def test_a_port_that_is_a_file(tmp_path: Path) -> None:
    (tmp_path / "port").write_bytes(b"")
    line = said_by("gyro", identity, port=str(tmp_path / "port"))
    assert "cannot be opened" in line
    assert "check the cable, the name of the port, and which other process uses the port" in line


def test_a_port_that_goes_away_while_it_is_read() -> None:
    """A pseudo-terminal whose other end is closed gives EIO, as an adapter does that is pulled out."""
    master, slave = pty.openpty()
    bench = bench_with("gyro", port=os.ttyname(slave))
    gyro = bench.gyros["fog"]
    gyro.start()
    os.close(master)
    os.close(slave)
    with pytest.raises(
        LinkError, match=r"^fog: the link /dev/\S+ broke \(.*\); check the cable; the stream must be star"
    ):
        gyro.read(1.0)
    bench.close()


@contextmanager
def listening(serve: Callable[[socket.socket], None]) -> Iterator[int]:
    """Serve each connection in a thread; yields the port."""
    with socket.create_server(("127.0.0.1", 0)) as server:

        def run() -> None:
            while True:
                try:
                    connection, _ = server.accept()
                except OSError:
                    return
                with connection:
                    serve(connection)

        thread = threading.Thread(target=run, daemon=True)
        thread.start()
        yield server.getsockname()[1]
        server.shutdown(socket.SHUT_RDWR)
    thread.join(5)


def closes(connection: socket.socket) -> None:
    """Close the connection at once."""


def resets(connection: socket.socket) -> None:
    """Reset the connection after the first request."""
    connection.recv(100)
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))


def web(connection: socket.socket) -> None:
    """Answer as a web server does."""
    connection.recv(100)
    connection.sendall(b"HTTP/1.1 400 Bad Request\r\nConnection: close\r\n\r\n<html>Bad Request</html>")


def login(connection: socket.socket) -> None:
    """Greet as a remote shell does, and wait for an answer that makes sense."""
    connection.sendall(b"SSH-2.0-OpenSSH_9.2p1 Debian\r\n")
    connection.recv(100)


SERVERS = [
    (closes, (r"^chamber: cannot read part number \(register 16\), the link was lost.*; check cable "
    r"and power \(3 tries")),
    (resets, (r"^chamber: cannot read part number \(register 16\), the link was lost.*; check cable "
    r"and power \(3 tries")),
    (web, r"^chamber: cannot read .*, an HTTP server answered, not a Modbus instrument; check host and tcp_port"),
    (login, (r"^chamber: cannot read .*, text arrived \(SSH-2.0-OpenSSH_9.2p1 Debian\) instead of a "
    r"Modbus reply; check host and")),
]  # fmt: skip


@pytest.mark.parametrize(("serve", "text"), SERVERS, ids=[serve.__name__ for serve, _ in SERVERS])
def test_another_server_than_a_modbus_instrument(serve: Callable[[socket.socket], None], text: str) -> None:
    with listening(serve) as port:
        line = said_by("chamber", identity, tcp_port=port)
    assert re.search(text, line), line


def test_a_closed_port_is_reported() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    line = said_by("chamber", identity, tcp_port=port)
    assert line.startswith(
        f"chamber: no Modbus TCP instrument answers at 127.0.0.1:{port}; check address, cable and that the instrument "
        "is switched on"
    )
