"""The simulated world against physics worked out apart: motion, heat, noise, the Earth, and everything hidden in it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from instruments.simulation import hidden_defaults
from instruments.simulators.physics.motion import TableMotion

Make = Callable[..., Any]
EARTH_DPS = 360 / 86164.0905


def sampled(s: Any, seconds: float, from_s: float = 0.0, hz: float = 125.0) -> Any:
    unit = s.world.gyro(s.file.gyros[0].name)
    return unit.sample(from_s + np.arange(1, round(seconds * hz) + 1) / hz)


def test_a_move_is_a_trapezoid_of_whole_steps() -> None:
    table = TableMotion(1600, step_error_deg=0.0)
    ends = table.start(0.0, 4000, 200.0, 90.0)  # 45 deg/s, ramps of half a second
    t = np.linspace(0, ends, 20001)
    angle = table.angle_deg(t)
    rate = np.gradient(angle, t)
    assert angle[-1] == pytest.approx(900)
    assert rate.max() == pytest.approx(45, rel=1e-3)
    assert np.all(np.diff(angle) >= -1e-9)
    assert ends == pytest.approx(900 / 45 + 0.5)
    assert np.abs(np.gradient(rate, t)[50:-50]).max() < 91


def test_an_abort_ramps_down_from_where_it_is() -> None:
    table = TableMotion(1600, step_error_deg=0.0)
    table.start(0.0, 4000, 200.0, 90.0)
    at_rest = table.abort(10.0)
    assert at_rest == pytest.approx(10.5)
    before, after = table.angle_deg(np.array([10.0, at_rest, at_rest + 5]))[[0, 1]], table.angle_deg(np.array([99.0]))
    assert before[1] - before[0] == pytest.approx(45 * 0.25)
    assert after[0] == pytest.approx(before[1])


def test_step_errors_repeat_every_electrical_cycle_and_do_not_add_up() -> None:
    table = TableMotion(1600, step_error_deg=0.02)
    ends = table.start(0.0, 1600 * 5, 400.0, 200.0)
    t = np.linspace(0, ends, 50001)
    error = table.angle_deg(t) - table.commanded_deg(t)
    assert np.abs(error).max() == pytest.approx(0.02, rel=0.02)
    assert table.angle_deg(np.array([ends]))[0] == pytest.approx(5 * 360)


def test_the_earth_turns_with_the_bench(stand: Make) -> None:
    """Up: sin of the latitude. Level: cos of the latitude, once per turn of the table."""
    s = stand("triaxial-sim")
    s.world.mount(0.0, "z")
    angle = np.linspace(0, 720, 73)
    body = s.world.body_rates(np.zeros(73), angle)
    latitude = np.radians(42.28)
    assert body[:, 2] == pytest.approx(EARTH_DPS * np.sin(latitude), rel=1e-4)
    assert np.hypot(body[:, 0], body[:, 1]) == pytest.approx(EARTH_DPS * np.cos(latitude), rel=1e-4)
    assert body[0] == pytest.approx(body[36])
    assert np.linalg.norm(body, axis=1) == pytest.approx(EARTH_DPS, rel=1e-4)
    s.world.mount(0.0, "-z")
    assert s.world.body_rates(np.full(1, 10.0), angle[:1])[0, 2] == pytest.approx(-10 - EARTH_DPS * np.sin(latitude))


def test_white_noise_has_the_size_of_the_data_sheet(stand: Make) -> None:
    s = stand("triaxial-sim")
    rates = sampled(s, 400).rate_dps
    n = rates.diff() if hasattr(rates, "diff") else np.diff(rates, axis=0)
    assert n.std(axis=0) / np.sqrt(2) == pytest.approx(0.01 * np.sqrt(125), rel=0.02)


def test_bias_instability_wanders_more_the_longer_one_waits(stand: Make) -> None:
    s = stand("single-axis-sim", gyro={"sample_rate_hz": 1})
    s.world.power(0.0, True)
    means = sampled(s, 40_000, hz=1.0).rate_dps[8000:, 0].reshape(-1, 100).mean(axis=1)
    white = 0.0014 / np.sqrt(100)
    assert means.std() > 3 * white
    near, far = np.std(np.diff(means)), np.std(means[50:] - means[:-50])
    assert far > 1.2 * near


def test_heat_flows_from_chamber_to_gyro(stand: Make) -> None:
    s = stand("single-axis-sim")
    s.world.power(0.0, True)
    s.world.heat.set(0.0, 45.0)
    t = np.array([60.0, 720.0, 1800.0, 3600.0, 7200.0])
    air, gyro = s.world.heat.airs_c(t), s.world.heat.sensor_c("fog", t)
    assert np.all(np.diff(air) > -0.1)
    assert air[1] <= 25 + 1.67 * 12 + 0.5  # no faster than the chamber's ramp
    assert np.all(gyro[:3] < air[:3])  # the gyro lags behind ...
    assert air[-1] == pytest.approx(45, abs=0.1)
    assert gyro[-1] == pytest.approx(45 + 1.5, abs=0.2)  # ... and ends above: it heats itself


def test_the_same_seed_is_the_same_world_and_another_is_another(stand: Make) -> None:
    def first(seed: int, noise_seed: int = 0) -> Any:
        s = stand("triaxial-sim", simulation={"seed": seed, "noise_seed": noise_seed})
        return sampled(s, 2).rate_dps, s.world.gyro("mems").truth.k(25.0)

    (one, k1), (two, k2), (three, k3), (four, k4) = first(5), first(5), first(6), first(5, 1)
    assert np.array_equal(one, two)
    assert np.array_equal(k1, k2)
    assert not np.array_equal(k1, k3)
    assert np.array_equal(k1, k4)  # the same unit on another day
    assert not np.array_equal(one, four)
    assert not np.array_equal(one, three)


@pytest.mark.parametrize("effect", ["run_shift", "mounting_shift"])
def test_shifts_of_another_day_are_others_of_the_same_size(stand: Make, effect: str) -> None:
    def shifts(noise_seed: int) -> list[float]:
        """Return what the effect adds in ten mountings, each a powered session, deg/s."""
        means = []
        for size in (0.0, 1.0):
            hidden = {"seed": 5, "noise_seed": noise_seed, "hidden": {effect: size}}
            s = stand("triaxial-sim", simulation=hidden)
            means.append(np.array([_session(s, k) for k in range(10)]))
        return (means[1] - means[0]).tolist()

    days = np.array([shifts(day) for day in (0, 0, 1, 2)])
    assert np.array_equal(days[0], days[1])
    assert not np.any(np.isclose(days[0], days[2], atol=1e-3))
    assert not np.any(np.isclose(days[2], days[3], atol=1e-3))
    assert 0.5 < np.std(days) < 1.5


def _session(s: Any, number: int) -> float:
    """Return the mean output of the first axis in a mounting and powered session of its own."""
    at = 100.0 * number
    s.world.mount(at, "z")
    s.world.power(at, True)
    rate = s.world.gyro("mems").sample(at + np.arange(1, 3) / 10.0).rate_dps[:, 0].mean()
    s.world.power(at + 50.0, False)
    return float(rate)


def story(s: Any) -> np.ndarray:
    """A walk in which every channel moves: warm-up, a warming chamber, turns both ways, two mountings, two runs."""
    unit = s.world.gyro(s.file.gyros[0].name)
    parts = []
    t = 0.0
    for run, position in enumerate(["z", "x" if len(s.file.gyros[0].axes) > 1 else "z"]):
        s.world.power(t, True)
        s.world.mount(t, position)
        s.world.heat.set(t, 25.0 + 15 * (run + 1))
        for rate in (0.0, 60.0, 60.0, -60.0, 3.0, -3.0, 0.05, 0.12, 390.0):
            if rate:
                s.world.table.start(t, int(np.sign(rate)) * 8000, abs(rate) / s.world.table.step_deg, 90.0)
            sample = unit.sample(t + np.arange(1, 301) * 0.2)
            parts.append(np.concatenate([sample.rate_dps.ravel(), sample.temperature_c.ravel()]))
            t += min(8000 * s.world.table.step_deg / abs(rate or 60.0), 2000.0) + 600.0
        s.world.power(t, False)
        t += 3600.0
    return np.concatenate(parts)


@pytest.mark.parametrize("after_s", [0.01, 0.5, 2.0])
def test_an_abort_soon_after_homing_moves_nothing(after_s: float) -> None:
    table = TableMotion(28800)
    table.start(0.0, 500_000, 3200.0, 400.0)
    table.abort(7.0)
    home_s = table.home(15.0)
    assert table.abort(home_s + after_s) == home_s + after_s
    assert not table.moving(home_s + after_s)
    assert table.commanded_deg(np.array([home_s + after_s + 1.0]))[0] == 0.0


@pytest.mark.parametrize("effect", sorted(hidden_defaults()))
def test_every_effect_can_be_hidden_and_its_size_counts(stand: Make, effect: str) -> None:
    bench = "triaxial-sim"
    size = hidden_defaults()[effect]
    without = story(stand(bench))
    found = [story(stand(bench, simulation={"hidden": {effect: k * size}})) - without for k in (1.0, 1.0, 3.0)]
    assert np.any(found[0] != 0), "hiding it changes nothing"
    assert np.array_equal(found[0], found[1]), "the same seed must hide the same"
    # a delay moves the ripple of the steps by more than a period of it, and then by no more
    assert found[2].std() > 1.3 * found[0].std(), "three times the size must be more"
    assert np.all(np.isfinite(found[0]))


def test_what_cannot_be_hidden_is_named(stand: Make) -> None:
    with pytest.raises(ValueError, match=r"'gremlins' cannot be hidden; choose one of .*bias"):
        stand("triaxial-sim", simulation={"hidden": {"gremlins": 1.0}})
