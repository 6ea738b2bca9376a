"""Units that a person turns from pose to pose: gravity and rates belong to one motion."""

from __future__ import annotations

import numpy as np
import pytest

from instruments.simulators.physics.tumbling import AGAIN_AFTER_S, Tumbling

UPS = ((0.0, 1.0, 0.0), (0.0, -1.0, 0.0), (0.6, 0.0, -0.8), (0.0, 0.0, 1.0))


@pytest.fixture
def person() -> Tumbling:
    made = Tumbling((0.0, 0.0, 1.0), 60.0, 1.0, [1])
    for k, up in enumerate(UPS):
        made.lay(10.0 * k, up)
    return made


def test_the_units_come_to_lie_as_asked(person: Tumbling) -> None:
    lain = person.attitudes(np.array([0.0, 9.0, 19.0, 29.0, 39.0]))[:, 2]
    assert lain[0] == pytest.approx([0, 0, 1])
    off = np.degrees(np.arccos(np.clip(np.sum(lain[1:] * np.array(UPS), axis=1), -1, 1)))
    assert off.max() < 10
    assert off.min() > 0.1  # a hand does not meet a pose exactly


def test_gravity_turns_with_the_integral_of_the_rates(person: Tumbling) -> None:
    step = 1e-3
    t_s = np.arange(1, 40_000) * step
    rates = np.radians(person.rates_dps(t_s, step))
    up = np.array([0.0, 0.0, 1.0])
    for rate in rates:  # what is fixed outside turns backwards in the body, by its rate
        size = float(np.linalg.norm(rate)) * step
        if size > 0:
            axis = rate * step / size
            up = (up * np.cos(size) - np.cross(axis, up) * np.sin(size)
                  + axis * (axis @ up) * (1 - np.cos(size)))  # fmt: skip
    assert up == pytest.approx(person.attitudes(t_s[-1:])[0, 2], abs=1e-6)
    assert (
        np.abs(person.attitudes(t_s[::500]) @ person.attitudes(t_s[::500]).transpose(0, 2, 1) - np.eye(3)).max() < 1e-9
    )


def test_a_person_does_one_thing_after_the_other() -> None:
    person = Tumbling((0.0, 0.0, 1.0), 60.0, 1.0, [1])
    person.lay(0.0, (0.0, 1.0, 0.0))
    person.lay(1.0, (1.0, 0.0, 0.0))  # while it is turned
    there = person.attitudes(np.array([9.0]))[0, 2]
    assert there[1] > 0.98
    person.lay(9.0, (0.0, 1.0, 0.0))  # it lies so already
    assert person.attitudes(np.array([14.0]))[0, 2] == pytest.approx(there)
    person.lay(9.0 + AGAIN_AFTER_S, (0.0, 1.0, 0.0))  # that was not good enough
    assert person.attitudes(np.array([40.0]))[0, 2] != pytest.approx(there, abs=1e-3)


def test_no_turn_is_no_rate() -> None:
    person = Tumbling((0.0, -1.0, 0.0), 60.0, 1.0, [1])
    t_s = np.linspace(0, 1, 5)
    assert person.attitudes(t_s)[:, 2] == pytest.approx(np.tile([0, -1, 0], (5, 1)))
    assert not person.rates_dps(t_s, 0.1).any()
