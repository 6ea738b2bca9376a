"""Whether a unit answers the table, with readings that numpy alone makes."""

from __future__ import annotations

import numpy as np
import pytest

from instruments.interfaces.gyro import Channel, Readings
from instruments.positions import Position
from procedures.monitoring.turn_course import nominal_outputs
from procedures.monitoring.unit_response import UnitResponse

CHANNELS = tuple(Channel(f"gyro_{axis}", "deg/s", 1e-3) for axis in "xyz")
MAX_DPS = 400.0


def readings(**rates_dps: float) -> Readings:
    """Return a second of a unit whose axes turn at such rates, with noise and a bias, in thousandths of deg/s."""
    rng, n = np.random.default_rng(7), 100
    raw = {
        f"gyro_{axis}": np.rint(1e3 * (rates_dps.get(axis, 0.0) + 0.8 + rng.normal(0, 0.2, n))).astype(np.int64)
        for axis in "xyz"
    }
    return Readings(np.arange(n) / n, raw, np.ones(n, dtype=bool), 0, 0)


def complaints(position: str, *sets: tuple[float, dict[str, float]]) -> list[str]:
    response = UnitResponse()
    response.expect("fog", nominal_outputs(CHANNELS, {}))
    found = []
    for rate_dps, output in sets:
        response.begin((1, 1))
        response.add("fog", readings(**output))
        found.append(response.complaint("fog", rate_dps, Position.of(position), MAX_DPS))
    return found


@pytest.mark.parametrize(("position", "sign"), [("z", 1), ("-z", -1), ("z@180/90", 1)])
def test_a_unit_that_follows_the_table_is_not_complained_of(position: str, sign: int) -> None:
    sets = [(rate, {"z": sign * 0.93 * rate, "x": 0.02 * rate}) for rate in (-90.0, 0.0, 3.0, 90.0)]
    assert complaints(position, *sets) == [""] * 4


def test_each_axis_of_a_tilted_unit_follows_by_its_share() -> None:
    third = 3**-0.5
    sets = [(rate, dict.fromkeys("xyz", third * rate)) for rate in (-90.0, 0.0, 90.0)]
    assert complaints("x+y+z", *sets) == [""] * 3
    one = [(rate, {"x": third * rate, "y": third * rate, "z": -third * rate}) for rate in (0.0, 90.0)]
    said = complaints("x+y+z", *one)[1]
    assert "its output about z changed by -52" in said
    assert "-100 % of the 57.7 % of that which turn about this axis" in said
    assert "its sign is reversed: mount the unit with x+y+z up" in said
    assert complaints("x+y-z", *one) == [""] * 2


@pytest.mark.parametrize(
    ("output", "advice"),
    [
        ({"z": 0.9}, "one that sends the angle of each sample instead of the rate"),
        ({"y": 90.0}, "its output about y shows the rate: mount the unit with z up"),
        ({"z": -90.0}, "its sign is reversed"),
        ({"z": 270.0}, "check the unit and scale of its output"),
    ],
)
def test_a_unit_in_another_mode_or_place_is_found_in_the_second_data_set(output: dict[str, float], advice: str) -> None:
    first, second = complaints("z", (0.0, {}), (90.0, output))
    assert first == ""
    assert second.startswith("from 0 to 90 deg/s of the table its output about z changed by ")
    assert advice in second


def test_rates_outside_the_judged_range_are_not_judged() -> None:
    silent = {"z": 0.0}
    assert complaints("z", (0.0, silent), (4.0, silent)) == ["", ""]  # slower than a drift may be
    assert complaints("z", (0.0, silent), (500.0, silent)) == ["", ""]  # beyond the range of the unit
    response = UnitResponse()
    volts = (Channel("gyro_z", "V", 1e-3),)
    response.expect("piezo", nominal_outputs(volts, {}))  # no scale factor is stated
    for rate_dps in (0.0, 90.0):
        response.begin((1, 1))
        response.add("piezo", readings())
        assert not response.complaint("piezo", rate_dps, Position.of("z"), MAX_DPS)


def test_another_mounting_is_not_compared_with_the_one_before() -> None:
    response = UnitResponse()
    response.expect("fog", nominal_outputs(CHANNELS, {}))
    for mounting, rate_dps in ((1, 90.0), (2, 0.0)):
        response.begin((mounting, 1))
        response.add("fog", readings(z=90.0))
        assert not response.complaint("fog", rate_dps, Position.of("z"), MAX_DPS)


def test_complete_data_sets_are_unconfirmed_until_the_output_answers_a_change_of_the_rate() -> None:
    response = UnitResponse()
    response.expect("fog", nominal_outputs(CHANNELS, {}))
    for number, rate_dps in enumerate((0.0, 3.0, 90.0, -90.0), start=1):
        response.begin((1, 1))
        response.add("fog", readings(z=rate_dps))
        assert not response.complaint("fog", rate_dps, Position.of("z"), MAX_DPS)
        response.keep(["fog", "other"], number)
        if number == 2:
            assert response.unconfirmed("fog") == (1, 2)  # between 0 and 3 deg/s nothing was compared
    assert response.unconfirmed("fog") == ()
    assert response.unconfirmed("other") == (1, 2, 3, 4)
    response.begin((2, 1))
    assert response.unconfirmed("other") == ()
