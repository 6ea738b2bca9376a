"""What the units put out just now: worked out when asked, of valid readings only, gone with the units."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from instruments.clock import VirtualClock
from instruments.interfaces.gyro import Channel, Readings
from procedures.monitoring.campaign_time import CampaignTime
from procedures.monitoring.progress import LiveOutput, Output, Progress
from tests.helpers.engine_rig import Rig

UNIT: Any = SimpleNamespace(channels=(Channel("gyro_z", "deg/s", 0.5, 1.0), Channel("temperature_c", "deg C", 1.0)))


def readings(values: list[int], valid: list[bool]) -> Readings:
    raw = {"gyro_z": np.array(values, dtype=np.int64), "temperature_c": np.zeros(len(values), dtype=np.int64)}
    return Readings(100.0 + np.arange(len(values)), raw, np.array(valid, dtype=bool))


def begun_at(clock_s: float) -> CampaignTime:
    clock = VirtualClock()
    clock.sleep(clock_s)
    return CampaignTime(clock)


def test_only_valid_readings_count_in_their_unit() -> None:
    live = LiveOutput()
    live.heard("imu", UNIT, readings([2, 4, 900], [True, True, False]), begun_at(40.0))
    (output,) = live.outputs()
    assert output == Output("imu", "gyro_z", "deg/s", 2.5, pytest.approx(0.5**0.5), 2, 62.0)


def test_nothing_is_said_of_what_sends_nothing() -> None:
    live = LiveOutput()
    live.heard("imu", UNIT, readings([], []), begun_at(0.0))
    live.heard("other", UNIT, readings([1], [False]), begun_at(0.0))
    assert live.outputs() == ()
    live.heard("other", UNIT, readings([1], [True]), begun_at(0.0))
    live.forget("other")
    assert live.outputs() == ()


def test_outputs_are_there_while_a_data_set_is_taken_and_gone_while_the_units_are_off(rig: Rig) -> None:
    during: dict[str, list[tuple[Output, ...]]] = {}

    def look(progress: Progress) -> None:
        during.setdefault(progress.step_text, []).append(progress.live.outputs())

    rig.run(observer=look)
    taken = [outputs for text, pictures in during.items() if text.startswith("data set") for outputs in pictures]
    assert {(each.gyro, each.channel, each.unit) for outputs in taken for each in outputs} == {
        ("imu", "gyro_z", "deg/s")
    }
    assert during["switch the units on, session 2"][0] == ()
    rates = {text.split(": ")[1].split(" deg/s")[0] for text in during if text.startswith("data set")}
    assert rates == {"0", "+20"}
