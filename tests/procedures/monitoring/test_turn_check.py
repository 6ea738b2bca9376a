"""The check right after a turn by hand, on courses whose integral is known in closed form."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from instruments.interfaces.gyro import Channel, Readings
from procedures.contracts.steps import Turn
from procedures.monitoring.turn_check import TurnResult, UnitTurn, check_turn, moved
from procedures.monitoring.turn_course import Course, nominal_outputs
from procedures.recipe.turns import TurnRules

RATE_HZ, REST_S, TURN_S = 100.0, 4.0, 8.0
BIAS_DPS = {"x": 0.7, "y": -0.3, "z": 2.0}
RULES = TurnRules(turns_deg=(360,))
CHANNELS = tuple(Channel(f"gyro_{axis}", "deg/s", 1e-3) for axis in "xyz")


def swing(angle_deg: float, n: int = round(TURN_S * RATE_HZ)) -> Any:
    """Return rates (n,) of a sine hump whose trapezoids give the angle."""
    hump = np.sin(np.linspace(0.0, np.pi, n))
    return angle_deg * hump / np.trapezoid(hump, dx=1 / RATE_HZ)


def course(rates: dict[str, Any], **counts: int) -> Course:
    n = len(next(iter(rates.values())))
    noise = np.random.default_rng(1)
    raw = {
        f"gyro_{axis}": np.rint(1e3 * (rate + BIAS_DPS[axis] + 0.05 * noise.standard_normal(n))).astype(np.int64)
        for axis, rate in rates.items()
    }
    taken = Course(nominal_outputs(CHANNELS, {}), RATE_HZ)
    taken.add(Readings(np.arange(n) / RATE_HZ, raw, np.ones(n, bool), **counts))
    return taken


def still(**off_dps: Any) -> Course:
    n = round(REST_S * RATE_HZ)
    return course({axis: np.zeros(n) + off_dps.get(axis, 0.0) for axis in "xyz"})


def judged(
    turned: dict[str, float], asked_deg: float = 360.0, position: str = "x", after: Course | None = None, **counts: int
) -> TurnResult:
    step = Turn(
        dataset=2, position=position, run=1, mounting=1, turn_deg=asked_deg, turn_u_deg=1.0, rest_s=REST_S, within_s=60
    )
    rates = {axis: swing(turned.get(axis, 0.0)) for axis in "xyz"}
    return check_turn(step, RULES, UnitTurn("imu", still(), course(rates, **counts), after or still(), 400.0))


@pytest.mark.parametrize(
    ("turned", "asked", "position", "said"),
    [
        ({"x": 359.0}, 360, "x", ""),
        ({"x": -359.0}, 360, "-x", ""),  # counter-clockwise with -x up is negative about x
        ({"y": -725.0}, -720, "y", ""),
        ({"x": 330.0}, 360, "x", ""),  # a nominal scale factor may be off by a tenth
        ({"x": 300.0}, 360, "x", "the unit turned by only 300 deg about axis x instead of 360 deg"),
        ({"x": 420.0}, 360, "x", "the unit turned by 420 deg about axis x instead of 360 deg"),
        ({"z": 360.0}, 720, "z", "the unit turned by only 360 deg about axis z instead of 720 deg"),
        ({"y": 360.0}, 360, "x", "the unit turned by 360 deg about axis y, not about axis x"),
        ({"x": -360.0}, 360, "x", "the unit turned by 360 deg in the wrong direction, clockwise"),
        ({"x": 360.0}, 360, "-x", "the unit turned by 360 deg in the wrong direction, clockwise"),
        ({"x": 360.0}, -360, "x", "the unit turned by 360 deg in the wrong direction, counter-clockwise"),
        ({}, 360, "x", "the unit turned by only 0 deg about axis x instead of 360 deg"),
    ],
)
def test_a_turn_is_judged_by_its_angle(turned: dict[str, float], asked: float, position: str, said: str) -> None:
    found = judged(turned, asked, position)
    assert found.refused == said
    sign = -1.0 if position.startswith("-") else 1.0
    assert found.came_deg == pytest.approx(sign * turned.get(position.lstrip("-"), 0.0), abs=0.5)


def test_a_turn_that_is_too_fast_for_the_unit_is_refused() -> None:
    assert "the unit measures only up to 400 deg/s; turn the unit more slowly" in judged({"x": 2600.0}, 2600).refused


def test_lost_readings_are_counted_of_all_that_should_have_come() -> None:
    assert judged({"x": 360.0}, lost=16).refused == ""
    assert judged({"x": 360.0}, lost=17).refused == "2.1 % of the readings of the turn were lost or bad, limit 2 %"


def test_a_nudge_and_a_slow_turn_in_a_rest_are_found() -> None:
    nudge = np.zeros(round(REST_S * RATE_HZ))
    nudge[200:225] = 20.0
    assert judged({"x": 360.0}, after=still(z=nudge)).refused.startswith(
        "the unit moved during the rest after the turn"
    )
    creeping = judged({"x": 360.0}, after=still(y=1.5)).refused
    assert creeping == (
        "the output about y changed by +1.5 deg/s between the rests before and after the turn; "
        "the unit moved during one of them"
    )
    assert judged({"x": 360.0}, after=still(y=0.5)).refused == ""


def test_noise_alone_is_no_movement() -> None:
    noisy = Course(nominal_outputs(CHANNELS, {}), RATE_HZ)
    n, draw = 1000, np.random.default_rng(3)
    raw = {f"gyro_{axis}": np.rint(8e3 * draw.standard_normal(n)).astype(np.int64) for axis in "xyz"}
    noisy.add(Readings(np.arange(n) / RATE_HZ, raw, np.ones(n, bool)))
    assert moved(noisy, 1.0, "before") == ""


def test_an_axis_that_the_unit_does_not_measure_is_not_judged_but_another_one_is() -> None:
    only_z = nominal_outputs(CHANNELS[2:], {})

    def of(rate: Any) -> Course:
        taken = Course(only_z, RATE_HZ)
        raw = {"gyro_z": np.rint(1e3 * rate).astype(np.int64)}
        taken.add(Readings(np.arange(len(rate)) / RATE_HZ, raw, np.ones(len(rate), bool)))
        return taken

    def about_x(angle_deg: float) -> TurnResult:
        step = Turn(dataset=2, position="x", run=1, mounting=1, turn_deg=360, turn_u_deg=1, rest_s=4, within_s=60)
        rest = of(np.zeros(400))
        return check_turn(step, RULES, UnitTurn("imu", rest, of(swing(angle_deg)), rest, 400.0))

    assert about_x(3.0) == TurnResult("", None)
    assert about_x(360.0).refused == "the unit turned by 360 deg about axis z, not about axis x"


def test_a_voltage_counts_by_the_nominal_scale_factor_of_the_data_sheet() -> None:
    channel = (Channel("gyro_z", "V", 1e-4),)
    nominal = nominal_outputs(channel, {"z": {"unit": "V", "offset": 2.5, "scale": 0.02}})
    assert nominal["z"].rate_dps(np.array([25_000, 27_000])) == pytest.approx([0.0, 10.0])
    assert nominal_outputs((Channel("gyro_z", "rad/s", 1.0),), {})["z"].rate_dps(np.array([1])) == pytest.approx(
        57.29578
    )
