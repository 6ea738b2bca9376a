"""`labctl live` from its arguments to what it prints."""

from __future__ import annotations

import json
import signal
from pathlib import Path

import pytest

import instruments.clock
from instruments.clock import VirtualClock
from labctl.fitting.live import PoseRequest
from labctl.fitting.live.directions import DIRECTIONS
from labctl.services.live import feeds
from tests.helpers.lab import Lab
from tests.helpers.patience import WAIT_S
from tests.helpers.processes import begin, kill, labctl
from tests.helpers.turned_unit import TurnedUnit

NAMES = ("t_s", *(f"gyro_{a}" for a in "xyz"), *(f"accel_{a}_g" for a in "xyz"))


class TurnedFeed:
    """Lines of a unit that is turned from face to edge to face, whatever is asked for."""

    may_lose = False

    name = "standard input"

    def __init__(self, blocks: int) -> None:
        self._unit, self._left, self._places = TurnedUnit(1), blocks, 0

    def open(self) -> None:
        pass

    def take(self) -> bytes | None:
        if self._left == 0:
            return None
        self._left -= 1
        pose = DIRECTIONS[self._places * 7 % 18]  # every one of the first 18, in some order
        self._unit.see(PoseRequest(pose, 2.0))
        columns = self._unit.block(4.65)  # from rest to rest
        self._places += 1
        rows = zip(*(columns[name].tolist() for name in NAMES), strict=True)
        return "".join(",".join(map(repr, row)) + "\n" for row in rows).encode()

    def close(self) -> None:
        pass


@pytest.fixture
def lab(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Lab:
    monkeypatch.setattr(instruments.clock, "SystemClock", VirtualClock)
    return Lab(tmp_path)


@pytest.mark.slow
def test_a_stream_of_lines_to_a_version(lab: Lab, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(feeds, "feed_of", lambda *_: TurnedFeed(40))
    answer = lab.json("live", "IMU-1", "--lines", "-", "--columns", ",".join(NAMES), "--target", "0.002")
    assert answer["complete"]
    assert answer["fit"]["version"] == 1
    assert lab.json("calibration", "IMU-1", "--version", "1")["version"] == 1
    assert list(lab.folder.glob("live-*")) == []


def test_an_incomplete_one_says_what_is_missing_and_keeps_the_recording(
    lab: Lab, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(feeds, "feed_of", lambda *_: TurnedFeed(6))
    out = lab.folder / "kept"
    found = lab.run(
        "live", "IMU-1", "--lines", "-", "--columns", ",".join(NAMES), "--out", str(out), status=1
    )  # fmt: skip
    assert "next: turn the unit until it lies with body ax" in found.stderr
    assert "recording 1 of IMU-1: 2790 readings in 28 s" in found.stdout
    assert "not complete: standard input has ended" in found.stdout
    assert "of 18 poses are missing, by the axes that point up:" in found.stdout
    assert sorted(path.name for path in out.iterdir()) == ["recording.toml", "samples.csv"]
    (row,) = lab.json("export", "recording", "1", "--out", str(lab.folder / "again"))["files"][:1]
    assert row


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((), "name the stream of the unit by one of --bench FILE, --driver NAME with --port, or --lines SOURCE"),
        (("--bench", "by-hand-sim", "--driver", "stim300"), "by one of --bench FILE"),
        (("--lines", "-"), "give its serial number: labctl live SERIAL --lines ..."),
        (
            ("A", "--lines", "sctp://x:1"),
            "sctp://x:1: no address of a stream; give tcp:// or udp://HOST:PORT, ws://HOST:PORT",
        ),
        (("A", "--driver", "stim300"), "--driver needs the serial number of the unit and its --port"),
        (("--bench", "by-hand-sim"), "driver stim300 gives no accel_x_g, accel_y_g, accel_z_g"),
        (("B", "--bench", "by-hand-sim"), "B: bench by-hand-sim has no such unit; choose one of STIM-0001"),
        (
            ("A", "--driver", "stim300", "--port", "sim://stim300/unit", "--option", "x"),
            "--option x: write KEY=VALUE",
        ),
        (("A", "--driver", "nothing", "--port", "sim://stim300/unit"), "nothing"),
        (("A", "--lines", "-", "--target", "-1"), "--target -1: an uncertainty must be above 0"),
    ],
)
def test_wrong_use_is_one_clear_line(lab: Lab, arguments: tuple[str, ...], said: str) -> None:
    found = lab.run("live", *arguments, status=2)
    assert said in found.stderr
    assert found.stderr.count("\n") == 1
    assert not lab.database.exists()


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_it_and_keeps_what_was_read(tmp_path: Path, number: signal.Signals) -> None:
    process = begin(labctl(tmp_path / "lab.sqlite", "live", "--bench", "poses-sim", "--speed", "20", "--json"))
    try:
        assert process.stderr is not None
        while "1 of 18 poses" not in (line := process.stderr.readline()):  # one pose is covered
            assert line
        process.send_signal(number)
        out, _ = process.communicate(timeout=WAIT_S)
    finally:
        kill(process)
    answer = json.loads(out)
    assert process.returncode == 1
    assert (answer["ended"], answer["complete"], answer["recording"]) == ("interrupted", False, 1)
    assert answer["readings"] > 200
    assert list(tmp_path.glob("live-*")) == []
