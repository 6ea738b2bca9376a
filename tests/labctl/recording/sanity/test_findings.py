"""Sanity of a recording: what is wrong is said, with value, place and what to do; good data get no finding."""

from __future__ import annotations

import numpy as np
import pytest

from labctl.recording import OutputUnit, Recording, to_points
from labctl.recording.sanity import Finding, certain, findings_of, inspect_recording, joined, summarise
from labctl.services.recordings.warnings import as_json, warning_of
from tests.helpers.recordings import Triaxial, cycled
from tests.helpers.simulated_recordings import single_axis, three_axes
from tests.helpers.spoilt import (
    at_one_dataset,
    exchanged,
    flip,
    quantised,
    scaled,
    shake,
    slow_down,
    spoilt,
    with_gaps,
    wrong_rate,
)


@pytest.fixture(scope="module")
def one_axis() -> Recording:
    return single_axis(1)


@pytest.fixture(scope="module")
def three() -> Recording:
    return Triaxial(1).campaign(1)


def only(findings: list[Finding]) -> Finding:
    assert len(findings) == 1, [finding.text for finding in findings]
    return findings[0]


def test_good_readings_get_no_finding(one_axis: Recording) -> None:
    assert inspect_recording(one_axis) == []
    assert inspect_recording(to_points(one_axis)) == []


def test_good_means_get_no_finding(three: Recording) -> None:
    assert inspect_recording(three) == []
    assert inspect_recording(cycled(0.05)) == []


@pytest.mark.parametrize(
    "hidden",
    [
        {"scale_factor_odd": 1e-7, "bias": 2.0},
        {"saturation": -0.3},
        {"start_transient": 0.01},
        {"missed_steps": 0.05},
        {"rate_hysteresis": 0.1},
        {"dead_band": 0.5},
        {"table_rate_ripple": 0.01},
        {"thermal_hysteresis": 0.15},
        {"warm_up": 1.0},
    ],
    ids=str,
)
def test_large_effects_of_the_catalogue_are_no_finding(hidden: dict[str, float]) -> None:
    assert inspect_recording(single_axis(2, **hidden)) == []


@pytest.mark.slow
def test_three_axes_at_several_readings_per_second_get_no_finding() -> None:
    assert inspect_recording(three_axes(3, misalignment=0.05)) == []


@pytest.mark.parametrize(
    ("factor", "what", "said", "do"),
    [
        (-1.0, "sign", "gain -1.02", "[output.z] scale = -1"),
        (np.pi / 180, "unit", "near pi/180: the output is in rad/s", "state rad/s as the unit of this output"),
        (180 / np.pi, "unit", "near 180/pi", "[output.z] scale = 57.2958 "),
        (3600.0, "unit", "deg/h", "state deg/h as the unit of this output"),
        (16384.0, "scale", "gain 1.67", "raw counts"),
        (1000.0, "scale", "gain 1024", "mV"),
    ],
)
def test_a_wrong_gain_is_named(one_axis: Recording, factor: float, what: str, said: str, do: str) -> None:
    found = only(inspect_recording(spoilt(one_axis, scaled(factor, "gyro_z"))))
    assert (found.what, found.severity) == (what, "certain")
    assert said in found.text
    assert do in found.do
    assert found.value == pytest.approx(factor * 1.0234, rel=0.01)


def test_the_scale_that_is_advised_is_right(one_axis: Recording) -> None:
    unit = {"z": OutputUnit(unit="mV", scale=-22.0, offset=3.0)}
    wrong = spoilt(one_axis, scaled(1000.0, "gyro_z"), output=unit)
    advised = float(inspect_recording(wrong)[0].do.partition("scale = ")[2].split()[0].rstrip(","))
    right = spoilt(wrong, lambda _: None, output={"z": unit["z"].model_copy(update={"scale": advised})})
    assert [f.what for f in inspect_recording(right)] == []
    assert abs(advised) == pytest.approx(1023, rel=0.01)


def test_a_gain_of_half_is_only_likely_wrong(one_axis: Recording) -> None:
    assert only(inspect_recording(spoilt(one_axis, scaled(0.6, "gyro_z")))).severity == "likely"


def test_an_output_that_does_not_follow_is_named(one_axis: Recording) -> None:
    def dead(columns: dict[str, np.ndarray]) -> None:
        columns["gyro_z"] = np.random.default_rng(1).normal(0, 0.01, len(columns["gyro_z"]))

    assert only(inspect_recording(spoilt(one_axis, dead))).what == "no_response"


def test_exchanged_axes_are_named_with_both(three: Recording) -> None:
    found = only(inspect_recording(spoilt(three, exchanged("gyro_x", "gyro_y"))))
    assert (found.what, found.where, found.severity) == ("axes", "axes x and y", "certain")
    assert "exchange columns gyro_x and gyro_y" in found.do


def test_one_wrong_mounting_is_named_by_its_position(three: Recording) -> None:
    def remount(columns: dict[str, np.ndarray]) -> None:
        columns["position"][columns["position"] == "x"] = "z"

    found = inspect_recording(spoilt(three, remount))
    assert found
    assert all("z" in finding.where for finding in certain(found))

    def upside_down(columns: dict[str, np.ndarray]) -> None:
        columns["position"] = np.where(columns["position"] == "y", "-y", columns["position"])

    wrong = only(inspect_recording(spoilt(three, upside_down)))
    assert (wrong.what, wrong.where) == ("sign", "axis y")


def test_rates_without_a_sign_are_named(one_axis: Recording) -> None:
    def unsigned(columns: dict[str, np.ndarray]) -> None:
        columns["table_rate_dps"] = np.abs(columns["table_rate_dps"])

    found = only(inspect_recording(spoilt(one_axis, unsigned)))
    assert (found.what, found.severity) == ("sign", "certain")
    assert "column table_rate_dps" in found.where


@pytest.mark.parametrize(("edit", "meant"), [(flip, -80.0), (wrong_rate, 80.0)], ids=["flipped", "wrong rate"])
def test_one_data_set_that_disagrees_is_named_with_its_rate_and_its_outputs(
    one_axis: Recording, edit: object, meant: float
) -> None:
    wrong = spoilt(one_axis, at_one_dataset(80.0, edit))  # type: ignore[arg-type]
    for recording in (wrong, to_points(wrong)):
        found = only(inspect_recording(recording))
        assert (found.what, found.severity) == ("one_data_set", "certain")
        assert found.where.startswith("data set 65")
        assert found.value == pytest.approx(meant, rel=0.01)
        assert "deg/s, but the output shows " in found.text


def test_several_wrong_data_sets_are_each_named(one_axis: Recording) -> None:
    def several(columns: dict[str, np.ndarray]) -> None:
        for number in (10, 40, 90, 100):
            columns["gyro_z"][columns["dataset"] == number] *= -1

    found = inspect_recording(spoilt(one_axis, several))
    named = {finding.where.split(",")[0] for finding in found if finding.what == "one_data_set"}
    assert named == {f"data set {number}" for number in (10, 40, 90, 100)} - {"data set 39", "data set 94"}


def test_a_unit_that_moves_at_rest_is_named(one_axis: Recording) -> None:
    found = only(inspect_recording(spoilt(one_axis, at_one_dataset(0.0, shake))))
    assert (found.what, found.severity) == ("moves_at_rest", "certain")
    assert "data set 61" in found.where


def test_a_rate_that_changes_inside_a_data_set_shows_in_the_output(one_axis: Recording) -> None:
    found = only(inspect_recording(spoilt(one_axis, at_one_dataset(80.0, slow_down))))
    assert (found.what, found.severity) == ("rate_changes", "certain")
    assert found.value == pytest.approx(-40, rel=0.02)
    assert "data set 65" in found.text
    means = inspect_recording(to_points(spoilt(one_axis, at_one_dataset(80.0, slow_down))))
    assert {finding.what for finding in means} == {"one_data_set", "spread"}
    assert all("data set 65" in finding.where for finding in means)


def test_coarse_steps_are_said_against_the_noise(one_axis: Recording) -> None:
    found = only(inspect_recording(spoilt(one_axis, quantised(5.0))))
    assert (found.what, found.severity, found.value) == ("quantised", "likely", pytest.approx(5.0))
    assert "u = 1.4 deg/s" in found.text


@pytest.mark.parametrize(("factor", "unit"), [(1e3, "ms"), (1e6, "us")])
def test_time_stamps_in_another_unit_are_named(one_axis: Recording, factor: float, unit: str) -> None:
    for info in ({"sample_rate_hz": 5.0}, {"sample_rate_hz": None}):
        found = inspect_recording(spoilt(one_axis, scaled(factor, "t_s"), **info))[0]
        assert (found.what, found.severity) == ("time_unit", "certain")
        assert f"in {unit}" in found.text


def test_time_stamps_in_another_unit_without_rate_or_angle_are_likely(one_axis: Recording) -> None:
    def blind(columns: dict[str, np.ndarray]) -> None:
        columns["t_s"] *= 1e3
        del columns["table_angle_deg"]

    wrong = spoilt(one_axis, blind, sample_rate_hz=None)
    found = inspect_recording(Recording(wrong.info, wrong.columns))[0]
    assert (found.what, found.severity) == ("time_unit", "likely")


def test_time_stamps_since_1970_are_named(one_axis: Recording) -> None:
    def epoch(columns: dict[str, np.ndarray]) -> None:
        columns["t_s"] += 1.79e9

    found = only(inspect_recording(spoilt(one_axis, epoch)))
    assert (found.what, found.severity) == ("time_origin", "likely")


def test_gaps_are_named(one_axis: Recording) -> None:
    found = only(inspect_recording(spoilt(one_axis, with_gaps)))
    assert (found.what, found.severity) == ("gaps", "likely")
    assert "121 of 121" in found.where


def test_a_summary_of_parts_is_that_of_the_whole(one_axis: Recording) -> None:
    wrong = spoilt(one_axis, quantised(5.0))
    dataset = wrong.columns["dataset"]
    parts = [
        summarise(Recording(wrong.info, {name: v[dataset == number] for name, v in wrong.columns.items()}))
        for number in np.unique(dataset)
    ]
    assert findings_of(joined(wrong.info, parts), wrong.environment) == inspect_recording(wrong)


def test_a_finding_is_one_sentence_with_what_where_and_what_to_do(one_axis: Recording) -> None:
    found = only(inspect_recording(spoilt(one_axis, scaled(-1.0, "gyro_z"))))
    kept = as_json(warning_of(found))
    assert list(kept) == ["what", "severity", "where", "said", "value", "unit", "expected", "do", "text", "part"]
    assert "\n" not in found.text
    assert found.text.startswith("axis z: ")


def test_a_recording_without_rates_or_readings_is_no_trouble() -> None:
    info = single_axis(1).info
    empty = {name: np.zeros(0) for name in ("t_s", "table_rate_dps", "temperature_c", "gyro_z")}
    assert inspect_recording(Recording(info, {"dataset": np.zeros(0, dtype=np.int64), **empty})) == []
    one = {"dataset": np.array([1]), **{name: np.zeros(1) for name in empty}}
    assert inspect_recording(Recording(info, one)) == []
