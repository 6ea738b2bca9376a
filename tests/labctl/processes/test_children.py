"""What a child process says while it starts: that it is ready, why it does not begin, or what no process should say."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from instruments.clock import WallClock
from labctl.errors import LabctlError
from labctl.processes.children import Child, Failed
from labctl.processes.documents import BadDocument
from labctl.processes.settings import BenchSettings

#: A child that reads its settings and says what stands in the place of them, then waits for the end of the line.
PROGRAM = """
import sys
from multiprocessing.connection import Connection
line = Connection(int(sys.argv[1]))
settings = line.recv_bytes()
{act}
try:
    line.recv_bytes()
except (EOFError, OSError):
    sys.exit(3)
"""
SETTINGS = BenchSettings("lab.sqlite", "a bench", True, 2.0, Path("/a folder"), "http://127.0.0.1:1")
REFUSAL = b'raised\n[{"kind":"PermissionError","args":[13,"Permission denied"]}]'
CONFLICT = b'raised\n[{"kind":"Conflict","args":["it is held; stop the other one"]}]'


@pytest.fixture
def child(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest) -> Iterator[Child]:
    (tmp_path / "a_child.py").write_text(PROGRAM.format(act=request.param))
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    made = Child("a_child")
    yield made
    made.kill()


def saying(document: bytes, *, ends: bool = True) -> str:
    return f"line.send_bytes({document!r})" + ("; sys.exit(2)" if ends else "")


READY = "import json; assert json.loads(settings)[0]['speed'] == 2.0\n" + saying(b'value\n["ready"]', ends=False)


@pytest.mark.parametrize("child", [READY], indirect=True)
def test_a_child_gets_its_settings_as_data_and_says_that_it_is_ready(child: Child) -> None:
    child.open(SETTINGS)
    assert not child.has_ended()


@pytest.mark.parametrize("child", [saying(CONFLICT)], indirect=True)
def test_a_refusal_is_raised_once_the_child_has_ended(child: Child) -> None:
    with pytest.raises(LabctlError, match="it is held; stop the other one"):
        child.open(SETTINGS)
    assert child.status == 2


@pytest.mark.parametrize("child", [saying(REFUSAL.replace(b"PermissionError", b"OSError"))], indirect=True)
def test_an_error_of_the_system_is_raised_as_it_was_and_is_no_lost_line(child: Child) -> None:
    with pytest.raises(PermissionError, match="Permission denied"):
        child.open(SETTINGS)


@pytest.mark.parametrize("child", [saying(b"\x80\x05K\x01.", ends=False)], indirect=True)
def test_a_child_that_says_what_is_no_document_is_ended(child: Child) -> None:
    with pytest.raises(BadDocument, match="what a process of the service says is no answer"):
        child.open(SETTINGS)
    assert child.has_ended()


@pytest.mark.parametrize("child", ["sys.exit(5)"], indirect=True)
def test_a_child_that_ends_without_a_word_has_failed(child: Child) -> None:
    with pytest.raises(Failed, match="the a child ended with exit status 5 while it started; read the log"):
        child.open(SETTINGS)


@pytest.mark.parametrize("child", [""], indirect=True)
def test_a_child_that_is_late_is_given_up_at_once(child: Child) -> None:
    begun_s = WallClock().now_s()
    with pytest.raises(Failed, match="was not ready when it was asked to end; start the service again"):
        child.open(SETTINGS, lambda: True)
    assert WallClock().now_s() - begun_s < 10.0
    assert not child.has_ended()
