"""What the supervisor tells the service manager that started it."""

from __future__ import annotations

import socket
from pathlib import Path

import pytest

from labctl.processes import systemd


def test_the_supervisor_tells_its_manager(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.delenv("NOTIFY_SOCKET", raising=False)
    systemd.ready()  # no listener: nothing happens
    address = str(tmp_path / "notify")
    monkeypatch.setenv("NOTIFY_SOCKET", address)
    systemd.ready()  # no listener there either
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as manager:
        manager.bind(address)
        manager.settimeout(5)
        for say, said in ((systemd.ready, b"READY=1"), (systemd.alive, b"WATCHDOG=1")):
            say()
            assert manager.recv(100) == said
        systemd.stopping()
        assert manager.recv(100).startswith(b"STOPPING=1\nWATCHDOG_USEC=")
    monkeypatch.setenv("WATCHDOG_USEC", "60000000")
    assert systemd.period_s() == 20
