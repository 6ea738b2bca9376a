"""Recordings with wrong content, and the error that each has to cause."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from tests.helpers.hostile_parquet import write_constant_rows

HEAD = """format = "labctl-recording/1"
serial = "G-1"
axes = ["z"]
kind = "samples"
started_at = "2026-01-05T08:00:00Z"
"""
GOOD: dict[str, Any] = {
    "dataset": [1, 1, 2, 2],
    "t_s": [0.0, 0.1, 5.0, 5.1],
    "table_rate_dps": [10.0, 10.0, 20.0, 20.0],
    "temperature_c": [25.0] * 4,
    "gyro_z": [10.1, 10.2, 20.1, 20.3],
}
DEEP = 100_000


def with_column(folder: Path, name: str, values: Any) -> None:
    """Write a recording of four readings as Parquet, one column replaced or added."""
    (folder / "recording.toml").write_text(HEAD)
    pq.write_table(pa.table({**GOOD, name: values}), folder / "samples.parquet")


def with_datasets(folder: Path, first: str, second: str) -> None:
    """Write a recording of two data sets of one rate as CSV, numbered so."""
    rows = [f"{first},0,10,25,10.1", f"{first},1,10,25,10.2", f"{second},5,10,25,10.1", f"{second},6,10,25,10.3"]
    (folder / "recording.toml").write_text(HEAD)
    (folder / "samples.csv").write_text("\n".join([",".join(GOOD), *rows]) + "\n")


def with_head(folder: Path, line: str) -> None:
    """Write a recording of two data sets whose recording.toml ends in a line of its own."""
    with_datasets(folder, "1", "2")
    (folder / "recording.toml").write_text(f"{HEAD}{line}\n")


def with_words(folder: Path) -> None:
    """Write 2 million rows of one word of 1 MB: 230 bytes a row group packed, 8 TB as text."""
    (folder / "recording.toml").write_text(HEAD)
    word = pa.DictionaryArray.from_arrays(pa.array([0] * 20_000, pa.int32()), pa.array(["x" * 1_000_000]))
    good = {name: pa.array([values[0]] * 20_000) for name, values in GOOD.items()}
    pq.write_table(pa.table({**good, "position": word}), folder / "samples.parquet", compression="zstd")


def constant_rows(folder: Path) -> None:
    """Write 400 million readings in 250 kB."""
    (folder / "recording.toml").write_text(HEAD)
    write_constant_rows(folder / "samples.parquet", 1_000_000, 400)


def one_row_data_sets(folder: Path) -> None:
    """Write 300,000 data sets of one reading: 5 MB that held the database's writer for 300 s."""
    (folder / "recording.toml").write_text(HEAD)
    n = 300_000
    steps = {name: pa.array([values[0]] * n) for name, values in GOOD.items()}
    steps |= {"dataset": pa.array(range(1, n + 1)), "t_s": pa.array([0.1 * row for row in range(n)])}
    pq.write_table(pa.table(steps), folder / "samples.parquet")


def with_bytes(folder: Path, file: str, content: bytes) -> None:
    """Write a recording whose data file has these bytes."""
    (folder / "recording.toml").write_text(HEAD)
    (folder / file).write_bytes(content)


def column(name: str, values: Any) -> Callable[[Path], None]:
    return partial(with_column, name=name, values=values)


def datasets(first: str, second: str) -> Callable[[Path], None]:
    return partial(with_datasets, first=first, second=second)


def head(line: str) -> Callable[[Path], None]:
    return partial(with_head, line=line)


def data(file: str, content: bytes) -> Callable[[Path], None]:
    return partial(with_bytes, file=file, content=content)


_TIMES = pa.array([0, 1, 2, 3], pa.timestamp("us"))
_ROWS = b"dataset,t_s,table_rate_dps,temperature_c,gyro_z"
_IN = "samples.parquet: column "

#: Name -> how it is written, and a regular expression of the one line.
HOSTILE: dict[str, tuple[Callable[[Path], None], str]] = {
    "400 million rows": (constant_rows, r"400000000 rows x 5 columns = 2000000000 values; at most 100000000"),
    "a long word": (with_words, _IN + r"'position': the file's values take more than 800 MB"),
    "timestamp": (
        column("t_s", _TIMES),
        _IN + r"'t_s' holds timestamp\[us\]; expected numbers, s; .* since started_at",
    ),
    "timestamp beside": (column("when", _TIMES), _IN + r"'when' holds timestamp\[us\]; .*leave the column out"),
    "duration": (column("dataset", pa.array([1, 1, 2, 2], pa.duration("s"))), _IN + r"'dataset' holds duration"),
    "list": (column("gyro_z", [[1.0], [2.0], [3.0], [4.0]]), _IN + r"'gyro_z' holds list<"),
    "list beside": (column("more", [[1.0], [2.0], [3.0], [4.0]]), _IN + r"'more' holds list<.*leave the column out"),
    "struct": (column("gyro_z", [{"a": 1.0}] * 4), _IN + r"'gyro_z' holds struct<"),
    "binary": (column("gyro_z", [b"1", b"2", b"3", b"4"]), _IN + r"'gyro_z' holds binary; expected numbers"),
    "binary words": (column("position", [b"z"] * 4), _IN + r"'position' holds binary; expected text"),
    "not UTF-8": (
        column("position", pa.array([b"\xff"] * 4).view(pa.string())),
        _IN + r"'position', rows 1 to 4: not UTF",
    ),
    "no position": (column("position", ["z", None, "z", "z"]), _IN + r"'position', row 2: '' is not a position"),
    "2^53 + 1": (
        column("dataset", [2**53, 2**53, 2**53 + 1, 2**53 + 1]),
        r"row 1: 9007199254740992 is beyond .*2\^53 - 1",
    ),
    "2^64 - 1": (
        column("dataset", pa.array([1, 1, 2, 2**64 - 1], pa.uint64())),
        r"row 4: 18446744073709551615 is beyond",
    ),
    "2^31": (column("dataset", [1, 1, 2**31, 2**31]), r"'dataset', row 3: 2147483648 is beyond .-2147483647"),
    "mounting 2^31": (column("mounting", [1, 1, 1, -(2**31)]), r"'mounting', row 4: -2147483648 is beyond"),
    "300,000 data sets": (one_row_data_sets, r"300000 data sets; at most 50000 are imported at once; divide"),
    "1e24": (column("dataset", [1.0, 1.0, 1e24, 2e24]), r"row 3: 1e\+24 is beyond .-9007199254740991"),
    "2^53 + 1 in CSV": (datasets("9007199254740991", "9007199254740993"), r"row 3: 9007199254740993 is beyond"),
    "1e24 in CSV": (datasets("1", "1e24"), r"column 'dataset', row 3: 1e\+24 is beyond"),
    "30 digits in CSV": (datasets("1", "1" * 30), r"column 'dataset', row 3: 1\.1.*e\+29 is beyond"),
    "inf in CSV": (datasets("1", "inf"), r"column 'dataset', row 3: inf is not a whole number"),
    "arrays in the head": (
        head("notes = " + "[" * DEEP + "]" * DEEP),
        r"recording.toml: not TOML: line 6: brackets .* deep",
    ),
    "tables in the head": (
        head("notes = " + "{a=" * DEEP + "1" + "}" * DEEP),
        r"line 6: brackets are nested more than 32 levels deep",
    ),
    "dots in the head": (
        head("[" + "a." * DEEP + "a]"),
        r"recording.toml: not TOML: line 6: a dotted key is more than 32 levels deep",
    ),
    "digits in the head": (head("power_on_s = " + "1" * 5000), r"recording.toml: not TOML: .*4300 digits"),
    "doubled in the head": (head('serial = "G-2"'), r"recording.toml: not TOML: Cannot overwrite a value"),
    "long head": (head("#" * (1 << 20)), r"recording.toml: not TOML: larger than 1048576 bytes"),
    "long value": (head("axis = '" + "x" * 10_000 + "'"), r"recording.toml: axis: .{100,300}$"),
    "long header": (data("samples.csv", b"x" * 100_000), r"samples.csv: the first line is longer than 65536 bytes"),
    "many columns": (
        data("samples.csv", b",".join(b"c%d" % n for n in range(300)) + b"\n"),
        r"300 columns, but at most 256",
    ),
    "CSV not UTF-8": (data("samples.csv", _ROWS + b"\n1,0,10,25,\xff\n"), r"samples.csv: not UTF-8 text after row 0"),
    "long word": (
        data("samples.csv", _ROWS + b"\n1,0,10,25," + b"a" * 10_000 + b"\n"),
        r"row 1: 'a{80}' is not a number",
    ),
    "footer of 1 GB": (
        data("samples.parquet", b"PAR1" + b"\0" * 99 + bytes([0, 0, 0, 64]) + b"PAR1"),
        r"footer has 10737",
    ),
    "no footer": (
        data("samples.parquet", b"PAR1" + b"\0" * 99 + b"\x09\0\0\0PAR1"),
        r"samples.parquet: not a complete Parquet file",
    ),
}
