"""Files with wrong content end in one line that names place, value and limit, in bounded memory and time."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from labctl.errors import BadRecording
from labctl.recording import read_recording
from labctl.recording.data_files import limits, read_table
from tests.helpers.hostile_parquet import write_constant_rows
from tests.helpers.hostile_recordings import GOOD, HOSTILE, constant_rows, with_column, with_datasets

LONGEST_LINE = 600
PEAK_OF = """
import resource, sys
from pathlib import Path
from labctl.errors import BadRecording
from labctl.recording import read_recording
import labctl.recording.data_files
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
try:
    read_recording(Path(sys.argv[1]))
except BadRecording as error:
    print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before, error)
"""


@pytest.mark.timeout(20)
@pytest.mark.parametrize("case", HOSTILE)
def test_one_line_names_what_is_wrong(case: str, tmp_path: Path) -> None:
    write, said = HOSTILE[case]
    write(tmp_path)
    with pytest.raises(BadRecording, match=said) as caught:
        read_recording(tmp_path)
    line = str(caught.value)
    assert str(tmp_path) in line
    assert "\n" not in line
    assert len(line) < LONGEST_LINE + len(str(tmp_path))


def test_400_million_constant_rows_take_no_memory(tmp_path: Path) -> None:
    constant_rows(tmp_path)
    assert (tmp_path / "samples.parquet").stat().st_size < 1_000_000
    found = subprocess.run([sys.executable, "-c", PEAK_OF, tmp_path], capture_output=True, text=True, check=True).stdout
    kib, _, line = found.partition(" ")
    assert "at most 100000000" in line
    assert int(kib) < 50_000


def test_what_is_just_allowed_is_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(limits, "MAX_VALUES", 20)
    with_column(tmp_path, "gyro_z", GOOD["gyro_z"])
    assert len(read_recording(tmp_path)) == 4
    with_column(tmp_path, "power_s", GOOD["t_s"])
    with pytest.raises(BadRecording, match=r"4 rows x 6 columns = 24 values; at most 20 are read"):
        read_recording(tmp_path)
    (tmp_path / "samples.parquet").unlink()
    with_datasets(tmp_path, "1", "2")
    assert len(read_recording(tmp_path)) == 4
    monkeypatch.setattr(limits, "MAX_VALUES", 19)
    with pytest.raises(BadRecording, match=r"samples\.csv: 4 rows x 5 columns = 20 values; at most 19"):
        read_recording(tmp_path)


def test_padding_counts_by_what_it_unpacks_to(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "samples.parquet"
    words = pa.array([f"{n}" + "x" * 5000 for n in range(100)])
    pq.write_table(pa.table({"note": words}), file, compression="zstd", use_dictionary=False)
    monkeypatch.setattr(limits, "MAX_UNPACKED_BYTES", 400_000)
    with pytest.raises(BadRecording, match=r"has an unpacked size of 0\.5\d* MB; at most 0\.4 MB are read"):
        read_table(file)


def test_rows_are_those_of_the_footer(tmp_path: Path) -> None:
    file = tmp_path / "samples.parquet"
    write_constant_rows(file, 200_000, 3)
    columns = read_table(file)
    assert {len(values) for values in columns.values()} == {600_000}
    assert columns["dataset"].dtype == np.int64


def test_a_damaged_file_is_never_a_traceback(tmp_path: Path) -> None:
    with_column(tmp_path, "position", ["z"] * 4)
    file = tmp_path / "samples.parquet"
    whole = file.read_bytes()
    draw = np.random.default_rng(4)
    read = 0
    for _ in range(300):
        damaged = bytearray(whole)
        for place in draw.integers(0, len(whole), 3):
            damaged[place] = draw.integers(0, 256)
        file.write_bytes(damaged)
        try:
            read_recording(tmp_path)
            read += 1
        except BadRecording:
            pass
    assert read < 300


@pytest.mark.parametrize("file_format", ["parquet", "csv"])
def test_words_numbers_and_whole_numbers_stay_what_they_are(tmp_path: Path, file_format: str) -> None:
    columns = {
        "dataset": pa.array([2**53 - 1, 2**53 - 2, 3]),
        "gyro_z": pa.array([0.1, 1e-300, -1e300]),
        "weather": pa.array(["rain", "", "sun"]),
        "shift": pa.array(["early", "late", "early"]).dictionary_encode(),
        "count": pa.array([1.5, 2.5, 3.5]).dictionary_encode(),
        "price": pa.array([1, 2, 3], pa.decimal128(10, 2)),
        "on": pa.array([1, 0, 1]),
    }
    file = tmp_path / f"samples.{file_format}"
    if file_format == "parquet":
        pq.write_table(pa.table(columns), file)
    else:
        rows = zip(*(column.to_pylist() for column in columns.values()), strict=True)
        file.write_text("\n".join([",".join(columns), *(",".join(str(v) for v in row) for row in rows)]))
    read = read_table(file)
    assert read["dataset"].tolist() == [2**53 - 1, 2**53 - 2, 3]
    assert read["gyro_z"].tolist() == [0.1, 1e-300, -1e300]
    assert read["weather"].tolist() == ["rain", "", "sun"]
    assert read["shift"].tolist() == ["early", "late", "early"]
    assert read["count"].tolist() == [1.5, 2.5, 3.5]
    assert read["price"].tolist() == [1.0, 2.0, 3.0]
    assert read["on"].tolist() == [1.0, 0.0, 1.0]


def test_an_extra_column_is_words_where_one_of_its_blocks_is(tmp_path: Path) -> None:
    file = tmp_path / "samples.csv"
    rows = [f"{n},{n / 2:020.3f}" for n in range(100_000)]
    file.write_text("\n".join(["dataset,more", *rows, "7,end"]))  # more than one block of 1 MiB
    read = read_table(file)
    assert read["more"][[0, -1]].tolist() == ["0000000000000000.000", "end"]
    assert read["dataset"][-2:].tolist() == [99_999, 7]
    file.write_text("\n".join(["dataset,more", *rows]))
    assert read_table(file)["more"][-1] == 99_999 / 2
    file.write_text("\n".join(["dataset,more", *rows, "x,1"]))
    with pytest.raises(BadRecording, match="column 'dataset', row 100001: 'x' is not a number"):
        read_table(file)
