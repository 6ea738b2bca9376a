"""Static bias and orientation on the command line and over HTTP: closed forms, and the same numbers everywhere."""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient

from labctl.answers.orientation import OrientationOptions, OrientationQuery
from labctl.calibration import Calibration
from labctl.cli.commands import noise
from labctl.compensator import Compensator
from labctl.error_per_turn import static_bias
from labctl.errors import BadInput, BadRecording, NotEnoughData
from labctl.recording import Recording, RecordingInfo
from labctl.recording.data_files import read_table
from labctl.services.calibrations.orientation import orientation_of_file
from tests.helpers.lab import Lab
from tests.helpers.openapi import openapi_document
from tests.helpers.service import add_recording, open_client, service_of

BIAS = 0.4


@pytest.fixture
def turned() -> dict[str, np.ndarray]:
    """Return 30 s at rest, a turn by 360 deg in 36 s, and 44 s at rest, 10 readings a second, with a bias."""
    t = 0.1 * np.arange(1, 1101)
    rate = np.where((t > 30.05) & (t < 66.05), 10.0, 0.0)
    return {"t_s": t, "gyro_z": rate + BIAS + np.random.default_rng(1).normal(0, 0.02, t.size)}


def write(path: Path, columns: dict[str, np.ndarray]) -> Path:
    rows = zip(*columns.values(), strict=True)
    path.write_text("\n".join([",".join(columns), *(",".join(f"{v:.17g}" for v in row) for row in rows), ""]))
    return path


def test_the_static_bias_is_taken_off_and_a_turn_is_a_turn(tmp_path: Path, turned: dict[str, np.ndarray]) -> None:
    source = write(tmp_path / "turn.csv", turned)
    plain = orientation_of_file(source, None, None, OrientationOptions(standstill=False))
    assert plain.static_bias is None
    assert plain.angle_deg == pytest.approx(360 + BIAS * 109.9, abs=0.3)  # the bias is integrated all the time
    with_bias = orientation_of_file(
        source, None, None, OrientationOptions(rest_s=20, standstill=False, instability_dps=0.01)
    )
    expected = static_bias(turned["gyro_z"][:200], 0.01)
    assert with_bias.static_bias is not None
    assert (with_bias.static_bias.bias_dps, with_bias.static_bias.u_dps) == (expected.bias_dps, expected.u_dps)
    assert with_bias.static_bias.readings == 200
    assert abs(with_bias.static_bias.bias_dps - BIAS) < 3 * 0.02 / np.sqrt(200)
    assert with_bias.angle_deg == pytest.approx(360, abs=4 * 0.02 / np.sqrt(200) * 90 + 0.1)
    held = orientation_of_file(source, None, tmp_path / "out.csv", OrientationOptions(rest_s=20))
    assert held.angle_deg == pytest.approx(360, abs=0.2)
    assert 45 < held.standing_s < 54  # 10 s before the turn and 44 s after it, less what it takes to settle
    assert held.drift_deg_per_min == pytest.approx(60 * held.angle_deg / held.seconds)
    angle = np.asarray(read_table(tmp_path / "out.csv")["angle_z_deg"], dtype=float)
    assert np.isnan(angle[:200]).all()
    assert angle[-1] == pytest.approx(held.angle_deg)
    assert (held.t_s[-1], held.course_deg[-1]) == (pytest.approx(110), held.angle_deg)


def test_what_cannot_be_followed_is_named(tmp_path: Path, turned: dict[str, np.ndarray]) -> None:
    def follow(columns: dict[str, np.ndarray], **options: Any) -> None:
        orientation_of_file(write(tmp_path / "in.csv", columns), None, None, OrientationOptions(**options))

    with pytest.raises(BadRecording, match=r"in\.csv: column 't_s' is missing"):
        follow({"gyro_z": turned["gyro_z"]})
    with pytest.raises(BadInput, match=r"axis not named; name an axis .*\(x, z\)"):
        follow({**turned, "gyro_x": turned["gyro_z"]})
    with pytest.raises(BadInput, match=r"axis y; name an axis .*\(z\)"):
        follow(turned, axis="y")
    with pytest.raises(NotEnoughData, match="no valid reading"):
        follow({**turned, "valid": np.zeros(1100)})
    with pytest.raises(NotEnoughData, match="at least 10 finite readings"):
        follow(turned, rest_s=0.5)
    with pytest.raises(BadRecording, match=r"column 't_s', row 2: 109\.9 s is not later than"):
        follow({**turned, "t_s": turned["t_s"][::-1]})
    source = write(tmp_path / "in.csv", turned)
    with pytest.raises(BadInput, match="name another file for the result"):
        orientation_of_file(source, None, source, OrientationOptions())


def test_a_table_is_corrected_by_a_calibration_first(
    fog: Calibration, tmp_path: Path, turned: dict[str, np.ndarray]
) -> None:
    (tmp_path / "fog.json").write_bytes(fog.to_bytes())
    columns = {**turned, "temperature_c": np.full(1100, 35.0)}
    lab = Lab(tmp_path)
    source = str(write(tmp_path / "turn.csv", columns))
    answer = lab.json("orientation", source, "--calibration", str(tmp_path / "fog.json"), "--rest-s", "20")
    rate = Compensator(fog).compensate(turned["gyro_z"], columns["temperature_c"]).rate_dps
    assert answer["static_bias"]["bias_dps"] == static_bias(rate[:200]).bias_dps
    assert (answer["version"], answer["axis"], answer["readings"]) == (fog.version, "z", 1100)
    shown = lab.run("orientation", source, "--rest-s", "20").stdout
    assert "axis z, uncorrected: 1100 readings, 0 left out" in shown
    assert "static bias" in shown
    missing = lab.run("orientation", "NO-UNIT", "--out", str(tmp_path / "a.csv"), status=2).stderr
    assert "there is no such file; leave out --calibration and --out" in missing


@pytest.fixture
def client(tmp_path: Path) -> Iterator[TestClient]:
    with open_client(tmp_path / "lab.sqlite") as opened:
        yield opened


def test_a_recording_is_followed_over_http_as_on_the_command_line(
    client: TestClient, tmp_path: Path, turned: dict[str, np.ndarray]
) -> None:
    n = len(turned["t_s"])
    columns = {
        "dataset": np.ones(n, dtype=np.int64), "table_rate_dps": np.zeros(n), "temperature_c": np.full(n, 25.0),
        "position": np.full(n, "z"), **turned, "valid": (np.arange(n) != 500).astype(np.int64),
    }  # fmt: skip
    info = RecordingInfo(serial="T-1", axes=("z",), kind="samples", started_at=datetime(2026, 1, 1, tzinfo=UTC))
    number = add_recording(client, Recording(info, columns))
    answer = client.get(f"/api/recordings/{number}/orientation", params={"rest_s": 20, "version": 0})
    assert answer.status_code == 200, answer.text
    found = answer.json()
    assert (found["version"], found["readings"], found["left_out"]) == (None, n - 1, 1)
    assert found["angle_deg"] == pytest.approx(360, abs=0.2)
    assert client.get(f"/api/recordings/{number}/orientation").json()["version"] is None  # none is in force
    refused = client.get(f"/api/recordings/{number}/orientation", params={"axis": "x"})
    assert (refused.status_code, refused.json()["type"]) == (400, "urn:labctl:problem:bad-input")
    wanted = {"warm_up_s": 10, "stop_every_s": 25, "version": 0}
    with_stops = client.get(f"/api/recordings/{number}/orientation", params=wanted).json()
    assert len(with_stops["drift_between_stops_deg_per_min"]) == 3  # of 100 s; the fourth is broken off
    assert with_stops["readings"] == n - 1 - 100
    for name, value in (("warm_up_s", "-1"), ("stop_every_s", "19"), ("rest_s", "nan"), ("version", "-1")):
        bad = client.get(f"/api/recordings/{number}/orientation", params={name: value})
        assert 400 <= bad.status_code < 500, name
    client.close()
    service_of(client).close()
    lab = Lab(tmp_path)
    assert lab.json("orientation", "T-1", "--rest-s", "20") == found
    options = [word for name, value in wanted.items() for word in (f"--{name.replace('_', '-')}", str(value))]
    assert lab.json("orientation", "T-1", *options) == with_stops


@pytest.mark.slow
def test_http_and_the_command_line_take_the_same_options() -> None:
    taken = set(inspect.signature(noise.orientation).parameters)
    assert set(OrientationQuery.model_fields) <= taken
    described: Any = openapi_document()["paths"]
    parameters = described["/api/recordings/{recording}/orientation"]["get"]["parameters"]
    assert {each["name"] for each in parameters} == {"recording", *OrientationQuery.model_fields}
