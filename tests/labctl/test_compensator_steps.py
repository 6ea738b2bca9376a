"""What a compensator does with each of its arguments, on small calibrations; quick, so that its mutants can run.

A correction is compared with the fitted model, with a lag written out here, and with itself at the edge of its range.
"""

from __future__ import annotations

import warnings
from datetime import UTC, datetime
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from instruments.clock import VirtualClock
from labctl.calibration import Calibration
from labctl.calibration.certification import CalibrationWarning
from labctl.compensator import Compensator, output_limits_dps
from labctl.errors import BadInput
from labctl.fitting import Channels
from tests.helpers.small_calibrations import small

LAWS = ["lags", "direct, lags", "two axes, lags"]
PER_G, PER_G2 = np.array([[0.3, -0.2, 0.1]]), np.array([0.05])
EDGE_C, EDGE_DPS = (19.5, 40.5), (-104.0, 104.0)  #: what counts as inside of 20 to 40 deg C, -100 to 100 deg/s
T_S = np.array([0.0, 10.0, 30.0, 31.0, 200.0, 200.0, 260.0])
WARM_C = np.array([25.0, 26.0, 30.0, 30.5, 38.0, 38.0, 33.0])


def raws(calibration: Calibration, n: int) -> np.ndarray:
    return np.random.default_rng(2).uniform(-90.0, 90.0, (n, len(calibration.axes)))


def by_model(calibration: Calibration, raw: np.ndarray, columns: dict[str, Any], across: Any = None) -> np.ndarray:
    """Return the rates by the whole fitted model."""
    outputs = {axis: raw[:, i] for i, axis in enumerate(calibration.axes)}
    found = calibration.fitted.compensate(outputs, Channels(columns, outputs), across or {})
    return np.column_stack([found[axis] for axis in calibration.axes])


@pytest.mark.parametrize("name", ["plain", "direct", "two axes"])
def test_inside_the_range_the_correction_is_that_of_the_model(name: str) -> None:
    calibration = small(name)
    raw = raws(calibration, 7)
    found = Compensator(calibration).compensate(raw, WARM_C)
    assert found.rate_dps == pytest.approx(by_model(calibration, raw, {"temperature_c": WARM_C}), abs=1e-9)
    assert found.rate_dps.shape == raw.shape
    assert (found.outside.tolist(), found.left_out_dps) == ([False] * 7, None)
    for k in range(7):
        rate, outside = Compensator(calibration).step(raw[k], WARM_C[k])
        assert (rate == pytest.approx(found.rate_dps[k], abs=1e-12), outside) == (True, False)


@pytest.mark.parametrize("name", ["plain", "direct"])
@pytest.mark.parametrize(
    ("raw", "warm_c", "outside"),
    [
        (10.0, EDGE_C[0], False), (10.0, EDGE_C[0] - 0.01, True), (10.0, EDGE_C[1], False),
        (10.0, EDGE_C[1] + 0.01, True), (EDGE_DPS[0], 30.0, False), (EDGE_DPS[0] - 0.01, 30.0, True),
        (EDGE_DPS[1], 30.0, False), (EDGE_DPS[1] + 0.01, 30.0, True), (500.0, 80.0, True), (-500.0, 0.0, True),
    ],
)  # fmt: skip
def test_outside_its_range_a_sample_is_flagged_and_the_error_at_the_edge_taken_off(
    name: str, raw: float, warm_c: float, outside: bool
) -> None:
    clamp, refuse = Compensator(small(name)), Compensator(small(name), "refuse")
    edge = float(np.clip(raw, *EDGE_DPS))
    expected = clamp.compensate([edge], float(np.clip(warm_c, 20.0, 40.0))).rate_dps[0] + raw - edge
    found = clamp.compensate([0.0, raw], [30.0, warm_c])
    assert found.rate_dps[1] == pytest.approx(expected, abs=1e-12)
    assert found.outside.tolist() == [False, outside]
    rate, flag = clamp.step(raw, warm_c)
    assert (rate[0], flag) == (pytest.approx(expected, abs=1e-12), outside)
    if not outside:
        assert refuse.compensate([raw], warm_c).rate_dps[0] == pytest.approx(expected, abs=1e-12)
        return
    what = f"temperature [{warm_c}] deg C outside 20 to 40 deg C" if not 19.5 <= warm_c <= 40.5 else (
        f"rate [{raw}] deg/s outside -104 to 104 deg/s"
    )  # fmt: skip
    with pytest.raises(BadInput) as refused:
        refuse.compensate([0.0, raw], [30.0, warm_c])
    assert str(refused.value).startswith(f"sample 2: {what} (the range calibrated for ONE version 1)")


def test_a_sample_at_its_limit_is_inside_also_beside_one_that_is_not() -> None:
    compensator = Compensator(small("plain"))
    raw = np.array([EDGE_DPS[0], EDGE_DPS[1], 500.0])
    assert compensator.compensate(raw, 30.0).outside.tolist() == [False, False, True]
    with pytest.raises(BadInput, match=r"^sample 1: temperature \[80\.0\] deg C outside"):
        Compensator(small("plain"), "refuse").compensate(raw, 80.0)


@pytest.mark.parametrize("name", ["plain", "direct", "lags", "direct, lags"])
def test_what_is_no_number_gives_none_flagged(name: str) -> None:
    raw, warm = np.array([1.0, np.nan, 1.0, 1.0]), np.array([30.0, 30.0, np.nan, 30.0])
    compensator = Compensator(small(name))
    found = compensator.compensate(raw, warm, {"t_s": np.arange(4.0)})
    assert found.outside.tolist() == np.isnan(found.rate_dps).tolist() == [False, True, True, False]
    with pytest.raises(BadInput, match=r"^sample 2: rate \[nan\]"):
        Compensator(small(name), "refuse").compensate(raw[:2], warm[:2], {"t_s": np.arange(2.0)})


def test_each_temperature_of_a_sample_is_judged() -> None:
    compensator = Compensator(small("two axes"))
    warm = np.array([[30.0, 31.0], [30.0, 41.0], [19.0, 31.0]])
    assert compensator.compensate(np.zeros((3, 2)), warm).outside.tolist() == [False, True, True]
    assert compensator.compensate([[0.0, 0.0], [0.0, 105.0], [-105.0, 0.0]], 30.0).outside.tolist() == [
        False, True, True,
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("rate_dps", "limits"),
    [((-100.0, 100.0), (-104.0, 104.0)), ((20.0, 40.0), (19.6, 40.4)), ((5.0, 5.0), (5.0 - 2e-11, 5.0 + 2e-11))],
)
def test_the_range_of_rates_is_two_hundredths_wider(rate_dps: Any, limits: Any) -> None:
    calibration: Any = SimpleNamespace(rate_dps=rate_dps)
    assert output_limits_dps(calibration) == pytest.approx(limits, rel=1e-15)
    calibration.rate_dps = (-np.inf, np.inf)
    assert output_limits_dps(calibration) == (-np.inf, np.inf)


def test_another_word_than_clamp_or_refuse_is_refused() -> None:
    word: Any = "ignore"
    with pytest.raises(BadInput, match="outside = 'ignore' is not known"):
        Compensator(small("plain"), word)


def test_a_calibration_that_is_overdue_or_revoked_says_so_by_the_clock_that_is_given() -> None:
    calibration = small("plain")
    document: Any = calibration.document
    document["certification"] = {
        "state": "in-force", "by": "Ada", "reason": "", "at": "2026-01-01T00:00:00+00:00",
        "due": "2026-02-01T00:00:00+00:00", "calibration_hash": "",
    }  # fmt: skip
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert Compensator(calibration, clock=VirtualClock(datetime(2026, 1, 31, tzinfo=UTC))).warning == ""
        assert Compensator(small("plain")).warning == ""
    with pytest.warns(CalibrationWarning, match="ONE version 1 was due on .*, 1.0 days ago"):
        late = Compensator(calibration, clock=VirtualClock(datetime(2026, 2, 2, tzinfo=UTC)))
    assert "1.0 days ago" in late.warning
    document["certification"] |= {"state": "revoked", "due": None}
    with pytest.warns(CalibrationWarning, match="revoked"):
        Compensator(calibration)


def test_a_file_and_its_bytes_are_loaded_as_asked(tmp_path: Path) -> None:
    content = small("plain").to_bytes()
    (tmp_path / "file.json").write_bytes(content)
    for load in (lambda *how: Compensator.from_file(tmp_path / "file.json", *how),
                 lambda *how: Compensator.from_file(str(tmp_path / "file.json"), *how),
                 lambda *how: Compensator.from_bytes(content, *how)):  # fmt: skip
        assert load().compensate([500.0], 30.0).outside.tolist() == [True]
        with pytest.raises(BadInput, match="sample 1: rate"):
            load("refuse").compensate([500.0], 30.0)


def test_an_output_in_volts_becomes_a_rate_by_offset_and_scale_of_its_axis() -> None:
    one, two = small("plain"), small("two axes")
    document: Any = one.document
    document["output"] = {"z": {"unit": "V", "offset": 2.5, "scale": 0.02}}
    document = two.document
    document["output"] = {
        "x": {"unit": "V", "offset": 2.5, "scale": 0.02}, "z": {"unit": "V", "offset": -1.0, "scale": -0.01},
    }  # fmt: skip
    raw = raws(two, 4)
    for compensator, rates, volts in (
        (Compensator(one), raw[:, 0], 2.5 + 0.02 * raw[:, 0]),
        (Compensator(one), raw[:, :1], 2.5 + 0.02 * raw[:, :1]),
        (Compensator(two), raw, np.column_stack([2.5 + 0.02 * raw[:, 0], -1.0 - 0.01 * raw[:, 1]])),
    ):
        expected = compensator.compensate(rates, 30.0).rate_dps
        assert compensator.compensate_output(volts, 30.0).rate_dps == pytest.approx(expected, abs=1e-9)


def test_channels_of_the_model_are_needed_and_may_be_one_for_all() -> None:
    compensator = Compensator(small("supply"))
    assert (compensator.needs, Compensator(small("plain")).needs) == (("supply_v",), ())
    assert Compensator(small("lags")).needs == ("t_s",)
    raw, supply = np.array([10.0, 20.0]), np.array([5.1, 4.9])
    found = compensator.compensate(raw, 30.0, {"supply_v": supply}).rate_dps
    expected = by_model(small("supply"), raw[:, None], {"temperature_c": np.full(2, 30.0), "supply_v": supply})
    assert found == pytest.approx(expected[:, 0], abs=1e-12)
    one: Any = 5.1
    for given in (one, np.array([5.1])):
        assert compensator.compensate(raw, 30.0, {"supply_v": given}).rate_dps[0] == found[0]
    with pytest.raises(BadInput, match="ONE: its model needs channel 'supply_v'"):
        compensator.compensate(raw, 30.0)


@pytest.mark.parametrize(
    ("name", "raw", "warm_c", "channels", "said"),
    [
        ("plain", np.zeros((4, 2)), 30.0, {}, "rates of 2 axes given; the calibration has axes z"),
        ("two axes", np.zeros(4), 30.0, {}, "rates of 1 axes given; the calibration has axes x, z"),
        ("plain", np.zeros(4), np.zeros(3), {}, r"temperature_c has shape \(3,\)"),
        ("plain", np.zeros(4), np.zeros((4, 2)), {}, r"temperature_c has shape \(4, 2\); .*, \(4, 1\), deg C"),
        ("two axes", np.zeros((4, 2)), np.zeros((4, 3)), {}, r"temperature_c has shape \(4, 3\)"),
        ("two axes", np.zeros((4, 2)), np.zeros((2, 4)), {}, r"temperature_c has shape \(2, 4\)"),
        ("plain", np.zeros(4), np.zeros(0), {}, r"temperature_c has shape \(0,\)"),
        ("lags", np.zeros(4), 30.0, {"t_s": np.zeros(3)}, r"channel 't_s' has shape \(3,\); give one value for each"),
        ("lags", np.zeros(4), 30.0, {"t_s": 0.0}, r"channel 't_s' has shape \(\)"),
        ("lags", np.zeros(4), 30.0, {"t_s": np.zeros(1)}, r"channel 't_s' has shape \(1,\)"),
        ("supply", np.zeros(4), 30.0, {"supply_v": np.zeros((4, 1))}, r"channel 'supply_v' has shape \(4, 1\)"),
    ],
)  # fmt: skip
def test_a_shape_that_does_not_fit_is_refused(
    name: str, raw: np.ndarray, warm_c: Any, channels: Any, said: str
) -> None:
    with pytest.raises(BadInput, match=said):
        Compensator(small(name)).compensate(raw, warm_c, channels)


def test_an_answer_has_the_shape_of_what_was_given() -> None:
    one, two = Compensator(small("plain")), Compensator(small("two axes"))
    for compensator, shape, flags in ((one, (3,), 3), (one, (3, 1), 3), (two, (3, 2), 3), (one, (0,), 0),
                                      (two, (0, 2), 0), (one, (), 1), (two, (1, 2), 1)):  # fmt: skip
        for warm in (30.0, np.full(1, 30.0)):
            found = compensator.compensate(np.full(shape, 50.0), warm)
            assert (found.rate_dps.shape, found.outside.shape) == (shape, (flags,))
            assert found.rate_dps == pytest.approx(np.full(shape, 50.0), abs=5.0)
    raw = np.array([[10.0, 20.0], [30.0, 40.0]])
    by_axis = two.compensate(raw, [[25.0, 35.0], [25.0, 35.0]]).rate_dps
    assert by_axis[1] == pytest.approx(two.compensate(raw[1:], [[25.0, 35.0]]).rate_dps[0], abs=1e-12)


def test_without_a_thermometer_no_temperature_is_needed() -> None:
    calibration = small("plain")
    with pytest.raises(BadInput, match=r"depends on the temperature \(20 to 40 deg C\); give temperature_c"):
        Compensator(calibration).compensate([1.0], None)
    assert Compensator(calibration).needs_temperature is True
    document: Any = calibration.document
    document["validity"]["temperature_c"] = [None, None]
    free = Compensator(calibration)
    assert free.needs_temperature is False
    assert free.compensate([1.0], None).outside.tolist() == [False]
    assert free.step([1.0], None)[1] is False
    warm = free.compensate([1.0], 300.0)  # not limited, where it is given
    assert warm.outside.tolist() == [False]
