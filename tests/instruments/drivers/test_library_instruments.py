"""Instruments of PyMeasure through the bytes of the bench, and of MSL-Equipment through a module in its place."""

from __future__ import annotations

import sys
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest
from pydantic import ValidationError

from instruments.bench_config import BenchFile, read_bench
from instruments.clock import VirtualClock
from instruments.drivers.library_reference import LibraryReference
from instruments.drivers.resolution import resolve
from instruments.drivers.serial_numbers import refuse_other_serial
from instruments.errors import LinkError, MalformedReply, NoReply, RequestRejected, WrongInstrument
from instruments.transport.factory import Ports
from tests.helpers.tap import Tap

URL = "sim://thermotron"
THERMOTRON = {
    "driver": "library-chamber",
    "instrument": "pymeasure.instruments.thermotron:Thermotron3800",
    "port": URL,
    "identity": "id",
    "start": "run",
    "stop": "stop",
    "program": "mode",
    "program_mask": 1,
}


@pytest.fixture
def thermotron(stand: Callable[..., Any], monkeypatch: pytest.MonkeyPatch) -> Callable[..., Any]:
    """Make a bench on which PyMeasure's class drives a simulated Thermotron that answers no command."""

    def make(**settings: Any) -> Any:
        simulation = {"chamber": {"acknowledges": False}}
        s = stand("single-axis-sim", chamber={**THERMOTRON, **settings}, simulation=simulation)
        # its class sleeps a second of real time after each command
        monkeypatch.setattr("pymeasure.instruments.thermotron.thermotron3800.sleep", s.clock.sleep)
        wire = s.bench.simulation.device(URL)
        s.state, s.driver = wire._device.chamber, s.bench.chamber
        s.tap = s.bench.simulation._devices[URL] = Tap(wire)
        return s

    return make


def test_a_chamber_of_a_library_that_was_switched_off_is_a_change_by_others(thermotron: Callable[..., Any]) -> None:
    s = thermotron(running="mode", running_mask=16)
    s.driver.set_temperature_c(85.0)
    assert s.driver.read().foreign == ()
    s.state.run(s.clock.now_s(), on=False)
    assert s.driver.read().foreign == ("the chamber does not run",)
    s.driver.set_temperature_c(85.0)
    assert (s.state.runs, s.driver.read().foreign) == (True, ())


def test_pymeasures_own_class_controls_the_chamber(thermotron: Callable[..., Any]) -> None:
    s = thermotron()
    assert s.driver.identify() == "pymeasure.instruments.thermotron:Thermotron3800 of pymeasure THERMOTRON 8800"
    s.tap.forget()
    assert s.driver.set_temperature_c(85.0) == 85.0
    assert [line for line in s.tap.heard if b"?" not in line] == [b"RUNM\r\n", b"SETP1,85\r\n", b"RUNM\r\n"]
    s.clock.sleep(3 * 3600)
    state = s.driver.read()
    assert (state.temperature_c, state.setpoint_c, state.alarms) == (pytest.approx(85.0, abs=0.3), 85.0, ())
    s.driver.close()
    s.driver.close()
    assert s.driver.make_safe() == 25.0


def test_its_program_is_refused_and_its_safe_state_may_be_off(thermotron: Callable[..., Any]) -> None:
    s = thermotron(safe_state="off")
    s.state.program = True
    with pytest.raises(RequestRejected, match="a profile is running"):
        s.driver.set_temperature_c(40.0)
    s.state.program = False
    s.driver.set_temperature_c(40.0)
    s.state.program = True
    assert s.driver.make_safe() == 25.0
    assert not s.state.runs


def test_what_the_library_refuses_is_one_line(thermotron: Callable[..., Any]) -> None:
    s = thermotron(max_c=200)
    with pytest.raises(RequestRejected, match=r"^chamber: pymeasure refused to set setpoint to 170 \(Value of 170"):
        s.driver.set_temperature_c(170.0)
    other = thermotron(temperature="temprature")
    with pytest.raises(RequestRejected, match=r"cannot read temprature: .*; correct the name in the bench file"):
        other.driver.identify()
    text = thermotron(temperature="id")
    with pytest.raises(MalformedReply, match="attribute id holds 'THERMOTRON 8800', which is not a number"):
        text.driver.identify()
    absent = thermotron(instrument="pymeasure.instruments.thermotrons:Oven")
    with pytest.raises(LinkError, match=r"Oven cannot be imported .* install pymeasure \(`pip install pymeasure`\)"):
        absent.driver.identify()


@pytest.mark.parametrize(("fault", "error"), [("silence", NoReply), ("dropped_link", LinkError)])
def test_a_silent_link_is_named_and_comes_back(thermotron: Callable[..., Any], fault: Any, error: Any) -> None:
    s = thermotron()
    s.driver.identify()
    s.faults(URL).arm(fault)
    with pytest.raises(error, match=r"^chamber: "):
        s.driver.read()
    assert s.clock.now_s() < 20
    s.faults(URL).clear()
    assert s.driver.read().setpoint_c == 25.0


def reference(ports: Any = None, clock: Any = None, **settings: Any) -> Any:
    record = read_bench("single-axis-sim").model_dump()
    record["references"] = [{"driver": "library-reference", **settings}]
    section: Any = resolve(BenchFile.model_validate(record)).references[0]
    clock = clock or VirtualClock()
    return LibraryReference(section, ports or Ports(clock), clock)


class ScriptedPort:
    """A port that answers each request with the next of its replies."""

    def __init__(self, *replies: bytes) -> None:
        self.replies, self.sent, self._unread = list(replies), [], b""

    def write(self, data: bytes) -> None:
        self.sent.append(data)
        self._unread = self.replies.pop(0)

    def read(self, size: int) -> bytes:
        found, self._unread = self._unread[:size], self._unread[size:]
        return found

    def reset_input_buffer(self) -> None:
        self._unread = b""

    def close(self) -> None:
        pass


def test_a_thermometer_of_pymeasure() -> None:
    """A Fluke 7341 as its manual (p. 81) prints it: *ver gives `ver.7341,1.00`, t gives `t: 25.0100 C`."""
    port = ScriptedPort(b"ver.7341,1.00\r\n", b"t: 25.0123 C \r\n", b"t: 25.0200 C \r\n")
    driver = reference(
        SimpleNamespace(serial=lambda *_, **__: port),
        instrument="pymeasure.instruments.fluke:Fluke7341",
        port="/dev/ttyUSB0",
        serial="A12345",  # of the readout; it does not tell its own
        certificate="NMI 1",
        corrections={"reference_c": 0.01},
    )
    said = "pymeasure.instruments.fluke:Fluke7341 of pymeasure Fluke,7341,NA,1.00"
    assert driver.identify() == f"{said}; certificate NMI 1"
    assert driver.read().raw == {"reference_c": 250200}
    assert driver.channels[0].offset == 0.01
    assert port.sent == [b"*ver\r\n", b"t\r\n", b"t\r\n"]


@pytest.mark.parametrize(
    ("instrument", "reply", "said"),
    [
        ("pymeasure.instruments.hp:HP34401A", b"HEWLETT-PACKARD,34401A,0,11-5-2\n", "HEWLETT-PACKARD,34401A,0,11-5-2"),
        ("pymeasure.instruments.hp:HP34401A", b"HEWLETT-PACKARD,34401A,X77,1\n", "HEWLETT-PACKARD,34401A,X77,1"),
        ("pymeasure.instruments.hp:HP34401A", b"", ""),
    ],
)
def test_the_identity_is_asked_by_default(instrument: str, reply: bytes, said: str) -> None:
    """By `*IDN?` of IEEE Std 488.2 where the class has that; an instrument that does not answer is used without one."""
    port = ScriptedPort(reply, b"+2.5E+01\n", *[b"+2.5E+01\n"] * 2)
    clock = VirtualClock()
    read = port.read
    port.read = lambda size: read(size) or clock.sleep(1.0) or b""  # type: ignore[method-assign]
    quantity = {"reference_c": {"attribute": "reading"}}
    given = {"instrument": instrument, "port": "/dev/ttyUSB0", "serial": "X77", "reads": quantity}
    driver = reference(SimpleNamespace(serial=lambda *_, **__: port), clock, **given)
    assert driver.identify() == f"{instrument} of pymeasure {said}".strip()
    assert driver.identify().startswith(instrument)
    asked = port.sent.count(b"*IDN?\r\n")
    assert asked == (2 if said else 1)


def test_another_serial_number_in_the_usual_identity_is_refused() -> None:
    port = ScriptedPort(b"HEWLETT-PACKARD,34401A,X78,11-5-2\n")
    given = {"instrument": "pymeasure.instruments.hp:HP34401A", "port": "/dev/ttyUSB0", "serial": "X77"}
    with pytest.raises(WrongInstrument, match="34401A,X78,11-5-2', but the bench file gives serial number 'X77'"):
        reference(SimpleNamespace(serial=lambda *_, **__: port), **given).identify()


@pytest.mark.parametrize(
    ("said", "wanted", "holds_serial", "is_right"),
    [
        ("FLUKE,1529,B77,1.0", "B77", False, True),
        ("FLUKE,1529,B779,1.0", "B77", False, False),  # the whole number, not a part of it
        ("FLUKE,1529,0,1.0", "B77", False, True),  # it has none to tell
        ("FLUKE,1529,0,1.0", "B77", True, False),
        ("Thermotron 8800 S/N 4711", "4711", True, True),
        ("Thermotron 8800 S/N 4711", "471", True, False),
        ("Thermotron 8800", "4711", False, True),
        ("FLUKE,1529,B78,1.0", "", True, True),
    ],
)
def test_serial_numbers_are_compared_in_one_way(said: str, wanted: str, *, holds_serial: bool, is_right: bool) -> None:
    if is_right:
        refuse_other_serial("reference", said, wanted, holds_serial=holds_serial)
        return
    with pytest.raises(WrongInstrument, match=f"gives serial number '{wanted}'"):
        refuse_other_serial("reference", said, wanted, holds_serial=holds_serial)


def test_no_identity_is_asked_where_the_bench_file_says_so() -> None:
    port = ScriptedPort(b"t: 25.0123 C \r\n")
    given = {"instrument": "pymeasure.instruments.fluke:Fluke7341", "port": "/dev/ttyUSB0", "identity": ""}
    assert reference(SimpleNamespace(serial=lambda *_, **__: port), **given).identify().endswith("of pymeasure")
    assert port.sent == [b"t\r\n"]


def test_instruments_of_msl_equipment(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its registry is another than PyPI: a module with the calls of its examples stands for it."""
    asked: list[Any] = []

    class Ithx:
        identity = "OMEGA iTHX-W3 4440"

        def temperature(self) -> float:
            return 21.5

        def humidity(self) -> float:
            return 44.25

        def disconnect(self) -> None:
            asked.append("disconnected")

    def connection(address: str, **properties: Any) -> Any:
        asked.append((address, properties))
        return SimpleNamespace(connect=Ithx)

    monkeypatch.setitem(sys.modules, "msl", SimpleNamespace())
    monkeypatch.setitem(sys.modules, "msl.equipment", SimpleNamespace(Connection=connection))
    settings: dict[str, Any] = {
        "library": "msl-equipment",
        "instrument": "OMEGA:iTHX-W3",
        "address": "TCP::192.168.1.100::2000",
        "serial": "4440",
        "identity": "identity",
        "arguments": {"timeout": 2},
        "reads": {
            "reference_c": {"attribute": "temperature", "resolution": 0.001},
            "humidity_pct": {"attribute": "humidity", "unit": "%", "resolution": 0.01},
        },
    }
    driver = reference(**settings)
    assert driver.identify() == "OMEGA:iTHX-W3 of msl-equipment OMEGA iTHX-W3 4440"
    assert driver.read().raw == {"reference_c": 21500, "humidity_pct": 4425}
    driver.close()
    properties = {"manufacturer": "OMEGA", "model": "iTHX-W3", "serial": "4440", "timeout": 2}
    assert asked == [("TCP::192.168.1.100::2000", properties), "disconnected"]
    with pytest.raises(WrongInstrument, match="gives serial number '4441'"):
        reference(**settings | {"serial": "4441"}).identify()


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        ({"instrument": "pymeasure.instruments.fluke:Fluke7341"}, "give either port"),
        ({"instrument": "Fluke7341", "port": "/dev/ttyUSB0"}, "String should match pattern"),
        ({"library": "msl-equipment", "instrument": "OMEGA:iTHX-W3"}, "key address is missing"),
    ],
)
def test_wrong_settings_are_refused(settings: dict[str, Any], text: str) -> None:
    with pytest.raises(ValidationError, match=text):
        reference(**settings)
