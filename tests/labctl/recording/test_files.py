"""The interchange format: what goes out comes back, and what is wrong is named with file, column and row."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from labctl.errors import BadRecording
from labctl.recording import Recording, RecordingInfo, read_recording, to_points, write_recording
from labctl.recording.motions.constant_rate import rate_change

HEAD = """format = "labctl-recording/1"
serial = "G-1"
axes = ["z"]
kind = "samples"
started_at = "2026-01-05T08:00:00Z"
"""
ROWS = [
    "dataset,t_s,table_rate_dps,temperature_c,gyro_z",
    "1,0.0,10,25.0,10.1",
    "1,0.1,10,25.0,10.2",
    "2,5.0,20,25.1,20.1",
    "2,5.1,20,25.1,20.3",
]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "recording.toml").write_text(HEAD)
    (tmp_path / "samples.csv").write_text("\n".join(ROWS) + "\n")
    return tmp_path


def rows(folder: Path, change: Callable[[list[str]], list[str]]) -> None:
    (folder / "samples.csv").write_text("\n".join(change(list(ROWS))) + "\n")


def test_reads_and_fills_in_the_defaults(folder: Path) -> None:
    recording = read_recording(folder)
    assert recording.info.started_at == datetime(2026, 1, 5, 8, tzinfo=UTC)
    assert recording.columns["position"].tolist() == ["z"] * 4
    assert recording.columns["run"].tolist() == [1] * 4
    assert recording.columns["mounting"].tolist() == [1] * 4
    assert recording.gyro_dps("z").tolist() == [10.1, 10.2, 20.1, 20.3]


@pytest.mark.parametrize("file_format", ["parquet", "csv"])
def test_comes_back_exactly(tmp_path: Path, file_format: str) -> None:
    rng = np.random.default_rng(1)
    columns = {
        "dataset": np.repeat([1, 2], 50),
        "t_s": np.cumsum(rng.uniform(0.01, 0.2, 100)),
        "position": np.repeat(["x", "-x"], 50),
        "run": np.ones(100, dtype=np.int64),
        "mounting": np.repeat([1, 2], 50),
        "table_rate_dps": np.repeat([10.0, -10.0], 50),
        "temperature_c": rng.normal(25, 1, 100),
        "gyro_x": rng.normal(0, 1, 100),
        "gyro_y": rng.normal(0, 1, 100),
        "humidity_rh": rng.normal(40, 1, 100),
    }
    info = RecordingInfo(serial="G", axes=("x", "y"), kind="samples", started_at=datetime(2026, 1, 1, tzinfo=UTC))
    environment = {"t_s": np.array([0.0, 10.0]), "run": np.array([1, 1]), "temperature_c": np.array([25.0, 25.5])}
    write_recording(Recording(info, columns, environment), tmp_path / "out", file_format)  # type: ignore[arg-type]
    back = read_recording(tmp_path / "out")
    assert back.info == info
    for name, values in columns.items():
        assert np.array_equal(back.columns[name], values), name
    assert back.environment is not None
    assert np.array_equal(back.environment["temperature_c"], environment["temperature_c"])


def test_a_folder_that_is_not_empty_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "precious").write_text("data")
    info = RecordingInfo(serial="G", axes=("z",), kind="points", started_at=datetime(2026, 1, 1, tzinfo=UTC))
    with pytest.raises(BadRecording, match="not empty"):
        write_recording(Recording(info, {"dataset": np.array([1])}), tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["precious"]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda r: [",".join(x.split(",")[:-1]) for x in r], r"samples.csv: column 'gyro_z' is missing"),
        (
            lambda r: [*r[:3], "2,5.0,20,warm,20.1", *r[4:]],
            r"column 'temperature_c', row 3: 'warm' is not a number",
        ),
        (lambda r: [*r[:2], "1,0.1,10,nan,10.2", *r[3:]], r"column 'temperature_c', row 2: nan"),
        (lambda r: [*r[:2], "1,0.1,10,25.0,", *r[3:]], r"column 'gyro_z', row 2: nan"),
        (lambda r: [r[0], r[2], r[1], *r[3:]], r"column 't_s', row 2: 0 s does not follow 0.1 s"),
        (lambda r: [*r, "1,6.0,10,25.0,10.0"], r"column 'dataset', row 5: number 1 is repeated"),
        (lambda r: [*r[:1], "1.5" + r[1][1:], *r[2:]], r"column 'dataset', row 1: 1.5 is not a whole number"),
        (lambda r: r[:1], r"no rows below the header"),
        (lambda r: [r[0] + ",gyro_z", *[x + ",1" for x in r[1:]]], r"column 'gyro_z' is repeated in the header"),
        (lambda r: [*r[:2], "1,0.1,10,25.0", *r[3:]], r"expected 5 columns"),
        (lambda r: [r[0].replace(",", ";"), *r[1:]], r"separated by ';'"),
        (lambda r: [*r[:2], '1,0.1,10,"25,0",10.2', *r[3:]], r"row 2: '25,0' is not a number .*decimal point"),
        (
            lambda r: [r[0] + ",position", *[x + ",up" for x in r[1:]]],
            r"column 'position', row 1: 'up' is not a position",
        ),
    ],
)
def test_bad_rows_are_named(folder: Path, change: Callable[[list[str]], list[str]], said: str) -> None:
    rows(folder, change)
    with pytest.raises(BadRecording, match=said):
        read_recording(folder)


@pytest.mark.parametrize(
    ("head", "said"),
    [
        (HEAD.replace("serial", "seriel"), r"seriel: Extra inputs"),
        (HEAD.replace("G-1", "G/1"), r"serial cannot be used \(is 'G/1'\); give 1 to 64 characters: a letter"),
        (HEAD.replace('Z"', '"'), r"started_at: .*timezone"),
        (HEAD.replace('axes = ["z"]', 'axes = ["z", "z"]'), "an axis is repeated"),
        (HEAD + '[output.z]\nunit = "furlong"\n', r"output.z"),
        (HEAD + '[output.z]\nunit = "V"\n', r"needs a scale"),
        (HEAD + '[output.z]\nunit = "V"\nscale = 0.0\n', r"must be finite numbers, and scale must not be 0"),
        ("not toml at all [", r"not TOML"),
        (HEAD.replace("samples", "points"), r"needs a file points.parquet or points.csv"),
    ],
)
def test_bad_heads_are_named(folder: Path, head: str, said: str) -> None:
    (folder / "recording.toml").write_text(head)
    with pytest.raises(BadRecording, match=said):
        read_recording(folder)


def test_a_truncated_parquet_file_is_named(folder: Path) -> None:
    whole = read_recording(folder)
    out = folder / "whole"
    write_recording(whole, out)
    path = out / "samples.parquet"
    path.write_bytes(path.read_bytes()[:-200])
    with pytest.raises(BadRecording, match=r"samples.parquet: not a complete Parquet file"):
        read_recording(out)


def test_an_empty_file_is_named(folder: Path) -> None:
    (folder / "samples.csv").write_text("")
    with pytest.raises(BadRecording, match="the file is empty"):
        read_recording(folder)


def test_radians_per_second_need_no_scale(folder: Path) -> None:
    (folder / "recording.toml").write_text(HEAD + '[output.z]\nunit = "rad/s"\n')
    recording = read_recording(folder)
    assert recording.gyro_dps("z")[0] == pytest.approx(np.degrees(10.1))


def test_points_are_means_of_valid_readings(folder: Path) -> None:
    rows(folder, lambda r: [r[0] + ",valid", r[1] + ",1", r[2] + ",0", r[3] + ",1", r[4] + ",1"])
    points = to_points(read_recording(folder))
    assert points.columns["gyro_z"].tolist() == pytest.approx([10.1, 20.2])
    assert points.columns["n"].tolist() == [1, 2]
    assert points.columns["gyro_z_std"][1] == pytest.approx(np.std([20.1, 20.3], ddof=1))


def test_a_bad_reading_may_hold_no_number(folder: Path) -> None:
    rows(folder, lambda r: [r[0] + ",valid", r[1] + ",1", "1,0.1,10,25.0,nan,0", r[3] + ",1", r[4] + ",1"])
    assert len(read_recording(folder)) == 4


def test_rates_that_change_inside_a_data_set_are_refused(folder: Path) -> None:
    rows(folder, lambda r: [*r[:2], "1,0.1,20,25.0,10.2", *r[3:]])
    said = r"samples.csv: column 'table_rate_dps', row 2: 20 deg/s in data set 1, which began at 10 deg/s"
    with pytest.raises(BadRecording, match=said):
        read_recording(folder)


def test_a_reading_at_another_rate_that_is_marked_bad_is_no_change(folder: Path) -> None:
    rows(folder, lambda r: [r[0] + ",valid", *(f"{row},{int(k != 1)}" for k, row in enumerate(r[1:]))])
    rows_of = (folder / "samples.csv").read_text().replace("1,0.1,10,25.0,10.2,0", "1,0.1,40,25.0,10.2,0")
    (folder / "samples.csv").write_text(rows_of)
    assert len(read_recording(folder)) == 4


@pytest.mark.parametrize(("noise", "share"), [(0.2, 0.0), (0.0, 0.004), (0.5, 0.002)])
def test_a_measured_rate_may_be_noisy(noise: float, share: float) -> None:
    rng = np.random.default_rng(1)
    dataset = np.repeat(np.arange(20), 100)
    rate = 5.0 * dataset * (1 + share * np.sin(np.arange(2000) / 9)) + noise * rng.normal(size=2000)
    assert rate_change(dataset, rate, np.ones(2000, dtype=bool)) is None


def test_a_change_is_found_in_noise_with_its_row() -> None:
    rng = np.random.default_rng(1)
    dataset = np.repeat(np.arange(20), 100)
    rate = 5.0 * dataset + 0.2 * rng.normal(size=2000)
    rate[1150:1200] += 5.0
    change = rate_change(dataset, rate, np.ones(2000, dtype=bool))
    assert change is not None
    assert (change.dataset, change.row) == (11, 1150)
    assert change.after_dps == pytest.approx(60, abs=1)


@pytest.mark.parametrize("noise_dps", [0.0, 30.0])
def test_a_motion_that_repeats_is_no_constant_rate_although_each_part_has_the_same_mean(noise_dps: float) -> None:
    """Rates of both directions at eight temperatures, logged as one: each eighth is one temperature."""
    once = np.repeat([0.0, 100.0, -100.0, 300.0, -300.0], 200)
    rate = np.tile(once, 8) + noise_dps * np.random.default_rng(4).normal(size=8000)
    change = rate_change(np.ones(8000, dtype=np.int64), rate, np.ones(8000, dtype=bool))
    assert change is not None
    assert change.dataset == 1
    if noise_dps == 0:
        assert (change.row, change.before_dps, change.after_dps) == (200, 0.0, 100.0)


def test_ripple_and_the_noise_of_an_encoder_are_no_motion() -> None:
    t_s = np.arange(20_000) / 100.0
    rippling = 40.0 * (1 + 0.02 * np.sin(2 * np.pi * t_s / 3.0))
    noisy = 40.0 + 20.0 * np.random.default_rng(5).normal(size=20_000)
    for rate in (rippling, noisy):
        assert rate_change(np.ones(20_000, dtype=np.int64), rate, np.ones(20_000, dtype=bool)) is None
