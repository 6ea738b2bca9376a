"""Campaigns on a servo table, through its bytes: a table that turns 200 ppm too fast, by the encoder and without it."""

from __future__ import annotations

import json
import re
import sqlite3
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from instruments.bench_config import BenchFile, read_bench
from instruments.clock import VirtualClock
from instruments.drivers.resolution import resolve
from labctl.answers.calibrations import FitRequest
from labctl.recording import Recording, read_recording, to_points, write_recording
from labctl.services.calibrations.fitting import fit_unit, one_version
from labctl.services.calibrations.served import calibration_file
from labctl.services.campaigns.execution import run
from labctl.services.campaigns.preparation import prepare
from labctl.services.criticism.criticise import criticise_unit
from labctl.store import open_store

RECIPE = """format = "labctl-recipe/1"
name = "servo"
temperatures_c = [25]
rates_dps = [-90, -45, 0, 45, 90]
positions = ["z"]
repeats = 2
[soak]
hold_s = 60
max_drift_c = 1.0
drift_window_s = 30
[acquire]
duration_s = 20
settle_s = 2
"""
AT = datetime(2026, 11, 23, tzinfo=UTC)
FAST = {"rate_ratio": 1.0002}


@dataclass
class Outcome:
    """What a campaign left, its fit, and what criticism says of it."""

    samples: Recording
    points: Recording
    version: Any
    provenance: dict[str, Any]
    scale: float  #: fitted scale factor less the true one
    u: float
    text: str
    events: list[tuple[str, str, float]]
    location: str


def campaign(
    folder: Path, table: dict[str, Any] | None = None, *, criticised: bool = True, **simulated: float
) -> Outcome:
    """Run a campaign of a gyro with a linear law on the servo table; fit it and criticise the fit."""
    record = read_bench("servo-sim").model_dump()
    record["table"] |= table or {}
    record["simulation"]["table"] |= simulated
    linear = {"profile": "mems-triaxial", "white_dps_rthz": 0.001, "instability_dps": 0.0002}
    record["simulation"]["units"] = {"fog": linear}
    record["gyros"][0].update(datasheet={}, datasheet_conventions={})
    location = str(folder / "lab.sqlite")
    with open_store(location, write=True) as store:
        prepared = prepare(store, RECIPE, resolve(BenchFile.model_validate(record)), VirtualClock(), clip=False)
        answer = run(store, prepared)
        assert answer.state == "done", answer.reason
        number = next(iter(answer.recordings.values()))
        samples, points = store.recordings.samples(number), store.recordings.points(number)
        assert prepared.bench.simulation is not None
        truth = prepared.bench.simulation.world.gyro("fog").truth
        warm = np.asarray(points.columns["temperature_c"], dtype=np.float64)
        true = float(truth.gain(warm)[:, -1, -1].mean())
        made = fit_unit(store, "FOG-0001", FitRequest(model="single_temperature"), AT)
        row = store.calibrations.get("FOG-0001", made.version)
        document = json.loads(row.document)
        coefficient = document["coefficients"]["z"]["scale_factor"]
        version = one_version(store, "FOG-0001", made.version)
        text = "\n".join(criticise_unit(store, "FOG-0001", None, None).text) if criticised else ""
        assert calibration_file(store, "FOG-0001", made.version, "json").content == row.document
    with sqlite3.connect(location) as raw:
        events = raw.execute("select level, message, value from events where kind = 'table_rate_ratio'").fetchall()
    raw.close()
    value, u = coefficient["value"], coefficient["u"]
    return Outcome(samples, points, version, document["provenance"], 1 + value - true, u, text, events, location)


@pytest.mark.slow
def test_with_the_encoder_the_scale_factor_is_right(tmp_path: Path) -> None:
    found = campaign(tmp_path, **FAST)
    assert abs(found.scale) < 3 * found.u < 3e-5
    ((level, message, value),) = found.events  # once, not for every data set
    assert level == "warning"
    assert value == pytest.approx(200, abs=30)
    assert "the encoder is the reference, so this difference does not affect a calibration" in message
    assert "table_rate_ratio" not in found.text  # nothing is wrong with the data
    # said in the recording, in the calibration document and for the pages
    assert found.samples.info.rate_reference == "measured"
    assert found.provenance["rate_reference"] == found.version.rate_reference == "measured by the encoder"
    # stored: raw angles with their times, and the reference of every reading
    with sqlite3.connect(found.location) as raw:
        encoders = [json.loads(text) for (text,) in raw.execute("select encoder from data_sets order by number")]
    raw.close()
    assert all(len(one["t_s"]) == len(one["angle_deg"]) >= 20 for one in encoders)
    rate = np.asarray(found.samples.columns["table_rate_dps"])
    commanded = np.asarray(found.samples.columns["computed_rate_dps"])
    turned = commanded != 0
    assert np.all(np.abs(rate[turned] / commanded[turned] - 1.0002) < 4e-5)
    assert np.all(rate[~turned] == 0)
    again = to_points(found.samples)
    assert np.allclose(again.columns["table_rate_dps"], found.points.columns["table_rate_dps"], rtol=1e-12)
    write_recording(found.samples, tmp_path / "out")
    assert read_recording(tmp_path / "out").info.rate_reference == "measured"


@pytest.mark.slow
def test_without_it_the_error_is_in_the_scale_factor_and_is_named_table_rate_ratio(tmp_path: Path) -> None:
    found = campaign(tmp_path, {"reference": "demanded"}, **FAST)
    assert found.scale == pytest.approx(2e-4, abs=1e-5)
    assert abs(found.scale) > 10 * found.u
    assert set(np.asarray(found.points.columns["table_rate_dps"])) == {-90.0, -45.0, 0.0, 45.0, 90.0}
    assert found.version.rate_reference == "the demanded rate, not measured"
    (warning,) = found.version.warnings
    assert warning.what == "table_rate_ratio"
    assert warning.value == pytest.approx(200, abs=15)
    # criticism says what the angles show, and why the readings of the gyro alone show nothing
    assert found.text.startswith("Check the data: column table_rate_dps: table_rate_ratio: the logged table angle")
    assert "looks exactly like an error of the scale factor" in found.text
    assert "No reading of the gyro can distinguish the two" in found.text
    assert "so this difference becomes part of the scale factor" in found.events[0][1]


@pytest.mark.slow
def test_an_error_in_one_direction_is_found_by_direction(tmp_path: Path) -> None:
    """Without the angles it would be taken for an asymmetry of the gyro."""
    found = campaign(tmp_path, {"reference": "demanded"}, rate_ratio=1.0002, rate_ratio_reverse=1.0)
    said = found.text.splitlines()[0]
    (forwards, way), (backwards, _) = re.findall(r"([+-]\d+) ppm (forwards|backwards)", said)
    assert way == "forwards"
    assert float(forwards) == pytest.approx(200, abs=15)
    assert float(backwards) == pytest.approx(0, abs=15)
    assert "scale_factor_asymmetry" in found.text


@pytest.mark.slow
def test_a_table_that_turns_as_commanded_gives_no_warning(tmp_path: Path) -> None:
    found = campaign(tmp_path, {"reference": "demanded"}, criticised=False)
    assert found.events == []
    assert found.version.warnings == []
    assert abs(found.scale) < 2 * found.u
