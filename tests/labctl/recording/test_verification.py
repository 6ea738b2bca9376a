"""What was measured to verify a calibration: marked from the plan to the file, and fitted by nothing."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from instruments.bench_config import read_bench
from instruments.clock import VirtualClock
from instruments.drivers.resolution import resolve
from labctl.answers.calibrations import FitRequest
from labctl.errors import BadRecording, DataRefused, NotEnoughData
from labctl.fitting import fit
from labctl.fitting.criticism import criticise
from labctl.fitting.data.fit_data import fit_data_of
from labctl.fitting.data.joined import joined_recording
from labctl.recording import Recording, read_recording, to_points, write_recording
from labctl.recording.sanity import certain, inspect_recording
from labctl.recording.verification import fitted_part, verification_part
from labctl.services.calibrations.assessment import assess
from labctl.services.calibrations.fitting import fit_unit
from labctl.services.campaigns.execution import run
from labctl.services.campaigns.preparation import prepare
from labctl.services.criticism.verification.of_version import verify_unit
from labctl.services.planning.loading import limits_of, load_bench, load_recipe
from labctl.services.recordings.catalogue import data_sets
from labctl.services.simulation.plan_simulation import hidden_recording
from labctl.store import open_store
from procedures.planning.plan import make_plan
from procedures.recipe.rules import Verification

#: The same question of the same recording is answered once for the whole run.
pytestmark = pytest.mark.usefixtures("shared_answers")

AT = datetime(2026, 11, 25, tzinfo=UTC)
EFFECTS = ["bias", "scale_factor", "misalignment"]
RECIPE = """format = "labctl-recipe/1"
name = "verified"
temperatures_c = [24, 28]
rates_dps = [-40, -20, 0, 20, 40]
positions = ["z"]
[soak]
hold_s = 60
max_drift_c = 1.0
drift_window_s = 30
[acquire]
duration_s = 10
settle_s = 2
[verification]
rates = 4
"""


@pytest.fixture(scope="module")
def recording() -> Recording:
    """Readings of a tri-axial unit, of which 30 of 114 data sets verify."""
    recipe = load_recipe("quick-triaxial").model_copy(update={"verification": Verification(temperatures=2)})
    bench = load_bench("triaxial-sim")
    plan = make_plan(recipe, limits_of(bench))
    return hidden_recording(plan, bench, bench.gyros[0].model_copy(update={"sample_rate_hz": 4.0}), 3, {})


def spoilt(recording: Recording) -> Recording:
    """Return a recording whose verification part is 5 deg/s off."""
    marked = np.asarray(recording.columns["verification"]) != 0
    columns = {n: v + 5.0 * marked if n.startswith("gyro_") else v for n, v in recording.columns.items()}
    return replace(recording, columns=columns)


def test_no_fit_and_no_criticism_sees_it(recording: Recording) -> None:
    whole, off = fit(recording, effects=EFFECTS), fit(spoilt(recording), effects=EFFECTS)
    for axis in "xyz":
        assert np.array_equal(whole.fitted.axes[axis].values, off.fitted.axes[axis].values)
    assert off.error == whole.error
    first, second = (criticise(each, whole.fitted.model, full=False) for each in (recording, spoilt(recording)))
    assert first.verdict == second.verdict
    assert len(first.fit_data) == len(fit_data_of(recording)) == 84


def test_it_is_left_out_of_several_recordings_too(recording: Recording) -> None:
    plain = fitted_part(recording)
    assert "verification" not in plain.columns
    joined = joined_recording({1: to_points(spoilt(recording)), 2: to_points(plain)})
    assert "verification" not in joined.columns
    assert len(joined) == 2 * 84
    assert np.abs(joined.columns["gyro_x"][np.asarray(joined.columns["table_rate_dps"]) == 0]).max() < 1.0


def test_verification_and_fitted_parts_cover_a_recording(recording: Recording) -> None:
    aside = verification_part(recording)
    assert aside is not None
    assert len(aside) + len(fitted_part(recording)) == len(recording)
    assert verification_part(aside) is None
    assert len(np.unique(aside.columns["dataset"])) == 30
    only = replace(recording, columns={**recording.columns, "verification": np.ones(len(recording), dtype=np.int64)})
    with pytest.raises(NotEnoughData, match="never fitted; name another recording"):
        fit(only, effects=EFFECTS)


@pytest.mark.slow
@pytest.mark.parametrize("file_format", ["csv", "parquet"])
def test_the_mark_survives_files_and_the_database(recording: Recording, tmp_path: Path, file_format: Any) -> None:
    write_recording(recording, tmp_path / "out", file_format)
    read = read_recording(tmp_path / "out")
    assert np.array_equal(read.columns["verification"], recording.columns["verification"])
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as store:
        number = store.recordings.add_import(read, AT)
        points = store.recordings.points(number)
        assert int(points.columns["verification"].sum()) == 30
        assert np.array_equal(points.columns["verification"], to_points(recording).columns["verification"])
        assert "verification" not in set(data_sets(store, number).channels)
        assert sum(data_sets(store, number).verification) == 30
        fit_unit(store, "STIM-0001", FitRequest(effects=EFFECTS), AT)
        answer = verify_unit(store, "STIM-0001", None, None)
        assert (answer.part, answer.datasets, answer.seen) == ("verification", 30, False)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda marks: marks * 2, "column 'verification', row .*: 2 is not 0 or 1"),
        (
            lambda marks: np.where(np.arange(len(marks)) == 5, 1 - marks, marks),
            "row 6: 1 differs from 0 in the row before",
        ),
    ],
)
def test_a_wrong_mark_is_named(recording: Recording, tmp_path: Path, change: Any, message: str) -> None:
    marks = np.asarray(recording.columns["verification"])
    wrong = replace(recording, columns={**recording.columns, "verification": change(marks)})
    write_recording(wrong, tmp_path / "out")
    with pytest.raises(BadRecording, match=message):
        read_recording(tmp_path / "out")


@pytest.mark.slow
def test_a_campaign_marks_its_verification_part(tmp_path: Path) -> None:
    bench = resolve(read_bench("servo-sim"))
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as store:
        prepared = prepare(store, RECIPE, bench, VirtualClock(), clip=False)
        answer = run(store, prepared)
        assert answer.state == "done", answer.reason
        number = next(iter(answer.recordings.values()))
        samples, points = store.recordings.samples(number), store.recordings.points(number)
        assert int(points.columns["verification"].sum()) == 4
        assert np.array_equal(to_points(samples).columns["verification"], points.columns["verification"])
        assert len(np.unique(points.columns["run"])) == 2
        fit_unit(store, "FOG-0001", FitRequest(effects=["bias", "scale_factor"]), AT)
        assert verify_unit(store, "FOG-0001", None, None).datasets == 4


def without_gain(recording: Recording) -> Recording:
    """Return a recording whose verification part has one output with the sign of another mounting."""
    marked = np.asarray(recording.columns["verification"]) != 0
    return replace(
        recording, columns={n: np.where(marked, -v, v) if n == "gyro_x" else v for n, v in recording.columns.items()}
    )


@pytest.mark.slow
def test_a_fault_of_the_verification_part_refuses_no_fit_but_the_certification(
    recording: Recording, tmp_path: Path
) -> None:
    assert inspect_recording(recording) == []
    wrong = without_gain(recording)
    found = inspect_recording(wrong)
    assert {each.part for each in certain(found)} == {"verification"}
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as store:
        store.recordings.add_import(wrong, AT)
        serial = wrong.info.serial
        made = fit_unit(store, serial, FitRequest(effects=EFFECTS), AT)
        assert made.warnings == []
        objections = [each for each in assess(store, serial, made.version).objections if each["what"] == "data"]
    assert objections
    assert "recording 1: verification part, axis x" in objections[0]["text"]
    assert objections[0]["do"].endswith("and measure the verification part again")


@pytest.mark.slow
def test_a_fault_of_what_is_fitted_refuses_the_fit(recording: Recording, tmp_path: Path) -> None:
    columns = {name: -values if name == "gyro_x" else values for name, values in recording.columns.items()}
    wrong = replace(recording, columns=columns)
    assert {each.part for each in certain(inspect_recording(wrong))} == {"fitted", "verification"}
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as store:
        store.recordings.add_import(wrong, AT)
        with pytest.raises(DataRefused, match=r"is refused: axis x"):
            fit_unit(store, wrong.info.serial, FitRequest(effects=EFFECTS), AT)
