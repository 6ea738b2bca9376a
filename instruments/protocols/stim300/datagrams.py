"""What a STIM300 says of itself: configuration and serial number (data sheet TS1524 rev. 31, 5.5.2 and 5.5.3)."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Literal

from instruments.protocols.stim300.layouts import (
    AUXILIARY,
    CONFIGURATION,
    PLAIN,
    PPS,
    SERIAL_NUMBER,
    SPECIALS,
    Content,
    content_of,
    crc32_mpeg2,
)

#: Normal-mode commands (section 8); the unit answers by a datagram in place of the next reading.
ASK_CONFIGURATION, ASK_SERIAL_NUMBER, RESET = b"C\r", b"I\r", b"R\r"

OutputUnit = Literal["rate", "incremental", "average", "integrated"]
OUTPUT_UNITS: tuple[OutputUnit, ...] = ("rate", "incremental", "average", "integrated")
DELAYED = 0x08  #: bit of the output unit: gyro and accelerometer delayed alike, which changes no scale
RATE_UNITS = ("rate", "average")  #: deg/s
SAMPLE_RATES_HZ = (125, 250, 500, 1000, 2000)
EXTERNAL_TRIGGER = 5  #: code of the sample rate
BIT_RATES = {0: 374_400, 1: 460_800, 2: 921_600, 3: 1_843_200}
USER_DEFINED = 15  #: code of the bit rate
PARITIES: tuple[Literal["none", "even", "odd"], ...] = ("none", "even", "odd")
ACCELERATION_RANGES_G = {0: 10, 3: 5, 4: 30, 6: 80}
#: Serial number of a unit as it is engraved, and as it is sent: N and 14 digits.
SERIAL_PATTERN = re.compile(r"N?(\d{14})")


@dataclass(frozen=True)
class Configuration:
    """How a unit is set (table 5-16), as far as its readings depend on it."""

    revision: str  #: of the part number
    firmware: int
    sample_rate_hz: int | None  #: None: external trigger
    content: Content
    crlf: bool
    baudrate: int | None  #: None: user-defined
    stop_bits: int
    parity: Literal["none", "even", "odd"]
    axes: str  #: gyro axes that are active
    unit: OutputUnit
    is_delayed: bool
    has_pps: bool  #: a pulse per second; else an auxiliary input
    acceleration_range_g: int | None

    @property
    def datagrams(self) -> tuple[int, ...]:
        """Identifiers that its content may have, the likelier one first."""
        if not self.content.pps:
            return (PLAIN[self.content.index],)
        rows = (PPS, AUXILIARY) if self.has_pps else (AUXILIARY, PPS)
        return tuple(row[self.content.index] for row in rows)


def parse_configuration(frame: bytes) -> Configuration | None:
    """Return the content of an intact configuration datagram without CR LF; None where it is another datagram."""
    if frame[0] not in CONFIGURATION:
        return None
    rate, line, gyro = frame[3], frame[4], frame[5]
    code = rate >> 5
    parity = line >> 1 & 3
    return Configuration(
        revision=chr(frame[1]),
        firmware=frame[2],
        sample_rate_hz=SAMPLE_RATES_HZ[code] if code < len(SAMPLE_RATES_HZ) else None,
        content=Content(bool(rate & 2), bool(rate & 4), bool(rate & 8), bool(rate & 16)),
        crlf=bool(rate & 1),
        baudrate=BIT_RATES.get(line >> 4),
        stop_bits=2 if line & 8 else 1,
        parity=PARITIES[parity] if parity < len(PARITIES) else "none",
        axes="".join(axis for axis, bit in (("x", 0x40), ("y", 0x20), ("z", 0x10)) if gyro & bit),
        unit=OUTPUT_UNITS[gyro & 3],
        is_delayed=bool(gyro & DELAYED),
        has_pps=bool(frame[14] & 8),
        acceleration_range_g=ACCELERATION_RANGES_G.get(frame[17] >> 4),
    )


def parse_serial_number(frame: bytes) -> str | None:
    """Return the serial number, N and 14 digits, of an intact datagram; None where it is another datagram."""
    if frame[0] not in SERIAL_NUMBER:
        return None
    return chr(frame[1]) + frame[2:9].hex()


def configuration_frame(given: Configuration) -> bytes:
    """Return the configuration datagram, with CR LF where it is set so, of a unit that is set as given."""
    rate_hz = given.sample_rate_hz
    code = EXTERNAL_TRIGGER if rate_hz is None else SAMPLE_RATES_HZ.index(rate_hz)
    content = given.content
    body = bytearray(21)
    body[0], body[1] = ord(given.revision), given.firmware
    body[2] = code << 5 | content.pps << 4 | content.temperature << 3 | content.inclination << 2
    body[2] |= content.acceleration << 1 | given.crlf
    bit_rates = {baudrate: number for number, baudrate in BIT_RATES.items()}
    bit_rate = USER_DEFINED if given.baudrate is None else bit_rates.get(given.baudrate, USER_DEFINED)
    body[3] = bit_rate << 4 | (given.stop_bits == 2) << 3 | PARITIES.index(given.parity) << 1 | given.crlf
    body[4] = sum(bit for axis, bit in (("x", 0x40), ("y", 0x20), ("z", 0x10)) if axis in given.axes)
    body[4] |= OUTPUT_UNITS.index(given.unit) | (DELAYED if given.is_delayed else 0)
    body[13] = 8 if given.has_pps else 0
    ranges = {value: number for number, value in ACCELERATION_RANGES_G.items()}
    reach = ranges[given.acceleration_range_g or 10]
    body[16], body[17] = reach << 4 | reach, reach << 4
    return _frame(CONFIGURATION[given.crlf], bytes(body), crlf=given.crlf)


def serial_number_frame(serial: str, *, crlf: bool) -> bytes:
    """Return the datagram of a serial number, N and 14 digits."""
    return _frame(SERIAL_NUMBER[crlf], serial[:1].encode() + bytes.fromhex(serial[1:]) + bytes(7), crlf=crlf)


def _frame(identifier: int, body: bytes, *, crlf: bool) -> bytes:
    covered = bytes([identifier]) + body
    crc = crc32_mpeg2(covered + bytes(SPECIALS[identifier].pad))
    return covered + crc.to_bytes(4, "big") + (b"\r\n" if crlf else b"")


def content_of_datagram(identifier: int) -> tuple[Content, bool]:
    """Return what a datagram holds, and whether its fourth part is a pulse per second, not an auxiliary input."""
    return content_of(identifier), identifier not in AUXILIARY
