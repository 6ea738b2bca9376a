"""The steps of a stop: who is asked, for how long, and what is said of it; processes, clock and threads are made up."""

from __future__ import annotations

import errno
import os
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import pytest

from instruments.clock import SystemClock
from labctl.stop import client, instruments_stop
from labctl.stop.client import (
    AttemptedStop,
    StopAttempt,
    StopResult,
    at_instruments,
    not_stopped_text,
    stop_bench,
)
from labctl.stop.instruments_stop import InstrumentsLeft
from labctl.stop.latch import StopRequest
from labctl.stop.places import DriverNote
from labctl.stop.wire import Word

STOP = StopRequest("1", "2026-11-26T12:00:00+00:00", "Ada", "key", "smoke")
SAFE = InstrumentsLeft(stands=True, safe=True, text="table at rest")


@dataclass
class Process:
    """A process that lives, or ends after it was asked for a number of times whether it does."""

    pid: int = 0
    lives_for: int = 0
    stands_still: bool = False

    @property
    def lives(self) -> bool:
        self.lives_for -= 1
        return self.lives_for >= 0


def alive(pid: int, **is_what: bool) -> Any:
    return Process(pid, 10**6, **is_what)


@dataclass
class Latch:
    """A latch on a disk that writes, fails, or stands still for a time."""

    fails: bool = False
    requests: list[StopRequest] = field(default_factory=list)
    confirmed: list[tuple[list[str], str]] = field(default_factory=list)

    def request(self, stop: StopRequest) -> None:
        if self.fails:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        self.requests.append(stop)

    def at_rest(self, ids: list[str], text: str) -> None:
        self.confirmed.append((ids, text))
        if self.fails:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


@dataclass
class World:
    """What a stop finds: answers of each socket with the time of each word, s, and what the instruments say."""

    answers: dict[str, list[tuple[float, Word]]] = field(default_factory=dict)
    left: InstrumentsLeft | Exception = SAFE
    held: dict[str, int] = field(default_factory=dict)  #: thread -> at which `join` it goes on; it never does: 0
    now: float = 100.0
    asked: list[tuple[str, StopRequest, float, float]] = field(default_factory=list)
    documents: list[dict[str, object]] = field(default_factory=list)
    threads: list[tuple[str, bool]] = field(default_factory=list)
    joined: list[tuple[str, float]] = field(default_factory=list)
    said_meanwhile: list[str] = field(default_factory=list)

    def now_s(self) -> float:
        return self.now

    def ask(self, path: str, stop: StopRequest, silent_s: float, first_s: float) -> Iterator[Word]:
        self.asked.append((path, stop, silent_s, first_s))
        if path not in self.answers:
            raise ConnectionRefusedError("refused")
        begun = self.now
        for at_s, word in self.answers[path]:
            self.now = begun + at_s
            yield word

    def stop_instruments(self, document: dict[str, object], say: Callable[[str], None]) -> InstrumentsLeft:
        self.documents.append(document)
        if isinstance(self.left, Exception):
            raise self.left
        say("table to rest: no answer yet")
        return self.left

    def thread(self, *, target: Callable[[], None], name: str, daemon: bool) -> Any:
        """Return a thread that does its work at once, or when it is joined."""
        self.threads.append((name, daemon))

        def join(within_s: float) -> None:
            self.joined.append((name, within_s))
            if name in self.held and sum(1 for each, _ in self.joined if each == name) == self.held[name]:
                target()

        return SimpleNamespace(start=target if name not in self.held else lambda: None, join=join)


@pytest.fixture
def world(monkeypatch: pytest.MonkeyPatch) -> World:
    made = World()
    monkeypatch.setattr(client, "SystemClock", lambda: made)
    monkeypatch.setattr(client, "ask", made.ask)
    monkeypatch.setattr(instruments_stop, "stop_instruments", made.stop_instruments)
    monkeypatch.setattr(client, "threading", SimpleNamespace(Event=threading.Event, Thread=made.thread))
    monkeypatch.setattr(client, "end_process", lambda process: f"process {process.pid} does not end" * process.lives)
    return made


def attempt(note: DriverNote | None, latch: Latch | None = None) -> StopAttempt:
    place: Any = SimpleNamespace(name="b", latch=latch or Latch(), note=lambda: note)
    return StopAttempt(place, STOP)


def driven(driver: Any = None, guardian: Any = None, **more: Any) -> DriverNote:
    sockets = {"socket": "bench", "guardian_socket": "guardian", "document": {"name": "b"}} | more
    return DriverNote("b", driver or Process(), guardian=guardian or Process(), **sockets)


def result_of(note: DriverNote | None, latch: Latch | None = None) -> StopResult:
    result = attempt(note, latch).result(0.0)
    assert result is not None
    return result


def test_the_bench_process_then_its_guardian_have_1500_ms_to_react_and_3_s_between_two_words(world: World) -> None:
    """As docs/explanation/safety.md says."""
    result_of(driven(alive(5), alive(6)))
    assert world.asked == [("bench", STOP, 3.0, 1.5), ("guardian", STOP, 3.0, 1.5)]
    world.asked.clear()
    result_of(driven(Process(5), alive(6)))
    assert [path for path, *_ in world.asked] == ["guardian"]
    world.asked.clear()
    result_of(driven(alive(5), alive(6), socket=""))
    assert [path for path, *_ in world.asked] == ["guardian"]


def test_a_process_that_stands_still_is_passed_over_at_once(world: World) -> None:
    world.answers["guardian"] = [(0.1, Word("stands", "at rest", 7))]
    assert result_of(driven(alive(5, stands_still=True), alive(6))) == StopResult("b", True, "at rest", 7)
    assert [path for path, *_ in world.asked] == ["guardian"]
    world.asked.clear()
    found = attempt(driven(alive(5, stands_still=True), guardian_socket=""))
    assert (world.asked, found.result(0.0)) == ([], StopResult("b", False, "process 5 does not end"))


@pytest.mark.parametrize(
    ("words", "by_guardian"),
    [
        ([(0.1, Word("asked")), (1.5, Word("waiting")), (1.5, Word("heard")), (9.0, Word("stands", "by it"))], False),
        ([(0.1, Word("asked")), (1.6, Word("waiting")), (1.7, Word("heard")), (9.0, Word("stands", "by it"))], True),
        ([(5.0, Word("stands", "by it"))], False),
        ([(5.0, Word("failed", "by it"))], False),
    ],
)
def test_an_engine_that_has_not_reacted_after_1500_ms_is_left_to_the_guardian(
    world: World, words: list[tuple[float, Word]], by_guardian: bool
) -> None:
    world.answers = {"bench": words, "guardian": [(0.1, Word("stands", "by the guardian"))]}
    found = result_of(driven(alive(5), alive(6)))
    assert found.text == ("by the guardian" if by_guardian else "by it")
    assert found.stands == (by_guardian or words[-1][1].phase == "stands")


@pytest.mark.parametrize(("at_s", "stands"), [(60.0, True), (60.1, False)])
def test_a_table_that_does_not_stand_after_60_s_is_not_called_stopped(world: World, at_s: float, stands: bool) -> None:
    world.answers["bench"] = [
        (0.1, Word("heard")), (at_s, Word("waiting", "it turns", 7)), (at_s, Word("stands", "it stands", 7)),
    ]  # fmt: skip
    assert result_of(driven(alive(5))) == StopResult("b", stands, "it stands" if stands else "it turns", 7)


def test_how_far_a_stop_is_can_be_read_until_it_is_over(world: World) -> None:
    """And it counts as heard as soon as the engine has left its step, or the instruments were stopped without it."""
    seen: list[tuple[str, bool, StopResult | None]] = []
    found: StopAttempt

    def ask(*_: object) -> Iterator[Word]:
        for word in (Word("asked", "it is asked"), Word("waiting"), Word("heard", "it brakes"), Word("stands", "done")):
            yield word
            seen.append((found.text, found.is_heard(0.0), found.result(0.0)))

    client.ask = ask  # type: ignore[assignment]  # the fixture puts it back
    world.held["stop-attempt"] = 0
    found = attempt(driven(alive(5)))
    assert (found.text, found.is_heard(0.0), found.result(0.0)) == ("the stop is asked for", False, None)
    found._work()
    assert seen == [
        ("it is asked", False, None), ("it is asked", False, None), ("it brakes", True, None), ("done", True, None),
    ]  # fmt: skip
    assert (found.text, found.result(0.0)) == ("done", StopResult("b", True, "done"))
    found = attempt(driven())
    found._work()
    assert found.is_heard(0.0) is True


def test_what_is_said_of_the_instruments_can_be_read_meanwhile(world: World, monkeypatch: pytest.MonkeyPatch) -> None:
    texts = []
    world.held["stop-attempt"] = 0
    found = attempt(driven(alive(5)))

    def at_once(_note: DriverNote, say: Callable[[str], None]) -> StopResult:
        texts.append(found.text)
        say("table to rest: no answer")
        texts.append(found.text)
        return StopResult("b", True, "at rest")

    monkeypatch.setattr(client, "at_instruments", at_once)
    found._work()
    ends = "process 5 did not answer the stop (refused); labctl ends it and goes to the instruments"
    assert texts == [ends, "table to rest: no answer"]


def test_a_bench_that_its_process_left_in_order_is_as_it_was_left(world: World) -> None:
    assert result_of(driven(left="it is safe", left_safe=True)) == StopResult("b", True, "it is safe")
    assert result_of(driven(left="no answer", left_safe=False)) == StopResult("b", False, "no answer")
    assert world.documents == []
    result_of(driven(alive(5), left="it is safe", left_safe=True, socket=""))  # written by an earlier process
    assert world.documents == []  # this one does not end


def test_without_a_note_or_a_bench_file_the_instruments_are_not_known(world: World) -> None:
    text = "no process drives it, and its instruments are not known; name the bench file: labctl stop --bench FILE"
    assert result_of(None) == StopResult("b", False, text)
    assert result_of(driven(document={})) == StopResult("b", False, text)


def test_the_latch_is_written_first_and_confirmed_once_the_table_stands(world: World) -> None:
    latch = Latch()
    assert result_of(driven(left="it is safe", left_safe=True), latch).latched is True
    assert (latch.requests, latch.confirmed) == ([STOP], [(["1"], "it is safe")])
    latch = Latch()
    result_of(driven(left="no answer"), latch)
    assert (latch.requests, latch.confirmed) == ([STOP], [])
    assert result_of(driven(left="it is safe", left_safe=True), Latch(fails=True)) == StopResult(
        "b", True, "it is safe", latched=False
    )


@pytest.mark.parametrize(("goes_on_at", "latched"), [(1, True), (2, True), (0, False)])
def test_a_disk_that_stands_still_keeps_a_stop_for_twice_300_ms(world: World, goes_on_at: int, latched: bool) -> None:
    world.held["latch"] = goes_on_at
    found = result_of(driven(left="it is safe", left_safe=True))
    assert (found.stands, found.latched) == (True, latched)
    assert world.joined == [("latch", 0.3), ("latch", 0.3)]


def test_no_thread_of_a_stop_keeps_its_process_from_ending(world: World) -> None:
    result_of(None)
    assert world.threads == [("stop-attempt", True), ("latch", True)]


@pytest.mark.parametrize(("error", "text"), [(RuntimeError("no driver"), "no driver"), (MemoryError(), "MemoryError")])
def test_whatever_goes_wrong_is_the_result(world: World, error: Exception, text: str) -> None:
    world.left = error
    assert result_of(driven()) == StopResult("b", False, text)


def test_a_result_counts_as_latched_where_nothing_else_is_said() -> None:
    assert StopResult("b", True, "at rest").latched is True


def test_what_a_person_reads_of_a_bench_that_may_not_stand() -> None:
    assert not_stopped_text("it turns") == "NOT STOPPED: it turns. Use the stop switch of the bench."


@pytest.mark.parametrize(("begun_s", "waits_s"), [(0.0, 4.0), (1.5, 2.5), (3.6, 0.5), (60.0, 0.5)])
@pytest.mark.parametrize("late", [True, False])
def test_not_stopped_is_said_after_4_s_with_those_before_the_command_began_and_half_a_second_at_least(
    monkeypatch: pytest.MonkeyPatch, begun_s: float, waits_s: float, late: bool
) -> None:
    waits: list[float | None] = []
    end = StopResult("b", True, "at rest")

    def result(within_s: float | None = None) -> StopResult | None:
        waits.append(within_s)
        return None if late and len(waits) == 1 else end

    monkeypatch.setattr(client, "StopAttempt", lambda *_: SimpleNamespace(text="it turns", result=result))
    said: list[str] = []
    place: Any = SimpleNamespace(name="b")
    assert stop_bench(place, STOP, said.append, begun_s) == end
    assert waits == ([waits_s, None] if late else [waits_s])
    text = "NOT STOPPED yet: bench b: it turns. Use the stop switch of the bench."
    assert said == ([text] if late else [])
    waits.clear()
    assert stop_bench(place, STOP) == end  # it need not be said
    assert waits[0] == 4.0


def test_the_process_that_drives_a_bench_is_ended_before_its_instruments_are_stopped(world: World) -> None:
    said: list[str] = []
    assert at_instruments(driven(alive(5)), said.append) == StopResult("b", False, "process 5 does not end")
    simulated = at_instruments(driven(simulated=True), said.append)
    assert (simulated.stands, "ended with the process" in simulated.text, world.documents) == (True, True, [])
    world.left = InstrumentsLeft(stands=False, safe=False, text="no answer")
    found = at_instruments(driven(), said.append)
    assert found == StopResult("b", False, "its instruments were stopped directly: no answer")
    assert (world.documents, said) == ([{"name": "b"}], ["table to rest: no answer yet"])


def test_an_attempt_is_a_stop_that_is_under_way(world: World) -> None:
    world.held["stop-attempt"] = 0
    found = attempt(driven(left="it is safe", left_safe=True))
    stopping = AttemptedStop(found)
    before = (stopping.is_heard(0.0), stopping.is_over(0.0), stopping.stands, stopping.text)
    assert before == (False, False, False, "the stop is asked for")
    found._work()
    after = (stopping.is_heard(0.0), stopping.is_over(0.0), stopping.stands, stopping.text)
    assert after == (True, True, True, "it is safe")
    failed = attempt(driven(left="it turns"))
    failed._work()
    assert AttemptedStop(failed).stands is False


def test_whether_a_table_stands_is_answered_at_once() -> None:
    """The answers to a stop do not wait for one another."""
    waits: list[float] = []
    under_way: Any = SimpleNamespace(result=waits.append)
    assert AttemptedStop(under_way).stands is False
    assert waits == [0.0]


def test_the_end_of_a_stop_is_waited_for_and_no_longer() -> None:
    goes_on, clock = threading.Event(), SystemClock()

    def note() -> DriverNote:
        goes_on.wait(20.0)
        return driven(left="it is safe", left_safe=True)

    place: Any = SimpleNamespace(name="b", latch=Latch(), note=note)
    found = StopAttempt(place, STOP)
    assert found.result(0.0) is None
    goes_on.set()
    begun_s = clock.now_s()
    assert found.result(20.0) == StopResult("b", True, "it is safe")
    assert clock.now_s() - begun_s < 10.0
