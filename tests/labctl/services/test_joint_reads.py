"""Reads of many requests at the same time: joined, never begun before a request that they answer, errors for all."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Awaitable, Callable, Coroutine, Sequence
from typing import Any

import pytest

from labctl.errors import StoreError
from labctl.services.joint_reads import MAX_JOINED, JointReads

InLoop = Callable[[Coroutine[Any, Any, Any]], Any]
Open = Callable[[Callable[[Sequence[str]], Awaitable[dict[str, int]]]], JointReads[str, int]]


class Source:
    """What is read; a statement ends once `go` is set."""

    def __init__(self) -> None:
        self.values = {f"k{n}": n for n in range(200)}
        self.asked: list[list[str]] = []
        self.begun, self.go = threading.Event(), threading.Event()

    async def read(self, keys: Sequence[str]) -> dict[str, int]:
        self.asked.append(list(keys))
        found = {key: self.values[key] for key in keys if key in self.values}
        self.begun.set()
        assert await asyncio.to_thread(self.go.wait, 30)
        return found


@pytest.fixture
def source() -> Source:
    return Source()


@pytest.fixture
def open_reads() -> Open:
    """Return what makes joint reads."""
    return JointReads


async def begun(source: Source) -> None:
    await asyncio.to_thread(source.begun.wait, 30)


def test_requests_during_a_statement_share_the_next_one(source: Source, open_reads: Open, in_a_loop: InLoop) -> None:
    async def ask() -> list[int | None]:
        reads = open_reads(source.read)
        first = asyncio.create_task(reads.get("k0"))
        await begun(source)
        others = [asyncio.create_task(reads.get(key)) for key in ("k1", "k2", "k1", "absent")]
        await asyncio.sleep(0)
        source.go.set()
        return [await first, *[await each for each in others]]

    assert in_a_loop(ask()) == [0, 1, 2, 1, None]
    assert source.asked == [["k0"], ["k1", "k2", "absent"]]


def test_a_request_gets_what_is_true_after_it_asked(source: Source, open_reads: Open, in_a_loop: InLoop) -> None:
    async def ask() -> tuple[int | None, int | None]:
        reads = open_reads(source.read)
        before = asyncio.create_task(reads.get("k5"))
        await begun(source)
        source.values["k5"] = -1  # as a revocation that is committed while the statement for `before` is under way
        after = asyncio.create_task(reads.get("k5"))
        await asyncio.sleep(0)
        source.go.set()
        return await before, await after

    assert in_a_loop(ask()) == (5, -1)


def test_an_error_reaches_every_request_and_the_next_statement_is_tried(
    source: Source, open_reads: Open, in_a_loop: InLoop
) -> None:
    source.go.set()
    fails = [True]

    async def read(keys: Sequence[str]) -> dict[str, int]:
        if fails[0]:
            raise StoreError("away; try again")
        return await source.read(keys)

    async def ask() -> list[object]:
        reads = open_reads(read)
        refused = await asyncio.gather(reads.get("k1"), reads.get("k2"), return_exceptions=True)
        fails[0] = False
        return [*refused, await reads.get("k1")]

    one, two, value = in_a_loop(ask())
    assert (str(one), str(two), value) == ("away; try again", "away; try again", 1)


def test_a_client_that_leaves_takes_nothing_from_the_others(
    source: Source, open_reads: Open, in_a_loop: InLoop
) -> None:
    async def ask() -> int | None:
        reads = open_reads(source.read)
        leaves, stays = asyncio.create_task(reads.get("k3")), asyncio.create_task(reads.get("k3"))
        await begun(source)
        leaves.cancel()
        source.go.set()
        return await stays

    assert in_a_loop(ask()) == 3
    assert source.asked == [["k3"]]


def test_one_statement_takes_no_more_than_its_limit(source: Source, open_reads: Open, in_a_loop: InLoop) -> None:
    source.go.set()

    async def ask() -> list[int | None]:
        reads = open_reads(source.read)
        return list(await asyncio.gather(*(reads.get(f"k{n}") for n in range(150))))

    assert in_a_loop(ask()) == list(range(150))
    assert max(map(len, source.asked)) == MAX_JOINED
    assert sum(map(len, source.asked)) == 150
