"""The F4T through its bytes: floats in two words, units, limits, modes, alarms."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from instruments.drivers.chambers.watlow_f4t import ALARMS_EVERY_S
from instruments.errors import LimitError, LinkError, MalformedReply, NoReply, RequestRejected, WrongInstrument
from instruments.interfaces.chamber import ChamberLimits

pytest_plugins = ["tests.helpers.modbus_rig"]


def test_making_the_driver_sends_nothing(f4t: Any) -> None:
    assert f4t.tap.heard == []
    assert f4t.ports.opened == []


def test_identify_reads_the_part_number(f4t: Any) -> None:
    assert f4t.driver.identify() == "Watlow F4T1A1A1A1A1A1A"


def test_another_part_number_is_another_instrument(f4t: Any) -> None:
    f4t.simulated.part_number[:3] = [ord(letter) for letter in "PM6"]
    with pytest.raises(WrongInstrument, match="part number 'PM61A1A1A1A1A1A' is not that of an F4T"):
        f4t.driver.identify()


@pytest.mark.parametrize(
    ("attribute", "value", "text"), [("units", 30, "units on Ethernet are 30"), ("status", 32, "status is 32")]
)
def test_fahrenheit_and_failure_are_refused(f4t: Any, attribute: str, value: int, text: str) -> None:
    setattr(f4t.simulated, attribute, value)
    with pytest.raises(WrongInstrument, match=f"chamber: .*{text}"):
        f4t.driver.identify()


def test_the_narrower_limits_count(make_rig: Callable[..., Any]) -> None:
    rig = make_rig("f4t", min_c=-60, max_c=100)
    rig.simulated.min_c, rig.simulated.max_c = -55.0, 180.0
    assert rig.driver.limits == ChamberLimits(-55.0, 100.0, 0.1, 1.67)
    with pytest.raises(LimitError, match=r"-55\.1 deg C lies outside the limits, -55 to 100 deg C"):
        rig.driver.set_temperature_c(-55.1)
    assert rig.simulated.writes == []


@pytest.mark.parametrize(("asked_c", "set_c"), [(85.1, 85.1), (0.3, 0.3), (-0.05, 0.0), (-22.14, -22.1), (40, 40.0)])
@pytest.mark.parametrize("word_order", ["little", "big"])
def test_set_points_are_rounded_and_read_back(
    make_rig: Callable[..., Any], word_order: str, asked_c: float, set_c: float
) -> None:
    rig = make_rig("f4t", word_order=word_order)
    assert rig.driver.set_temperature_c(asked_c) == set_c
    assert rig.driver.read().setpoint_c == set_c
    assert rig.simulated.setpoint_c == pytest.approx(set_c, abs=1e-5)


def test_a_set_point_is_written_on_change_only(f4t: Any) -> None:
    for temperature_c in (25.0, 85.1, 85.1, 85.14, 85.1):
        f4t.driver.set_temperature_c(temperature_c)
    assert f4t.simulated.writes == [pytest.approx(85.1)]


def test_a_set_point_that_reads_back_otherwise_is_an_error(f4t: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    f4t.driver.identify()
    f4t.simulated._cells[2782] = f4t.simulated._cells[2782].__class__(
        f4t.simulated._cells[2782].get, lambda _words, _t_s: True, words=2
    )
    with pytest.raises(RequestRejected, match="40 deg C was written, but the controller reports 25 deg C"):
        f4t.driver.set_temperature_c(40.0)


def test_words_in_another_order_are_seen_at_once(make_rig: Callable[..., Any]) -> None:
    rig = make_rig("f4t", word_order="big")
    rig.driver._registers._word_order = "little"
    for value_c in (25.0, 36.6, -40.0, 85.0, 100.0):  # round numbers are denormal floats in the other order
        rig.simulated.setpoint_c = value_c
        with pytest.raises(
            MalformedReply, match=rf"exchanged the value is {value_c:g}: set word_order = 'big' in the bench"
        ):
            rig.driver._read_setpoint()
    with pytest.raises(MalformedReply, match="set word_order = 'big' in the bench file"):
        rig.driver.identify()


def test_limits_in_the_wrong_order_are_said(f4t: Any) -> None:
    f4t.simulated.min_c = f4t.simulated.max_c = 0.0
    with pytest.raises(
        MalformedReply, match=r"limits were read as 0 and 0 deg C, .* set word_order = 'big' in the bench file"
    ):
        f4t.driver.identify()


def test_the_chamber_follows(f4t: Any) -> None:
    f4t.driver.set_temperature_c(15.0)
    f4t.clock.sleep(3600)
    state = f4t.driver.read()
    assert (state.temperature_c, state.setpoint_c) == (pytest.approx(15.0, abs=0.3), 15.0)
    assert state.t_s == f4t.clock.now_s()


@pytest.mark.parametrize(("mode", "text"), [(62, "off"), (54, "manual"), (7, "7")])
def test_control_that_is_switched_off_is_left_to_the_person(f4t: Any, mode: int, text: str) -> None:
    f4t.simulated.control_mode = mode
    with pytest.raises(RequestRejected, match=f"mode {text}, not auto"):
        f4t.driver.set_temperature_c(40.0)
    f4t.simulated.setpoint_c = 80.0
    assert f4t.driver.make_safe() == 25.0
    (said,) = f4t.driver.shortcomings()
    assert f"control loop 1 is in mode {text}, not auto, so a set point would have no effect" in said


@pytest.mark.parametrize("state", [149, 146])
def test_a_profile_of_somebody_is_not_ended(f4t: Any, state: int) -> None:
    f4t.simulated.profile_state = state
    for act in (lambda: f4t.driver.set_temperature_c(40.0), f4t.driver.make_safe):
        with pytest.raises(RequestRejected, match="a profile is running or held"):
            act()
    assert f4t.simulated.profile_state == state


def test_the_way_to_safety_ends_a_profile_that_came_later(f4t: Any) -> None:
    f4t.driver.set_temperature_c(80.0)
    f4t.simulated.profile_state = 149
    assert f4t.driver.make_safe() == 25.0
    assert f4t.simulated.profile_state not in {149, 146}


def test_a_controller_without_profiles_needs_no_profile_register(f4t: Any) -> None:
    del f4t.simulated._cells[16568]
    assert f4t.driver.set_temperature_c(40.0) == 40.0


def test_alarms_are_asked_for_at_first_and_then_twice_a_minute(f4t: Any) -> None:
    assert f4t.driver.read().alarms == ()
    f4t.simulated.alarms[2] = 8
    f4t.clock.sleep(ALARMS_EVERY_S - 1)
    assert f4t.driver.read().alarms == ()
    f4t.clock.sleep(1)
    assert f4t.driver.read().alarms == ("alarm 3",)
    for quiet in (88, 61, 12):
        f4t.simulated.alarms[2] = quiet
        f4t.clock.sleep(ALARMS_EVERY_S)
        assert f4t.driver.read().alarms == ()


@pytest.mark.parametrize(
    ("kind", "error"),
    [("silence", NoReply), ("wrong_crc", MalformedReply), ("dropped_link", LinkError), ("merge", NoReply)],
)
def test_every_lasting_fault_names_the_chamber(f4t: Any, kind: Any, error: Any) -> None:
    f4t.driver.identify()
    f4t.faults.arm(kind)
    with pytest.raises(error, match=r"^chamber: "):
        f4t.driver.read()
    assert f4t.clock.now_s() < 10
    f4t.faults.clear()
    assert f4t.driver.read().setpoint_c == 25.0


@pytest.mark.parametrize("kind", ["silence", "wrong_crc", "noise", "split", "lost_reply", "dropped_link"])
def test_every_passing_fault_is_survived(f4t: Any, kind: Any) -> None:
    f4t.faults.arm(kind, count=2, value=2)
    assert f4t.driver.set_temperature_c(40.0) == 40.0
    assert f4t.simulated.setpoint_c == 40.0


def test_an_exception_of_the_controller_is_a_refusal(f4t: Any) -> None:
    f4t.driver.identify()
    f4t.faults.arm("modbus_exception", value=2, count=1)
    with pytest.raises(RequestRejected, match=r"refused to read air temperature \(register 2820\): Modbus exception 2"):
        f4t.driver.read()


@pytest.mark.parametrize(("digit", "count"), [("A", 6), ("E", 8), ("F", 14)])
def test_the_part_number_says_how_many_alarms_there_are(make_rig: Callable[..., Any], digit: str, count: int) -> None:
    rig = make_rig("f4t", simulated={"part_number": f"F4T1A1{digit}1A1A1A1A"})
    assert rig.driver.read().alarms == ()
    assert len(rig.simulated.alarms) == count
    rig.simulated.alarms[-1] = 8
    rig.clock.sleep(ALARMS_EVERY_S)
    assert rig.driver.read().alarms == (f"alarm {count}",)


@pytest.mark.parametrize(("part", "value"), [(0, 28), (1, 32), (2, 53)])
def test_a_limit_module_that_tripped_is_an_alarm(f4t: Any, part: int, value: int) -> None:
    assert f4t.driver.read().alarms == ()
    f4t.simulated.limit_module[part] = value
    f4t.clock.sleep(ALARMS_EVERY_S)
    assert f4t.driver.read().alarms == ("limit module 5",)


def test_a_cascade_loop_has_registers_of_its_own(make_rig: Callable[..., Any]) -> None:
    rig = make_rig("f4t", simulated={"part_number": "F4T1A1D1A1A6A1A"})
    assert rig.driver.set_temperature_c(40.0) == 40.0
    sent = b"".join(rig.tap.heard)
    assert bytes.fromhex("10 0FCA 0002 04") in sent  # 4042
    assert bytes.fromhex("10 0ADE") not in sent  # 2782 of control loop 1
    rig.clock.sleep(3600)
    assert rig.driver.read().temperature_c == pytest.approx(40.0, abs=0.3)
    rig.simulated.control_mode = 62
    with pytest.raises(RequestRejected, match="cascade loop 1 is in mode off, not auto"):
        rig.driver.set_temperature_c(30.0)


def test_a_chamber_that_does_not_run_is_seen_by_its_output(make_rig: Callable[..., Any]) -> None:
    rig = make_rig("f4t", run_output=(1, 1))
    assert rig.driver.read().alarms == ()
    rig.simulated.output = 62
    with pytest.raises(
        RequestRejected, match=r"does not run \(output 1 of module 1 is off\); switch it on at its panel"
    ):
        rig.driver.set_temperature_c(40.0)
    (said,) = rig.driver.shortcomings()
    assert said.startswith("the chamber does not run (output 1 of module 1 is off), so a set point would have no")


def test_control_that_a_person_switches_off_is_in_the_next_reading(make_rig: Callable[..., Any]) -> None:
    """Within one poll of 8.5 s, also between two requests of the alarms; only a person can switch it on again."""
    rig = make_rig("f4t", run_output=(1, 1))
    rig.driver.set_temperature_c(40.0)
    rig.clock.sleep(3600)
    assert (rig.driver.read().foreign, rig.driver.shortcomings()) == ((), ())
    rig.simulated.switch(rig.clock.now_s(), on=False)
    assert rig.driver.read().foreign == ("control loop 1 is in mode off, not auto",)
    rig.simulated.control_mode = 10
    assert rig.driver.read().foreign == ("the chamber does not run (output 1 of module 1 is off)",)
    with pytest.raises(RequestRejected, match="switch it on at its panel"):
        rig.driver.set_temperature_c(40.0)
    rig.clock.sleep(3600)
    assert rig.driver.read().temperature_c == pytest.approx(25.0, abs=0.5)


def test_closing_twice_is_fine(f4t: Any) -> None:
    f4t.driver.identify()
    f4t.driver.close()
    f4t.driver.close()
    assert f4t.driver.read().setpoint_c == 25.0
