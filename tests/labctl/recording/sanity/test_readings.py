"""Faults of single readings, made by a generator that knows nothing of the checks, and what is said of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from labctl.recording import Recording, RecordingInfo, read_recording, write_recording
from labctl.recording.column_map.movement import movement
from labctl.recording.sanity import inspect_recording
from labctl.recording.sanity.readings import examination, examine, joined_examinations, without
from labctl.services.recordings.examples import examples
from studies.forensics import NAMES, recording_of, said_of
from studies.forensics_records import FAULTS, Record, clean_record, faulty

SEEDS = (301, 302)
STARTED = datetime(2026, 1, 5, 8, tzinfo=UTC)


@pytest.mark.slow
@pytest.mark.parametrize("kind", FAULTS)
def test_each_kind_of_fault_is_found(kind: str) -> None:
    for seed in SEEDS:
        assert NAMES[kind] & set(said_of(faulty(kind, seed))), (kind, seed)


@pytest.mark.slow
def test_clean_records_get_no_finding() -> None:
    assert [dict(said_of(clean_record(seed))) for seed in range(301, 316)] == [{}] * 15


@pytest.mark.parametrize("name", [name for name in examples() if name != "weiss-gyrostar"])
def test_the_examples_get_no_finding_of_single_readings(name: str) -> None:
    assert examine(read_recording(examples()[name])) == []


def at_rest(change: Callable[[np.ndarray], None] | None = None) -> Recording:
    """Return a record of 60 s at rest whose first output is changed."""
    record = next(made for made in map(clean_record, range(1, 99)) if made.motion == "rest")
    gyro = record.gyro_dps.copy()
    if change is not None:
        change(gyro)
    return recording_of(replace(record, gyro_dps=gyro))


def spiked(gyro: np.ndarray) -> None:
    gyro[[500, 900, 901], 0] += 40.0


def test_a_finding_says_channel_rows_size_and_that_they_may_be_left_out() -> None:
    (found,) = inspect_recording(at_rest(spiked))
    assert (found.what, found.channel, found.n, found.may_leave_out) == ("spikes", "gyro_x", 3, True)
    assert "row 501 and 1 more place" in found.where
    assert abs(found.value or 0.0) == pytest.approx(40.0, rel=0.05)


def test_readings_are_left_out_by_choice_and_the_recording_says_so(tmp_path: Path) -> None:
    made = without(at_rest(spiked), ["spikes"], "a.csv")
    assert np.flatnonzero(np.asarray(made.columns["valid"]) == 0).tolist() == [500, 900, 901]
    (left,) = made.info.left_out
    assert (left.what, left.channel, left.n, left.of) == ("spikes", "gyro_x", 3, len(made))
    assert inspect_recording(made) == []
    write_recording(made, tmp_path / "made")
    assert read_recording(tmp_path / "made").info.left_out == made.info.left_out


def test_nothing_is_left_out_where_nothing_was_found() -> None:
    clean = at_rest()
    assert without(clean, ["all"], "a.csv") is clean


def test_every_reading_is_in_the_picture() -> None:
    made = at_rest(spiked)
    course = next(each for each in examination(made).courses if each["channel"] == "gyro_x")
    values = np.asarray(made.columns["gyro_x"], dtype=np.float64)
    assert course["readings"] == len(made)
    assert max(high for high in course["high"] if high is not None) == values.max()
    assert min(low for low in course["low"] if low is not None) == values.min()


def test_the_places_of_a_finding_are_marked() -> None:
    made = at_rest(spiked)
    (mark,) = examination(made).marks
    t_s = np.asarray(made.columns["t_s"], dtype=np.float64)
    assert (mark["what"], mark["channel"], mark["places"], mark["whole"]) == ("spikes", "gyro_x", 2, False)
    assert mark["from_s"][0] < t_s[500] < mark["until_s"][0]


def test_parts_of_a_recording_are_one_examination() -> None:
    part = examination(at_rest(spiked))
    both = joined_examinations([part, part])
    assert [(each.what, each.n) for each in both.findings] == [("spikes", 6)]
    assert both.courses[0]["readings"] == 2 * part.courses[0]["readings"]


def test_rows_marked_as_bad_are_not_examined() -> None:
    made = at_rest(spiked)
    valid = np.ones(len(made), dtype=np.int64)
    valid[[500, 900, 901]] = 0
    assert inspect_recording(replace(made, columns={**made.columns, "valid": valid})) == []


@pytest.mark.parametrize("level_dps", [0.0, 0.1, 0.125, 0.2])
def test_coarse_steps_at_rest_are_no_movement(level_dps: float) -> None:
    rng = np.random.default_rng(7)
    rates = np.round((level_dps + 0.03 * rng.normal(size=(6000, 3))) / 0.25) * 0.25
    assert movement(rates, np.arange(6000) / 50.0).is_rest


@pytest.mark.slow
@pytest.mark.parametrize("every_s", [0.02, 0.5])
def test_a_bias_that_follows_a_temperature_loop_is_no_movement(every_s: float) -> None:
    """3 deg/s over a loop of 70 min: it leaves its level for many minutes, and takes minutes to do so."""
    rng = np.random.default_rng(11)
    t_s = np.arange(0.0, 4200.0, every_s)
    warm = np.interp(t_s, [0.0, 1400.0, 3100.0, 4200.0], [50.0, -17.0, 74.0, 36.0])
    bias = 4e-4 * (warm - 20.0) ** 2 + 0.02 * rng.standard_normal((3, len(t_s)))
    columns: dict[str, np.ndarray] = {"t_s": t_s, "dataset": np.ones(len(t_s), dtype=np.int64), "temperature_c": warm}
    info = RecordingInfo(serial="U", axes=["x", "y", "z"], kind="samples", motion="rest", started_at=STARTED)
    columns |= {f"gyro_{axis}": values for axis, values in zip("xyz", bias, strict=True)}
    assert "moved" not in {found.what for found in inspect_recording(Recording(info, columns))}
    columns["gyro_x"] = bias[0] + 5.0 * ((t_s > 2000.0) & (t_s < 2050.0))
    assert "moved" in {found.what for found in inspect_recording(Recording(info, columns))}


def test_a_clock_that_was_set_back_says_what_to_add() -> None:
    record: Record = next(made for made in map(clean_record, range(1, 99)) if made.motion == "rest")
    set_back = replace(record, t_s=record.t_s - 12.0 * (np.arange(len(record)) >= 2000))
    (found,) = inspect_recording(recording_of(set_back))
    assert found.what == "clock_step"
    assert not found.may_leave_out
    assert "from row 2001 on" in found.do
    assert found.value == pytest.approx(-12.0, abs=0.05)


@pytest.mark.parametrize(("of_the_room", "found"), [(0.0, []), (0.1, ["vibration"])])
def test_steps_of_the_table_that_all_rates_sample_to_one_frequency_are_no_vibration(
    of_the_room: float, found: list[str]
) -> None:
    """A motor with full steps of 1.8 deg at 125 Hz: 25 and 50 deg/s are seen at 13.9 and 27.8 Hz, and so on."""
    rng, rates_dps, n = np.random.default_rng(5), np.repeat([0.0, 100.0, -100.0, 150.0, -150.0, 275.0, -275.0], 4), 1024
    dataset = np.repeat(np.arange(1, len(rates_dps) + 1), n)
    t_s, rate_dps = np.arange(len(dataset)) / 125, np.repeat(rates_dps, n)
    ripple_dps = sum(np.sin(2 * np.pi * k * rate_dps * t_s / 1.8) for k in (1, 2, 3))
    room_dps = np.sin(2 * np.pi * 31.0 * t_s)
    gyro_dps = rate_dps + 0.15 * ripple_dps + of_the_room * room_dps + rng.normal(0, 0.1, len(t_s))
    info = RecordingInfo(serial="U", axes=["z"], kind="samples", motion="rates", started_at=STARTED)
    columns = {"t_s": t_s, "dataset": dataset, "table_rate_dps": rate_dps, "gyro_z": gyro_dps}
    assert [finding.what for finding in inspect_recording(Recording(info, columns))] == found
