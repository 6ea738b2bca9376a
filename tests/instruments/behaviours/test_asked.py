"""Odd behaviours of instruments that answer: each is survived with right values, or said in one right line."""

from __future__ import annotations

import errno
from typing import Any

import pytest
from pymodbus.framer import FramerRTU

from instruments.errors import LinkError, MalformedReply, NoReply, RequestRejected, WrongInstrument
from tests.helpers.odd_devices import (
    LONGEST_S,
    Answer,
    Behaviour,
    Deaf,
    Flood,
    Late,
    Unplugged,
    Wire,
    another_baud_rate,
    answers,
    make_odd,
    noise,
    stand_of,
    through,
)

C4, F4, F4T, ADAM = "arrick-c4", "watlow-f4", "watlow-f4t", "gyrostar"
TRIES = r"\(3 tries in [\d.]+ s\)"


def rtu(body: bytes) -> bytes:
    """Return a Modbus RTU frame."""
    return body + FramerRTU.compute_CRC(body).to_bytes(2, "big")


def other_unit(request: bytes, reply: bytes) -> bytes:
    return rtu(b"\x02" + reply[1:-2])


def on_tcp(change: Any) -> Answer:
    """Return an answer made of the transaction number and the body of the right one."""
    return lambda _, reply: change(reply)


def exception(code: int) -> Any:
    return lambda faults: faults.arm("modbus_exception", value=code)


class Echoes(Wire):
    """Hears what it sends: a line whose adapter echoes."""

    _echo = b""

    def receive(self, data: bytes, t_s: float) -> None:
        self._echo += data
        super().receive(data, t_s)

    def transmit(self, t_s: float) -> bytes:
        echoed, self._echo = self._echo, b""
        return echoed + super().transmit(t_s)

    def next_byte_s(self, t_s: float) -> float | None:
        return t_s if self._echo else super().next_byte_s(t_s)


def fine(found: Any) -> bool:
    return bool(found)


def modbus(driver: str, what: str, unit: int) -> list[Behaviour]:
    """Return what any Modbus instrument may do; `what` is its first request."""
    cannot, refused = f"cannot {what}", f"refused to {what}: Modbus exception"
    bytes_ = r"\d+ bytes arrived that are not a Modbus reply; check line settings and cable"
    serial = driver == F4
    late = (NoReply, f"no answer to {what}; check power, cable and address {unit} {TRIES}")
    return [
        Behaviour(driver, "mute", Deaf, late),
        Behaviour(driver, "always slower than the time-out", lambda wire: Late(wire, 30.0), late),
        Behaviour(driver, "slow", lambda wire: Late(wire, 0.6), gives=fine),
        Behaviour(driver, "in pieces", lambda wire: Late(wire, 0.0, 3, 0.002), gives=fine),
        Behaviour(driver, "garbage", through(noise(3)), (MalformedReply, f"{cannot}, .*; (check|find|set) .* {TRIES}")),
        Behaviour(driver, "unplugged (EIO)", Unplugged, (
            LinkError, f"{cannot}, the link was lost; check cable and power {TRIES}")),
        Behaviour(driver, "does not know the function", faults=exception(1), says=(
            RequestRejected, f"{refused} 1, the instrument does not know the function; check driver and address")),
        Behaviour(driver, "has no such register", faults=exception(2), says=(
            RequestRejected, f"{refused} 2, the instrument has no such register, .*; check model and driver")),
        Behaviour(driver, "fails inside", faults=exception(4), says=(
            RequestRejected, f"{refused} 4, the instrument has an internal failure; read its panel")),
        Behaviour(driver, "is busy for ever", faults=exception(6), says=(
            RequestRejected, f"{refused} 6, the instrument is busy; end its present task")),
        Behaviour(driver, "is busy twice", faults=lambda faults: faults.arm("modbus_exception", value=6, count=2),
                  gives=fine),
        Behaviour(driver, "memory parity error", faults=exception(8), says=(
            RequestRejected, (f"{refused} 8, the instrument has a memory parity error; switch it off "
            "and on, and have it repaired"))),
        Behaviour(driver, "gateway without a path", faults=exception(10), says=(
            RequestRejected, f"{refused} 10, gateway path unavailable; check the gateway's serial port settings")),
        Behaviour(driver, "gateway without a device", faults=exception(11), says=(
            RequestRejected, f"{refused} 11, gateway target device failed to respond; check address, power and cable")),
        Behaviour(driver, "loses one reply", faults=lambda faults: faults.arm("lost_reply", count=1), gives=fine),
        Behaviour(driver, "half of each reply", answers(lambda _, reply: reply[: len(reply) // 2]), (
            MalformedReply, f"{cannot}, {bytes_} {TRIES}")),
        Behaviour(driver, "is another unit", answers(other_unit if serial else on_tcp(
            lambda reply: reply[:6] + b"\x09" + reply[7:])), (
            MalformedReply, f"{cannot}, unit {2 if serial else 9} answered instead of unit {unit}; set address in")),
    ]  # fmt: skip


def http(request: bytes, reply: bytes) -> bytes:
    return b"HTTP/1.1 400 Bad Request\r\nContent-Type: text/html\r\n\r\n"


TCP = [
    (
        "HTTP server instead of Modbus",
        http,
        "an HTTP server answered, not a Modbus instrument; check host and tcp_port",
    ),
    (
        "SSH server instead of Modbus",
        lambda request, _: b"SSH-2.0-OpenSSH_9.2p1\r\n",
        r"text arrived \(SSH-2.0-OpenSSH_9.2p1\) instead of a Modbus reply; check host and",
    ),
    (
        "reply to another request",
        lambda _, reply: b"\x77\x77" + reply[2:],
        r"the reply to request 30583 arrived instead of that to re",
    ),
    (
        "another protocol number",
        lambda _, reply: reply[:2] + b"\0\1" + reply[4:],
        r"the reply has protocol number 1 instead of 0",
    ),
    (
        "a byte too many",
        lambda _, reply: reply + b"U",
        r"the reply belongs to another request; check power, cable and ad",
    ),
    ("another function", lambda _, reply: reply[:7] + bytes([reply[7] ^ 7]) + reply[8:], r".*; check"),
]
FOUND = [
    Behaviour(driver, what, answers(answer), (MalformedReply, f"cannot {first}, {text}"))
    for driver, first in ((F4T, r"read part number \(register 16\)"), (ADAM, r"read module name \(register 210\)"))
    for what, answer, text in TCP
]
SERIAL = [
    Behaviour(F4, "wrong checksum", faults=lambda faults: faults.arm("wrong_crc"), says=(
        MalformedReply, (rf"cannot read .*, \d+ bytes arrived that are not a Modbus reply; check "
        rf"line settings and cable {TRIES}"))),
    Behaviour(F4, "another baud rate", through(another_baud_rate), (
        MalformedReply, (rf"cannot read .*, \d+ bytes arrived that are not a Modbus reply; check "
        rf"line settings and cable {TRIES}"))),
    Behaviour(F4, "echo of the adapter", Echoes, gives=fine),
    Behaviour(F4, "echo of the adapter and no device", answers(lambda request, _: request), (
        NoReply, f"no answer to read .*; check power, cable and address 1 {TRIES}")),
    Behaviour(F4, "zero byte before each reply", answers(lambda _, reply: b"\0" + reply), gives=fine),
    Behaviour(F4, "flood", lambda wire: Flood(wire, b"UUUU"), (
        MalformedReply, (r"labctl sent no request for 20 s, but the line was never silent for .* s; "
        r"find a second Modbus master"))),
    Behaviour(F4, "late once", answers(lambda _, reply: reply, 0.9), gives=fine),
]  # fmt: skip


class RefusesMoves(Wire):
    """Refuses each move, or what comes after it, with a letter that is no `a`."""

    _refused = b""

    def receive(self, data: bytes, t_s: float) -> None:
        if b"m1" in data:
            self._refused = b"e"
        else:
            super().receive(data, t_s)

    def transmit(self, t_s: float) -> bytes:
        refused, self._refused = self._refused, b""
        return refused + super().transmit(t_s)

    def next_byte_s(self, t_s: float) -> float | None:
        return t_s if self._refused else super().next_byte_s(t_s)


def of_table() -> list[Behaviour]:
    """Return what the controller of the table may do."""
    silent = r"sim://arrick gave no answer in 1.0 s; check power, cable and baud rate"
    other = r"sim://arrick answered {}, which is not the answer of a C4 controller; check the name "
    r"of the port and the baud rate$"
    return [
        Behaviour(C4, "mute", Deaf, (NoReply, silent)),
        Behaviour(C4, "always slower than the time-out", lambda wire: Late(wire, 90.0), (NoReply, silent)),
        Behaviour(C4, "slow", lambda wire: Late(wire, 0.3), gives=fine),
        Behaviour(C4, "byte by byte", lambda wire: Late(wire, 0.0, 1, 0.01), gives=fine),
        Behaviour(C4, "garbage", through(noise()), (WrongInstrument, other.format(".*"))),
        Behaviour(C4, "another baud rate", through(another_baud_rate), (WrongInstrument, other.format(".*"))),
        Behaviour(C4, "is another controller", through(lambda data, _: data.replace(b"C4", b"MD")), (
            WrongInstrument, other.format("'MD simulated'"))),
        Behaviour(C4, "echo of what is sent", Echoes, (
            WrongInstrument, (r"sim://arrick answered '!1fp', which is not the answer of a C4 "
            r"controller; the line echoes what labctl sends: switch"))),
        Behaviour(C4, "flood of a", lambda wire: Flood(wire, b"aaaa"), (
            NoReply, ("sim://arrick gave no answer in 1.0 s; letters arrive that answer no command; "
            "find what else sends"))),
        Behaviour(C4, "refuses everything", faults=lambda faults: faults.arm("refusal"), says=(
            WrongInstrument, other.format("'e'"))),
        Behaviour(C4, "refuses a move", RefusesMoves, (
            RequestRejected, r"answered 'e' instead of 'a', so it did not .*; home the table")),
        Behaviour(C4, "unplugged (EIO)", lambda wire: Unplugged(wire, errno.EIO), (
            LinkError, r"the link sim://arrick broke \(\[Errno 5\] Input/output error\); check the cable, then")),
        Behaviour(C4, "unplugged during a run", lambda wire: Unplugged(wire, errno.EIO, 4.0), (
            LinkError, r"the link sim://arrick broke \(\[Errno 5\] Input/output error\); check the cable, then")),
        Behaviour(C4, "ends lines with LF", through(lambda data, _: data.replace(b"\r\n", b"\n")), gives=fine),
        Behaviour(C4, "ends lines with CR", through(lambda data, _: data.replace(b"\r\n", b"\r")), gives=fine),
        Behaviour(C4, "motor stalls", faults=lambda faults: faults.arm("stall"), says=(
            MalformedReply, (r"\d+ steps took [\d.]+ s instead of [\d.]+ s; check speed_template, .* "
            r"motor does not stall"))),
    ]  # fmt: skip


BEHAVIOURS = [
    *of_table(),
    *modbus(F4, "read .*", 1),
    *SERIAL,
    *modbus(F4T, "read part number.*", 1),
    *modbus(ADAM, "read module name.*", 1),
    *FOUND,
]


def use(stand: Any) -> Any:
    """Use an instrument as a campaign does."""
    driver = stand.driver
    who = driver.identify()
    if stand.kind == "table":
        driver.home()
        spin = driver.spin(20.0, 20.0)
        driver.settle(spin)
        return who and not driver.is_moving()
    if stand.kind == "chamber":
        return who and driver.set_temperature_c(30.0) == 30.0 == driver.read().setpoint_c
    driver.start()
    return who and len(driver.read(1.0)) > 0


@pytest.mark.parametrize("behaviour", BEHAVIOURS, ids=str)
def test_an_odd_instrument(behaviour: Behaviour) -> None:
    stand = stand_of(behaviour)
    make_odd(stand, behaviour)
    if behaviour.says is None:
        assert behaviour.gives is not None
        assert behaviour.gives(use(stand))
    else:
        error, text = behaviour.says
        with pytest.raises(error, match=rf"^{stand.driver.name}: {text}") as caught:
            use(stand)
        assert "\n" not in str(caught.value)
        assert stand.clock.now_s() < LONGEST_S + (60 if stand.kind == "table" else 0)
    stand.bench.close()


def test_there_are_at_least_70_distinct_behaviours() -> None:
    assert len(BEHAVIOURS) == len({str(each) for each in BEHAVIOURS}) >= 70
