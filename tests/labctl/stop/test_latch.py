"""The latch: what is asked for is never lost, by whatever writes beside it or is torn."""

from __future__ import annotations

import errno
import json
import os
import threading
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from labctl.stop import latch as module
from labctl.stop.latch import MARK, MARK_ID, NAME, SERVICE_STOPS, StopLatch, StopRequest

FullDisk = Callable[[StopLatch, StopRequest], None]


@pytest.fixture
def latch(tmp_path: Path) -> StopLatch:
    return StopLatch(tmp_path / "bench")


def asked(reason: str = "smoke", *, holds: bool = True) -> StopRequest:
    return StopRequest.new("Ada", "command line", reason, holds=holds)


def test_a_bench_that_was_never_stopped_is_free(latch: StopLatch) -> None:
    assert (latch.state().open, latch.state().held) == ((), ())
    latch.prepare()
    assert (latch.state().open, latch.state().held) == ((), ())


def test_a_stop_is_open_until_it_is_carried_out_and_holds_until_it_is_taken_back(latch: StopLatch) -> None:
    stop = asked()
    latch.request(stop)
    assert StopLatch(latch._folder).state().open == (stop,)  # as the next process reads it
    latch.at_rest([stop.id], "the table stands")
    assert (latch.state().open, latch.state().unconfirmed) == ((stop,), ())
    latch.carried_out([stop.id], "safe")
    assert (latch.state().open, latch.state().held) == ((), (stop,))
    latch.take_back([stop.id], "Bob")
    assert latch.state().held == ()
    latch.request(stop)  # the same request comes late over another way
    assert (latch.state().open, latch.state().held) == ((), ())


def test_the_end_of_a_service_keeps_nothing_from_moving_once_it_is_carried_out(latch: StopLatch) -> None:
    end = asked(holds=False)
    latch.request(end)
    assert latch.state().held == (end,)
    latch.carried_out([end.id], "safe")
    assert latch.state().held == ()


def test_a_stop_that_comes_while_another_is_taken_back_stays(latch: StopLatch) -> None:
    first, second = asked("first"), asked("second")
    latch.request(first)
    state = latch.state()
    latch.request(second)
    latch.carried_out([stop.id for stop in state.open], "safe")
    latch.take_back([stop.id for stop in state.held], "Bob")
    assert latch.state().open == (second,)


def test_many_writers_at_once_lose_nothing(latch: StopLatch) -> None:
    stops = [asked(f"stop {number}") for number in range(40)]
    threads = [threading.Thread(target=latch.request, args=(stop,)) for stop in stops]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert {stop.id for stop in latch.state().open} == {stop.id for stop in stops}


@settings(max_examples=60)
@given(cut=st.integers(0, 400), junk=st.binary(max_size=20))
def test_a_torn_line_counts_as_a_stop_and_hides_no_other(
    tmp_path_factory: pytest.TempPathFactory, cut: int, junk: bytes
) -> None:
    latch = StopLatch(tmp_path_factory.mktemp("latch"))
    latch.request(asked("first"))
    path = latch._folder / NAME
    whole = path.read_bytes()
    latch.request(asked("second"))
    path.write_bytes(path.read_bytes()[: len(whole) + cut] + junk)
    last = asked("last")
    latch.request(last)
    open_ids = {stop.id for stop in latch.state().open}
    assert last.id in open_ids
    assert any(stop.reason == "first" for stop in latch.state().open)
    if 0 < cut < 100:  # part of the second line is there, and not the whole
        assert len(open_ids) >= 3


def test_a_full_disk_leaves_room_for_the_mark(latch: StopLatch, monkeypatch: pytest.MonkeyPatch) -> None:
    latch.prepare()

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(module.StopLatch, "_append", full)
    latch.request(asked())
    monkeypatch.undo()
    (stop,) = latch.state().open
    assert (stop.id.startswith(MARK_ID), "disk was full" in stop.reason, stop.holds) == (True, True, True)
    latch.at_rest([stop.id], "the table stands")
    assert latch.state().unconfirmed == ()
    latch.carried_out([stop.id], "safe")
    assert (latch.state().open, latch.state().held) == ((), (stop,))  # until a person takes it back
    latch.take_back([stop.id], "Bob")
    assert (latch.state().open, latch.state().held) == ((), ())
    later = asked()
    latch.request(later)
    assert latch.state().open == (later,)


@pytest.fixture
def full_disk(monkeypatch: pytest.MonkeyPatch) -> Callable[[StopLatch, StopRequest], None]:
    """Ask for a stop while no line fits on the disk."""

    def ask(latch: StopLatch, stop: StopRequest) -> None:
        with monkeypatch.context() as patched:
            patched.setattr(os, "write", lambda _handle, line: len(line) - 1)
            latch.request(stop)

    return ask


def test_a_second_stop_on_a_full_disk_is_another_stop(latch: StopLatch, full_disk: FullDisk) -> None:
    latch.prepare()
    ids = []
    for number in range(3):
        full_disk(latch, asked(f"stop {number}"))
        (stop,) = latch.state().open
        assert (latch.state().held, latch.state().unconfirmed) == ((stop,), (stop,))
        ids.append(stop.id)
        latch.at_rest([stop.id], "the table stands")
        latch.carried_out([stop.id], "safe")
        latch.take_back([stop.id], "Bob")
        assert (latch.state().open, latch.state().held) == ((), ())
    assert len(set(ids)) == 3


def test_the_mark_stays_while_its_stop_cannot_be_noted_as_carried_out(
    latch: StopLatch, full_disk: FullDisk, monkeypatch: pytest.MonkeyPatch
) -> None:
    latch.prepare()
    full_disk(latch, asked())
    (stop,) = latch.state().open
    with monkeypatch.context() as patched:
        patched.setattr(os, "write", lambda _handle, line: len(line) - 1)
        with pytest.raises(OSError, match="does not fit on the disk") as full:
            latch.carried_out([stop.id], "safe")
    assert full.value.errno == errno.ENOSPC
    assert latch.state().open == (stop,)


def test_only_what_the_mark_remembers_is_taken_off_it(latch: StopLatch, full_disk: FullDisk) -> None:
    first = asked()
    latch.request(first)
    full_disk(latch, asked("second"))
    latch.carried_out([first.id], "safe")
    assert [stop.id.startswith(MARK_ID) for stop in latch.state().open] == [True]


def test_a_request_says_when_by_whom_and_in_plain_characters(latch: StopLatch) -> None:
    stop = StopRequest.new("A" * 300, "key", "smoke\x1b[2J\n" + "r" * 600, campaign=3)
    assert (len(stop.by), len(stop.reason)) == (200, 500)
    assert stop.reason.startswith("smoke [2J r")
    assert (stop.via, stop.campaign, stop.holds, len(stop.id)) == ("key", 3, True, 16)
    assert stop.at.endswith("+00:00")
    assert StopRequest.new("Ada", "key", "", stop_id="given").id == "given"
    assert StopRequest("i", "", "", "", "").holds
    latch.request(stop)
    assert latch.state().open == (stop,)


def test_the_end_of_a_service_is_a_stop_that_holds_nothing() -> None:
    end = StopRequest.of_service_end("service")
    assert (end.by, end.via, end.reason, end.campaign, end.holds) == ("service", "signal", SERVICE_STOPS, None, False)


def test_the_stamp_changes_with_each_line(latch: StopLatch) -> None:
    assert latch.stamp == (0, 0)
    latch.request(asked())
    first = latch.stamp
    path = latch._folder / NAME
    assert first == (path.stat().st_size, path.stat().st_mtime_ns)
    latch.request(asked("again"))
    assert latch.stamp[0] > first[0]


def test_a_latch_is_made_in_folders_that_are_not_there_and_leaves_nothing_beside_it(tmp_path: Path) -> None:
    folder = tmp_path / "state" / "bench"
    latch = StopLatch(folder)
    descriptors = len(list(Path("/proc/self/fd").iterdir()))
    latch.prepare()
    latch.request(asked())
    latch.prepare()
    assert len(list(Path("/proc/self/fd").iterdir())) == descriptors
    assert [path.name for path in folder.iterdir()] == [NAME]
    assert folder.stat().st_mode & 0o777 == 0o700


def test_each_entry_is_one_line_with_its_time(latch: StopLatch) -> None:
    first, second = asked("first"), asked("second")
    latch.request(first)
    latch.request(second)
    latch.at_rest([first.id], "the table stands")
    latch.carried_out([first.id], "safe")
    latch.take_back([first.id], "Bob")
    head, *lines, last = (latch._folder / NAME).read_bytes().split(b"\n")
    assert (head, last) == (b" ", b"")
    entries = [json.loads(line) for line in lines]
    assert [next(iter(each)) for each in entries] == ["stop", "stop", "at_rest", "carried_out", "taken_back"]
    assert all(each["at"].endswith("+00:00") for each in entries[2:])


def test_an_empty_line_hides_nothing_after_it(latch: StopLatch) -> None:
    latch.prepare()
    with (latch._folder / NAME).open("ab") as file:
        file.write(b"\n\n")
    stop = asked()
    latch.request(stop)
    assert latch.state().open == (stop,)


def test_the_mark_is_the_first_byte_and_changes_no_other(latch: StopLatch) -> None:
    latch.request(asked())
    before, handles = (latch._folder / NAME).read_bytes(), len(list(Path("/proc/self/fd").iterdir()))
    latch._mark(MARK)
    assert (latch._folder / NAME).read_bytes() == MARK + before[1:]
    assert len(list(Path("/proc/self/fd").iterdir())) == handles


def test_each_line_is_on_the_disk_before_the_call_returns(latch: StopLatch, monkeypatch: pytest.MonkeyPatch) -> None:
    synced: list[int] = []

    def sync(handle: int) -> None:
        synced.append(os.fstat(handle).st_size)

    monkeypatch.setattr(os, "fsync", sync)
    latch.prepare()
    assert synced == [2]  # the first line, before the file has its name
    latch.request(asked())
    size_bytes = (latch._folder / NAME).stat().st_size
    assert synced == [2, size_bytes]
    latch._mark(MARK)
    assert synced == [2, size_bytes, size_bytes]


def test_another_process_that_was_quicker_keeps_its_file(latch: StopLatch, monkeypatch: pytest.MonkeyPatch) -> None:
    first = asked()
    latch.request(first)
    monkeypatch.setattr(Path, "exists", lambda _path: False)
    latch.prepare()
    assert latch.state().open == (first,)


def test_a_latch_that_cannot_be_read_counts_as_a_stop(latch: StopLatch) -> None:
    latch.prepare()
    (latch._folder / NAME).unlink()
    (latch._folder / NAME).mkdir()
    assert "cannot be read" in latch.state().open[0].reason


def test_the_latch_is_private(latch: StopLatch) -> None:
    latch.request(asked())
    assert (latch._folder / NAME).stat().st_mode & 0o777 == 0o600
