"""A date that no file states is not known, and nothing is computed by it; recordings of one occasion are no trend."""

from __future__ import annotations

import json
import os
import sqlite3
from contextlib import closing
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from labctl.recording import RecordingInfo, read_recording, write_recording
from labctl.recording.info import DATE_OF_FILE
from labctl.services.calibrations.stability import stability_of
from labctl.services.standards.usage import performed
from labctl.store import open_store
from tests.helpers.joint_recordings import EFFECTS, recording_of_day
from tests.helpers.lab import Lab

ADVICE = "import it again with `--option started_at=2026-01-05T08:00:00Z`"


def rest_log(path: Path, seed: int, first_s: float = 0.0, unit: str = "s") -> Path:
    """Write a log at rest without a date, whose file was written in 2001."""
    rng = np.random.default_rng(seed)
    rows = "\n".join(f"{first_s + k / 100:.6f},{rng.normal(0.1, 0.02):.6f},25.0" for k in range(6000))
    path.write_text(f"time [{unit}],gyro_z [deg/s],temperature [degC]\n{rows}\n", encoding="utf-8")
    os.utime(path, (1e9, 1e9))
    return path


def brought(lab: Lab, path: Path, *more: str) -> int:
    """Import a log and return its number."""
    return int(lab.json("import", str(path), "--accept-map", "--option", "serial=R-1", *more)["recording"])


def test_the_date_of_a_file_is_no_date_of_a_measurement(tmp_path: Path) -> None:
    lab, before = Lab(tmp_path), datetime.now(UTC)
    answer = lab.json("import", str(rest_log(tmp_path / "a.csv", 1)), "--accept-map", "--option", "serial=R-1")
    assert answer["measured_at"] is None
    (info,) = stored(lab)
    assert info["date_known"] is False
    assert before <= datetime.fromisoformat(info["started_at"]) <= datetime.now(UTC)
    said = lab.run("import", str(tmp_path / "a.csv"), "--accept-map", "--option", "serial=R-1").stdout
    assert f"the date of the measurement is not known; {ADVICE}" in said.replace("\n", " ")


def stored(lab: Lab) -> list[dict[str, object]]:
    """Return the heads in the database."""
    with closing(sqlite3.connect(lab.database)) as raw:
        return [json.loads(row[0]) for row in raw.execute("SELECT info FROM recordings ORDER BY id")]


def test_a_clock_that_was_never_set_gives_no_date(tmp_path: Path) -> None:
    lab = Lab(tmp_path)
    brought(lab, rest_log(tmp_path / "a.csv", 1, first_s=120.0, unit="epoch s"))
    brought(lab, rest_log(tmp_path / "b.csv", 1, first_s=1_750_000_000.0, unit="epoch s"))
    first, second = stored(lab)
    assert (first["date_known"], second["date_known"]) == (False, True)
    assert second["started_at"] == "2025-06-15T15:06:40Z"


@pytest.mark.slow
def test_the_trend_leaves_out_what_has_no_date_and_says_what_to_do(tmp_path: Path) -> None:
    lab = Lab(tmp_path)
    for seed in (1, 2, 3):
        brought(lab, rest_log(tmp_path / f"{seed}.csv", seed))
    lab.run("fit", "R-1", "--recording", "1", "--model", "bias")
    found = lab.json("trend", "R-1")
    assert (found["points"], found["drifts"], found["leaves"], found["undated"]) == ([], [], [], [1, 2, 3])
    assert found["text"][-1].startswith("Recordings 1, 2, 3 have no date of measurement")
    assert ADVICE in found["text"][-1]
    brought(lab, tmp_path / "1.csv", "--option", "started_at=2026-01-05T08:00:00Z")
    brought(lab, tmp_path / "2.csv", "--option", "started_at=2027-01-05T08:00:00Z")
    dated = lab.json("trend", "R-1")
    assert [point["at"] for point in dated["points"]] == ["2026-01-05T08:00:00Z", "2027-01-05T08:00:00Z"]
    assert [point["as_found"] for point in dated["points"]] == [None, None]  # version 1 has no date
    assert dated["drifts"]


def test_recordings_that_earlier_versions_dated_by_their_file_have_no_date() -> None:
    head = {"serial": "A", "axes": ("z",), "kind": "samples", "started_at": "2026-01-05T08:00:00Z"}
    assert RecordingInfo(**head).measured_at == datetime(2026, 1, 5, 8, tzinfo=UTC)  # type: ignore[arg-type]
    assert RecordingInfo(**head, notes=f"bench; the file contains no start time; {DATE_OF_FILE}").measured_at is None  # type: ignore[arg-type]
    assert RecordingInfo(**head, date_known=False).measured_at is None  # type: ignore[arg-type]


@pytest.mark.slow
@pytest.mark.parametrize("apart_days", [0.0, 10 / 86400, 0.02])
def test_recordings_that_overlap_or_are_close_are_no_trend(tmp_path: Path, apart_days: float) -> None:
    rng, lab = np.random.default_rng(9), Lab(tmp_path)
    for k in range(3):
        write_recording(recording_of_day(rng, k * apart_days), tmp_path / f"{k}")
        lab.run("import", str(tmp_path / f"{k}"))
    lab.run("fit", "J-1", "--recording", "1", "--effects", ",".join(EFFECTS))
    found = lab.json("trend", "J-1")
    assert (len(found["points"]), found["drifts"], found["leaves"]) == (3, [], [])
    assert any(
        line.startswith("Recordings 1, 2, 3 overlap in time or are less than 24 h apart") for line in found["text"]
    )


def test_an_export_keeps_that_the_date_is_not_known(tmp_path: Path) -> None:
    lab = Lab(tmp_path)
    number = brought(lab, rest_log(tmp_path / "a.csv", 1))
    lab.run("export", "recording", str(number), "--out", str(tmp_path / "out"))
    assert read_recording(tmp_path / "out").info.measured_at is None
    assert lab.json("import", str(tmp_path / "out"))["measured_at"] is None


def test_drift_and_days_of_a_version_without_a_date_are_not_known(tmp_path: Path) -> None:
    lab = Lab(tmp_path)
    brought(lab, rest_log(tmp_path / "a.csv", 1))
    lab.run("fit", "R-1", "--model", "bias")
    with open_store(str(lab.database), write=False) as store:
        assert performed(store, store.recordings.get(1)) == (None, None)
        assert store.certified_versions.of_unit("R-1", 1)[0].measured_at is None
        assert f"the date of its measurement is not known; {ADVICE}" in str(stability_of(store, "R-1", 1))
