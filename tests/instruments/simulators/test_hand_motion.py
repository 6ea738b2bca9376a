"""The simulated hand: how it moves, how well it meets an angle, and the mistakes that its settings name."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from instruments.simulators.physics.hand_motion import HandMotion
from instruments.simulators.physics.motion import TableMotion

SURE = {"u_deg": 0, "rate_dps": 90, "reaction_s": 2}


def hand(settings: dict[str, object] | None = None, below: Any = None, seed: int = 1) -> HandMotion:
    return HandMotion(settings or SURE, below, [seed])


def test_a_turn_goes_from_rest_to_rest_with_the_least_jerk() -> None:
    turning = hand()
    turning.turn(10.0, "x", 360.0)
    t = np.linspace(10.0, 20.0, 100_001)
    angle = turning.angle_deg(t)
    rate = np.gradient(angle, t)
    assert (angle[0], angle[-1]) == (0.0, pytest.approx(360.0))
    assert rate.max() == pytest.approx(1.875 * 90.0, rel=1e-4)  # 15/8 of the mean: Flash and Hogan 1985
    assert np.all(rate >= -1e-6)
    begin, end = t[np.flatnonzero(angle > 1e-6)[0]], t[np.flatnonzero(angle < 360.0 - 1e-6)[-1]]
    assert begin > 10.5
    assert end - begin == pytest.approx(4.0, abs=0.1)
    assert turning.is_turning(float(end))
    assert not turning.is_turning(20.0)


def test_turns_add_to_the_angle_of_the_table() -> None:
    table = TableMotion(1600, step_error_deg=0.0)
    table.start(0.0, 400, 200.0, 90.0)
    turning = hand(below=table)
    turning.turn(100.0, "x", 360.0)
    turning.turn(200.0, "x", -720.0)
    at = np.array([50.0, 150.0, 300.0])
    assert turning.angle_deg(at) == pytest.approx([90.0, 450.0, -270.0])
    assert turning.commanded_deg(at) == pytest.approx([90.0, 450.0, -270.0])


def test_angle_errors_scatter_by_the_stated_u() -> None:
    turning = hand({"u_deg": 1.5})
    for number in range(400):
        turning.turn(100.0 * number, "x", 360.0)
    ends = turning.angle_deg(np.arange(401) * 100.0)
    assert np.std(np.diff(ends)) == pytest.approx(1.5, rel=0.1)
    assert np.mean(np.diff(ends)) == pytest.approx(360.0, abs=0.3)


@pytest.mark.parametrize(
    ("mistake", "came_deg", "up"),
    [
        ("short", 300.0, "-x"), ("axis", 360.0, "-y"), ("direction", -360.0, "-x"), ("nothing", 0.0, "-x"),
        ("nudge", 368.0, "-x"), ("fast", 360.0, "-x"),
    ],
)  # fmt: skip
def test_each_mistake_is_made_once(mistake: str, came_deg: float, up: str) -> None:
    turning = hand({**SURE, "mistakes": [mistake]})
    assert turning.turn(0.0, "-x", 360.0) == up
    assert turning.angle_deg(np.array([50.0]))[0] == pytest.approx(came_deg)
    assert turning.turn(100.0, "-x", 360.0) == "-x"
    assert turning.angle_deg(np.array([150.0]))[0] == pytest.approx(came_deg + 360.0)


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"speed": 1}, "hand.speed is not known; choose one of u_deg, rate_dps, reaction_s, mistakes"),
        ({"rate_dps": 0}, "hand.rate_dps = 0; give a number above 0"),
        ({"u_deg": "small"}, "hand.u_deg = 'small'; give a number above 0"),
        ({"mistakes": ["drop"]}, "give a list of short, axis, direction"),
    ],
)
def test_a_setting_that_cannot_be_is_named(settings: dict[str, object], said: str) -> None:
    with pytest.raises(ValueError, match=said.replace(".", r"\.")):
        hand(settings)
