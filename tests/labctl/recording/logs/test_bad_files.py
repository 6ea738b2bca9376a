"""Bad files of 40 kinds: one clear line each, exit 2, nothing kept."""

from __future__ import annotations

import gzip
import io
import os
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from labctl.errors import BadInput, LabctlError
from labctl.recording.column_map import parse_map
from labctl.services.recordings.importers import as_interchange
from tests.helpers.written_logs import HEADER, at_rest, csv_text, in_poses, moved, resting_ulog

ROWS = at_rest()
GOOD = csv_text(ROWS)
LINES = GOOD.splitlines()
GYROS = "gyro_x (deg/s),gyro_y (deg/s),gyro_z (deg/s)"


def text(path: Path, content: str, encoding: str = "utf-8") -> Path:
    path.write_text(content, encoding=encoding)
    return path


def with_line(number: int, line: str) -> str:
    """The good file with another line in place of one, from 0."""
    return "\n".join([*LINES[:number], line, *LINES[number + 1 :]]) + "\n"


def with_cell(row: int, column: int, cell: str) -> str:
    cells = LINES[row].split(",")
    return with_line(row, ",".join([*cells[:column], cell, *cells[column + 1 :]]))


def zipped(content: bytes, name: str = "log.csv") -> bytes:
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        archive.writestr(name, content)
    return packed.getvalue()


def sparse(path: Path) -> Path:
    with path.open("wb") as file:
        file.write(GOOD.encode())
        os.truncate(path, 2 << 30)
    return path


def parquet(path: Path, **columns: object) -> Path:
    pq.write_table(pa.table(columns), path)
    return path


def raw(path: Path, content: bytes) -> Path:
    path.write_bytes(content)
    return path


def truncated_ulog(path: Path) -> Path:
    whole = resting_ulog(path).read_bytes()
    path.write_bytes(whole[:20])
    return path


FILES: dict[str, tuple[Callable[[Path], Path], str]] = {
    "empty": (lambda p: raw(p / "a.csv", b""), "the file is empty"),
    "only empty lines": (lambda p: text(p / "a.csv", "\n\n\n"), "only empty lines"),
    "only a header": (lambda p: text(p / "a.csv", HEADER + "\n"), "no row of numbers"),
    "one row": (lambda p: text(p / "a.csv", "\n".join(LINES[:2]) + "\n"), "1 row of readings"),
    "binary": (lambda p: raw(p / "a.bin", bytes(range(256)) * 40), "the file is binary"),
    "random bytes": (lambda p: raw(p / "a.dat", np.random.default_rng(1).bytes(9999)), "no text has|binary"),
    "NUL bytes within": (lambda p: text(p / "a.csv", GOOD + "\0" * 500), "NUL|0x00"),
    "NUL bytes far within": (lambda p: text(p / "a.csv", csv_text(at_rest(4000)) + "\0\0\0"), "NUL byte"),
    "zip": (lambda p: raw(p / "a.zip", zipped(GOOD.encode())), "a zip archive or a spreadsheet, .*; unpack it"),
    "zip of a zip": (lambda p: raw(p / "a.csv", zipped(zipped(GOOD.encode()), "b.zip")), "a zip archive"),
    "gzip of a zip": (lambda p: raw(p / "a.csv.gz", gzip.compress(zipped(GOOD.encode()))), "a zip archive"),
    "gzip, cut off": (lambda p: raw(p / "a.csv.gz", gzip.compress(GOOD.encode())[:-20]), "not a complete gzip file"),
    "PDF": (lambda p: raw(p / "a.csv", b"%PDF-1.7\n%..."), "a PDF document"),
    "picture": (lambda p: raw(p / "a.csv", b"\x89PNG\r\n\x1a\n" + b"0" * 99), "a picture"),
    "JSON": (lambda p: text(p / "a.json", '{"gyro": [1, 2, 3]}'), "this is JSON"),
    "web page": (lambda p: text(p / "a.csv", "<!DOCTYPE html><p>Not found</p>"), "XML or HTML"),
    "prose": (lambda p: text(p / "a.txt", "The gyro was warm.\nIt drifted.\n"), "no row of numbers"),
    "2 GB": (lambda p: sparse(p / "a.csv"), "2147 MB; at most 1000 MB"),
    "wrong separator": (lambda p: text(p / "a.csv", GOOD), r"no row of numbers|holds text|is not in the file"),
    "mixed separators": (
        lambda p: text(p / "a.csv", "\n".join(LINES[:200] + [each.replace(",", ";") for each in LINES[200:220]])),
        "columns where the others have",
    ),
    "rows of other widths": (
        lambda p: text(p / "a.csv", with_line(7, "1,2")),
        "row 7: 2 columns where the others have 5",
    ),
    "duplicate columns": (
        lambda p: text(p / "a.csv", GOOD.replace("gyro_y", "gyro_x", 1)),
        r"'gyro_x \(deg/s\)' occurs more than once",
    ),
    "time backwards": (
        lambda p: text(p / "a.csv", with_cell(9, 0, "0.001")),
        r"\(time\), row 9: 0.001 does not follow",
    ),
    "time twice": (lambda p: text(p / "a.csv", with_line(9, LINES[8])), r"\(time\), row 9: 0.07 does not follow 0.07"),
    "a damaged time": (
        lambda p: text(p / "a.csv", with_cell(400, 0, "4e12")),
        r"\(time\), row 400: 4e\+12 after 3.98; a recording lasts at most 100000000 s",
    ),
    "a counter that begins again": (
        lambda p: text(
            p / "a.csv",
            csv_text(np.column_stack([(65000 + 10 * np.arange(400)) % 65536, ROWS[:, 1:]]), "time ms," + GYROS).replace(
                "gyro_z (deg/s)\n", "gyro_z (deg/s),temp\n"
            ),
        ),
        "wrap_bits = 16",
    ),
    "NaN": (lambda p: text(p / "a.csv", with_cell(12, 2, "nan")), "row 12: empty or no finite number"),
    "empty cell": (lambda p: text(p / "a.csv", with_cell(12, 2, "")), "row 12: empty or no finite number"),
    "infinite": (lambda p: text(p / "a.csv", with_cell(12, 2, "inf")), "row 12: empty or no finite number"),
    "words among numbers": (lambda p: text(p / "a.csv", with_cell(5, 1, "err")), "row 5: 'err' is no number"),
    "units nobody gave": (
        lambda p: text(p / "a.csv", GOOD.replace("gyro_x (deg/s)", "gyro_x", 1)),
        r"column 'gyro_x' .* no unit is given; write its unit in \[units\]",
    ),
    "an unknown unit": (
        lambda p: text(p / "a.csv", GOOD.replace("gyro_x (deg/s)", "gyro_x (furlong)", 1)),
        "no unit is given",
    ),
    "time without a unit": (
        lambda p: text(
            p / "a.csv", csv_text(np.column_stack([np.arange(400), ROWS[:, 1:]]), HEADER.replace("time (s)", "time"))
        ),
        "for t_s: no unit is given",
    ),
    "no time": (
        lambda p: text(p / "a.csv", csv_text(ROWS[:, 1:4], GYROS)),
        "no column of time; .* sample_rate_hz = readings per second",
    ),
    "no gyro": (lambda p: text(p / "a.csv", csv_text(ROWS[:, [0, 4]], "time (s),temp (C)")), "the output of a gyro"),
    "colder than nothing": (
        lambda p: text(p / "a.csv", with_cell(3, 4, "-300")),
        "row 3: -300 deg C is not possible",
    ),
    "faster than anything": (
        lambda p: text(p / "a.csv", with_cell(3, 1, "2e6")),
        r"row 3: 2e\+06 deg/s is not possible",
    ),
    "free motion": (
        lambda p: text(p / "a.csv", csv_text(moved())),
        "free motion without a reference cannot calibrate a gyro",
    ),
    "mixed axes": (
        lambda p: text(p / "a.csv", csv_text(in_poses()[:, :6], f"time (s),{GYROS},acc_x (m/s2),acc_y (m/s2)")),
        "free motion without a reference",
    ),
    "UTF-16 without a mark": (lambda p: raw(p / "a.csv", GOOD.encode("utf-16-le")), "UTF-16 .little-endian. without"),
    "cut-off Parquet": (
        lambda p: raw(p / "a.parquet", parquet(p / "b.parquet", gyro_x=[1.0, 2.0]).read_bytes()[:60]),
        "not a complete Parquet file",
    ),
    "Parquet of lists": (lambda p: parquet(p / "a.parquet", gyro_x=[[1.0], [2.0]]), "column 'gyro_x' holds list"),
    "cut-off ULog": (lambda p: truncated_ulog(p / "a.ulg"), "none of the topics sensor_gyro, .*it has no topic"),
    "cut-off bag": (lambda p: raw(p / "a.bag", b"#ROSBAG V2.0\n" + b"\x45\x00\x00\x00"), "not a complete ROS bag"),
    "a folder": (lambda p: p, r"recording\.toml"),
    "not there": (lambda p: p / "none.csv", "not found"),
}
#: Kinds that a map of a user's makes bad.
MAPS = {"wrong separator": '[file]\nseparator = ";"\n[columns]\ngyro_x = {from = "gyro_x (deg/s)"}\n'}


@pytest.mark.parametrize("kind", FILES)
def test_a_bad_file_gives_one_error_and_stores_nothing(kind: str, tmp_path: Path) -> None:
    from labctl.recording import read_recording

    make, said = FILES[kind]
    path = make(tmp_path)
    column_map = parse_map(MAPS[kind]) if kind in MAPS else None
    with pytest.raises(LabctlError, match=said) as refused, as_interchange(path, column_map=column_map) as folder:
        read_recording(folder)
    assert isinstance(refused.value, BadInput)
    assert refused.value.exit_status == 2
    line = str(refused.value)
    assert "\n" not in line
    assert len(line.replace(str(tmp_path), "")) < 1000
    assert path.name in line or path == tmp_path


def test_the_kinds_are_at_least_forty() -> None:
    assert len(FILES) >= 40


def test_the_file_that_the_bad_ones_are_made_of_is_good(tmp_path: Path) -> None:
    with as_interchange(text(tmp_path / "a.csv", GOOD)) as folder:
        from labctl.recording import read_recording

        recording = read_recording(folder)
    assert recording.info.motion == "rest"
    assert len(recording) == len(ROWS)


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "cp1252"])
def test_marks_and_encodings_are_read(tmp_path: Path, encoding: str) -> None:
    content = GOOD.replace("(degC)", "(°C)", 1)
    with as_interchange(text(tmp_path / "a.csv", content, encoding)) as folder:
        from labctl.recording import read_recording

        assert "temperature_c" in read_recording(folder).columns
