"""Sixty and more logs as people have them: each is read right, or refused in one line that helps; none is read wrong.

What "right" is comes from the numbers that the files were made of: times, rates in deg/s, temperature in deg C, date.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from labctl.errors import LabctlError
from labctl.recording.column_map import parse_map
from labctl.recording.logs.encoding import TextStream
from labctl.services.recordings.importers import log_with_map
from tests.helpers import ugly_files as made
from tests.helpers.ugly_files import EPOCH_S, UNITS, clock, dates, gz, lines, log, names, npz, numbers, text, truth, xz

ROWS = truth()
PLAIN = lines([names()], numbers())
UNIT_MAP = '[units]\ngyro = { unit = "deg/s" }\n'
ALL_MAP = UNIT_MAP + 'time = { unit = "s" }\ntemperature = { unit = "deg C" }\n'
DATED = "2024-01-25T08:00:00"
ARRAYS = {"time": ROWS[:, 0], "gyro": ROWS[:, 1:4], "temp": ROWS[:, 4]}
FORCE = np.tile([0.0, 0.0, 9.80665], (len(ROWS), 1))
WITH_FORCE = lines(
    [[*names(), "ax", "ay", "az"]],
    [[*row, *force] for row, force in zip(numbers(), FORCE.round(5).tolist(), strict=True)],
)


@dataclass(frozen=True)
class Right:
    """What a file becomes."""

    started: str = ""  #: the date that it states, empty for none
    within_s: float = 2e-5  #: its times are this near
    has_temperature: bool = True
    axes: str = "xyz"  #: whose rates are compared, of those that it has


R = Right()
D = Right(DATED)
BOTH_UNITS = r"deg C and .* degF .* are both possible"
#: Kind -> the file, its map (empty: none), and what becomes of it or what the refusal says.
CASES: dict[str, tuple[made.Maker, str, Right | str]] = {
    # clocks without a unit: the only one by which nothing impossible follows, else it is asked for
    "fractions of a second": (log(None, ""), "", R),
    "milliseconds": (log(clock(1e3)), "", R),
    "microseconds": (log(clock(1e6)), "", R),
    "nanoseconds": (log(clock(1e9)), "", R),
    "microseconds since power-on, ten digits": (log(clock(1e6, 1200.0)), "", R),
    "microseconds since 1970": (log(clock(1e6, EPOCH_S)), "", D),
    "nanoseconds since 1970": (log(clock(1e9, EPOCH_S)), "", Right(DATED, 1e-3)),
    "milliseconds since 1970": (log(clock(1e3, EPOCH_S)), "", D),
    "seconds since 1970 with fractions": (log([f"{EPOCH_S + k / 100:.2f}" for k in range(1000)]), "", D),
    "a second a row, or a millisecond": (log(range(1000)), "", "in s it is 1 readings .* in ms it is 1000 readings"),
    "steps of 1000 of an unknown unit": (log(range(0, 1_000_000, 1000)), "", "no unit is given .*in ms .*in us"),
    "whole seconds since 1970 without a unit": (log([EPOCH_S + k // 100 for k in range(1000)]), "", D),
    "100 ns since 1601": (log([(EPOCH_S + 11_644_473_600) * 10**7 + k * 100_000 for k in range(1000)]), "", D),
    "days of a spreadsheet": (
        log([f"{EPOCH_S / 86400 + 25569 + k / 8_640_000:.12f}" for k in range(1000)]), "", Right(DATED, 1e-4),
    ),
    "days of datenum": (
        log([f"{EPOCH_S / 86400 + 719529 + k / 8_640_000:.12f}" for k in range(1000)], stamp="datenum"), "",
        Right(DATED, 1e-4),
    ),
    "seconds since 1904 without a unit": (
        log([f"{EPOCH_S + 2_082_844_800 + k / 100:.2f}" for k in range(1000)]), "",
        "in epoch 1904 s, of LabVIEW, it would begin 2024-01-25T08:00:00 UTC",
    ),
    "seconds since 1904 by the map": (
        log([f"{EPOCH_S + 2_082_844_800 + k / 100:.2f}" for k in range(1000)]),
        '[units]\ntime = { unit = "epoch 1904 s" }\n', D,
    ),
    "time of week": (log([f"{432_000 + k / 100:.2f}" for k in range(1000)], stamp="TOW"), "", R),
    "time of week that begins again": (
        log([f"{(604_795 + k / 100) % 604_800:.2f}" for k in range(1000)], stamp="TOW"), "",
        "the time of week began again; add 604800 s to the time stamps from row 501 on",
    ),
    # clocks with a unit that is right, or cannot be
    "unit in the name": (log(clock(1e6), "us"), "", R),
    "a name that is a unit": (log(clock(1e3), stamp="millis"), "", R),
    "microseconds since 1970, said to be microseconds": (log(clock(1e6, EPOCH_S), "us"), "", D),
    "microseconds said to be nanoseconds": (log(clock(1e6), "ns"), "", "usual step would be 1e-05 s in ns.*'us' would"),
    "microseconds since 1970 said to be nanoseconds": (
        log(clock(1e6, EPOCH_S), "ns"), "", "usual step would be 1.* s in ns.*'epoch us' would fit",
    ),
    "milliseconds said to be microseconds": (log(clock(1e3), "us"), "", "usual step would be 1e-05 s in us"),
    "seconds said to be milliseconds": (log(None, "ms"), "", "usual step would be 1e-05 s in ms"),
    "60 K/s": (
        text(lines([names(("ms", *UNITS[1:]))], numbers(range(1000), rows=ROWS + ROWS[:, :1] * [0, 0, 0, 0, 6]))),
        "",
        "temperature_c: would change by .* K/s",
    ),
    "a rate in the map that the times contradict": (text(PLAIN), "sample_rate_hz = 50\n", "where sample_rate_hz = 50"),
    "a rate in the map that the times confirm": (text(PLAIN), "sample_rate_hz = 100\n", R),
    "no time, the rate in the map": (
        text(lines([names()[1:]], [row[1:] for row in numbers()])), "sample_rate_hz = 100\n", R,
    ),
    "no time": (text(lines([names()[1:]], [row[1:] for row in numbers()])), "", "no column of time; write"),
    # dates and stamps
    "ISO dates": (log(dates("%Y-%m-%dT%H:%M:%S.%fZ"), stamp="time"), "", D),
    "dd/mm/yyyy": (log(dates("%d/%m/%Y %H:%M:%S.%f"), stamp="time"), "", D),
    "mm/dd/yyyy": (log(dates("%m/%d/%Y %H:%M:%S.%f"), stamp="Date Time"), "", D),
    "dd.mm.yyyy": (log(dates("%d.%m.%Y %H:%M:%S.%f", digits=3), stamp="timestamp"), "", D),
    "yyyy/mm/dd": (log(dates("%Y/%m/%d %H:%M:%S.%f"), stamp="time"), "", D),
    "mm/dd/yyyy with AM": (log(dates("%m/%d/%Y %I:%M:%S.%f %p"), stamp="time"), "", D),
    "05/04/2024: April or May": (
        log(dates("%d/%m/%Y %H:%M:%S.%f", start=made.STARTED.replace(month=4, day=5)), stamp="time"), "",
        "day first or the month first; write unit = 'date-time d/m/y'",
    ),
    "05/04/2024: said by the map": (
        log(dates("%d/%m/%Y %H:%M:%S.%f", start=made.STARTED.replace(month=4, day=5)), stamp="time"),
        '[units]\ntime = { unit = "date-time d/m/y" }\n', Right("2024-04-05T08:00:00"),
    ),
    "times of day": (log(dates("%H:%M:%S.%f"), stamp="time"), "", R),
    "times of day over midnight": (
        log(dates("%H:%M:%S.%f", start=made.STARTED.replace(hour=23, minute=59, second=57)), stamp="time"), "", R,
    ),
    "stamps of whole seconds": (log(dates("%Y-%m-%d %H:%M:%S"), stamp="time"), "", D),
    "whole seconds since 1970": (log([EPOCH_S + k // 100 for k in range(1000)], "s"), "", D),
    "stamps of whole seconds, readings lost": (
        text(lines([["time", *names()[1:]]], numbers(dates("%Y-%m-%d %H:%M:%S"))[:330] +
                   numbers(dates("%Y-%m-%d %H:%M:%S"))[365:])), "", "readings share a stamp.*write sample_rate_hz",
    ),
    "dates with the name of a month": (log(dates("%d-%b-%Y %H:%M:%S.%f"), stamp="time"), "", D),
    "ISO dates without separators": (log(dates("%Y%m%dT%H%M%S.%f"), stamp="time"), "", D),
    "years of two digits": (
        log(dates("%d.%m.%y %H:%M:%S"), stamp="time"), "", "'time' holds texts such as '25.01.24 08:00:00'; expected",
    ),
    "a clock that was set back": (
        log(clock(1e3, 9.0)[:500] + clock(1e3, 4.0)[500:], "ms"), "", "set back by 5 s at row 501.*; add 5 s to",
    ),
    "thousands": (
        log([f"{k:,}" for k in clock(1e3)], "ms"), "", "no column of time .column 't .ms.' holds texts such as '1,000'",
    ),
    "a count of the readings": (log(range(1000), stamp="sample"), "", "column 'sample' counts the readings, at a rate"),
    "a date that is none": (log([*dates("%d/%m/%Y %H:%M:%S")[:-1], "31/02/2024 8:00:09"], stamp="time"), "", "out of"),
    # headers and texts
    "units in a second row": (text(lines([made.NAMES, UNITS], numbers())), "", R),
    "units in brackets in a second row": (text(lines([made.NAMES, [f"[{u}]" for u in UNITS]], numbers())), "", R),
    "units in a second row, milliseconds": (
        text(lines([made.NAMES, ("ms", *UNITS[1:])], numbers(clock(1e3)))), "", R,
    ),
    "T[C]": (text(lines([["t", *names()[1:4], "T[C]"]], numbers())), "", R),
    "T_degC": (text(lines([["t", *names()[1:4], "T_degC"]], numbers())), "", R),
    "ordinals for degrees": (text(PLAIN.replace("deg/s", "º/s").replace("degC", "ºC")), "", R),
    "German": (
        text(lines([["Zeit (s)", *(f"Drehrate {axis} (°/s)" for axis in "XYZ"), "Temperatur (°C)"]], numbers())), "", R,
    ),
    "roll, pitch and yaw": (
        text(lines([["t", "Roll rate [deg/s]", "Pitch rate [deg/s]", "Yaw rate [deg/s]", "T [C]"]], numbers())), "", R,
    ),
    "yaw beside z": (
        text(lines([["yaw rate [deg/s]", *names()]], [["7", *row] for row in numbers()])), "", R,
    ),
    "the header again": (
        text(lines([names()], [*numbers()[:500], names(), *numbers()[500:]])), "",
        "row 501: the names of the columns again, as where logs were joined",
    ),
    "latin-1 degrees": (text(PLAIN.replace("deg/s", "°/s").replace("degC", "°C"), encoding="latin-1"), "", R),
    "UTF-16": (text(PLAIN, encoding="utf-16"), "", R),
    "semicolons and decimal commas": (text(lines([names()], numbers(decimal=","), ";")), "", R),
    "tabs and a title": (text("Gyro 7\nOperator: X\n\n" + lines([names()], numbers(), "\t"), "log.txt"), "", R),
    "Windows lines, a mark, a comment": (text("\ufeff# " + PLAIN.replace("\n", "\r\n")), "", R),
    "rad/s": (
        text(lines([names(("s", *["rad/s"] * 3, "degC"))], numbers(rows=ROWS * [1, *[np.pi / 180] * 3, 1]))), "", R,
    ),
    "a gyro without a unit": (text(lines([made.NAMES], numbers())), "", "for gyro_x: no unit is given"),
    # temperatures without a unit
    "temperatures of a room": (made.warm(lambda x: 24 + x), "", Right(has_temperature=False)),
    "kelvin": (text(lines([[*names()[:4], "temp"]], numbers(rows=ROWS + np.array([0, 0, 0, 0, 273.15])))), "", R),
    "20 to 120, a room at 70": (made.warm(lambda x: 70 - 50 * np.sin(2 * np.pi * x)), "", BOTH_UNITS),
    "a room at 72": (made.warm(lambda x: 72 + x), "", BOTH_UNITS),
    "Fahrenheit by the map": (
        text(lines([[*names()[:4], "temp"]], numbers(rows=ROWS * [1, 1, 1, 1, 1.8] + np.array([0, 0, 0, 0, 32])))),
        '[units]\ntemperature = { unit = "degF" }\n', R,
    ),
    "volts for a temperature": (text(lines([[*names()[:4], "temp [V]"]], numbers())), "", Right(has_temperature=False)),
    # maps with entries that do nothing
    "accel stated, ax ay az in the file": (text(WITH_FORCE), '[units]\naccel = { unit = "m/s2" }\n', R),
    "accel stated, no such column": (text(PLAIN), '[units]\naccel = { unit = "g" }\n', "accel changes nothing"),
    "accel stated, left out of the map": (
        text(WITH_FORCE), '[units]\naccel = { unit = "g" }\n[columns]\nt_s = "x"\n'.replace('t_s = "x"', (
            't_s = { from = "t [s]", unit = "s" }\ngyro_x = { from = "gx [deg/s]", unit = "deg/s" }'
        )), "accel changes nothing: no column of the map .*'ax', 'ay', 'az'",
    ),
    "gap_s without gaps": (text(PLAIN), "[datasets]\ngap_s = 3\n", "gap_s changes nothing"),
    "a constant over a column": (text(PLAIN), "[constants]\ntemperature_c = 20\n", "temperature_c: the map also fills"),
    "[file] of a file that is no text": (npz(time=ROWS[:, 0], gyro=ROWS[:, 1:4]), '[file]\ndecimal = ","\n', "no text"),
    # packed, and of other programs
    "gzip": (gz(text(PLAIN)), "", R),
    "xz": (xz(text(PLAIN)), "", R),
    "bzip2": (made.bz(text(PLAIN)), "", R),
    "gzip, cut off": (made.packed(gz(text(PLAIN)), lambda b: b[: len(b) // 2], ""), "", "not a complete gzip file"),
    "gzip with a decimal comma": (gz(text(lines([names()], numbers(decimal=","), ";"))), "", R),
    "zip": (made.zipped(text(PLAIN)), "", "a zip archive .*; unpack it"),
    "R data": (gz(made.raw(b"RDX3\nX\n" + bytes(99), "log.rda")), "", "R data.*Rscript -e .*write.csv"),
    "R data, not packed": (made.raw(b"RDX3\nX\n" + bytes(99), "log.rda"), "", "R data.*Rscript -e .*write.csv"),
    "R object": (gz(made.raw(b"X\n\0\0\0\x03" + bytes(99), "log.rds")), "", "R object.*readRDS"),
    "spreadsheet": (made.workbook(("data", [names(), *made.cells()])), "", R),
    "spreadsheet with a title and a row of units": (
        made.workbook(("data", [["Test 7"], [], made.NAMES, UNITS, *made.cells()])), "", R,
    ),
    "spreadsheet with dates": (
        made.workbook(("data", [["time", *names()[1:]], *(
            [date, *row[1:]] for date, row in zip(dates("%d/%m/%Y %H:%M:%S.%f"), made.cells(), strict=True)
        )])), "", D,
    ),
    "spreadsheet with two sheets": (
        made.workbook(("one", [names(), *made.cells()]), ("two", [names(), *made.cells()])), "",
        "'one', 'two' hold rows; choose one with --option sheet=NAME",
    ),
    "spreadsheet, cut off": (
        made.packed(made.workbook(("a", [names(), *made.cells()])), lambda b: b[: len(b) // 2], ""), "",
        "a zip archive or a spreadsheet",
    ),
    "npz": (npz(**ARRAYS), UNIT_MAP, R),
    "npz with units in the names": (npz(t_s=ROWS[:, 0], gyro_dps=ROWS[:, 1:4], temp_c=ROWS[:, 4]), "", R),
    "npz without the gyro's unit": (npz(time=ROWS[:, 0], gyro=ROWS[:, 1:4]), "", "for gyro_x: no unit is given"),
    "npz, outputs as rows": (npz(time=ROWS[:, 0], gyro=ROWS[:, 1:4].T, temperature=ROWS[:, 4]), UNIT_MAP, R),
    "npz with a field for each column": (
        npz(log=np.array([tuple(row) for row in ROWS], dtype=[(n, "f8") for n in ("t", "gx", "gy", "gz", "temp")])),
        UNIT_MAP, R,
    ),
    "npz of Python objects": (npz(time=np.array([{}, []] * 9, dtype=object)), "", "no array of numbers"),
    "npz with outputs of two lengths": (
        npz(**{"a.gyro": ROWS[:, 1:4], "b.gyro": ROWS[:9, 1:4], "time": ROWS[:, 0]}), UNIT_MAP,
        "two lengths are outputs of a gyro",
    ),
    "npy": (
        made.npy(ROWS), "[columns]\n" + "\n".join(
            f'{target} = {{ from = {k}, unit = "{unit}" }}'
            for k, (target, unit) in enumerate(zip(("t_s", "gyro_x", "gyro_y", "gyro_z", "temperature_c"), UNITS,
                                                   strict=True), start=1)
        ) + "\n", R,
    ),
    "npy without a map": (made.npy(ROWS), "", "no column is known to be the output of a gyro"),
    "mat 5": (made.mat5({**ARRAYS, "fs": 100.0}), UNIT_MAP, R),
    "mat 5 with a struct": (
        made.mat5({"imu": ARRAYS}), UNIT_MAP, R,
    ),
    "mat 5, packed": (gz(made.mat5(ARRAYS)), UNIT_MAP, R),
    "mat 5 of words": (made.mat5({"note": "a gyro"}), "", "no array of numbers"),
    "mat 7.3": (
        made.hdf5(ARRAYS, {}, "log.mat", matlab=True), UNIT_MAP, R,
    ),
    "HDF5 with units": (
        made.hdf5(
            {"imu/time": 1e3 * ROWS[:, 0], "imu/gyro": np.radians(ROWS[:, 1:4]), "imu/temp": ROWS[:, 4] + 273.15},
            {"imu/time": "ms", "imu/gyro": "rad/s", "imu/temp": "K"},
        ), "", R,
    ),
    "Parquet": (made.parquet(names(), ROWS), "", R),
    "Parquet with an erased page": (
        made.parquet(names(), ROWS, zeroed=(1, slice(200, 456))), "", "rows 201 to 456: 256 exact zeros",
    ),
    "Parquet, an output that is 0 everywhere": (
        made.parquet(names(), ROWS, zeroed=(1, slice(0, 1000))), "", Right(axes="yz"),
    ),
    "HDF5, cut off": (
        made.packed(made.hdf5({"gyro": ROWS[:, 1:4]}, {}), lambda b: b[: len(b) // 2], ""), "", "not a complete HDF5",
    ),
}  # fmt: skip


def test_there_are_sixty() -> None:
    assert len(CASES) >= 60


@pytest.mark.parametrize("kind", [kind for kind in CASES if isinstance(CASES[kind][2], str)])
def test_refused_in_one_line_that_helps(kind: str, tmp_path: Path) -> None:
    maker, toml, expected = CASES[kind]
    assert isinstance(expected, str)
    path = maker(tmp_path)
    with pytest.raises(LabctlError, match=expected) as refused:
        assert log_with_map(path, None, {}, parse_map(toml) if toml else None).recording
    assert str(path) in str(refused.value)
    assert "/labctl-" not in str(refused.value)  # a folder that labctl made


@pytest.mark.parametrize("kind", [kind for kind in CASES if isinstance(CASES[kind][2], Right)])
def test_read_right(kind: str, tmp_path: Path) -> None:
    maker, toml, expected = CASES[kind]
    recording = log_with_map(maker(tmp_path), None, {}, parse_map(toml) if toml else None).recording
    assert isinstance(expected, Right)
    columns, info = recording.columns, recording.info
    t_s = np.asarray(columns["t_s"], dtype=np.float64)
    np.testing.assert_allclose(t_s - t_s[0], ROWS[:, 0], rtol=0, atol=expected.within_s)
    for axis in set(expected.axes) & set(info.axes):
        np.testing.assert_allclose(recording.gyro_dps(axis), ROWS[:, 1 + "xyz".index(axis)], rtol=0, atol=1e-4)
    if expected.has_temperature:
        np.testing.assert_allclose(
            np.asarray(columns["temperature_c"], dtype=np.float64), ROWS[:, 4], rtol=0, atol=2e-5
        )
    date = f"{info.measured_at:%Y-%m-%dT%H:%M:%S}" if info.measured_at is not None else ""
    assert date == expected.started


@pytest.mark.parametrize("zone", [None, "Europe/Berlin"])
def test_time_stamps_of_parquet(zone: str | None, tmp_path: Path) -> None:
    stamps = pa.array([(EPOCH_S * 1000 + 10 * k) for k in range(1000)], pa.timestamp("ms", zone))
    table = pa.table({"timestamp": stamps, **{f"gyro_{a}_dps": ROWS[:, 1 + k] for k, a in enumerate("xyz")}})
    pq.write_table(table, tmp_path / "log.parquet")
    recording = log_with_map(tmp_path / "log.parquet", None, {}, None).recording
    assert f"{recording.info.measured_at:%Y-%m-%dT%H:%M:%S}" == DATED
    np.testing.assert_allclose(np.asarray(recording.columns["t_s"], dtype=np.float64), ROWS[:, 0], rtol=0, atol=1e-6)


@pytest.mark.parametrize(
    "order",
    [("commanded rate", "table rate"), ("table rate", "rate_cmd"), ("rate_cmd", "rate_meas"), ("SpeedFbk", "rate_cmd")],
)
def test_a_measured_rate_goes_before_the_commanded_one(order: tuple[str, str], tmp_path: Path) -> None:
    rates = np.repeat([0.0, 20.0, -20.0, 40.0], 250)
    asked, measured = ("commanded rate", "rate_cmd"), ("table rate", "rate_meas", "SpeedFbk")
    both = dict.fromkeys(asked, rates) | dict.fromkeys(measured, 1.001 * rates)
    columns = np.column_stack([ROWS[:, 0], *(both[each] for each in order), ROWS[:, 3] + rates, ROWS[:, 4]])
    header = ["t [s]", *(f"{each} [deg/s]" for each in order), "gyro_z [deg/s]", "temp [degC]"]
    path = text(lines([header], columns.round(6).tolist()))(tmp_path)
    taken = np.asarray(log_with_map(path, None, {}, None).recording.columns["table_rate_dps"], dtype=np.float64)
    assert taken == pytest.approx(1.001 * rates, abs=1e-6)


@pytest.mark.parametrize(
    ("rate", "output"),
    [("rate_dps", "gyro_out_dps"), ("angular rate [deg/s]", "gyro_z [deg/s]"), ("rate [deg/s]", "gyro output [deg/s]")],
)
def test_a_bare_rate_beside_an_output_of_the_gyro_is_the_tables(rate: str, output: str, tmp_path: Path) -> None:
    rates = np.repeat([0.0, 20.0, -20.0, 40.0], 250)
    columns = np.column_stack([ROWS[:, 0], rates, ROWS[:, 3] + rates, ROWS[:, 4]])
    path = text(lines([["t [s]", rate, output, "temp [degC]"]], columns.round(6).tolist()))(tmp_path)
    recording = log_with_map(path, None, {}, None).recording
    assert np.asarray(recording.columns["table_rate_dps"], dtype=np.float64) == pytest.approx(rates)
    np.testing.assert_allclose(recording.gyro_dps("z"), ROWS[:, 3] + rates, rtol=0, atol=1e-6)


def test_a_bare_rate_alone_is_that_of_the_gyro(tmp_path: Path) -> None:
    columns = np.column_stack([ROWS[:, 0], ROWS[:, 3], ROWS[:, 4]])
    path = text(lines([["t [s]", "rate [deg/s]", "temp [degC]"]], columns.round(6).tolist()))(tmp_path)
    recording = log_with_map(path, None, {}, None).recording
    assert recording.gyro_dps("z") == pytest.approx(ROWS[:, 3], abs=1e-6)


def test_only_the_calling_thread_reads_a_text(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    readers = set()
    read = TextStream.read

    def seen(stream: TextStream, size: int = -1) -> bytes:
        readers.add(threading.current_thread())
        return read(stream, size)

    monkeypatch.setattr(TextStream, "read", seen)
    assert log_with_map(text(PLAIN)(tmp_path), None, {}, None).recording
    assert readers == {threading.main_thread()}  # a thread that takes the interpreter's lock as it ends aborts it


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_rows_are_whole_and_counted_across_pieces(end: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("labctl.recording.logs.text.BLOCK_BYTES", 1000)
    content = PLAIN.replace("\n", end)
    recording = log_with_map(text(content)(tmp_path), None, {}, None).recording
    np.testing.assert_allclose(recording.gyro_dps("x"), ROWS[:, 1], rtol=0, atol=1e-6)
    rows = content.split(end)
    rows[700] += ",7"
    rows[900] += ",7"
    with pytest.raises(LabctlError, match="rows 700, 900: 6 columns where the others have 5"):
        assert log_with_map(text(end.join(rows))(tmp_path), None, {}, None).recording


def test_what_the_map_states_is_not_guessed(tmp_path: Path) -> None:
    maker = npz(**ARRAYS)
    path = maker(tmp_path)
    assert len(log_with_map(path, None, {}, parse_map(UNIT_MAP)).guesses) == 2
    assert not log_with_map(path, None, {}, parse_map(ALL_MAP)).guesses
