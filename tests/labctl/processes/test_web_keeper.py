"""A web process that does not end when it is asked to is ended, and the log says so."""

from __future__ import annotations

import signal
import socket
from pathlib import Path

import pytest

from labctl.processes import web_keeper
from labctl.processes.children import Child
from labctl.processes.listening import Listening
from labctl.processes.settings import ServeRequest, WebSettings
from labctl.processes.waker import Waker
from labctl.processes.web_keeper import WebKeeper
from labctl.services.campaigns.stop_requests import StopElsewhere

#: A web process that is ready at once, and stands still when it is asked to end.
PROGRAM = """
import signal, sys
from multiprocessing.connection import Connection
line = Connection(int(sys.argv[1]))
signal.signal(signal.SIGTERM, signal.{on_sigterm})
line.recv_bytes()
line.send_bytes(b'value\\n["ready"]')
line.recv_bytes()
"""


@pytest.mark.parametrize(("on_sigterm", "status", "said"), [
    ("SIG_IGN", -signal.SIGKILL, 1),
    ("SIG_DFL", -signal.SIGTERM, 0),
])  # fmt: skip
def test_only_a_process_that_does_not_end_by_itself_is_killed(
    on_sigterm: str, status: int, said: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "a_web_process.py").write_text(PROGRAM.format(on_sigterm=on_sigterm))
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.setattr(web_keeper, "Child", lambda _, pass_fds: Child("a_web_process", pass_fds))
    monkeypatch.setattr(web_keeper, "ENDS_WITHIN_S", 0.5 if said else 60.0)
    logged: list[tuple[str, dict[str, object]]] = []
    monkeypatch.setattr(web_keeper.log, "error", lambda event, **more: logged.append((event, more)))
    with socket.create_server(("127.0.0.1", 0)) as listener:
        at = Listening(listener, "127.0.0.1", "http://127.0.0.1:1")
        settings = WebSettings(ServeRequest(), tmp_path, listener.fileno(), "127.0.0.1")
        keeper = WebKeeper(at, Waker(), lambda: settings, lambda _: StopElsewhere("", stands=True))
        process = keeper._process
        keeper.open()
        keeper.close()
    assert process.status == status
    assert logged == [("child.silent", {"child": "web", "child_pid": process.pid, "asked_to_end": True})] * said
