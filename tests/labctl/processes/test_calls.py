"""Calls between processes: values, errors and who acts travel; a silent end is reported in time."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import pytest

from labctl.acting_user import Actor, acting, actor
from labctl.errors import BenchSilent, DiskFull, LabctlError
from labctl.processes.calls import Answer, Call, Caller, CallServer, Respond, answer_with

WAIT_S = 20.0


def echo(call: Call, _: Connection) -> Answer:
    with acting(call.actor):
        return answer_with(lambda: (call.name, call.args, call.kwargs, actor().name))


@contextmanager
def serving(path: Path, respond: Respond, *, in_turn: bool = False) -> Iterator[Caller]:
    server, caller = CallServer(path, respond, in_turn=in_turn), Caller(path, WAIT_S, keeps=not in_turn)
    server.start()
    try:
        yield caller
    finally:
        caller.close()
        server.close()


@pytest.mark.parametrize("in_turn", [False, True])
def test_a_call_carries_its_arguments_and_who_acts(tmp_path: Path, in_turn: bool) -> None:
    with serving(tmp_path / "calls", echo, in_turn=in_turn) as caller, acting(Actor("Ada", "key")):
        for number in range(3):
            assert caller.call("any", number, b=2.5) == ("any", (number,), {"b": 2.5}, "Ada")


def test_what_is_raised_is_raised_here_with_all_it_says(tmp_path: Path) -> None:
    def full(*_: Any) -> Answer:
        return Answer(raised=DiskFull("no room; nothing was stored", cause="no room"))

    with serving(tmp_path / "calls", full) as caller, pytest.raises(DiskFull, match="nothing was stored") as caught:
        caller.call("any")
    assert caught.value.cause == "no room"


def test_an_answer_that_cannot_travel_is_told_in_words(tmp_path: Path) -> None:
    refused = pytest.raises(
        LabctlError,
        match=r"an answer cannot be sent between processes; report this text and the version of "
        r"labctl to its maintainers: .*lock",
    )
    with serving(tmp_path / "calls", lambda *_: Answer(threading.Lock())) as caller, refused:
        caller.call("any")


def test_an_end_that_does_not_answer_is_silent_after_a_time_and_its_late_answer_is_no_other_calls(
    tmp_path: Path,
) -> None:
    late = threading.Event()

    def slow(call: Call, _: Connection) -> Answer:
        if call.args == ("late",):
            late.wait(WAIT_S)
        return Answer(call.args[0])

    with serving(tmp_path / "calls", slow) as caller:
        with pytest.raises(BenchSilent, match=r"has not answered within 0\.05 s"):
            caller.call("any", "late", timeout_s=0.05)
        late.set()
        assert caller.call("any", "next") == "next"


def test_no_process_at_all_is_silent(tmp_path: Path) -> None:
    with pytest.raises(BenchSilent, match="cannot be reached"):
        Caller(tmp_path / "no_process", WAIT_S).call("any")


def test_a_process_that_has_gone_is_noticed_by_callers_that_knew_it(tmp_path: Path) -> None:
    path = tmp_path / "calls"
    with serving(path, echo) as caller:
        caller.call("any")
    path.unlink(missing_ok=True)
    with pytest.raises(BenchSilent):
        caller.call("any")
