"""The web process leaves what is loaded out of garbage collections; asked to end more than once, it ends once."""

from __future__ import annotations

import gc
import signal
import socket
from multiprocessing import Pipe
from pathlib import Path
from types import SimpleNamespace

import pytest
import uvicorn

from labctl import web
from labctl.processes import web_process
from labctl.processes.settings import ServeRequest, WebSettings
from labctl.processes.web_process import until_sigterm


def test_the_first_request_ends_the_block_and_later_ones_interrupt_nothing() -> None:
    reached = []
    with until_sigterm():
        reached.append("serving")
        signal.raise_signal(signal.SIGTERM)
        reached.append("served on")
    signal.raise_signal(signal.SIGTERM)
    reached.append("closed")
    assert reached == ["serving", "closed"]


def test_a_block_that_ends_by_itself_is_not_interrupted_afterwards() -> None:
    with until_sigterm():
        pass
    signal.raise_signal(signal.SIGTERM)
    assert signal.getsignal(signal.SIGTERM) is signal.SIG_IGN


def test_what_is_loaded_when_it_begins_to_serve_is_left_out_of_garbage_collections(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    app: list[object] = []  # stands for all that is loaded: the collector tracks it
    looked_through: list[bool] = []

    def is_looked_through() -> bool:
        return any(each is app for each in gc.get_objects())

    service = SimpleNamespace(store=None, close=lambda: None)
    watch = SimpleNamespace(start=lambda: None)
    monkeypatch.setattr(web_process, "create_service", lambda _: service)
    monkeypatch.setattr(web_process, "access_for", lambda *_: SimpleNamespace(keys=False))
    monkeypatch.setattr(web_process, "create_app", lambda *_: app)
    monkeypatch.setattr(web_process, "SupervisorWatch", lambda *_: watch)
    monkeypatch.setattr(web_process, "_end_with", lambda _: None)
    monkeypatch.setattr(web, "prepare", lambda: None)
    monkeypatch.setattr(uvicorn.Server, "run", lambda *_, **__: looked_through.append(is_looked_through()))
    assert is_looked_through()
    before, line = signal.getsignal(signal.SIGTERM), Pipe()
    settings = WebSettings(ServeRequest(), tmp_path, socket.socket().detach(), "127.0.0.1")
    web_process.serve(line[1], settings)
    signal.signal(signal.SIGTERM, before)
    assert looked_through == [False]
