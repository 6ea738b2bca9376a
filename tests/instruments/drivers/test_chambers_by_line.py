"""Chambers that speak lines of text, and Binder's registers, through their bytes: golden bytes, refusals, safety.

Golden bytes: ChamberConnectLibrary 1d2deb8 (p300.py, especinteract.py), ClimateChamberMonitor 858ca67 and basil 85c4116
(SimServ, Binder), the description that a VC3 7060 sends of its ASCII-2, Thermotron's Interface Command Descriptions.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import pytest
from pydantic import ValidationError

from instruments.bench_config import BenchFile, read_bench
from instruments.drivers.resolution import resolve
from instruments.errors import LimitError, LinkError, MalformedReply, NoReply, RequestRejected
from instruments.protocols.text_lines import weiss_ascii2
from tests.helpers.tap import Tap

LINES = ("espec", "weiss-simserv", "weiss-ascii2", "thermotron")
ALL = (*LINES, "binder")
#: Driver -> what is sent to set 85 deg C while the chamber is off, without what is only read.
SETTING = {
    "espec": [b"MODE,CONSTANT\r\n", b"TEMP, S85.0\r\n"],
    "weiss-simserv": [b"14001\xb61\xb61\xb61\r", b"11001\xb61\xb61\xb685.0\r"],
    "weiss-ascii2": [
        b"$01E 0025.0 0000.0 0090.0 0000.0 0000.0 0000.0 0000.0 01000000000000000000000000000000\r",
        b"$01E 0085.0 0000.0 0090.0 0000.0 0000.0 0000.0 0000.0 01000000000000000000000000000000\r",
    ],
    "thermotron": [b"RUNM\r\n", b"SETP1,85.0\r\n"],
    "binder": [bytes.fromhex("0110 1581 0002 04 0000 42aa"), bytes.fromhex("0110 156f 0002 04 0000 42aa")],
}
READS = (b"?", b"I\r", b"11002", b"11004", b"11007", b"11009", b"14003", b"19210", b"10012")


@pytest.fixture
def chamber(stand: Callable[..., Any]) -> Callable[..., Any]:
    """Make a bench with a chamber of a driver, and a tap on its wire."""

    def make(driver: str, simulated: dict[str, Any] | None = None, **settings: Any) -> Any:
        url = f"sim://{driver}"
        if driver == "binder":
            settings = {"controller": "mk53", **settings}
        s = stand("single-axis-sim", chamber={"driver": driver, "port": url, **settings}, **(simulated or {}))
        wire = s.bench.simulation.device(url)
        s.simulated = wire._device
        s.state = s.simulated.chamber
        s.tap = s.bench.simulation._devices[url] = Tap(wire)
        s.driver, s.wire_faults = s.bench.chamber, s.faults(url)
        return s

    return make


def commands(heard: list[bytes], driver: str) -> list[bytes]:
    if driver == "binder":
        return [frame[:-2] for frame in heard if frame[1] == 16]
    return [line for line in heard if not any(each in line for each in READS)]


@pytest.mark.parametrize("driver", ALL)
def test_a_set_point_by_its_bytes(chamber: Callable[..., Any], driver: str) -> None:
    s = chamber(driver)
    assert s.driver.set_temperature_c(85.04) == 85.0
    assert commands(s.tap.heard, driver) == SETTING[driver]
    s.tap.forget()
    s.driver.set_temperature_c(85.0)
    assert commands(s.tap.heard, driver) == []  # written on change only
    s.clock.sleep(3 * 3600)
    state = s.driver.read()
    assert (state.temperature_c, state.setpoint_c, state.alarms) == (pytest.approx(85.0, abs=0.3), 85.0, ())


@pytest.mark.parametrize(
    ("driver", "request_", "reply"),
    [
        ("espec", b"TEMP?\r\n", b"25.0,25.0,120.0,-40.0\r\n"),
        ("espec", b"MODE?\r\n", b"STANDBY\r\n"),
        ("espec", b"ALARM?\r\n", b"0\r\n"),
        ("weiss-simserv", b"11002\xb61\xb61\r", b"1\xb625.0\r\n"),
        ("weiss-simserv", b"99997\xb61\xb61\r", b"1\xb6LabEvent T/210/70/5\r\n"),
        (
            "weiss-ascii2",
            b"$01I\r",
            b"0025.0 0025.0 0000.0 0000.0 0090.0 0090.0 0000.0 0023.8 0000.0 0022.2 0000.0 0025.5 0000.0 0024.4 %032d\r"
            % 0,
        ),
        ("thermotron", b"SETP1?\r\n", b"25.0\r\n"),
        ("thermotron", b"ALRM1?\r\n", b"0\r\n"),
        ("binder", bytes.fromhex("0103 1077 0002"), bytes.fromhex("010304 0000 41c8")),
    ],
)
def test_requests_and_replies(chamber: Callable[..., Any], driver: str, request_: bytes, reply: bytes) -> None:
    s = chamber(driver)
    s.driver.identify()
    s.driver.read()
    s.driver._profile_runs()
    cut = -2 if driver == "binder" else None
    said = dict(zip((each[:cut] for each in s.tap.heard), (each[:cut] for each in s.tap.said), strict=True))
    assert said[request_] == reply


def test_ascii2_numbers_and_the_line_that_its_maker_prints() -> None:
    assert [weiss_ascii2.number(c) for c in (50, -40, 0, -0.04, 123.4)] == [
        "0050.0", "-040.0", "0000.0", "-000.0", "0123.4",
    ]  # fmt: skip
    printed = (
        "0050.0 0024.6 0080.0 0066.7 0090.0 0090.0 0000.0 0023.8 0000.0 0022.2 0000.0 0025.5 0000.0 0024.4 "
        "01100000000000000000000000000000"
    )
    match = re.fullmatch(weiss_ascii2.STATUS, printed)
    assert match is not None
    status = weiss_ascii2.parse(match)
    assert (status.nominal[:2], status.actual[:2]) == ((50.0, 80.0), (24.6, 66.7))
    assert [status.is_on(n) for n in range(4)] == [False, True, True, False]
    assert status.commanded(-40.0, 1, on=True) == (
        "-040.0 0080.0 0090.0 0000.0 0000.0 0000.0 0000.0 01100000000000000000000000000000"
    )


@pytest.mark.parametrize(
    ("driver", "text"),
    [
        ("espec", "a profile is running"),
        ("weiss-simserv", "a profile is running"),
        ("thermotron", "a profile is running"),
    ],
)
def test_a_program_of_somebody_is_refused_and_not_ended(chamber: Callable[..., Any], driver: str, text: str) -> None:
    s = chamber(driver)
    s.state.program = True
    for act in (lambda: s.driver.set_temperature_c(40.0), s.driver.make_safe):
        with pytest.raises(RequestRejected, match=text):
            act()
    assert s.state.program
    assert commands(s.tap.heard, driver) == []


@pytest.mark.parametrize("driver", ["espec", "weiss-simserv", "thermotron"])
def test_the_way_to_safety_ends_a_program_that_came_later(chamber: Callable[..., Any], driver: str) -> None:
    s = chamber(driver)
    s.driver.set_temperature_c(80.0)
    s.state.program = True
    assert s.driver.make_safe() == 25.0
    assert not s.state.program
    assert s.state.setpoint_c == 25.0


def test_a_binder_that_runs_a_program_or_is_idle(chamber: Callable[..., Any]) -> None:
    s = chamber("binder")
    s.simulated.mode = 0x0400
    with pytest.raises(RequestRejected, match="a profile is running or held"):
        s.driver.set_temperature_c(40.0)
    s.simulated.mode = 0
    with pytest.raises(RequestRejected, match=r"idle .* switch it on at its panel"):
        s.driver.set_temperature_c(40.0)
    other = chamber("binder", controller="mk56")
    assert other.driver.set_temperature_c(40.0) == 40.0
    assert other.tap.heard[-2][:6] == bytes.fromhex("0110 114c 0002")


@pytest.mark.parametrize("driver", ALL)
def test_the_safe_state_is_the_safe_set_point(chamber: Callable[..., Any], driver: str) -> None:
    s = chamber(driver)
    s.driver.set_temperature_c(80.0)
    assert s.driver.make_safe() == 25.0
    assert s.state.runs
    assert s.driver.read().alarms == ()


@pytest.mark.parametrize("driver", LINES)
def test_the_safe_state_may_be_off(chamber: Callable[..., Any], driver: str) -> None:
    s = chamber(driver, safe_state="off")
    s.driver.set_temperature_c(80.0)
    assert s.driver.make_safe() == 25.0
    assert not s.state.runs
    assert s.driver.read().alarms == ()
    assert s.driver.set_temperature_c(30.0) == 30.0
    assert s.state.runs


@pytest.mark.parametrize("driver", LINES)
def test_a_chamber_that_was_switched_off_is_a_change_by_others(chamber: Callable[..., Any], driver: str) -> None:
    s = chamber(driver)
    assert s.driver.read().foreign == ()  # before the first set point it may be off
    s.driver.set_temperature_c(80.0)
    s.state.run(s.clock.now_s(), on=False)
    (said,) = s.driver.read().foreign
    assert said.startswith("the chamber does not run")
    s.driver.set_temperature_c(80.0)
    assert s.state.runs
    assert s.driver.read().foreign == ()


def test_a_binder_that_was_switched_off_is_left_to_the_person(chamber: Callable[..., Any]) -> None:
    s = chamber("binder", controller="mk53")
    s.driver.set_temperature_c(80.0)
    s.simulated.mode = 0
    assert s.driver.read().foreign == ("the controller is idle (mode neither manual nor basic)",)
    with pytest.raises(RequestRejected, match=r"is idle .*; switch it on at its panel"):
        s.driver.set_temperature_c(80.0)


@pytest.mark.parametrize(
    ("driver", "alarms", "texts"),
    [
        ("espec", [7, 21], ("alarm 7", "alarm 21")),
        ("weiss-simserv", [1], ("the controller reports an alarm",)),
        ("thermotron", [1, 32], ("low deviation alarm", "high process alarm")),
    ],
)
def test_alarms(chamber: Callable[..., Any], driver: str, alarms: list[int], texts: tuple[str, ...]) -> None:
    s = chamber(driver)
    s.state.alarms += alarms
    assert s.driver.read().alarms == texts


def test_a_digital_channel_of_ascii2_may_be_an_alarm(chamber: Callable[..., Any]) -> None:
    s = chamber("weiss-ascii2", alarm_channel=7)
    assert s.driver.read().alarms == ()
    s.state.alarms.append(1)
    assert s.driver.read().alarms == ("digital channel 7 is on",)


@pytest.mark.parametrize("driver", ["espec", "weiss-simserv"])
def test_the_narrower_limits_count(chamber: Callable[..., Any], driver: str) -> None:
    s = chamber(driver, min_c=-60, max_c=150)
    s.state.min_c, s.state.max_c = -55.0, 130.0
    assert (s.driver.limits.min_c, s.driver.limits.max_c) == (-55.0, 130.0)
    with pytest.raises(LimitError, match=r"131 deg C lies outside the limits, -55 to 130 deg C"):
        s.driver.set_temperature_c(131.0)
    assert s.state.writes == []


@pytest.mark.parametrize(
    ("driver", "error"),
    [
        ("espec", "refused to set the set point: the value is out of its range"),
        ("weiss-simserv", "refused to set the set point: a parameter is wrong or missing"),
        ("weiss-ascii2", "refused to set the set point: 6"),
        ("thermotron", "refused to set the set point: 3"),
    ],
)
def test_a_refusal_is_one_clear_line(chamber: Callable[..., Any], driver: str, error: str) -> None:
    s = chamber(driver)
    s.driver.limits  # noqa: B018  the controller is asked now
    s.state.max_c = 30.0
    with pytest.raises(RequestRejected, match=rf"^chamber: {error}; check its mode at its panel$"):
        s.driver.set_temperature_c(40.0)


@pytest.mark.parametrize("driver", LINES)
@pytest.mark.parametrize(("kind", "error"), [("silence", NoReply), ("dropped_link", LinkError), ("merge", NoReply)])
def test_every_lasting_fault_names_the_chamber(chamber: Callable[..., Any], driver: str, kind: Any, error: Any) -> None:
    s = chamber(driver)
    s.driver.identify()
    s.wire_faults.arm(kind)
    with pytest.raises(error, match=r"^chamber: .* \(3 tries in "):
        s.driver.read()
    assert s.clock.now_s() < 15
    s.wire_faults.clear()
    assert s.driver.read().setpoint_c == 25.0


@pytest.mark.parametrize("driver", LINES)
@pytest.mark.parametrize("kind", ["silence", "noise", "split", "lost_reply", "dropped_link"])
def test_every_passing_fault_is_survived(chamber: Callable[..., Any], driver: str, kind: Any) -> None:
    s = chamber(driver)
    s.wire_faults.arm(kind, count=2, value=2)
    assert s.driver.set_temperature_c(40.0) == 40.0
    assert s.state.setpoint_c == 40.0


def test_a_late_reply_is_not_taken_for_the_next_answer(chamber: Callable[..., Any]) -> None:
    """SimServ's replies to air and set point look alike; one that comes 1.2 s late must not be read as the other."""
    s = chamber("weiss-simserv")
    s.driver.set_temperature_c(80.0)
    now_s = s.clock.now_s()
    s.wire_faults.arm("merge", from_s=now_s, until_s=now_s + 1.2)
    state = s.driver.read()
    assert state.setpoint_c == 80.0
    assert state.temperature_c < 30.0


def test_a_device_that_sends_without_end(chamber: Callable[..., Any]) -> None:
    s = chamber("espec")
    s.simulated.transmit = lambda _t_s: b"x" * 500
    with pytest.raises(MalformedReply, match=r"the line was never silent|bytes without a line end"):
        s.driver.identify()
    assert s.clock.now_s() < 60


def test_another_device_answers(chamber: Callable[..., Any]) -> None:
    s = chamber("espec")
    s.simulated.answer = lambda request, _t_s: "HTTP/1.1 400 Bad Request"
    with pytest.raises(MalformedReply, match=r"answered 'HTTP/1.1 400 Bad Request' to the request to read its type"):
        s.driver.identify()


def test_a_thermotron_3800_answers_no_command(chamber: Callable[..., Any]) -> None:
    s = chamber("thermotron", acknowledges=False, command_pause_s=1.0)
    assert s.driver.set_temperature_c(85.0) == 85.0
    assert min(b - a for a, b in zip(s.tap.heard_s, s.tap.heard_s[1:], strict=False)) >= 1.0


def test_an_espec_on_rs485_is_called_by_its_number(chamber: Callable[..., Any]) -> None:
    s = chamber("espec", unit=3)
    s.driver.identify()
    assert s.tap.heard[0] == b"3,TYPE?\r\n"


@pytest.mark.parametrize("address", [{"port": None}, {"port": "/dev/ttyUSB0", "host": "10.0.0.7"}])
def test_one_address_is_needed(address: dict[str, str | None]) -> None:
    record = read_bench("single-axis-sim").model_dump()
    record["chamber"] = {"driver": "espec", **address}
    with pytest.raises(ValidationError, match="give either port"):
        resolve(BenchFile.model_validate(record))


def test_a_host_is_reached_by_a_socket() -> None:
    record = read_bench("single-axis-sim").model_dump()
    record["chamber"] = {"driver": "weiss-simserv", "host": "10.0.0.7"}
    settings: Any = resolve(BenchFile.model_validate(record)).chamber
    assert settings.address_url == "socket://10.0.0.7:2049"


@pytest.mark.parametrize("driver", ALL)
def test_what_others_change_at_the_panel_is_in_the_next_reading(chamber: Callable[..., Any], driver: str) -> None:
    s = chamber(driver)
    s.state.setpoint_c = 31.0  # labctl gave none yet
    assert (s.driver.read().given_c, s.driver.read().foreign) == (None, ())
    s.driver.set_temperature_c(40.0)
    assert (s.driver.read().given_c, s.driver.read().foreign) == (40.0, ())
    s.state.setpoint_c = 47.0
    found = s.driver.read()
    assert (found.setpoint_c, found.given_c) == (47.0, 40.0)
    assert found.foreign == ("the set point is 47 deg C, labctl gave 40 deg C",)
    assert s.driver.set_temperature_c(40.0) == 40.0
    assert s.driver.read().foreign == ()


@pytest.mark.parametrize("driver", ["espec", "weiss-simserv", "thermotron"])
def test_a_program_that_somebody_starts_is_in_the_next_reading(chamber: Callable[..., Any], driver: str) -> None:
    s = chamber(driver)
    s.driver.set_temperature_c(40.0)
    s.state.program = True
    (said, *_) = s.driver.read().foreign
    assert said.startswith("a profile is running or held on the controller")
