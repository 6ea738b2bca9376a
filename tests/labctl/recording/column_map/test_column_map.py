"""What a column map does to the columns of a log, and what is said of a wrong one."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from labctl.errors import BadFile, BadInput
from labctl.recording import Recording
from labctl.recording.column_map import FileKeys, completed, map_text, parse_map, propose, recording_of
from labctl.recording.logs.text import TextOptions, read_text
from labctl.recording.raw_table import RawTable
from tests.helpers.paths import ROOT
from tests.helpers.written_logs import HEADER, at_rest, csv_text, in_poses, moved


def table(tmp_path: Path, content: str, name: str = "log.csv") -> RawTable:
    path = tmp_path / name
    path.write_text(content, encoding="utf-8")
    return read_text(path, TextOptions())


def mapped(tmp_path: Path, content: str, toml: str) -> Recording:
    column_map = parse_map(toml)
    path = tmp_path / "log.csv"
    path.write_text(content, encoding="utf-8")
    found = read_text(path, TextOptions(file=column_map.file))
    return recording_of(found, completed(found, column_map).column_map).recording


def one_axis(values: list[float], header: str = "t,w") -> str:
    return "\n".join([header, *(f"{0.01 * k:.2f},{value!r}" for k, value in enumerate(values))]) + "\n"


@pytest.mark.parametrize(
    ("unit", "value", "dps"),
    [
        ('"deg/s"', 0.5, 0.5),
        ('"rad/s"', 0.01, math.degrees(0.01)),
        ('"mdps"', 500.0, 0.5),
        ('"mrad/s"', 10.0, math.degrees(0.01)),
        ('"deg/h"', 360.0, 0.1),
        ('"rpm"', 0.1, 0.6),
        ('"LSB", scale = 131', 131.0, 1.0),
        ('"LSB", scale = 16.4, offset = 100', 116.4, 1.0),
        ('"LSB", scale = -131', 131.0, -1.0),
        ('"LSB", scale = 131, signed_bits = 16', 65536.0 - 131.0, -1.0),
        ('"deg/s", sign = -1', 0.5, -0.5),
    ],
)
def test_rates_in_every_unit(tmp_path: Path, unit: str, value: float, dps: float) -> None:
    toml = f'[columns]\nt_s = {{from = "t", unit = "s"}}\ngyro_z = {{from = "w", unit = {unit}}}\n'
    recording = mapped(tmp_path, one_axis([value] * 40), toml)
    np.testing.assert_allclose(recording.gyro_dps("z"), dps, rtol=1e-12)
    assert recording.info.axes == ("z",)


@pytest.mark.parametrize(
    ("unit", "value", "celsius"),
    [
        ('"deg C"', 25.0, 25.0),
        ('"K"', 298.15, 25.0),
        ('"degF"', 77.0, 25.0),
        ('"mdegC"', 25000.0, 25.0),
        # the MPU-6050's data sheet: word / 340 + 36.53 deg C
        ('"LSB", scale = 340, at_zero = 36.53', -8884.0, -8884 / 340 + 36.53),
        ('"LSB", scale = 256, at_zero = 25, signed_bits = 16', 65236.0, 25 - 300 / 256),
    ],
)
def test_temperatures_in_every_unit(tmp_path: Path, unit: str, value: float, celsius: float) -> None:
    lines = ["t,w,T", *(f"{0.01 * k:.2f},0.1,{value}" for k in range(40))]
    toml = (
        '[columns]\nt_s = {from = "t", unit = "s"}\ngyro_z = {from = "w", unit = "deg/s"}\n'
        f'temperature_c = {{from = "T", unit = {unit}}}\n'
    )
    recording = mapped(tmp_path, "\n".join(lines) + "\n", toml)
    assert np.asarray(recording.columns["temperature_c"]) == pytest.approx(np.full(40, celsius), rel=1e-12)


@pytest.mark.parametrize(
    ("unit", "first", "step", "step_s"),
    [("s", 5, 0.25, 0.25), ("ms", 17, 10, 0.01), ("us", 3, 500, 5e-4), ("ns", 0, 1_000_000, 1e-3)],
)
def test_clocks_in_every_unit(tmp_path: Path, unit: str, first: float, step: float, step_s: float) -> None:
    lines = ["t,w", *(f"{first + step * k},0.1" for k in range(40))]
    toml = f'[columns]\nt_s = {{from = "t", unit = "{unit}"}}\ngyro_z = {{from = "w", unit = "deg/s"}}\n'
    t_s = np.asarray(mapped(tmp_path, "\n".join(lines), toml).columns["t_s"])
    np.testing.assert_allclose(np.diff(t_s), step_s, rtol=1e-9)
    assert t_s[0] == pytest.approx(first * step_s / step)


@pytest.mark.parametrize(
    ("unit", "written"),
    [
        ("epoch s", lambda k: f"{1_750_000_000 + 0.01 * k:.2f}"),
        ("epoch ms", lambda k: str(1_750_000_000_000 + 10 * k)),
        ("epoch us", lambda k: str(1_750_000_000_000_000 + 10_000 * k)),
        ("epoch ns", lambda k: str(1_750_000_000_000_000_000 + 10_000_000 * k)),
        ("date-time", lambda k: f"2025-06-15T15:06:40.{10 * k:03d}Z"),
    ],
)
def test_an_instant_says_when_the_recording_began(tmp_path: Path, unit: str, written: Callable[[int], str]) -> None:
    lines = ["time,gyro (deg/s)", *(f"{written(k)},0.1" for k in range(40))]
    found = table(tmp_path, "\n".join(lines))
    proposed = propose(found).column_map
    assert proposed.columns["t_s"].unit == unit
    recording = recording_of(found, proposed).recording
    assert recording.info.started_at.isoformat() == "2025-06-15T15:06:40+00:00"
    np.testing.assert_allclose(np.diff(np.asarray(recording.columns["t_s"])), 0.01, atol=1e-6)


def test_a_counter_that_begins_again_is_unwrapped(tmp_path: Path) -> None:
    lines = ["t,w", *(f"{(65_000 + 10 * k) % 65_536},0.1" for k in range(200))]
    toml = '[columns]\nt_s = {from = "t", unit = "ms", wrap_bits = 16}\ngyro_z = {from = "w", unit = "deg/s"}\n'
    t_s = np.asarray(mapped(tmp_path, "\n".join(lines), toml).columns["t_s"])
    assert np.diff(t_s) == pytest.approx(np.full(199, 0.01), rel=1e-9)


@pytest.mark.parametrize(
    ("separator", "decimal"), [(",", "."), (";", ","), (";", "."), ("\t", ","), (" ", "."), ("|", ".")]
)
def test_separators_and_decimal_signs_are_found(tmp_path: Path, separator: str, decimal: str) -> None:
    header = separator.join(["t_s", "gyro_x(deg/s)", "gyro_y(deg/s)", "gyro_z(deg/s)", "temperature_c"])
    found = table(tmp_path, "# a remark\n\n" + csv_text(at_rest(), header, separator, decimal))
    assert found.layout is not None
    assert (found.layout.separator, found.layout.decimal, found.layout.header) == (separator, decimal, 3)
    recording = recording_of(found, propose(found).column_map).recording
    np.testing.assert_allclose(recording.gyro_dps("y"), at_rest()[:, 2], atol=1e-6)


def test_a_log_without_a_header_is_mapped_by_numbers(tmp_path: Path) -> None:
    content = "\n".join(" ".join(f"{value:.5f}" for value in row[1:]) for row in in_poses())
    toml = "sample_rate_hz = 100\n[columns]\n" + "".join(
        f"{name} = {{from = {number}}}\n"
        for number, name in enumerate(["gyro_x", "gyro_y", "gyro_z", "accel_x_g", "accel_y_g", "accel_z_g"], start=1)
    )
    recording = mapped(tmp_path, content, toml + '[units]\ngyro = {unit = "deg/s"}\naccel = {unit = "m/s2"}\n')
    assert recording.info.motion == "poses"
    np.testing.assert_allclose(np.diff(np.asarray(recording.columns["t_s"])), 0.01, rtol=1e-9)


def test_parts_say_what_holds_for_stretches_of_a_log(tmp_path: Path) -> None:
    lines = ["part,w", *(["rest,0.1"] * 30), *(["turn,90.0"] * 40), *(["back,-90.0"] * 40)]
    toml = (
        'sample_rate_hz = 10\n[columns]\ngyro_z = {from = "w", unit = "deg/s"}\n'
        '[datasets]\nby = "column"\ncolumn = "part"\n'
        "[parts.rest]\nskip = true\n[parts.turn]\nturn_deg = 360\nturn_u_deg = 1\n[parts.back]\nturn_deg = -360\n"
        'turn_u_deg = 1\n[constants]\nposition = "z"\n'
    )
    recording = mapped(tmp_path, "\n".join(lines), toml)
    assert recording.info.motion == "turns"
    assert len(recording) == 80
    assert recording.columns["dataset"].tolist() == [2] * 40 + [3] * 40
    assert recording.columns["turn_deg"].tolist() == [360.0] * 40 + [-360.0] * 40
    assert set(recording.columns["position"].tolist()) == {"z"}


def test_rows_and_rests_and_gaps_make_data_sets(tmp_path: Path) -> None:
    rows = moved()
    content = csv_text(rows)
    by_rows = (
        'motion = "turns"\n[datasets]\nby = "rows"\n[constants]\nposition = "z"\n'
        "[parts.a]\nrows = [501, 1500]\nturn_deg = 360\n"
    )
    assert len(mapped(tmp_path, content, by_rows)) == 1000
    rests = mapped(tmp_path, content, 'motion = "rest"\n[datasets]\nby = "rests"\n')
    assert sorted(set(rests.columns["dataset"].tolist())) == [1, 2]
    assert len(rests) == pytest.approx(1000, abs=60)
    still = at_rest()
    still[200:, 0] += 60
    gaps = mapped(tmp_path, csv_text(still), '[datasets]\nby = "gaps"\n')
    assert gaps.columns["dataset"].tolist() == [1] * 200 + [2] * 200


def test_a_table_that_stands_at_steps_is_proposed_as_rates_and_one_that_sweeps_as_a_profile(tmp_path: Path) -> None:
    steps = np.repeat([0.0, 10.0, -10.0], 40)
    t_s = np.arange(120) / 100
    header = "time (s),table rate (deg/s),gyro (deg/s),temperature (degC)"
    found = table(tmp_path, csv_text(np.column_stack([t_s, steps, steps + 0.1, 0 * t_s + 25]), header))
    log = recording_of(found, propose(found).column_map)
    assert log.motion == "rates"
    assert sorted(set(log.recording.columns["dataset"].tolist())) == [1, 2, 3]
    sweep = 20 * np.sin(t_s)
    found = table(tmp_path, csv_text(np.column_stack([t_s, sweep, sweep + 0.1, 0 * t_s + 25]), header))
    assert recording_of(found, propose(found).column_map).motion == "profile"


def test_means_with_a_table_and_no_time_are_points(tmp_path: Path) -> None:
    rate = np.linspace(-1, 1, 30)
    header = "rig_rate_rad_s,gyro_z (deg/s),gyro_temp_C"
    found = table(tmp_path, csv_text(np.column_stack([rate, np.degrees(rate), 0 * rate + 37]), header))
    recording = recording_of(found, propose(found).column_map).recording
    assert (recording.info.kind, recording.info.motion) == ("points", "rates")
    np.testing.assert_allclose(np.asarray(recording.columns["table_rate_dps"]), np.degrees(rate), atol=1e-4)


def test_all_problems_of_a_file_are_listed_at_once_with_rows_and_bounded(tmp_path: Path) -> None:
    lines = csv_text(at_rest()).splitlines()
    for row in range(5, 50):
        lines[row] = lines[row].replace(",", ",x", 1)
    lines[60] = lines[60] + ",1,2"
    lines[70] = "0.1" + lines[70][lines[70].index(",") :]
    lines[80] = lines[80].rpartition(",")[0] + ",-400"
    found = table(tmp_path, "\n".join(lines))
    with pytest.raises(BadFile) as refused:
        recording_of(found, propose(found).column_map)
    said = refused.value.problems
    assert any(line.startswith("row 60: 7 columns where the others have 5") for line in said)
    assert any("rows 5, 6, 7, 8, 9 and 40 more: 'x" in line for line in said)
    assert any("0.1 does not follow" in line for line in said)
    assert any("-400 deg C is not possible" in line for line in said)
    assert len(said) <= 21


def test_unused_columns_are_named(tmp_path: Path) -> None:
    rows = np.column_stack([at_rest(), np.ones(400), np.ones(400)])
    header = "time (s),gyro_x (deg/s),gyro_y (deg/s),gyro_z (deg/s),temperature (degC),Press,Ix"
    found = table(tmp_path, csv_text(rows, header))
    assert recording_of(found, propose(found).column_map).unused == ["Press", "Ix"]


def test_a_rest_needs_no_uncertainty_of_its_angle(tmp_path: Path) -> None:
    content = "\n".join(["p,gyro_z (deg/s)", *["still,0.1"] * 40, *["turn,90.1"] * 40]) + "\n"
    toml = (
        'sample_rate_hz = 10\n[datasets]\nby = "column"\ncolumn = "p"\n[parts.still]\nturn_deg = 0\nposition = "z"\n'
        '[parts.turn]\nturn_deg = 360\nturn_u_deg = 2\nposition = "z"\n'
    )
    columns = mapped(tmp_path, content, toml).columns
    assert np.asarray(columns["turn_u_deg"]).tolist() == [0.0] * 40 + [2.0] * 40


def test_an_accelerometer_tells_its_unit_by_gravity(tmp_path: Path) -> None:
    rows = np.column_stack([at_rest()[:, :4], np.tile([6, 92, 16548], (400, 1))])
    header = "time (s),gyro_x (deg/s),gyro_y (deg/s),gyro_z (deg/s),Ax,Ay,Az"
    found = table(tmp_path, csv_text(rows, header))
    proposal = propose(found)
    assert (proposal.column_map.columns["accel_z_g"].unit, proposal.column_map.columns["accel_z_g"].scale) == (
        "LSB",
        16384,
    )
    assert any("16384 words per g" in guess for guess in proposal.guesses)
    wrong = parse_map('[units]\naccel = {unit = "m/s2"}\n')
    with pytest.raises(BadFile, match="g at rest, where gravity is 1 g"):
        recording_of(found, completed(found, wrong).column_map)


def test_a_knock_is_no_movement_and_a_slow_drift_neither(tmp_path: Path) -> None:
    rows = at_rest(6000)
    rows[3000:3020, 1] += 40.0
    rows[:, 2] += np.linspace(0, 3, 6000)
    found = table(tmp_path, csv_text(rows))
    assert recording_of(found, propose(found).column_map).motion == "rest"


@pytest.mark.parametrize(
    ("toml", "said"),
    [
        ("gyro = 1", "gyro: Extra inputs are not permitted"),
        ("columns = 3", "columns: Input should be a valid dictionary"),
        ('[columns]\ngyro_z = {unit = "deg/s"}', "columns.gyro_z.from: Field required"),
        (
            '[columns]\ngyro_z = {from = "w", unit = "furlong"}',
            "gyro_z: 'furlong' is not a known unit of measurement; use deg/s, rad/s, mdps",
        ),
        ('[columns]\ngyro_z = {from = "w", unit = "LSB"}', "gyro_z: unit = 'LSB' also needs scale"),
        ('[columns]\ngyro_z = {from = "w", unit = "deg/s", scale = 3}', "scale is only for unit = 'LSB'"),
        ('[columns]\ngyro_z = {from = "w", unit = "LSB", scale = 0}', "scale is 0"),
        ('[columns]\ngyro_z = {from = "w", sign = 2}', "columns.gyro_z.sign: Input should be 1 or -1"),
        (
            '[columns]\ndataset = {from = "w"}',
            r"dataset: a map cannot fill this column .labctl makes it from \[datasets\]",
        ),
        ('[columns]\n"gy ro" = {from = "w"}', "gy ro: not a name for a column; use letters, digits and _"),
        ("sample_rate_hz = -1", "sample_rate_hz: Input should be greater than 0"),
        ('serial = "/etc"', "serial: String should match pattern"),
        ('motion = "flight"', "motion: Input should be 'rates', 'rest'"),
        ('[datasets]\nby = "column"', 'by = "column" and column = NAME go together; give both'),
        ('[datasets]\nby = "rows"', r'by = "rows" needs a \[parts.NAME\] for each data set'),
        ('[datasets]\nby = "whole"\n[parts.a]\nturn_deg = 1', r"\[parts.NAME\] needs \[datasets\]"),
        ('[parts.a]\nposition = "up"', "parts.a.position: 'up' is not a position .expected x, -x"),
        ('[units]\ngyro = {unit = "K"}', "'K' is not a known unit of measurement; use"),
        ("[[[", "not TOML"),
    ],
)
def test_every_wrong_entry_of_a_map_is_one_clear_line(toml: str, said: str) -> None:
    with pytest.raises(BadInput, match=said) as refused:
        parse_map(toml, "--map m.toml")
    assert str(refused.value).startswith("--map m.toml: ")
    assert "\n" not in str(refused.value)


def test_a_proposed_map_reads_back_as_it_was_written(tmp_path: Path) -> None:
    found = table(tmp_path, csv_text(at_rest(), HEADER.replace(",", ";"), ";", ","))
    proposed = propose(found).column_map
    again = parse_map(map_text(proposed))
    assert again == proposed
    assert again.file == FileKeys(separator=";", decimal=",", header=1, data=2, encoding="utf-8")


def test_the_maps_of_the_how_to_are_maps() -> None:
    text = (ROOT / "docs" / "how-to" / "importing-logs.md").read_text(encoding="utf-8")
    blocks = re.findall(r"```toml\n(.*?)```", text, re.DOTALL)
    assert len(blocks) == 3
    for block in blocks:
        assert parse_map(block).serial
