"""Recordings by what moved the unit: at rest, in turns, of a profile, in poses; every number against its data."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient

from labctl.calibration import read_calibration
from labctl.compensator import Compensator
from labctl.recording import Recording, read_recording
from labctl.recording.checks import checked
from labctl.services.criticism import by_motion as page
from studies.poses_simulation import Session, simulate_session
from tests.helpers.paths import EXAMPLES
from tests.helpers.profiles import profile_recording, sweep
from tests.helpers.rest import NOISE_DPS, at_rest
from tests.helpers.service import add_recording, service_of

LAG_S = 600.0


def by_motion(client: TestClient, recording: Recording, **fit: Any) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return a recording by its motion, uncorrected and by a version fitted to it."""
    whole = Recording(recording.info, checked(Path("samples"), recording.info, dict(recording.columns)))
    number, serial = add_recording(client, whole), recording.info.serial
    made = client.post(f"/api/units/{serial}/calibrations", json=fit)
    assert made.status_code == 201, made.text
    plain = client.get(f"/api/recordings/{number}/motion").json()
    found = client.get(f"/api/units/{serial}/calibrations/1/motion").json()
    assert (plain["version"], found["version"], found["recording"]) == (None, 1, number)
    assert found["source"] == f"version 1 without refitting, on recording {number}, which the version was fitted to"
    return plain, found


def of_axis(found: dict[str, Any], axis: str) -> dict[str, np.ndarray]:
    rows = found[found["motion"]]
    own = np.array(rows["axis"]) == axis
    return {name: np.array(values)[own] for name, values in rows.items()}


@pytest.mark.slow
def test_at_rest_the_bias_is_that_of_the_readings_and_the_model_that_of_the_file(client: TestClient) -> None:
    recording = at_rest(("z",), lag_s=LAG_S)
    plain, found = by_motion(client, recording, effects=["bias", "bias_temperature:2", "thermal_lag"])
    assert all(value is None for value in plain["rest"]["modelled_dps"])
    document, _ = service_of(client).store.calibrations.document("REST-1", 1)
    running = Compensator(read_calibration(document))
    t_s, output = np.asarray(recording.columns["t_s"]), np.asarray(recording.columns["gyro_z"])
    warm = np.asarray(recording.columns["temperature_c"])
    samples = zip(output.tolist(), warm.tolist(), t_s.tolist(), strict=True)
    corrected = np.array([running.step([each], c, t_s=t)[0][0] for each, c, t in samples])
    rows = of_axis(found, "z")
    assert (found["rows"], found["of"], len(rows["t_s"])) == (160, 160, 160)
    middle = np.searchsorted(t_s, rows["t_s"])
    assert rows["bias_dps"] == pytest.approx(np.array([output[k - 60 : k + 60].mean() for k in middle]), abs=2e-4)
    assert np.median(rows["u_dps"].astype(float)) == pytest.approx(NOISE_DPS / np.sqrt(120), rel=0.1)
    subtracted = np.array([(output - corrected)[k - 60 : k + 60].mean() for k in middle])
    assert rows["modelled_dps"] == pytest.approx(subtracted, abs=5e-4)
    assert rows["residual_dps"].astype(float) == pytest.approx(rows["bias_dps"] - rows["modelled_dps"])
    minutes = rows["t_s"] / 60
    inside = np.abs(minutes % 40 - 20) < 19  # where the legs meet a minute is of either
    assert ((rows["leg"] == "heating")[inside] == (minutes % 80 < 40)[inside]).all()
    assert set(rows["leg"]) == {"heating", "cooling"}
    check_memory(client.get("/api/units/REST-1/calibrations/1").json())


def check_memory(version: dict[str, Any]) -> None:
    """The version says what follows the temperature in use, and how well one leg is predicted from the other."""
    (follower,) = version["remembers"]
    assert (follower["kind"], follower["unit"], version["left_out"]) == ("lag", "s", [])
    assert follower["parameter"] == pytest.approx(LAG_S, rel=0.1)
    assert follower["size"]["z"] == pytest.approx(2e-3, rel=0.1)
    legs = {(leg["fitted"], leg["tested"]): leg["rms_dps"] for leg in version["error"]["heldout_by_leg"]}
    assert legs["heating", "cooling"] == pytest.approx(NOISE_DPS / np.sqrt(120), rel=0.5)


def test_without_a_thermometer_there_is_time_and_no_leg(client: TestClient) -> None:
    _, found = by_motion(client, at_rest(("z",), thermometer=False, serial="REST-0"), model="bias")
    assert set(found["rest"]["temperature_c"]) == {None}
    assert set(found["rest"]["leg"]) == {""}
    assert np.diff(found["rest"]["t_s"]) == pytest.approx(60.0, rel=0.01)


def test_a_turn_is_its_integral_and_its_uncertainty_that_of_angle_and_noise(client: TestClient) -> None:
    recording = read_recording(EXAMPLES / "imucal-turns")
    plain, found = by_motion(client, recording, model="turns")
    assert (found["rows"], len(found["turns"]["axis"])) == (3, 9)
    document, _ = service_of(client).store.calibrations.document(recording.info.serial, 1)
    compensator = Compensator(read_calibration(document))
    number = np.asarray(recording.columns["dataset"])
    for axis, about in (("x", "x"), ("y", "z"), ("z", "y")):
        rows = of_axis(found, axis)
        k = int(np.flatnonzero(rows["about"] == about)[0])
        here = number == rows["dataset"][k]
        t_s = np.asarray(recording.columns["t_s"])[here]
        outputs = np.column_stack([recording.gyro_dps(a)[here] for a in recording.info.axes])
        place = recording.info.axes.index(axis)
        assert rows["asked_deg"][k] == pytest.approx(360.0 if axis == about else 0.0)
        assert rows["output_deg"][k] == pytest.approx(np.trapezoid(outputs[:, place], t_s), rel=1e-9)
        true = compensator.compensate(outputs, np.full(len(t_s), 25.0)).rate_dps
        assert rows["corrected_deg"][k] == pytest.approx(np.trapezoid(true[:, place], t_s), abs=1e-6)
        assert rows["residual_deg"][k] == pytest.approx(rows["corrected_deg"][k] - rows["asked_deg"][k])
        if axis == about:  # 1 deg by the angle; noise and time stamps add little
            assert rows["u_deg"][k] == pytest.approx(1.0, abs=0.1)
    assert of_axis(plain, "x")["output_deg"] == pytest.approx(of_axis(found, "x")["output_deg"])
    assert set(plain["turns"]["corrected_deg"]) == {None}


@pytest.mark.slow
def test_a_profile_has_delay_and_bandwidth_and_says_how_many_windows_are_drawn(
    client: TestClient, monkeypatch: pytest.MonkeyPatch
) -> None:
    recording = profile_recording(sweep(30.0, 0.5, 20.0, 100.0, 100.0), delay_s=0.005, bandwidth_hz=40.0, scale=1e-3)
    effects = ["bias", "scale_factor", "time_delay", "bandwidth"]
    monkeypatch.setattr(page, "MAX_ROWS", 700)
    _, found = by_motion(client, recording, effects=effects, accept_warnings=True)
    assert found["rows"] == 700 == len(found["profile"]["t_s"])
    assert 2900 < found["of"] < 3000
    response = found["responses"]["z"]
    assert abs(response["delay_s"] - 0.005) < 4 * response["u_delay_s"] + 1e-6
    assert abs(response["bandwidth_hz"] - 40.0) < 4 * response["u_bandwidth_hz"] + 0.05
    rows = of_axis(found, "z")
    reading = np.searchsorted(np.asarray(recording.columns["t_s"]), rows["t_s"] - 1e-6)
    assert rows["true_dps"] == pytest.approx(np.asarray(recording.columns["table_rate_dps"])[reading])
    assert rows["output_dps"] == pytest.approx(np.asarray(recording.columns["gyro_z"])[reading])
    assert np.std(rows["followed_dps"].astype(float)) == pytest.approx(0.02, rel=0.15)  # its noise and nothing else
    assert np.std(rows["residual_dps"].astype(float)) > 5.0  # what is late is not undone in use


def test_a_move_in_poses_has_the_angle_that_was_simulated(client: TestClient) -> None:
    recording, _ = simulate_session(1, Session(rests=16, latitude_deg=48.0, temperature_c=23.5))
    plain, found = by_motion(client, recording, model="poses")
    poses = {name: np.array(values) for name, values in found["poses"].items()}
    assert (found["rows"], found["of"], found["left_out"]) == (15, 15, [])
    t_s = np.asarray(recording.columns["t_s"])
    accel = np.column_stack([np.asarray(recording.columns[f"accel_{a}_g"]) for a in "xyz"])
    edges = [t_s[0], *np.ravel(np.column_stack([poses["from_s"], poses["until_s"]])), t_s[-1]]
    force = [accel[(t_s >= a) & (t_s <= b)].mean(axis=0) for a, b in zip(edges[::2], edges[1::2], strict=True)]
    up = np.array([each / np.linalg.norm(each) for each in force])
    by_hand = np.degrees(np.arccos(np.sum(up[1:] * up[:-1], axis=1)))
    assert poses["accelerometer_deg"] == pytest.approx(by_hand, abs=8.0)  # the accelerometer there is not calibrated
    assert poses["gyro_deg"] == pytest.approx(poses["accelerometer_deg"], abs=0.2)
    assert np.all(np.abs(poses["gyro_deg"] - poses["accelerometer_deg"]) <= poses["residual_deg"] + 1e-9)
    raw = np.array(plain["poses"]["residual_deg"])
    assert np.sqrt(np.mean(raw**2)) > 10 * np.sqrt(np.mean(poses["residual_deg"] ** 2))
    verified = client.get(f"/api/units/{recording.info.serial}/calibrations/1/verification").json()
    seconds = poses["until_s"] - poses["from_s"]
    # of small angles the two components square to gravity, which a verification pools
    pooled = np.sqrt(np.mean((poses["residual_deg"] / seconds) ** 2) / 2)
    assert pooled == pytest.approx(verified["rms_dps"], rel=1e-3)
    by_hand = f"/api/units/{recording.info.serial}/calibrations/1"
    left = client.get(by_hand).json()["left_out"]
    assert [each["effect"] for each in left] == ["g_sensitivity", "cross_g_sensitivity"]
    used = client.get(f"{by_hand}/uncertainty", params={"rate_dps": 10, "temperature_c": 25}).json()
    assert used["axes"]["x"]["unknown"]["model"].startswith("the rate during turns between rests is not known")


def test_a_recording_at_constant_rates_is_refused_in_one_sentence(client: TestClient) -> None:
    number = add_recording(client, read_recording(EXAMPLES / "osu-fog"))
    refused = client.get(f"/api/recordings/{number}/motion")
    assert refused.status_code == 400
    assert refused.json()["detail"] == (
        f"recording {number} has one rate in each data set (motion = 'rates'); "
        "request its comparison with a version instead"
    )
    (row,) = client.get("/api/recordings").json()
    assert row["motion"] == "rates"
