"""Recordings with data sets that were measured to verify: no figure of the unit is taken from these."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from labctl.answers.calibrations import FitRequest, ImproveRequest
from labctl.errors import NotEnoughData
from labctl.recording import Recording, RecordingInfo, write_recording
from labctl.services.calibrations.fitting import fit_unit
from labctl.services.calibrations.revision import improve_unit
from labctl.services.criticism.criticise import criticise_unit
from labctl.services.criticism.trend import trend_unit
from labctl.services.criticism.verification.of_version import verify_unit
from labctl.services.datasheet.sheet import datasheet
from labctl.services.recordings.allan import allan_unit
from labctl.services.recordings.allan_source import allan_of_file, allan_of_unit
from labctl.store import Store, open_store
from tests.helpers.simulated_recordings import single_axis

AT = datetime(2026, 11, 25, tzinfo=UTC)
SERIAL = "FOG-0001"
NOISE_DPS = 0.01
SHORT, LONG = 2000, 8000


def marked(recording: Recording) -> Recording:
    """Return a recording that was measured to verify as a whole."""
    marks = np.ones(len(recording), dtype=np.int64)
    return replace(recording, columns={**recording.columns, "verification": marks})


def at_rest() -> Recording:
    """Return two data sets at rest; the second is longer, has 100 times the noise, and was measured to verify."""
    n = SHORT + LONG
    aside = np.arange(n) >= SHORT
    noise = np.random.default_rng(1).standard_normal(n) * np.where(aside, 100.0, 1.0) * NOISE_DPS
    info = RecordingInfo(
        format="labctl-recording/1", serial=SERIAL, model="FOG", axes=("z",), kind="samples",
        started_at=AT, sample_rate_hz=100.0,
    )  # fmt: skip
    columns = {
        "dataset": np.where(aside, 2, 1), "t_s": np.arange(n) / 100.0, "run": np.ones(n, dtype=np.int64),
        "position": np.full(n, "z"), "table_rate_dps": np.zeros(n), "temperature_c": np.full(n, 25.0),
        "gyro_z": noise, "verification": aside.astype(np.int64),
    }  # fmt: skip
    return Recording(info, columns)


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as opened:
        yield opened


def test_the_allan_deviation_and_the_data_sheet_take_what_is_fitted(store: Store, tmp_path: Path) -> None:
    white = NOISE_DPS / np.sqrt(100.0)  # deg/s per root hertz; the Allan deviation states it in deg per root hour
    expected = pytest.approx(60.0 * white, rel=0.1)
    write_recording(at_rest(), tmp_path / "file")
    number = store.recordings.add_import(at_rest(), AT)
    found = allan_of_unit(store, SERIAL, None, None)
    for answer in (found, allan_of_unit(store, SERIAL, None, "gyro_z"), allan_of_file(tmp_path / "file", None)):
        assert next(iter(answer.axes.values()))["N"]["value"] == expected
    assert found.datasets == [1, 1]
    assert allan_unit(store, number, 2).axes["z"]["N"]["value"] > 3000.0 * white  # asked for by its number
    lines = {each.id: each for each in datasheet(store, SERIAL).characteristics}
    assert lines["angle_random_walk"].value == pytest.approx(white, rel=0.1)
    assert lines["bias"].conditions is not None
    assert lines["bias"].conditions.datasets == 1


def test_a_recording_that_only_verifies_has_no_allan_deviation(store: Store) -> None:
    number = store.recordings.add_import(marked(at_rest()), AT)
    with pytest.raises(NotEnoughData, match="beside the 2 data sets at rest that were measured to verify"):
        allan_unit(store, number, None)


@pytest.mark.slow
def test_without_a_number_the_newest_recording_that_can_be_fitted_is_taken(store: Store) -> None:
    store.recordings.add_import(single_axis(1), AT)
    store.recordings.add_import(marked(single_axis(2)), AT)
    made = fit_unit(store, SERIAL, FitRequest(effects=["bias", "scale_factor"]), AT)
    assert made.recording == 1
    (said,) = made.warnings
    assert (said.what, said.severity) == ("passed_over", "likely")
    assert said.text.startswith("recording 2: measured only to verify a calibration, so recording 1 was used")
    changed = improve_unit(store, SERIAL, ImproveRequest(add=["scale_factor_odd"]), AT)
    criticism = criticise_unit(store, SERIAL, None, None)
    for answer in (changed, criticism):
        assert answer.recording == 1
        assert [each.what for each in answer.warnings] == ["passed_over"]
    assert "recording 2" in criticism.text[0]
    assert verify_unit(store, SERIAL, None, None).recording == 2
    named = fit_unit(store, SERIAL, FitRequest(recording=1, effects=["bias", "scale_factor"]), AT)
    assert named.warnings == []
    points = trend_unit(store, SERIAL).points
    assert "never fitted" in points[1].why
    assert points[1].as_found is not None or points[0].as_left is not None
    with pytest.raises(NotEnoughData, match="never fitted; name another recording"):
        fit_unit(store, SERIAL, FitRequest(recording=2, effects=["bias", "scale_factor"]), AT)


def test_a_unit_with_no_recording_that_can_be_fitted_is_refused(store: Store) -> None:
    store.recordings.add_import(marked(single_axis(1)), AT)
    with pytest.raises(NotEnoughData, match="never fitted; name another recording"):
        fit_unit(store, SERIAL, FitRequest(effects=["bias", "scale_factor"]), AT)
