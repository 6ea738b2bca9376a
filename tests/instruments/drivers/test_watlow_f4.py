"""The F4 through its bytes: units, limits, rounding, care for its EEPROM, and no running profile ended."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from instruments.errors import LimitError, LinkError, MalformedReply, NoReply, RequestRejected, WrongInstrument
from instruments.interfaces.chamber import ChamberLimits

pytest_plugins = ["tests.helpers.modbus_rig"]

TERMINATE_FRAME = bytes.fromhex("01 06 04C1 0001")  # register 1217


def sent(rig: Any) -> bytes:
    return b"".join(rig.tap.heard)


def test_making_the_driver_sends_nothing(f4: Any) -> None:
    assert f4.tap.heard == []
    assert f4.ports.opened == []
    assert (f4.driver.name, f4.driver.safe_c) == ("chamber", 25)


def test_identify_states_the_resolution(f4: Any) -> None:
    assert f4.driver.identify() == "Watlow F4, steps of 0.1 deg C"


@pytest.mark.parametrize(
    ("attribute", "value", "text"),
    [
        ("model", 9600, "model register reads 9600 instead of 5270"),
        ("scale", 0, "works in degrees Fahrenheit"),
        ("units", 1, "does not measure a temperature"),
    ],
)
def test_another_controller_or_fahrenheit_is_refused(f4: Any, attribute: str, value: int, text: str) -> None:
    setattr(f4.simulated, attribute, value)
    with pytest.raises(WrongInstrument, match=f"chamber: .*{text}"):
        f4.driver.identify()


def test_the_narrower_limits_count(make_rig: Callable[..., Any]) -> None:
    rig = make_rig("f4", min_c=-60, max_c=100)
    rig.simulated.min_c, rig.simulated.max_c = -55.5, 180.0
    assert rig.driver.limits == ChamberLimits(-55.5, 100.0, 0.1, 1.67)


@pytest.mark.parametrize("temperature_c", [-40.1, 120.1, 1e6, float("nan"), float("inf")])
def test_a_set_point_beyond_the_limits_is_not_sent(f4: Any, temperature_c: float) -> None:
    with pytest.raises(
        LimitError, match=r"chamber: set point .* outside the limits, -40 to 120 deg C .*nothing was written"
    ):
        f4.driver.set_temperature_c(temperature_c)
    assert f4.simulated.writes == []


@pytest.mark.parametrize("temperature_c", [-40.0, 120.0])
def test_the_limits_themselves_are_allowed(f4: Any, temperature_c: float) -> None:
    assert f4.driver.set_temperature_c(temperature_c) == temperature_c


@pytest.mark.parametrize(
    ("decimals", "asked_c", "counts"),
    [(1, 85.1, 851), (1, 0.3, 3), (1, -0.05, 0), (1, -22.1, -221), (1, 24.94, 249), (0, 84.6, 85), (2, 85.13, 8513)],
)
def test_set_points_are_rounded_to_counts_not_cut(f4: Any, decimals: int, asked_c: float, counts: int) -> None:
    f4.simulated.decimals = decimals
    assert f4.driver.set_temperature_c(asked_c) == counts / 10**decimals
    assert f4.simulated.setpoint == counts
    assert f4.simulated.writes == [counts]


def test_three_decimals_are_ten_to_the_third(f4: Any) -> None:
    """A public library multiplies by ten per decimal; two decimals would come out as 20 instead of 100."""
    f4.simulated.decimals, f4.simulated.sensor_code = 3, 25123
    f4.simulated.min_c, f4.simulated.max_c = -30.0, 30.0
    assert f4.driver.read().temperature_c == pytest.approx(25.123, abs=1e-12)
    assert f4.driver.limits.resolution_c == pytest.approx(0.001)


def test_a_set_point_is_written_on_change_only(f4: Any) -> None:
    for temperature_c in (40.0, 40.0, 40.04, 39.96, 40.0):
        assert f4.driver.set_temperature_c(temperature_c) == 40.0
    assert f4.simulated.writes == [400]


def test_not_even_the_first_write_without_a_change(f4: Any) -> None:
    f4.simulated.setpoint = 400
    assert f4.driver.set_temperature_c(40.0) == 40.0
    assert f4.simulated.writes == []


def test_what_somebody_changed_at_the_panel_is_set_again(f4: Any) -> None:
    f4.driver.set_temperature_c(40.0)
    f4.simulated.setpoint = 300
    assert f4.driver.set_temperature_c(40.0) == 40.0
    assert f4.simulated.writes == [400, 400]


def test_a_set_point_that_reads_back_otherwise_is_an_error(f4: Any) -> None:
    f4.simulated.on_run_page = False
    with pytest.raises(RequestRejected, match=r"40 deg C was written, but .*reports 25 deg C; .*run page"):
        f4.driver.set_temperature_c(40.0)


def test_the_chamber_follows(f4: Any) -> None:
    f4.driver.set_temperature_c(35.0)
    f4.clock.sleep(3600)
    state = f4.driver.read()
    assert state.temperature_c == pytest.approx(35.0, abs=0.3)
    assert state.setpoint_c == 35.0
    assert 3600 < state.t_s < 3602


@pytest.mark.parametrize("code", [-32000, -32001, -32002, -32768])
def test_a_code_in_place_of_a_measurement_is_no_temperature(f4: Any, code: int) -> None:
    f4.simulated.sensor_code = code
    with pytest.raises(MalformedReply, match=rf"air temperature \(register 100\) reads {code} counts"):
        f4.driver.read()


def test_requests_keep_thirty_milliseconds_distance(f4: Any) -> None:
    f4.driver.identify()
    f4.driver.set_temperature_c(40.0)
    f4.driver.read()
    gaps = [b - a for a, b in zip(f4.tap.heard_s, f4.tap.heard_s[1:], strict=False)]
    assert len(gaps) > 10
    assert min(gaps) >= 0.03 - 1e-9


@pytest.mark.parametrize("mode", [2, 3])
def test_a_profile_of_somebody_is_not_ended(f4: Any, mode: int) -> None:
    f4.simulated.mode = mode
    f4.simulated.setpoint = 400
    for act in (lambda: f4.driver.set_temperature_c(40.0), f4.driver.make_safe):
        with pytest.raises(RequestRejected, match="a profile is running or held"):
            act()
    assert f4.simulated.mode == mode
    assert TERMINATE_FRAME not in sent(f4)


def test_what_others_change_at_the_panel_is_in_the_next_reading(f4: Any) -> None:
    f4.simulated.mode = 2
    assert f4.driver.read().foreign == ()  # labctl has not given a set point
    f4.simulated.mode = 0
    f4.driver.set_temperature_c(40.0)
    assert f4.driver.read().foreign == ()
    f4.simulated.setpoint = 470
    assert f4.driver.read().foreign == ("the set point is 47 deg C, labctl gave 40 deg C",)
    f4.simulated.setpoint, f4.simulated.mode = 400, 2
    f4.clock.sleep(8.5)  # until the next poll of a campaign
    (said,) = f4.driver.read().foreign
    assert said.startswith("a profile is running or held on the controller")


def test_the_way_to_safety_ends_a_profile_that_came_later(f4: Any) -> None:
    f4.driver.set_temperature_c(80.0)
    f4.simulated.mode = 2
    assert f4.driver.make_safe() == 25.0
    assert TERMINATE_FRAME in sent(f4)
    assert (f4.simulated.mode, f4.simulated.setpoint) == (0, 250)


def test_safe_again_after_a_restart(f4: Any) -> None:
    f4.driver.set_temperature_c(80.0)
    f4.driver.close()
    assert f4.make_driver().make_safe() == 25.0
    assert f4.simulated.setpoint == 250


def test_alarms_come_from_the_inputs_that_are_wired(make_rig: Callable[..., Any]) -> None:
    rig = make_rig("f4", alarm_inputs=(1, 3))
    assert rig.driver.read().alarms == ()
    rig.simulated.inputs[0] = rig.simulated.inputs[1] = rig.simulated.inputs[2] = 1
    rig.simulated.active_states[2] = 0
    assert rig.driver.read().alarms == ("digital input 1",)
    rig.simulated.inputs[2] = 0
    assert rig.driver.read().alarms == ("digital input 1", "digital input 3")


def test_an_input_that_profiles_wait_for_is_no_alarm(make_rig: Callable[..., Any]) -> None:
    rig = make_rig("f4", alarm_inputs=(2,))
    rig.simulated.input_functions[1] = 10
    with pytest.raises(WrongInstrument, match="digital input 2 as the wait-for input of a profile"):
        rig.driver.identify()


@pytest.mark.parametrize(
    ("offset", "value", "text"),
    [(0, 3, "error 3 of input 1"), (1, 1, "alarm 1 high"), (1, 2, "alarm 1 low"), (5, 1, "alarm 2 high")],
)
def test_alarms_come_with_the_air_where_the_controller_has_them(
    make_rig: Callable[..., Any], offset: int, value: int, text: str
) -> None:
    rig = make_rig("f4")
    assert rig.driver.read().alarms == ()
    rig.simulated.alarm_words[offset] = value
    assert rig.driver.read().alarms == (text,)
    quiet = make_rig("f4", alarm_registers=False)
    quiet.simulated.alarm_words[offset] = value
    assert quiet.driver.read().alarms == ()


@pytest.mark.parametrize(("there", "counts"), [(range(101, 103), "0003"), ((), "0001")])
def test_a_controller_without_alarm_registers_is_read_without_them(f4: Any, there: Any, counts: str) -> None:
    for number in range(101, 107):
        if number not in there:
            del f4.simulated._cells[number]
    f4.simulated.alarm_words[1] = 1
    state = f4.driver.read()
    assert state.temperature_c == pytest.approx(25.0, abs=0.2)
    assert state.alarms == (("alarm 1 high",) if there else ())
    f4.tap.forget()
    f4.driver.read()
    assert [frame[4:6].hex() for frame in f4.tap.heard if frame[2:4] == b"\x00\x64"] == [counts]  # known from then on


def test_codes_of_absent_registers_are_no_alarms(f4: Any) -> None:
    f4.simulated.alarm_words[:] = [-32000] * 6
    assert f4.driver.read().alarms == ()


def test_air_set_point_and_mode_have_replies_of_their_own_length(f4: Any) -> None:
    """A late reply to one of them does not fit another."""
    f4.driver.set_temperature_c(40.0)
    f4.driver.read()
    lengths = {request[2:4]: len(reply) for request, reply in f4.tap.exchanges() if request[1] == 3}
    assert len({lengths[number.to_bytes(2, "big")] for number in (100, 200, 300)}) == 3


@pytest.mark.parametrize("absent", [None, 0, -32000])
def test_an_f4p_in_manual_mode_runs_no_profile(f4: Any, absent: int | None) -> None:
    """Mode 2 is a running profile on an F4, manual on its sister model F4P, which has no profiles."""
    del f4.simulated._cells[4100]
    f4.simulated.absent, f4.simulated.mode = absent, 2
    for act in (lambda: f4.driver.set_temperature_c(40.0), f4.driver.make_safe):
        with pytest.raises(RequestRejected, match=r"is in manual mode, .* set the controller to auto at its panel"):
            act()
    assert TERMINATE_FRAME not in sent(f4)
    f4.simulated.mode = 1
    assert f4.driver.set_temperature_c(40.0) == 40.0


def test_the_event_that_switches_the_chamber(make_rig: Callable[..., Any]) -> None:
    rig = make_rig("f4", enable_event=3)
    rig.driver.make_safe()
    assert rig.simulated.events[2] == 0  # the way to safety switches nothing on
    rig.driver.set_temperature_c(40.0)
    assert rig.simulated.events == [1] * 8
    rig.tap.forget()
    rig.driver.set_temperature_c(41.0)
    assert bytes.fromhex("01 06 07E4") not in sent(rig)  # it is on: not written again


def test_the_event_that_a_person_switches_off_is_in_the_next_reading(make_rig: Callable[..., Any]) -> None:
    rig = make_rig("f4", enable_event=1)
    assert rig.driver.read().foreign == ()  # labctl has not switched it on
    rig.driver.set_temperature_c(40.0)
    rig.clock.sleep(3600)
    assert (rig.driver.read().temperature_c, rig.driver.read().foreign) == (pytest.approx(40.0, abs=0.3), ())
    rig.simulated.switch(1, rig.clock.now_s(), on=False)
    assert rig.driver.read().foreign == ("event output 1 (register 2000) is off",)
    rig.clock.sleep(3600)
    assert rig.driver.read().temperature_c == pytest.approx(25.0, abs=0.5)
    assert rig.driver.set_temperature_c(40.0) == 40.0
    assert (rig.simulated.events[0], rig.driver.read().foreign) == (1, ())
    assert rig.simulated.writes == [400]  # the set point was as it was: its memory is spared


def test_an_event_that_stays_off_is_refused(make_rig: Callable[..., Any]) -> None:
    rig = make_rig("f4", enable_event=1)
    rig.simulated.switch = lambda *_a, **_k: None
    with pytest.raises(RequestRejected, match=r"event output 1 \(register 2000\) stays off, .* check enable_event"):
        rig.driver.set_temperature_c(40.0)
    assert rig.simulated.writes == []


def test_a_controller_that_knows_function_16_only(f4: Any) -> None:
    f4.simulated.functions = frozenset({3, 16})
    assert f4.driver.set_temperature_c(40.0) == 40.0
    assert f4.driver.set_temperature_c(41.0) == 41.0
    assert sent(f4).count(bytes.fromhex("01 06 012C")) == 1  # tried once


def test_the_address_of_the_bench_file_goes_on_the_wire(make_rig: Callable[..., Any]) -> None:
    rig = make_rig("f4", address=201)
    assert rig.driver.identify().startswith("Watlow F4")
    assert all(frame[0] == 201 for frame in rig.tap.heard)


@pytest.mark.parametrize(
    ("kind", "error"),
    [("silence", NoReply), ("wrong_crc", MalformedReply), ("dropped_link", LinkError), ("merge", NoReply)],
)
def test_every_lasting_fault_names_the_chamber(f4: Any, kind: Any, error: Any) -> None:
    f4.driver.identify()
    f4.faults.arm(kind)
    begun_s = f4.clock.now_s()
    with pytest.raises(error, match=r"^chamber: "):
        f4.driver.read()
    assert f4.clock.now_s() - begun_s < 10
    f4.faults.clear()
    assert f4.driver.read().setpoint_c == 25.0


@pytest.mark.parametrize("kind", ["silence", "wrong_crc", "noise", "split", "lost_reply", "dropped_link"])
def test_every_passing_fault_is_survived(f4: Any, kind: Any) -> None:
    f4.faults.arm(kind, count=2, value=2)
    assert f4.driver.set_temperature_c(40.0) == 40.0
    assert f4.simulated.setpoint == 400


def test_an_exception_of_the_controller_is_a_refusal(f4: Any) -> None:
    f4.driver.identify()
    f4.faults.arm("modbus_exception", value=4, count=1)
    with pytest.raises(RequestRejected, match=r"refused to read air temperature \(register 100\): Modbus exception 4"):
        f4.driver.read()


def test_closing_twice_is_fine(f4: Any) -> None:
    f4.driver.identify()
    f4.driver.close()
    f4.driver.close()
    assert f4.driver.read().setpoint_c == 25.0
