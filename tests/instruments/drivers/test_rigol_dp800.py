"""A Rigol DP800 through its bytes: golden requests, limits, read-back, protections, faults, the bench file."""

from __future__ import annotations

from typing import Any

import pytest
from pydantic import ValidationError

from instruments.bench import open_bench
from instruments.bench_config import BenchFile, read_bench
from instruments.checks.check import ask_supply, check
from instruments.checks.findings import DeviceReport
from instruments.clock import VirtualClock
from instruments.errors import LimitError, MalformedReply, NoReply, RequestRejected, WrongInstrument
from instruments.protocols import rigol_dp800 as dp800
from tests.helpers.supplied_bench import SUPPLY, SUPPLY_URL, with_supply
from tests.helpers.tap import Tap


class Opened:
    """A driver of a simulated DP800, with a tap on its wire."""

    def __init__(self, **settings: Any) -> None:
        self.clock = VirtualClock()
        self.file = with_supply(read_bench("single-axis-sim"), **settings)
        self.bench = open_bench(self.file, self.clock)
        simulation: Any = self.bench.simulation
        wire = simulation.device(SUPPLY_URL)
        self.tap = simulation._devices[SUPPLY_URL] = Tap(wire)
        self.simulated, self.world = wire._device, simulation.world
        self.faults = simulation.faults(SUPPLY_URL)
        self.driver: Any = self.bench.supply

    def measured_v(self) -> float:
        self.clock.sleep(1.0)
        return self.driver.read().raw["supply_v"] * 1e-4


def test_a_voltage_is_set_with_its_limits_and_read_back_byte_by_byte() -> None:
    opened = Opened()
    opened.driver.identify()
    opened.tap.forget()
    assert opened.driver.set_voltage_v(5.25) == 5.25
    assert opened.tap.heard == [
        b":SYST:ERR?\n", b":APPL CH1,5.250,1.000\n", b":SYST:ERR?\n", b":OUTP:OVP:VAL CH1,5.78\n", b":SYST:ERR?\n",
        b":OUTP:OVP CH1,ON\n", b":SYST:ERR?\n", b":APPL? CH1\n", b":OUTP? CH1\n",
    ]  # fmt: skip
    assert opened.tap.said[-2:] == [b"CH1:30V/3A,5.250,1.000\n", b"ON\n"]
    assert opened.measured_v() == pytest.approx(5.25, abs=0.002)
    assert opened.world.supply.volts(opened.clock.now_s()) == pytest.approx(5.25)


@pytest.mark.parametrize("wrong_v", [4.49, 5.51, 0.0, -5.0, 12.0])
def test_a_voltage_outside_of_the_limits_is_refused_before_a_byte_is_sent(wrong_v: float) -> None:
    opened = Opened()
    with pytest.raises(LimitError, match=r"outside the 4\.5 to 5\.5 V of the supply; nothing was sent: ask for"):
        opened.driver.set_voltage_v(wrong_v)
    assert opened.tap.heard == []


def test_a_channel_that_cannot_give_what_the_bench_file_says_is_refused() -> None:
    with pytest.raises(WrongInstrument, match=r"channel 3 of a DP832A gives at most 5\.3 V and 3\.2 A; correct them"):
        Opened(channel=3).driver.identify()
    with pytest.raises(WrongInstrument, match=r"current_limit_a = 4 A .* at most 32 V and 3\.2 A"):
        Opened(current_limit_a=4.0).driver.identify()
    opened = Opened(serial="DP8Z")
    opened.driver.identify()
    opened.simulated.serial = "DP8A000000009"
    with pytest.raises(WrongInstrument, match="bench file gives serial number 'DP8Z'"):
        opened.driver.identify()


def test_another_model_is_another_instrument() -> None:
    opened = Opened()
    opened.simulated.model = "DP811A"
    opened.simulated._channel = 1
    with pytest.raises(WrongInstrument, match="this driver drives channels of DP831, DP831A"):
        opened.driver.identify()


def test_an_error_of_an_earlier_command_is_not_that_of_this_one_but_a_refusal_is() -> None:
    opened = Opened()
    opened.simulated._errors.extend(['-113,"Undefined header"'] * 3)
    assert opened.driver.set_voltage_v(5.1) == 5.1
    opened.faults.arm("refusal", count=1)
    with pytest.raises(RequestRejected, match=r"refused to set 5\.2 V: error -222 'Data out of range' after ':APPL"):
        opened.driver.set_voltage_v(5.2)
    assert opened.measured_v() == pytest.approx(5.1, abs=0.002)


def test_a_set_point_without_effect_is_found_by_its_read_back() -> None:
    opened = Opened()
    opened.faults.arm("stall", count=1)
    with pytest.raises(RequestRejected, match=r"5\.2 V and at most 1 A were set, but it reports 5 V and 1 A; unlock"):
        opened.driver.set_voltage_v(5.2)


def test_an_output_that_is_off_is_switched_on_and_one_whose_protection_trips_is_reported() -> None:
    opened = Opened()
    opened.driver.switch_off()
    assert not opened.driver.is_on()
    assert opened.measured_v() == pytest.approx(0.0, abs=0.002)  # nothing is demanded of an output that is off
    opened.driver.set_voltage_v(5.0)
    assert opened.driver.is_on()
    assert opened.measured_v() == pytest.approx(5.0, abs=0.002)
    opened.simulated.turn_knob(opened.clock.now_s(), 7.0)  # beyond the overvoltage protection of 5.78 V
    with pytest.raises(RequestRejected, match=r"instead of 5 V, limit 0\.05 V off: its overvoltage protection has"):
        opened.measured_v()


def test_a_voltage_that_others_change_or_the_load_pulls_down_is_reported_once_it_had_arrived() -> None:
    opened = Opened()
    opened.driver.set_voltage_v(5.0)
    opened.measured_v()
    opened.simulated.turn_knob(opened.clock.now_s(), 5.2)
    with pytest.raises(RequestRejected, match=r"at 5\.2\d* V instead of 5 V, limit 0\.05 V off: it controls the"):
        opened.measured_v()
    opened.driver.set_voltage_v(5.0)
    opened.measured_v()
    opened.simulated.load_a = 1.5
    opened.simulated.turn_knob(opened.clock.now_s(), 5.0)
    with pytest.raises(RequestRejected, match=r"instead of 5 V, limit 0\.05 V off: it limits the current; check load"):
        opened.measured_v()


def test_on_its_way_to_a_voltage_it_is_no_fault() -> None:
    opened = Opened()
    opened.driver.set_voltage_v(5.0)
    opened.measured_v()
    opened.driver.set_voltage_v(5.5)
    assert opened.driver.read().raw["supply_v"] > 0  # whatever is measured now
    assert opened.measured_v() == pytest.approx(5.5, abs=0.002)


def test_the_safe_state_is_the_nominal_voltage_and_switches_nothing_on() -> None:
    opened = Opened()
    opened.driver.set_voltage_v(5.5)
    assert opened.driver.make_safe() == 5.0
    assert opened.driver.is_on()
    assert opened.measured_v() == pytest.approx(5.0, abs=0.002)
    opened.driver.switch_off()
    assert opened.driver.make_safe() == 5.0
    assert not opened.driver.is_on()


def test_the_safe_state_is_off_where_the_bench_file_says_so() -> None:
    opened = Opened(safe_state="off")
    opened.driver.set_voltage_v(5.5)
    assert opened.driver.make_safe() == 0.0
    assert not opened.driver.is_on()


def test_switched_off_it_takes_the_power_of_the_units_and_gives_it_back() -> None:
    opened = Opened()
    opened.bench.unit_handler.power(on=True)
    opened.driver.switch_off()
    assert opened.world.powered_on_s is None
    opened.driver.set_voltage_v(5.0)
    assert opened.world.powered_on_s is not None


def test_silence_and_nonsense_are_said_in_one_line() -> None:
    opened = Opened()
    opened.faults.arm("silence", count=None)
    with pytest.raises(NoReply, match=r"supply: no answer to the request to say what errors it holds .* \(3 tries"):
        opened.driver.set_voltage_v(5.0)
    opened.faults.clear()
    opened.simulated.answer = lambda request, t_s: "garbage"
    with pytest.raises(MalformedReply, match=r"supply: answered 'garbage' to the request to measure its voltage"):
        opened.driver.read()
    opened.faults.clear()


def test_one_lost_reply_is_asked_for_again() -> None:
    opened = Opened()
    opened.driver.identify()
    opened.faults.arm("lost_reply", count=1)
    assert opened.driver.set_voltage_v(4.75) == 4.75


def test_the_check_of_a_bench_says_what_the_supply_gives_and_switches_nothing() -> None:
    opened = Opened()
    (report,) = [each for each in check(opened.file, opened.clock) if each.device == "supply"]
    assert (report.kind, report.state) == ("supply", "good")
    assert "4.5 to 5.5 V, at most 1 A" in report.text
    opened.simulated.on = False
    off = DeviceReport("supply", "supply", SUPPLY_URL)
    ask_supply(opened.driver, off)
    assert (off.state, off.findings[-1].what) == ("doubtful", "output")
    assert not opened.simulated.on
    opened.faults.arm("silence")
    silent = DeviceReport("supply", "supply", SUPPLY_URL)
    ask_supply(opened.driver, silent)
    assert silent.state == "bad"


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"nominal_v": 6.0}, r"nominal_v = 6 V must lie between min_v = 4\.5 and max_v = 5\.5 V; correct it"),
        ({"port": "/dev/ttyUSB9"}, r"give either port \(a serial port\), or host with tcp_port"),
        ({"current_limit_a": 0.0}, "greater than 0"),
        ({"column": "voltage"}, "should match pattern"),
        ({"colour": "red"}, "driver rigol-dp800 has no such setting"),
    ],
)
def test_a_section_that_says_nonsense_is_refused(settings: dict[str, Any], said: str) -> None:
    with pytest.raises(ValidationError, match=said):
        open_bench(with_supply(read_bench("single-axis-sim"), **settings), VirtualClock())


def test_without_the_section_a_bench_has_no_supply() -> None:
    bench = read_bench("single-axis-sim")
    assert bench.supply is None
    assert "supply" not in bench.sections
    assert open_bench(bench, VirtualClock()).supply is None
    assert BenchFile.model_validate(with_supply(bench).model_dump()).sections["supply"].driver == SUPPLY["driver"]


@pytest.mark.parametrize(
    ("register", "text"),
    [(4, "overvoltage"), (8, "overcurrent"), (1, "limits the current"), (2, "controls the voltage"), (3, "off or"),
     (0, "off or")],
)  # fmt: skip
def test_what_the_summary_register_says(register: int, text: str) -> None:
    assert text in dp800.why_off(register)


def test_models_and_replies_of_the_manual() -> None:
    assert dp800.model_in("RIGOL TECHNOLOGIES,DP832A,DP8A1234567,00.01.16") == "DP832A"
    assert dp800.model_in("KEYSIGHT,E36312A,MY1,1.0") == ""
    assert (dp800.resolution_v("DP832A"), dp800.resolution_v("DP832")) == (0.001, 0.01)
    assert dp800.MODELS["DP821"][1].max_v == 63.0
    assert 3 not in dp800.MODELS["DP831A"]  # a negative voltage
