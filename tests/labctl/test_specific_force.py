"""g-sensitivity in use: a unit whose truth is known, corrected with the specific force and without."""

from __future__ import annotations

import warnings
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest

from labctl.calibration import Calibration, read_calibration
from labctl.calibration.certification import LeftOutWarning
from labctl.compensator import Compensator
from labctl.errors import BadCalibrationFile, BadInput
from labctl.recording.data_files import read_table
from labctl.services.calibrations.apply import compensate_file
from labctl.services.simulation.plan_simulation import hidden_recording
from tests.helpers.calibrations import calibrated, inside, with_force
from tests.helpers.simulated_recordings import plan_on

OWN, ACROSS = 0.03, 0.02
PER_G, PER_G2 = np.array([[0.01, -0.004, 0.002]]), np.array([0.003])


def true_bias_dps(force_g: np.ndarray) -> np.ndarray:
    """Return what specific force adds to the simulated unit, (n, 3) deg/s, as `instruments.simulators.hidden` does."""
    across = np.roll(force_g, -1, axis=1) - 0.6 * np.roll(force_g, -2, axis=1)
    return OWN * 20 * np.arctan(force_g / 20) + ACROSS * across


@lru_cache(maxsize=1)
def tumbled() -> Calibration:
    """Return the calibration of a simulated unit that rested on its six faces."""
    plan, bench = plan_on("six-face-tumble", "triaxial-sim")
    gyro = bench.gyros[0].model_copy(update={"sample_rate_hz": 2.0})
    hidden = {"g_sensitivity": OWN, "cross_g_sensitivity": ACROSS}
    recording = hidden_recording(plan, bench, gyro, 3, hidden)
    return calibrated(recording, effects=["bias", "g_sensitivity", "cross_g_sensitivity"])


def directions(n: int) -> np.ndarray:
    found = np.random.default_rng(5).normal(size=(n, 3))
    return np.asarray(found / np.linalg.norm(found, axis=1)[:, None])


def stated_u(calibration: Calibration) -> np.ndarray:
    """Return the standard uncertainties of the coefficients, (3, 3) deg/s/g."""
    found = calibration.document["specific_force"]["coefficients"]
    return np.array([[found[a]["g_own" if a == b else f"g_{b}"]["u"] for b in "xyz"] for a in "xyz"], dtype=float)


def test_a_simulated_unit_is_corrected_in_every_attitude_by_its_six_faces() -> None:
    compensator = Compensator(read_calibration(tumbled().to_bytes()))
    force = directions(300)
    warm = np.mean(compensator.calibration.temperature_c)
    still = compensator.compensate(np.zeros((1, 3)), warm, specific_force_g=np.zeros(3)).rate_dps
    output = true_bias_dps(force) - still  # the bias at 0 g, as it was found
    with_it = compensator.compensate(output, warm, specific_force_g=force)
    without = compensator.compensate(output, warm)
    u = stated_u(compensator.calibration)
    assert (np.abs(with_it.rate_dps) < 4 * np.sqrt(force**2 @ u.T**2)).all()
    assert u.max() < 0.1 * OWN
    assert with_it.left_out_dps is None
    assert without.left_out_dps is not None
    left = np.abs(without.rate_dps).max(axis=0)
    assert left == pytest.approx(without.left_out_dps, rel=0.1)
    assert (left < 1.02 * without.left_out_dps).all()
    assert not with_it.outside.any()


def test_the_document_holds_coefficients_with_uncertainty_beside_what_is_left_out() -> None:
    document = tumbled().document
    found = document["specific_force"]
    assert found["input"] == "specific_force_g"
    assert found["not_measured"] == {}
    for axis in "xyz":
        own = found["coefficients"][axis]["g_own"]
        assert own["unit"] == "deg/s/g"
        assert own["u"] is not None
        assert own["value"] == pytest.approx(OWN, abs=4 * own["u"])
    assert [each["effect"] for each in document["left_out"]] == ["g_sensitivity", "cross_g_sensitivity"]
    assert [term["effect"] for term in document["model"]["terms"]] == ["bias"]


def test_sample_by_sample_and_in_arrays_alike(mems: Calibration) -> None:
    per_g = np.array([[0.02, -0.01, 0.003], [0.004, -0.03, 0.001], [0.0, 0.002, 0.05]])
    per_g2 = np.array([0.001, 0.0, -0.004])
    compensator = Compensator(with_force(mems, per_g, per_g2))
    raw, warm = inside(mems, 20)
    force = 3 * directions(20)
    whole = compensator.compensate(raw, warm, specific_force_g=force)
    plain = Compensator(mems).compensate(raw - (force @ per_g.T + per_g2 * force**2), warm)
    assert whole.rate_dps == pytest.approx(plain.rate_dps, abs=1e-12)
    for i in range(20):
        assert compensator.step(raw[i], warm[i], specific_force_g=force[i])[0] == pytest.approx(whole.rate_dps[i])
    one = compensator.compensate(raw, warm, specific_force_g=force[0]).rate_dps[0]
    assert one == pytest.approx(whole.rate_dps[0])


def test_a_direct_law_is_corrected_after_the_output(fog: Calibration) -> None:
    raw, warm = inside(fog, 50)
    force = 5 * directions(50)
    found = Compensator(with_force(fog, PER_G, PER_G2)).compensate(raw, warm, specific_force_g=force).rate_dps
    bias = force @ PER_G[0] + PER_G2[0] * force[:, 2] ** 2
    assert found[:, 0] == pytest.approx(Compensator(fog).compensate(raw, warm).rate_dps[:, 0] - bias, abs=1e-12)


def test_steps_without_the_force_say_once_what_they_leave(fog: Calibration) -> None:
    compensator = Compensator(with_force(fog, PER_G, np.array([np.nan])))
    said = r"ONE: g-sensitivity is not corrected without specific_force_g; at 1 g at most: z 0\.011 deg/s"
    with pytest.warns(LeftOutWarning, match=said):
        compensator.step([1.0], 35.0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        compensator.step([1.0], 35.0)
        compensator.step([1.0], 35.0, specific_force_g=[0.0, 0.0, 1.0])


def test_a_force_that_is_no_number_gives_none_flagged(fog: Calibration, mems: Calibration) -> None:
    sensitive = with_force(mems, np.full((3, 3), 0.01), np.zeros(3))
    for calibration in (with_force(fog, PER_G, PER_G2), sensitive):
        raw, warm = inside(calibration, 3)
        force = np.ones((3, 3))
        force[1, 0] = np.inf
        found = Compensator(calibration).compensate(raw, warm, specific_force_g=force)
        assert found.outside.tolist() == [False, True, False]
        assert np.isnan(found.rate_dps[1]).all()
        with pytest.raises(BadInput, match="sample 2: rate"):
            Compensator(calibration, "refuse").compensate(raw, warm, specific_force_g=force)
        with pytest.raises(BadInput, match=r"specific_force_g of shape \(2, 3\) given; .*\(3, 3\)"):
            Compensator(calibration).compensate(raw, warm, specific_force_g=force[:2])


def test_a_calibration_that_knows_of_none_ignores_the_force(fog: Calibration) -> None:
    raw, warm = inside(fog, 5)
    found = Compensator(fog).compensate(raw, warm, specific_force_g=np.ones(3))
    assert found.rate_dps.tolist() == Compensator(fog).compensate(raw, warm).rate_dps.tolist()
    assert found.left_out_dps is None


def test_what_was_not_measured_is_named_and_not_needed(fog: Calibration) -> None:
    calibration = with_force(fog, np.array([[np.nan, np.nan, 0.01]]), np.array([np.nan]))
    force = read_calibration(calibration.to_bytes()).force_sensitivity
    assert force is not None
    assert force.not_measured == {"z": ["x", "y"]}
    assert force.needs == ["z"]
    assert force.error_dps(np.array([[9.0, 9.0, 1.0]])).tolist() == [[0.01]]


def test_a_spoilt_part_is_refused(fog: Calibration) -> None:
    calibration = with_force(fog, PER_G, PER_G2)
    calibration.document["specific_force"]["coefficients"] = {}
    with pytest.raises(BadCalibrationFile, match="its specific_force cannot be read"):
        Compensator(calibration)


def test_a_file_is_corrected_by_its_accelerometer_columns_or_says_what_is_left(
    fog: Calibration, tmp_path: Path
) -> None:
    file, source, target = (tmp_path / name for name in ("fog.json", "in.csv", "out.csv"))
    file.write_bytes(with_force(fog, np.array([[np.nan, np.nan, 0.01]]), np.array([np.nan])).to_bytes())
    rates = []
    for head, value in (("", ""), (",accel_z_g", ",-2.0")):
        source.write_text(f"gyro_z,temperature_c{head}\n10.0,35.0{value}\n")
        answer = compensate_file(file, source, target, "clamp")
        rates.append(float(read_table(target)["rate_z_dps"][0]))
        said = "column accel_z_g is missing: g-sensitivity is not corrected without specific_force_g; at 1 g at most: "
        assert answer.left_out == ("" if head else f"{said}z 0.01 deg/s")
    assert rates[1] - rates[0] == pytest.approx(0.02, abs=1e-12)
