"""The latch: what is asked for is never lost, by whatever writes beside it or is torn."""

from __future__ import annotations

import threading
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from labctl.stop import latch as module
from labctl.stop.latch import MARK_ID, NAME, StopLatch, StopRequest


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
    assert (stop.id, "disk was full" in stop.reason) == (MARK_ID, True)
    latch.carried_out([MARK_ID], "safe")
    latch.take_back([MARK_ID], "Bob")
    assert (latch.state().open, latch.state().held) == ((), ())
    later = asked()
    latch.request(later)
    assert latch.state().open == (later,)


def test_a_latch_that_cannot_be_read_counts_as_a_stop(latch: StopLatch) -> None:
    latch.prepare()
    (latch._folder / NAME).unlink()
    (latch._folder / NAME).mkdir()
    assert "cannot be read" in latch.state().open[0].reason


def test_the_latch_is_private(latch: StopLatch) -> None:
    latch.request(asked())
    assert (latch._folder / NAME).stat().st_mode & 0o777 == 0o600
