"""Calls between processes: values, errors and who acts travel as data; a silent end is reported in time."""

from __future__ import annotations

import os
import pickle
import socket
import struct
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import pytest

from labctl.acting_user import Actor, acting, actor
from labctl.errors import BadInput, BenchSilent, DiskFull, LabctlError
from labctl.processes.documents import LONGEST_BYTES, BadDocument, receive
from labctl.processes.rpc import Answer, Respond, RpcClient, RpcServer, answer_with
from labctl.processes.rpc_methods import Call, RpcMethod, parameter, supervisor_method
from tests.helpers.log_records import logged
from tests.helpers.patience import WAIT_S


def method_of(name: str) -> RpcMethod:
    """Calls of a number, a factor and a note, answered by a list of them and who acts."""
    if name != "any":
        return supervisor_method(name)
    return RpcMethod(name, [parameter("number", int), parameter("factor", float)], list[Any])


def echo(call: Call, _: Connection) -> Answer:
    with acting(call.actor):
        return answer_with(lambda: [call.name, *call.arguments.values(), actor().name])


@contextmanager
def serving(path: Path, respond: Respond) -> Iterator[RpcClient]:
    server, caller = RpcServer(path, respond, method_of), RpcClient(path, WAIT_S, method_of)
    server.start()
    try:
        yield caller
    finally:
        caller.close()
        server.close()


def test_a_call_carries_its_arguments_and_who_acts(tmp_path: Path) -> None:
    with serving(tmp_path / "calls", echo) as caller, acting(Actor("Ada", "key")):
        for number in range(3):
            assert caller.call("any", number, factor=2.5) == ["any", number, 2.5, "Ada"]


def test_what_is_raised_is_raised_here_with_all_it_says(tmp_path: Path) -> None:
    def full(*_: Any) -> Answer:
        return Answer(raised=DiskFull("no room; nothing was stored", cause="no room"))

    with serving(tmp_path / "calls", full) as caller, pytest.raises(DiskFull, match="nothing was stored") as caught:
        caller.call("any", 1, 2.0)
    assert caught.value.cause == "no room"


def test_an_answer_that_cannot_travel_is_told_in_words(tmp_path: Path) -> None:
    refused = pytest.raises(
        LabctlError,
        match=r"the answer to call any cannot be sent between processes \(.*lock.*\); report this text and the version "
        r"of labctl to its maintainers",
    )
    with serving(tmp_path / "calls", lambda *_: Answer([threading.Lock()])) as caller, refused:
        caller.call("any", 1, 2.0)


def test_an_end_that_does_not_answer_is_silent_after_a_time_and_its_late_answer_is_no_other_calls(
    tmp_path: Path,
) -> None:
    late = threading.Event()

    def slow(call: Call, _: Connection) -> Answer:
        if call.arguments["number"] == 0:
            late.wait(WAIT_S)
        return Answer([call.arguments["number"]])

    with serving(tmp_path / "calls", slow) as caller:
        with pytest.raises(BenchSilent, match=r"has not answered within 0\.05 s"):
            caller.call("any", 0, 1.0, timeout_s=0.05)
        late.set()
        assert caller.call("any", 7, 1.0) == [7]


def test_no_process_at_all_is_silent(tmp_path: Path) -> None:
    with pytest.raises(BenchSilent, match="cannot be reached"):
        RpcClient(tmp_path / "no_process", WAIT_S, method_of).call("any", 1, 2.0)


def test_a_process_that_has_gone_is_noticed_by_callers_that_knew_it(tmp_path: Path) -> None:
    path = tmp_path / "calls"
    with serving(path, echo) as caller:
        caller.call("any", 1, 2.0)
    path.unlink(missing_ok=True)
    with pytest.raises(BenchSilent):
        caller.call("any", 1, 2.0)


def test_a_call_that_the_other_end_does_not_have_is_not_sent(tmp_path: Path) -> None:
    with serving(tmp_path / "calls", echo) as caller:
        with pytest.raises(BadInput, match=r"has no call 'store\.Audit\.rows'; stop the service and start it again"):
            caller.call("store.Audit.rows")
        with pytest.raises(TypeError, match="factor"):
            caller.call("any", 1)


def test_what_is_too_long_for_a_frame_is_not_sent(tmp_path: Path) -> None:
    long, why = "x" * LONGEST_BYTES, r"the answer to call any has \d+ bytes and cannot be sent .*; send less at a time"
    with serving(tmp_path / "calls", lambda *_: Answer([long])) as caller, pytest.raises(LabctlError, match=why):
        caller.call("any", 1, 2.0)


class Opens:
    """Unpickled, it makes a folder: what an attacker's code would do."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self) -> tuple[Callable[[str], None], tuple[str]]:
        return os.mkdir, (str(self.path),)


def framed(content: bytes) -> bytes:
    return struct.pack("!i", len(content)) + content


HEAD = b'[{"call":"any","actor":{"name":"Eve","via":""}}]\n'
#: Name -> what is sent, and what the one line of the log says; the end of the connection follows at once.
HOSTILE: dict[str, tuple[bytes, str]] = {
    "garbage": (framed(b"\x00\xff\xfe{{{"), "the head of a call is not as expected: Invalid JSON"),
    "nothing": (framed(b""), "the head of a call is not as expected: Invalid JSON"),
    "no frame": (b"GET / HTTP/1.1\r\n\r\n", "is not whole or longer than"),
    "an over-long line": (struct.pack("!i", LONGEST_BYTES + 1) + b"x" * 100, "is not whole or longer than"),
    "half a line": (framed(HEAD + b"[[1,2.0]]")[:40], "is not whole or longer than"),
    "half a frame's length": (b"\x00\x00", "is not whole or longer than"),
    "no arguments": (framed(HEAD), "what call any was given is not as expected: Invalid JSON"),
    "arguments of other types": (framed(HEAD + b'[["one",2.0]]'), "is not as expected at 0: Input should be a valid"),
    "too many arguments": (framed(HEAD + b"[[1,2.0,3]]"), "Tuple should have at most 2 items"),
    "an unknown call": (framed(HEAD.replace(b"any", b"os.system") + b"[[]]"), "has no call 'os.system'"),
    "more than is known": (framed(HEAD.replace(b'"via"', b'"x":1,"via"') + b"[[1,2.0]]"), "at actor.x"),
    "deep": (framed(b"[" * 100_000), "recursion limit"),
}


def say(path: Path, content: bytes) -> bytes:
    """Send bytes and the end of the connection; returns the other end's answer.

    Nothing where it has left bytes unread: its end of the connection then discards what it has sent too.
    """
    with socket.socket(socket.AF_UNIX) as line:
        line.settimeout(WAIT_S)
        line.connect(str(path))
        line.sendall(content)
        line.shutdown(socket.SHUT_WR)
        answer = b""
        with suppress(ConnectionResetError):
            while more := line.recv(4096):
                answer += more
        return answer


def refused(path: Path, content: bytes, why: str) -> None:
    with serving(path, echo) as caller:
        with logged(path.parent) as records:
            answer = say(path, content)
        (line,) = records.named("call.refused")
        assert why in line["error"]
        assert len(line["error"]) < 500
        assert answer[4:11] in (b"raised\n", b"")
        assert caller.call("any", 1, 2.0)[:2] == ["any", 1]  # the process goes on


@pytest.mark.parametrize("name", HOSTILE)
def test_what_is_no_call_is_refused_and_the_process_goes_on(tmp_path: Path, name: str) -> None:
    refused(tmp_path / "calls", *HOSTILE[name])


@pytest.mark.parametrize("protocol", range(pickle.HIGHEST_PROTOCOL + 1))
def test_a_pickle_is_never_opened(tmp_path: Path, protocol: int) -> None:
    made = tmp_path / "made"
    content = pickle.dumps(Opens(made), protocol)
    for name, sent in (("h", content), ("a", HEAD + content)):  # head, arguments; the name of a socket is short
        (tmp_path / name).mkdir()
        refused(tmp_path / name / "c", framed(sent), "is not as expected: Invalid JSON")
    assert not made.exists()
    pickle.loads(content)
    assert made.is_dir()  # what was sent does what it is meant to


def test_an_answer_of_another_type_is_refused_by_the_caller(tmp_path: Path) -> None:
    def hostile(_: Call, connection: Connection) -> None:
        connection.send_bytes(pickle.dumps(Opens(tmp_path / "made")))

    with serving(tmp_path / "calls", hostile) as caller, pytest.raises(BadDocument, match="is no answer"):
        caller.call("any", 1, 2.0)
    assert not (tmp_path / "made").exists()


def test_a_line_that_ends_between_two_frames_is_no_error() -> None:
    ours, theirs = socket.socketpair()
    with Connection(ours.detach()) as line:
        theirs.sendall(framed(b"[1]"))
        theirs.close()
        assert receive(line) == b"[1]"
        with pytest.raises(EOFError):
            receive(line)
