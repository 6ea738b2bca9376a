"""Orientation with the offset renewed at standstill: every trap of the report's program, and its result on a bench."""

from __future__ import annotations

import numpy as np
import pytest

from instruments.bench import open_bench
from instruments.clock import VirtualClock
from labctl.error_per_turn import static_bias
from labctl.errors import BadInput
from labctl.orientation import Orientation, StandstillRule
from labctl.services.planning.loading import load_bench

HZ = 10.0


def times(seconds: float, from_s: float = 0.0) -> np.ndarray:
    return from_s + np.arange(1, round(seconds * HZ) + 1) / HZ


def test_a_turn_is_followed_past_full_turns_and_counter_clockwise_is_positive() -> None:
    angle = Orientation().follow(times(1000), np.full(10_000, 90.0))
    assert angle[-1] == pytest.approx(90 * (1000 - 0.1))  # 64-bit and not wrapped; a 32-bit integer angle overflows
    assert Orientation().follow(times(10), np.full(100, -5.0))[-1] < 0


def test_readings_need_not_be_periodic() -> None:
    rng = np.random.default_rng(1)
    t = np.cumsum(rng.uniform(0.02, 0.3, 2000))
    angle = Orientation().follow(t, 30 * np.sin(t / 5) + 40)
    truth = 40 * (t - t[0]) - 150 * (np.cos(t / 5) - np.cos(t[0] / 5))
    assert np.max(np.abs(angle - truth)) < 0.05


def test_small_rates_are_not_truncated_away() -> None:
    creeping = Orientation().follow(times(1000), np.full(10_000, 1e-4), still=[False] * 10_000)
    assert creeping[-1] == pytest.approx(0.1, rel=1e-3)


def test_the_angle_is_held_at_standstill_from_its_beginning() -> None:
    o = Orientation()
    turned = o.follow(times(10), np.full(100, 20.0))[-1]
    rates = np.full(300, 0.3)  # an unknown offset: nothing of it is integrated once the rest counts
    stood = o.follow(times(30, from_s=10), rates)
    assert o.standing
    assert stood[-1] == pytest.approx(turned + 0.5 * (20.0 + 0.3) * 0.1)
    assert o.offset_dps == pytest.approx(0.3)


def test_a_short_stop_teaches_nothing() -> None:
    """The report's program goes on averaging for a moment while the vehicle drives off, and learns the motion."""
    o = Orientation(offset_dps=0.1)
    o.follow(times(1.9), np.full(19, 0.5))
    o.follow(times(10, from_s=1.9), np.full(100, 30.0))
    assert o.offset_dps == 0.1


def test_the_beginning_of_motion_is_neither_learned_nor_lost() -> None:
    """A vehicle that drives off gently: its first seconds pass for rest until it is fast enough."""
    o = Orientation(rule=StandstillRule(near_dps=1.0, quiet_dps=0.6))
    o.follow(times(20), np.zeros(200))
    t = times(10, from_s=20)
    ramp = 0.5 * (t - 20)
    angle = o.follow(t, ramp)
    assert o.offset_dps == pytest.approx(0, abs=1e-9)
    truth = 0.25 * (t[-1] - 20) ** 2
    assert angle[-1] == pytest.approx(truth, abs=1.1)  # what passed for rest in a whole stretch: 1 deg/s x 2 s at most


def test_slow_turning_that_the_wheels_know_of_is_no_offset() -> None:
    o = Orientation()
    angle = o.follow(times(60), np.full(600, 0.5), still=[False] * 600)
    assert o.offset_dps == 0
    assert angle[-1] == pytest.approx(0.5 * 59.9)


def test_told_standstill_renews_even_a_far_offset() -> None:
    o = Orientation()
    o.follow(times(10), np.full(100, 6.0), still=[True] * 100)
    assert o.offset_dps == pytest.approx(6.0)


def test_vibration_is_not_rest() -> None:
    o = Orientation()
    rates = 1.5 * np.sin(np.arange(400))
    o.follow(times(40), rates + 0.2)
    assert not o.standing
    assert o.offset_dps == 0


def test_angle_and_offset_are_set_apart() -> None:
    """The report's program hands the angle to the parameter of the offset."""
    o = Orientation()
    o.set_angle(90)
    assert (o.angle_deg, o.offset_dps) == (90, 0)
    o.set_offset(static_bias(np.full(100, 0.25)).bias_dps)
    assert (o.angle_deg, o.offset_dps) == (90, 0.25)
    assert o.follow(times(5), np.full(50, 10.25))[-1] == pytest.approx(90 + 49)


def test_only_the_newest_rest_counts() -> None:
    o = Orientation(rule=StandstillRule(learn_s=10))
    o.follow(times(60), np.full(600, 0.1))
    o.follow(times(60, from_s=60), np.full(600, 0.4))
    assert o.offset_dps == pytest.approx(0.4)


def test_a_gap_is_counted_and_is_no_rest() -> None:
    o = Orientation()
    o.follow(times(1.5), np.zeros(15))
    o.update(8.0, 0.0)
    assert o.gap_s == pytest.approx(6.5)
    assert not o.standing


@pytest.mark.parametrize(("t_s", "rate"), [(1.0, 0.0), (0.5, 0.0), (2.0, float("nan")), (float("inf"), 0.0)])
def test_bad_readings_are_refused_and_change_nothing(t_s: float, rate: float) -> None:
    o = Orientation()
    o.update(1.0, 1.0)
    with pytest.raises(BadInput):
        o.update(t_s, rate)
    assert o.update(1.1, 1.0) == pytest.approx(0.1)


@pytest.mark.slow
def test_the_simulated_gyrostar_drifts_less_than_a_degree_a_minute() -> None:
    """The report's result: 10 min of warm-up, then a standstill that renews the offset every 2 min.

    The table stands throughout, and the integration gets `still=False`, so that all it gathers is drift.
    """
    clock = VirtualClock()
    bench = open_bench(load_bench("gyrostar-sim"), clock)
    gyro = bench.gyros["gyrostar"]
    output = gyro.identify().output["z"]
    volts = gyro.channels[0]
    bench.unit_handler.power(on=True)
    gyro.start()

    def read(seconds: float) -> tuple[np.ndarray, np.ndarray]:
        readings = gyro.read(seconds)
        values = volts.value(readings.raw[volts.name])
        return readings.t_s, (values - float(output["offset"])) / float(output["scale"])

    cold = static_bias(read(20)[1]).bias_dps
    read(580)
    o = Orientation(offset_dps=static_bias(read(20)[1]).bias_dps, rule=StandstillRule(near_dps=3, quiet_dps=1))
    assert abs(o.offset_dps - cold) * 60 > 2  # without the warm-up and the renewal it would be far more
    drifts = []
    for _ in range(10):
        o.follow(*read(12))
        assert o.standing
        before_deg = o.angle_deg
        t, rate = read(108)
        o.follow(t, rate, still=[False] * len(t))
        drifts.append(abs(o.angle_deg - before_deg) / (108 / 60))
    bench.close()
    assert max(drifts) < 1.0
    assert max(drifts) > 0  # and the instrument does drift
