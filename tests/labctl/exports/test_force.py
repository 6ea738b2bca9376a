"""g-sensitivity in files of other consumers: C, Q31 and Python correct it, the others say what they lose."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from labctl.calibration import Calibration
from labctl.compensator import Compensator
from labctl.exports.fixed_point.force import fixed_force
from labctl.exports.fixed_point.whole_numbers import fixed_point
from labctl.exports.static_part import static_part
from tests.helpers.c_fixed_point import compiled
from tests.helpers.c_header import in_c
from tests.helpers.calibrations import calibrated, inside, with_force
from tests.helpers.exported import exported, stated
from tests.helpers.rest import at_rest

SEED = 11
LAGGING = ["bias", "bias_temperature", "thermal_lag", "thermal_hysteresis"]


@pytest.fixture(params=["fog", "mems"])
def sensitive(request: pytest.FixtureRequest) -> tuple[Calibration, Calibration, np.ndarray, np.ndarray]:
    """Return a calibration without and with g-sensitivity, and its coefficients."""
    plain: Calibration = request.getfixturevalue(request.param)
    rng = np.random.default_rng(SEED)
    per_g, per_g2 = rng.normal(0, 0.05, (len(plain.axes), 3)), rng.normal(0, 0.01, len(plain.axes))
    return plain, with_force(plain, per_g, per_g2), per_g, per_g2


def by_hand(
    plain: Calibration, per_g: np.ndarray, per_g2: np.ndarray, raw: np.ndarray, warm: np.ndarray, force: np.ndarray
) -> np.ndarray:
    """Return the consumer's formula written out: the bias by the force, then the correction without it."""
    bias = np.empty_like(raw)
    for row, axis in enumerate(plain.axes):
        fx, fy, fz = force.T
        own = {"x": fx, "y": fy, "z": fz}[axis]
        bias[:, row] = per_g[row, 0] * fx + per_g[row, 1] * fy + per_g[row, 2] * fz + per_g2[row] * own**2
    if plain.fitted.model.argument == "output":
        return Compensator(plain).compensate(raw, warm).rate_dps - bias
    return Compensator(plain).compensate(raw - bias, warm).rate_dps


def samples(calibration: Calibration, n: int = 200) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    raw, warm = inside(calibration, n)
    return raw, warm, np.random.default_rng(SEED).uniform(-16, 16, (n, 3))


@pytest.mark.needs_cc
@pytest.mark.parametrize(("real", "tolerance"), [("double", 1e-11), ("float", 1e-3)])
def test_c_computes_the_consumers_formula(sensitive: Any, tmp_path: Path, real: str, tolerance: float) -> None:
    plain, calibration, *coefficients = sensitive
    raw, warm, force = samples(plain)
    table = in_c(calibration, raw, warm, tmp_path, real, force)
    assert table[:, 0].sum() == 0
    assert np.abs(table[:, 1:] - by_hand(plain, *coefficients, raw, warm, force)).max() < tolerance
    python = Compensator(calibration).compensate(raw, warm, specific_force_g=force).rate_dps
    assert np.abs(table[:, 1:] - python).max() < tolerance


@pytest.mark.needs_cc
def test_c_without_the_force_computes_what_it_did(sensitive: Any, tmp_path: Path) -> None:
    plain, calibration, *_ = sensitive
    raw, warm, _ = samples(plain, 20)
    assert in_c(calibration, raw, warm, tmp_path).tolist() == in_c(plain, raw, warm, tmp_path).tolist()


@pytest.mark.needs_cc
def test_c_flags_a_force_that_is_no_number(sensitive: Any, tmp_path: Path) -> None:
    plain, calibration, *_ = sensitive
    raw, warm, force = samples(plain, 3)
    force[0, 0], force[1, 1] = np.nan, np.inf
    table = in_c(calibration, raw, warm, tmp_path, force=force)
    assert table[:, 0].tolist() == [1, 1, 0]
    assert np.isnan(table[:2, 1:]).all()


@pytest.mark.needs_cc
def test_q31_computes_the_consumers_formula_bit_by_bit(sensitive: Any, tmp_path: Path) -> None:
    plain, calibration, *coefficients = sensitive
    text, _ = exported(calibration, "c-q31")
    fixed = fixed_point(static_part(calibration, "c-q31", carries=""), 65, "c-q31")
    is_direct = plain.fitted.model.argument == "output"
    assert calibration.force_sensitivity is not None
    whole = fixed_force(fixed, calibration.force_sensitivity, "c-q31", is_direct=is_direct)
    raw, warm, force = samples(plain)
    force[0], force[1], force[2] = 127.9, 129.0, -30000.0
    inputs, hot, pull = fixed.as_q31(raw), np.rint(warm * 65536).astype(np.int64), np.rint(force * 65536).astype(int)
    found = compiled(tmp_path, calibration, np.column_stack([hot, inputs, pull]), with_force=True)
    rates, outside = whole.corrected(inputs, hot, pull)
    assert np.array_equal(found[:, 1:], rates)
    assert np.array_equal(found[:, 0].astype(bool), outside)
    assert outside[1:3].all()
    kept = ~outside
    assert kept.sum() > 150
    apart = found[:, 1:] * fixed.full_scale_dps / 2**31 - by_hand(plain, *coefficients, raw, warm, force)
    assert np.abs(apart[kept]).max() <= stated(
        text, "Rates corrected by this file differ from those of the calibration"
    )


def test_the_python_module_alone_computes_the_consumers_formula(sensitive: Any) -> None:
    plain, calibration, *coefficients = sensitive
    text, written = exported(calibration, "python")
    module: dict[str, Any] = {}
    exec(compile(text, "calibration.py", "exec"), module)
    raw, warm, force = samples(plain, 50)
    rows = zip(raw.tolist(), warm.tolist(), force.tolist(), strict=True)
    found = np.array([module["correct_with_force"](*row)[0] for row in rows])
    assert np.abs(found - by_hand(plain, *coefficients, raw, warm, force)).max() <= (written.differs_dps or 0.0)
    rates, is_outside = module["correct_with_force"](raw[0], warm[0], [0.0, np.nan, 1.0])
    assert is_outside
    assert np.isnan(rates).all()
    with pytest.raises(ValueError, match="give one output for each axis"):
        module["correct_with_force"]([0.0] * 4, 25.0, [0.0, 0.0, 1.0])
    with pytest.raises(ValueError, match="along body axes x, y and z"):
        module["correct_with_force"](raw[0], 25.0, [1.0])


@pytest.mark.parametrize("name", ["c", "c-q31", "python"])
def test_a_file_that_carries_it_says_its_size_without_a_force(sensitive: Any, name: str) -> None:
    _, calibration, *_ = sensitive
    text, written = exported(calibration, name)
    assert "g-sensitivity, at 1 g at most " in " ".join(text.replace("*", " ").replace("#", " ").split())
    assert not [loss for loss in written.losses if "g-sensitivity" in loss.what]


NOISE = {"noise_dps_rthz": "0.01", "walk_dps_s_rthz": "0.001", "rate_hz": "100"}


@pytest.mark.parametrize(
    ("name", "options"),
    [("px4", {}), ("ardupilot", {}), ("table-csv", {}), ("kalibr", NOISE), ("ros2-imu", {**NOISE})],
)
def test_a_file_that_cannot_carry_it_names_the_loss(mems: Calibration, name: str, options: dict[str, str]) -> None:
    if name == "ros2-imu":
        options = {key: value for key, value in options.items() if key != "walk_dps_s_rthz"}
    per_g = np.diag([0.03, 0.02, 0.01])
    per_g[0, 1] = 0.04
    text, written = exported(with_force(mems, per_g, np.zeros(3)), name, **options)
    assert "LOST g-sensitivity, at 1 g: up to 0.05 deg/s." in text
    assert [loss.size for loss in written.losses if "g-sensitivity" in loss.what] == pytest.approx([0.05])


@pytest.mark.needs_cc
def test_a_step_of_a_unit_that_remembers_takes_the_force_too(tmp_path: Path) -> None:
    calibration = with_force(
        calibrated(at_rest(("z",), lag_s=400.0), effects=LAGGING), np.array([[0.01, 0.0, -0.02]]), np.zeros(1)
    )
    t_s, warm = np.arange(0.0, 3000.0, 60.0), np.linspace(20, 40, 50)
    raw, force = np.zeros((50, 1)), np.random.default_rng(SEED).uniform(-16, 16, (50, 3))
    running = Compensator(calibration)
    stepped = [running.step(raw[i], warm[i], t_s[i], specific_force_g=force[i])[0] for i in range(50)]
    whole = Compensator(calibration).compensate(raw, warm, {"t_s": t_s}, specific_force_g=force)
    assert np.array(stepped) == pytest.approx(whole.rate_dps, abs=1e-12)
    found = in_c(calibration, raw, warm, tmp_path, force=force, t_s=t_s)
    assert found[:, 1:] == pytest.approx(whole.rate_dps, abs=1e-9)
