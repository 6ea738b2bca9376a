"""The server as a scope of signals: it hears them while it serves, and restores the handlers that it found."""

from __future__ import annotations

import signal
from pathlib import Path
from typing import Any

import pytest
import uvicorn

from instruments.clock import WallClock
from labctl.api.server import ServeRequest, serve_forever
from labctl.services.lab_service import LabService
from labctl.store import open_store
from procedures.execution.signals import ENDING


def handlers() -> dict[signal.Signals, object]:
    return {number: signal.getsignal(number) for number in ENDING}


def test_a_lost_terminal_ends_the_server_and_the_handlers_are_restored(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    exits: list[bool] = []

    def run(server: uvicorn.Server, **_: Any) -> None:
        signal.raise_signal(signal.SIGHUP)
        exits.append(server.should_exit)

    monkeypatch.setattr(uvicorn.Server, "run", run)
    before = handlers()
    serve_forever(ServeRequest(port=0, database=str(tmp_path / "lab.sqlite")), lambda _url: None)
    assert exits == [True]
    assert handlers() == before


def test_a_service_hears_of_signals_until_it_is_closed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ends: list[int] = []
    monkeypatch.setattr(LabService, "end_soon", lambda _: ends.append(1))
    for number in ENDING:
        signal.signal(number, lambda *_: None)
    before = handlers()
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as store:
        service = LabService(store, WallClock())
        service.start()
        signal.raise_signal(signal.SIGTERM)
        assert ends == [1]
        service.close()
    signal.raise_signal(signal.SIGTERM)
    assert ends == [1]
    assert handlers() == before
