"""A live calibration from its stream to the database: complete, interrupted, broken off, killed."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import nullcontext
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from instruments.clock import VirtualClock
from instruments.errors import LinkError
from labctl.answers.live import LiveResponse
from labctl.errors import BadInput, StoreError
from labctl.fitting.live import PoseRequest, Target
from labctl.recording import RecordingInfo, read_recording
from labctl.recording.line_stream import LineDecoder
from labctl.services.commands import open as opening
from labctl.services.commands.open import DatabaseCommands
from labctl.services.live.assessor import BackgroundAssessor, InlineAssessor
from labctl.services.live.calibrate import calibrate_live
from labctl.services.live.line_source import LineSource
from labctl.services.live.source import Block, StreamEnded
from labctl.services.recordings.live_folders import usual_folder
from labctl.store import open_store
from tests.helpers.turned_unit import TurnedUnit

INFO = RecordingInfo(
    serial="HAND-1", axes=("x", "y", "z"), kind="samples", motion="poses", started_at=datetime(2026, 1, 5, tzinfo=UTC)
)
TARGET = Target(u=1.5e-3, poses=18)


class TurnedSource:
    """A stream of a turned unit, which ends by an error after some blocks."""

    name, serial, is_simulated = "simulated", INFO.serial, True
    clock = VirtualClock()

    def __init__(self, seed: int, ends_after: int = 1000, error: BaseException | None = None) -> None:
        self.unit = TurnedUnit(seed)
        self.stopped = False
        self._left, self._error = ends_after, error or StreamEnded("the simulated stream has ended")

    def start(self) -> RecordingInfo:
        return INFO

    def read(self, duration_s: float) -> Block:
        if self._left == 0:
            raise self._error
        self._left -= 1
        return Block(self.unit.block(2 * duration_s))

    def ask(self, request: PoseRequest | None) -> None:
        self.unit.see(request)

    def stop(self) -> None:
        self.stopped = True


class Bench:
    """Runs live calibrations with a database of its own."""

    def __init__(self, folder: Path) -> None:
        self.database, self.folder = str(folder / "lab.sqlite"), folder / "live"
        self.said: list[str] = []

    def run(self, source: TurnedSource | LineSource, *, keep_folder: bool = False) -> LiveResponse:
        return calibrate_live(
            DatabaseCommands(self.database), source, TARGET, InlineAssessor(), self.folder, keep_folder=keep_folder,
            show=lambda _: None, say=self.said.append, attended=nullcontext(),
        )  # fmt: skip


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    return Bench(tmp_path)


@pytest.mark.slow
def test_a_complete_calibration_becomes_a_recording_and_the_version_that_was_shown(bench: Bench) -> None:
    source = TurnedSource(1)
    answer = bench.run(source)
    assert source.stopped
    assert (answer.complete, answer.ended, answer.missing) == (True, "complete", [])
    assert answer.fit is not None
    assert answer.fit.version == 1
    assert answer.fit.recording == answer.recording
    for each in answer.coefficients:
        stored = answer.fit.axes[each.axis]["coefficients"][each.name]
        assert stored["value"] == each.value
        assert stored["u"] is not None
        assert 2 * stored["u"] == each.expanded
    assert not bench.folder.exists()


@pytest.mark.parametrize(
    ("error", "ended", "text"),
    [
        (KeyboardInterrupt(), "interrupted", "the person at the terminal ended it"),
        (StreamEnded("standard input has ended"), "stream", "standard input has ended"),
        (LinkError("imu", "the link broke"), "stream", "imu: the link broke"),
    ],
    ids=["interrupt", "end", "link"],
)
def test_what_was_measured_until_then_is_a_recording(bench: Bench, error: BaseException, ended: str, text: str) -> None:
    source = TurnedSource(1, ends_after=60, error=error)
    answer = bench.run(source)
    assert source.stopped
    assert (answer.complete, answer.ended, answer.fit) == (False, ended, None)
    assert text in answer.text
    assert answer.readings == 60 * 50
    assert answer.missing[0].startswith(f"{18 - len(answer.poses)} of 18 poses are missing")
    again = TurnedSource(1)
    with open_store(bench.database, write=False) as store:
        stored = store.recordings.samples(answer.recording)
    assert len(stored) == answer.readings
    assert stored.columns["t_s"][-1] == pytest.approx(29.99)
    first = again.read(0.25).columns
    assert np.array_equal(stored.columns["gyro_x"][:50], first["gyro_x"])


def test_a_process_that_is_killed_leaves_a_recording(bench: Bench, tmp_path: Path) -> None:
    left = tmp_path / "left"

    class Killed(TurnedSource):
        def read(self, duration_s: float) -> Block:
            if self._left == 1:
                shutil.copytree(bench.folder, left)
            return super().read(duration_s)

    bench.run(Killed(1, ends_after=40))
    assert len(read_recording(left)) == 39 * 50


def test_a_stream_without_a_reading_leaves_nothing(bench: Bench) -> None:
    with pytest.raises(BadInput, match="the simulated stream has ended"):
        bench.run(TurnedSource(1, ends_after=0))
    with pytest.raises(KeyboardInterrupt):
        bench.run(TurnedSource(1, ends_after=0, error=KeyboardInterrupt()))
    assert bench.said == []
    assert not bench.folder.exists()


def test_readings_that_cannot_be_stored_stay_where_they_are(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise StoreError("the database is locked")

    monkeypatch.setattr(opening, "execute", refuse)
    with pytest.raises(StoreError):
        bench.run(TurnedSource(1, ends_after=10))
    assert bench.said == [f"the 500 readings so far are kept; import them with `labctl import {bench.folder}`"]
    assert len(read_recording(bench.folder)) == 500


def test_a_folder_that_exists_is_refused_before_the_stream_begins(bench: Bench) -> None:
    bench.folder.mkdir()
    (bench.folder / "notes.txt").write_text("mine")
    source = TurnedSource(1)
    with pytest.raises(BadInput, match="exists already and is not empty; name a new folder with --out"):
        bench.run(source)
    assert (bench.folder / "notes.txt").read_text() == "mine"


class Feed:
    """Lines that arrive in parts; None ends the stream, b"" is silence."""

    may_lose = False

    name = "feed"

    def __init__(self, parts: Iterator[bytes | None]) -> None:
        self._parts = parts

    def open(self) -> None:
        pass

    def take(self) -> bytes | None:
        return next(self._parts)

    def close(self) -> None:
        pass


def lines_of(seed: int, blocks: int) -> list[bytes]:
    unit, found = TurnedUnit(seed), list[bytes]()
    for _ in range(blocks):
        columns = unit.block(0.5)
        header = b"" if found else (",".join(columns) + "\n").encode()
        rows = zip(*(values.tolist() for values in columns.values()), strict=True)
        found.append(header + "".join(",".join(map(repr, row)) + "\n" for row in rows).encode())
    return found


def line_source(*parts: bytes | None) -> LineSource:
    return LineSource(Feed(iter(parts)), LineDecoder(), INFO, VirtualClock())


def test_damaged_lines_are_said_once_counted_and_stated_in_the_recording(bench: Bench) -> None:
    first, second = lines_of(1, 2)
    damaged = second.replace(b"\n", b"\nnonsense\n", 3)
    answer = bench.run(line_source(first, damaged, None), keep_folder=True)
    assert answer.damaged == 3
    assert answer.readings == 100
    assert answer.text == "feed has ended"
    assert bench.said == ["a line of the stream is left out: 1 values where 7 are expected: 'nonsense'"]
    info = read_recording(bench.folder).info
    assert info.unread.startswith("3 lines or frames of the stream could not be read; the first: 1 values")
    assert info.unread_share == pytest.approx(3 / 103)


def test_a_stream_that_falls_silent_is_said(bench: Bench) -> None:
    answer = bench.run(line_source(*lines_of(1, 2), *[b""] * 50))
    assert answer.text == "feed gave no reading for 10 s; check the sender"
    assert answer.readings == 100


def test_a_stream_that_never_begins_is_said_with_what_arrived(bench: Bench) -> None:
    with pytest.raises(
        BadInput, match=r"feed gave no reading for 60 s; what arrived is no reading: no JSON: '{'; check"
    ):
        bench.run(line_source(*[b"{\n"] * 300))


def test_a_header_that_does_not_suffice_is_refused(bench: Bench) -> None:
    with pytest.raises(BadInput, match="the lines have no gyro_x"):
        bench.run(line_source(b"t_s,a,b\n"))


def test_the_background_gives_the_same_states() -> None:
    from labctl.fitting.live import LiveCalibration

    live, unit, background = LiveCalibration(INFO, TARGET), TurnedUnit(1), BackgroundAssessor()
    live.add(unit.block(3.0))
    assert background.state(live) is None
    last = background.last(live)
    background.close()
    assert (last.rests, last.still_s) == (1, pytest.approx(3.0, abs=0.05))


def test_the_folder_is_beside_the_database() -> None:
    assert usual_folder("/data/lab.sqlite", "A", "1") == Path("/data/live-A-1")
    assert usual_folder("postgresql://host/lab", "A", "1").name == "live-A-1"
