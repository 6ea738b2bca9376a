"""Live calibrations of a service, one at a time: refused, ended by others, unwatched, stopped, broken off."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from instruments.clock import VirtualClock
from labctl.answers.campaigns import CampaignRequest
from labctl.answers.live import LiveEndRequest, LiveRequest, LiveStateResponse
from labctl.errors import BadInput, BenchBusy, Conflict, StoreError
from labctl.fitting.live import PoseRequest
from labctl.fitting.live.directions import DIRECTIONS, Direction
from labctl.services.campaigns.bench_runner import BenchRunner
from labctl.services.live import live_sessions
from labctl.services.live.assessor import InlineAssessor
from labctl.services.live.live_sessions import UNWATCHED_S, LiveSessions
from labctl.services.planning.loading import load_bench
from labctl.services.recordings.live_folders import usual_folder
from labctl.stop.latch import StopRequest
from labctl.store import Store
from labctl.store.connection.database import Database
from tests.helpers.paced_feed import PacedFeed
from tests.helpers.turned_unit import TurnedUnit
from tests.helpers.waiting import wait_until

REQUEST = LiveRequest(serial="HAND-1", address="tcp://127.0.0.1:1", poses=18, target_u=1.5e-3)


class Service:
    """Live sessions over a database and a simulated bench, with a clock that only the test advances."""

    def __init__(self, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self.folder, self._patch = folder, monkeypatch
        self.store = Store(Database(str(folder / "lab.sqlite"), write=True))
        self.clock = VirtualClock()
        self.runner = BenchRunner(self.store, load_bench("poses-sim"), VirtualClock)
        self.live = LiveSessions(self.store, self.clock, self.runner, VirtualClock)
        self._pool = ThreadPoolExecutor(1)
        self._feeds: list[PacedFeed] = []

    def feed(self, feed: PacedFeed) -> PacedFeed:
        """Have the next stream of the network be this one."""
        self._patch.setattr(live_sessions, "network_feed", lambda *_: feed)
        self._feeds.append(feed)
        return feed

    def until(self, holds: Callable[[LiveStateResponse], bool]) -> LiveStateResponse:
        return wait_until(self.live.listen, self.live.state, holds)

    def end(self, feed: PacedFeed, request: LiveEndRequest) -> LiveStateResponse:
        ending = self._pool.submit(self.live.end, request)
        feed.run_free()
        ending.result()
        return self.until(_is_over)

    def obey(self, unit: TurnedUnit) -> None:
        """Do what the newest state asks for."""
        moment = self.live.state().moment
        if moment is not None and moment.request is not None:
            unit.see(PoseRequest(_named(moment.request.name), 2.0))

    def close(self) -> None:
        self.live.end_soon()
        for feed in self._feeds:
            feed.run_free()
        self.live.close()
        self.runner.close()
        self.store.close()
        self._pool.shutdown()


def _is_over(state: LiveStateResponse) -> bool:
    return state.stage in ("done", "ended", "failed")


def _has(readings: int) -> Callable[[LiveStateResponse], bool]:
    return lambda state: state.moment is not None and state.moment.readings >= readings


@pytest.fixture
def service(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Service]:
    monkeypatch.setattr(live_sessions, "BackgroundAssessor", InlineAssessor)  # the stream waits: it is no real one
    made = Service(tmp_path, monkeypatch)
    yield made
    made.close()


def test_a_stream_that_breaks_off_leaves_its_recording_and_no_version(service: Service) -> None:
    feed = service.feed(PacedFeed())
    begun = service.live.start(REQUEST)
    assert (begun.stage, begun.serial, begun.bench, begun.number) == ("running", "HAND-1", "", 1)
    feed.allow(12)
    feed.break_off()
    over = service.until(_is_over)
    assert feed.closed
    assert (over.stage, over.text, over.kept) == ("ended", "paced feed has ended", [])
    assert over.result is not None
    assert (over.result.ended, over.result.fit, over.result.readings) == ("stream", None, 600)
    assert len(service.store.recordings.samples(over.result.recording)) == 600
    assert list(service.folder.glob("live-*")) == []


def test_a_unit_that_is_never_still_is_told_so_and_gets_no_version(service: Service) -> None:
    """It turns about x without an end, as fast as 90 deg/s."""

    def turning(columns: Any) -> Any:
        t_s = columns["t_s"]
        angle = np.radians(90 * t_s)
        still = np.zeros(len(t_s))
        force = {"accel_x_g": still, "accel_y_g": np.sin(angle), "accel_z_g": np.cos(angle)}
        return {"t_s": t_s, "gyro_x": still + 90.0, "gyro_y": still, "gyro_z": still, **force}

    feed = service.feed(PacedFeed(change=turning))
    service.live.start(REQUEST)
    feed.allow(24)
    moment = service.until(_has(900)).moment
    assert moment is not None
    assert (moment.still_s, moment.poses, moment.coefficients) == (0.0, [], [])
    assert moment.missing[0].startswith("18 of 18 poses are missing")
    assert "rest" in moment.missing[1]
    over = service.end(feed, LiveEndRequest(fit=True, reason="enough"))
    assert over.stage == "ended"
    assert over.result is not None
    assert over.result.fit is None
    assert "rest" in over.result.refused
    assert over.text == "labctl ended it: enough"


def test_a_wrong_pose_is_said_with_its_angle_and_is_not_the_one_that_was_asked_for(service: Service) -> None:
    feed = service.feed(PacedFeed())
    wrong = next(each for each in DIRECTIONS if each.name == "x,y")
    feed.unit.see(PoseRequest(wrong, 2.0))  # the person reads nothing, and lays it on an edge
    service.live.start(REQUEST)
    feed.allow(30)
    moment = service.until(lambda state: state.moment is not None and "x,y" in state.moment.poses).moment
    assert moment is not None
    assert moment.request is not None
    assert moment.request.name != "x,y"
    assert not moment.request.covered
    asked, now = np.array(moment.request.up), np.array(wrong.up)
    assert moment.off_deg == pytest.approx(np.degrees(np.arccos(asked @ now)), abs=12.0)
    assert moment.off_deg > 17.0
    assert [each.name for each in moment.pose_list if each.covered] == moment.poses


@pytest.mark.slow
def test_a_person_ends_it_early_with_a_version(service: Service) -> None:
    feed = service.feed(PacedFeed())
    feed.turn = service.obey
    service.live.start(REQUEST.model_copy(update={"target_u": 1e-6, "poses": 12}))
    feed.run_free()
    service.until(lambda state: state.moment is not None and state.moment.fits > 1)
    over = service.end(feed, LiveEndRequest(fit=True))
    assert (over.stage, over.text) == ("done", "labctl ended it")
    assert over.result is not None
    assert over.result.fit is not None
    assert (over.result.complete, over.result.ended, over.result.fit.version) == (False, "interrupted", 1)
    for each in over.result.coefficients:
        assert 2 * over.result.fit.axes[each.axis]["coefficients"][each.name]["u"] == each.expanded


def _named(name: str) -> Direction:
    return next(each for each in DIRECTIONS if each.name == name)


def test_it_goes_on_unwatched_unless_the_person_wanted_its_end(service: Service) -> None:
    feed = service.feed(PacedFeed())
    service.live.start(REQUEST)
    service.clock.sleep(10 * UNWATCHED_S)
    feed.allow(4)
    assert service.until(_has(100)).stage == "running"
    service.end(feed, LiveEndRequest())

    feed = service.feed(PacedFeed())
    service.live.start(REQUEST.model_copy(update={"end_unwatched": True}))
    service.clock.sleep(UNWATCHED_S - 1)
    service.live.state(watched=True)
    service.clock.sleep(UNWATCHED_S - 1)
    feed.allow(4)
    assert service.until(_has(100)).stage == "running"
    service.clock.sleep(2)
    feed.run_free()
    over = service.until(_is_over)
    assert over.text == "no page had followed it for 30 s, and it was to end then"
    assert over.result is not None
    assert over.result.readings >= 100


def test_one_at_a_time_and_only_one_has_the_bench(service: Service) -> None:
    feed = service.feed(PacedFeed())
    service.live.start(REQUEST)
    with pytest.raises(Conflict, match="a live calibration of HAND-1 runs in this service now; wait for its end"):
        service.live.start(LiveRequest())
    service.runner.start(CampaignRequest(recipe="by-hand"))  # a stream of the network does not have the bench
    service.end(feed, LiveEndRequest())
    with pytest.raises(BenchBusy, match="bench poses-sim runs campaign 1 now"):
        service.live.start(LiveRequest())


def test_while_it_has_the_bench_no_campaign_begins_and_a_stop_ends_it(service: Service) -> None:
    begun = service.live.start(LiveRequest())
    assert (begun.serial, begun.bench) == ("IMU-0001", "poses-sim")
    assert service.runner.describe().live == "IMU-0001"
    assert not service.runner.free
    with pytest.raises(BenchBusy, match="bench poses-sim: unit IMU-0001 is being calibrated live; wait for its end"):
        service.runner.start(CampaignRequest(recipe="by-hand"))
    service.until(_has(100))
    stopping = service.runner.stops.request(StopRequest.new("Ann", "", "smoke", None))
    assert stopping.is_over(10.0)
    over = service.until(_is_over)
    assert (over.stage, over.text) == ("ended", "the bench was stopped")
    assert over.result is not None
    assert service.store.recordings.samples(over.result.recording) is not None
    assert service.runner.describe().live == ""


def test_the_end_of_the_service_stores_what_was_measured(service: Service) -> None:
    service.live.start(LiveRequest())
    service.until(_has(100))
    service.live.close()
    over = service.live.state()
    assert (over.stage, over.text) == ("ended", "the service ended")
    with pytest.raises(Conflict, match="the service ends, and begins no live calibration"):
        service.live.start(LiveRequest())


def test_readings_that_cannot_be_stored_are_kept_and_said(service: Service, monkeypatch: pytest.MonkeyPatch) -> None:
    class Refusing:
        def __init__(self, *_: object) -> None:
            pass

        def execute(self, *_: object) -> None:
            raise StoreError("the database is locked")

    monkeypatch.setattr(live_sessions, "LocalExecutor", Refusing)
    feed = service.feed(PacedFeed())
    service.live.start(REQUEST)
    feed.allow(4)
    feed.break_off()
    over = service.until(_is_over)
    assert over.stage == "failed"
    assert "the database is locked" in over.text
    (folder,) = over.kept
    assert folder == str(next(service.folder.glob("live-HAND-1-*")))
    again = LiveSessions(service.store, service.clock, service.runner)
    assert again.state().kept == [folder]


@pytest.mark.parametrize(
    ("request_", "said"),
    [
        (LiveRequest(address="tcp://127.0.0.1:1"), "the stream does not say which unit it is; give its serial number"),
        (
            LiveRequest(address="sctp://x:1", serial="A"),
            "sctp://x:1: no address of a stream; give tcp:// or udp://HOST:PORT",
        ),
        (LiveRequest(serial="B"), "B: bench poses-sim has no such unit; choose one of IMU-0001"),
        (LiveRequest(poses=3), "--poses 3: give 12 to 26"),
    ],
)
def test_what_cannot_be_is_refused_and_the_bench_is_free(service: Service, request_: LiveRequest, said: str) -> None:
    with pytest.raises(BadInput, match=said):
        service.live.start(request_)
    assert service.runner.free
    assert service.live.state().stage == "idle"


def test_ending_without_a_session_is_a_conflict(service: Service) -> None:
    with pytest.raises(Conflict, match="no live calibration runs in this service"):
        service.live.end(LiveEndRequest())


def test_the_folder_of_any_serial_number_is_beside_the_database() -> None:
    assert usual_folder("/data/lab.sqlite", "IMU #1/..", "1") == Path("/data/live-IMU__1_..-1")
