"""Clients that follow one campaign: one query for all, never an old status after the bell, each receives everything."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

from labctl.services.campaigns.event_stream import MIN_S, Bell, CampaignEventStream, StatusCache

Loop = Callable[[Any], Any]


def test_a_moment_is_looked_up_once_for_all_who_ask(in_a_loop: Loop) -> None:
    asked: list[str] = []

    async def crowd() -> list[int]:
        glances = StatusCache()
        return await asyncio.gather(*(glances.at("it", lambda: asked.append("it") or 7) for _ in range(50)))

    assert in_a_loop(crowd()) == [7] * 50
    assert len(asked) <= 2  # two where the moment ends in between


def test_after_the_bell_everybody_looks_anew(in_a_loop: Loop) -> None:
    state = ["running"]

    async def two() -> tuple[str, str]:
        glances = StatusCache()
        before = await glances.at("it", lambda: state[0])
        state[0] = "done"
        glances.ring()
        return before, await glances.at("it", lambda: state[0])

    assert in_a_loop(two()) == ("running", "done")


def test_one_who_leaves_takes_nothing_from_the_others(in_a_loop: Loop) -> None:
    async def leaving() -> int:
        glances, may = StatusCache(), asyncio.Event()
        loop = asyncio.get_running_loop()

        def look() -> int:
            asyncio.run_coroutine_threadsafe(may.wait(), loop).result()
            return 7

        first = asyncio.create_task(glances.at("it", look))
        second = asyncio.create_task(glances.at("it", look))
        await asyncio.sleep(0)
        first.cancel()
        may.set()
        return await second

    assert in_a_loop(leaving()) == 7


def test_what_cannot_be_read_is_said_to_everybody(in_a_loop: Loop) -> None:
    def look() -> int:
        raise OSError("no disk")

    async def both() -> list[Any]:
        glances = StatusCache()
        return await asyncio.gather(glances.at("it", look), glances.at("it", look), return_exceptions=True)

    assert [str(each) for each in in_a_loop(both())] == ["no disk", "no disk"]


@pytest.mark.parametrize("onlookers", [1, 30])
def test_the_store_is_read_as_often_for_many_as_for_one(
    onlookers: int, monkeypatch: pytest.MonkeyPatch, in_a_loop: Loop
) -> None:
    monkeypatch.setattr("labctl.services.campaigns.event_stream.FRESH_S", 1e9)  # only the bell ends a moment here
    monkeypatch.setattr("labctl.services.campaigns.event_stream.event_answer", lambda row: row)
    rows = [SimpleNamespace(id=1)]
    state, reads, bells = ["running"], [], []

    def events(campaign: int, after: int) -> list[Any]:
        reads.append(campaign)
        return [row for row in rows if row.id > after]

    campaigns = SimpleNamespace(state=lambda campaign: state[0], events=events)
    store: Any = SimpleNamespace(campaigns=campaigns)

    def listen(bell: Any) -> Any:
        bells.append(bell)
        return lambda: bells.remove(bell)

    async def watched() -> list[list[int]]:
        followers = CampaignEventStream(store, lambda campaign: (campaign, state[0]), listen)  # type: ignore[arg-type,return-value]

        async def one() -> list[int]:
            return [reported.id async for reported in followers.follow(1, 0, lambda: False) if hasattr(reported, "id")]

        looking = [asyncio.create_task(one()) for _ in range(onlookers)]
        while not reads and not any(onlooker.done() for onlooker in looking):
            await asyncio.sleep(0)
        rows.append(SimpleNamespace(id=2))
        state[0] = "done"
        for bell in bells:
            bell()
        return await asyncio.gather(*looking)

    assert in_a_loop(watched()) == [[1, 2]] * onlookers
    assert len(reads) == 2
    assert len(bells) == 1  # that of the followers as a whole: a follower that left gets no bell


def test_changes_that_follow_each_other_quickly_are_one_to_a_client(
    in_a_loop: Loop, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A bench in virtual time reports hundreds of changes a second; each costs a client a look into the database."""

    async def rung() -> tuple[int, bool, bool]:
        loop, calls = asyncio.get_running_loop(), []
        wake = loop.call_soon_threadsafe
        monkeypatch.setattr(loop, "call_soon_threadsafe", lambda *call: (calls.append(call), wake(*call)))
        bell, began_s = Bell(), loop.time()
        for _ in range(1000):
            bell.ring()
        heard = await bell.rings()
        late = loop.time() - began_s >= 0.9 * MIN_S
        bell.clear()
        bell.ring()
        return len(calls), heard, late

    assert in_a_loop(rung()) == (2, True, True)


def test_whether_the_service_ends_is_asked_beside_the_loop_which_may_not_wait_for_another_process(
    in_a_loop: Loop,
) -> None:
    asked: list[bool] = []
    campaigns = SimpleNamespace(state=lambda _: "running", events=lambda *_: [])
    store: Any = SimpleNamespace(campaigns=campaigns)

    def over() -> bool:
        asked.append(threading.current_thread() is threading.main_thread())
        return True

    async def followed() -> list[Any]:
        stream = CampaignEventStream(store, lambda campaign: campaign, None)  # type: ignore[arg-type,return-value]
        return [update async for update in stream.follow(7, 0, over)]

    assert in_a_loop(followed()) == [7]
    assert asked == [False]
