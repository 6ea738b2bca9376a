"""What a killed live calibration left: who says it, when, and when not."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

import instruments.clock
from instruments.clock import VirtualClock
from labctl.recording import RecordingInfo
from labctl.recording.files import HEAD
from labctl.services.live import feeds
from labctl.services.live.calibrate import Spool
from labctl.services.live.live_sessions import LiveSessions
from labctl.services.live.source import Block
from labctl.services.recordings.live_folders import SAMPLES, kept_beside, usual_folder
from labctl.store import open_store
from tests.helpers.lab import Lab
from tests.helpers.log_records import logged

INFO = RecordingInfo(
    serial="HAND 1", axes=("x", "y", "z"), kind="samples", motion="poses", started_at=datetime(2026, 1, 5, tzinfo=UTC)
)


def _block(n: int) -> Block:
    names = (*(f"gyro_{a}" for a in "xyz"), *(f"accel_{a}_g" for a in "xyz"))
    return Block({"t_s": np.arange(n) / 100, **{name: np.ones(n) for name in names}})


@pytest.fixture
def lab(tmp_path: Path) -> Lab:
    return Lab(tmp_path)


@pytest.fixture
def left(lab: Lab) -> Path:
    """The folder of a session that was killed after 40 readings, in the middle of a line."""
    folder = usual_folder(str(lab.database), INFO.serial, "20260105T000000Z")
    with Spool(folder) as spool:
        spool.add(INFO, _block(40))
    with (folder / SAMPLES).open("ab") as samples:
        samples.write(b"1,0.4,1.0,1")
    return folder


def _line(folder: Path) -> str:
    return (
        "40 readings of HAND 1 that a live calibration left are in no recording; import them with `labctl import "
        f"{folder}`, then remove the folder"
    )


def test_check_says_them_until_they_are_imported(lab: Lab, left: Path) -> None:
    lab.run("effects")
    with open_store(str(lab.database), write=True):
        pass
    assert _line(left) in lab.run("check").stdout.splitlines()
    assert lab.json("check")["kept_readings"] == [_line(left)]
    samples = left / SAMPLES
    samples.write_bytes(samples.read_bytes().rpartition(b"\n")[0] + b"\n")  # as the import asks for
    lab.run("import", str(left))
    assert lab.json("check")["kept_readings"] == []


def test_the_next_live_calibration_says_them(lab: Lab, left: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class Ended:
        name = "standard input"

        def open(self) -> None: ...
        def close(self) -> None: ...
        def take(self) -> None: ...

    monkeypatch.setattr(instruments.clock, "SystemClock", VirtualClock)
    monkeypatch.setattr(feeds, "feed_of", lambda *_: Ended())
    said = lab.run("live", "HAND-2", "--lines", "-", "--rate", "100", status=2).stderr.splitlines()
    assert said[0] == f"labctl: {_line(left)}"
    assert not lab.database.exists()


def test_a_service_says_them_when_it_starts(lab: Lab, left: Path) -> None:
    with open_store(str(lab.database), write=True) as store, logged(lab.folder) as records:
        live = LiveSessions(store, VirtualClock(), None)
        assert live.state().kept == [str(left)]
    assert [each["text"] for each in records.named("live.kept")] == [_line(left)]


def test_a_folder_that_a_session_uses_is_not_said_and_one_that_it_gave_up_is(lab: Lab) -> None:
    folder = usual_folder(str(lab.database), "A", "1")
    with Spool(folder) as spool:
        spool.add(INFO, _block(3))
        assert kept_beside(str(lab.database)) == []
        spool.close()  # its stream has ended; the readings are being imported
        assert kept_beside(str(lab.database)) == []
    (kept,) = kept_beside(str(lab.database))
    assert (kept.folder, kept.serial, kept.readings) == (folder, "HAND 1", 3)


def test_a_folder_without_a_reading_or_with_a_damaged_head(lab: Lab, left: Path) -> None:
    (left / HEAD).write_text("serial = ")
    empty = usual_folder(str(lab.database), "B", "1")
    empty.mkdir()
    (empty / HEAD).write_text("")
    (empty / SAMPLES).write_text("dataset,t_s\n")
    (kept,) = kept_beside(str(lab.database))
    assert (kept.folder, kept.serial, kept.readings) == (left, "", 40)
    assert kept.text.startswith("40 readings that a live calibration left")
