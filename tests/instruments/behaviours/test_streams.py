"""Odd behaviours of gyros that send by themselves: each is survived with right readings, or said in one right line."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from instruments.errors import LinkError, MalformedReply, NoReply, WrongInstrument
from instruments.interfaces.gyro import Readings
from tests.helpers.odd_devices import (
    LONGEST_S,
    Behaviour,
    Deaf,
    Flood,
    Late,
    Unplugged,
    Wire,
    another_baud_rate,
    make_odd,
    noise,
    stand_of,
    through,
)

SECONDS = 8
STIM, DSP, RD, FORMAT = "stim300", "kvh-dsp3000", "kvh-rd2100", "stream-format"
#: Bytes of a datagram, and of the message of the format's trial.
SIZE = {STIM: 25, DSP: 21, FORMAT: 54}


class Found:
    """What came in SECONDS."""

    def __init__(self, parts: list[Readings], rate_hz: float) -> None:
        self.n = sum(len(part) for part in parts)
        self.lost = sum(part.lost for part in parts)
        self.damaged = sum(part.damaged for part in parts)
        self.wanted = round(SECONDS * rate_hz)
        times = np.concatenate([part.t_s for part in parts])
        self.rises = bool(np.all(np.diff(times) > 0))
        self.valid = np.concatenate([part.valid for part in parts])

    @property
    def is_whole(self) -> bool:
        return abs(self.n - self.wanted) <= 2 and self.lost == self.damaged == 0 and self.rises

    def __repr__(self) -> str:
        return f"{self.n} of {self.wanted} readings, {self.lost} lost, {self.damaged} damaged, times rise: {self.rises}"


def whole(found: Found) -> bool:
    return found.is_whole


def told(found: Found) -> bool:
    """Whether what is missing was counted; half a second may still be on its way."""
    return found.rises and abs(found.n + found.lost + found.damaged - found.wanted) <= 3 + 0.5 * found.wanted / SECONDS


def once(found: Found) -> bool:
    """Whether each reading is there once, and each repetition was dropped."""
    return found.rises and found.lost == 0 and abs(found.n - found.wanted) <= 2 and abs(found.damaged - found.n) <= 2


class Reset(Wire):
    """Is switched off from 4 to 5.5 s, and begins again in the middle of a message."""

    _was_off = False

    def transmit(self, t_s: float) -> bytes:
        data = self.device.transmit(t_s)
        if 4.0 <= t_s < 5.5:
            self._was_off = True
            return b""
        cut, self._was_off = 7 if self._was_off else 0, False
        return data[cut:]


class FirstForEver(Wire):
    """Sends one of its messages all the time, from 3 s on."""

    _first = b""
    size = SIZE[STIM]

    def transmit(self, t_s: float) -> bytes:
        data = self.device.transmit(t_s)
        if t_s < 3.0:
            return data
        self._first = self._first or data[: self.size]
        return self._first * (len(data) // self.size)


class FirstMessageForEver(FirstForEver):
    size = SIZE[FORMAT]


class Echo(Wire):
    """Sends back what it is sent, before what it sends itself."""

    _heard = b""

    def receive(self, data: bytes, t_s: float) -> None:
        self._heard += data
        super().receive(data, t_s)

    def transmit(self, t_s: float) -> bytes:
        echoed, self._heard = self._heard, b""
        return echoed + self.device.transmit(t_s)


def every(driver: str, change: Any) -> Any:
    """Return a wire that changes each whole message."""
    if driver == RD:
        return through(lambda data, _: b"".join(change(line) for line in data.splitlines(keepends=True)))
    size = SIZE[driver]

    def changed(data: bytes, t_s: float) -> bytes:
        del t_s
        if len(data) % size:
            return data  # with an answer of the unit in it
        return b"".join(change(data[at : at + size]) for at in range(0, len(data), size))

    return through(changed)


def line_end(end: bytes) -> Any:
    return through(lambda data, _: data.replace(b"\r\n", end))


def flipped(message: bytes) -> bytes:
    """Change a bit in the middle of a message: its checksum is wrong then."""
    return message[:12] + bytes([message[12] ^ 1]) + message[13:]


def clock_off(ppm: float) -> Any:
    def change(record: Any) -> None:
        units = record["simulation"]["units"]
        name = record["gyros"][0]["name"]
        units[name] = units.get(name, {}) | {"sample_clock_ppm": ppm}

    return change


def device(**settings: Any) -> Any:
    return lambda record: record["simulation"]["units"].update(mems={"device": settings})


def gyro(**keys: Any) -> Any:
    return lambda record: record["gyros"][0].update(keys)


NOTHING, STRANGE = "no bytes arrived; check power, cable and ", r"\d+ bytes arrived that are not readings; check "
WHERE = {
    STIM: r"no intact datagram on sim://\S+ (within|for) [\d.]+ s: {}bit rate 460800, datagram 0x94 and crlf",
    DSP: r"no complete line on sim://\S+ for [\d.]+ s: {}baud rate 38400 and options.pattern",
    RD: r"no complete line on sim://\S+ for [\d.]+ s: {}baud rate 9600 and options.pattern",
    FORMAT: r"no intact Xsens MTi reading on sim://\S+ for [\d.]+ s: {}baud rate 115200 and that the unit sends",
}
BROKE = (
    r"the link sim://\S+ broke \(\[Errno 5\] Input/output error\); check the cable; the stream must be started again"
)


def of_each(driver: str) -> list[Behaviour]:
    """Return what the device of any stream may do."""
    within_ppm, beyond_ppm = (3e3, 2.8e4) if driver == STIM else (3e4, 8e4)  # a crystal, and what a manual allows
    remedy = "by its own crystal the unit sends 125, 250," if driver == STIM else "set sample_rate_hz"
    mute, strange = (NoReply, WHERE[driver].format(NOTHING)), (NoReply, WHERE[driver].format(STRANGE))
    return [
        Behaviour(driver, "mute", through(lambda data, _: b""), mute),
        Behaviour(driver, "mute after a while", through(lambda data, t_s: data if t_s < 3 else b""), mute),
        Behaviour(driver, "garbage", through(noise()), strange),
        Behaviour(driver, "another baud rate", through(another_baud_rate), strange),
        Behaviour(driver, "half of each message", every(driver, lambda each: each[: len(each) // 2]), strange),
        Behaviour(driver, "flood of zeros", lambda wire: Flood(wire, bytes(500)), strange),
        Behaviour(driver, "unplugged (EIO)", lambda wire: Unplugged(wire, from_s=3.0), (LinkError, BROKE)),
        Behaviour(driver, "byte by byte", lambda wire: Late(wire, 0.0, 1, 1e-5), gives=told),
        Behaviour(driver, "half a second late", lambda wire: Late(wire, 0.5), gives=told),
        Behaviour(driver, "echo of what is sent", Echo, gives=lambda found: told(found) and found.damaged <= 1),
        Behaviour(driver, f"clock {within_ppm / 1e4:g} % fast", gives=lambda found: found.lost == 0,
                  changes=clock_off(within_ppm)),
        Behaviour(
            driver, f"clock {beyond_ppm / 1e4:g} % fast", None,
            (WrongInstrument, rf"sends [\d.]+ readings/s on sim://\S+, but the bench file says .*; {remedy}"),
            changes=clock_off(beyond_ppm),
        ),
        Behaviour(driver, "switched off for 1.5 s", Reset, gives=told),
        Behaviour(
            driver, "one damaged message", None, faults=lambda faults: faults.arm("wrong_crc", from_s=3, count=1),
            gives=lambda found: found.damaged == 1 and told(found),
        ),
    ]  # fmt: skip


SET_OTHERWISE = (
    r"the unit on sim://\S+ is not configured as the bench file requires: {}.*; configure the unit in its service mode"
)
STANDS = (
    MalformedReply,
    (
        r"the sample counter on sim://\S+ does not advance: it is \d+ in \d+ successive readings; check "
        r"that the bench file names the right field of the frame as the counter"
    ),
)
SPECIAL = [
    Behaviour(STIM, "sends increments", changes=device(output_unit="incremental"), says=(
        WrongInstrument, SET_OTHERWISE.format("the gyro output unit is INCREMENTAL ANGLE"))),
    Behaviour(STIM, "sends 250 a second", changes=device(sample_rate_hz=250), says=(
        WrongInstrument, SET_OTHERWISE.format("the sample rate is 250"))),
    Behaviour(STIM, "sends another datagram", changes=device(datagram=0xA5), says=(
        WrongInstrument, SET_OTHERWISE.format("the datagram is 0xA5 instead of 0x94"))),
    Behaviour(STIM, "is another unit", changes=lambda record: (
        gyro(serial="N25582018000013")(record), device(serial="N25582018000014")(record)), says=(
        WrongInstrument, (r"the unit on \S+ has serial number N25582018000014, but the bench file or "
        r"the campaign names N2"))),
    Behaviour(STIM, "hears nothing", Deaf, (
        NoReply, r"sends datagrams on sim://\S+ but does not answer the commands C and I within 1.5 s; check")),
    Behaviour(STIM, "wrong checksum in each", every(STIM, flipped), (NoReply, WHERE[STIM].format(STRANGE))),
    Behaviour(FORMAT, "wrong checksum in each", every(FORMAT, flipped), (NoReply, WHERE[FORMAT].format(STRANGE))),
    Behaviour(STIM, "counter that stands", FirstForEver, STANDS),
    Behaviour(FORMAT, "counter that stands", FirstMessageForEver, STANDS),
    Behaviour(STIM, "each message twice", every(STIM, lambda each: 2 * each), gives=once),
    Behaviour(FORMAT, "each message twice", every(FORMAT, lambda each: 2 * each), gives=once),
    Behaviour(STIM, "zero byte before each", every(STIM, lambda each: b"\0" + each), gives=lambda found: (
        found.lost == 0 and abs(found.n - found.wanted) <= 2 and found.damaged < 0.05 * found.n)),
    Behaviour(FORMAT, "zero byte before each", every(FORMAT, lambda each: b"\0" + each), gives=lambda found: (
        found.lost == 0 and abs(found.n - found.wanted) <= 2 and found.damaged < 0.05 * found.n)),
    Behaviour(STIM, "gap in the counter", faults=lambda faults: faults.arm("counter_gap", from_s=3, count=1, value=5),
              gives=lambda found: found.lost == 5 and told(found)),
    Behaviour(FORMAT, "gap in the counter", faults=lambda given: given.arm("counter_gap", from_s=3, count=1, value=5),
              gives=lambda found: found.lost == 5 and told(found)),
    Behaviour(DSP, "marks each reading bad", every(DSP, lambda line: line[:18] + b"0\r\n"), gives=lambda found: (
        found.is_whole and not found.valid.any())),
    Behaviour(DSP, "ends lines with LF", line_end(b"\n"), gives=whole),
    Behaviour(DSP, "ends lines with LF CR", line_end(b"\n\r"), gives=whole),
    Behaviour(DSP, "ends lines with CR", line_end(b"\r"), (NoReply, WHERE[DSP].format(STRANGE))),
    Behaviour(DSP, "ends no line", line_end(b""), (NoReply, WHERE[DSP].format(STRANGE))),
    Behaviour(DSP, "empty lines between", line_end(b"\r\n\r\n"), gives=whole),
    Behaviour(DSP, "decimal commas", through(lambda data, _: data.replace(b".", b",")), (
        NoReply, WHERE[DSP].format(STRANGE))),
    Behaviour(RD, "text between the lines", through(lambda data, _: data.replace(b"\r\n", b"\r\nREADY\r\n", 1)),
              gives=lambda found: found.n == found.wanted or told(found)),
]  # fmt: skip
BEHAVIOURS = [each for driver in (STIM, DSP, RD, FORMAT) for each in of_each(driver)] + SPECIAL


@pytest.mark.parametrize("behaviour", BEHAVIOURS, ids=str)
def test_an_odd_gyro(behaviour: Behaviour) -> None:
    stand = stand_of(behaviour)
    driver = stand.driver
    make_odd(stand, behaviour)

    def listen() -> Found:
        driver.identify()
        driver.start()
        driver.read_latest()
        return Found([driver.read(0.5) for _ in range(2 * SECONDS)], driver.sample_rate_hz)

    if behaviour.says is None:
        assert behaviour.gives is not None
        found = listen()
        assert behaviour.gives(found), found
    else:
        error, text = behaviour.says
        with pytest.raises(error, match=rf"^{driver.name}: {text}") as caught:
            listen()
        assert "\n" not in str(caught.value)
        assert stand.clock.now_s() < LONGEST_S
    stand.bench.close()


def test_there_are_at_least_60_distinct_behaviours() -> None:
    assert len(BEHAVIOURS) == len({str(each) for each in BEHAVIOURS}) >= 60
