"""Each axis is judged by its own expectation: one axis off alone is found, and a version that holds is not doubted."""

from __future__ import annotations

import numpy as np
import pytest

from labctl.recording import Recording, RecordingInfo, write_recording
from labctl.services.criticism.verification.of_version import (
    FALSE_ALARM,
    OwnError,
    independent_groups,
    judged,
    largest_ratio,
    own_errors,
)
from tests.helpers.lab import Lab
from tests.helpers.recordings import STARTED

UNIT = "AX-1"
#: Scatter of the means of each axis, deg/s: as different as an x from another maker.
SCATTER_DPS = {"x": 0.04, "y": 0.02, "z": 0.005}
RATES_DPS = (-100.0, -50.0, 0.0, 50.0, 100.0)
TEMPERATURES_C = (-20.0, 0.0, 25.0, 45.0, 60.0)
CLEAN = 40


def recording(seed: int, **off_dps: float) -> Recording:
    """Return the means of three axes turned about each in turn at five temperatures, some axes off by so much."""
    rng = np.random.default_rng([31, seed])
    rows = [(axis, t, rate) for axis in "xyz" for t in TEMPERATURES_C for rate in RATES_DPS]
    n = len(rows)
    position, warm, rate = (np.array(each) for each in zip(*rows, strict=True))
    columns = {
        "dataset": np.arange(1, n + 1), "t_s": 60.0 * np.arange(n), "position": position,
        "run": np.searchsorted(np.array(["x", "y", "z"]), position) + 1, "table_rate_dps": rate,
        "temperature_c": warm + rng.normal(0, 0.05, n), "n": np.full(n, 100),
    }  # fmt: skip
    for axis, size in SCATTER_DPS.items():
        true = np.where(position == axis, rate, 0.0)
        columns[f"gyro_{axis}"] = 1.002 * true + 0.1 + off_dps.get(axis, 0.0) + rng.normal(0, size, n)
        columns[f"gyro_{axis}_std"] = np.full(n, size * 10)
    info = RecordingInfo(serial=UNIT, axes=("x", "y", "z"), kind="points", started_at=STARTED)
    return Recording(info, columns)


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Lab:
    """A lab with one version of the unit, fitted to recording 1."""
    lab = Lab(tmp_path_factory.mktemp("axes"))
    add(lab, recording(1))
    lab.json("fit", UNIT, "--model", "bias_scale")
    return lab


def add(lab: Lab, measured: Recording) -> str:
    """Import a recording and return its number."""
    folder = lab.folder / f"r{len(list(lab.folder.iterdir()))}"
    write_recording(measured, folder, "parquet")
    return str(lab.json("import", str(folder))["recording"])


def test_an_axis_is_expected_to_err_by_its_share_of_the_error(lab: Lab) -> None:
    found = lab.json("verify", UNIT, "--recording", add(lab, recording(2)))
    expected = {axis: each["expected_dps"] for axis, each in found["axes"].items()}
    assert np.mean([each**2 for each in expected.values()]) == pytest.approx(found["expected_dps"] ** 2)
    for axis, size in SCATTER_DPS.items():
        assert expected[axis] == pytest.approx(size, rel=0.5)
        assert found["axes"][axis]["limit_dps"] == pytest.approx(2 * expected[axis])
    assert (found["ok"], found["axes_off"]) == (True, [])


@pytest.mark.parametrize(("axis", "off_dps"), [("x", 0.1), ("y", 0.06), ("z", 0.016)])
def test_each_axis_off_alone_is_found(lab: Lab, axis: str, off_dps: float) -> None:
    number = add(lab, recording(3, **{axis: off_dps}))
    found = lab.json("verify", UNIT, "--recording", number, status=1)
    assert (found["ok"], found["axes_off"]) == (False, [axis])
    assert {name: each["ok"] for name, each in found["axes"].items()} == {name: name != axis for name in "xyz"}
    assert found["axes"][axis]["bias_dps"] == pytest.approx(off_dps, abs=0.02)
    if axis != "x":  # over all axes it is small
        assert found["rms_dps"] < 2 * found["expected_dps"]
    said = lab.run("verify", UNIT, "--recording", number, status=1).stdout
    assert f"Axis {axis} is off: {found['axes'][axis]['rms_dps']:.3g} deg/s RMS, " in said.replace("\n", " ")
    assert f"NOT as expected on axis {axis}" in said


def test_an_axis_is_off_where_all_have_one_expectation() -> None:
    noise = np.random.default_rng(1).normal(0, 0.01, (3, 50))
    errors = {"x": 0.051 + noise[0], "y": noise[1], "z": noise[2]}
    found = judged(errors, 0.023, {}, groups=3)
    assert [axis for axis, each in found.items() if not each.ok] == ["x"]
    assert np.sqrt(np.mean([each.rms_dps**2 for each in found.values()])) < 2 * 0.023


@pytest.mark.slow
def test_nothing_is_off_in_recordings_of_a_unit_that_did_not_change(lab: Lab) -> None:
    for seed in range(100, 100 + CLEAN):
        found = lab.json("verify", UNIT, "--recording", add(lab, recording(seed)))
        assert found["axes_off"] == [], seed


@pytest.mark.slow
@pytest.mark.parametrize("groups", [1, 2, 3, 8])
@pytest.mark.parametrize("freedom", [6, 40])
@pytest.mark.parametrize("axes", ["x", "xy", "xyz"])
def test_the_rate_of_false_alarms_is_at_most_as_stated(axes: str, groups: int, freedom: int) -> None:
    """4,000 recordings whose errors are the same within each group, and versions with few or many data of their own."""
    rng, n, alarms = np.random.default_rng([7, groups, freedom, len(axes)]), 4000, 0
    for _ in range(n):
        own = {axis: OwnError(float(np.sqrt(rng.chisquare(freedom) / freedom)), freedom) for axis in axes}
        expected = float(np.sqrt(np.mean([each.rms_dps**2 for each in own.values()])))
        errors = {axis: np.repeat(rng.normal(size=groups), 5) for axis in axes}
        alarms += any(not each.ok for each in judged(errors, expected, own, groups).values())
    assert alarms / n <= FALSE_ALARM + 3 * np.sqrt(FALSE_ALARM * (1 - FALSE_ALARM) / n)


def test_the_limit_is_twice_the_expectation_or_more_where_less_is_independent() -> None:
    assert largest_ratio(1, 9, None) == largest_ratio(3, 9, 60) == 2.0
    assert largest_ratio(3, 1, None) == pytest.approx(2.388, abs=0.001)
    assert largest_ratio(3, 1, 10) > largest_ratio(3, 1, 100) > largest_ratio(2, 1, 100)


def test_sessions_and_temperature_levels_are_groups() -> None:
    assert independent_groups(recording(1)) == 15
    still = Recording(
        RecordingInfo(serial="A", axes=("x",), kind="points", started_at=STARTED), {"dataset": np.ones(3)}
    )
    assert independent_groups(still) == 1


def test_axes_are_not_told_apart_by_as_many_data_sets_as_coefficients() -> None:
    value = {"value": 1.0, "u": None, "unit": "deg/s"}
    coefficients = {axis: {"coefficients": {"bias": value, "scale_factor": value}} for axis in "xy"}
    assert own_errors({"x": [np.ones(2)], "y": [np.ones(9)]}, coefficients) == {}  # type: ignore[arg-type]
    assert own_errors({"x": [np.ones(5)], "y": [np.ones(9)]}, coefficients)["x"] == OwnError(1.0, 3)  # type: ignore[arg-type]
