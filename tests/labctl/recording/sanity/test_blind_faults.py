"""Files with one fault each, made by a generator whose author had not read the checks, and what is said of them."""

from __future__ import annotations

import zlib
from pathlib import Path

import numpy as np
import pytest

from labctl.errors import BadInput
from labctl.services.recordings.examination import inspection_of_file
from studies.blind.fault_kinds import KINDS
from studies.blind.records import Record, rest
from studies.blind_forensics import outcome, said_of, written

SEED = 3
#: Packets of whole seconds are no fault: their readings are spread over them when they are imported.
NOT_ALWAYS = {"batched_stamps"}


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind not in NOT_ALWAYS])
def test_a_fault_is_named_or_its_file_refused_with_its_name(kind: str, tmp_path: Path) -> None:
    assert outcome(kind, *said_of(kind, 0, SEED, tmp_path)) in ("named", "refused")


@pytest.mark.parametrize("index", [3, 5])  # within a slow swing of a fast log; two swings within half a second
def test_a_nudge_is_a_motion_and_no_second_device(index: int, tmp_path: Path) -> None:
    assert outcome("nudged", *said_of("nudged", index, 97, tmp_path)) in ("named", "refused")


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["plain", "rate_steps", "long_soak", "coarse", "jitter", "through_zero", "hot"])
def test_awkward_but_clean_files_get_no_finding(kind: str, tmp_path: Path) -> None:
    for index in range(2):
        assert said_of(kind, index, SEED, tmp_path) == (frozenset(), "")


def at_rest(kind: str = "rest") -> Record:
    record = rest(np.random.default_rng([SEED, zlib.crc32(kind.encode())]))
    record.form, record.unit = "csv", "deg/s"
    return record


def test_part_of_a_thermometer_in_fahrenheit_is_said_and_may_be_left_out(tmp_path: Path) -> None:
    record = at_rest()
    record.temperature = 22.0 + np.zeros(record.size)
    record.temperature[200:400] = 22.0 * 1.8 + 32.0
    (found,) = inspection_of_file(written(record, tmp_path / "log")).warnings
    assert (found.what, found.n, found.may_leave_out) == ("thermometer", 200, True)
    assert "200 readings are in deg F" in found.text


def test_a_log_in_two_units_is_refused_with_that_as_the_cause(tmp_path: Path) -> None:
    rng = np.random.default_rng(SEED)
    record = at_rest()
    record.gyro = {axis: 3.0 + rng.normal(0.0, 0.2, record.size) for axis in "xyz"}
    for values in record.gyro.values():
        values[record.size // 2 :] *= np.pi / 180.0
    with pytest.raises(BadInput, match=r'if the unit was to rest, write motion = "rest" in a map.*mixed_units'):
        inspection_of_file(written(record, tmp_path / "log"))


def test_stamps_that_readings_share_are_inspected_as_they_are_imported(tmp_path: Path) -> None:
    record = at_rest()
    record.t_s = np.floor(np.arange(record.size) / 10.0)
    found = inspection_of_file(written(record, tmp_path / "log"))
    assert (found.readings, found.warnings) == (record.size, [])


def test_rows_that_were_written_twice_are_no_clock_that_was_set(tmp_path: Path) -> None:
    record = at_rest()
    record.take(np.r_[0:300, 200 : record.size])
    (found,) = inspection_of_file(written(record, tmp_path / "log")).warnings
    assert (found.what, found.n, found.may_leave_out) == ("time_back", 100, True)
    assert "written twice" in found.text


def test_a_temperature_that_no_gyro_survives_asks_for_its_unit(tmp_path: Path) -> None:
    record = at_rest()
    record.temperature = np.linspace(150.5, 200.0, record.size)
    (found,) = inspection_of_file(written(record, tmp_path / "log")).warnings
    assert found.what == "thermometer"
    assert "check the unit of the column: deg F" in found.text
