"""Damage at random places of each kind of file: refused, or said with share and place, and what is left is right."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from labctl.errors import BadRecording
from labctl.recording import Recording
from tests.helpers.bags import bag, imported
from tests.helpers.lab import Lab
from tests.helpers.service import open_client
from tests.helpers.written_logs import at_rest, csv_text, resting_ulog

ROWS = at_rest(3000)
PLACES = 24


def csv(folder: Path) -> Path:
    """Write a CSV file."""
    path = folder / "a.csv"
    path.write_text(csv_text(ROWS), encoding="utf-8")
    return path


def parquet(folder: Path) -> Path:
    """Write a Parquet file whose pages have checksums."""
    names = ["time [s]", "gyro_x [deg/s]", "gyro_y [deg/s]", "gyro_z [deg/s]", "temp [degC]"]
    path = folder / "a.parquet"
    table = pa.table(dict(zip(names, ROWS.T, strict=True)))
    pq.write_table(table, path, compression="none", use_dictionary=False, write_page_checksum=True)
    return path


def ros2(folder: Path) -> Path:
    """Write a ROS 2 bag and return its data file."""
    bag(folder / "ros2", rows=ROWS)
    return next(iter(sorted((folder / "ros2").glob("*.db3")) or sorted((folder / "ros2").glob("*.mcap"))))


KINDS: dict[str, Callable[[Path], Path]] = {
    "CSV": csv,
    "Parquet": parquet,
    "ULog": lambda folder: resting_ulog(folder / "a.ulg", 3000),
    "ROS 1": lambda folder: bag(folder / "a.bag", rows=ROWS),
    "ROS 2": ros2,
}


def ends_of(kind: str, content: bytes) -> set[int]:
    """Return where the lines of a text, or the messages of a ULog, end."""
    if kind == "CSV":
        return {k + 1 for k, byte in enumerate(content) if byte == ord("\n")}
    ends, at = set[int](), 16
    while kind == "ULog" and at < len(content):
        at += 3 + content[at] + 256 * content[at + 1]
        ends.add(at)
    return ends


def read(path: Path) -> Recording | None:
    """Return what an import makes of a file; None where it is refused."""
    try:
        return imported(path.parent if path.suffix in {".db3", ".mcap"} else path)
    except BadRecording:
        return None


def is_part(found: Recording, whole: Recording) -> bool:
    """Return whether every reading found is one of the whole recording, at the same time since the first one found."""
    gyro, all_gyro = (np.column_stack([each.gyro_dps(axis) for axis in "xyz"]) for each in (found, whole))
    row = {tuple(reading): k for k, reading in enumerate(all_gyro.tolist())}
    at = [row.get(tuple(reading), -1) for reading in gyro.tolist()]
    return min(at) >= 0 and bool((np.diff(at) > 0).all())


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_damage_anywhere_is_refused_or_said_and_no_reading_is_invented(kind: str, tmp_path: Path) -> None:
    path = KINDS[kind](tmp_path)
    content, whole = path.read_bytes(), read(path)
    assert whole is not None
    assert whole.info.unread == ""
    draw, said = np.random.default_rng(5), 0
    for _ in range(PLACES):
        at = int(draw.integers(len(content) - 4096))
        path.write_bytes(content[:at] + draw.bytes(4096) + content[at + 4096 :])
        if (found := read(path)) is not None:
            said += 1
            assert found.info.unread, at
            assert 0 < (found.info.unread_share or 0) < 0.5
            assert is_part(found, whole), at
    assert said == PLACES or kind != "ULog"


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_a_file_that_is_cut_off_is_refused_or_says_so(kind: str, tmp_path: Path) -> None:
    path = KINDS[kind](tmp_path)
    content, whole = path.read_bytes(), read(path)
    assert whole is not None
    for at in np.random.default_rng(6).integers(len(content) // 2, len(content), PLACES).tolist():
        is_end = at in ends_of(kind, content)
        path.write_bytes(content[:at])
        if (found := read(path)) is not None and not is_end:  # nothing shows such a cut
            assert "its end is cut off, and what followed is lost" in found.info.unread, at
            assert is_part(found, whole)


def test_a_log_of_which_most_is_lost_is_refused(tmp_path: Path) -> None:
    path = resting_ulog(tmp_path / "a.ulg", 3000, instances=1)
    content = bytearray(path.read_bytes())
    content[2000 : len(content) * 3 // 4] = bytes(len(content) * 3 // 4 - 2000)
    path.write_bytes(content)
    with pytest.raises(BadRecording, match=r"7\d % of the file could not be read: bytes \d+ to .* at most 50% may be"):
        imported(path)


@pytest.mark.slow
def test_four_kilobytes_of_damage_cost_as_many_readings_and_the_answers_say_so(tmp_path: Path) -> None:
    path = resting_ulog(tmp_path / "a.ulg", 20_000, instances=1)
    content = bytearray(path.read_bytes())
    content[100_000:104_096] = np.random.default_rng(7).bytes(4096)
    path.write_bytes(content)
    lab = Lab(tmp_path)
    answer = lab.json("import", str(path), "--accept-map")
    assert 19_850 < answer["readings"] < 19_950
    (warning,) = [each for each in answer["warnings"] if each["what"] == "unread"]
    assert re.search(
        r"of the file could not be read: bytes \d+ to \d+ \([\d.]+ s to [\d.]+ s of its clock\)", warning["said"]
    )
    assert 0 < warning["value"] < 1
    said = lab.run("import", str(path), "--accept-map").stdout + lab.run("import", str(path), "--accept-map").stderr
    assert "of the file could not be read" in said.replace("\n", " ")
    with open_client(lab.database) as client:
        sent = client.post("/api/recordings/logs", files={"file": ("a.ulg", bytes(content))})
        assert sent.status_code == 201
        assert [each["what"] for each in sent.json()["warnings"]] == ["unread", "gaps"]
    criticised = lab.json("fit", answer["serial"], "--model", "bias")
    assert "unread" in [each["what"] for each in criticised["warnings"]]


def test_a_recording_in_csv_whose_last_number_is_cut_off_is_refused(tmp_path: Path) -> None:
    head = 'format = "labctl-recording/1"\nserial = "C-1"\naxes = ["z"]\nkind = "samples"\nmotion = "rest"\n'
    (tmp_path / "recording.toml").write_text(head + 'started_at = "2026-01-05T08:00:00Z"\n', encoding="utf-8")
    rows = "".join(f"1,{k / 100:.2f},{0.1 + k % 7 / 1000:.4f}\n" for k in range(200))
    (tmp_path / "samples.csv").write_text(("dataset,t_s,gyro_z\n" + rows)[:-3], encoding="utf-8")
    said = Lab(tmp_path / "lab").run("import", str(tmp_path), status=2).stderr
    assert "the last line has no line break and ends after" in said.replace("\n", " ")
