"""Which connections make room, whom they are counted by, and that a loop that stood still ends none."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass, field
from typing import Any

import pytest

from labctl.api.connection_limits import ConnectionLimits, limits_for
from labctl.api.connection_table import LOCAL, ConnectionTable, Phase, source_of


@dataclass(eq=False)
class FakeConnection:
    phase: Phase
    since: float
    source: str = LOCAL
    reserved: bool = False
    is_cut: bool = False
    checks: list[float] = field(default_factory=list)

    def check(self, now: float) -> None:
        self.checks.append(now)

    def cut(self) -> None:
        self.is_cut = True


class FakeLoop(asyncio.AbstractEventLoop):
    """A loop whose time is set, and whose timers are called by hand."""

    now = 100.0

    def __init__(self) -> None:
        self.timers: list[tuple[float, Any, tuple[Any, ...]]] = []

    def time(self) -> float:
        return self.now

    def call_at(self, when: float, callback: Any, *args: Any, **_: Any) -> Any:
        self.timers.append((when, callback, args))
        return object()

    def run_timer(self, late_s: float = 0.0) -> None:
        when, callback, args = self.timers.pop()
        self.now = when + late_s
        callback(*args)


LIMITS = ConnectionLimits(total=4, local=4, per_address=2, reserve=2)


@pytest.mark.parametrize(
    ("waits", "goes"),
    [
        ([(Phase.ANSWER, 1), (Phase.BODY, 2), (Phase.IDLE, 3), (Phase.HEADERS, 4)], 3),
        ([(Phase.ANSWER, 1), (Phase.BODY, 2), (Phase.IDLE, 3), (Phase.IDLE, 4)], 2),
        ([(Phase.ANSWER, 1), (Phase.BODY, 3), (Phase.BODY, 2), (Phase.ANSWER, 4)], 2),
        ([(Phase.BODY, 99.2), (Phase.HEADERS, 99.5), (Phase.HEADERS, 99.6), (Phase.HEADERS, 99.7)], 0),
        ([(Phase.BODY, 90), (Phase.HEADERS, 99.5), (Phase.HEADERS, 99.6), (Phase.HEADERS, 99.7)], 0),
        ([(Phase.ANSWER, 1)] * 4, None),
    ],
)
def test_which_connection_a_full_table_closes(waits: list[tuple[Phase, float]], goes: int | None) -> None:
    table, loop = ConnectionTable(LIMITS), FakeLoop()
    old = [FakeConnection(*each) for each in waits]
    assert all(table.admit(each, loop) for each in old)
    new = FakeConnection(Phase.HEADERS, 100)
    assert table.admit(new, loop)
    assert [index for index, each in enumerate(old) if each.is_cut] == ([] if goes is None else [goes])
    assert table.on_reserve(new) == (goes is None)
    assert not new.is_cut


def test_a_place_of_the_reserve_becomes_an_ordinary_one() -> None:
    table, loop = ConnectionTable(LIMITS), FakeLoop()
    busy = [FakeConnection(Phase.ANSWER, 1) for _ in range(6)]
    assert all(table.admit(each, loop) for each in busy)
    assert not table.admit(FakeConnection(Phase.HEADERS, 100), loop)
    assert [each.reserved for each in busy] == [False] * 4 + [True] * 2
    for each in busy[:2]:
        table.release(each)
    assert not table.on_reserve(busy[5])
    assert len(table) == 4


def test_one_address_makes_room_for_itself_only() -> None:
    table, loop = ConnectionTable(LIMITS), FakeLoop()
    other = FakeConnection(Phase.HEADERS, 1, "10.0.0.9")
    mine = [FakeConnection(Phase.IDLE, 50 + index, "10.0.0.7") for index in range(3)]
    assert all(table.admit(each, loop) for each in [other, *mine])
    assert [each.is_cut for each in [other, *mine]] == [False, True, False, False]


def test_a_loop_that_stood_still_reads_before_it_ends_a_connection() -> None:
    table, loop = ConnectionTable(LIMITS), FakeLoop()
    waits = FakeConnection(Phase.BODY, 100)
    table.admit(waits, loop)
    loop.run_timer()
    loop.run_timer(late_s=40)
    assert len(waits.checks) == 1
    loop.run_timer(late_s=40)
    assert len(waits.checks) == 2


@pytest.mark.parametrize(
    ("address", "source"),
    [
        (None, LOCAL),
        ("127.0.0.1", LOCAL),
        ("127.9.9.9", LOCAL),
        ("::1", LOCAL),
        ("::ffff:127.0.0.1", LOCAL),
        ("::ffff:10.0.0.7", "10.0.0.7"),
        ("10.0.0.7", "10.0.0.7"),
        ("fe80::1:2:3:4%eth0", "fe80::/64"),
        ("2001:db8:1:2:3:4:5:6", "2001:db8:1:2::/64"),
        ("somewhere", "somewhere"),
    ],
)
def test_connections_are_counted_by_source_address(address: str | None, source: str) -> None:
    assert source_of(address) == source


@pytest.mark.parametrize("files", [16, 64, 256, 1024, 4096, 1 << 20])
def test_connections_leave_files_for_the_bench(files: int) -> None:
    limits = limits_for(files)
    assert limits.total + limits.reserve + limits.backlog <= max(0.85 * files, 16)
    assert limits.total + limits.reserve + limits.backlog < 1024 - 200
    assert 2 <= limits.per_address <= limits.local <= limits.total
