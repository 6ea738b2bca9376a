"""The client of a service: typed answers, ETag, an event stream that breaks, refusals and silence."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest

from instruments.clock import VirtualClock
from labctl.client import (
    CampaignRequest,
    CampaignResponse,
    Client,
    EventResponse,
    FitRequest,
    ScheduledResponse,
    ServiceRefused,
)
from labctl.client.campaigns import RECONNECT_AFTER_S
from labctl.compensator import Compensator
from labctl.errors import BadRecording, StoreError
from tests.helpers.paths import EXAMPLES
from tests.helpers.service import open_client, transport_to

FOG = "OSU-FOG-2024"


@pytest.fixture
def client(tmp_path: Path) -> Iterator[Client]:
    with (
        open_client(tmp_path / "lab.sqlite") as inside,
        Client("http://testserver", transport=transport_to(inside)) as made,
    ):
        made.import_recording(EXAMPLES / "osu-fog")
        made.fit(FOG, FitRequest(effects=["bias", "scale_factor"]))
        yield made


def test_units_recordings_and_versions_are_listed(client: Client) -> None:
    assert FOG in [unit.serial for unit in client.units()]
    assert client.unit(FOG).calibrations == [1]
    assert [row.serial for row in client.recordings()][-1] == FOG
    assert [row.version for row in client.calibrations(FOG)] == [1]


def test_a_calibration_that_is_held_is_not_fetched_again(client: Client) -> None:
    file = client.calibration(FOG, 1)
    assert client.calibration(FOG, 1, held=file) is file
    assert file.etag == f'"{file.calibration.hash}"'
    assert Compensator.from_bytes(file.content).axes == ("z",)
    header = client.calibration(FOG, 1, file_format="c", held=file)
    assert (header.media_type.partition(";")[0], header.content[:2]) == ("text/x-c", b"/*")


@pytest.mark.parametrize(("timeout_s", "asked"), [(20.0, 4), (8.0, 3)])
def test_a_service_that_is_busy_is_asked_again_when_it_says(timeout_s: float, asked: int) -> None:
    bodies: list[bytes] = []
    busy = [{"retry-after": "3"}, {}, {"retry-after": "5"}]

    def answer(request: httpx.Request) -> httpx.Response:
        bodies.append(request.read())
        if len(bodies) <= len(busy):
            problem = {"type": "urn:labctl:problem:too-busy", "detail": "24 computations wait"}
            return httpx.Response(429, json=problem, headers=busy[len(bodies) - 1])
        return httpx.Response(201, json={"serial": FOG, "recording": 7, "datasets": 1, "readings": 2, "warnings": []})

    clock = VirtualClock()
    began_s = clock.now_s()
    with Client("http://busy", timeout_s=timeout_s, transport=httpx.MockTransport(answer), clock=clock) as client:
        if asked > len(busy):
            assert client.import_recording(EXAMPLES / "osu-fog").recording == 7
        else:
            with pytest.raises(ServiceRefused, match="24 computations wait") as refused:
                client.import_recording(EXAMPLES / "osu-fog")
            assert refused.value.status == 429
    assert clock.now_s() - began_s == (9.0 if asked == 4 else 4.0)
    assert len(bodies) == asked
    assert len({len(body) for body in bodies}) == 1  # each time the whole recording was sent
    assert len(bodies[0]) > 10_000


def test_a_refusal_has_the_services_words_and_a_slug_for_programs(client: Client) -> None:
    with pytest.raises(ServiceRefused, match="unit 'X'") as unknown:
        client.unit("X")
    assert (unknown.value.status, unknown.value.slug) == (404, "not-found")
    with pytest.raises(ServiceRefused) as uncertified:
        client.calibration(FOG)
    assert (uncertified.value.slug, uncertified.value.exit_status) == ("not-certified", 1)


@pytest.mark.slow
def test_a_folder_without_a_recording_is_not_sent(client: Client, tmp_path: Path) -> None:
    with pytest.raises(BadRecording, match="no recording there"):
        client.import_recording(tmp_path)


@pytest.mark.slow
def test_a_campaign_is_started_watched_and_found(client: Client) -> None:
    begun = client.start_campaign(CampaignRequest(recipe="short"))
    assert isinstance(begun, CampaignResponse)
    reported = list(client.watch(begun.id))
    events = [each for each in reported if isinstance(each, EventResponse)]
    assert [event.id for event in events] == sorted(event.id for event in events)
    assert any("campaign done" in event.message for event in events)
    assert client.campaign(begun.id).state == "done"
    assert begun.id in [each.id for each in client.campaigns()]
    assert begun.id in [each.id for each in client.campaigns(search="SHORT", limit=1)]
    assert client.campaigns(search="no & such=recipe") == []
    (serial, recording), *_ = client.campaign(begun.id).recordings.items()
    assert [each.id for each in client.recordings(unit=serial, search=serial[:3], limit=1)] == [recording]
    assert client.recordings(unit=serial[:3]) == []
    assert [each.serial for each in client.units(search=serial[1:])] == [serial]
    assert client.units(search="%") == []
    later = [each for each in client.watch(begun.id, after=events[-2].id) if isinstance(each, EventResponse)]
    assert later == events[-1:]


@pytest.mark.slow
def test_a_later_start_is_an_entry_of_the_schedule_and_an_abort_names_its_reason(client: Client) -> None:
    later = client.start_campaign(CampaignRequest(recipe="short", cron="30 2 * * MON", time_zone="UTC"))
    assert isinstance(later, ScheduledResponse)
    begun = client.start_campaign(CampaignRequest(recipe="table1-x-table2", clip=True))
    assert client.abort(begun.id, "wrong recipe", by="Ada").id == begun.id
    list(client.watch(begun.id))
    ended = client.campaign(begun.id)
    assert (ended.state, ended.reason) == ("aborted", "aborted: wrong recipe (Ada)")


EVENT = '"at":"2026-01-01T00:00:00Z","t_s":1.0,"kind":"note","level":"info","message":"m"'


class Breaking(httpx.SyncByteStream):
    """One event, then the connection breaks."""

    def __init__(self, number: int) -> None:
        self._text = f'id: {number}\nevent: note\ndata: {{"id":{number},{EVENT}}}\n\n'

    def __iter__(self) -> Iterator[bytes]:
        yield self._text.encode()
        raise httpx.ReadError("broken")


def test_a_broken_stream_goes_on_behind_the_last_event() -> None:
    asked: list[str | None] = []

    def answer(request: httpx.Request) -> httpx.Response:
        after = request.headers.get("last-event-id")
        asked.append(after)
        if after == "3":
            return httpx.Response(200, text="", headers={"content-type": "text/event-stream"})
        stream = Breaking(int(after or 0) + 1)
        return httpx.Response(200, stream=stream, headers={"content-type": "text/event-stream"})

    clock = VirtualClock()
    with Client("http://bench", transport=httpx.MockTransport(answer), clock=clock) as client:
        assert [update.id for update in client.watch(7)] == [1, 2, 3]
    assert (asked, clock.now_s()) == ([None, "1", "2", "3"], 3 * RECONNECT_AFTER_S[0])


def test_a_service_that_stays_silent_is_an_error_that_says_what_to_check() -> None:
    def answer(request: httpx.Request) -> httpx.Response:
        raise httpx.ConnectError("refused")

    clock = VirtualClock()
    with Client("http://bench", transport=httpx.MockTransport(answer), clock=clock) as client:
        with pytest.raises(StoreError, match=r"http://bench does not answer .*check that `labctl serve` runs"):
            client.units()
        with pytest.raises(StoreError, match="does not answer"):
            list(client.watch(1))
    assert clock.now_s() == sum(RECONNECT_AFTER_S)
